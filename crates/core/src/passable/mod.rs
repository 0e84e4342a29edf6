//! Whether a device can follow a path through a vessel: its clearance, and the bends it must take.
//!
//! This considers only geometry and stiffness and takes hundredths of a second; a simulation shows what a device
//! really does when pushed. In at least 95 of 100 random vessels both agree: `cargo run --release -p endowire-benches
//! --bin passages`.

mod cut;
#[cfg(test)]
mod tests;

use serde::Serialize;

use crate::device::Device;
use crate::vessel::CentrelinePath;
use crate::{Error, Result, Vec3};

/// Default for the force along a device that counts as negligible, N: some tenths of a haemostatic valve's friction
/// (an assumption).
pub const NO_FORCE_N: f64 = 0.1;
/// Clearance, as a fraction of the device's radius, below which a path is tight.
const TIGHT: f64 = 0.1;
/// Largest distance of the contact surface from the surface, as a fraction of the lumen's radius and in mm (as
/// [`WallProperties::deviation_mm`](crate::contact::WallProperties::deviation_mm)). A device too thick by at most
/// this may pass.
const WALL_OFF: f64 = 0.05;
const WALL_OFF_MM: f64 = 0.1;
/// Number of points of a path: per smallest lumen radius, and smallest and largest in all.
const POINTS_PER_RADIUS: f64 = 3.0;
const POINTS: [f64; 2] = [40.0, 2000.0];
/// Number of points before and behind over which bends of the smooth line are measured.
const SMOOTH_POINTS: usize = 2;

/// The verdict on a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Passage {
    /// Clearance all the way, and no bend that takes force.
    Passes,
    /// The clearance is less than a tenth of the device's radius, possibly zero, or a bend is sharper than the device
    /// takes without force.
    Tight,
    /// The lumen is narrower than the device by more than a twentieth of the lumen's radius or 0.1 mm, whichever is
    /// less: the possible error of the contact surface.
    Blocked,
    /// The device is shorter than its path.
    Short,
}

/// A point of a path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WayPoint {
    /// Length of the path to this point, mm.
    pub arc_mm: f64,
    /// The position on the centre line, mm.
    pub position_mm: [f64; 3],
    /// Radius of the lumen, mm.
    pub lumen_radius_mm: f64,
    /// Largest radius of the part of the device that has passed here when the tip is at the end, mm.
    pub device_radius_mm: f64,
    /// Lumen radius minus device radius, mm.
    pub clearance_mm: f64,
    /// Radius of curvature of the centre line over two radii of the lumen, mm; infinite where straight.
    pub bend_radius_mm: f64,
    /// Radius of curvature of the least bent path within the clearance, that of a uniform wire without friction, mm;
    /// infinite where straight.
    pub cut_radius_mm: f64,
    /// Smallest radius of curvature that all of the device passing here takes without force, mm.
    pub bears_radius_mm: f64,
}

/// Whether a device passes along a path, and its most difficult points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Passable {
    /// The verdict.
    pub passage: Passage,
    /// Length of the path along the centre line, mm.
    pub length_mm: f64,
    /// Length of device along the path, that of the least bent line, mm.
    pub taken_mm: f64,
    /// How far along the path the tip gets, mm: to its end, or to where the device is too thick for the lumen, or
    /// ends.
    pub reaches_mm: f64,
    /// The point with the smallest clearance.
    pub narrowest: WayPoint,
    /// The point with the sharpest bend relative to what the device takes.
    pub sharpest: WayPoint,
    /// The whole path, evenly spaced.
    pub way: Vec<WayPoint>,
}

