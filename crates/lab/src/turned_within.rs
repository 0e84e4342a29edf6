//! D9: a wire that is rotated, and pushed, in a bent catheter with friction.

use super::Row;
use super::ends::{CATHETER, WIRE, force, free_space, push};
use endowire_core::Result;
use endowire_core::device::{Device, Instrument, Section, Stack};
use endowire_core::insertion::{Command, Move, Sheath, Simulation};
use endowire_core::methods::kirchhoff::KirchhoffOptions;

/// Length of the wire outside the body, mm.
const TAIL_MM: f64 = 103.0;
/// Length of the arc, mm, its curvature, 1/mm, and coefficient of friction.
const LENGTH_MM: f64 = 60.0;
const CURVATURE: f64 = 0.03;
const FRICTION: f64 = 0.2;
const WIRE_RADIUS_MM: f64 = 0.4;
/// Bending stiffness of both, N·mm².
const WIRE_NMM2: f64 = 200.0;
const CATHETER_NMM2: f64 = 600.0;
const ELEMENT_MM: f64 = 0.5;

/// A straight wire of this torsional stiffness, N·mm², which protrudes by 2 mm from a catheter that is curved
/// everywhere and does not twist.
fn bent(torsion_nmm2: f64, friction: f64) -> Result<Simulation> {
    let one = |name: &str, section: Section| -> Result<Instrument> {
        let device = Device::new(vec![section])?;
        Ok(Instrument { name: name.to_owned(), device, may_lead: true })
    };
    let wire = Section::straight(165.0, WIRE_RADIUS_MM, WIRE_NMM2);
    let wire = Section { torsional_stiffness_nmm2: Some(torsion_nmm2), ..wire };
    let rest = CURVATURE * (WIRE_NMM2 + CATHETER_NMM2) / CATHETER_NMM2;
    let catheter = Section {
        inner_radius_mm: Some(0.5),
        rest_curvature_per_mm: [rest, 0.0],
        torsional_stiffness_nmm2: Some(1e5),
        ..Section::straight(150.0, 0.8, CATHETER_NMM2)
    };
    let stack = Stack::new(vec![one("wire", wire)?, one("catheter", catheter)?])?;
    let wall = free_space()?;
    let sheath = Sheath::at_opening(&wall.wall, wall.inlet, 1.0)?;
    let options = KirchhoffOptions { element_mm: ELEMENT_MM, ..KirchhoffOptions::default() };
    let builder = Simulation::builder(wall.wall, stack.with_friction(vec![friction, 0.0])?, sheath);
    let mut simulation = builder.method(&options).build()?;
    push(&mut simulation, &[(WIRE, 2.0)])?;
    for _ in 0..30 {
        push(&mut simulation, &[(WIRE, LENGTH_MM / 30.0), (CATHETER, LENGTH_MM / 30.0)])?;
    }
    Ok(simulation)
}

fn go(simulation: &mut Simulation, advance_mm: f64, rotate_rad: f64) -> Result<()> {
    let command = Command { advance_mm, rotate_rad, ..Command::default() };
    simulation.step_together(&[Move { instrument: WIRE, command }]).map(|_| ())
}

/// The wire presses with n = ½EI₁κ³ per length, as N₁ + ½EI₁κ² = 0 if nothing holds it along the line, and dM/ds = −μ
/// r n where it rotates, up to a length ℓ, beyond which it sticks. Outside it twists over the length T of its tail under M = μ r n ℓ, so
/// that its hand rotates by θ = μ r n (ℓ²/2 + ℓ T)/GJ. All of it rotates once ℓ = L; its tip then lags by that.
///
/// Pushed by Δ and rotated by θ in each step it slips by (Δ, r θ): the force along the line grows by e^{μφ cos α}
/// with tan α = r θ/Δ, and the torque is r tan α times the increase.
pub(super) fn turned() -> Result<Vec<Row>> {
    const SOFT_NMM2: f64 = 0.5;
    const STIFF_NMM2: f64 = 100.0;
    const NAME: &str = "D9 103°, μ = 0.2, 120 elements";
    let couple = FRICTION * WIRE_RADIUS_MM * 0.5 * WIRE_NMM2 * CURVATURE.powi(3);
    let lag_rad = couple * (0.5 * LENGTH_MM + TAIL_MM) * LENGTH_MM / SOFT_NMM2;
    let mut rows = Vec::new();
    let mut row = |quantity: &str, computed: f64, expected: f64| {
        rows.push(Row::relative(NAME, quantity, computed, expected, 1e-2));
    };
    let mut turning = bent(SOFT_NMM2, FRICTION)?;
    for quarter in 1..=8 {
        go(&mut turning, 0.0, 0.25 * lag_rad)?;
        let reported = turning.report().instruments[WIRE];
        match quarter {
            2 => row(
                "torque, half of the way that turns all",
                reported.torque_nmm,
                couple * ((TAIL_MM * TAIL_MM + SOFT_NMM2 * lag_rad / couple).sqrt() - TAIL_MM),
            ),
            8 => {
                row("torque, all of it turns", reported.torque_nmm, couple * LENGTH_MM);
                row("lag of the tip, rad", reported.rotation_rad - reported.tip_rotation_rad, lag_rad);
            }
            _ => {}
        }
    }
    let loose = force(&bent(STIFF_NMM2, 0.0)?, WIRE);
    for turn_rad in [0.0f64, 0.25, 1.0] {
        let mut pushed = bent(STIFF_NMM2, FRICTION)?;
        for _ in 0..4 {
            go(&mut pushed, 0.1, turn_rad)?;
        }
        let slope = WIRE_RADIUS_MM * turn_rad / 0.1;
        let built_up = (FRICTION * CURVATURE * LENGTH_MM / slope.hypot(1.0)).exp() - 1.0;
        let expected = 0.5 * WIRE_NMM2 * CURVATURE * CURVATURE * built_up;
        let how = format!("pushed by 0.1 mm and turned by {turn_rad} rad a step");
        row(&format!("friction along the line, {how}"), force(&pushed, WIRE) - loose, expected);
        if turn_rad > 0.0 {
            let torque_nmm = pushed.report().instruments[WIRE].torque_nmm;
            row(&format!("torque, {how}"), torque_nmm, WIRE_RADIUS_MM * slope * expected);
        }
    }
    Ok(rows)
}
