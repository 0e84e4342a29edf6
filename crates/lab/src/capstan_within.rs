//! D5 and D7: a wire that is pulled and pushed through a catheter with friction, or with a valve.

use std::f64::consts::FRAC_PI_2;

use super::Row;
use super::ends::{CATHETER, WIRE, force, free_space, push};
use endowire_core::Result;
use endowire_core::device::{Device, Instrument, Section, Stack};
use endowire_core::insertion::{Command, Move, Sheath, Simulation};

/// Length of the catheter, mm, and coefficient of friction.
const LENGTH_MM: f64 = 80.0;
const FRICTION: f64 = 0.15;
const WIRE_RADIUS_MM: f64 = 0.2;
/// Bending stiffness of both, N·mm².
const WIRE_NMM2: f64 = 20.0;
const CATHETER_NMM2: f64 = 60.0;

/// A wire with this rest curvature, which protrudes by 3 mm from a straight catheter.
fn bent(curvature_per_mm: f64, friction: f64) -> Result<Simulation> {
    bent_within(curvature_per_mm, friction, 0.0)
}

/// The same in a catheter with a valve on its hub.
fn bent_within(curvature_per_mm: f64, friction: f64, valve_n: f64) -> Result<Simulation> {
    let one = |name: &str, section: Section| -> Result<Instrument> {
        let device = Device::new(vec![section])?;
        Ok(Instrument { name: name.to_owned(), device, may_lead: true })
    };
    let wire = Section::straight(165.0, WIRE_RADIUS_MM, WIRE_NMM2);
    let wire = Section { rest_curvature_per_mm: [curvature_per_mm, 0.0], ..wire };
    let catheter = Section::straight(150.0, 0.8, CATHETER_NMM2);
    let catheter = Section { inner_radius_mm: Some(0.5), ..catheter };
    let stack = Stack::new(vec![one("wire", wire)?, one("catheter", catheter)?])?;
    let wall = free_space()?;
    let sheath = Sheath::at_opening(&wall.wall, wall.inlet, 1.0)?;
    let stack = stack.with_friction(vec![friction, 0.0])?.sealed(vec![0.0, valve_n])?;
    let mut simulation = Simulation::builder(wall.wall, stack, sheath).build()?;
    for _ in 0..40 {
        push(&mut simulation, &[(WIRE, (LENGTH_MM + 3.0) / 40.0), (CATHETER, LENGTH_MM / 40.0)])?;
    }
    Ok(simulation)
}

/// Together they form an arc of κ = κ₁EI₁/(EI₁ + EI₂), here of 90°. Where the wire comes out it is pulled by ½EI₁(κ₁²
/// − κ²) for any friction, and at the sheath by e^{μφ} times that while it is pulled back, by e^{−μφ} times that
/// while it is pushed.
pub(super) fn capstan() -> Result<Vec<Row>> {
    let curvature = FRAC_PI_2 / LENGTH_MM;
    let rest = curvature * (WIRE_NMM2 + CATHETER_NMM2) / WIRE_NMM2;
    let tension_n = 0.5 * WIRE_NMM2 * (rest * rest - curvature * curvature);
    let (mut smooth, mut rough) = (bent(rest, 0.0)?, bent(rest, FRICTION)?);
    let mut rows = Vec::new();
    for (quantity, way_mm, sign) in [("pulled back", -0.1, 1.0f64), ("pushed", 0.1, -1.0)] {
        push(&mut smooth, &[(WIRE, way_mm)])?;
        push(&mut rough, &[(WIRE, way_mm)])?;
        let ratio = 1.0 + (force(&smooth, WIRE) - force(&rough, WIRE)) / tension_n;
        let quantity = format!("axial force behind over before, {quantity}");
        let expected = (sign * FRICTION * FRAC_PI_2).exp();
        rows.push(Row::relative("D5 90°, μ = 0.15, 40 elements", &quantity, ratio, expected, 1e-2));
    }
    Ok(rows)
}

/// Force of the valve, N.
const VALVE_N: f64 = 0.3;

/// On a straight wire in a straight catheter only the valve acts: with F₀ against its motion, and in a combined
/// motion with the components of F₀ along and around the wire. The catheter's hand feels the reaction, and neither
/// hand feels anything if both move together. Between valve and hand the wire twists by what its hand turns more.
pub(super) fn valve() -> Result<Vec<Row>> {
    const NAME: &str = "D7 valve of 0.3 N, straight wire";
    let starts = [bent(0.0, 0.0)?, bent_within(0.0, 0.0, VALVE_N)?];
    let mut rows = Vec::new();
    let along = 0.2 / 0.2f64.hypot(WIRE_RADIUS_MM * 2.0);
    let around = WIRE_RADIUS_MM * (1.0 - along * along).sqrt();
    for (quantity, advance_mm, turn_rad, [push, torque]) in [
        ("pushed", 0.2, 0.0, [1.0, 0.0]),
        ("pulled back", -0.2, 0.0, [-1.0, 0.0]),
        ("pushed and turned", 0.2, 2.0, [along, around]),
    ] {
        let [mut plain, mut sealed] = starts.clone();
        let outside_mm = (165.0 - LENGTH_MM - 3.0 - advance_mm) - (150.0 - LENGTH_MM);
        let lag_rad = VALVE_N * torque * outside_mm / (WIRE_NMM2 / 1.3);
        let command = Command { advance_mm, rotate_rad: turn_rad + lag_rad, ..Command::default() };
        for simulation in [&mut plain, &mut sealed] {
            simulation.step_together(&[Move { instrument: WIRE, command }])?;
        }
        let felt = |index: usize| {
            let [with, without] = [&sealed, &plain].map(|one| one.report().hand(index));
            let push_n = with.push_force_n.unwrap_or(f64::NAN) - without.push_force_n.unwrap_or(f64::NAN);
            [push_n, with.torque_nmm - without.torque_nmm]
        };
        let taken_mj = sealed.report().dissipated_mj;
        let slip_mm = advance_mm.hypot(WIRE_RADIUS_MM * turn_rad);
        let [wire, catheter] = [felt(WIRE), felt(CATHETER)];
        let mut row = |what: &str, computed: f64, expected: f64| {
            let error = (computed - expected).abs();
            let quantity = format!("{what}, {quantity}");
            rows.push(Row::with_error(NAME, &quantity, computed, expected, error, 1e-9));
        };
        row("push of the wire", wire[0], VALVE_N * push);
        row("torque of the wire", wire[1], VALVE_N * torque);
        row("push of the catheter", catheter[0], -VALVE_N * push);
        row("energy taken, mJ", taken_mj, VALVE_N * slip_mm);
    }
    Ok(rows)
}
