//! The configuration of the rod, and how a Newton step moves it.

use super::batch::Lane;
use super::element::{ElementData, ElementState, mid_slope};
use super::frame::{Frame, normalised, reference_twist, turn_parts};
use super::layout::{Layout, MAX_ANGLES};
use super::quadrature::Point;
use crate::Vec3;
use serde::{Deserialize, Serialize};

/// State of a rod of n elements: n + 1 nodes.
///
/// Chords are stored beside positions, not computed as their differences: on a fine mesh the difference of two
/// positions loses the digits that determine curvature.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RodState {
    /// Node triads. `t` is the tangent of the rod; angles are measured from `u` and `v`.
    pub frames: Vec<Frame>,
    /// Chords (x₁ − x₀)/h of the elements.
    pub(crate) chords: Vec<Vec3>,
    /// Axial forces of the elements.
    pub tensions: Vec<f64>,
    /// Angles of the material triads against the reference triad at the nodes: node by node, and within a node set by
    /// set.
    pub angles: Vec<f64>,
    /// Angle bubbles of the elements, in the same order: the angle at the middle minus the mean of the ends.
    pub(crate) bubbles: Vec<f64>,
    /// Reference twist of the elements, followed continuously over full turns.
    pub(crate) reference_twists: Vec<f64>,
    /// Node positions; they follow from the first one and the chords.
    pub positions: Vec<Vec3>,
}

impl RodState {
    /// A straight rod from `start` along `frame.t`, untwisted.
    #[cfg(test)]
    pub(crate) fn straight(elements: &[ElementData], start: Vec3, frame: Frame) -> Self {
        Self::from_frames(elements, start, vec![frame; elements.len() + 1])
    }

    /// A rod with the given node tangents: the middle slopes are halfway between them, all angles are zero. The reference
    /// triads are carried along the rod from the first by smallest rotations.
    pub(crate) fn from_frames(elements: &[ElementData], start: Vec3, mut frames: Vec<Frame>) -> Self {
        let n = elements.len();
        let mut chords = Vec::with_capacity(n);
        for e in 0..n {
            frames[e + 1] = frames[e].transported_to(&frames[e + 1].t);
            let sum = frames[e].t + frames[e + 1].t;
            chords.push((sum / sum.norm().max(1e-9) + sum * 0.25) / 1.5);
        }
        let mut state = Self {
            frames,
            chords,
            tensions: vec![0.0; n],
            angles: vec![0.0; n + 1],
            bubbles: vec![0.0; n],
            reference_twists: vec![0.0; n],
            positions: vec![start; n + 1],
        };
        state.place(elements);
        state
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.chords.len()
    }

    /// Computes all node positions from the first node and the chords of these elements.
    pub(crate) fn place(&mut self, elements: &[ElementData]) {
        for (e, data) in elements.iter().enumerate() {
            self.positions[e + 1] = self.positions[e] + self.chords[e] * data.length;
        }
    }

    /// The same centre line with `sets` sets of angles, at least one, all equal to the first.
    pub(crate) fn with_sets(mut self, sets: usize) -> Self {
        let repeat = |list: &[f64]| list.iter().flat_map(|angle| std::iter::repeat_n(*angle, sets)).collect();
        self.angles = repeat(&self.angles);
        self.bubbles = repeat(&self.bubbles);
        self
    }

    /// State of element `e`, where two neighbouring nodes have `C` unknowns.
    #[inline]
    pub(crate) fn element<const C: usize>(&self, e: usize) -> ElementState {
        ElementState {
            first: self.frames[e],
            second: self.frames[e + 1],
            chord: self.chords[e],
            tension: self.tensions[e],
            angles: self.element_angles::<C>(e),
        }
    }

    /// Element `e` as a lane.
    #[inline(always)]
    pub(super) fn lane<'a, const C: usize>(&'a self, data: &'a ElementData, e: usize) -> Lane<'a> {
        Lane {
            data,
            first: &self.frames[e],
            second: &self.frames[e + 1],
            chord: &self.chords[e],
            tension: self.tensions[e],
            angles: self.element_angles::<C>(e),
        }
    }

    /// θ₀, θ₁ + reference twist, and b of each set of angles of element `e`.
    #[inline(always)]
    fn element_angles<const C: usize>(&self, e: usize) -> [[f64; 3]; MAX_ANGLES] {
        let k = Layout::<C>::ANGLES;
        let mut angles = [[0.0; 3]; MAX_ANGLES];
        for (set, angles) in angles.iter_mut().enumerate().take(k) {
            let (first, second) = (self.angles[k * e + set], self.angles[k * (e + 1) + set]);
            *angles = [first, second + self.reference_twists[e], self.bubbles[k * e + set]];
        }
        angles
    }

