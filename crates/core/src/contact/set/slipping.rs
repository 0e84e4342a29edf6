//! Friction within a Newton step.
//!
//! The linearised system contains the friction of the base: a contact that sticks there acts as a spring, however far
//! the step moves it, and one that slips drives the step on, even where it would stick or slip back. The friction
//! energy, μ N φ(|u|), is convex in the slip, and the slip u is linear in the step. So where a step is recomputed
//! with the contacts at its end ([`super`]), friction is included, in every round with the force and the stiffness at
//! the slip of the previous round,
//!
//! ```text
//! f(u) + H(u) (u′ − u),    f = μ N φ′ û,    H = ∂f/∂u
//! ```
//!
//! and as far along the round as the model decreases.

use super::{Motion, Stencil, Stiffness, System, Wrench};
use crate::Vec3;
use crate::contact::friction::{Coulomb, FrictionDerivatives, Slider};

/// A contact with friction in a step.
#[derive(Debug, Clone, Copy)]
pub(in crate::contact) struct Slipping<S> {
    /// What it depends on.
    pub(super) stencil: S,
    slider: Slider,
    /// Its place, mm, and material angle, rad, at the base.
    base: Motion,
    /// Its motion in the step.
    way: Motion,
    /// Linearised force and moment of friction in the system at zero motion.
    at_rest: Wrench,
    /// Their derivatives in the system.
    stiffness: Stiffness,
    /// The friction that balances the rod's own stiffness.
    carried: Wrench,
    round: Round,
}

/// Motion of a contact with friction in a round.
#[derive(Debug, Clone, Copy, Default)]
struct Round {
    /// Its slip at the start of the round, mm.
    begin_mm: Vec3,
    /// Change of its slip, mm.
    change_mm: Vec3,
    /// Change of the balanced force in a full round.
    carried: Wrench,
    /// Work of the initial balanced force, and of its change, over the motion, mJ.
    work_mj: [f64; 2],
}

fn times((hessian, mixed, turn2): &Stiffness, (way, turn): &Motion) -> Wrench {
    (hessian * way + mixed * *turn, mixed.dot(way) + turn2 * turn)
}

fn plus(a: &Wrench, part: f64, b: &Wrench) -> Wrench {
    (a.0 + b.0 * part, a.1 + b.1 * part)
}

fn work(force: &Wrench, (way, turn): &Motion) -> f64 {
    force.0.dot(way) + force.1 * turn
}

/// Stiffness of friction in place and angle.
fn stiffness(f: &FrictionDerivatives) -> Stiffness {
    (f.hessian, f.mixed, f.turn2)
}

impl<S: Stencil> Slipping<S> {
    /// With the friction of the base, at that place and material angle; `None` without a normal force.
    pub(in crate::contact) fn new(stencil: S, slider: &Slider, base: Motion, law: &Coulomb) -> Option<Self> {
        let f = law.derivatives(slider, &base.0, base.1)?;
        Some(Self {
            stencil,
            slider: *slider,
            base,
            way: (Vec3::zeros(), 0.0),
            at_rest: (f.gradient, f.turn),
            stiffness: stiffness(&f),
            carried: (Vec3::zeros(), 0.0),
            round: Round::default(),
        })
    }

    /// Force and moment in the system at the end of a step.
    #[inline]
    fn linear(&self, way: &Motion) -> Wrench {
        plus(&self.at_rest, 1.0, &times(&self.stiffness, way))
    }

    /// Begins with a step that solves the system as it is.
    #[inline]
    pub(super) fn predict(&mut self, way: Motion) {
        self.way = way;
        self.carried = self.linear(&way);
    }

    /// Changes the system to the friction at the end of the step, where that is another one. Returns whether the
    /// difference requires another round.
    pub(super) fn switches(&mut self, way: Motion, law: &Coulomb, system: &mut System<'_>) -> bool {
        self.way = way;
        let (x, angle) = plus(&self.base, 1.0, &way);
        let Some(f) = law.derivatives(&self.slider, &x, angle) else { return false };
        let off = plus(&(f.gradient, f.turn), -1.0, &self.linear(&way));
        let (off_n, largest_n) = (off.0.norm(), law.largest_n(&self.slider));
        if off_n > law.tuning.renewed * largest_n {
            let at_rest = plus(&(f.gradient, f.turn), -1.0, &times(&stiffness(&f), &way));
            let more = plus(&at_rest, -1.0, &self.at_rest);
            let (hessian, mixed, turn2) = self.stiffness;
            self.stencil.add(system, &more, &(f.hessian - hessian, f.mixed - mixed, f.turn2 - turn2));
            (self.at_rest, self.stiffness) = (at_rest, stiffness(&f));
        }
        off_n > law.tuning.changed * largest_n
    }

    /// Computes its slip in a round to the end of another step.
    pub(super) fn set_direction(&mut self, end: &Motion) {
        let slip_mm = |way: &Motion| {
            let (x, angle) = plus(&self.base, 1.0, way);
            self.slider.slip(&x, angle).0
        };
        let begin_mm = slip_mm(&self.way);
        let way = plus(end, -1.0, &self.way);
        let carried = plus(&self.linear(end), -1.0, &self.carried);
        self.round = Round {
            begin_mm,
            change_mm: slip_mm(end) - begin_mm,
            carried,
            work_mj: [work(&self.carried, &way), work(&carried, &way)],
        };
    }

    /// Slope of the friction energy at a `part` of a round, minus the work of the balanced force.
    #[inline]
    pub(super) fn slope(&self, part: f64, law: &Coulomb) -> f64 {
        let Round { begin_mm, change_mm, work_mj, .. } = &self.round;
        let there = begin_mm + change_mm * part;
        law.resistance(&self.slider, &there) * there.dot(change_mm) - (work_mj[0] + part * work_mj[1])
    }

    /// Moves on by that part of the round.
    #[inline]
    pub(super) fn advance(&mut self, part: f64) {
        self.carried = plus(&self.carried, part, &self.round.carried);
    }
}
