//! C7: walls with regions.
//!
//! A long rod under a load q per length on a floor of modulus k₁ left and k₂ right of x = 0 sinks by q/kᵢ far from there. With
//! λᵢ = (kᵢ/4EI)^¼ and r = λ₂/λ₁ the beam equation EI p⁗ + k p = q has, where p and three derivatives are continuous,
//!
//! ```text
//! p(0) = q/k₂ + (q/k₁ − q/k₂) / (1 + r²),    p′(0) = −2 λ₂ (q/k₁ − q/k₂) r / ((1 + r) (1 + r²))
//! ```
//!
//! (Hetényi, *Beams on elastic foundation*, 1946). A rope drawn over a bend with friction only within an angle φ
//! needs e^{μφ} times the force.

use super::Row;
use super::capstan::{BEND, PLAY, RADIUS, STRAIGHT, drawn, rigid};
use super::channel::with_regions;
use super::contact::falling;

use endowire_core::insertion::{WallProperties, WallRegion};
use endowire_core::statics::WallRodSpec;
use endowire_core::{Result, Vec3};

/// EI of the rod in N·mm², its radius and half its length in mm, moduli left and right in N/mm².
const BENDING: f64 = 160.0;
const WIRE_RADIUS: f64 = 0.45;
const HALF: f64 = 60.0;
const MODULI: [f64; 2] = [1.0, 10.0];
/// Depth far on the left, mm.
const DEEP: f64 = 0.02;
/// Number of elements of the rod; the edge of the region is at the middle.
const ELEMENTS: usize = 240;

/// A rod on a floor with two moduli: depths at a quarter, the middle and three quarters, and slope in the middle.
struct OnTwo {
    depths: [f64; 3],
    slope: f64,
}

/// The modulus changes over `transition_mm`, on triangles with sides of that length.
fn on_two(moduli: [f64; 2], transition_mm: f64) -> Result<OnTwo> {
    // A ball so large that its surface is flat here.
    let radius_mm = 1e5;
    let right = WallRegion {
        centre_mm: Some([HALF + radius_mm, 0.0, 0.0]),
        radius_mm: Some(radius_mm),
        transition_mm: Some(transition_mm),
        modulus_n_per_mm2: Some(moduli[1]),
        ..WallRegion::default()
    };
    let setup = WallRodSpec {
        length: 2.0 * HALF,
        bending: BENDING,
        radius: WIRE_RADIUS,
        elements: ELEMENTS,
        modulus: moduli[0],
    };
    let mut channel = with_regions(&setup, [DEEP - WIRE_RADIUS, 2.0], transition_mm, vec![right])?;
    channel.loads.distributed = vec![(0, ELEMENTS, Vec3::y() * -(moduli[0] * DEEP))];
    channel.solve()?;
    let depth = |node: usize| DEEP - channel.state.positions[node].y;
    Ok(OnTwo {
        depths: [ELEMENTS / 4, ELEMENTS / 2, 3 * ELEMENTS / 4].map(depth),
        slope: -channel.state.frames[ELEMENTS / 2].t.y,
    })
}

fn two_moduli() -> Result<Vec<Row>> {
    let [left, right] = MODULI.map(|k| MODULI[0] * DEEP / k);
    let stiff = (0.25 * MODULI[1] / BENDING).powf(0.25);
    let r = (MODULI[1] / MODULI[0]).powf(0.25);
    let rise = (left - right) / (1.0 + r * r);
    let slope = -2.0 * stiff * rise * r / (1.0 + r);
    let found = [1.0, 0.5, 0.25].map(|transition| on_two(MODULI, transition));
    let [coarse, middle, fine] = found;
    let (coarse, middle, fine) = (coarse?, middle?, fine?);
    let error = |found: &OnTwo| (found.depths[1] / (right + rise) - 1.0).abs();
    // The transition shifts the edge by a fraction of its width.
    let at_edge = |of: &dyn Fn(&OnTwo) -> f64| 2.0 * of(&fine) - of(&middle);
    let (name, bound) = ("C7 two moduli, h = 0.5 mm", 1e-2);
    Ok(vec![
        Row::relative(name, "depth on the soft side", fine.depths[0], left, bound),
        Row::relative(name, "depth on the stiff side", fine.depths[2], right, bound),
        Row::relative(name, "depth at the edge", at_edge(&|found| found.depths[1]), right + rise, bound),
        Row::relative(name, "slope at the edge", at_edge(&|found| found.slope), slope, bound),
        falling(name, "error there, width 1 … 0.25 mm", &[&coarse, &middle, &fine].map(error), 0.6),
    ])
}

/// The wall of the capstan with friction `outside`, but `inside` in a ball of `radius_mm` about the middle of the
/// bend, and the angle of the bend within it.
fn rough_part(outside: f64, inside: f64, radius_mm: f64) -> (WallProperties, f64) {
    // The wire lies on the inner side of the bend.
    let inner = BEND - RADIUS - PLAY;
    let region = WallRegion {
        centre_mm: Some([STRAIGHT + inner, BEND, 0.0]),
        radius_mm: Some(radius_mm),
        transition_mm: Some(1.0),
        friction: Some(inside),
        ..WallRegion::default()
    };
    let properties = WallProperties { region: vec![region], ..rigid(outside) };
    (properties, 4.0 * (0.5 * radius_mm / inner).asin())
}

pub(super) fn regions() -> Result<Vec<Row>> {
    let mut rows = two_moduli()?;
    for (outside, inside) in [(0.0, 0.3), (0.3, 0.1)] {
        let (properties, part) = rough_part(outside, inside, 20.0);
        let (ratio, angle) = drawn(&properties, 0.4)?;
        let name = format!("C7 capstan, μ={inside} on {:.0}°, else {outside}", part.to_degrees());
        let expected = (inside * part + outside * (angle - part)).exp();
        rows.push(Row::relative(&name, "ratio of forces", ratio, expected, 1e-2));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_modulus_and_another_region_are_seen() {
        let off = |found: f64, expected: f64| !Row::relative("", "", found, expected, 1e-2).pass;
        let (here, stiffer) = (on_two(MODULI, 0.5).unwrap(), on_two([1.0, 11.0], 0.5).unwrap());
        assert!(off(stiffer.depths[2], here.depths[2]) && off(stiffer.depths[1], here.depths[1]));
        let (properties, _) = rough_part(0.0, 0.3, 19.0);
        let (_, part) = rough_part(0.0, 0.3, 20.0);
        assert!(off(drawn(&properties, 0.4).unwrap().0, (0.3 * part).exp()));
    }
}
