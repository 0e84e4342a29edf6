//! Contacts as data, and what Newton's method does with them: once, for the wall and for pairs.
//!
//! A contact is a gap g (mm), negative where surfaces overlap, with its gradient in the motion of a [`Stencil`]: one
//! point of an element on a wall, or the difference of two points in a pair. Where contacts are, and how their gaps
//! bend, is known to a [`Geometry`] alone; whatever implements that is [`Contacts`] of Newton's method.
//!
//! # Forces as unknowns
//!
//! With p = −g the depth, κ the stiffness of the surface over the length that the contact represents, and a force
//! unknown f ≥ 0, equilibrium is ∇E − Σ f ∇g = 0 and f = κ p₊. A thread presses on a hard wall by nanometres, and the
//! error of a step along a curved wall is larger: forces indicate contact much better than depths. So a contact is
//! active while
//!
//! ```text
//! f + ρ p > 0,    ρ = c w EI/h⁴
//! ```
//!
//! with a penalty ρ of the magnitude of the element's own stiffness. Newton's method for x and f, with f eliminated,
//! is
//!
//! ```text
//! (∇∇E − Σ f ∇∇g + Σ κ ∇g ∇gᵀ) δx = −(∇E − Σ κ p ∇g),    f⁺ = κ (p − ∇g·δx)
//! ```
//!
//! over the active contacts, the primal-dual active set method (M. Hintermüller, K. Ito, K. Kunisch, *The primal-dual
//! active set strategy as a semismooth Newton method*, SIAM J. Optim. 13 (2002)).
//!
//! # The model of a step
//!
//! A contact has the gap g + ∇g·δx at the end of a step, and presses there with κ times that if it is negative
//! ([`linear`]). Planes are needed for all contacts that a step may close, whether they are active at the base or
//! not; the others' planes have no effect. [`crate::solve`] seeks the minimum of that model; friction is included
//! ([`slipping`]).
//!
//! # The merit along the step
//!
//! It is the augmented Lagrangian at f⁺ (R. T. Rockafellar, *Augmented Lagrange multiplier functions and duality in
//! nonconvex programming*, SIAM J. Control 12 (1974)), with the depth s = f/κ by which the surface gives way minimised
//! out,
//!
//! ```text
//! E(x) + Σ [κ t²/(2 ρ (κ + ρ)) − f⁺²/(2 ρ)],    t = (f⁺ + ρ p)₊,    force κ t/(κ + ρ)
//! ```
//!
//! which is as soft as the rod, so second-order errors of a step cost nothing there.
//!
//! Where the modulus varies, κ = κ₀ eˢ, the merit also has a gradient towards the softer side: ½ κ p² ∇s where f = κ
//! p, like the energy, plus
//!
//! ```text
//! κ t²/(2 (κ + ρ)²) ∇s
//! ```
//!
//! The Hessian includes the energy's contribution ([`Stiffness::graded`](super::regions::Stiffness)); the planes of
//! contacts that become active do not.

mod linear;
mod slipping;

pub(super) use linear::{LinearContact, merit, penalty_n_per_mm};
pub(super) use slipping::Slipping;

use nalgebra::Matrix3;

use super::friction::Coulomb;
use crate::Vec3;
use crate::rod::{ElementData, RodState, Stencils};
use crate::solve::{ContactMerit, Contacts, Moved};

/// Displacement, mm, and rotation about its own axis, rad, of what a contact depends on.
pub(super) type Motion = (Vec3, f64);

/// The system at a base, to which contacts are added and from which they are removed.
pub(super) struct System<'a> {
    pub(super) elements: &'a [ElementData],
    pub(super) base: &'a RodState,
    pub(super) into: &'a mut dyn Stencils,
}

/// A force, N, and a moment about the axis, N·mm.
pub(super) type Wrench = (Vec3, f64);

/// Derivatives of a wrench in a motion: of the force in the displacement, of either in the other, and of the moment in
/// the rotation.
pub(super) type Stiffness = (Matrix3<f64>, Vec3, f64);

