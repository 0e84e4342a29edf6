//! The wall in contact with devices, as written, reported and drawn by `endowire vessel check`.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use endowire_core::contact::{ContactMesh, WallProperties};
use endowire_core::vessel::{Conditioned, Conditioning, NoStore, SurfaceMesh, Wall, WallQuery, condition};
use endowire_core::{Error, Vec3};
use serde::Serialize;

use crate::args::FeltArgs;
use crate::failure::Failure;
use crate::output::chart::write_png;

/// Radius of the wire for which the wall is smoothed, mm: 0.014″, the thinnest. For thicker wires the wall differs
/// only at septa.
const RADIUS_MM: f64 = 0.178;
/// Number of pixels along the picture's longer side.
const PIXELS: f64 = 1600.0;
/// Margin around the vessel, pixels.
const MARGIN: f64 = 20.0;
/// Search radius for the given surface, mm: a larger distance is drawn as this one.
const REACH_MM: f64 = 10.0;

/// Properties of the contact surface.
#[derive(Serialize)]
pub(crate) struct FeltReport {
    changed: bool,
    triangles: usize,
    limit_mm: f64,
    deviation_mm: f64,
    deviation_99_mm: f64,
    deviation_mean_mm: f64,
    worst_at_mm: [f64; 3],
    edge_min_mm: f64,
    edge_median_mm: f64,
    edge_max_mm: f64,
    least_angle_deg: f64,
    largest_turn_deg: f64,
    written: Vec<PathBuf>,
}

impl FeltReport {
    /// Conditions the repaired `surface` and writes the requested outputs; `None` if nothing is requested.
    pub(crate) fn new(surface: &SurfaceMesh, args: &FeltArgs) -> Result<Option<Self>, Failure> {
        if args.felt.is_none() && args.picture.is_none() && args.deviation_mm.is_none() {
            return Ok(None);
        }
        let wall = Wall::from_surface(surface)?;
        let mut options = Conditioning::default();
        options.deviation_mm = args.deviation_mm.unwrap_or(options.deviation_mm);
        let even = wall.with_even_rims()?;
        let felt = condition(even.mesh(), &options).map_err(|error| match error {
            Error::Parameter { name, value, remedy } if name == "deviation_mm" => {
                Failure::from(Error::Parameter { name: "--deviation-mm".to_owned(), value, remedy })
            }
            other => other.into(),
        })?;
        // No further deviation, because the mesh is already conditioned.
        let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
        let meshed = Wall::welded(&felt.mesh)?;
        let smooth = ContactMesh::new(&meshed, RADIUS_MM, &properties, &NoStore)?;
        let deviation = smooth.deviation(&wall)?;
        let mut written = Vec::new();
        if let Some(path) = &args.felt {
            felt.mesh.write(path)?;
            written.push(path.clone());
        }
        if let Some(path) = &args.picture {
            draw(path, &felt, &wall, options.deviation_mm)?;
            written.push(path.clone());
        }
        Ok(Some(Self {
            changed: felt.changed || matches!(even, Cow::Owned(_)),
            triangles: felt.mesh.triangles.len(),
            limit_mm: options.deviation_mm,
            deviation_mm: deviation.most_mm,
            deviation_99_mm: deviation.usual_mm,
            deviation_mean_mm: deviation.mean_mm,
            worst_at_mm: deviation.worst_at_mm.into(),
            edge_min_mm: felt.edge_min_mm,
            edge_median_mm: felt.edge_median_mm,
            edge_max_mm: felt.edge_max_mm,
            least_angle_deg: felt.least_angle.to_degrees(),
            largest_turn_deg: felt.largest_turn.to_degrees(),
            written,
        }))
    }

