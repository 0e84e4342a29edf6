//! Coulomb friction of the device on the wall, as an incremental potential.
//!
//! In a step every contact point of the device slips along the wall by
//!
//! ```text
//! u = P (x − a) + r (θ − θₐ) n × t,    P = I − n nᵀ,    a = x̄ − Δ t̄
//! ```
//!
//! where x̄ and t̄ are its position and direction after the device has slid by the advance Δ of its hand along the
//! line's curve before the step, so that a device that follows its curve slips by exactly Δ t̄ for any step length; θ is the material
//! angle, θₐ that before the step, and n × t the direction in which a surface that touches the wall with normal n
//! moves when the device spins. Friction is then
//!
//! ```text
//! D = Σ μ Nᵢ φ(|uᵢ|),    φ(y) = y  for y ≥ ε,    y²/ε − y³/3ε² + ε/3  for less
//! ```
//!
//! of Li et al., *Incremental potential contact*, SIGGRAPH 2020 (eq. 14): twice continuously differentiable, with a
//! force μN against the slip wherever the point slips farther than ε, and less where it sticks. A stuck point creeps
//! by less than ε per step; ε is a thousandth of the hand's motion in the step, or of the radius if the hand rests.
//!
//! The normal force N and the normal n are lagged: within one Newton step they are fixed in D, so the energy keeps a
//! symmetric Hessian and steps that descend; between steps they are renewed (`friction/follow.rs`). The final state
//! satisfies Coulomb's law.
//!
//! Where the coefficient varies over the wall, μ is the largest one, and N the normal force times the local
//! coefficient over μ, which is lagged with the force.

mod between;
mod coulomb;
mod follow;
mod moving;
mod slider;

pub(crate) use between::{Between, InnerFriction, Place};
pub(in crate::contact) use coulomb::{Coulomb, FrictionDerivatives};
pub(in crate::contact) use follow::unsettled;
pub(crate) use moving::CarriedSlopes;
pub(crate) use slider::NormalForce;
pub(in crate::contact) use slider::Slider;

use super::ContactPoint;
use crate::Vec3;
use crate::rod::{ElementData, RodState};
use crate::tuning::FrictionTuning;
use crate::vessel::Displacement;
use coulomb::sticking_mm;

/// Smallest slip length, mm: below it steps are lost in the rounding of positions.
const LEAST_STICK_MM: f64 = 1e-8;

/// Friction at all contact points of a device in one step.
#[derive(Debug, Clone, Default)]
pub(crate) struct Friction {
    pub(in crate::contact) law: Coulomb,
    /// One for each contact point; none without friction.
    pub(in crate::contact) sliders: Vec<Slider>,
    /// Friction between instruments.
    pub(crate) between: Between,
}

/// Motion of a hand in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HandMotion {
    /// Length inserted before, mm.
    pub from_mm: f64,
    /// Length inserted after, mm.
    pub to_mm: f64,
    /// Turn, rad.
    pub turn_rad: f64,
    /// Change of the steering value.
    pub steer: f64,
}

impl HandMotion {
    /// Advance, mm; positive inwards.
    pub(crate) fn advance_mm(&self) -> f64 {
        self.to_mm - self.from_mm
    }

    /// Advance, mm, and turn, rad.
    pub(crate) fn parts(&self) -> [f64; 2] {
        [self.advance_mm(), self.turn_rad]
    }
}

impl Friction {
    /// Friction of coefficient μ ≥ 0; 0 disables it.
    pub(crate) fn new(coefficient: f64) -> Self {
        Self::tuned(coefficient, &FrictionTuning::DEFAULT)
    }

    /// As [`Self::new`], with these numbers.
    pub(crate) fn tuned(coefficient: f64, tuning: &FrictionTuning) -> Self {
        Self { law: Coulomb::new(coefficient, tuning), sliders: Vec::new(), between: Between::new(tuning) }
    }

    /// Allocates for `points` points.
    pub(crate) fn reserve(&mut self, points: usize) {
        if self.acts() {
            self.sliders.reserve(points.saturating_sub(self.sliders.len()));
        }
    }

    /// Whether there is friction.
    pub(crate) fn acts(&self) -> bool {
        self.law.acts()
    }

    /// ε of the step, mm; infinite without friction.
    pub(crate) fn stick_mm(&self) -> f64 {
        if self.acts() { self.law.stick_mm } else { f64::INFINITY }
    }

    /// Sets ε, mm.
    pub(crate) fn stick_at(&mut self, stick_mm: f64) {
        self.law.stick_mm = stick_mm;
    }

