//! Friction of rods on themselves and each other, as an incremental potential like that of the wall
//! ([`crate::contact::friction`]).
//!
//! In a part of a command the two points of a pair, material points of the base, slip on each other by
//!
//! ```text
//! u = P [(A − a) − (B − b)],    P = I − n nᵀ,    a = Ā − Δ t̄
//! ```
//!
//! where Ā and t̄ are position and direction of the first after its device has slid by the advance Δ of its hand
//! along its own curve, and b is the same for the second. With μ, and the φ of the wall, friction dissipates Σ μ N
//! φ(|u|). N and n are those of the base, and are renewed from base to base until they settle.
//!
//! Rotation of surfaces about their own axis causes no friction: a wire spins freely in its loops.

use nalgebra::Matrix3;

use super::curve::Curve;
use super::{Pair, SelfContact};
use crate::Vec3;
use crate::contact::friction::{Coulomb, Slider, unsettled};
use crate::rod::{Couple, ElementData, RodState};

/// Friction of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct PairFriction {
    /// Slip of the first point relative to the second.
    pub(super) slider: Slider,
    /// Its slip when slip was reset, mm.
    kept_mm: Vec3,
    /// A − B at the base, mm.
    pub(super) apart_mm: Vec3,
}

/// Friction of all pairs in a part of a command.
#[derive(Debug, Clone, Default)]
pub(super) struct FrictionOfPairs {
    pub(super) law: Coulomb,
    /// A negligible force, N.
    least_n: f64,
    /// State of the rods at the start of the part, after devices have slid along their own curves.
    begun: RodState,
    /// Advance of each element, mm.
    advances_mm: Vec<f64>,
}

/// Parameters of friction in a part of a command.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrictionLaw {
    /// Coefficient of friction μ.
    pub(crate) coefficient: f64,
    /// Slip below which points stick, and its lower bound while hands hold still, mm.
    pub(crate) stick_mm: [f64; 2],
    /// A negligible force, N.
    pub(crate) least_n: f64,
}

impl PairFriction {
    /// With the normal force of an earlier part, whose direction is known from the first base on.
    fn recalled(force_n: f64) -> Self {
        Self { slider: Slider::default().with(Vec3::zeros(), force_n), ..Self::default() }
    }

    /// Slip at the base, mm.
    fn slip_mm(&self) -> Vec3 {
        self.slider.slip(&self.apart_mm, 0.0).0
    }
}

impl Pair {
    /// Whether friction may hold it.
    pub(super) fn is_held(&self) -> bool {
        self.friction.slider.holds()
    }

    /// A − B, mm, of its material points.
    fn apart_mm(&self, curve: &Curve<'_>) -> Vec3 {
        let [a, b] = self.gap.at.map(|place| curve.jet(place).at);
        a - b
    }

    /// Adds a friction force as a gradient, and its derivative, to the pair's contribution.
    fn add_friction(&self, to: &mut Couple, force_n: &Vec3, stiffness: &Matrix3<f64>) {
        let c = &self.difference.weights;
        for k in 0..c.len() {
            to.gradient[k] += force_n * c[k];
            to.carried[k] += force_n * c[k];
            for l in k..c.len() {
                to.hessian[k][l] += stiffness * (c[k] * c[l]);
            }
        }
    }
}

impl SelfContact {
    /// Begins a part of a command: rods are at a state after devices have slid along their own curves, each element
    /// by its advance, mm. Their first nodes were at `places` on these curves: in `state` they are only nearly, since
    /// between nodes that have moved on, a curve of cubic pieces is another one.
    pub(crate) fn begin_friction(
        &mut self,
        state: &RodState,
        places: impl Iterator<Item = Vec3>,
        advances_mm: impl Iterator<Item = f64>,
        FrictionLaw { coefficient, stick_mm, least_n }: FrictionLaw,
    ) {
        let friction = &mut self.friction;
        friction.law = Coulomb::new(coefficient, &friction.law.tuning);
        friction.law.stick_within(stick_mm);
        friction.least_n = least_n;
        if !friction.law.acts() {
            return;
        }
        friction.begun.copy_from(state);
        friction.begun.positions.iter_mut().zip(places).for_each(|(to, place)| *to = place);
        friction.advances_mm.clear();
        friction.advances_mm.extend(advances_mm);
    }

    /// Friction of a pair with the normal force of an earlier part.
    pub(super) fn recalled_friction(&self, force_n: f64) -> PairFriction {
        if self.has_friction() { PairFriction::recalled(force_n) } else { PairFriction::default() }
    }