    /// Lines of text.
    pub(crate) fn text(&self) -> Vec<String> {
        let mut lines = vec!["as a device feels it:".to_owned()];
        let how = if self.changed { "meshed anew" } else { "even as they are" };
        lines.push(format!("  triangles            {}, {how}", self.triangles));
        let [x, y, z] = self.worst_at_mm;
        lines.push(format!(
            "  off the surface      {:.3} mm in the mean, 99 of 100 places below {:.3}, at most {:.3} at [{x:.2}, {y:.2}, {z:.2}]; aimed at {:.3}",
            self.deviation_mean_mm, self.deviation_99_mm, self.deviation_mm, self.limit_mm
        ));
        lines.push(format!(
            "  edges                {:.3} to {:.3} mm, median {:.3} mm; angles from {:.0}°, edges bent by up to {:.0}°",
            self.edge_min_mm, self.edge_max_mm, self.edge_median_mm, self.least_angle_deg, self.largest_turn_deg
        ));
        lines.extend(self.written.iter().map(|path| format!("  written              {}", path.display())));
        lines
    }
}

/// Draws the contact surface, seen along its shortest extent: grey where it agrees with the given surface, red where it is
/// inside by the limit or more, blue where it is outside.
fn draw(path: &Path, felt: &Conditioned<'_>, wall: &Wall, limit_mm: f64) -> Result<(), Failure> {
    let mesh = &felt.mesh;
    let query = WallQuery::new(wall)?;
    let bound = |f: fn(&Vec3, &Vec3) -> Vec3| mesh.vertices_mm.iter().copied().reduce(|a, b| f(&a, &b));
    let (low, high) = bound(Vec3::inf).zip(bound(Vec3::sup)).unwrap_or((Vec3::zeros(), Vec3::repeat(1.0)));
    let size = high - low;
    let depth = size.imin();
    let (right, up) = ((depth + 1) % 3, (depth + 2) % 3);
    let (right, up) = if size[right] >= size[up] { (right, up) } else { (up, right) };
    let scale = PIXELS / size[right].max(f64::MIN_POSITIVE);
    let (width, height) = (PIXELS + 2.0 * MARGIN, (size[up] * scale).max(1.0) + 2.0 * MARGIN);
    let (width, height) = (width as usize, height as usize);
    let seen = |v: &Vec3| {
        Vec3::new(
            MARGIN + (v[right] - low[right]) * scale,
            MARGIN + (high[up] - v[up]) * scale,
            (v[depth] - low[depth]) * scale,
        )
    };
    let points: Vec<Vec3> = mesh.vertices_mm.iter().map(seen).collect();
    let off = |v: &Vec3| query.nearest(v, REACH_MM).map_or(-REACH_MM, |n| n.distance_mm) / limit_mm;
    let offs: Vec<f64> = mesh.vertices_mm.iter().map(off).collect();
    let mut nearest = vec![f64::NEG_INFINITY; width * height];
    let mut pixels = vec![255u8; 3 * width * height];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| points[v as usize]);
        let normal = (b - a).cross(&(c - a));
        if normal.z == 0.0 {
            continue;
        }
        let light = 0.4 + 0.6 * normal.z.abs() / normal.norm();
        let (from, to) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
        for y in from.y.ceil() as usize..=(to.y as usize).min(height - 1) {
            for x in from.x.ceil() as usize..=(to.x as usize).min(width - 1) {
                let p = Vec3::new(x as f64, y as f64, 0.0);
                let part =
                    |q: &Vec3, r: &Vec3| ((q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x)) / normal.z;
                let weights = [part(&b, &c), part(&c, &a), part(&a, &b)];
                if weights.iter().any(|w| *w < -1e-9) {
                    continue;
                }
                let z = weights[0] * a.z + weights[1] * b.z + weights[2] * c.z;
                if z <= nearest[y * width + x] {
                    continue;
                }
                nearest[y * width + x] = z;
                let off: f64 = (0..3).map(|k| weights[k] * offs[t[k] as usize]).sum();
                let colour = colour(off).map(|c| (light * c) as u8);
                pixels[3 * (y * width + x)..][..3].copy_from_slice(&colour);
            }
        }
    }
    let written = write_png(path, (width as u32, height as u32), &pixels);
    written.map_err(|error| Failure::Input(format!("{}: {error}", path.display())))
}

/// Colour of a deviation relative to the limit, positive inside.
fn colour(off: f64) -> [f64; 3] {
    let fade = 200.0 * (1.0 - off.abs().min(1.0));
    if off > 0.0 {
        [200.0 + 0.25 * (200.0 - fade), fade, fade]
    } else {
        [fade, fade, 200.0 + 0.25 * (200.0 - fade)]
    }
}
