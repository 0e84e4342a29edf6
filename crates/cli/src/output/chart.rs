//! Charts as SVG and PNG, the same on every machine: the font is in the program.

use std::path::{Path, PathBuf};
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use crate::failure::Failure;

/// What drawing on a backend returns.
pub(crate) type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// Colours that people with any colour vision can tell apart (Okabe and Ito 2008), and three greys.
pub(crate) const COLOURS: [RGBColor; 9] = [
    RGBColor(0, 90, 160),
    RGBColor(90, 90, 90),
    RGBColor(160, 160, 160),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(120, 60, 110),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

const FAMILY: &str = "sans-serif";

/// The font of all charts.
pub(crate) fn font(size: u32) -> TextStyle<'static> {
    (FAMILY, size).into_font().color(&RGBColor(30, 30, 30))
}

/// A label of a logarithmic axis.
pub(crate) fn power(value: &f64) -> String {
    // The axis computes its powers of ten with rounding.
    if (0.009..9e3).contains(value) {
        format!("{}", (value * 1e4).round() / 1e4)
    } else {
        format!("1e{}", value.log10().round())
    }
}

/// A chart that draws itself on any backend.
pub(crate) trait Chart {
    /// Draws on `root`, which is white.
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>) -> Drawn<B>;
}

/// Draws one chart into `folder` twice: NAME.svg and NAME.png.
pub(crate) fn write(
    folder: &Path,
    name: &str,
    size: (u32, u32),
    chart: &impl Chart,
) -> Result<Vec<PathBuf>, Failure> {
    static FONT: Once = Once::new();
    FONT.call_once(|| {
        // Only a font that cannot be read is refused, and this one is part of the program.
        let _ = register_font(FAMILY, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    });
    let failed =
        |e: &dyn std::fmt::Display| Failure::Computation(format!("the chart {name} cannot be drawn: {e}"));
    let (svg, png) = (folder.join(format!("{name}.svg")), folder.join(format!("{name}.png")));
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(|e| failed(&e))?;
        chart.draw(&root).map_err(|e| failed(&e))?;
        root.present().map_err(|e| failed(&e))?;
    }
    std::fs::write(&svg, text).map_err(|e| Failure::write(&svg, &e))?;
    let mut pixels = vec![0; 3 * (size.0 * size.1) as usize];
    {
        let root = BitMapBackend::with_buffer(&mut pixels, size).into_drawing_area();
        root.fill(&WHITE).map_err(|e| failed(&e))?;
        chart.draw(&root).map_err(|e| failed(&e))?;
        root.present().map_err(|e| failed(&e))?;
    }
    write_png(&png, size, &pixels).map_err(|e| Failure::write(&png, &e))?;
    Ok(vec![svg, png])
}

fn write_png(path: &Path, size: (u32, u32), rgb: &[u8]) -> std::io::Result<()> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, size.0, size.1);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()?;
    Ok(())
}
