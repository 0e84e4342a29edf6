//! Curves in panels side by side, with one legend below: the picture of a bench test or a study.

use plotters::coord::Shift;
use plotters::coord::combinators::LogCoord;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

use super::chart::{self, Drawn};

/// Height of the title, of a line of the legend, and of a line of the footnote, pixels.
const TITLE_PX: u32 = 62;
const LEGEND_PX: u32 = 34;
const NOTE_PX: u32 = 28;
/// Height of the panels, pixels.
const PANEL_PX: u32 = 560;
/// Width of a picture with one panel, and of each panel of several, pixels.
const ALONE_PX: u32 = 1120;
const PANEL_WIDTH_PX: u32 = 760;
/// Margin left of titles and legends, pixels.
const MARGIN_PX: i32 = 26;
/// Colour of what is beside the curves.
const GREY: RGBColor = RGBColor(90, 90, 90);
/// Background of bands.
const BAND: RGBColor = RGBColor(238, 241, 245);

/// Order of colours of [`chart::COLOURS`] that are distinguished best, without greys.
const ORDER: [usize; 9] = [0, 3, 4, 5, 7, 8, 6, 10, 9];

/// Colour of the curve number `index`.
pub(crate) fn colour(index: usize) -> RGBColor {
    chart::COLOURS[ORDER[index % ORDER.len()]]
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stroke {
    Solid,
    Dashed,
    /// Points alone.
    Dots,
}

/// A curve.
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    pub(crate) colour: RGBColor,
    pub(crate) stroke: Stroke,
    pub(crate) points: Vec<[f64; 2]>,
}

/// The scale of a vertical axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Scale {
    Linear,
    Logarithmic,
}

/// A stretch of the horizontal axis with a caption.
#[derive(Debug, Clone)]
pub(crate) struct Band {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) caption: String,
}

/// Curves over a common axis.
#[derive(Debug, Clone)]
pub(crate) struct Panel {
    pub(crate) title: String,
    /// Names of the axes, with units.
    pub(crate) across: String,
    pub(crate) up: String,
    pub(crate) scale: Scale,
    pub(crate) curves: Vec<Curve>,
    pub(crate) bands: Vec<Band>,
}

/// An entry of the legend.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) name: String,
    pub(crate) colour: RGBColor,
    pub(crate) stroke: Stroke,
}

/// A picture of panels.
#[derive(Debug, Clone)]
pub(crate) struct Curves {
    pub(crate) title: String,
    pub(crate) panels: Vec<Panel>,
    pub(crate) legend: Vec<Entry>,
    /// Lines below the legend.
    pub(crate) notes: Vec<String>,
}

impl Curves {
    /// Size of the picture in pixels.
    pub(crate) fn size(&self) -> (u32, u32) {
        let width = if self.panels.len() > 1 { PANEL_WIDTH_PX * self.panels.len() as u32 } else { ALONE_PX };
        (width, TITLE_PX + PANEL_PX + self.below_px())
    }

    fn below_px(&self) -> u32 {
        LEGEND_PX * self.legend.len() as u32 + NOTE_PX * self.notes.len() as u32 + 18
    }
}

impl chart::Chart for Curves {
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>) -> Drawn<B> {
        let (head, rest) = root.split_vertically(TITLE_PX);
        head.draw(&Text::new(self.title.clone(), (MARGIN_PX, 20), chart::font(30)))?;
        let (panels, below) = rest.split_vertically(PANEL_PX);
        for (panel, area) in self.panels.iter().zip(panels.split_evenly((1, self.panels.len().max(1)))) {
            match panel.scale {
                Scale::Linear => {
                    let [low, high] = range(panel, 1, 0.06);
                    let up: RangedCoordf64 = (low..high).into();
                    draw_panel(&area, panel, [low, high], up, &linear_label(high - low))?;
                }
                Scale::Logarithmic => {
                    let [low, high] = decades(panel);
                    let up: LogCoord<f64> = (low..high).log_scale().into();
                    draw_panel(&area, panel, [low, high], up, &chart::power)?;
                }
            }
        }
        let mut y = 16;
        for entry in &self.legend {
            draw_stroke(&below, entry, y)?;
            below.draw(&Text::new(entry.name.clone(), (MARGIN_PX + 84, y - 11), chart::font(22)))?;
            y += LEGEND_PX as i32;
        }
        for note in &self.notes {
            below.draw(&Text::new(note.clone(), (MARGIN_PX, y - 8), chart::font(19).color(&GREY)))?;
            y += NOTE_PX as i32;
        }
        Ok(())
    }
}

