//! Packing of a sac (aneurysm) with coils.
//!
//! The volume of a coil is that of its outer radius along its centre line, π/4 D² L, the usual definition in packing
//! densities. It counts where its centre line is beyond the neck's plane and out of the catheter: what still lies in a
//! catheter whose tip is in the sac fills nothing yet, and goes back with it.

use serde::Serialize;

use super::Simulation;
use crate::Vec3;
use crate::device::{Device, line_mm};
use crate::rod::quadrature::hermite;
use crate::shape::Shape;
use crate::vessel::{NoStore, Sac};
use crate::{Error, Result};

/// Number of pieces of a coil between two nodes; each is represented by its middle.
const PIECES: usize = 8;
/// Distance from the neck's plane, mm, within which a coil covers it.
const NECK_MM: f64 = 1.0;
/// Number of sample points across the neck and across the sac.
const ACROSS: (usize, usize) = (60, 24);
/// Distance outside the neck, mm, beyond which a coil counts as herniated.
const HERNIATED_MM: f64 = 1.0;

/// Coils in a sac.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Packing {
    /// Volume of coils in the sac, mm³.
    pub coils_mm3: f64,
    /// Ratio of that to the volume of the sac.
    pub density: f64,
    /// Fraction of the neck's circle covered by coils within a millimetre of it.
    pub neck_coverage: f64,
    /// Length of coils out of the catheter and outside the neck, mm.
    pub outside_mm: f64,
    /// Whether loops have herniated: whether that is more than a millimetre.
    pub herniated: bool,
    /// Sum of the forces of inserted devices on the wall of the sac, N.
    pub dome_force_n: f64,
}

/// A short piece of a coil.
struct Piece {
    at_mm: Vec3,
    length_mm: f64,
    radius_mm: f64,
}

impl Packing {
    /// The packing of a simulation in the sac of its vessel.
    ///
    /// # Errors
    /// A sac without a volume, and a wall that cannot be queried.
    pub fn of(simulation: &Simulation, sac: &Sac) -> Result<Self> {
        if !(sac.volume_mm3.is_finite() && sac.volume_mm3 > 0.0) {
            let remedy = "there is nothing to fill: measure the sac of this vessel";
            return Err(Error::parameter("sac.volume_mm3", sac.volume_mm3, remedy));
        }
        let height_mm = |x: &Vec3| (x - sac.neck_mm).dot(&sac.normal);
        let pieces = pieces(simulation);
        let (inside, outside): (Vec<_>, Vec<_>) = pieces.iter().partition(|p| height_mm(&p.at_mm) >= 0.0);
        let volume = |piece: &&Piece| std::f64::consts::PI * piece.radius_mm.powi(2) * piece.length_mm;
        // From 0: the sum of no values would be −0.
        let coils_mm3 = inside.iter().map(volume).fold(0.0, |sum, mm3| sum + mm3);
        let outside_mm = outside.iter().fold(0.0, |sum, piece| sum + piece.length_mm);
        let contacts = simulation.report().contacts.iter();
        let at_dome = contacts.filter(|contact| height_mm(&contact.position_mm) >= 0.0);
        Ok(Self {
            coils_mm3,
            density: coils_mm3 / sac.volume_mm3,
            neck_coverage: covered(sac, &inside),
            outside_mm,
            herniated: outside_mm > HERNIATED_MM,
            dome_force_n: at_dome.fold(0.0, |sum, contact| sum + contact.force_n),
        })
    }

    /// Diameter of the largest ball that fits in the sac between wall, neck and coils, mm, centred on a point of a
    /// grid with a spacing of a twenty-fourth of its height.
    ///
    /// # Errors
    /// A wall that cannot be queried.
    pub fn largest_void_mm(simulation: &Simulation, sac: &Sac) -> Result<f64> {
        let coils = pieces(simulation);
        let query = simulation.lumen().query(&NoStore)?;
        let [u, v] = across(&sac.normal);
        let step_mm = sac.height_mm / ACROSS.1 as f64;
        let (half, mut largest_mm) = (ACROSS.1 as i32, 0.0f64);
        for k in 0..ACROSS.1 {
            for (i, j) in (-half..=half).flat_map(|i| (-half..=half).map(move |j| (i, j))) {
                let up_mm = (k as f64 + 0.5) * step_mm;
                let at = sac.neck_mm + sac.normal * up_mm + (u * f64::from(i) + v * f64::from(j)) * step_mm;
                // Skip points where no larger ball fits above the neck or between the coils.
                let mut room_mm = up_mm.min(sac.height_mm);
                for piece in &coils {
                    room_mm = room_mm.min((piece.at_mm - at).norm() - piece.radius_mm);
                    if room_mm <= largest_mm {
                        break;
                    }
                }
                if room_mm <= largest_mm {
                    continue;
                }
                let near = query.nearest(&at, sac.height_mm).filter(|near| !near.rim);
                largest_mm = largest_mm.max(near.map_or(0.0, |near| near.distance_mm.min(room_mm)));
            }
        }
        Ok(2.0 * largest_mm)
    }
}

/// The detached coils, and the part of the inserted one that is out.
fn pieces(simulation: &Simulation) -> Vec<Piece> {
    let stack = simulation.stack();
    let device = |instrument: usize| &stack.instruments()[instrument].device;
    let mut all = Vec::new();
    for coil in simulation.coils() {
        cut(&coil.shape, device(coil.instrument), f64::INFINITY, &mut all);
    }
    let inserted_mm = simulation.report().lengths_mm();
    let line = line_mm(inserted_mm.iter().copied());
    for (instrument, mm) in inserted_mm.iter().enumerate().filter(|(_, mm)| **mm > 0.0) {
        let covered_mm = line_mm(inserted_mm[instrument + 1..].iter().copied());
        let out_mm = device(instrument).coil_mm().min(mm - covered_mm);
        if out_mm > 0.0 {
            cut(&simulation.shape().behind(line - mm), device(instrument), out_mm, &mut all);
        }
    }
    all
}

