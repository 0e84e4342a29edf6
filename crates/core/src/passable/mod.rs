//! Whether a device can follow a way through a vessel: the room it has, and the bends it must take.
//!
//! This looks at geometry and stiffness alone and takes hundredths of a second; what a device does when it is pushed is what a simulation tells.
//! In at least 95 of 100 random vessels both agree: `cargo run --release -p endowire-benches --bin passages`.

mod cut;
#[cfg(test)]
mod tests;

use serde::Serialize;

use crate::device::Device;
use crate::vessel::CentrelinePath;
use crate::{Error, Result, Vec3};

/// Force along a device that is taken for none, N, unless set: some tenths of what a haemostatic valve holds it with (an assumption).
pub const NO_FORCE_N: f64 = 0.1;
/// A way is tight where there is less room than this part of the device's radius.
const TIGHT: f64 = 0.1;
/// So far may the wall that a device feels be off the surface: a part of the lumen's radius, and at most this, mm (as
/// [`WallProperties::deviation_mm`](crate::contact::WallProperties::deviation_mm) has it). What is thicker by no more may pass.
const WALL_OFF: f64 = 0.05;
const WALL_OFF_MM: f64 = 0.1;
/// Points of a way: so many in a least lumen radius, and no fewer or more than this in all.
const POINTS_PER_RADIUS: f64 = 3.0;
const POINTS: [f64; 2] = [40.0, 2000.0];
/// Bends are measured over so many points before and behind where the line is smooth.
const SMOOTH_POINTS: usize = 2;

/// A device on its way, in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Passage {
    /// There is room all the way, and no bend that takes force.
    Passes,
    /// There is less room than a tenth of the device's radius, which may be none, or a bend is sharper than the device takes without force.
    Tight,
    /// The lumen is narrower than the device by more than a twentieth of the lumen's radius or 0.1 mm, whichever is less: by so much the
    /// wall that is felt may be off the surface.
    Blocked,
    /// The device is shorter than the way that it takes.
    Short,
}

/// What a device finds at a place of its way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WayPoint {
    /// Length of the way to here, mm.
    pub arc_mm: f64,
    /// The place on the centre line, mm.
    pub position_mm: [f64; 3],
    /// Radius of the lumen, mm.
    pub lumen_radius_mm: f64,
    /// Largest radius of what has passed here when the tip is at the end of the way, mm.
    pub device_radius_mm: f64,
    /// The one less the other, mm.
    pub clearance_mm: f64,
    /// Radius of curvature of the centre line over two radii of the lumen, mm; infinite where that is straight.
    pub bend_radius_mm: f64,
    /// Radius of curvature of the least bent way that the room allows, as a uniform wire lies in it without friction, mm; infinite where that
    /// is straight.
    pub cut_radius_mm: f64,
    /// Smallest radius of curvature that all of the device that passes here takes without force, mm.
    pub bears_radius_mm: f64,
}

/// Whether a device passes along a way, and where it is hardest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Passable {
    /// In one word.
    pub passage: Passage,
    /// Length of the way along the centre line, mm.
    pub length_mm: f64,
    /// Length of the device that the way takes: of the least bent line, mm.
    pub taken_mm: f64,
    /// How far along the way the tip comes, mm: all of it, or to where the device is too thick for the lumen, or ends.
    pub reaches_mm: f64,
    /// Where there is least room.
    pub narrowest: WayPoint,
    /// Where the bend is sharpest beside what the device takes.
    pub sharpest: WayPoint,
    /// All of the way, evenly.
    pub way: Vec<WayPoint>,
}

/// Looks at a device on a way from the inlet to a target, where its tip is in the end.
///
/// A section of stiffness EI and rest curvature κ₀ takes a curvature κ without force where ½ EI (κ − κ₀)², what it costs to push a length
/// of it into the bend, is at most `force_n` ([`NO_FORCE_N`] for most uses).
///
/// # Errors
/// [`Error::Parameter`] for a force that is not positive and finite, or a way of no length.
pub fn passable(way: &CentrelinePath, device: &Device, force_n: f64) -> Result<Passable> {
    if !(force_n > 0.0 && force_n.is_finite()) {
        return Err(Error::parameter("force_n", force_n, "must be positive and finite, N"));
    }
    let length_mm = way.length_mm();
    let least_mm = way.least_radius_mm();
    let wanted = (POINTS_PER_RADIUS * length_mm / least_mm).clamp(POINTS[0], POINTS[1]);
    // The solver has blocks of two.
    let count = 2 * (0.5 * wanted).ceil() as usize;
    let spacing_mm = length_mm / (count - 1) as f64;
    let arcs: Vec<f64> = (0..count).map(|k| spacing_mm * k as f64).collect();
    let places: Vec<(Vec3, f64)> = arcs.iter().map(|arc_mm| way.place(*arc_mm)).collect();
    let passed: Vec<(f64, f64)> =
        arcs.iter().map(|arc_mm| passes(device, length_mm - arc_mm, force_n)).collect();
    let mut room_mm: Vec<f64> =
        places.iter().zip(&passed).map(|(place, p)| (place.1 - p.0).max(0.0)).collect();
    let points: Vec<Vec3> = places.iter().map(|place| place.0).collect();
    // It comes out of its sheath in the middle of the inlet, along the way.
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
    // Both lines have their points at the same places of the way.
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

/// Length of a device from its tip that is no thicker than this, mm; infinite if all of it is.
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

/// Of the part of a device up to this far from its tip: the largest radius, and the smallest radius of curvature that all of it takes.
fn passes(device: &Device, from_tip_mm: f64, force_n: f64) -> (f64, f64) {
    // At the end of the way it is the tip itself that arrives.
    let from_tip_mm = from_tip_mm.max(f64::MIN_POSITIVE);
    let mut begin_mm = 0.0;
    let mut bears_mm = 0.0_f64;
    for section in device.sections() {
        if begin_mm >= from_tip_mm {
            break;
        }
        let [u, v] = section.rest_curvature_per_mm;
        let more_per_mm = (2.0 * force_n / section.bending_stiffness_nmm2).sqrt();
        bears_mm = bears_mm.max(1.0 / (libm::hypot(u, v) + more_per_mm));
        begin_mm += section.length_mm;
    }
    (device.max_radius_within(from_tip_mm), bears_mm)
}

/// Radius of the circle through a point of a line and those so many before and behind; of the nearest such at the ends.
fn bend_radius_mm(line: &[Vec3], at: usize, window: usize) -> f64 {
    let window = window.clamp(1, (line.len() - 1) / 2);
    let at = at.clamp(window, line.len() - 1 - window);
    let (a, b, c) = (line[at - window], line[at], line[at + window]);
    let (u, v) = (b - a, c - b);
    let area = u.cross(&v).norm();
    // Rounding bends a straight line by no more.
    if area <= 1e-9 * u.norm() * v.norm() {
        return f64::INFINITY;
    }
    u.norm() * v.norm() * (c - a).norm() / (2.0 * area)
}