    /// Number of sets of angles allocated.
    pub(crate) fn sets(&self) -> usize {
        self.angles.len() / self.frames.len().max(1)
    }

    /// Angle of the material triad at node `i` in a `set` of angles.
    pub fn angle(&self, i: usize, set: usize) -> f64 {
        self.angles[self.sets() * i + set]
    }

    /// Unit tangent in element `e` at the local coordinate ξ.
    pub(crate) fn tangent_in(&self, e: usize, xi: f64) -> Vec3 {
        let slope = Point::at(xi, 0.0).derivatives(self.chords[e], self.frames[e].t, self.frames[e + 1].t).0;
        slope / slope.norm()
    }

    /// Twist of the whole rod, rad, any number of turns.
    pub(crate) fn twist(&self) -> f64 {
        self.twist_to(self.elements(), 0)
    }

    /// Twist of the instrument in a `set` of angles from the first node to node `i`, rad, any number of turns.
    pub(crate) fn twist_to(&self, i: usize, set: usize) -> f64 {
        self.angle(i, set) - self.angle(0, set) + self.reference_twists[..i].iter().sum::<f64>()
    }

    /// Angles by which the nodes' triads are turned against one carried along the rod without twist, rad.
    pub(crate) fn carried_twists(&self) -> impl Iterator<Item = f64> {
        std::iter::once(0.0).chain(self.reference_twists.iter().scan(0.0, |sum, twist| {
            *sum += twist;
            Some(*sum)
        }))
    }

    /// Measures the angles of the first nodes from these triads, moved here by smallest rotations; the device stays as
    /// it is.
    ///
    /// The smallest rotation does not spin a triad about its tangent. So where the triads are those of the same nodes
    /// elsewhere, the difference of an angle is the spin of the device on the way. Measured from triads carried along
    /// the rod it is not: those themselves spin by ∫ t·(t′ × δt) ds, the change of writhe (Fuller 1978).
    pub(crate) fn measure_from(&mut self, triads: &[Frame]) {
        let sets = self.sets();
        let mut spin = 0.0;
        for (i, from) in triads.iter().enumerate() {
            let own = self.frames[i];
            self.frames[i] = from.transported_to(&own.t);
            let w = self.frames[i].u;
            let more = libm::atan2(own.v.dot(&w), own.u.dot(&w)) - spin;
            // As little more than at the node before as it can be.
            let more = more - (more / std::f64::consts::TAU).round() * std::f64::consts::TAU;
            spin += more;
            self.angles[sets * i..sets * (i + 1)].iter_mut().for_each(|angle| *angle -= spin);
            if i > 0 {
                self.reference_twists[i - 1] += more;
            }
        }
    }

    /// The material triad (t, d₁, d₂) of node `i`, of the first instrument that has angles.
    pub(crate) fn material_frame(&self, i: usize) -> Frame {
        self.frames[i].turned(self.angle(i, 0))
    }

    /// Allocates for `elements` elements, so that a rod can grow to that size without allocating.
    pub(crate) fn reserve(&mut self, elements: usize) {
        let more = |len: usize| (elements + 1).saturating_sub(len);
        self.frames.reserve(more(self.frames.len()));
        self.angles.reserve((self.sets().max(1) * (elements + 1)).saturating_sub(self.angles.len()));
        self.positions.reserve(more(self.positions.len()));
        self.chords.reserve(more(self.chords.len()));
        for list in [&mut self.tensions, &mut self.bubbles, &mut self.reference_twists] {
            list.reserve(more(list.len()));
        }
    }

