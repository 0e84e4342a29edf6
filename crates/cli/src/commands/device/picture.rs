//! The shapes of devices at rest, each in its plane, to one scale.

use std::path::Path;

use endowire_core::device::{DeviceFile, Part};
use endowire_core::shape::Shape;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::table::diameters;
use crate::failure::Failure;
use crate::output::chart::{self, COLOURS};

/// Shortest end of a device that is drawn, mm.
const LEAST_SHOWN_MM: f64 = 60.0;
/// Straight shaft behind a shaped end, as a share of it.
const SHAFT_SHARE: f64 = 0.3;
/// Points along a device: an arc of 5 mm is drawn to a tenth of a millimetre, and a sheet of all shapes stays small.
const POINTS: f64 = 64.0;
/// Least width of a device in the picture, pixels.
const LEAST_WIDTH_PX: u32 = 2;
/// Lengths of scale bars, mm.
const BARS_MM: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
/// Margin of a panel, and room for its captions and for the legend, pixels.
const MARGIN_PX: i32 = 14;
const CAPTION_PX: i32 = 50;
const LEGEND_PX: i32 = 64;

/// The material of a part that names none.
const UNNAMED: &str = "no material given";

/// The end of one device, in the plane of its shape: across and along its shaft, which points up.
struct Drawing {
    captions: [String; 2],
    parts: Vec<Stretch>,
    low_mm: [f64; 2],
    high_mm: [f64; 2],
}

/// A part of one material.
struct Stretch {
    /// Of its outermost layer.
    material: String,
    left_mm: Vec<[f64; 2]>,
    right_mm: Vec<[f64; 2]>,
}

/// Draws one device.
pub(super) fn one(path: &Path, device: &DeviceFile) -> Result<(), Failure> {
    let picture = Picture { drawings: vec![Drawing::new(device.name.clone(), device)], columns: 1 };
    chart::write_file(path, (520, 620), &picture)
}

/// Draws many, under the names of their files.
pub(super) fn sheet(path: &Path, names: &[String], devices: &[DeviceFile]) -> Result<(), Failure> {
    let drawings: Vec<Drawing> =
        names.iter().zip(devices).map(|(name, device)| Drawing::new(name.clone(), device)).collect();
    let columns = drawings.len().min(7);
    let rows = drawings.len().div_ceil(columns) as u32;
    let size = (240 * columns as u32, 360 * rows + LEGEND_PX as u32);
    chart::write_file(path, size, &Picture { drawings, columns })
}

impl Drawing {
    fn new(title: String, file: &DeviceFile) -> Self {
        let device = &file.device;
        let shown_mm = (device.shaped_mm() * (1.0 + SHAFT_SHARE)).max(LEAST_SHOWN_MM).min(device.length_mm());
        let shape = device.rest_shape(shown_mm, shown_mm / POINTS);
        let (points, directions, off_plane_mm) = in_plane(&shape);
        let mut drawing = Self {
            captions: [title, caption(file, off_plane_mm)],
            parts: vec![],
            low_mm: [f64::MAX; 2],
            high_mm: [f64::MIN; 2],
        };
        for part in file.parts.iter().filter(|part| part.from_tip_mm[0] < shown_mm) {
            drawing.parts.push(stretch(part, &shape, &points, &directions));
        }
        for point in drawing.parts.iter().flat_map(|part| part.left_mm.iter().chain(&part.right_mm)) {
            for axis in [0, 1] {
                drawing.low_mm[axis] = drawing.low_mm[axis].min(point[axis]);
                drawing.high_mm[axis] = drawing.high_mm[axis].max(point[axis]);
            }
        }
        drawing
    }

    /// Pixels a millimetre with which it fills a panel of `size_px`.
    fn fitting(&self, size_px: [f64; 2]) -> f64 {
        let along = |axis: usize| size_px[axis] / (self.high_mm[axis] - self.low_mm[axis]).max(1.0);
        along(0).min(along(1))
    }
}

/// Points and directions of a shape in the plane of its shaft and of its point farthest off the shaft's axis, and how far it leaves that
/// plane, mm.
fn in_plane(shape: &Shape) -> (Vec<[f64; 2]>, Vec<[f64; 2]>, f64) {
    let off_axis = shape.positions_mm.iter().map(|p| [p.x, p.y]);
    let [x, y] =
        off_axis.fold([0.0f64; 2], |far, p| if p[0].hypot(p[1]) > far[0].hypot(far[1]) { p } else { far });
    let far_mm = x.hypot(y);
    let [x, y] = if far_mm > 1e-9 { [x / far_mm, y / far_mm] } else { [1.0, 0.0] };
    let points = shape.positions_mm.iter().map(|p| [p.x * x + p.y * y, p.z]).collect();
    let directions = shape.tangents.iter().map(|t| [t.x * x + t.y * y, t.z]).collect();
    let off_plane_mm = shape.positions_mm.iter().map(|p| (p.y * x - p.x * y).abs()).fold(0.0, f64::max);
    (points, directions, off_plane_mm)
}

