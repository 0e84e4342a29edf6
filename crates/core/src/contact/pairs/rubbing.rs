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
use crate::contact::friction::{CHANGED, Coulomb, RENEWED, Slider, unsettled};
use crate::rod::{Couple, ElementData, RodState, Stencils};

/// Friction of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Rub {
    /// Slip of the first point relative to the second.
    pub(super) slider: Slider,
    /// Its slip when slip was reset, mm.
    kept_mm: Vec3,
    /// A − B at the base, mm.
    apart_mm: Vec3,
    /// Relative displacement of the two points in the step, mm.
    way_mm: Vec3,
    /// Linearised friction force in the system at zero displacement, N; its derivative there, N/mm.
    at_rest_n: Vec3,
    stiffness: Matrix3<f64>,
    /// The friction that balances the stiffness of the rods, N.
    carried_n: Vec3,
    /// Relative displacement of the two points in a round, mm, and the balanced force after it, N.
    end_mm: Vec3,
    end_n: Vec3,
}

/// Friction of all pairs in a part of a command.
#[derive(Debug, Clone, Default)]
pub(super) struct Rubbing {
    law: Coulomb,
    /// A negligible force, N.
    least_n: f64,
    /// State of the rods at the start of the part, after devices have slid along their own curves.
    begun: RodState,
    /// Advance of each element, mm.
    advances_mm: Vec<f64>,
}

/// Parameters of friction in a part of a command.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rubs {
    /// Coefficient of friction μ.
    pub(crate) coefficient: f64,
    /// Slip below which points stick, and its lower bound while hands hold still, mm.
    pub(crate) stick_mm: [f64; 2],
    /// A negligible force, N.
    pub(crate) least_n: f64,
}

impl Rub {
    /// With the normal force of an earlier part, whose direction is known from the first base on.
    fn recalled(force_n: f64) -> Self {
        Self { slider: Slider::default().with(Vec3::zeros(), force_n), ..Self::default() }
    }

    /// Slip at the base, mm.
    fn slip_mm(&self) -> Vec3 {
        self.slider.slip(&self.apart_mm, 0.0).0
    }

    /// Force in the system at the end of a step, N.
    fn linear_n(&self, way_mm: &Vec3) -> Vec3 {
        self.at_rest_n + self.stiffness * way_mm
    }
}

impl Pair {
    pub(super) fn rubs(&self) -> bool {
        self.rub.slider.holds()
    }

    /// A − B, mm, of its material points.
    fn apart_mm(&self, curve: &Curve<'_>) -> Vec3 {
        let [a, b] = self.gap.at.map(|place| curve.jet(place).at);
        a - b
    }

    /// Adds a friction force as a gradient, and its derivative, to the pair's contribution.
    fn add_friction(&self, to: &mut Couple, force_n: &Vec3, stiffness: &Matrix3<f64>) {
        let c = &self.weights;
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
        Rubs { coefficient, stick_mm, least_n }: Rubs,
    ) {
        let rubbing = &mut self.rubbing;
        rubbing.law = Coulomb::new(coefficient);
        rubbing.law.stick_within(stick_mm);
        rubbing.least_n = least_n;
        if !rubbing.law.acts() {
            return;
        }
        rubbing.begun.copy_from(state);
        rubbing.begun.positions.iter_mut().zip(places).for_each(|(to, place)| *to = place);
        rubbing.advances_mm.clear();
        rubbing.advances_mm.extend(advances_mm);
    }

    /// Friction of a pair with the normal force of an earlier part.
    pub(super) fn recalled_friction(&self, force_n: f64) -> Rub {
        if self.rubs() { Rub::recalled(force_n) } else { Rub::default() }
    }

    /// Whether there is friction.
    fn rubs(&self) -> bool {
        self.rubbing.law.acts()
    }

