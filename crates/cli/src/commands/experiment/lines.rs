//! One chart of lines with their names beside them: what an experiment has measured, and what the paper has.

use std::path::{Path, PathBuf};

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::failure::Failure;
use crate::output::chart;

/// Size in pixels.
const SIZE: (u32, u32) = (1000, 600);
/// Part of a logarithmic axis that is left free before the first and after the last value.
const LOG_ROOM: f64 = 1.4;

/// A line: name, points, and whether it is the paper's, which is drawn in grey.
pub(super) struct Line {
    pub(super) name: String,
    pub(super) points: Vec<(f64, f64)>,
    pub(super) paper: bool,
}

/// A chart of lines.
pub(super) struct Lines {
    pub(super) title: &'static str,
    pub(super) across: &'static str,
    pub(super) up: &'static str,
    /// Whether both axes are logarithmic.
    pub(super) logarithmic: bool,
    pub(super) lines: Vec<Line>,
}

impl Lines {
    /// Draws FOLDER/NAME.svg and .png.
    pub(super) fn write(&self, folder: &Path, name: &str) -> Result<Vec<PathBuf>, Failure> {
        std::fs::create_dir_all(folder).map_err(|e| Failure::write(folder, &e))?;
        chart::write(folder, name, SIZE, self)
    }

    /// Least and largest of one coordinate over all lines.
    fn range(&self, value: fn(&(f64, f64)) -> f64) -> (f64, f64) {
        let all = self.lines.iter().flat_map(|line| line.points.iter().map(value));
        all.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)))
    }
}

/// Draws mesh, lines and names on a chart with either kind of axes.
macro_rules! draw_on {
    ($self:ident, $plot:ident, $format:expr) => {{
        let mut mesh = $plot.configure_mesh();
        mesh.light_line_style(WHITE)
            .bold_line_style(RGBColor(225, 225, 225))
            .x_desc($self.across)
            .y_desc($self.up)
            .label_style(chart::font(15))
            .axis_desc_style(chart::font(17))
            .x_label_formatter($format)
            .y_label_formatter($format);
        mesh.draw()?;
        // Colours that stand out, for what is measured.
        let mut colours = [0, 5, 6, 7, 8, 9, 10].into_iter().cycle().map(|k: usize| chart::COLOURS[k]);
        for line in &$self.lines {
            let colour = if line.paper { chart::COLOURS[3] } else { colours.next().unwrap_or(BLACK) };
            let (width, points) = (if line.paper { 2 } else { 3 }, line.points.clone());
            $plot.draw_series(LineSeries::new(points.clone(), colour.stroke_width(width)))?;
            if points.len() < 100 {
                $plot.draw_series(points.iter().map(|p| Circle::new(*p, 4, colour.filled())))?;
            }
            // The chart calls for its legend after it is drawn.
            $plot
                .draw_series(std::iter::once(PathElement::new(Vec::new(), colour)))?
                .label(line.name.clone())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 22, y)], colour.stroke_width(3)));
        }
        $plot
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.8))
            .label_font(chart::font(16))
            .draw()?;
        Ok(())
    }};
}

impl chart::Chart for Lines {
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>) -> chart::Drawn<B> {
        let ((left, right), (low, high)) = (self.range(|p| p.0), self.range(|p| p.1));
        if left > right {
            return Ok(());
        }
        let mut chart = ChartBuilder::on(root);
        chart.caption(self.title, chart::font(22)).margin(14).x_label_area_size(48).y_label_area_size(72);
        if self.logarithmic {
            let across = (left / LOG_ROOM..right * LOG_ROOM).log_scale();
            let up = (low / LOG_ROOM..high * LOG_ROOM).log_scale();
            let mut plot = chart.build_cartesian_2d(across, up)?;
            draw_on!(self, plot, &chart::power)
        } else {
            let number = |value: &f64| format!("{}", (value * 1e6).round() / 1e6);
            let mut plot = chart.build_cartesian_2d(left..right, low.min(0.0)..1.1 * high)?;
            draw_on!(self, plot, &number)
        }
    }
}