/// What a contact depends on: a point of an element, or the difference of two.
pub(super) trait Stencil: Copy + Default {
    /// Adds a spring that is linear in the motion: its wrench at the base, as a gradient. It has no effect on the
    /// rotation of tangents.
    fn add(&self, to: &mut System<'_>, spring: &Wrench, stiffness: &Stiffness);
}

/// A point near a surface that no step has brought into contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearby<S> {
    /// Number of the contact.
    pub(super) key: usize,
    /// What it depends on.
    pub(super) stencil: S,
    /// It touches nothing while it moves by less than this, mm.
    pub(super) free_mm: f64,
    /// ρ, N/mm.
    pub(super) penalty_n_per_mm: f64,
    /// Its displacement in the step, mm.
    way: Vec3,
}

impl<S> Nearby<S> {
    pub(super) fn new((key, stencil): (usize, S), free_mm: f64, penalty_n_per_mm: f64) -> Self {
        Self { key, stencil, free_mm, penalty_n_per_mm, way: Vec3::zeros() }
    }
}

/// The contacts in a step from a base.
#[derive(Debug, Clone, Default)]
pub(super) struct ContactSet<S> {
    /// Those that are active at the base, or that a step may close; keys ascend.
    pub(super) contacts: Vec<LinearContact<S>>,
    /// Those that no step has closed yet.
    pub(super) nearby: Vec<Nearby<S>>,
    /// Those with friction.
    pub(super) slipping: Vec<Slipping<S>>,
    /// Whether `nearby` and `slipping` are those of the base.
    is_complete: bool,
    /// Whether forces have targets: the value of the energy is then the merit.
    pub(super) has_targets: bool,
}

impl<S> ContactSet<S> {
    /// Allocates for `points` contacts.
    pub(super) fn reserve(&mut self, points: usize) {
        self.contacts.reserve(points.saturating_sub(self.contacts.len()));
        self.nearby.reserve(points.saturating_sub(self.nearby.len()));
        self.slipping.reserve(points.saturating_sub(self.slipping.len()));
    }

    /// Begins at another base, where no contact is known. Keeps the memory.
    pub(super) fn clear(&mut self) {
        self.contacts.clear();
        self.nearby.clear();
        self.slipping.clear();
        (self.is_complete, self.has_targets) = (false, false);
    }

    /// The contacts active at the base.
    pub(super) fn at_base(&self) -> impl Iterator<Item = &LinearContact<S>> {
        self.contacts.iter().filter(|contact| contact.at_base)
    }
}

/// Where contacts are.
pub(super) trait Geometry {
    /// What they depend on.
    type Stencil: Stencil;

    /// The contacts; those active at the base are there once that is linearised.
    fn set(&mut self) -> &mut ContactSet<Self::Stencil>;

    /// Prepares for the motions of a step.
    fn follow(&mut self, _moved: &dyn Moved) {}

    /// The motion of a stencil in the step that was followed last.
    fn motion(&self, stencil: &Self::Stencil, moved: &dyn Moved) -> Motion;

    /// Adds what is near a surface at the base without touching it.
    fn find_nearby(&mut self, _elements: &[ElementData], _base: &RodState) {}

    /// The linearised contact of what a step may close; `None` if it is out of reach after all.
    fn linearised(&mut self, _nearby: &Nearby<Self::Stencil>) -> Option<LinearContact<Self::Stencil>> {
        None
    }

    /// The law of friction.
    fn law(&mut self) -> &mut Coulomb;

    /// Adds the contacts that friction may hold, at the base.
    fn find_slipping(&self, base: &RodState, into: &mut Vec<Slipping<Self::Stencil>>);

    /// Stores the force unknowns of the contacts.
    fn store_forces(&mut self);

    /// A negligible force, N.
    fn least_force_n(&self) -> f64;

    /// Relative difference of the normal forces of friction from the contact forces at the last base.
    fn friction_off(&self) -> f64;
}

/// Moves to the contacts what a step may close. The planes of the others are out of its reach.
fn meet<G: Geometry>(geometry: &mut G, set: &mut ContactSet<G::Stencil>, moved: &dyn Moved) {
    let ContactSet { contacts, nearby, .. } = set;
    let before = contacts.len();
    nearby.retain(|point| {
        let stays = geometry.motion(&point.stencil, moved).0.norm() <= point.free_mm;
        if !stays && let Some(contact) = geometry.linearised(point) {
            contacts.push(contact.met_on_the_way(&point.way));
        }
        stays
    });
    if contacts.len() > before {
        contacts.sort_unstable_by_key(|contact| contact.key);
    }
}

