//! A registry of all methods, and published methods for catheters and guidewires, each as in its paper, for
//! comparison with the core's own.
//!
//! [`AnyMethod`] is any `[method]` of a scene, and [`Scene`] a scene file with it; [`scene_with`] overrides values of
//! its keys.
//!
//! | name | module | paper |
//! |---|---|---|
//! | `kirchhoff` | [`endowire_core::methods::kirchhoff`] | ours |
//! | `li2011-dense`, `li2011-banded` | [`li2011`] | Li, Qin, Guo, Chui, Heng 2011 |
//! | `rigid-links` | [`rigid_links`] | Dawson, Cotin, Meglan, Shaffer, Ferrell 2000 |
//! | `mass-spring` | [`mass_spring`] | Wang, Duratti, Samur, Spaelter, Bleuler 2007 |
//! | `beam-fem`, `beam-fem-damped` | [`beam_fem`] | Cotin, Duriez, Lenoir, Neumann, Dawson 2005 |
//! | `chord-energy` | [`chord_energy`] | Konings et al. 2003; Alderliesten, Konings, Niessen 2004, 2007 |
//! | `discrete-rod` | [`discrete_rod`] | Bergou et al. 2008; Tang et al. 2010 |
//!
//! The last six are [`RodModel`]s: each relaxes a [`Chain`] of nodes under nodal loads, with the numerics of its
//! paper. The same relaxation is used for a static [`cantilever`](fn@cantilever) and, as [`Insertion`], for the
//! core's trait `Method`. What is not part of any paper is shared: the discretisation of the device, the wall's
//! energy per length (so that all methods have the same limit under refinement), and the slide along the device's own
//! curve at the start of each step.
//!
//! Papers leave parameters open (time steps, damping, stiffness of springs). The defaults are those with which a
//! method reaches a given error fastest; `cargo run --profile dist -p endowire-methods --example tune` repeats the
//! search.

pub mod beam_fem;
pub mod cantilever;
pub mod chain;
pub mod chord_energy;
pub mod discrete_rod;
mod explicit;
pub mod insertion;
mod key;
pub mod li2011;
mod links;
pub mod mass_spring;
pub mod options;
mod registry;
pub mod rigid_links;
mod setting;
mod wall_load;

pub use beam_fem::BeamFem;
pub use cantilever::{CantileverSolution, cantilever};
pub use chain::{Chain, NodalLoad, Posture, Push, TipForce};
pub use chord_energy::ChordEnergy;
pub use discrete_rod::DiscreteRod;
pub use insertion::{Inserted, Insertion, InsertionOptions};
pub use key::Key;
pub use mass_spring::MassSpring;
pub use registry::{AnyMethod, MODEL_NAMES, NAMES, Scene, static_model};
pub use rigid_links::RigidLinks;
pub use setting::{SceneTables, Setting, scene_with, scene_with_of};

use std::fmt::Debug;

use endowire_core::device::Device;
use endowire_core::{Error, Result};

/// Outcome of a relaxation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Outcome {
    /// Number of iterations: time steps, sweeps or linear solves, depending on the method.
    pub iterations: usize,
    /// Whether the imbalance fell below the tolerance.
    pub converged: bool,
}

/// What a chain stores.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Strain {
    /// Energy of bending, from its shape at rest, mJ.
    pub bend_mj: f64,
    /// Energy of twist, mJ.
    pub twist_mj: f64,
    /// Twist from the clamp to the tip, rad.
    pub twist_rad: f64,
}

/// A discrete rod with the solver of its paper.
pub trait RodModel: Debug + Send + Sync {
    /// The name used in tables and scenes.
    fn name(&self) -> &'static str;

    /// Rejects a device that the method cannot represent; by default none.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming the unsupported feature.
    fn check(&self, _device: &Device) -> Result<()> {
        Ok(())
    }

    /// What a chain stores in this posture; by default, one that is straight at rest and knows no twist, so that its tip
    /// turns with the clamp.
    fn strain(&self, chain: &Chain, posture: &Posture) -> Strain {
        Strain { bend_mj: chain.bending_energy_mj(posture), ..Strain::default() }
    }

    /// Moves `posture` to equilibrium under `load`.
    ///
    /// `tolerance` is the total force that may be out of balance, in units of EI/L² (L the chain's length): for a
    /// smooth error it is about the error of the tip in units of L.
    fn relax(
        &self,
        chain: &Chain,
        load: &mut dyn NodalLoad,
        posture: &mut Posture,
        tolerance: f64,
    ) -> Outcome;
}

/// Rejects a device with a rest shape, for a method that supports none.
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
