//! Rest shapes of devices, each in its plane, at one scale.

use std::path::Path;

use endowire_core::device::{DeviceFile, Part};
use endowire_core::shape::Shape;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::table::diameters;
use crate::failure::Failure;
use crate::output::chart::{self, COLOURS};

/// Smallest length at the end of a device that is drawn, mm.
const LEAST_SHOWN_MM: f64 = 40.0;
/// Length of straight shaft drawn behind a shaped end, mm.
const SHAFT_MM: f64 = 15.0;
/// Length of shaft drawn below a tip that turns back, mm.
const BELOW_MM: f64 = 8.0;
/// Number of points along a device: smooth for a single one, fewer on a sheet to keep its file small.
const POINTS_ALONE: f64 = 150.0;
const POINTS_ON_SHEET: f64 = 90.0;
/// Scale of a sheet: a French is more than a pixel.
const SHEET_PX_PER_MM: f64 = 4.0;
/// Lengths of scale bars, mm.
const BARS_MM: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
/// Sizes in pixels: of a panel, of the picture of one device, of the margin around a shape.
const PANEL_PX: i32 = 430;
const ONE_PX: (u32, u32) = (1000, 1100);
const MARGIN_PX: i32 = 24;
const CAPTION_PX: i32 = 90;
const LEGEND_PX: i32 = 110;

/// Label of a part without a material.
const UNNAMED: &str = "no material given";

/// The end of one device, in the plane of its shape: across and along its shaft, which points up.
struct Drawing {
    captions: [String; 2],
    parts: Vec<Stretch>,
    low_mm: [f64; 2],
    high_mm: [f64; 2],
}

/// The centre line of a part.
struct Stretch {
    /// Material of its outermost layer.
    material: String,
    diameter_mm: f64,
    points_mm: Vec<[f64; 2]>,
}

impl Stretch {
    fn looks_like(&self, other: &Self) -> bool {
        self.material == other.material && self.diameter_mm == other.diameter_mm
    }
}

/// Draws one device.
pub(super) fn one(path: &Path, device: &DeviceFile) -> Result<(), Failure> {
    let drawing = Drawing::new(device.name.clone(), device, POINTS_ALONE);
    let (width, height) = (ONE_PX.0 as i32, ONE_PX.1 as i32 - LEGEND_PX - CAPTION_PX);
    let room_px = [width, height].map(|px| f64::from(px - 2 * MARGIN_PX));
    let scale = drawing.fitting(room_px);
    chart::write_file(path, ONE_PX, &Picture { drawings: vec![drawing], columns: 1, scale })
}

/// Draws several devices, labelled with their file names.
pub(super) fn sheet(path: &Path, names: &[String], devices: &[DeviceFile]) -> Result<(), Failure> {
    let drawing = |(name, device): (&String, _)| Drawing::new(name.clone(), device, POINTS_ON_SHEET);
    let drawings: Vec<Drawing> = names.iter().zip(devices).map(drawing).collect();
    let room_px = [f64::from(PANEL_PX - 2 * MARGIN_PX), f64::MAX];
    let scale = drawings.iter().map(|drawing| drawing.fitting(room_px)).fold(SHEET_PX_PER_MM, f64::min);
    let picture = Picture { columns: drawings.len().min(7), drawings, scale };
    let height = picture.rows_px().iter().sum::<i32>() + LEGEND_PX;
    chart::write_file(path, ((PANEL_PX * picture.columns as i32) as u32, height as u32), &picture)
}

