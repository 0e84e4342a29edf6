//! D8: the effect of clearance between instruments, which the shared line neglects unless it is given play.
//!
//! Here a wire and a catheter are two beams with small deflections w₁ and w₂, held together at the sheath and kept
//! within the clearance δ of each other where both are, |w₁ − w₂| ≤ δ; the wire continues beyond the catheter's tip.
//! Their difference u = w₁ − w₂ lies on one side of the lumen, and over a last length ℓ it crosses to the other. If
//! their free curvatures at the tip differ by Δκ, u″ increases linearly to that from 0 where u leaves its side, so
//! that
//!
//! ```text
//! 2δ = Δκ ℓ²/6,    u′ = Δκ ℓ/2 = √(3 δ Δκ)
//! ```
//!
//! at the tip, of which the stiffer instrument takes the smaller part. A rest curvature κ⁰ of the wire gives Δκ = κ⁰,
//! a force F across the wire at a beyond the tip Δκ = F a/EI₁. On a bent line these are deflections from the line, if
//! ℓ is small compared with its radius.

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

use super::{Row, section, unit_rod};
use endowire_core::statics::{Instrument, Load, LoadKind, Rod, StaticCase};
use endowire_core::{Error, Result};

/// Length of the catheter, and of the wire beyond it, mm.
const LENGTH_MM: f64 = 60.0;
const BEYOND_MM: f64 = 10.0;
/// Length of a beam element, mm.
const ELEMENT_MM: f64 = 1.0;
/// EI of the wire's end and of the catheter, N·mm²: a floppy tip in a 4 F catheter.
const WIRE_NMM2: f64 = 5.0;
const CATHETER_NMM2: f64 = 60.0;
/// Rest curvature of the wire, 1/mm, and force across its tip, N.
const CURVATURE_PER_MM: f64 = 0.04;
const FORCE_N: f64 = 0.05;
/// Clearances, mm.
const CLEARANCES_MM: [f64; 2] = [0.05, 0.2];
/// Stiffness of the lumen at a node, N/mm: it yields by nanometres.
const LUMEN_N_PER_MM: f64 = 1e6;
/// Largest number of changes of the active set.
const ROUNDS: usize = 200;
/// Part of clearance, rest curvature and force at which the shared line with play is compared: it has large deflections, and these
/// two beams small ones, in which all angles grow alike.
const SMALL: f64 = 1e-2;
/// Motion below which the iteration has converged, mm.
const SETTLED_MM: f64 = 1e-6;

/// Direction of the wire relative to the catheter at the catheter's tip, rad, and position of the wire's tip, mm.
struct Deflection {
    tilt_rad: f64,
    tip_mm: f64,
}

/// Two beams within a clearance of each other: cubic elements, and a primal-dual active set of the nodes in contact.
fn deflect(clearance_mm: f64, curvature_per_mm: f64, force_n: f64) -> Result<Deflection> {
    let both = (LENGTH_MM / ELEMENT_MM).round() as usize;
    let wire = both + (BEYOND_MM / ELEMENT_MM).round() as usize;
    // Deflection and slope of each node except the first, of the wire and then of the catheter.
    let (of_wire, of_catheter) = (|i: usize| 2 * (i - 1), |i: usize| 2 * (wire + i - 1));
    let count = 2 * (wire + both);
    let (mut stiffness, mut load) = (DMatrix::<f64>::zeros(count, count), DVector::<f64>::zeros(count));
    let h = ELEMENT_MM;
    let beam = Matrix4::new(
        12.0,
        6.0 * h,
        -12.0,
        6.0 * h, //
        6.0 * h,
        4.0 * h * h,
        -6.0 * h,
        2.0 * h * h, //
        -12.0,
        -6.0 * h,
        12.0,
        -6.0 * h, //
        6.0 * h,
        2.0 * h * h,
        -6.0 * h,
        4.0 * h * h,
    ) / (h * h * h);
    let turn = Vector4::new(0.0, -1.0, 0.0, 1.0);
    let mut add = |elements: usize, at: &dyn Fn(usize) -> usize, ei: f64, rest: f64| {
        for e in 0..elements {
            for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
                let row = |k: usize| (e + k / 2 > 0).then(|| at(e + k / 2) + k % 2);
                let Some(r) = row(i) else { continue };
                if let Some(c) = row(j) {
                    stiffness[(r, c)] += ei * beam[(i, j)];
                }
                if j == 0 {
                    load[r] += ei * rest * turn[i];
                }
            }
        }
    };
    add(wire, &of_wire, WIRE_NMM2, curvature_per_mm);
    add(both, &of_catheter, CATHETER_NMM2, 0.0);
    load[of_wire(wire)] += force_n;
    // Side that each node touches: 1, −1, or 0; without clearance all touch both.
    let tied = clearance_mm == 0.0;
    let mut sides = vec![f64::from(u8::from(tied)); both + 1];
    let mut before = DVector::<f64>::zeros(count);
    for _ in 0..ROUNDS {
        let (mut matrix, mut right) = (stiffness.clone(), load.clone());
        for i in (1..=both).filter(|i| sides[*i] != 0.0) {
            let (p, q) = (of_wire(i), of_catheter(i));
            for (r, c, sign) in [(p, p, 1.0), (q, q, 1.0), (p, q, -1.0), (q, p, -1.0)] {
                matrix[(r, c)] += sign * LUMEN_N_PER_MM;
            }
            right[p] += LUMEN_N_PER_MM * sides[i] * clearance_mm;
            right[q] -= LUMEN_N_PER_MM * sides[i] * clearance_mm;
        }
        let Some(factor) = matrix.cholesky() else { break };
        let w = factor.solve(&right);
        // Where both lie on each other without force, rounding decides which nodes are active.
        if tied || (&w - &before).amax() < SETTLED_MM {
            let tilt_rad = w[of_wire(both) + 1] - w[of_catheter(both) + 1];
            return Ok(Deflection { tilt_rad, tip_mm: w[of_wire(wire)] });
        }
        for i in 1..=both {
            let apart: f64 = w[of_wire(i)] - w[of_catheter(i)];
            sides[i] = if apart.abs() > clearance_mm { apart.signum() } else { 0.0 };
        }
        before = w;
    }
    Err(Error::Computation(format!("clearance {clearance_mm} mm: the nodes that touch do not settle")))
}