    /// Largest distance of a node from its position in another state of the same size, mm.
    pub(crate) fn farthest_mm(&self, other: &Self) -> f64 {
        self.positions.iter().zip(&other.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    /// Copies another state of the same size without allocating.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.frames.clone_from(&other.frames);
        self.chords.clone_from(&other.chords);
        self.tensions.clone_from(&other.tensions);
        self.angles.clone_from(&other.angles);
        self.bubbles.clone_from(&other.bubbles);
        self.reference_twists.clone_from(&other.reference_twists);
        self.positions.clone_from(&other.positions);
    }

    /// Sets this state to `base` moved by `alpha` times the Newton step `d`.
    ///
    /// Node tangents and the slopes in the middle of the elements move along geodesics of the sphere, axial forces of
    /// extensible elements move linearly and give the strain (an inextensible element keeps |r′| = 1 exactly), and
    /// chords and positions follow. So a state that satisfies the constraints stays on the constraint manifold for
    /// any step length, and the energy along the step is the potential energy itself. Constant curvature is
    /// reproduced exactly: one full step solves a pure end moment of any size.
    pub(crate) fn advance<const C: usize>(
        &mut self,
        elements: &[ElementData],
        base: &Self,
        d: &[f64],
        alpha: f64,
    ) {
        let l = Layout::<C>;
        let k = Layout::<C>::ANGLES;
        for i in 0..base.frames.len() {
            let t = l.tangent(i);
            self.frames[i] = base.frames[i].transported(alpha * d[t], alpha * d[t + 1]);
            for set in 0..k {
                self.angles[k * i + set] = base.angles[k * i + set] + alpha * d[l.angle(i, set)];
            }
        }
        self.positions[0] = base.positions[0] + position_step(d, l.position(0)) * alpha;
        for (e, data) in elements.iter().enumerate() {
            if data.is_break() {
                let step = position_step(d, l.position(e + 1)) * alpha;
                self.positions[e + 1] = base.positions[e + 1] + step;
                self.chords[e] = (self.positions[e + 1] - self.positions[e]) / data.length;
                continue;
            }
            let (before, rate) = mid_rate::<C>(elements, base, d, e);
            let size = before.norm();
            let m = before / size;
            let along = m.dot(&rate);
            let turn = (rate - m * along) * (alpha / size);
            let square = turn.norm_squared();
            let (first, second) = turn_parts(square);
            let direction = normalised(&(m * (1.0 - square * second) + turn * first));
            // c = D N exactly: the strain is computed from the force, since a force from the strain would amplify its
            // rounding.
            let length = if data.flexibility > 0.0 {
                self.tensions[e] = base.tensions[e] + alpha * d[l.tension(e)];
                1.0 + 1.5 * data.flexibility * self.tensions[e] / data.length
            } else {
                1.0
            };
            let ends = self.frames[e].t + self.frames[e + 1].t;
            self.chords[e] = (direction * length + ends * 0.25) / 1.5;
            self.positions[e + 1] = self.positions[e] + self.chords[e] * data.length;
            for set in 0..k {
                self.bubbles[k * e + set] = base.bubbles[k * e + set] + alpha * d[l.bubble(e, set)];
            }
            if k > 0 {
                let psi = reference_twist(&self.frames[e], &self.frames[e + 1]);
                let turns = ((base.reference_twists[e] - psi) / std::f64::consts::TAU).round();
                self.reference_twists[e] = psi + turns * std::f64::consts::TAU;
            }
        }
    }

    /// Sets the axial forces of inextensible elements after the Newton step `d` from `base`: as multipliers they take
    /// the full step, however far the state moves. (Those of extensible elements move with the state.)
    pub(crate) fn take_tensions<const C: usize>(&mut self, elements: &[ElementData], base: &Self, d: &[f64]) {
        for (e, data) in elements.iter().enumerate() {
            if data.flexibility == 0.0 {
                self.tensions[e] = base.tensions[e] + d[Layout::<C>.tension(e)];
            }
        }
    }

    /// Whether an element bends by more than 120° from end to end: then the drawn curve is a fiftieth shorter than
    /// the element, at 180° a tenth, where its twist is no longer defined.
    pub(crate) fn is_folded(&self, elements: &[ElementData]) -> bool {
        const COSINE: f64 = -0.5;
        let mut each = self.frames.windows(2).zip(elements).filter(|(_, data)| !data.is_break());
        each.any(|(ends, _)| ends[0].t.dot(&ends[1].t) < COSINE)
    }

    /// The largest rotation in a step, at nodes and at the middle of elements, and the largest change of angle.
    pub(crate) fn largest_turn<const C: usize>(
        elements: &[ElementData],
        base: &Self,
        d: &[f64],
    ) -> (f64, f64) {
        let l = Layout::<C>;
        let (mut square, mut twist) = (0.0f64, 0.0f64);
        for i in 0..base.frames.len() {
            let t = l.tangent(i);
            square = square.max(d[t] * d[t] + d[t + 1] * d[t + 1]);
            for set in 0..Layout::<C>::ANGLES {
                twist = twist.max(d[l.angle(i, set)].abs());
            }
        }
        for e in (0..elements.len()).filter(|e| !elements[*e].is_break()) {
            let (mid, rate) = mid_rate::<C>(elements, base, d, e);
            let (size, along) = (mid.norm_squared(), mid.dot(&rate));
            square = square.max((rate.norm_squared() - along * along / size) / size);
        }
        (square.sqrt(), twist)
    }
}

/// The slope in the middle of element `e` and its rate of change along the step `d`.
#[inline]
fn mid_rate<const C: usize>(elements: &[ElementData], base: &RodState, d: &[f64], e: usize) -> (Vec3, Vec3) {
    let l = Layout::<C>;
    let (f0, f1) = (&base.frames[e], &base.frames[e + 1]);
    let (t0, t1) = (l.tangent(e), l.tangent(e + 1));
    let chord = (position_step(d, l.position(e + 1)) - position_step(d, l.position(e))) / elements[e].length;
    let ends = f0.u * d[t0] + f0.v * d[t0 + 1] + f1.u * d[t1] + f1.v * d[t1 + 1];
    (mid_slope(f0.t, base.chords[e], f1.t), chord * 1.5 - ends * 0.25)
}

/// The three entries of a step from `at` on.
#[inline]
fn position_step(d: &[f64], at: usize) -> Vec3 {
    Vec3::new(d[at], d[at + 1], d[at + 2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const NODES: usize = 9;

    /// A rod whose tangents go from z to this angle from it in the plane at this azimuth, with a uniform twist.
    fn bent(angle: f64, azimuth: f64, twist: f64) -> RodState {
        let elements = [ElementData::plain(1.0, 1.0); NODES - 1];
        let tangent = |i: usize| {
            let polar = angle * i as f64 / (NODES - 1) as f64;
            Vec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos())
        };
        let mut frames = vec![Frame::new(Vec3::z(), Some(Vec3::x()))];
        for i in 1..NODES {
            frames.push(frames[i - 1].transported_to(&tangent(i)));
        }
        let mut state = RodState::from_frames(&elements, Vec3::zeros(), frames);
        state.angles.iter_mut().enumerate().for_each(|(i, angle)| *angle = twist * i as f64);
        state
    }

    #[test]
    fn an_angle_measured_from_elsewhere_is_the_spin_on_the_way() {
        let (angle, turn) = (1.2, 0.5);
        let (before, mut after) = (bent(angle, 0.3, 0.1), bent(angle, 0.3 + turn, 0.1));
        let was = after.clone();
        after.measure_from(&before.frames);
        // The area between the two paths of the tangent: of a spherical triangle with this angle between two sides.
        let side = libm::tan(0.5 * angle).powi(2);
        let area = 2.0 * (side * turn.sin()).atan2(1.0 + side * turn.cos());
        let spin = after.angle(NODES - 1, 0) - before.angle(NODES - 1, 0);
        assert!((spin.abs() - area).abs() < 1e-12, "{spin} {area}");
        // Both rods carry their triads without twist: measured from those, nothing has turned.
        assert_eq!(was.angle(NODES - 1, 0), before.angle(NODES - 1, 0));
        assert_eq!(after.angle(0, 0), 0.0);
    }

    #[test]
    fn measured_from_elsewhere_the_device_is_the_same() {
        let before = bent(0.4, 0.0, 0.0);
        let was = bent(2.5, 1.9, 1.0);
        let mut after = was.clone();
        after.measure_from(&before.frames);
        for i in 0..NODES {
            let off = (after.material_frame(i).u - was.material_frame(i).u).norm();
            assert!(off < 1e-12 && after.frames[i].t == was.frames[i].t, "{off} at {i}");
        }
        for e in 0..NODES - 1 {
            let twist = after.angles[e + 1] - after.angles[e] + after.reference_twists[e];
            assert!((twist - 1.0).abs() < 1e-12, "{twist}");
            let off = reference_twist(&after.frames[e], &after.frames[e + 1]) - after.reference_twists[e];
            assert!((off / TAU - (off / TAU).round()).abs() < 1e-12, "{off}");
        }
        // Counter-check: the triads are others.
        assert!((after.frames[NODES - 1].u - was.frames[NODES - 1].u).norm() > 0.1);
        // And back.
        after.measure_from(&was.frames);
        for (a, b) in after.angles.iter().zip(&was.angles) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }
}