    /// Whether there is friction.
    fn has_friction(&self) -> bool {
        self.friction.law.acts()
    }

    /// Renews friction from the pairs active at the base, unless it is settled or held.
    pub(super) fn follow_pairs(&mut self, elements: &[ElementData], state: &RodState) {
        if !self.has_friction() {
            return;
        }
        let FrictionOfPairs { law, least_n, begun, advances_mm } = &mut self.friction;
        let (capsules, closed, tuning) = (&self.capsules, self.closed, &self.tuning);
        let (now, was) = (
            Curve { elements, state, capsules, closed, tuning },
            Curve { elements, state: begun, capsules, closed, tuning },
        );
        let all = self.pairs.iter_mut().map(|pair| {
            let size = pair.gap.direction().norm();
            let forces_n = [pair.force_n, pair.spring_n_per_mm * pair.depth_mm().max(0.0)];
            let normal = pair.gap.direction() / size;
            let [a, b] = pair.gap.at.map(|place| {
                let jet = was.jet(place);
                jet.at - jet.first * (advances_mm[place.element] / jet.first.norm())
            });
            pair.friction.apart_mm = pair.apart_mm(&now);
            let PairFriction { slider, kept_mm, .. } = &mut pair.friction;
            slider.from_mm = a - b - *kept_mm;
            // Of a recalled force no direction is known before.
            if slider.normal == Vec3::zeros() {
                slider.normal = normal;
            }
            (slider, normal, forces_n.map(|force_n| force_n * size))
        });
        law.follow(all, *least_n);
    }

    /// Relative difference of the normal forces of friction from the contact forces at the last base.
    pub(crate) fn unsettled(&self) -> f64 {
        if !self.has_friction() {
            return 0.0;
        }
        unsettled(self.pairs.iter().map(|pair| &pair.friction.slider), self.friction.least_n)
    }

    /// Stops renewing normal forces.
    pub(crate) fn hold_friction(&mut self) {
        self.friction.law.hold();
    }

    /// Resumes renewing normal forces.
    pub(crate) fn release_friction(&mut self) {
        self.friction.law.release();
    }

    /// Resets normal forces to those of the start of the part, and holds them.
    pub(crate) fn rewind_friction(&mut self) {
        self.hold_friction();
        self.pairs
            .iter_mut()
            .for_each(|Pair { friction, .. }| *friction = PairFriction::recalled(friction.slider.begun.1));
    }

    /// Resets slip at the base and holds the normal forces there: see
    /// [`Coulomb::anchor`].
    pub(crate) fn anchor_friction(&mut self) {
        if !self.has_friction() {
            return;
        }
        let friction = &mut self.friction;
        let all = self.pairs.iter_mut().map(|pair| &mut pair.friction);
        friction.law.anchor(all.map(|one| (&mut one.slider, one.apart_mm, 0.0)));
        for Pair { friction, .. } in &mut self.pairs {
            friction.kept_mm = friction.apart_mm - friction.slider.from_mm;
        }
        friction.begun.copy_from(&self.base);
        friction.advances_mm.fill(0.0);
    }

    /// Lower and upper estimate of the energy dissipated in the part, mJ.
    pub(crate) fn dissipated_mj(&self) -> (f64, f64) {
        let all = self.pairs.iter().map(|pair| &pair.friction);
        self.friction.law.dissipated_mj(all.map(|one| (&one.slider, one.apart_mm, 0.0)))
    }

    /// Friction force on the first point of a pair at the base, N.
    pub(super) fn friction_n(&self, pair: &Pair) -> Vec3 {
        let slip_mm = pair.friction.slip_mm();
        -slip_mm * self.friction.law.resistance(&pair.friction.slider, &slip_mm)
    }

    /// Adds friction at the base to a pair's contribution, and returns its energy, mJ.
    pub(super) fn add_friction(&self, pair: &Pair, to: &mut Couple) -> f64 {
        let PairFriction { slider, apart_mm, .. } = &pair.friction;
        if let Some(f) = self.friction.law.derivatives(slider, apart_mm, 0.0) {
            pair.add_friction(to, &f.gradient, &f.hessian);
        }
        self.friction.law.value(slider, apart_mm, 0.0)
    }

    /// Friction energy of a pair on the way to a state, mJ.
    pub(super) fn friction_mj(&self, pair: &Pair, curve: &Curve<'_>) -> f64 {
        if !pair.is_held() {
            return 0.0;
        }
        self.friction.law.value(&pair.friction.slider, &pair.apart_mm(curve), 0.0)
    }
}
