//! Picture of the way of a device through a vessel, coloured by clearance, beside plots of clearance and bends along
//! it.

use std::path::Path;

use endowire_core::passable::{Passable, WayPoint};
use endowire_core::vessel::SurfaceMesh;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::glass::{Glass, Side};
use crate::failure::Failure;
use crate::output::chart::{self, COLOURS};

/// A radius plotted as a curve, mm.
type Radius = fn(&WayPoint) -> f64;

/// Size in pixels, and the parts of it for the vessel on the left and the legend below it.
const SIZE: (u32, u32) = (1700, 1000);
const VESSEL_PX: i32 = 760;
const LEGEND_PX: i32 = 150;
const TITLE_PX: i32 = 60;
/// Clearances, in radii of the device, and their colours: none, tight, as much as the device is thick, plenty.
const SCALE: [(f64, RGBColor); 4] = [
    (0.0, RGBColor(200, 30, 30)),
    (0.1, RGBColor(240, 150, 0)),
    (1.0, RGBColor(0, 158, 115)),
    (3.0, RGBColor(0, 90, 160)),
];
/// Height of the plot of radii relative to the largest, so that its legend covers no curve.
const HEADROOM: f64 = 1.25;
/// Radius above which the way is drawn as straight, mm.
const STRAIGHT_MM: f64 = 1000.0;
const LUMEN: RGBColor = COLOURS[1];
const DEVICE: RGBColor = COLOURS[0];
const NARROWEST: RGBColor = RGBColor(200, 30, 30);
const SHARPEST: RGBColor = RGBColor(120, 60, 110);

/// Data of the picture.
struct Picture<'a> {
    title: String,
    found: &'a Passable,
    side: Side,
    glass: Glass,
}

/// Draws the result for a vessel.
pub(super) fn write(
    path: &Path,
    title: String,
    found: &Passable,
    vessel: &SurfaceMesh,
) -> Result<(), Failure> {
    let room_px = [VESSEL_PX as usize, (SIZE.1 as i32 - LEGEND_PX - TITLE_PX) as usize];
    let places: Vec<_> = found.way.iter().map(|point| point.position_mm.into()).collect();
    let side = Side::fitting(vessel, &places, room_px);
    let glass = Glass::of(vessel, &side);
    chart::write_file(path, SIZE, &Picture { title, found, side, glass })
}

/// Colour of a clearance.
fn colour(point: &WayPoint) -> RGBColor {
    on_scale(point.clearance_mm / point.device_radius_mm)
}

fn on_scale(radii: f64) -> RGBColor {
    let Some(pair) = SCALE.windows(2).find(|pair| radii < pair[1].0) else { return SCALE[SCALE.len() - 1].1 };
    let [(low, from), (high, to)] = [pair[0], pair[1]];
    let part = ((radii - low) / (high - low)).max(0.0);
    let mix = |a: u8, b: u8| (f64::from(a) + part * (f64::from(b) - f64::from(a))).round() as u8;
    RGBColor(mix(from.0, to.0), mix(from.1, to.1), mix(from.2, to.2))
}

/// A colour mixed with white. Transparent pieces would leave stripes at shared edges; opaque ones do not.
fn lighter(RGBColor(red, green, blue): RGBColor) -> RGBColor {
    let thin = |level: u8| (255.0 - 0.4 * (255.0 - f64::from(level))).round() as u8;
    RGBColor(thin(red), thin(green), thin(blue))
}

impl chart::Chart for Picture<'_> {
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>) -> chart::Drawn<B> {
        let (title, below) = root.split_vertically(TITLE_PX);
        title.draw(&Text::new(self.title.clone(), (24, 18), chart::font(26)))?;
        let (left, right) = below.split_horizontally(VESSEL_PX);
        let (vessel, legend) = left.split_vertically(SIZE.1 as i32 - LEGEND_PX - TITLE_PX);
        self.draw_vessel(&vessel)?;
        self.draw_legend(&legend)?;
        let panels = right.split_evenly((2, 1));
        self.draw_room(&panels[0])?;
        self.draw_bends(&panels[1])
    }
}

