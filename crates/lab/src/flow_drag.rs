//! C9: drag of Poiseuille flow in a straight tube on a wire: along its axis, which the hand balances, and across it,
//! which bends it.

use std::f64::consts::PI;

use super::Row;
use endowire_core::device::Device;
use endowire_core::flow::{BloodFlow, VesselFlow};
use endowire_core::insertion::{Command, Sheath, Simulation};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution};
use endowire_core::{Result, Vec3};

const TUBE_MM: f64 = 4.0;
const WIRE_MM: f64 = 0.2;
const INFLOW_ML_PER_S: f64 = 20.0;
const VISCOSITY_MPA_S: f64 = 3.5;

/// A wire from `start` along `direction` into a tube along z in which blood flows upwards.
fn wire(stiffness_nmm2: f64, start: Vec3, direction: Vec3) -> Result<Simulation> {
    let node = |z: f64, parent| CentrelineNode { position_mm: Vec3::z() * z, radius_mm: TUBE_MM, parent };
    let tree =
        CentrelineTree::new((0..=30).map(|k: usize| node(5.0 * k as f64, k.checked_sub(1))).collect())?;
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(1.5))?;
    let flow = VesselFlow {
        inflow_ml_per_s: INFLOW_ML_PER_S,
        inlet_mm: Some([0.0; 3]),
        split_exponent: 3.0,
        viscosity_mpa_s: VISCOSITY_MPA_S,
    };
    let device = Device::uniform(120.0, WIRE_MM, stiffness_nmm2)?;
    Simulation::builder(made.wall, device, Sheath::new(start, direction)?)
        .flow(Some(BloodFlow::new(&tree, &flow)?))
        .method(&KirchhoffOptions { element_mm: 2.0, ..KirchhoffOptions::default() })
        .build()
}

/// Along the axis the drag per length is ½πG((R² − a²)/ln(R/a) − 2a²), G = 8μQ/πR⁴ (Bird, Stewart and Lightfoot,
/// *Transport Phenomena*, section 2.4). Across a diameter the drag on a thin thread, a ≪ R, is twice 2πμu/ln((R² −
/// e²)/aR) with u = G(R² − e²)/4μ, and it bends like a beam.
pub(super) fn drag() -> Result<Vec<Row>> {
    let gradient = 8.0 * VISCOSITY_MPA_S * 1e-9 * INFLOW_ML_PER_S * 1e3 / (PI * TUBE_MM.powi(4));
    let mut along = wire(20.0, Vec3::z() * 5.0, Vec3::z())?;
    for _ in 0..20 {
        along.step(Command::advance(5.0))?;
    }
    let [outer, inner] = [TUBE_MM, WIRE_MM].map(|r| r * r);
    let annulus = 0.5 * PI * gradient * ((outer - inner) / (TUBE_MM / WIRE_MM).ln() - 2.0 * inner);
    let name = "C9 Poiseuille flow, 100 mm on the axis";
    let force_n = -along.report().push_force_n;
    let mut rows = vec![Row::relative(name, "force that the hand holds", force_n, 100.0 * annulus, 1e-6)];

    let (length_mm, stiffness) = (3.0, 0.02);
    let mut across = wire(stiffness, Vec3::new(-3.0, 0.0, 75.0), Vec3::x())?;
    for _ in 0..30 {
        across.step(Command::advance(0.1))?;
    }
    const PARTS: u32 = 3000;
    let bent = (0..PARTS).map(|k| {
        let s = length_mm * (f64::from(k) + 0.5) / f64::from(PARTS);
        let room = outer - (3.0 - s) * (3.0 - s);
        let load = 2.0 * 2.0 * PI * (0.25 * gradient * room) / (room / (WIRE_MM * TUBE_MM)).ln();
        load * s * s * (3.0 * length_mm - s) / 6.0
    });
    let expected = bent.sum::<f64>() * length_mm / f64::from(PARTS) / stiffness;
    let tip_mm = across.shape().tip_mm().unwrap_or_default().z - 75.0;
    let name = "C9 Poiseuille flow, 3 mm across it";
    rows.push(Row::relative(name, "deflection against that of a thin thread", tip_mm, expected, 0.02));
    Ok(rows)
}