    /// The same friction with another coefficient.
    pub(crate) fn set_coefficient(&mut self, coefficient: f64) {
        self.law.coefficient = coefficient;
    }

    /// Begins a step: `state` is the device after it has slid along its own curve, with the angles it had before.
    ///
    /// `before` are the points of the last equilibrium and `forces` the normal forces on them, the first estimate.
    /// `hands` are the motions of all instruments: a point slips by the motion of its own.
    pub(crate) fn begin(
        &mut self,
        elements: &[ElementData],
        state: &RodState,
        points: &[ContactPoint],
        before: (&[ContactPoint], &[NormalForce]),
        hands: &[HandMotion],
    ) {
        self.begin_on(|point| point.position_and_tangent(elements, state), state, points, before, hands);
    }

    /// As [`Self::begin`], with x̄ and t̄ of each point. A `state` on other nodes than before has them only nearly:
    /// between nodes that have moved on, a curve of cubic pieces is another one.
    pub(crate) fn begin_on(
        &mut self,
        slid: impl Fn(&ContactPoint) -> (Vec3, Vec3),
        state: &RodState,
        points: &[ContactPoint],
        before: (&[ContactPoint], &[NormalForce]),
        hands: &[HandMotion],
    ) {
        self.sliders.clear();
        self.law.begin();
        if !self.acts() {
            return;
        }
        let line_mm = |length: fn(&HandMotion) -> f64| hands.iter().map(length).fold(0.0, f64::max);
        let advance = line_mm(|hand| hand.to_mm) - line_mm(|hand| hand.from_mm);
        let radius = points.first().map_or(0.0, |p| p.potential.radius_mm);
        self.law.stick_within(stick_mm(hands, radius, &self.law.tuning));
        let (old_points, old) = before;
        let count = old_points.len().min(old.len());
        let near_tip = self.law.tuning.tip_radii * radius + advance.abs();
        let mut k = 0;
        for (index, point) in points.iter().enumerate() {
            let advance_mm = hands[point.instrument].advance_mm();
            let mut slider = Slider::at(slid(point), point.turned(state), advance_mm);
            let same = |old: &ContactPoint| old.instrument == point.instrument;
            if point.from_tip_mm < near_tip && old_points.get(index).is_none_or(same) {
                if index < count {
                    (slider.normal, slider.force_n) = (old[index].normal, old[index].force_n);
                }
            } else {
                // Arc length from the tip of the piece of device that was here before.
                let label = point.from_tip_mm - advance;
                while k + 1 < count && old_points[k + 1].from_tip_mm < label {
                    k += 1;
                }
                if k + 1 < count {
                    let (a, b) = (&old_points[k], &old_points[k + 1]);
                    let share = ((label - a.from_tip_mm) / (b.from_tip_mm - a.from_tip_mm)).clamp(0.0, 1.0);
                    let (p, q) = (&old[k], &old[k + 1]);
                    let pressure = (1.0 - share) * p.force_n / a.weight_mm + share * q.force_n / b.weight_mm;
                    slider.normal = if share < 0.5 { p.normal } else { q.normal };
                    slider.force_n = point.weight_mm * pressure;
                }
            }
            self.sliders.push(slider.with(slider.normal, slider.force_n));
        }
    }

    /// Continues with the points of a rod that no hand moves, with these normal forces.
    pub(crate) fn go_on(
        &mut self,
        elements: &[ElementData],
        state: &RodState,
        points: &[ContactPoint],
        forces: &[NormalForce],
    ) {
        if !self.acts() {
            return;
        }
        // With no hand on the rod, ε follows from its radius.
        if let ([], Some(first)) = (&self.sliders[..], points.first()) {
            let tuning = self.law.tuning;
            self.law.stick_within(sticking_mm(tuning.stick * first.potential.radius_mm, &tuning));
        }
        self.sliders.extend(points.iter().zip(forces).map(|(point, NormalForce { normal, force_n })| {
            let at = Slider::at(point.position_and_tangent(elements, state), point.turned(state), 0.0);
            at.with(*normal, *force_n)
        }));
    }

    /// The wall has moved since the step began; the reference points of slip move with its material points: see
    /// [`moving`].
    pub(crate) fn carry(&mut self, passage: (&Displacement, &Displacement), hands: &[HandMotion]) {
        let farthest_mm = self.go_with(passage);
        // If the hands rest, the motion of the wall sets ε.
        let moves = hands.iter().any(|hand| hand.parts() != [0.0; 2]);
        let tuning = self.law.tuning;
        let stick_mm = tuning.stick * farthest_mm;
        if farthest_mm > 0.0 {
            let stick_mm = if moves { self.law.stick_mm.max(stick_mm) } else { stick_mm };
            self.law.stick_within(sticking_mm(stick_mm, &tuning));
        }
    }