impl Picture<'_> {
    fn draw_vessel<B: DrawingBackend>(&self, panel: &DrawingArea<B, Shift>) -> chart::Drawn<B> {
        for (at, tint) in self.glass.pixels() {
            panel.draw_pixel(at, &RGBColor(70, 90, 110).mix(tint))?;
        }
        let at = |point: &WayPoint| self.side.pixel(&point.position_mm.into());
        let way = &self.found.way;
        for pair in way.windows(2) {
            // The way beyond the position that the tip reaches is thin.
            let width = if pair[1].arc_mm <= self.found.reaches_mm { 6 } else { 2 };
            let line = [at(&pair[0]), at(&pair[1])];
            panel.draw(&PathElement::new(line, colour(&pair[1]).stroke_width(width)))?;
        }
        let black = RGBColor(20, 20, 20);
        if let [first, .., last] = way.as_slice() {
            panel.draw(&Circle::new(at(first), 7, black.filled()))?;
            panel.draw(&Circle::new(at(last), 9, black.stroke_width(3)))?;
        }
        mark_narrowest(panel, at(&self.found.narrowest))?;
        mark_sharpest(panel, at(&self.found.sharpest))
    }

    /// Draws the legend of markers and colours, and the scale bar.
    fn draw_legend<B: DrawingBackend>(&self, legend: &DrawingArea<B, Shift>) -> chart::Drawn<B> {
        let found = self.found;
        let narrow = &found.narrowest;
        let bend = &found.sharpest;
        let grey = RGBColor(90, 90, 90);
        let reported: [(Mark<B>, String); 2] = [
            (
                mark_narrowest,
                format!(
                    "narrowest at {:.1} mm: {:.2} mm of room about the device",
                    narrow.arc_mm, narrow.clearance_mm
                ),
            ),
            (
                mark_sharpest,
                format!(
                    "sharpest bend at {:.1} mm: radius {}, {} takes no force",
                    bend.arc_mm,
                    length(bend.cut_radius_mm),
                    length(bend.bears_radius_mm)
                ),
            ),
        ];
        for (number, (mark, text)) in reported.into_iter().enumerate() {
            let y = 14 + 30 * number as i32;
            mark(legend, (36, y + 9))?;
            legend.draw(&Text::new(text, (60, y), chart::font(19)))?;
        }
        legend.draw(&Circle::new((36, 83), 6, RGBColor(20, 20, 20).filled()))?;
        legend.draw(&Text::new("inlet", (60, 74), chart::font(19)))?;
        legend.draw(&Circle::new((136, 83), 8, RGBColor(20, 20, 20).stroke_width(3)))?;
        legend.draw(&Text::new("target", (156, 74), chart::font(19)))?;
        let (bar_mm, bar_px) = self.side.scale_bar();
        let right = VESSEL_PX - 40;
        legend.draw(&PathElement::new(
            [(right - bar_px, 84), (right, 84)],
            RGBColor(20, 20, 20).stroke_width(4),
        ))?;
        legend.draw(&Text::new(format!("{bar_mm} mm"), (right - bar_px, 92), chart::font(17)))?;
        // Clearance in radii of the device; the colours of the scale are at quarters of the bar.
        let (from, width) = (36, 330);
        for x in 0..width {
            let place = f64::from(x) / f64::from(width) * (SCALE.len() - 1) as f64;
            let (k, part) = (place as usize, place.fract());
            let radii = SCALE[k].0 + part * (SCALE[k + 1].0 - SCALE[k].0);
            legend.draw(&PathElement::new(
                [(from + x, 112), (from + x, 124)],
                on_scale(radii).stroke_width(1),
            ))?;
        }
        for (k, (radii, _)) in SCALE.iter().enumerate() {
            let x = from + width * k as i32 / (SCALE.len() as i32 - 1);
            legend.draw(&Text::new(radii.to_string(), (x - 6, 128), chart::font(15).color(&grey)))?;
        }
        legend.draw(&Text::new(
            "room over the device's radius",
            (from + width + 18, 109),
            chart::font(17).color(&grey),
        ))
    }

    /// Draws lumen and device along the way.
    fn draw_room<B: DrawingBackend>(&self, panel: &DrawingArea<B, Shift>) -> chart::Drawn<B> {
        let found = self.found;
        let top_mm = found.way.iter().map(|p| p.lumen_radius_mm.max(p.device_radius_mm)).fold(0.0, f64::max);
        let mut plot = ChartBuilder::on(panel)
            .margin(14)
            .x_label_area_size(44)
            .y_label_area_size(66)
            .build_cartesian_2d(0.0..found.length_mm, 0.0..HEADROOM * top_mm)?;
        plot.configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(228, 228, 228))
            .x_desc("along the way, mm")
            .y_desc("radius, mm")
            .label_style(chart::font(15))
            .axis_desc_style(chart::font(17))
            .draw()?;
        for pair in found.way.windows(2) {
            let area = vec![
                (pair[0].arc_mm, pair[0].device_radius_mm),
                (pair[0].arc_mm, pair[0].lumen_radius_mm),
                (pair[1].arc_mm, pair[1].lumen_radius_mm),
                (pair[1].arc_mm, pair[1].device_radius_mm),
            ];
            plot.draw_series([Polygon::new(area, lighter(colour(&pair[1])).filled())])?;
        }
        let along = |of: fn(&WayPoint) -> f64| found.way.iter().map(move |p| (p.arc_mm, of(p)));
        plot.draw_series(LineSeries::new(along(|p| p.lumen_radius_mm), LUMEN.stroke_width(3)))?
            .label("free radius of the lumen")
            .legend(key(LUMEN, 3));
        plot.draw_series(LineSeries::new(along(|p| p.device_radius_mm), DEVICE.stroke_width(3)))?
            .label("radius of the device, its tip at the target")
            .legend(key(DEVICE, 3));
        if found.reaches_mm < found.length_mm {
            let stop = [(found.reaches_mm, 0.0), (found.reaches_mm, HEADROOM * top_mm)];
            plot.draw_series([PathElement::new(stop, NARROWEST.stroke_width(2))])?
                .label("the tip comes to here")
                .legend(key(NARROWEST, 2));
        }
        let at = plot.backend_coord(&(found.narrowest.arc_mm, found.narrowest.lumen_radius_mm));
        mark_narrowest(panel, self.in_panel(panel, at))?;
        legend_of(&mut plot)
    }

    /// Draws bends along the way, and those that the device allows.
    fn draw_bends<B: DrawingBackend>(&self, panel: &DrawingArea<B, Shift>) -> chart::Drawn<B> {
        let found = self.found;
        let least = |of: fn(&WayPoint) -> f64| found.way.iter().map(of).fold(STRAIGHT_MM, f64::min);
        let low_mm =
            least(|p| p.bend_radius_mm).min(least(|p| p.cut_radius_mm)).min(least(|p| p.bears_radius_mm));
        let mut plot = ChartBuilder::on(panel)
            .margin(14)
            .x_label_area_size(44)
            .y_label_area_size(66)
            .build_cartesian_2d(0.0..found.length_mm, (0.7 * low_mm..STRAIGHT_MM).log_scale())?;
        plot.configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(228, 228, 228))
            .x_desc("along the way, mm")
            .y_desc("radius of bends, mm")
            .label_style(chart::font(15))
            .axis_desc_style(chart::font(17))
            .y_label_formatter(&chart::power)
            .draw()?;
        let lines: [(Radius, RGBColor, &str); 3] = [
            (|p| p.bend_radius_mm, COLOURS[2], "centre line"),
            (|p| p.cut_radius_mm, LUMEN, "what the room lets a wire make of it"),
            (|p| p.bears_radius_mm, DEVICE, "the device takes this without force"),
        ];
        for (of, colour, name) in lines {
            let line = found.way.iter().map(|p| (p.arc_mm, of(p).min(STRAIGHT_MM)));
            plot.draw_series(LineSeries::new(line, colour.stroke_width(3)))?
                .label(name)
                .legend(key(colour, 3));
        }
        let sharp = &found.sharpest;
        let at = plot.backend_coord(&(sharp.arc_mm, sharp.cut_radius_mm.min(STRAIGHT_MM)));
        mark_sharpest(panel, self.in_panel(panel, at))?;
        legend_of(&mut plot)
    }

    /// Converts a position in the picture to one in a panel.
    fn in_panel<B: DrawingBackend>(&self, panel: &DrawingArea<B, Shift>, (x, y): (i32, i32)) -> (i32, i32) {
        let (left, top) = panel.get_base_pixel();
        (x - left, y - top)
    }
}

