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
mod follow;
mod moving;

pub use between::{Between, InnerFriction, Place};
pub(in crate::contact) use follow::Renewal;
pub use follow::SETTLED;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::ContactPoint;
use crate::Vec3;
use crate::rod::{ElementData, RodState};
use crate::vessel::Displacement;

/// Slip below which a point sticks, as a fraction of the hand's motion, or of the device's radius if the hand rests:
/// the error of the regularisation.
const STICK: f64 = 1e-3;
/// Factor by which it shrinks in every relaxation while the hand holds still.
pub(in crate::contact) const STICK_AT_REST: f64 = 0.3;
/// Smallest slip after shrinking, as a fraction of that of the step: a smaller one would make friction stiffer than
/// any wall.
const LEAST_AT_REST: f64 = 0.01;
/// Smallest slip length, mm: below it steps are lost in the rounding of positions.
const LEAST_STICK_MM: f64 = 1e-8;
/// Friction at a point causes another round in a step where its force is wrong by more than this fraction of its
/// bound.
pub(in crate::contact) const CHANGED: f64 = 0.05;
/// A round updates friction where it is wrong by more than this fraction: without the update, the error would make
/// steps uphill.
pub(in crate::contact) const RENEWED: f64 = 5e-3;
/// Points nearer to the tip than this many radii (plus the advance) keep their own normal force; the others take the
/// one felt before at their new position, since the wall does not move.
const TIP_RADII: f64 = 10.0;

/// A contact point in a step with friction.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Slider {
    /// a: where the point slips from.
    from_mm: Vec3,
    /// θₐ: its material angle before the step.
    from_rad: f64,
    /// Direction of the device.
    along: Vec3,
    /// Normal of the wall, into the lumen.
    normal: Vec3,
    /// N: normal force, scaled down where the coefficient is below its largest value.
    force_n: f64,
    /// Normal and force at the start of the step.
    begun: (Vec3, f64),
    /// Normal and force at the last base.
    seen: (Vec3, f64),
}

impl Slider {
    /// A point at x̄ with direction t̄, to where it has moved by `advance_mm` along its own curve, without normal force
    /// yet.
    fn at((place_mm, along): (Vec3, Vec3), from_rad: f64, advance_mm: f64) -> Self {
        Self {
            from_mm: place_mm - along * advance_mm,
            from_rad,
            along,
            normal: Vec3::zeros(),
            force_n: 0.0,
            begun: (Vec3::zeros(), 0.0),
            seen: (Vec3::zeros(), 0.0),
        }
    }
}

/// Normal force on a contact point at an equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NormalForce {
    /// Normal of the wall, into the lumen.
    normal: Vec3,
    /// Force, scaled down where the coefficient is below its largest value, N.
    force_n: f64,
}

/// Derivatives of a point's friction energy in its position and its angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrictionDerivatives {
    /// In the position, N: minus the friction force on the device.
    pub gradient: Vec3,
    /// Second derivative in the position, N/mm.
    pub hessian: Matrix3<f64>,
    /// In the angle, N·mm.
    pub turn: f64,
    /// Second derivative in the angle, N·mm.
    pub turn2: f64,
    /// Mixed derivative, N.
    pub mixed: Vec3,
}

/// Friction at all contact points of a device in one step.
#[derive(Debug, Clone, Default)]
pub struct Friction {
    coefficient: f64,
    /// ε, mm.
    stick_mm: f64,
    /// Lower bound of ε as it shrinks while the hand holds still, mm.
    least_stick_mm: f64,
    renewal: follow::Renewal,
    /// Energy dissipated before slip was reset, mJ.
    taken_mj: f64,
    sliders: Vec<Slider>,
    /// Friction between instruments.
    pub(crate) between: Between,
}

/// Motion of a hand in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandMotion {
    /// Length inserted before, mm.
    pub from_mm: f64,
    /// Length inserted after, mm.
    pub to_mm: f64,
    /// Turn, rad.
    pub turn_rad: f64,
}

