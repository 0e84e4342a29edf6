//! A line chart with a legend: results of an experiment and of the paper.

use std::path::{Path, PathBuf};

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::failure::Failure;
use crate::output::chart;

/// Size in pixels.
const SIZE: (u32, u32) = (1150, 600);
/// Width of the legend and height of its rows, in pixels.
const LEGEND: (i32, i32) = (270, 26);
/// Margin factor of a logarithmic axis before the first and after the last value.
const LOG_ROOM: f64 = 1.4;
/// Amount by which each line of a method is lighter than the previous one.
const LIGHTER: f64 = 0.32;
/// Lines with fewer points have a marker at each.
const MARKED: usize = 60;
/// Name of the method for lines from the paper, which are grey.
pub(super) const PAPER: &str = "Li et al. 2011";
/// Indices in [`chart::COLOURS`] for the paper and for the methods in order of their lines.
const COLOURS: [usize; 8] = [1, 0, 3, 4, 6, 7, 5, 8];

/// A line: the method, which determines its colour, a further label, and its points.
pub(super) struct Line {
    pub(super) method: String,
    pub(super) of: String,
    pub(super) points: Vec<(f64, f64)>,
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

    /// Smallest and largest value of one coordinate over all lines.
    fn range(&self, value: fn(&(f64, f64)) -> f64) -> (f64, f64) {
        let all = self.lines.iter().flat_map(|line| line.points.iter().map(value));
        all.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)))
    }

    /// The lines with their colours.
    fn coloured(&self) -> Vec<(&Line, RGBAColor)> {
        let mut seen = vec![(PAPER, 0)];
        let mut coloured = Vec::new();
        for line in &self.lines {
            let method = seen.iter().position(|(name, _)| *name == line.method).unwrap_or_else(|| {
                seen.push((&line.method, 0));
                seen.len() - 1
            });
            let strength = (1.0 - LIGHTER * f64::from(seen[method].1)).max(LIGHTER);
            seen[method].1 += 1;
            coloured.push((line, chart::COLOURS[COLOURS[method % COLOURS.len()]].mix(strength)));
        }
        coloured
    }
}

/// Draws mesh and lines on a chart with either kind of axes.
macro_rules! draw_on {
    ($self:ident, $plot:ident, $format:expr) => {{
        let mut mesh = $plot.configure_mesh();
        mesh.light_line_style(WHITE)
            .bold_line_style(RGBColor(225, 225, 225))
            .x_desc($self.across)
            .y_desc($self.up)
            .x_labels(6)
            .label_style(chart::font(15))
            .axis_desc_style(chart::font(17))
            .x_label_formatter($format)
            .y_label_formatter($format);
        mesh.draw()?;
        for (line, colour) in $self.coloured() {
            $plot.draw_series(LineSeries::new(line.points.clone(), colour.stroke_width(3)))?;
            if line.points.len() < MARKED {
                $plot.draw_series(line.points.iter().map(|p| Circle::new(*p, 4, colour.filled())))?;
            }
        }
    }};
}

impl chart::Chart for Lines {
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>) -> chart::Drawn<B> {
        let ((left, right), (low, high)) = (self.range(|p| p.0), self.range(|p| p.1));
        if left > right {
            return Ok(());
        }
        let (plane, legend) = root.split_horizontally(SIZE.0 as i32 - LEGEND.0);
        let mut chart = ChartBuilder::on(&plane);
        chart.caption(self.title, chart::font(22)).margin(14).x_label_area_size(48).y_label_area_size(72);
        if self.logarithmic {
            let across = (left / LOG_ROOM..right * LOG_ROOM).log_scale();
            let up = (low / LOG_ROOM..high * LOG_ROOM).log_scale();
            let mut plot = chart.build_cartesian_2d(across, up)?;
            draw_on!(self, plot, &chart::power);
        } else {
            let number = |value: &f64| format!("{}", (value * 1e6).round() / 1e6);
            let mut plot = chart.build_cartesian_2d(left..right, low.min(0.0)..1.1 * high)?;
            draw_on!(self, plot, &number);
        }
        let mut y = 3 * LEGEND.1;
        for (line, colour) in self.coloured() {
            legend.draw(&PathElement::new([(0, y), (22, y)], colour.stroke_width(4)))?;
            let name = format!("{} {}", line.method, line.of);
            legend.draw(&Text::new(name, (30, y - 9), chart::font(16)))?;
            y += LEGEND.1;
        }
        Ok(())
    }
}
