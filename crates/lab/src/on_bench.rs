//! G: the bench tests against exact answers.

use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::Range;
use std::sync::Arc;

use endowire_core::device::{Device, Section};
use endowire_core::field::{EnergyDensity, Field, MaterialPoint};
use endowire_core::vessel::NoStore;
use endowire_core::{Result, Vec3};

use super::Row;
use super::bench::bend::BendTest;
use super::bench::push::{PushCurve, PushTest};
use super::bench::tip_load::TipLoadTest;
use super::bench::torque::{TorqueResponse, TorqueTest};
use super::bench::track::{Piece, Track, tube};
use super::whip;

/// Bending stiffness of the wires, N·mm², their radius and length, mm.
const EI: f64 = 10.0;
const WIRE_RADIUS_MM: f64 = 0.45;
const LENGTH_MM: f64 = 400.0;
/// Radius of the bend that wires are pushed through, and their clearance in it, mm.
const BEND_MM: f64 = 50.0;
const PLAY_MM: f64 = 0.1;
/// Straight lengths before and after the bend, mm.
const STRAIGHTS_MM: [f64; 2] = [20.0, 60.0];
/// Force against the tip, N, large against what it takes to bend the wire.
const AGAINST_TIP_N: f64 = 1.0;
/// Free length of tips, mm.
const FREE_MM: f64 = 10.0;

/// A device whose EI varies linearly by ± `slope` over this span in its middle, in sections of a hundredth of it.
fn tapered(span_mm: f64, slope: f64) -> Result<Device> {
    let sections = 100;
    let section = |k: usize| {
        let u = (2.0 * k as f64 + 1.0) / sections as f64 - 1.0;
        Section::straight(span_mm / sections as f64, WIRE_RADIUS_MM, EI * (1.0 + slope * u))
    };
    Device::new((0..sections).map(section).collect())
}

/// Apparent EI of a linear taper, over EI in the middle: 1/(1 + m²/10 + m⁴/35 + …) with ± m over the span, from the
/// deflection by unit loads ∝ ∫₀¹ (1 − u)²/(1 − m²u²) du.
fn taper_factor(slope: f64) -> f64 {
    let term = |n: i32| {
        let k = 2 * n;
        3.0 * slope.powi(k) * (1.0 / f64::from(k + 1) - 2.0 / f64::from(k + 2) + 1.0 / f64::from(k + 3))
    };
    1.0 / (0..40).map(term).sum::<f64>()
}

/// Three-point bending.
pub(super) fn three_point() -> Result<Vec<Row>> {
    let test = BendTest::default();
    let wire = Device::uniform(LENGTH_MM, WIRE_RADIUS_MM, EI)?;
    let mut rows = vec![uniform_row(&test, &wire, EI)?];
    for slope in [0.3, 0.6] {
        let found = test.rigidity(&tapered(test.span_mm, slope)?, 0.5 * test.span_mm)?;
        let name = format!("G1 taper ±{:.0} %", 100.0 * slope);
        rows.push(Row::relative(&name, "rigidity", found.rigidity_nmm2, EI * taper_factor(slope), 1e-3));
    }
    Ok(rows)
}

fn uniform_row(test: &BendTest, wire: &Device, ei: f64) -> Result<Row> {
    let found = test.rigidity(wire, 0.5 * LENGTH_MM)?;
    Ok(Row::relative("G1 uniform", "rigidity F L³/(48 δ)", found.rigidity_nmm2, ei, 1e-4))
}

/// Largest deviation of the tip's angle from the hand's, degrees.
fn off_hand_deg(response: &TorqueResponse) -> f64 {
    response.points.iter().map(|p| (p.hand_deg - p.tip_deg).abs()).fold(0.0, f64::max)
}

/// A straight wire turned at the end of the standard track.
fn turned(friction: f64) -> Result<TorqueResponse> {
    let test = TorqueTest { friction, turn_deg: 360.0, step_deg: 30.0 };
    test.run(&Device::uniform(LENGTH_MM, WIRE_RADIUS_MM, EI)?, &Track::standard()?, &NoStore)
}

