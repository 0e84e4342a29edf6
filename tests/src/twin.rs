//! The same insertion into two surfaces, and how far apart the results are.

use endowire_core::Vec3;
use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation};
use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_lab::crossing::curve;

/// Commands at the end whose push forces are averaged: where a wire slides over single triangles, one force is chance.
const AVERAGED: usize = 10;

/// What is pushed in, and from where.
#[derive(Debug, Clone)]
pub struct Push {
    /// The sheath.
    pub sheath: Sheath,
    /// The wire.
    pub wire: Device,
    /// Length to insert, mm.
    pub length_mm: f64,
    /// Increment, mm.
    pub step_mm: f64,
}

/// Where a wire came to lie.
#[derive(Debug, Clone)]
pub struct Inserted {
    /// Points along it, from the sheath.
    pub points: Vec<Vec3>,
    /// Push force, N, mean of the last ten commands.
    pub push_force_n: f64,
}

impl Push {
    /// Inserts into a surface as it is.
    ///
    /// # Errors
    /// Why the surface or a command was refused, or which command found no equilibrium.
    pub fn insert(&self, surface: &SurfaceMesh) -> Result<Inserted, String> {
        let refused = |e: endowire_core::Error| format!("refused: {e}");
        let wall = Wall::from_surface(surface).map_err(refused)?;
        let mut simulation =
            Simulation::builder(wall, self.wire.clone(), self.sheath).build().map_err(refused)?;
        let mut forces = Vec::new();
        for number in 0..(self.length_mm / self.step_mm).round() as usize {
            let report = simulation
                .step(Command::advance(self.step_mm))
                .map_err(|e| format!("command {}: {e}", number + 1))?;
            if !report.converged {
                return Err(format!("command {}: no equilibrium", number + 1));
            }
            forces.push(report.push_force_n);
        }
        let last = &forces[forces.len().saturating_sub(AVERAGED)..];
        let push_force_n = last.iter().sum::<f64>() / last.len().max(1) as f64;
        Ok(Inserted { points: curve(simulation.shape()), push_force_n })
    }
}

/// Farthest that two curves are apart across, mm: how far one has come along the other does not count.
pub fn apart_mm(a: &[Vec3], b: &[Vec3]) -> f64 {
    one_way_mm(a, b).max(one_way_mm(b, a))
}

fn one_way_mm(from: &[Vec3], to: &[Vec3]) -> f64 {
    let mut farthest: f64 = 0.0;
    for x in from {
        let mut nearest = (f64::MAX, false);
        for (k, ends) in to.windows(2).enumerate() {
            let way = ends[1] - ends[0];
            let u = (x - ends[0]).dot(&way) / way.norm_squared().max(f64::MIN_POSITIVE);
            let distance = (x - ends[0] - way * u.clamp(0.0, 1.0)).norm();
            if distance < nearest.0 {
                nearest = (distance, k + 2 == to.len() && u > 1.0);
            }
        }
        // Beyond the other's tip there is nothing to compare with.
        if !nearest.1 {
            farthest = farthest.max(nearest.0);
        }
    }
    farthest
}
