//! The work–precision picture: error against time, one panel per case.

use std::path::{Path, PathBuf};

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::failure::Failure;
use crate::output::chart;
use endowire_lab::compare::Row;
use endowire_lab::studies::CANDIDATES;

/// Size in pixels.
const SIZE: (u32, u32) = (1650, 1060);

/// Titles of the panels.
const TITLES: [(&str, &str); 5] = [
    ("cantilever-1", "cantilever, PL²/EI = 1"),
    ("cantilever-10", "cantilever, PL²/EI = 10"),
    ("soft-tube", "wire into a soft-walled bend"),
    ("curved-tube", "insertion into the curved tube"),
    ("arch", "insertion into the aortic arch"),
];

/// Rows and their cases.
struct Picture<'a> {
    rows: &'a [Row],
    cases: &'a [(&'static str, &'static str, f64)],
}

/// Writes compare.svg and compare.png.
pub(super) fn write(
    folder: &Path,
    rows: &[Row],
    cases: &[(&'static str, &'static str, f64)],
) -> Result<Vec<PathBuf>, Failure> {
    chart::write(folder, "compare", SIZE, &Picture { rows, cases })
}

/// Colour and marker of a method: ours stands out, and the others are distinguishable without colour too.
fn style(method: &str) -> (RGBColor, usize, u32) {
    let index = CANDIDATES.iter().position(|name| *name == method).unwrap_or(0);
    let width = if index == 0 { 4 } else { 2 };
    (chart::COLOURS[index % chart::COLOURS.len()], index, width)
}

impl chart::Chart for Picture<'_> {
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>) -> chart::Drawn<B> {
        let columns = if self.cases.len() > 3 { 3 } else { self.cases.len().max(1) };
        let panels = root.split_evenly(((self.cases.len() + 1).div_ceil(columns), columns));
        for ((name, unit, _), panel) in self.cases.iter().zip(&panels) {
            panel_of(panel, name, unit, self.rows)?;
        }
        panels.get(self.cases.len()).map_or(Ok(()), |panel| legend(panel, self.rows))
    }
}

/// Rows with a result, as (time in ms, error).
fn points<'a>(rows: &'a [Row], case: &str, method: &str) -> Vec<(f64, f64)> {
    let own = rows.iter().filter(|row: &&'a Row| row.case == case && row.method == method);
    own.filter_map(|row| Some((1e3 * row.time_s?, row.error.filter(|e| e.is_finite() && *e > 0.0)?)))
        .collect()
}

fn panel_of<B: DrawingBackend>(
    panel: &DrawingArea<B, Shift>,
    case: &str,
    unit: &str,
    rows: &[Row],
) -> chart::Drawn<B> {
    let all: Vec<(f64, f64)> = CANDIDATES.iter().flat_map(|method| points(rows, case, method)).collect();
    if all.is_empty() {
        return Ok(());
    }
    let title = TITLES.iter().find(|(name, _)| *name == case).map_or(case, |(_, title)| title);
    let range = |value: fn(&(f64, f64)) -> f64| {
        let (low, high) = all.iter().map(value).fold((f64::MAX, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
        (low / 2.0)..(high * 2.0)
    };
    let quantity = if unit == "L" { "error of the tip, part of the length" } else { "error, mm" };
    let mut plot = ChartBuilder::on(panel)
        .caption(title, chart::font(22))
        .margin(12)
        .x_label_area_size(46)
        .y_label_area_size(70)
        .build_cartesian_2d(range(|p| p.0).log_scale(), range(|p| p.1).log_scale())?;
    plot.configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(225, 225, 225))
        .x_desc("time, ms")
        .y_desc(quantity)
        .label_style(chart::font(15))
        .axis_desc_style(chart::font(17))
        .x_label_formatter(&chart::power)
        .y_label_formatter(&chart::power)
        .draw()?;
    // Ours is drawn last, on top.
    for method in CANDIDATES.iter().rev() {
        let (colour, mark, width) = style(method);
        let line = points(rows, case, method);
        plot.draw_series(LineSeries::new(line.clone(), colour.stroke_width(width)))?;
        match mark {
            0 => plot.draw_series(line.iter().map(|p| Circle::new(*p, 6, colour.filled())))?,
            m if m % 3 == 0 => plot.draw_series(line.iter().map(|p| Circle::new(*p, 5, colour.filled())))?,
            m if m % 3 == 1 => {
                plot.draw_series(line.iter().map(|p| TriangleMarker::new(*p, 7, colour.filled())))?
            }
            _ => plot.draw_series(line.iter().map(|p| Cross::new(*p, 5, colour.stroke_width(2))))?,
        };
    }
    Ok(())
}

fn legend<B: DrawingBackend>(panel: &DrawingArea<B, Shift>, rows: &[Row]) -> chart::Drawn<B> {
    let (x, mut y) = (70, 70);
    for method in CANDIDATES {
        if !rows.iter().any(|row| row.method == method) {
            continue;
        }
        let (colour, mark, width) = style(method);
        panel.draw(&PathElement::new([(x, y), (x + 60, y)], colour.stroke_width(width)))?;
        match mark % 3 {
            0 => panel.draw(&Circle::new((x + 30, y), 6, colour.filled()))?,
            1 => panel.draw(&TriangleMarker::new((x + 30, y), 7, colour.filled()))?,
            _ => panel.draw(&Cross::new((x + 30, y), 5, colour.stroke_width(2)))?,
        }
        panel.draw(&Text::new(method, (x + 80, y - 11), chart::font(20)))?;
        y += 40;
    }
    for line in ["left and down is better;", "every mark is a resolution"] {
        panel.draw(&Text::new(line, (x, y + 6), chart::font(17).color(&RGBColor(90, 90, 90))))?;
        y += 24;
    }
    Ok(())
}