/// Angle of the tip with λ = 2 in degrees at which the hand stands at `hand_deg`, on the branch where the tip is
/// behind, from θ″ = λ² sin θ: shooting from the tip, by bisection.
fn tip_at(hand_deg: f64, lambda: f64) -> f64 {
    let hand = |tip_rad: f64| {
        let steps = 2000;
        let h = -1.0 / f64::from(steps);
        let slope = |y: [f64; 2]| [y[1], lambda * lambda * libm::sin(y[0])];
        let step = |y: [f64; 2], k: [f64; 2], f: f64| [y[0] + f * k[0], y[1] + f * k[1]];
        let mut y = [tip_rad, 0.0];
        for _ in 0..steps {
            let a = slope(y);
            let b = slope(step(y, a, h / 2.0));
            let c = slope(step(y, b, h / 2.0));
            let d = slope(step(y, c, h));
            y = [0, 1].map(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
        y[0].to_degrees()
    };
    // Up to the jump the hand's angle grows with the tip's.
    let (mut low, mut high) = (0.0, 100f64.to_radians());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if hand(middle) < hand_deg { low = middle } else { high = middle }
    }
    low.to_degrees()
}

/// Torque response.
pub(super) fn torque() -> Result<Vec<Row>> {
    /// Hand and tip at the jump of B5 with λ = 2, degrees.
    const JUMP_DEG: [f64; 2] = [197.785_614_25, 116.721_008_58];
    let off_deg = off_hand_deg(&turned(0.0)?);
    let mut rows =
        vec![Row::with_error("G2 straight wire, μ=0", "tip against hand, °", off_deg, 0.0, off_deg, 1e-6)];
    let whip = whipped(2.0, 1.0)?;
    // After the jump the tip is ahead: the mirror image of the branch on which it is behind.
    let after_deg = 360.0 - tip_at(360.0 - JUMP_DEG[0], 2.0);
    let at_deg = whip.whip_at_deg.unwrap_or_default();
    rows.push(Row::relative("G2 B5 λ=2, play 0.05 mm", "hand at the whip, °", at_deg, JUMP_DEG[0], 2e-2));
    let expected_deg = after_deg - JUMP_DEG[1];
    rows.push(Row::relative("G2 B5 λ=2, play 0.05 mm", "whip, °", whip.largest_whip_deg, expected_deg, 5e-2));
    let none = whipped(1.0, 5.0)?.largest_whip_deg;
    rows.push(Row::with_error("G2 B5 λ=1, play 0.05 mm", "whip, °", none, 0.0, none, 0.0));
    Ok(rows)
}

/// Half a turn and more of the wire of B5.
fn whipped(lambda: f64, step_deg: f64) -> Result<TorqueResponse> {
    TorqueTest { friction: 0.0, turn_deg: 210.0, step_deg }.turn(&mut whip::in_tube(lambda, 0.05)?)
}

/// A dead force on the last millimetres of a device, in total `force_n`.
#[derive(Debug)]
struct AtTip {
    force_n: Vec3,
}

/// Length on which it acts, mm.
const AT_TIP_MM: f64 = 2.0;

impl Field for AtTip {
    fn acts_on(&self, _: usize) -> Range<f64> {
        0.0..AT_TIP_MM
    }

    fn density(&self, point: &MaterialPoint) -> EnergyDensity {
        let force_n_per_mm = self.force_n / AT_TIP_MM;
        let value = -force_n_per_mm.dot(&point.position_mm);
        EnergyDensity { value, by_position: -force_n_per_mm, ..EnergyDensity::default() }
    }
}

/// A bend of 90° between straight lengths, or a straight tube.
fn bent(angle_rad: f64) -> Result<Track> {
    let [before, after] = STRAIGHTS_MM;
    let bend = Piece::Bend { radius_mm: BEND_MM, angle_rad, roll_rad: 0.0 };
    let straight = |length_mm| Piece::Straight { length_mm };
    let pieces = [straight(before), bend, straight(after)];
    let pieces = if angle_rad == 0.0 { vec![pieces[0], pieces[2]] } else { pieces.to_vec() };
    Track::of_tree(tube(&pieces, WIRE_RADIUS_MM + PLAY_MM)?)
}

/// A wire pushed to the middle of the bend or, if `through`, to the middle of the straight behind it, where a force
/// against its tip sets in before the last 8 mm.
fn pushed(angle_rad: f64, friction: f64, through: bool, against_tip_n: f64) -> Result<PushCurve> {
    let [before, after] = STRAIGHTS_MM;
    let bend_mm = BEND_MM * angle_rad;
    let reach_mm = if through { before + bend_mm + 0.5 * after } else { before + 0.5 * bend_mm };
    let wire = Device::uniform(LENGTH_MM, WIRE_RADIUS_MM, EI)?;
    let mut simulation = bent(angle_rad)?.simulation(&wire, friction, &NoStore)?;
    let test = PushTest { friction, step_mm: 2.0 };
    test.push(&mut simulation, reach_mm - 8.0);
    let back = -Vec3::new(libm::cos(angle_rad), libm::sin(angle_rad), 0.0);
    simulation.set_fields([Arc::new(AtTip { force_n: back * against_tip_n }) as Arc<dyn Field>])?;
    Ok(test.push(&mut simulation, 8.0))
}

/// The force at the end of a push.
fn last_n(curve: &PushCurve) -> f64 {
    curve.points.last().map_or(f64::NAN, |point| point.push_force_n)
}

/// Push along a track.
pub(super) fn push() -> Result<Vec<Row>> {
    let straight_n = pushed(0.0, 0.0, true, 0.0)?.largest_push_n.abs();
    let mut rows =
        vec![Row::with_error("G3 straight tube, μ=0", "push force, N", straight_n, 0.0, straight_n, 1e-9)];
    let in_bend_n = last_n(&pushed(FRAC_PI_2, 0.0, false, 0.0)?);
    let expected_n = EI / (2.0 * BEND_MM * BEND_MM);
    rows.push(Row::relative("G3 in a bend, μ=0", "push force EI/2R², N", in_bend_n, expected_n, 5e-2));
    for friction in [0.1, 0.3] {
        rows.push(capstan_row(friction, friction)?);
    }
    Ok(rows)
}

/// What a force against the tip adds to the push force behind a bend with friction, against the capstan's ratio for
/// `expected` friction.
pub(crate) fn capstan_row(friction: f64, expected: f64) -> Result<Row> {
    let added_n = last_n(&pushed(FRAC_PI_2, friction, true, AGAINST_TIP_N)?)
        - last_n(&pushed(FRAC_PI_2, friction, true, 0.0)?);
    let name = format!("G3 behind a bend of 90°, μ={friction}");
    let ratio = added_n / AGAINST_TIP_N;
    Ok(Row::relative(&name, "force of hand over tip", ratio, libm::exp(expected * FRAC_PI_2), 3e-2))
}

/// Force on the surface at a stroke, times L²/EI.
fn pressed(ei: f64, friction: f64, stroke_mm: f64) -> Result<f64> {
    let test = TipLoadTest { free_length_mm: FREE_MM, stroke_mm, friction, readings: 20 };
    let load = test.run(&Device::uniform(LENGTH_MM, 0.2, ei)?)?;
    let last_n = load.points.last().map_or(f64::NAN, |point| point.force_n);
    Ok(last_n * FREE_MM * FREE_MM / EI)
}

/// Tip load.
pub(super) fn tip_load() -> Result<Vec<Row>> {
    // The elastica of A3 with a tip angle of 60°.
    const STROKE: f64 = 1.0 - 0.741_019_606_076;
    let row =
        |name: &str, found: f64, expected: f64| Row::relative(name, "force F L²/EI", found, expected, 2e-3);
    Ok(vec![
        row("G4 buckles, slides freely", pressed(EI, 0.0, 0.011)?, PI * PI / 4.0),
        row("G4 buckled by 60°, slides freely", pressed(EI, 0.0, STROKE * FREE_MM)?, 2.841_754_258_75),
        row("G4 buckles, held by friction", pressed(EI, 0.5, 0.011)?, 20.190_728_556_43),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_stiffness_and_a_taper_without_its_correction_are_seen() {
        let test = BendTest::default();
        let wire = Device::uniform(LENGTH_MM, WIRE_RADIUS_MM, 1.001 * EI).unwrap();
        assert!(!uniform_row(&test, &wire, EI).unwrap().pass);
        let found = test.rigidity(&tapered(test.span_mm, 0.3).unwrap(), 0.5 * test.span_mm).unwrap();
        assert!(!Row::relative("", "", found.rigidity_nmm2, EI, 1e-3).pass, "{found:?}");
        assert!((taper_factor(0.3) - 1.0 / (1.0 + 0.009 + 0.0081 / 35.0)).abs() < 1e-4);
    }

    #[test]
    fn friction_and_another_whip_are_seen() {
        assert!(off_hand_deg(&turned(0.1).unwrap()) > 0.1);
        // λ 2.5 snaps at 229° (D2), beyond this turn.
        assert!(whipped(2.5, 2.0).unwrap().whip_at_deg.is_none());
    }

    #[test]
    fn another_coefficient_is_seen_in_the_push() {
        assert!(!capstan_row(0.3, 0.25).unwrap().pass);
        assert!(last_n(&pushed(0.0, 0.1, true, 0.5).unwrap()) > 0.4, "a force against the tip arrives");
    }

    #[test]
    fn another_stiffness_is_seen_in_the_tip_load() {
        let found = pressed(1.01 * EI, 0.0, 0.011).unwrap();
        assert!(!Row::relative("", "", found, PI * PI / 4.0, 2e-3).pass, "{found}");
    }
}