/// Cuts the part of a device within `out_mm` of its tip into pieces.
fn cut(shape: &Shape, device: &Device, out_mm: f64, into: &mut Vec<Piece>) {
    for e in 0..shape.len().saturating_sub(1) {
        let (from_mm, to_mm) = (shape.from_tip_mm[e].min(out_mm), shape.from_tip_mm[e + 1]);
        let (h, length_mm) = (shape.from_tip_mm[e] - to_mm, (from_mm - to_mm) / PIECES as f64);
        if length_mm <= 0.0 {
            continue;
        }
        for k in 0..PIECES {
            let from_tip_mm = from_mm - (k as f64 + 0.5) * length_mm;
            let [w0, s0, w1, s1] = hermite((shape.from_tip_mm[e] - from_tip_mm) / h);
            let (x, t) = (&shape.positions_mm, &shape.tangents);
            let at_mm = x[e] * w0 + x[e + 1] * w1 + (t[e] * s0 + t[e + 1] * s1) * h;
            into.push(Piece { at_mm, length_mm, radius_mm: device.section_at(from_tip_mm).radius_mm });
        }
    }
}

/// Two directions across a normal.
fn across(normal: &Vec3) -> [Vec3; 2] {
    let frame = crate::rod::Frame::new(*normal, None);
    [frame.u, frame.v]
}

/// Fraction of the circle of the neck's area covered by the projection of coils near it.
fn covered(sac: &Sac, coils: &[&Piece]) -> f64 {
    let [u, v] = across(&sac.normal);
    let near = coils.iter().filter(|piece| (piece.at_mm - sac.neck_mm).dot(&sac.normal) <= NECK_MM);
    let near: Vec<(f64, f64, f64)> = near
        .map(|piece| {
            let off = piece.at_mm - sac.neck_mm;
            (off.dot(&u), off.dot(&v), libm::hypot(piece.radius_mm, 0.5 * piece.length_mm))
        })
        .collect();
    let radius_mm = 0.5 * sac.neck_diameter_mm;
    let place = |k: usize| radius_mm * (2.0 * (k as f64 + 0.5) / ACROSS.0 as f64 - 1.0);
    let (mut all, mut behind) = (0, 0);
    for (x, y) in (0..ACROSS.0).flat_map(|i| (0..ACROSS.0).map(move |j| (place(i), place(j)))) {
        if libm::hypot(x, y) <= radius_mm {
            all += 1;
            behind += usize::from(near.iter().any(|(a, b, r)| libm::hypot(a - x, b - y) <= *r));
        }
    }
    f64::from(behind as u32) / f64::from(all as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A circle of 2 mm on which a coil of 20 mm lies.
    fn circle() -> (Shape, Device) {
        let at = |s: f64| Vec3::new(2.0 * (0.5 * s).cos(), 2.0 * (0.5 * s).sin(), 0.5);
        let along = |s: f64| Vec3::new(-(0.5 * s).sin(), (0.5 * s).cos(), 0.0);
        let places: Vec<f64> = (0..=40).map(|i| 0.5 * f64::from(i)).collect();
        let shape = Shape {
            positions_mm: places.iter().map(|s| at(*s)).collect(),
            tangents: places.iter().map(|s| along(*s)).collect(),
            from_tip_mm: places.iter().rev().copied().collect(),
        };
        (shape, Device::uniform(30.0, 0.15, 1e-3).unwrap().with_coil(20.0).unwrap())
    }

    #[test]
    fn a_coil_has_the_volume_of_its_outer_radius_along_what_is_out() {
        let (shape, device) = circle();
        let volume_mm3 = |out_mm: f64| {
            let mut pieces = Vec::new();
            cut(&shape, &device, out_mm, &mut pieces);
            pieces.iter().map(|p| std::f64::consts::PI * p.radius_mm.powi(2) * p.length_mm).sum::<f64>()
        };
        let whole_mm3 = std::f64::consts::PI * 0.15 * 0.15 * 20.0;
        assert!((volume_mm3(f64::INFINITY) / whole_mm3 - 1.0).abs() < 1e-12);
        assert!((device.coil_mm3() / whole_mm3 - 1.0).abs() < 1e-12);
        assert!((volume_mm3(7.3) / whole_mm3 - 0.365).abs() < 1e-12);
    }

    #[test]
    fn a_ring_covers_its_part_of_the_neck() {
        let (shape, device) = circle();
        let mut pieces = Vec::new();
        cut(&shape, &device, f64::INFINITY, &mut pieces);
        let sac = |up_mm: f64| Sac {
            neck_mm: Vec3::new(0.0, 0.0, 0.5 - up_mm),
            normal: Vec3::z(),
            neck_area_mm2: 25.0 * std::f64::consts::FRAC_PI_4,
            neck_diameter_mm: 5.0,
            volume_mm3: 100.0,
            height_mm: 5.0,
            dome_diameter_mm: 5.0,
            aspect_ratio: 1.0,
        };
        let all: Vec<&Piece> = pieces.iter().collect();
        // The annulus of 1.85 to 2.15 mm; a ring higher up does not count.
        let expected = (2.15 * 2.15 - 1.85 * 1.85) / (2.5 * 2.5);
        assert!((covered(&sac(0.5), &all) - expected).abs() < 0.03, "{}", covered(&sac(0.5), &all));
        assert_eq!(covered(&sac(1.5), &all), 0.0);
    }
}