impl<G: Geometry> Contacts for G {
    fn predict(&mut self, elements: &[ElementData], base: &RodState, moved: &dyn Moved) {
        self.follow(moved);
        let completes = !std::mem::replace(&mut self.set().is_complete, true);
        if completes {
            self.find_nearby(elements, base);
        }
        let mut set = std::mem::take(self.set());
        if completes && self.law().acts() {
            self.find_slipping(base, &mut set.slipping);
        }
        meet(self, &mut set, moved);
        for contact in &mut set.contacts {
            contact.predict(&self.motion(&contact.stencil, moved).0);
        }
        for slipping in &mut set.slipping {
            slipping.predict(self.motion(&slipping.stencil, moved));
        }
        *self.set() = set;
    }

    fn update_active_set(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &dyn Moved,
        into: &mut dyn Stencils,
    ) -> usize {
        self.follow(moved);
        let (mut set, law) = (std::mem::take(self.set()), *self.law());
        for point in &mut set.nearby {
            point.way = self.motion(&point.stencil, moved).0;
        }
        let mut system = System { elements, base, into };
        let mut changed = 0;
        for contact in &mut set.contacts {
            let way = self.motion(&contact.stencil, moved).0;
            changed += usize::from(contact.switches(&way, &mut system));
        }
        for slipping in &mut set.slipping {
            let way = self.motion(&slipping.stencil, moved);
            changed += usize::from(slipping.switches(way, &law, &mut system));
        }
        *self.set() = set;
        changed
    }

    fn set_direction(&mut self, moved: &dyn Moved) {
        self.follow(moved);
        let mut set = std::mem::take(self.set());
        meet(self, &mut set, moved);
        for contact in &mut set.contacts {
            contact.end_mm = self.motion(&contact.stencil, moved).0.dot(&contact.gradient);
        }
        for slipping in &mut set.slipping {
            slipping.set_direction(&self.motion(&slipping.stencil, moved));
        }
        *self.set() = set;
    }

    fn slope(&mut self, part: f64) -> f64 {
        let law = *self.law();
        let set = self.set();
        set.contacts.iter().map(|contact| contact.slope(part)).sum::<f64>()
            + set.slipping.iter().map(|slipping| slipping.slope(part, &law)).sum::<f64>()
    }

    fn advance(&mut self, part: f64) {
        let set = self.set();
        set.contacts.iter_mut().for_each(|contact| contact.advance(part));
        set.slipping.iter_mut().for_each(|slipping| slipping.advance(part));
    }

    fn merit(&mut self, moved: &dyn Moved) -> ContactMerit {
        self.follow(moved);
        let mut set = std::mem::take(self.set());
        let mut sum = ContactMerit::default();
        for contact in &mut set.contacts {
            contact.set_target(&self.motion(&contact.stencil, moved).0, &mut sum);
        }
        set.has_targets = true;
        *self.set() = set;
        sum
    }

    fn accept_forces(&mut self, part: f64) {
        for contact in &mut self.set().contacts {
            contact.force_n += part * (contact.target_n - contact.force_n);
        }
        self.store_forces();
    }

    fn settled(&mut self, tolerance: f64) -> bool {
        let (mut pull_n, mut press_n) = (0.0, self.least_force_n());
        for contact in self.set().at_base() {
            let force_n = contact.spring_n_per_mm * -contact.gap_mm;
            pull_n -= force_n.min(0.0);
            press_n += force_n.max(0.0);
        }
        if pull_n <= tolerance * press_n {
            let off = self.friction_off();
            return self.law().settles(off);
        }
        // What pulls lets go.
        let pulling = self.set().contacts.iter_mut().filter(|contact| contact.gap_mm > 0.0);
        pulling.for_each(|contact| contact.force_n = 0.0);
        self.store_forces();
        false
    }
}
