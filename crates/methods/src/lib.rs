//! The field's methods for catheters and guidewires, each as its paper has it, to compare the core's own with.
//!
//! | name | module | paper |
//! |---|---|---|
//! | `rigid-links` | [`rigid_links`] | Dawson, Cotin, Meglan, Shaffer, Ferrell 2000 |
//! | `mass-spring` | [`mass_spring`] | Wang, Duratti, Samur, Spaelter, Bleuler 2007 |
//! | `beam-fem`, `beam-fem-damped` | [`beam_fem`] | Cotin, Duriez, Lenoir, Neumann, Dawson 2005 |
//! | `chord-energy` | [`chord_energy`] | Konings et al. 2003; Alderliesten, Konings, Niessen 2004, 2007 |
//! | `discrete-rod` | [`discrete_rod`] | Bergou et al. 2008; Tang et al. 2010 |
//!
//! A method is a [`RodModel`]: it relaxes a [`Chain`] of nodes under nodal loads, with the numerics of its paper. The same
//! relaxation serves a static [`cantilever`](fn@cantilever) and, as [`Insertion`], core's trait `Method`. What is no part of
//! any paper is shared: the discretisation of the device, the wall's energy per length (so that all methods have the same
//! limit under refinement), and the slide along the own curve that starts each step.
//!
//! Papers leave parameters open (time steps, damping, stiffness of springs). The defaults are those with which a method
//! reaches a given error soonest; `cargo run --release -p endowire-methods --example tune` repeats the search.

pub mod beam_fem;
pub mod cantilever;
pub mod chain;
pub mod chord_energy;
pub mod discrete_rod;
mod explicit;
pub mod insertion;
mod links;
pub mod mass_spring;
pub mod rigid_links;
mod wall_load;

pub use beam_fem::BeamFem;
pub use cantilever::{CantileverSolution, cantilever};
pub use chain::{Chain, NodalLoad, Posture, Push, TipForce};
pub use chord_energy::ChordEnergy;
pub use discrete_rod::DiscreteRod;
pub use insertion::{Insertion, InsertionOptions};
pub use mass_spring::MassSpring;
pub use rigid_links::RigidLinks;

use endowire_core::device::Device;
use endowire_core::{Error, Result};

/// How a relaxation ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Outcome {
    /// Iterations: time steps, sweeps or linear solves, as the method has it.
    pub iterations: usize,
    /// Whether what is out of balance fell below the tolerance.
    pub converged: bool,
}

/// A discrete rod with the solution procedure of its paper.
pub trait RodModel: Send + Sync {
    /// The name used in tables and scenes.
    fn name(&self) -> &'static str;

    /// Refuses a device that the method cannot represent; one that can represent all refuses none.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming what the method does not have.
    fn check(&self, _device: &Device) -> Result<()> {
        Ok(())
    }

    /// Moves `posture` to equilibrium under `load`.
    ///
    /// `tolerance` is the force that may be out of balance in all, in units of EI/L² (L the chain's length): for a
    /// smooth error it is about the error of the tip in units of L.
    fn relax(
        &self,
        chain: &Chain,
        load: &mut dyn NodalLoad,
        posture: &mut Posture,
        tolerance: f64,
    ) -> Outcome;
}

/// Names of all methods of this crate.
pub const NAMES: [&str; 6] =
    ["rigid-links", "mass-spring", "beam-fem", "beam-fem-damped", "chord-energy", "discrete-rod"];

/// What a method is asked to do: its best parameters depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// One static solve from the unloaded shape: the motion is as long as the device.
    Cantilever,
    /// Insertion: the device is held along its length, and each step is short.
    Insertion,
}

/// The method of that name with the parameters that serve it best in `task`, as found by the example `tune`.
pub fn by_name(name: &str, task: Task) -> Option<Box<dyn RodModel>> {
    let insertion = task == Task::Insertion;
    Some(match name {
        "rigid-links" if insertion => {
            Box::new(RigidLinks { time_step: 0.015, damping: 0.05, ..RigidLinks::default() })
        }
        "rigid-links" => Box::new(RigidLinks::default()),
        "mass-spring" if insertion => {
            Box::new(MassSpring { damping: 10.0, max_iterations: 200_000, ..MassSpring::default() })
        }
        "mass-spring" => Box::new(MassSpring::default()),
        "beam-fem" => Box::new(BeamFem::default()),
        "beam-fem-damped" if insertion => Box::new(BeamFem { damping: 1e4, ..BeamFem::default() }),
        "beam-fem-damped" => Box::new(BeamFem::damped()),
        "chord-energy" if insertion => Box::new(ChordEnergy { max_iterations: 20_000 }),
        "chord-energy" => Box::new(ChordEnergy::default()),
        "discrete-rod" if insertion => {
            Box::new(DiscreteRod { damping: 10.0, max_iterations: 200_000, ..DiscreteRod::default() })
        }
        "discrete-rod" => Box::new(DiscreteRod::default()),
        _ => return None,
    })
}

/// The refusal of a device with a shape of its own by a method that has none.
fn refuse_shape(name: &str, device: &Device, reason: &str) -> Result<()> {
    match device.sections().iter().position(|s| s.rest_curvature_per_mm != [0.0; 2]) {
        None => Ok(()),
        Some(index) => Err(Error::parameter(
            format!("device.section[{index}].rest_curvature_per_mm"),
            format!("{:?}", device.sections()[index].rest_curvature_per_mm),
            format!("{name} {reason}: use a straight device or another method"),
        )),
    }
}
