//! A predictor that learns from the last step: if the hand repeats its motion, the device is assumed to depart from
//! its own curve as before.
//!
//! A tip that slides along a wall bends in every step by as much as in the one before, relative to the tip. Added to
//! the slid device, this predicts the next equilibrium with an error of second order in the step instead of first:
//! contacts of a hard wall stay closed, and Newton's method takes half the iterations. With several instruments nodes
//! change as one moves in another; the correction is interpolated between them, at the same distance from the line's
//! tip.

use std::ops::{Add, Mul};

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::mesh::Mesh;
use crate::Vec3;
use crate::contact::HandMotion;
use crate::rod::element::mid_slope;
use crate::rod::{ElementData, Frame, MAX_ANGLES, RodState};

/// Difference of an equilibrium from the slid device in an element and its second node.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Departure {
    /// Change of the node's tangent, in the triad of the slid device.
    tangent: Vec3,
    /// Change of the direction at the middle of the element, in the triad of its first node.
    middle: Vec3,
}

/// Difference of an instrument's angles there.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Turn {
    /// Change of the node's material angle against triads carried without twist, rad.
    angle: f64,
    /// Change of the angle bubble, rad.
    bubble: f64,
}

/// Difference of the last equilibrium from the slid device.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Correction {
    /// Advance, mm, and rotation, rad, of each hand in the step.
    motions: Vec<[f64; 2]>,
    /// In order from the tip.
    departures: Vec<Departure>,
    /// For every set of angles in each of these.
    turns: Vec<Turn>,
    /// Change of the angle of every set at the sheath's mouth, rad.
    mouth: Vec<f64>,
}

/// Relative difference of the components up to which motions are the same, except for a factor.
const SAME: f64 = 1e-6;

fn axes(f: &Frame) -> Matrix3<f64> {
    Matrix3::from_columns(&[f.t, f.u, f.v])
}

fn middle(state: &RodState, e: usize) -> Vec3 {
    mid_slope(state.frames[e].t, state.chords[e], state.frames[e + 1].t).normalize()
}

fn size(motions: impl Iterator<Item = f64>) -> f64 {
    motions.fold(0.0, libm::hypot)
}

/// `value` at `x`, linear between ascending positions `0..=last`, and constant beyond the last. `k` is where the
/// search starts: calls ascend.
fn read<T: Mul<f64, Output = T> + Add<Output = T>>(
    x: f64,
    (k, last): (&mut usize, usize),
    place: impl Fn(usize) -> f64,
    value: impl Fn(usize) -> T,
) -> T {
    while *k < last && place(*k) < x {
        *k += 1;
    }
    let here = place(*k);
    if *k == 0 || here <= x {
        return value(*k);
    }
    let before = place(*k - 1);
    let share = (x - before) / (here - before);
    value(*k - 1) * (1.0 - share) + value(*k) * share
}

impl Correction {
    /// Allocates for `elements` elements.
    pub(super) fn reserve(&mut self, elements: usize) {
        self.motions.reserve(1);
        self.departures.reserve(elements);
        self.turns.reserve(elements);
        self.mouth.reserve(MAX_ANGLES);
    }

    /// Clears everything. Keeps the memory.
    pub(super) fn clear(&mut self) {
        self.motions.clear();
        self.departures.clear();
        self.turns.clear();
        self.mouth.clear();
    }

    /// Number of elements with a correction.
    pub(super) fn len(&self) -> usize {
        self.departures.len()
    }

    /// Whether there is a correction for `elements` elements with this number of sets of angles, or none.
    pub(super) fn fits(&self, elements: usize, sets: usize) -> bool {
        let n = self.len();
        (n == 0 || n == elements) && self.turns.len() == n * sets && self.mouth.len() == sets * n.min(1)
    }

    /// Stores the difference of the equilibrium found from the slid device; further rods may follow the slid one.
    pub(super) fn learn(&mut self, motions: &[HandMotion], slid: &RodState, found: &RodState) {
        self.clear();
        self.motions.extend(motions.iter().map(HandMotion::parts));
        let n = found.elements();
        self.mouth.extend((0..found.sets()).map(|set| found.angle(0, set) - slid.angle(0, set)));
        // Those of the slid device are measured from triads carried along the rod without twist; so are these.
        let mut twist = found.reference_twists.iter().sum::<f64>();
        for e in (0..n).rev() {
            let (f, i) = (&slid.frames[e], e + 1);
            self.departures.push(Departure {
                tangent: slid.frames[i].local(&(found.frames[i].t - slid.frames[i].t)),
                middle: f.local(&(middle(found, e) - middle(slid, e))),
            });
            let sets = found.sets();
            self.turns.extend((0..sets).map(|set| Turn {
                angle: found.angle(i, set) + twist - slid.angle(i, set),
                bubble: found.bubbles[sets * e + set] - slid.bubbles[sets * e + set],
            }));
            twist -= found.reference_twists[e];
        }
    }

