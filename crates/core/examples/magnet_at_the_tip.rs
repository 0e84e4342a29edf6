//! A field of one's own: a wire with a magnet at its tip, steered by a magnet outside of the body.
//!
//! `cargo run -p endowire-core --example magnet_at_the_tip`

use std::ops::Range;
use std::sync::Arc;

use endowire_core::device::Device;
use endowire_core::field::{EnergyDensity, Field, MaterialPoint};
use endowire_core::insertion::{Command, Sheath, Simulation};
use endowire_core::nalgebra::Matrix3;
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};
use endowire_core::{Result, Vec3};

/// μ₀/4π, T·m/A.
const MU0_4PI: f64 = 1e-7;

/// The last millimetres of a wire, magnetised along its axis, in the field of a dipole far away.
///
/// u = −(m/l) B(r)·r′, with B(r) = μ₀/4π [3 (M·ρ) ρ/|ρ|⁵ − M/|ρ|³], ρ = r − r_M.
#[derive(Debug)]
struct Steered {
    length_mm: f64,
    moment_am2: f64,
    source_mm: Vec3,
    source_am2: Vec3,
}

impl Steered {
    /// The field at a place, T.
    fn field_t(&self, position_mm: &Vec3) -> Vec3 {
        let way_m = (position_mm - self.source_mm) * 1e-3;
        let distance_m = way_m.norm();
        let along = way_m * (3.0 * self.source_am2.dot(&way_m) / distance_m.powi(2));
        (along - self.source_am2) * (MU0_4PI / distance_m.powi(3))
    }

    /// Its derivative by the place, T/mm, column by column: differences will do for a field that changes over decimetres.
    fn gradient_t_per_mm(&self, position_mm: &Vec3) -> Matrix3<f64> {
        let column =
            |axis: Vec3| 0.5 * (self.field_t(&(position_mm + axis)) - self.field_t(&(position_mm - axis)));
        Matrix3::from_columns(&[column(Vec3::x()), column(Vec3::y()), column(Vec3::z())])
    }
}

impl Field for Steered {
    fn acts_on(&self, _instrument: usize) -> Range<f64> {
        0.0..self.length_mm
    }

    fn density(&self, point: &MaterialPoint) -> EnergyDensity {
        // A·m² T = J = 1000 mJ.
        let moment = -1e3 * self.moment_am2 / self.length_mm;
        let field = self.field_t(&point.position_mm) * moment;
        let gradient = self.gradient_t_per_mm(&point.position_mm) * moment;
        EnergyDensity {
            value: field.dot(&point.tangent),
            by_position: gradient.transpose() * point.tangent,
            by_tangent: field,
            by_position_and_tangent: gradient.transpose(),
            // A bend of the field over millimetres is left out: Newton's method then takes an iteration more.
            ..EnergyDensity::default()
        }
    }
}

pub(crate) fn main() -> Result<()> {
    let tree = anatomy::tree("aortic_arch").expect("a built-in anatomy");
    let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(3.0))?;
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 2.0)?;
    let tip_mm = sheath.position_mm + sheath.direction * 40.0;
    let across = sheath.direction.cross(&Vec3::y());
    let mut simulation =
        Simulation::builder(vessel.wall, Device::uniform(400.0, 0.45, 10.0)?, sheath).build()?;
    simulation.step(Command::advance(40.0))?;
    // A magnet of 970 A·m², held beside the body and brought nearer.
    for distance_mm in [300.0, 250.0, 200.0, 150.0] {
        let magnet = Steered {
            length_mm: 4.0,
            moment_am2: 4e-3,
            source_mm: tip_mm + across * distance_mm,
            source_am2: across * 970.0,
        };
        simulation.set_fields([Arc::new(magnet) as Arc<dyn Field>])?;
        let report = simulation.step(Command::default())?;
        println!(
            "magnet at {distance_mm:.0} mm: {:.3} mJ in the field, {} contacts, converged: {}",
            report.energy.field,
            report.contacts.len(),
            report.converged
        );
        let lateral_mm = (simulation.shape().tip_mm().expect("a tip") - tip_mm).dot(&across);
        println!("    the tip is {lateral_mm:.2} mm aside");
    }
    Ok(())
}