impl HandMotion {
    /// Advance, mm; positive inwards.
    pub fn advance_mm(&self) -> f64 {
        self.to_mm - self.from_mm
    }

    /// Advance, mm, and turn, rad.
    pub(crate) fn parts(&self) -> [f64; 2] {
        [self.advance_mm(), self.turn_rad]
    }
}

impl Friction {
    /// Friction of coefficient μ ≥ 0; 0 disables it.
    pub fn new(coefficient: f64) -> Self {
        Self { coefficient, ..Self::default() }
    }

    /// Allocates for `points` points.
    pub(crate) fn reserve(&mut self, points: usize) {
        if self.acts() {
            self.sliders.reserve(points.saturating_sub(self.sliders.len()));
        }
    }

    /// Whether there is friction.
    pub(crate) fn acts(&self) -> bool {
        self.coefficient > 0.0
    }

    /// Begins a step: `state` is the device after it has slid along its own curve, with the angles it had before.
    ///
    /// `before` are the points of the last equilibrium and `forces` the normal forces on them, the first estimate.
    /// `hands` are the motions of all instruments: a point slips by the motion of its own.
    pub fn begin(
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
        self.release();
        self.taken_mj = 0.0;
        if !self.acts() {
            return;
        }
        let line_mm = |length: fn(&HandMotion) -> f64| hands.iter().map(length).fold(0.0, f64::max);
        let advance = line_mm(|hand| hand.to_mm) - line_mm(|hand| hand.from_mm);
        let radius = points.first().map_or(0.0, |p| p.potential.radius_mm);
        [self.stick_mm, self.least_stick_mm] = stick_mm(hands, radius);
        let (old_points, old) = before;
        let count = old_points.len().min(old.len());
        let near_tip = TIP_RADII * radius + advance.abs();
        let mut k = 0;
        for (index, point) in points.iter().enumerate() {
            let advance_mm = hands[point.instrument].advance_mm();
            let mut slider = Slider::at(slid(point), point.angle(state), advance_mm);
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
            slider.begun = (slider.normal, slider.force_n);
            self.sliders.push(slider);
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
            self.stick_within(STICK * first.potential.radius_mm);
        }
        self.sliders.extend(points.iter().zip(forces).map(|(point, NormalForce { normal, force_n })| {
            let (normal, force_n) = (*normal, *force_n);
            let at = Slider::at(point.position_and_tangent(elements, state), point.angle(state), 0.0);
            Slider { normal, force_n, begun: (normal, force_n), ..at }
        }));
    }

    /// The wall has moved since the step began; the reference points of slip move with its material points: see
    /// [`moving`].
    pub(crate) fn carry(&mut self, (before, after): (&Displacement, &Displacement), hands: &[HandMotion]) {
        let mut farthest_mm = 0.0f64;
        for slider in &mut self.sliders {
            farthest_mm = farthest_mm.max(slider.carry(before, after));
        }
        // If the hands rest, the motion of the wall sets ε.
        let moves = hands.iter().any(|hand| hand.parts() != [0.0; 2]);
        let stick_mm = STICK * farthest_mm;
        if farthest_mm > 0.0 {
            self.stick_within(if moves { self.stick_mm.max(stick_mm) } else { stick_mm });
        }
    }

    /// Sets the ε of a step.
    fn stick_within(&mut self, stick_mm: f64) {
        [self.stick_mm, self.least_stick_mm] = sticking_mm(stick_mm);
    }

    /// Stores the normal forces at the end of a step.
    pub(crate) fn keep(&self, forces: &mut Vec<NormalForce>) {
        forces.clear();
        forces.extend(self.sliders.iter().map(|s| NormalForce { normal: s.normal, force_n: s.force_n }));
    }

    /// Friction force on a point divided by its `slip`, N/mm.
    pub(crate) fn resistance(&self, index: usize, slip: &Vec3) -> f64 {
        resistance(self.largest_n(index), slip, self.stick_mm)
    }