    /// The ratio of these motions to the hands' last ones; `None` if they are not proportional.
    pub(super) fn repeats(&self, motions: &[HandMotion]) -> Option<f64> {
        let (now, last) = (motions.iter().flat_map(HandMotion::parts), self.motions.iter().flatten());
        let way = size(now.clone());
        let factor = way / size(last.clone().copied());
        let off = size(now.zip(last).map(|(now, last)| now - factor * last));
        let known = !self.departures.is_empty() && way > 0.0 && factor.is_finite();
        (known && off <= SAME * way).then_some(factor)
    }

    /// Interpolates the correction from the nodes `from` to the nodes `to`, into `out`. Parts not inserted then are
    /// not changed.
    pub(super) fn transfer(&self, from: &Mesh, to: &Mesh, out: &mut Self) {
        out.clear();
        let n = self.departures.len();
        let sets = self.turns.len() / n;
        out.mouth.extend_from_slice(&self.mouth);
        let node = |k: usize| from.from_tip_mm[n - k];
        let middle = |k: usize| if k == n { node(n) } else { 0.5 * (node(k) + node(k + 1)) };
        let departure =
            |k: usize, of: fn(&Departure) -> Vec3| self.departures.get(k).map_or_else(Vec3::zeros, of);
        let turn =
            |k: usize, set: usize, of: fn(&Turn) -> f64| self.turns.get(sets * k + set).map_or(0.0, of);
        let (mut k, mut m) = (0, 0);
        for ends in to.from_tip_mm.windows(2).rev() {
            let (x, y) = (ends[1], 0.5 * (ends[0] + ends[1]));
            out.departures.push(Departure {
                tangent: read(x, (&mut k, n), node, |k| departure(k, |by| by.tangent)),
                middle: read(y, (&mut m, n), middle, |m| departure(m, |by| by.middle)),
            });
            out.turns.extend((0..sets).map(|set| Turn {
                angle: read(x, (&mut k, n), node, |k| turn(k, set, |by| by.angle)),
                bubble: read(y, (&mut m, n), middle, |m| turn(m, set, |by| by.bubble)),
            }));
        }
    }