    /// Renews friction from the pairs active at the base, unless it is settled or held.
    pub(super) fn rub_with_pairs(&mut self, elements: &[ElementData], state: &RodState) {
        if !self.rubs() {
            return;
        }
        let Rubbing { law, least_n, begun, advances_mm } = &mut self.rubbing;
        let (now, was) = (
            Curve { elements, state, skins: &self.skins, closed: self.closed },
            Curve { elements, state: begun, skins: &self.skins, closed: self.closed },
        );
        let all = self.pairs.iter_mut().map(|pair| {
            let size = pair.gap.direction().norm();
            let forces_n = [pair.force_n, pair.spring_n_per_mm * pair.depth_mm().max(0.0)];
            let normal = pair.gap.direction() / size;
            let [a, b] = pair.gap.at.map(|place| {
                let jet = was.jet(place);
                jet.at - jet.first * (advances_mm[place.element] / jet.first.norm())
            });
            pair.rub.apart_mm = pair.apart_mm(&now);
            pair.rub.slider.from_mm = a - b - pair.rub.kept_mm;
            (&mut pair.rub.slider, normal, forces_n.map(|force_n| force_n * size))
        });
        law.follow(all, *least_n);
    }

    /// Whether normal forces at an equilibrium match the contact forces, or are held; otherwise they are renewed
    /// again.
    pub(super) fn friction_settles(&mut self) -> bool {
        let unsettled = self.unsettled();
        self.rubbing.law.settles(unsettled)
    }

    /// Relative difference of the normal forces of friction from the contact forces at the last base.
    pub(crate) fn unsettled(&self) -> f64 {
        if !self.rubs() {
            return 0.0;
        }
        unsettled(self.pairs.iter().map(|pair| &pair.rub.slider), self.rubbing.least_n)
    }

    /// Stops renewing normal forces.
    pub(crate) fn hold_friction(&mut self) {
        self.rubbing.law.hold();
    }

    /// Resumes renewing normal forces.
    pub(crate) fn release_friction(&mut self) {
        self.rubbing.law.release();
    }

    /// Resets normal forces to those of the start of the part, and holds them.
    pub(crate) fn rewind_friction(&mut self) {
        self.hold_friction();
        self.pairs.iter_mut().for_each(|Pair { rub, .. }| *rub = Rub::recalled(rub.slider.begun.1));
    }

    /// Resets slip at the base and holds the normal forces there: see
    /// [`Friction::anchor`](crate::contact::Friction::anchor).
    pub(crate) fn anchor_friction(&mut self) {
        if !self.rubs() {
            return;
        }
        let rubbing = &mut self.rubbing;
        let rubs = self.pairs.iter_mut().map(|pair| &mut pair.rub);
        rubbing.law.anchor(rubs.map(|rub| (&mut rub.slider, rub.apart_mm, 0.0)));
        for Pair { rub, .. } in &mut self.pairs {
            rub.kept_mm = rub.apart_mm - rub.slider.from_mm;
        }
        rubbing.begun.copy_from(&self.base);
        rubbing.advances_mm.fill(0.0);
    }

    /// Lower and upper estimate of the energy dissipated in the part, mJ.
    pub(crate) fn dissipated_mj(&self) -> (f64, f64) {
        let rubs = self.pairs.iter().map(|pair| &pair.rub);
        self.rubbing.law.dissipated_mj(rubs.map(|rub| (&rub.slider, rub.apart_mm, 0.0)))
    }

    /// Friction force on the first point of a pair at the base, N.
    pub(super) fn friction_n(&self, pair: &Pair) -> Vec3 {
        let slip_mm = pair.rub.slip_mm();
        -slip_mm * self.rubbing.law.resistance(&pair.rub.slider, &slip_mm)
    }

    /// Adds friction at the base to a pair's contribution, and returns its energy, mJ.
    pub(super) fn add_friction(&self, pair: &Pair, to: &mut Couple) -> f64 {
        let Rub { slider, apart_mm, .. } = &pair.rub;
        if let Some(f) = self.rubbing.law.derivatives(slider, apart_mm, 0.0) {
            pair.add_friction(to, &f.gradient, &f.hessian);
        }
        self.rubbing.law.value(slider, apart_mm, 0.0)
    }

