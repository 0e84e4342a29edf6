//! A device, a vessel and a target, drawn at random.

use endowire_core::device::{Device, Section};
use endowire_core::vessel::{CentrelineEnd, CentrelinePath, ExtractedCentreline};
use endowire_core::{Error, Result};

use super::vessels::Vessel;
use super::{between, decades};
use crate::noise::Noise;

/// Radii and bending stiffnesses of devices, mm and N·mm²: from a microwire to a guiding catheter.
const RADIUS_MM: [f64; 2] = [0.15, 1.5];
const STIFFNESS_NMM2: [f64; 2] = [1.0, 3000.0];
/// The radius of every other device is so many of the least radius of its way, if that is a device's: what barely passes is the hard question.
const HARDLY: [f64; 2] = [0.6, 1.4];
/// Lengths of most devices over that of the way, and of the one in so many that is too short.
const LONG: [f64; 2] = [1.2, 1.6];
const SHORT: [f64; 2] = [0.4, 0.9];
const ONE_IN: usize = 8;
/// Length of a soft tip over that of the device, its radius over that of the shaft, and radii of bent tips, mm.
const TIP: [f64; 2] = [0.05, 0.3];
const THIN: [f64; 2] = [0.4, 1.0];
const TIP_BEND_MM: [f64; 2] = [8.0, 40.0];
/// A tip is bent by no less than so many of its radii.
const TIP_BEND_RADII: f64 = 3.0;
/// Vessels that are drawn until one can be made: a bend of an anatomy may be tighter than the vessel is wide.
const VESSELS: usize = 50;

/// Does this device come to the end of this way in this vessel?
pub struct Question {
    /// In words.
    pub what: String,
    /// The vessel.
    pub vessel: Vessel,
    /// The device.
    pub device: Device,
    /// The way: as the vessel was drawn, or found in its wall.
    pub way: CentrelinePath,
}

impl Question {
    /// That of a seed.
    ///
    /// # Errors
    /// A vessel in which no way is found; none that a seed is to blame for otherwise.
    pub fn new(seed: u64) -> Result<Self> {
        let mut random = Noise::new(seed);
        let mut drawn = Vessel::draw(&mut random);
        for _ in 1..VESSELS {
            if drawn.is_ok() {
                break;
            }
            drawn = Vessel::draw(&mut random);
        }
        let vessel = drawn?;
        let (way, to) = way(&mut random, &vessel)?;
        let (device, made) = device(&mut random, &way)?;
        Ok(Self { what: format!("{}; {to}; {made}", vessel.what), vessel, device, way })
    }
}

/// The way to the end of a vessel or to a place on its last half, and what it is.
fn way(random: &mut Noise, vessel: &Vessel) -> Result<(CentrelinePath, String)> {
    let nodes = vessel.tree.nodes();
    let last = nodes.len() - 1;
    let to_end = random.happens(0.5);
    let row = if to_end { last } else { (last + random.below(last)).div_ceil(2) };
    let place_mm = nodes[row].position_mm;
    let nowhere = || Error::parameter("row", row, "is where the way begins");
    if random.happens(0.5) {
        let way = vessel.tree.path_to(row).ok_or_else(nowhere)?;
        return Ok((way, format!("to row {row} of {last}")));
    }
    let to = match vessel.opening_near(&place_mm).filter(|opening| to_end && *opening != vessel.inlet) {
        Some(opening) => CentrelineEnd::Opening(opening),
        None => CentrelineEnd::Place(place_mm),
    };
    let found = ExtractedCentreline::of(&vessel.wall, Some(CentrelineEnd::Opening(vessel.inlet)), &[to])?;
    let row = found.tree.targets().first().map_or(0, |target| target.row);
    let way = found.tree.path_to(row).ok_or_else(nowhere)?;
    let [x, y, z] = place_mm.into();
    Ok((way, format!("to [{x:.1}, {y:.1}, {z:.1}], found in the wall")))
}

/// A wire, one with a thin soft tip, or one with a bent tip, and what it is.
fn device(random: &mut Noise, way: &CentrelinePath) -> Result<(Device, String)> {
    let (any_mm, stiffness_nmm2) = (decades(random, RADIUS_MM), decades(random, STIFFNESS_NMM2));
    let hardly_mm = between(random, HARDLY) * way.least_radius_mm();
    let is_hard = random.happens(0.5) && (RADIUS_MM[0]..RADIUS_MM[1]).contains(&hardly_mm);
    let radius_mm = if is_hard { hardly_mm } else { any_mm };
    let lengths = if random.below(ONE_IN) == 0 { SHORT } else { LONG };
    let length_mm = between(random, lengths) * way.length_mm();
    let shaft = Section::straight(length_mm, radius_mm, stiffness_nmm2);
    let tip_mm = between(random, TIP) * length_mm;
    let about = format!("{length_mm:.0} mm, radius {radius_mm:.3} mm, {stiffness_nmm2:.3} N·mm²");
    let with_tip = |tip: Section| {
        let rest = Section { length_mm: length_mm - tip.length_mm, ..shaft };
        Device::new(vec![tip, rest])
    };
    Ok(match random.below(3) {
        0 => (Device::new(vec![shaft])?, about),
        1 => {
            let thin = between(random, THIN);
            // As of a solid wire: with the fourth power of the radius.
            let bending_stiffness_nmm2 = STIFFNESS_NMM2[0].max(stiffness_nmm2 * thin.powi(4));
            let radius_mm = RADIUS_MM[0].max(thin * radius_mm);
            let soft = Section { length_mm: tip_mm, radius_mm, bending_stiffness_nmm2, ..shaft };
            (with_tip(soft)?, format!("{about}, {tip_mm:.0} mm of tip {thin:.2} as thick"))
        }
        _ => {
            let bend_mm = between(random, TIP_BEND_MM).max(TIP_BEND_RADII * radius_mm);
            let length_mm = tip_mm.min(bend_mm);
            let bent = Section { length_mm, rest_curvature_per_mm: [1.0 / bend_mm, 0.0], ..shaft };
            (with_tip(bent)?, format!("{about}, {length_mm:.0} mm of tip bent by {bend_mm:.0} mm"))
        }
    })
}
