//! Charts as SVG and PNG, identical on every machine: the font is part of the program.

use std::path::Path;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use super::whole;
use crate::failure::Failure;

/// Result of drawing on a backend.
pub(crate) type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// Colours that are distinguishable with any colour vision (Okabe and Ito 2008), two greys, black and brown.
pub(crate) const COLOURS: [RGBColor; 11] = [
    RGBColor(0, 90, 160),
    RGBColor(90, 90, 90),
    RGBColor(160, 160, 160),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(120, 60, 110),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(20, 20, 20),
    RGBColor(130, 90, 60),
];

const FAMILY: &str = "sans-serif";

/// The font of all charts.
pub(crate) fn font(size: u32) -> TextStyle<'static> {
    (FAMILY, size).into_font().color(&RGBColor(30, 30, 30))
}

/// Label of a logarithmic axis.
pub(crate) fn power(value: &f64) -> String {
    // The axis computes powers of ten with rounding errors.
    if (0.009..9e3).contains(value) {
        format!("{}", (value * 1e4).round() / 1e4)
    } else {
        format!("1e{}", value.log10().round())
    }
}

/// A chart that can draw itself on any backend.
pub(crate) trait Chart {
    /// Draws on `root`, which is white.
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>) -> Drawn<B>;
}

/// Draws a chart to two files in `folder`: NAME.svg and NAME.png.
#[cfg(feature = "lab")]
pub(crate) fn write(
    folder: &Path,
    name: &str,
    size: (u32, u32),
    chart: &impl Chart,
) -> Result<Vec<std::path::PathBuf>, Failure> {
    let paths = ["svg", "png"].map(|extension| folder.join(format!("{name}.{extension}")));
    paths.iter().try_for_each(|path| write_file(path, size, chart))?;
    Ok(paths.into())
}

/// Draws a chart to a file, SVG or PNG by its extension.
pub(crate) fn write_file(path: &Path, size: (u32, u32), chart: &impl Chart) -> Result<(), Failure> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("svg") => whole::write_bytes(path, svg(size, chart)?.as_bytes()),
        Some("png") => {
            register();
            let mut pixels = vec![0; 3 * (size.0 * size.1) as usize];
            draw(BitMapBackend::with_buffer(&mut pixels, size), chart)?;
            write_png(path, size, &pixels)
        }
        _ => return Err(Failure::Input(format!("--out {}: name a file .svg or .png", path.display()))),
    }
    .map_err(|e| Failure::write(path, &e))
}

/// The chart as the text of an SVG file.
pub(crate) fn svg(size: (u32, u32), chart: &impl Chart) -> Result<String, Failure> {
    register();
    let mut text = String::new();
    draw(SVGBackend::with_string(&mut text, size), chart)?;
    Ok(text)
}

/// Makes the font known to the drawing library.
fn register() {
    static FONT: Once = Once::new();
    FONT.call_once(|| {
        // Fails only for an invalid font, and this one is part of the program.
        let _ = register_font(FAMILY, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    });
}

/// Draws on a backend and completes its output.
fn draw<B: DrawingBackend>(backend: B, chart: &impl Chart) -> Result<(), Failure> {
    let root = backend.into_drawing_area();
    root.fill(&WHITE)
        .and_then(|()| chart.draw(&root))
        .and_then(|()| root.present())
        .map_err(|e| Failure::Computation(format!("the chart cannot be drawn: {e}")))
}

/// Writes an RGB picture of three bytes per pixel.
pub(crate) fn write_png(path: &Path, size: (u32, u32), rgb: &[u8]) -> std::io::Result<()> {
    whole::write(path, |file| {
        let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), size.0, size.1);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(rgb)?;
        writer.finish()?;
        Ok(())
    })
}