/// Evaluates a device on a path from the inlet to a target, where its tip ends.
///
/// A section of stiffness EI and rest curvature κ₀ takes a curvature κ without force if ½ EI (κ − κ₀)², the push
/// force into the bend, is at most `force_n` ([`NO_FORCE_N`] for most uses).
///
/// # Errors
/// [`Error::Parameter`] for a force that is not positive and finite, or a path of zero length.
pub fn passable(way: &CentrelinePath, device: &Device, force_n: f64) -> Result<Passable> {
    if !(force_n > 0.0 && force_n.is_finite()) {
        return Err(Error::parameter("force_n", force_n, "must be positive and finite, N"));
    }
    let length_mm = way.length_mm();
    let least_mm = way.least_radius_mm();
    let wanted = (POINTS_PER_RADIUS * length_mm / least_mm).clamp(POINTS[0], POINTS[1]);
    // The solver uses blocks of two points.
    let count = 2 * (0.5 * wanted).ceil() as usize;
    let spacing_mm = length_mm / (count - 1) as f64;
    let arcs: Vec<f64> = (0..count).map(|k| spacing_mm * k as f64).collect();
    let places: Vec<(Vec3, f64)> = arcs.iter().map(|arc_mm| way.place(*arc_mm)).collect();
    let passed: Vec<(f64, f64)> =
        arcs.iter().map(|arc_mm| passes(device, length_mm - arc_mm, force_n)).collect();
    let mut room_mm: Vec<f64> =
        places.iter().zip(&passed).map(|(place, p)| (place.1 - p.0).max(0.0)).collect();
    let points: Vec<Vec3> = places.iter().map(|place| place.0).collect();
    // It comes out of its sheath at the middle of the inlet, along the path.
    room_mm.iter_mut().take(2).for_each(|room_mm| *room_mm = 0.0);
    let cut = cut::least_bent(&points, &room_mm, spacing_mm);
    let point = |k: usize| {
        let ((position, lumen_radius_mm), (device_radius_mm, bears_radius_mm)) = (places[k], passed[k]);
        let window = (lumen_radius_mm / spacing_mm).ceil() as usize;
        WayPoint {
            arc_mm: arcs[k],
            position_mm: position.into(),
            lumen_radius_mm,
            device_radius_mm,
            clearance_mm: lumen_radius_mm - device_radius_mm,
            bend_radius_mm: bend_radius_mm(&points, k, window),
            cut_radius_mm: bend_radius_mm(&cut, k, SMOOTH_POINTS),
            bears_radius_mm,
        }
    };
    let way: Vec<WayPoint> = (0..count).map(point).collect();
    let least = |of: fn(&WayPoint) -> f64| way.iter().copied().min_by(|a, b| of(a).total_cmp(&of(b)));
    let nothing = || Error::parameter("way", length_mm, "has no points");
    let narrowest = least(|point| point.clearance_mm).ok_or_else(nothing)?;
    let sharpest = least(|point| point.cut_radius_mm / point.bears_radius_mm).ok_or_else(nothing)?;
    let is_tight = |point: &WayPoint| {
        point.clearance_mm < TIGHT * point.device_radius_mm || point.cut_radius_mm < point.bears_radius_mm
    };
    let fits_mm = |lumen_mm: f64| thinner_mm(device, lumen_mm + (WALL_OFF * lumen_mm).min(WALL_OFF_MM));
    let blocked_mm = way.iter().map(|point| point.arc_mm + fits_mm(point.lumen_radius_mm));
    let blocked_mm = blocked_mm.fold(f64::INFINITY, f64::min);
    let taken_mm = cut.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum::<f64>();
    // Both lines have their points at the same positions along the path.
    let ends_mm =
        if device.length_mm() < taken_mm { length_mm * device.length_mm() / taken_mm } else { f64::INFINITY };
    let passage = if blocked_mm <= length_mm && blocked_mm <= ends_mm {
        Passage::Blocked
    } else if ends_mm <= length_mm {
        Passage::Short
    } else if way.iter().any(is_tight) {
        Passage::Tight
    } else {
        Passage::Passes
    };
    let reaches_mm = length_mm.min(blocked_mm).min(ends_mm);
    Ok(Passable { passage, length_mm, taken_mm, reaches_mm, narrowest, sharpest, way })
}

/// Length of a device from its tip that is at most this thick, mm; infinite if all of it is.
fn thinner_mm(device: &Device, radius_mm: f64) -> f64 {
    let mut begin_mm = 0.0;
    for section in device.sections() {
        if section.radius_mm > radius_mm {
            return begin_mm;
        }
        begin_mm += section.length_mm;
    }
    f64::INFINITY
}

/// For the part of a device within this distance of its tip: the largest radius, and the smallest radius of curvature
/// that all of it takes.
fn passes(device: &Device, from_tip_mm: f64, force_n: f64) -> (f64, f64) {
    // At the end of the path the tip itself arrives.
    let from_tip_mm = from_tip_mm.max(f64::MIN_POSITIVE);
    let mut begin_mm = 0.0;
    let mut bears_mm = 0.0_f64;
    for section in device.sections() {
        if begin_mm >= from_tip_mm {
            break;
        }
        let [u, v] = section.rest_curvature_per_mm;
        // Across a soft plane, where it has one: it need not lie in that of the path.
        let more_per_mm = (2.0 * force_n / section.bending_stiffness_nmm2).sqrt();
        bears_mm = bears_mm.max(1.0 / (libm::hypot(u, v) + more_per_mm));
        begin_mm += section.length_mm;
    }
    (device.max_radius_within(from_tip_mm), bears_mm)
}

/// Radius of the circle through a point of a line and those `window` points before and behind; of the nearest such
/// circle at the ends.
fn bend_radius_mm(line: &[Vec3], at: usize, window: usize) -> f64 {
    let window = window.clamp(1, (line.len() - 1) / 2);
    let at = at.clamp(window, line.len() - 1 - window);
    let (a, b, c) = (line[at - window], line[at], line[at + window]);
    let (u, v) = (b - a, c - b);
    let area = u.cross(&v).norm();
    // Rounding bends a straight line by no more than this.
    if area <= 1e-9 * u.norm() * v.norm() {
        return f64::INFINITY;
    }
    u.norm() * v.norm() * (c - a).norm() / (2.0 * area)
}
