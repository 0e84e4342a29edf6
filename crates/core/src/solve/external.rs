//! Energies outside the rod, as Newton's method asks for them.

use crate::Vec3;
use crate::rod::{ElementData, RodState, Stencils};

/// What a step does to the point at ξ of an element, on the instrument in a set of angles: how far it moves it, mm, and turns it, rad.
pub type Moved<'a> = dyn Fn((usize, f64, usize)) -> (Vec3, f64) + 'a;

/// An energy outside the rod: loads, walls, or several of them together. It says where it acts in terms of the rod
/// ([`Stencils`]) and knows nothing of unknowns.
///
/// Newton's method asks in this order:
///
/// 1. [`linearise`](External::linearise) at a state, which is the *base* from then on, until the next one is linearised.
/// 2. What a step does to its [`contacts`](External::contacts), if it has any.
/// 3. [`safe_fraction`](External::safe_fraction) of the way from the base to a trial.
/// 4. [`value`](External::value) at that trial; as often as it takes, trials being nearer and nearer to the base.
/// 5. [`linearise`](External::linearise) at the trial that was taken.
///
/// Where something in the energy is lagged, as the normal forces are that friction follows, it is renewed when a base is linearised and at
/// no other time, so that one step lowers one energy.
pub trait External {
    /// Adds value, gradient and Hessian at a state, which becomes the base.
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils);

    /// Potential energy at a state, with what is lagged as it was at the base; with contacts whose [`merit`](Contacts::merit) was asked for
    /// since, that.
    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64;

    /// Part of the straight way from the base to `to` that crosses nothing: all of it, unless there is something to cross.
    fn safe_fraction(&mut self, _elements: &[ElementData], _to: &RodState) -> f64 {
        1.0
    }

    /// Sizes of what it exerts; none, unless they are more than the rod's own.
    fn sizes(&self) -> Sizes {
        Sizes::default()
    }

    /// Whether all of it has a potential, as most has. Where not, the stiffness is unsymmetric and there are no minima to look for.
    fn is_conservative(&self) -> bool {
        true
    }

    /// Work done on the way between two states by loads that have no potential.
    fn work(&self, _from: &RodState, _to: &RodState) -> f64 {
        0.0
    }

    /// Its contacts: forces that push and never pull. None, unless there is something to touch.
    fn contacts(&mut self) -> Option<&mut dyn Contacts> {
        None
    }
}

/// Sizes of forces at the base.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sizes {
    /// The largest force, N, …
    pub force_n: f64,
    /// … and moment, N·mm: a residual is measured by them.
    pub moment_nmm: f64,
    /// What rounding of positions leaves of the forces at a node, N.
    pub rounding_n: f64,
}

/// Forces that push and never pull, as unknowns beside the rod's shape, and what a step does to them.
pub trait Contacts {
    /// Takes note of a step from the base that answers the system as it is assembled.
    fn foresee(&mut self, elements: &[ElementData], base: &RodState, moved: &Moved<'_>);

    /// Adds the springs of those contacts to which another step leads, and takes away those out of which it leads. Returns how many were
    /// changed.
    fn press_or_let_go(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &Moved<'_>,
        into: &mut dyn Stencils,
    ) -> usize;

    /// Takes note of another step, which answers the system as it is.
    fn look_towards(&mut self, moved: &Moved<'_>);

    /// Slope, at a part of the way from the step noted first to that, of the model: of the energy with springs where contacts press and none
    /// where they would pull.
    fn slope_towards(&mut self, part: f64) -> f64;

    /// Goes a part of that way: where it leads is the step noted first from here on.
    fn go_towards(&mut self, part: f64);

    /// Aims at the forces to which a step leads. Their merit is the value from here on, until the next base.
    fn merit(&mut self, moved: &Moved<'_>) -> ContactMerit;

    /// Takes a part of the way to the forces that were aimed at.
    fn take(&mut self, part: f64);

    /// Whether an equilibrium at the base is one: nothing pulls, by more than a part of what presses, and friction is of the forces that
    /// press. What is not so is mended by the next base.
    fn settled(&mut self, tolerance: f64) -> bool;
}

/// What contacts add to the energy at the base for a merit of it.
#[derive(Debug, Clone, Copy, Default)]
pub struct ContactMerit {
    /// To the energy, mJ.
    pub excess_mj: f64,
    /// To its slope along the step, mJ.
    pub slope_mj: f64,
    /// Size of the terms that it is the sum of, mJ.
    pub size_mj: f64,
}