/// Draws a marker at a position.
type Mark<B> = fn(&DrawingArea<B, Shift>, (i32, i32)) -> chart::Drawn<B>;

/// A ring at the narrowest place.
fn mark_narrowest<B: DrawingBackend>(panel: &DrawingArea<B, Shift>, at: (i32, i32)) -> chart::Drawn<B> {
    panel.draw(&Circle::new(at, 10, NARROWEST.stroke_width(4)))
}

/// A triangle at the sharpest bend.
fn mark_sharpest<B: DrawingBackend>(panel: &DrawingArea<B, Shift>, at: (i32, i32)) -> chart::Drawn<B> {
    panel.draw(&TriangleMarker::new(at, 12, SHARPEST.filled()))
}

/// Legend symbol of a curve.
fn key(colour: RGBColor, width: u32) -> impl Fn((i32, i32)) -> PathElement<(i32, i32)> {
    move |(x, y)| PathElement::new([(x, y), (x + 26, y)], colour.stroke_width(width))
}

/// The legend of a plot.
fn legend_of<'a, B: DrawingBackend + 'a, C>(plot: &mut ChartContext<'a, B, C>) -> chart::Drawn<B>
where
    C: CoordTranslate,
{
    plot.configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(210, 210, 210))
        .label_font(chart::font(16))
        .draw()
}

/// A radius as text.
fn length(mm: f64) -> String {
    if mm < STRAIGHT_MM { format!("{mm:.1} mm") } else { "straight".to_owned() }
}