fn draw_stroke<B: DrawingBackend>(area: &DrawingArea<B, Shift>, entry: &Entry, y: i32) -> Drawn<B> {
    let ends = [(MARGIN_PX, y), (MARGIN_PX + 66, y)];
    let style = entry.colour.stroke_width(4);
    match entry.stroke {
        Stroke::Solid => area.draw(&PathElement::new(ends, style)),
        Stroke::Dots => area.draw(&Circle::new((MARGIN_PX + 33, y), 6, entry.colour.filled())),
        Stroke::Dashed => area.draw(&DashedPathElement::new(ends, 10, 7, style)),
    }
}

/// Least and largest value of a panel along an axis, with some room; of a vertical axis with zero.
fn range(panel: &Panel, axis: usize, room: f64) -> [f64; 2] {
    let values = panel.curves.iter().flat_map(|curve| &curve.points).map(|point| point[axis]);
    let (mut low, mut high) =
        values.filter(|v| v.is_finite()).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        (low, high) = (0.0, 1.0);
    }
    if axis == 1 {
        (low, high) = (low.min(0.0), high.max(0.0));
    }
    // A curve that is zero throughout lies on the axis, not in the middle.
    if high - low < 1e-9 {
        high = low + 1.0;
    }
    let room = room * (high - low);
    [if low < 0.0 { low - room } else { low }, high + room]
}

/// Whole decades around the positive values of a panel.
fn decades(panel: &Panel) -> [f64; 2] {
    let values = panel.curves.iter().flat_map(|curve| &curve.points).map(|point| point[1]);
    let (low, high) = values
        .filter(|v| v.is_finite() && *v > 0.0)
        .fold((f64::MAX, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return [1.0, 10.0];
    }
    // Half a decade below and above where the values nearly reach the next.
    [10f64.powf((low.log10() - 0.1).floor()), 10f64.powf((high.log10() + 0.1).ceil())]
}

/// Labels of a linear axis of this length: as many decimals as its ticks need.
fn linear_label(length: f64) -> impl Fn(&f64) -> String {
    let decimals = (1.0 - length.log10()).ceil().clamp(0.0, 6.0) as usize;
    move |value| {
        let text = format!("{value:.decimals$}");
        // No negative zero, and no zeros that say nothing.
        if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') { "0".to_owned() } else { text }
    }
}

fn draw_panel<B: DrawingBackend, Y>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
    [low, high]: [f64; 2],
    up: Y,
    label: &dyn Fn(&f64) -> String,
) -> Drawn<B>
where
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let [first, last] = range(panel, 0, 0.0);
    let mut plot = ChartBuilder::on(area)
        .caption(panel.title.clone(), chart::font(24))
        .margin(14)
        .margin_right(28)
        .x_label_area_size(58)
        .y_label_area_size(92)
        .build_cartesian_2d(first..last, up)?;
    for band in &panel.bands {
        let stripe = [(band.from, low), (band.to, high)];
        plot.draw_series([Rectangle::new(stripe, BAND.filled())])?;
    }
    let across = linear_label(last - first);
    plot.configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(214, 219, 225))
        .x_labels(9)
        .y_labels(8)
        .x_desc(panel.across.clone())
        .y_desc(panel.up.clone())
        .label_style(chart::font(18))
        .axis_desc_style(chart::font(20))
        .x_label_formatter(&across)
        .y_label_formatter(&label)
        .draw()?;
    for curve in &panel.curves {
        let points =
            curve.points.iter().map(|&[x, y]| (x, y)).filter(|(x, y)| x.is_finite() && y.is_finite());
        let style = curve.colour.stroke_width(3);
        match curve.stroke {
            Stroke::Dots => {
                let dot = |point| Circle::new(point, 6, curve.colour.filled());
                plot.draw_series(points.map(dot)).map(drop)?;
            }
            Stroke::Solid => plot.draw_series(LineSeries::new(points, style)).map(drop)?,
            Stroke::Dashed => plot.draw_series(DashedLineSeries::new(points, 9, 6, style)).map(drop)?,
        }
    }
    for band in &panel.bands {
        // Captions stand at the upper edge, inside their band.
        let at = plot.backend_coord(&(0.5 * (band.from + band.to), high));
        let style = chart::font(17).color(&GREY).pos(plotters::style::text_anchor::Pos::new(
            plotters::style::text_anchor::HPos::Center,
            plotters::style::text_anchor::VPos::Top,
        ));
        let at = (at.0 - area.get_base_pixel().0, at.1 - area.get_base_pixel().1 + 6);
        area.draw(&Text::new(band.caption.clone(), at, style))?;
    }
    Ok(())
}
