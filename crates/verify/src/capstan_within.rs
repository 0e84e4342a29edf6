//! D5: a wire that is pulled and pushed through a catheter which rubs on it.

use std::f64::consts::FRAC_PI_2;

use super::Row;
use super::ends::{CATHETER, WIRE, force, free_space, push};
use endowire_core::Result;
use endowire_core::device::{Device, Instrument, Section, Stack};
use endowire_core::insertion::{Sheath, Simulation};

/// Length of the catheter, mm, and coefficient of friction.
const LENGTH_MM: f64 = 80.0;
const FRICTION: f64 = 0.15;
/// Bending stiffness of both, N·mm².
const WIRE_NMM2: f64 = 20.0;
const CATHETER_NMM2: f64 = 60.0;

/// A wire with this rest curvature comes out of a straight catheter by 3 mm.
fn bent(curvature_per_mm: f64, friction: f64) -> Result<Simulation> {
    let one = |name: &str, section: Section| -> Result<Instrument> {
        let device = Device::new(vec![section])?;
        Ok(Instrument { name: name.to_owned(), device, may_lead: true })
    };
    let wire = Section::straight(165.0, 0.2, WIRE_NMM2);
    let wire = Section { rest_curvature_per_mm: [curvature_per_mm, 0.0], ..wire };
    let catheter = Section::straight(150.0, 0.8, CATHETER_NMM2);
    let catheter = Section { inner_radius_mm: Some(0.5), ..catheter };
    let stack = Stack::new(vec![one("wire", wire)?, one("catheter", catheter)?])?;
    let wall = free_space()?;
    let sheath = Sheath::at_opening(&wall.wall, wall.inlet, 1.0)?;
    let stack = stack.rubbing(vec![friction, 0.0])?;
    let mut simulation = Simulation::builder(wall.wall, stack, sheath).build()?;
    for _ in 0..40 {
        push(&mut simulation, &[(WIRE, (LENGTH_MM + 3.0) / 40.0), (CATHETER, LENGTH_MM / 40.0)])?;
    }
    Ok(simulation)
}

/// Both make an arc of κ = κ₁EI₁/(EI₁ + EI₂), here of 90°. Where the wire comes out it is pulled by ½EI₁(κ₁² − κ²) whatever rubs, and at the
/// sheath by e^{μφ} times that while it is pulled back, by e^{−μφ} times that while it is pushed.
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