    /// Adds `factor` times the correction to the slid device, whose elements are the first in `state`.
    pub(super) fn apply(&self, factor: f64, elements: &[ElementData], state: &mut RodState) {
        let n = elements.len();
        let first = n - n.min(self.departures.len());
        state.angles.iter_mut().zip(&self.mouth).for_each(|(angle, by)| *angle += factor * by);
        // Each middle before the tangents on either side change.
        let mut t = state.frames[first].t;
        for e in first..n {
            let by = &self.departures[n - 1 - e];
            let m = middle(state, e) + axes(&state.frames[e]) * by.middle * factor;
            let far = state.frames[e + 1];
            let t1 = (far.t + axes(&far) * by.tangent * factor).normalize();
            state.chords[e] = (m.normalize() + (t + t1) * 0.25) / 1.5;
            let sets = state.sets();
            for (set, by) in self.turns[sets * (n - 1 - e)..][..sets].iter().enumerate() {
                state.angles[sets * (e + 1) + set] += factor * by.angle;
                state.bubbles[sets * e + set] += factor * by.bubble;
            }
            if e > first {
                state.frames[e].t = t;
            }
            t = t1;
        }
        state.frames[n].t = t;
        for e in first..n {
            state.frames[e + 1] = state.frames[e].transported_to(&state.frames[e + 1].t);
        }
        state.place(elements);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::kirchhoff::mesh::Fineness;

    const ELEMENT_MM: f64 = 2.0;
    const NODES: usize = 12;

    /// Straight, and bent by 0.3 rad/mm over the last `hook_mm`.
    fn hooked(elements: &[ElementData], hook_mm: f64) -> RodState {
        let length_mm = ELEMENT_MM * elements.len() as f64;
        let angle = |i: usize| 0.3 * (ELEMENT_MM * i as f64 - length_mm + hook_mm).max(0.0);
        let tangent = |i: usize| Vec3::new(angle(i).sin(), 0.0, angle(i).cos());
        let mut frames = vec![Frame::new(tangent(0), Some(Vec3::y()))];
        for i in 1..=elements.len() {
            frames.push(frames[i - 1].transported_to(&tangent(i)));
        }
        RodState::from_frames(elements, Vec3::zeros(), frames)
    }

    fn learnt(motions: &[HandMotion], slid: &RodState, found: &RodState) -> Correction {
        let mut correction = Correction::default();
        correction.learn(motions, slid, found);
        correction
    }

    fn advance(mm: f64, turn_rad: f64) -> HandMotion {
        HandMotion { from_mm: 20.0, to_mm: 20.0 + mm, turn_rad }
    }

    #[test]
    fn motions_repeat_by_a_factor_or_not_at_all() {
        let elements = [ElementData::plain(ELEMENT_MM, 1.0); NODES];
        let (slid, found) = (hooked(&elements, 6.0), hooked(&elements, 6.1));
        let known = learnt(&[advance(1.0, 0.2)], &slid, &found);
        let factor = |mm: f64, rad: f64| known.repeats(&[advance(mm, rad)]);
        assert!((factor(1.0, 0.2).unwrap() - 1.0).abs() < 1e-12);
        assert!((factor(0.5, 0.1).unwrap() - 0.5).abs() < 1e-12);
        assert!((factor(10.0, 2.0).unwrap() - 10.0).abs() < 1e-12);
        // Back, rotated the other way, rotated more, and not at all.
        for (mm, rad) in [(-1.0, -0.2), (1.0, -0.2), (1.0, 0.21), (0.0, 0.0)] {
            assert_eq!(factor(mm, rad), None, "{mm} mm, {rad} rad");
        }
        assert_eq!(Correction::default().repeats(&[advance(1.0, 0.2)]), None);
        // With two hands each must repeat its own motion.
        let both = learnt(&[advance(1.0, 0.0), advance(0.5, 0.0)], &slid, &found);
        assert!((both.repeats(&[advance(2.0, 0.0), advance(1.0, 0.0)]).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(both.repeats(&[advance(1.0, 0.0), advance(1.0, 0.0)]), None);
    }

    #[test]
    fn a_change_that_goes_on_is_foreseen_to_second_order_at_least() {
        let elements = [ElementData::plain(ELEMENT_MM, 1.0); NODES];
        let motions = [advance(1.0, 0.0)];
        // A hook that lengthens by the same amount in each step.
        let off = |by_mm: f64| {
            let [before, now, next] = [0.0, 1.0, 2.0].map(|k| hooked(&elements, 6.0 + k * by_mm));
            let mut guess = now.clone();
            learnt(&motions, &before, &now).apply(1.0, &elements, &mut guess);
            (guess.farthest_mm(&next), now.farthest_mm(&next))
        };
        let ((coarse, without), (fine, _)) = (off(0.1), off(0.05));
        assert!(coarse < 0.1 * without, "{coarse} of {without}");
        let order = (coarse / fine).log2();
        assert!(order > 1.9, "order {order}");
    }

    #[test]
    fn what_was_learnt_is_the_same_on_the_same_nodes_and_between_them_on_others() {
        let device = crate::device::Device::uniform(100.0, 0.5, 1.0).unwrap();
        let mesh = |element_mm: f64| {
            let mut mesh = Mesh::default();
            mesh.build(&device, ELEMENT_MM * NODES as f64, Fineness::of_elements(element_mm), 1.0);
            mesh
        };
        let (from, fine) = (mesh(ELEMENT_MM), mesh(0.5 * ELEMENT_MM));
        let (slid, found) = (hooked(&from.elements, 6.0), hooked(&from.elements, 6.1));
        let known = learnt(&[advance(1.0, 0.0)], &slid, &found);
        let mut out = Correction::default();
        known.transfer(&from, &from, &mut out);
        for (a, b) in out.departures.iter().zip(&known.departures) {
            assert!((a.tangent - b.tangent).norm() < 1e-15 && (a.middle - b.middle).norm() < 1e-15);
        }
        known.transfer(&from, &fine, &mut out);
        assert_eq!((out.len(), known.len()), (2 * NODES, NODES));
        for k in 0..NODES {
            assert!((out.departures[2 * k].tangent - known.departures[k].tangent).norm() < 1e-15);
            if k + 1 < NODES {
                let mean = (known.departures[k].tangent + known.departures[k + 1].tangent) * 0.5;
                assert!((out.departures[2 * k + 1].tangent - mean).norm() < 1e-15);
            }
        }
    }
}