impl Drawing {
    fn new(title: String, file: &DeviceFile, points: f64) -> Self {
        let device = &file.device;
        let rest_shape = |end_mm: f64| device.rest_shape(end_mm, end_mm / points);
        let mut shown_mm = (device.shaped_mm() + SHAFT_MM).max(LEAST_SHOWN_MM);
        // Includes the shaft beside a tip that turns back.
        let low_mm = rest_shape(shown_mm).positions_mm.iter().map(|p| p.z).fold(0.0, f64::min);
        if low_mm < 0.0 {
            shown_mm += BELOW_MM - low_mm;
        }
        let shape = rest_shape(shown_mm);
        let (points, off_plane_mm) = in_plane(&shape);
        let mut drawing = Self {
            captions: [title, caption(file, off_plane_mm)],
            parts: vec![],
            low_mm: [f64::MAX; 2],
            high_mm: [f64::MIN; 2],
        };
        for part in file.parts.iter().rev().filter(|part| part.from_tip_mm[0] < shown_mm) {
            let next = stretch(part, &shape, &points);
            match drawing.parts.last_mut() {
                // Continues the line without a gap: the point between two parts belongs to both.
                Some(last) if last.looks_like(&next) => {
                    last.points_mm.extend(next.points_mm.into_iter().skip(1));
                }
                _ => drawing.parts.push(next),
            }
        }
        for point in points {
            for axis in [0, 1] {
                drawing.low_mm[axis] = drawing.low_mm[axis].min(point[axis]);
                drawing.high_mm[axis] = drawing.high_mm[axis].max(point[axis]);
            }
        }
        drawing
    }

    /// Pixels per millimetre at which it fills a space.
    fn fitting(&self, room_px: [f64; 2]) -> f64 {
        let along = |axis: usize| room_px[axis] / (self.high_mm[axis] - self.low_mm[axis]).max(1.0);
        along(0).min(along(1))
    }
}

/// Points of a shape in the plane through its shaft and its point farthest from the shaft's axis, and the largest
/// distance from that plane, mm.
fn in_plane(shape: &Shape) -> (Vec<[f64; 2]>, f64) {
    let off_axis = shape.positions_mm.iter().map(|p| [p.x, p.y]);
    let [x, y] =
        off_axis.fold([0.0f64; 2], |far, p| if p[0].hypot(p[1]) > far[0].hypot(far[1]) { p } else { far });
    let far_mm = x.hypot(y);
    let [x, y] = if far_mm > 1e-9 { [x / far_mm, y / far_mm] } else { [1.0, 0.0] };
    let points = shape.positions_mm.iter().map(|p| [p.x * x + p.y * y, p.z]).collect();
    let off_plane_mm = shape.positions_mm.iter().map(|p| (p.y * x - p.x * y).abs()).fold(0.0, f64::max);
    (points, off_plane_mm)
}

fn caption(file: &DeviceFile, off_plane_mm: f64) -> String {
    let device = &file.device;
    let [mm, ..] = diameters([2.0 * device.min_radius_mm(), 2.0 * device.max_radius_mm()]);
    let size = format!("{mm} mm, {:.0} cm", device.length_mm() / 10.0);
    // A deviation below 0.1 mm from the plane is not visible.
    if off_plane_mm < 0.1 { size } else { format!("{size}, {off_plane_mm:.0} mm off plane") }
}

/// The centre line of a part.
fn stretch(part: &Part, shape: &Shape, points: &[[f64; 2]]) -> Stretch {
    let [begin, end] = part.from_tip_mm;
    let material = part.coat.as_ref().map(|coat| &coat.material).or(part.material.as_ref());
    // The points lie at the ends of parts up to rounding.
    let inside = |from_tip_mm: f64| (begin - 1e-6..=end + 1e-6).contains(&from_tip_mm);
    let own = shape.from_tip_mm.iter().zip(points).filter(|(from_tip_mm, _)| inside(**from_tip_mm));
    Stretch {
        material: material.map_or_else(|| UNNAMED.to_owned(), String::clone),
        diameter_mm: 2.0 * part.at(0.5).radius_mm,
        points_mm: own.map(|(_, point)| *point).collect(),
    }
}

/// Panels in rows, with a legend below.
struct Picture {
    drawings: Vec<Drawing>,
    columns: usize,
    /// Pixels per millimetre.
    scale: f64,
}

