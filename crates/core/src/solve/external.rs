//! The interface of Newton's method to energies outside the rod.

use crate::Vec3;
use crate::rod::{ElementData, RodState, Stencils};

/// Motion of the rod in a step.
pub(crate) trait Moved {
    /// Displacement, mm, and rotation, rad, of the point at ξ of an element, on the instrument in a set of angles.
    fn point(&self, place: (usize, f64, usize)) -> (Vec3, f64);

    /// Changes of what points of an element depend on: x₀, h t₀, x₁ and h t₁, mm.
    fn element(&self, e: usize) -> [Vec3; 4];
}

/// An energy outside the rod: loads, walls, or several of them together. It acts through the rod's [`Stencils`] and
/// does not know the unknowns.
///
/// Newton's method calls in this order:
///
/// 1. [`linearise`](External::linearise) at a state, which is the *base* until the next call.
/// 2. its [contacts](External::visit_contacts), if there are any, with the step.
/// 3. [`safe_fraction`](External::safe_fraction) of the way from the base to a trial.
/// 4. [`value`](External::value) at that trial; repeated as the line search moves trials towards the base.
/// 5. [`linearise`](External::linearise) at the accepted trial.
///
/// Lagged quantities, such as the normal forces that friction follows, are renewed only when a base is linearised, so
/// that one step lowers one energy.
pub(crate) trait External {
    /// Adds value, gradient and Hessian at a state, which becomes the base.
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils);

    /// Potential energy at a state, with lagged quantities as at the base; for contacts whose
    /// [`merit`](Contacts::merit) was called since the base, that merit.
    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64;

    /// Fraction of the straight way from the base to `to` that crosses no surface; 1 by default.
    fn safe_fraction(&mut self, _elements: &[ElementData], _to: &RodState) -> f64 {
        1.0
    }

    /// Magnitudes of its forces; zero unless they may exceed the rod's own.
    fn sizes(&self) -> Sizes {
        Sizes::default()
    }

    /// Whether all of it has a potential, as by default. If not, the stiffness is unsymmetric and no minimum exists
    /// to find.
    fn is_conservative(&self) -> bool {
        true
    }

    /// Work between two states of loads without potential.
    fn work(&self, _from: &RodState, _to: &RodState) -> f64 {
        0.0
    }

    /// Calls `ask` with its contacts, forces that push and never pull, if it has some; several energies together have
    /// several. None by default.
    fn visit_contacts(&mut self, _ask: &mut dyn FnMut(&mut dyn Contacts)) {}
}

/// Magnitudes of forces at the base.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sizes {
    /// The largest force, N; the residual is relative to it.
    pub force_n: f64,
    /// The largest moment, N·mm; the residual is relative to it.
    pub moment_nmm: f64,
    /// Rounding error of the forces at a node due to rounding of positions, N.
    pub rounding_n: f64,
}

/// Forces that push and never pull, as unknowns beside the rod's shape, and their response to a step.
pub(crate) trait Contacts {
    /// Stores a step from the base that solves the assembled system.
    fn predict(&mut self, elements: &[ElementData], base: &RodState, moved: &dyn Moved);

    /// Adds the springs of contacts that become active by another step, and removes those of contacts that become
    /// inactive. Returns how many changed.
    fn update_active_set(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &dyn Moved,
        into: &mut dyn Stencils,
    ) -> usize;

    /// Stores another step, which solves the system as it is now.
    fn set_direction(&mut self, moved: &dyn Moved);

    /// Slope of the model at a fraction of the way from the first stored step to the second: of the energy with
    /// springs where contacts press and none where they would pull.
    fn slope(&mut self, part: f64) -> f64;

    /// Moves the first stored step by a fraction of that way.
    fn advance(&mut self, part: f64);

    /// Takes the forces at the end of a step as target. Until the next base, the value is the merit of these
    /// contacts.
    fn merit(&mut self, moved: &dyn Moved) -> ContactMerit;

    /// Moves the forces by a fraction of the way to their target.
    fn accept_forces(&mut self, part: f64);

    /// Whether an equilibrium at the base is valid for the contacts: none pulls by more than `tolerance` times the
    /// largest pressing force, and friction follows the current normal forces. If not, the next base corrects it.
    fn settled(&mut self, tolerance: f64) -> bool;
}

/// Contribution of contacts to the merit at the base.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ContactMerit {
    /// Added to the energy, mJ.
    pub excess_mj: f64,
    /// Added to the slope of the energy along the step, mJ.
    pub slope_mj: f64,
    /// Magnitude of the terms that are summed, mJ: the scale of its rounding.
    pub size_mj: f64,
}

impl std::ops::AddAssign for ContactMerit {
    fn add_assign(&mut self, other: Self) {
        self.excess_mj += other.excess_mj;
        self.slope_mj += other.slope_mj;
        self.size_mj += other.size_mj;
    }
}