    /// Slip vector of a point and the direction in which its surface moves when it spins.
    pub(crate) fn slip(&self, index: usize, x: &Vec3, angle: f64, radius_mm: f64) -> (Vec3, Vec3) {
        let s = &self.sliders[index];
        let spin = s.normal.cross(&s.along) * radius_mm;
        let way = x - s.from_mm;
        (way - s.normal * s.normal.dot(&way) + spin * (angle - s.from_rad), spin)
    }

    /// The largest force of friction on a point, N.
    pub(crate) fn largest_n(&self, index: usize) -> f64 {
        self.sliders.get(index).map_or(0.0, |slider| self.coefficient * slider.force_n)
    }

    /// Whether a point may be held by friction.
    pub(super) fn holds(&self, index: usize) -> bool {
        self.sliders.get(index).is_some_and(|slider| slider.force_n > 0.0)
    }

    /// Whether a point has no friction, now and at the start of the step.
    pub(super) fn is_free(&self, index: usize) -> bool {
        self.sliders.get(index).is_none_or(|slider| slider.force_n == 0.0 && slider.begun.1 == 0.0)
    }

    /// Friction energy of a point.
    pub fn value(&self, index: usize, x: &Vec3, angle: f64, radius_mm: f64) -> f64 {
        let force = self.largest_n(index);
        if force == 0.0 {
            return 0.0;
        }
        force * phi(self.slip(index, x, angle, radius_mm).0.norm(), self.stick_mm)
    }

    /// Energy dissipated by friction in the step, with the normal forces of its end, mJ.
    fn taken_mj(&self, elements: &[ElementData], state: &RodState, points: &[ContactPoint]) -> f64 {
        self.taken_mj + self.rubbed_mj(elements, state, points)[1]
    }

    /// Lower and upper estimate of the energy dissipated in the step, mJ: with the normal forces of its start and of
    /// its end.
    pub(crate) fn dissipated_mj(
        &self,
        elements: &[ElementData],
        state: &RodState,
        points: &[ContactPoint],
    ) -> (f64, f64) {
        let [at_start_mj, at_end_mj] = self.rubbed_mj(elements, state, points);
        // After slip was reset, the forces of the start no longer apply.
        if self.taken_mj != 0.0 {
            let taken_mj = self.taken_mj + at_end_mj;
            return (taken_mj, taken_mj);
        }
        (at_start_mj.min(at_end_mj), at_start_mj.max(at_end_mj))
    }

    /// Energy dissipated since slip was last reset, mJ: with the normal forces of the step's start and of its end.
    fn rubbed_mj(&self, elements: &[ElementData], state: &RodState, points: &[ContactPoint]) -> [f64; 2] {
        let mut sums_mj = [0.0; 2];
        for (index, (slider, point)) in self.sliders.iter().zip(points).enumerate() {
            let forces_n = [slider.begun.1, slider.force_n];
            if forces_n.iter().all(|force_n| *force_n <= 0.0) {
                continue;
            }
            let x = point.position(elements, state);
            let slip_mm = self.slip(index, &x, point.angle(state), point.potential.radius_mm).0.norm();
            let way_mm = rubbed_mm(slip_mm, self.stick_mm);
            for (sum_mj, force_n) in sums_mj.iter_mut().zip(forces_n) {
                *sum_mj += self.coefficient * force_n.max(0.0) * way_mm;
            }
        }
        sums_mj
    }