impl Picture {
    /// Heights of the rows of a sheet, each that of its tallest device.
    fn rows_px(&self) -> Vec<i32> {
        let tallest = |row: &[Drawing]| row.iter().map(|d| d.high_mm[1] - d.low_mm[1]).fold(0.0, f64::max);
        let height = |row| (tallest(row) * self.scale).ceil() as i32 + CAPTION_PX + 2 * MARGIN_PX;
        self.drawings.chunks(self.columns).map(height).collect()
    }

    /// Materials in order of occurrence.
    fn materials(&self) -> Vec<&str> {
        let mut materials: Vec<&str> = vec![];
        for part in self.drawings.iter().flat_map(|drawing| &drawing.parts) {
            if !materials.contains(&part.material.as_str()) {
                materials.push(&part.material);
            }
        }
        materials
    }
}

impl chart::Chart for Picture {
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>) -> chart::Drawn<B> {
        let materials = self.materials();
        let mut below = root.clone();
        for (row, height) in self.drawings.chunks(self.columns).zip(self.rows_px()) {
            let (above, rest) = below.split_vertically(height);
            for (drawing, panel) in row.iter().zip(above.split_evenly((1, self.columns))) {
                panel_of(&panel, drawing, self.scale, &materials)?;
            }
            below = rest;
        }
        legend_of(&below, self.scale, &materials)
    }
}

/// Colour of a material, by its position in the legend.
fn colour(materials: &[&str], material: &str) -> RGBColor {
    let index = materials.iter().position(|name| *name == material).unwrap_or(0);
    COLOURS[index % COLOURS.len()]
}

fn panel_of<B: DrawingBackend>(
    panel: &DrawingArea<B, Shift>,
    drawing: &Drawing,
    scale: f64,
    materials: &[&str],
) -> chart::Drawn<B> {
    let (width, height) = panel.dim_in_pixel();
    let [title, size] = &drawing.captions;
    panel.draw(&Text::new(title.clone(), (MARGIN_PX, 18), chart::font(28)))?;
    let grey = chart::font(24).color(&RGBColor(90, 90, 90));
    panel.draw(&Text::new(size.clone(), (MARGIN_PX, 52), grey))?;
    // Centred, with the shaft at the lower edge.
    let middle_mm = (drawing.low_mm[0] + drawing.high_mm[0]) / 2.0;
    let at = |[x, y]: [f64; 2]| {
        let across = f64::from(width) / 2.0 + (x - middle_mm) * scale;
        let down = f64::from(height) - f64::from(MARGIN_PX) - (y - drawing.low_mm[1]) * scale;
        (across.round() as i32, down.round() as i32)
    };
    for part in &drawing.parts {
        let line: Vec<_> = part.points_mm.iter().map(|p| at(*p)).collect();
        let width_px = (part.diameter_mm * scale).round().max(1.0) as u32;
        panel.draw(&PathElement::new(line, colour(materials, &part.material).stroke_width(width_px)))?;
    }
    Ok(())
}

/// Draws the scale bar, and the colours of the materials.
fn legend_of<B: DrawingBackend>(
    legend: &DrawingArea<B, Shift>,
    scale: f64,
    materials: &[&str],
) -> chart::Drawn<B> {
    let longest_px = 260.0;
    let bar_mm = BARS_MM.into_iter().rev().find(|mm| mm * scale <= longest_px).unwrap_or(BARS_MM[0]);
    let black = RGBColor(30, 30, 30);
    let (begin, end) = (MARGIN_PX, MARGIN_PX + (bar_mm * scale).round() as i32);
    legend.draw(&PathElement::new([(begin, 32), (end, 32)], black.stroke_width(6)))?;
    legend.draw(&Text::new(format!("{bar_mm} mm"), (begin, 46), chart::font(26)))?;
    let mut x = end + 60;
    for material in materials {
        legend.draw(&Rectangle::new([(x, 20), (x + 32, 44)], colour(materials, material).filled()))?;
        legend.draw(&Text::new((*material).to_owned(), (x + 44, 24), chart::font(26)))?;
        x += 90 + 14 * material.chars().count() as i32;
    }
    Ok(())
}