/// The tilt at the catheter's tip, rad, as the shared line with play has it.
fn tilt_of_line(clearance_mm: f64, curvature_per_mm: f64, force_n: f64) -> Result<f64> {
    let one = |name: &str, inserted: f64, ei: f64, curvature_per_mm: f64, clearance: f64| Instrument {
        name: name.to_owned(),
        inserted,
        hand: 0.0,
        clearance,
        section: vec![endowire_core::statics::Section {
            gj: Some(ei),
            rest_curvature: [curvature_per_mm, 0.0],
            ..section(2.0 * LENGTH_MM, ei)
        }],
    };
    let wire = one("wire", LENGTH_MM + BEYOND_MM, WIRE_NMM2, SMALL * curvature_per_mm, SMALL * clearance_mm);
    let instrument = vec![wire, one("catheter", LENGTH_MM, CATHETER_NMM2, 0.0, 0.0)];
    let load =
        Load { kind: LoadKind::Force, at: None, from: None, to: None, value: [0.0, SMALL * force_n, 0.0] };
    let elements = ((LENGTH_MM + BEYOND_MM) / ELEMENT_MM).round() as usize;
    let case = StaticCase {
        rod: Rod { length: 0.0, elements, section: vec![], instrument },
        load: vec![load],
        ..unit_rod(elements)
    };
    let solution = case.solve()?.checked()?;
    Ok(solution.instruments[1].tilt / SMALL)
}

/// The tilt at the catheter's tip compared with √(3 δ Δκ), and the displacement of the wire's tip from that without
/// clearance.
pub(super) fn clearance() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let arm = FORCE_N * BEYOND_MM / WIRE_NMM2;
    for (name, curvature_per_mm, force_n, difference) in
        [("bent wire", CURVATURE_PER_MM, 0.0, CURVATURE_PER_MM), ("pushed aside", 0.0, FORCE_N, arm)]
    {
        let without = deflect(0.0, curvature_per_mm, force_n)?;
        for clearance_mm in CLEARANCES_MM {
            let with = deflect(clearance_mm, curvature_per_mm, force_n)?;
            let off_mm = with.tip_mm - without.tip_mm;
            let quantity = format!("tilt, rad; {off_mm:.2} mm at the tip");
            let name = format!("D8 {name}, play {clearance_mm} mm");
            let expected = (3.0 * clearance_mm * difference).sqrt();
            rows.push(Row::relative(&name, &quantity, with.tilt_rad, expected, 2e-2));
            let line_rad = tilt_of_line(clearance_mm, curvature_per_mm, force_n)?;
            rows.push(Row::relative(
                &name,
                "tilt of the shared line with play, rad",
                line_rad,
                with.tilt_rad,
                3e-2,
            ));
        }
    }
    Ok(rows)
}