    /// Friction energy of a pair on the way to a state, mJ.
    pub(super) fn friction_mj(&self, pair: &Pair, curve: &Curve<'_>) -> f64 {
        if !pair.rubs() {
            return 0.0;
        }
        self.rubbing.law.value(&pair.rub.slider, &pair.apart_mm(curve), 0.0)
    }

    /// Stores the friction in a step from the base that solves the current system; the counterpart of
    /// [`crate::contact::wall`] (`wall/slipping.rs`).
    pub(super) fn foresee_slipping(&mut self) {
        let law = self.rubbing.law;
        let begins = !std::mem::replace(&mut self.slips_known, true);
        for pair in self.pairs.iter_mut().filter(|pair| pair.rubs()) {
            let way_mm = pair.way(&self.ways);
            let rub = &mut pair.rub;
            if begins && let Some(f) = law.derivatives(&rub.slider, &rub.apart_mm, 0.0) {
                (rub.at_rest_n, rub.stiffness) = (f.gradient, f.hessian);
            }
            rub.way_mm = way_mm;
            rub.carried_n = rub.linear_n(&rub.way_mm);
        }
    }

    /// Updates friction to the end of the step; returns at how many pairs it changes.
    pub(super) fn slip_on(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        into: &mut dyn Stencils,
    ) -> usize {
        let law = self.rubbing.law;
        let mut changed = 0;
        for pair in self.pairs.iter_mut().filter(|pair| pair.rubs()) {
            let rub = &mut pair.rub;
            let (way_mm, largest_n) = (rub.way_mm, law.largest_n(&rub.slider));
            let Some(f) = law.derivatives(&rub.slider, &(rub.apart_mm + way_mm), 0.0) else { continue };
            let (force_n, stiffness) = (f.gradient, f.hessian);
            let off_n = (force_n - rub.linear_n(&way_mm)).norm();
            changed += usize::from(off_n > CHANGED * largest_n);
            if off_n > RENEWED * largest_n {
                let at_rest_n = force_n - stiffness * way_mm;
                let (more_n, stiffer) = (at_rest_n - rub.at_rest_n, stiffness - rub.stiffness);
                (rub.at_rest_n, rub.stiffness) = (at_rest_n, stiffness);
                // Linear: no force acts on the rotation of tangents.
                into.add_link(elements, base, &pair.link(more_n, stiffer));
            }
        }
        changed
    }

    /// Computes the slips of pairs with friction in a round.
    pub(super) fn look_towards_slips(&mut self) {
        for pair in self.pairs.iter_mut().filter(|pair| pair.rubs()) {
            let end_mm = pair.way(&self.ways);
            pair.rub.end_n = pair.rub.linear_n(&end_mm);
            pair.rub.end_mm = end_mm;
        }
    }

    /// Slope of the friction energy at a `part` of a round, minus the work of the balanced forces.
    pub(super) fn slipping_slope(&self, part: f64) -> f64 {
        let law = self.rubbing.law;
        let each = self.pairs.iter().filter(|pair| pair.rubs()).map(|Pair { rub, .. }| {
            let way_mm = rub.end_mm - rub.way_mm;
            let slip_mm = rub.slider.slip(&(rub.apart_mm + rub.way_mm + way_mm * part), 0.0).0;
            let against = law.resistance(&rub.slider, &slip_mm) * slip_mm.dot(&way_mm);
            against - (rub.carried_n + (rub.end_n - rub.carried_n) * part).dot(&way_mm)
        });
        each.sum()
    }

    /// Moves on by that part of the round, with the balanced forces.
    pub(super) fn carry_slipping(&mut self, part: f64) {
        for Pair { rub, .. } in self.pairs.iter_mut().filter(|pair| pair.rubs()) {
            rub.carried_n += (rub.end_n - rub.carried_n) * part;
            rub.way_mm += (rub.end_mm - rub.way_mm) * part;
        }
    }
}