    /// Resets slip at `state` and holds the normal forces there: the hand holds still, and the device slides on until
    /// it rests. Slip of a stuck point is scaled to the new, smaller ε, so that friction holds it as before.
    pub(crate) fn anchor(&mut self, elements: &[ElementData], state: &RodState, points: &[ContactPoint]) {
        self.hold();
        let taken_mj = self.taken_mj(elements, state, points);
        let stick_mm = (self.stick_mm * STICK_AT_REST).max(self.least_stick_mm);
        for (index, point) in points.iter().enumerate().take(self.sliders.len()) {
            let (x, angle) = (point.position(elements, state), point.angle(state));
            let slip = self.slip(index, &x, angle, point.potential.radius_mm).0;
            let kept = slip * (stick_mm / slip.norm().max(self.stick_mm));
            let slider = &mut self.sliders[index];
            (slider.from_mm, slider.from_rad) = (x - kept, angle);
            slider.force_n = slider.seen.1;
            if slider.seen.1 > 0.0 {
                slider.normal = slider.seen.0;
            }
        }
        self.stick_mm = stick_mm;
        self.taken_mj = 0.0;
        self.taken_mj = taken_mj - self.taken_mj(elements, state, points);
    }

    /// Derivatives of a point's friction energy; `None` without a normal force.
    pub(crate) fn derivatives(
        &self,
        index: usize,
        x: &Vec3,
        angle: f64,
        radius_mm: f64,
    ) -> Option<FrictionDerivatives> {
        let slider = self.sliders.get(index).filter(|_| self.holds(index))?;
        let force = self.coefficient * slider.force_n;
        let (slip, spin) = self.slip(index, x, angle, radius_mm);
        let plane = Matrix3::identity() - slider.normal * slider.normal.transpose();
        let (gradient, hessian) = force_of_slip(force, &plane, &slip, self.stick_mm);
        let mixed = hessian * spin;
        Some(FrictionDerivatives {
            gradient,
            hessian,
            turn: gradient.dot(&spin),
            turn2: mixed.dot(&spin),
            mixed,
        })
    }
}

/// ε for a step with these hand motions and a device of that radius, and its lower bound while the hands hold still,
/// mm. An instrument at rest gets the ε of those that move.
pub(crate) fn stick_mm(hands: &[HandMotion], radius_mm: f64) -> [f64; 2] {
    let ways = hands.iter().map(|hand| hand.advance_mm().abs() + radius_mm * hand.turn_rad.abs());
    let way_mm = ways.fold(0.0, f64::max);
    sticking_mm(STICK * if way_mm > 0.0 { way_mm } else { radius_mm })
}

fn sticking_mm(stick_mm: f64) -> [f64; 2] {
    [stick_mm, LEAST_AT_REST * stick_mm].map(|mm| mm.max(LEAST_STICK_MM))
}

/// Gradient of μ N φ in a slip in the wall's plane, N, and its derivative, N/mm.
pub(in crate::contact) fn force_of_slip(
    largest_n: f64,
    plane: &Matrix3<f64>,
    slip_mm: &Vec3,
    stick_mm: f64,
) -> (Vec3, Matrix3<f64>) {
    let y = slip_mm.norm();
    let (over, second) = rates(y, stick_mm);
    let unit = if y > 0.0 { slip_mm / y } else { Vec3::zeros() };
    let hessian = (plane * over + unit * unit.transpose() * (second - over)) * largest_n;
    (slip_mm * (largest_n * over), hessian)
}

/// Friction force divided by its slip, N/mm.
pub(in crate::contact) fn resistance(largest_n: f64, slip_mm: &Vec3, stick_mm: f64) -> f64 {
    largest_n * rates(slip_mm.norm(), stick_mm).0
}

/// The slip length over which friction dissipates energy, mm: 0 while sticking.
pub(in crate::contact) fn rubbed_mm(slip_mm: f64, stick_mm: f64) -> f64 {
    phi(slip_mm, stick_mm) - phi(0.0, stick_mm)
}

/// φ(y) with ε = `e`.
pub(in crate::contact) fn phi(y: f64, e: f64) -> f64 {
    if y >= e { y } else { y * y / e - y * y * y / (3.0 * e * e) + e / 3.0 }
}

/// φ′/y and φ″.
fn rates(y: f64, e: f64) -> (f64, f64) {
    if y >= e { (1.0 / y, 0.0) } else { (2.0 / e - y / (e * e), 2.0 / e - 2.0 * y / (e * e)) }
}

#[cfg(test)]
mod tests;