fn caption(file: &DeviceFile, off_plane_mm: f64) -> String {
    let device = &file.device;
    let [mm, ..] = diameters([2.0 * device.min_radius_mm(), 2.0 * device.max_radius_mm()]);
    let size = format!("{mm} mm, {:.0} cm", device.length_mm() / 10.0);
    // What a tenth of a millimetre off its plane does is not seen.
    if off_plane_mm < 0.1 { size } else { format!("{size}; ±{off_plane_mm:.0} mm off this plane") }
}

/// Both sides of a part.
fn stretch(part: &Part, shape: &Shape, points: &[[f64; 2]], directions: &[[f64; 2]]) -> Stretch {
    let [begin, end] = part.from_tip_mm;
    let material = part.coat.as_ref().map(|coat| &coat.material).or(part.material.as_ref());
    let mut stretch = Stretch {
        material: material.map_or_else(|| UNNAMED.to_owned(), String::clone),
        left_mm: vec![],
        right_mm: vec![],
    };
    for (i, &from_tip_mm) in shape.from_tip_mm.iter().enumerate() {
        // Points stand at the ends of parts but for rounding.
        if !(begin - 1e-6..=end + 1e-6).contains(&from_tip_mm) {
            continue;
        }
        let radius_mm = part.at(((from_tip_mm - begin) / (end - begin)).clamp(0.0, 1.0)).radius_mm;
        let ([x, y], [dx, dy]) = (points[i], directions[i]);
        let norm = dx.hypot(dy).max(1e-9);
        let [nx, ny] = [-dy / norm * radius_mm, dx / norm * radius_mm];
        stretch.left_mm.push([x + nx, y + ny]);
        stretch.right_mm.push([x - nx, y - ny]);
    }
    stretch
}

/// Panels in rows, with a legend below.
struct Picture {
    drawings: Vec<Drawing>,
    columns: usize,
}

impl Picture {
    /// Materials in the order in which they come.
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
        let (_, height) = root.dim_in_pixel();
        let (panels, legend) = root.split_vertically(height as i32 - LEGEND_PX);
        let panels = panels.split_evenly((self.drawings.len().div_ceil(self.columns), self.columns));
        let (width, height) = panels[0].dim_in_pixel();
        let room = [width as i32 - 2 * MARGIN_PX, height as i32 - CAPTION_PX - 2 * MARGIN_PX].map(f64::from);
        let scale = self.drawings.iter().map(|drawing| drawing.fitting(room)).fold(f64::MAX, f64::min);
        let materials = self.materials();
        for (drawing, panel) in self.drawings.iter().zip(&panels) {
            panel_of(panel, drawing, scale, &materials)?;
        }
        legend_of(&legend, scale, &materials)
    }
}

/// The colour of a material, by its place in the legend.
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
    let grey = RGBColor(90, 90, 90);
    panel.draw(&Text::new(drawing.captions[0].clone(), (MARGIN_PX, 10), chart::font(16)))?;
    panel.draw(&Text::new(drawing.captions[1].clone(), (MARGIN_PX, 30), chart::font(14).color(&grey)))?;
    // In the middle, with the shaft at the lower edge.
    let middle_mm = (drawing.low_mm[0] + drawing.high_mm[0]) / 2.0;
    let at = |[x, y]: [f64; 2]| {
        let across = f64::from(width) / 2.0 + (x - middle_mm) * scale;
        let down = f64::from(height) - f64::from(MARGIN_PX) - (y - drawing.low_mm[1]) * scale;
        (across.round() as i32, down.round() as i32)
    };
    for part in &drawing.parts {
        let colour = colour(materials, &part.material);
        let outline: Vec<_> = part.left_mm.iter().chain(part.right_mm.iter().rev()).map(|p| at(*p)).collect();
        panel.draw(&Polygon::new(outline, colour.filled()))?;
        // Thin devices would vanish between pixels.
        let middle: Vec<_> = part
            .left_mm
            .iter()
            .zip(&part.right_mm)
            .map(|(l, r)| at([(l[0] + r[0]) / 2.0, (l[1] + r[1]) / 2.0]))
            .collect();
        panel.draw(&PathElement::new(middle, colour.stroke_width(LEAST_WIDTH_PX)))?;
    }
    Ok(())
}

/// A bar of the scale, and the colours of the materials.
fn legend_of<B: DrawingBackend>(
    legend: &DrawingArea<B, Shift>,
    scale: f64,
    materials: &[&str],
) -> chart::Drawn<B> {
    let longest_px = 160.0;
    let bar_mm = BARS_MM.into_iter().rev().find(|mm| mm * scale <= longest_px).unwrap_or(BARS_MM[0]);
    let black = RGBColor(30, 30, 30);
    let (begin, end) = (MARGIN_PX, MARGIN_PX + (bar_mm * scale).round() as i32);
    legend.draw(&PathElement::new([(begin, 16), (end, 16)], black.stroke_width(3)))?;
    legend.draw(&Text::new(format!("{bar_mm} mm"), (begin, 24), chart::font(15)))?;
    let mut x = end + 40;
    for material in materials {
        legend.draw(&Rectangle::new([(x, 10), (x + 18, 22)], colour(materials, material).filled()))?;
        legend.draw(&Text::new((*material).to_owned(), (x + 26, 8), chart::font(15)))?;
        x += 50 + 8 * material.chars().count() as i32;
    }
    Ok(())
}