    /// The vessel yields further: the reference points of slip move with its material points. Returns how far at most, mm.
    pub(crate) fn go_with(&mut self, (before, after): (&Displacement, &Displacement)) -> f64 {
        self.sliders.iter_mut().map(|slider| slider.carry(before, after)).fold(0.0, f64::max)
    }

    /// Stores the normal forces at the end of a step.
    pub(crate) fn keep(&self, forces: &mut Vec<NormalForce>) {
        forces.clear();
        forces.extend(self.sliders.iter().map(|s| NormalForce { normal: s.normal, force_n: s.force_n }));
    }

    /// The friction of a point, if it may be held.
    #[inline]
    pub(super) fn holding(&self, index: usize) -> Option<&Slider> {
        self.sliders.get(index).filter(|slider| slider.holds())
    }

    /// Friction energy of a point, mJ.
    #[inline]
    pub(super) fn value(&self, index: usize, x: &Vec3, angle: f64) -> f64 {
        self.holding(index).map_or(0.0, |slider| self.law.value(slider, x, angle))
    }

    /// Derivatives of the friction energy of a point; `None` without a normal force.
    #[inline]
    pub(super) fn derivatives(&self, index: usize, x: &Vec3, angle: f64) -> Option<FrictionDerivatives> {
        self.law.derivatives(self.holding(index)?, x, angle)
    }

    /// Whether a point has no friction, now and at the start of the step.
    #[inline]
    pub(super) fn is_free(&self, index: usize) -> bool {
        self.sliders.get(index).is_none_or(Slider::is_free)
    }

    /// Renews the normal forces from the active points: ascending indices, each with its normal, its force unknown,
    /// and the force of its depth, N.
    pub(super) fn follow(&mut self, active: impl Iterator<Item = (usize, (Vec3, [f64; 2]))>, least_n: f64) {
        let mut active = active.peekable();
        let all = self.sliders.iter_mut().enumerate().map(|(index, slider)| {
            let now = active.next_if(|(point, _)| *point == index);
            let (normal, forces_n) = now.map_or((slider.normal, [0.0; 2]), |(_, now)| now);
            (slider, normal, forces_n)
        });
        self.law.follow(all, least_n);
    }

    /// Resumes renewing normal forces.
    pub(crate) fn release(&mut self) {
        self.law.release();
    }

    /// Sets the normal forces to those of a solution, one per point, and renews them from there.
    pub(crate) fn resume<'a>(&mut self, forces: impl IntoIterator<Item = &'a NormalForce>) {
        self.release();
        self.sliders.iter_mut().zip(forces).for_each(|(s, f)| (s.normal, s.force_n) = (f.normal, f.force_n));
    }

    /// Resets and holds the normal forces of the start of the step.
    pub(super) fn rewind(&mut self) {
        self.law.hold();
        self.sliders.iter_mut().for_each(Slider::rewind);
    }

    /// Lower and upper estimate of the energy dissipated in the step, mJ.
    pub(crate) fn dissipated_mj(
        &self,
        elements: &[ElementData],
        state: &RodState,
        points: &[ContactPoint],
    ) -> (f64, f64) {
        let held = self.sliders.iter().zip(points).filter(|(slider, _)| !slider.is_free());
        self.law.dissipated_mj(
            held.map(|(slider, point)| (slider, point.position(elements, state), point.angle(state))),
        )
    }

    /// Resets slip at `state` and holds the normal forces there.
    pub(super) fn anchor(&mut self, elements: &[ElementData], state: &RodState, points: &[ContactPoint]) {
        let all = self.sliders.iter_mut().zip(points);
        self.law
            .anchor(all.map(|(slider, point)| (slider, point.position(elements, state), point.angle(state))));
    }
}

/// ε for a step with these hand motions and a device of that radius, and its lower bound while the hands hold still,
/// mm. An instrument that is still gets the ε of those that move.
pub(crate) fn stick_mm(hands: &[HandMotion], radius_mm: f64, tuning: &FrictionTuning) -> [f64; 2] {
    let ways = hands.iter().map(|hand| hand.advance_mm().abs() + radius_mm * hand.turn_rad.abs());
    let way_mm = ways.fold(0.0, f64::max);
    sticking_mm(tuning.stick * if way_mm > 0.0 { way_mm } else { radius_mm }, tuning)
}

#[cfg(test)]
mod tests;
