//! The guess that learns from the last step: where the same motion of the hand follows, the device departs from its own curve as it
//! did before.
//!
//! A tip that slides along a wall bends in every step by as much as in the step before, seen from the tip. Added to the
//! slid device, that leaves the next equilibrium at second order in the step instead of first: contacts of a hard wall stay closed
//! on the way there, and Newton's method takes half the iterations.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::Vec3;
use crate::contact::HandMotion;
use crate::rod::element::mid_slope;
use crate::rod::{ElementData, Frame, RodState};

/// How an equilibrium differed from the slid device in an element and its second node.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Departure {
    /// Change of the node's tangent, in the triad of the slid device.
    tangent: Vec3,
    /// Change of the direction in the middle of the element, in the triad of its first node.
    middle: Vec3,
    /// Change of the node's material angle against triads carried without twist, rad.
    angle: f64,
    /// Change of the angle bubble, rad.
    bubble: f64,
}

/// What the last step changed on the slid device.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Correction {
    /// Advance, mm, and turn, rad, of the step.
    motion: [f64; 2],
    /// From the tip.
    departures: Vec<Departure>,
}

/// Motions are the same if their parts differ by less than this, …
const SAME: f64 = 1e-6;
/// … times a factor of at most this, or over it.
const LONGER: f64 = 5.0;
/// Nothing is learnt where a tangent turned by more than this, rad: the device let go of something.
const LARGEST: f64 = 0.2;

fn axes(f: &Frame) -> Matrix3<f64> {
    Matrix3::from_columns(&[f.t, f.u, f.v])
}

fn middle(state: &RodState, e: usize) -> Vec3 {
    mid_slope(&state.frames[e].t, &state.chords[e], &state.frames[e + 1].t).normalize()
}

fn motion(hand: HandMotion) -> [f64; 2] {
    [hand.to_mm - hand.from_mm, hand.turn_rad]
}

impl Correction {
    /// Takes memory for `elements` elements.
    pub(super) fn reserve(&mut self, elements: usize) {
        self.departures.reserve(elements);
    }

    /// Forgets all. Keeps the memory.
    pub(super) fn clear(&mut self) {
        self.motion = [0.0; 2];
        self.departures.clear();
    }

    /// Remembers the way from the slid device to the equilibrium that was found.
    pub(super) fn learn(&mut self, hand: HandMotion, slid: &RodState, found: &RodState) {
        self.departures.clear();
        self.motion = motion(hand);
        let n = slid.elements();
        let far = |i: usize| (found.frames[i].t - slid.frames[i].t).norm_squared() > LARGEST * LARGEST;
        if (0..=n).any(far) {
            return;
        }
        let mut twist: f64 = found.reference_twists.iter().sum();
        for e in (0..n).rev() {
            let (f, i) = (&slid.frames[e], e + 1);
            self.departures.push(Departure {
                tangent: slid.frames[i].local(&(found.frames[i].t - slid.frames[i].t)),
                middle: f.local(&(middle(found, e) - middle(slid, e))),
                angle: found.angles[i] + twist - slid.angles[i],
                bubble: found.bubbles[e] - slid.bubbles[e],
            });
            twist -= found.reference_twists[e];
        }
    }

    /// How many of the last motions this one is; `None` if it is another one.
    pub(super) fn repeats(&self, hand: HandMotion) -> Option<f64> {
        let (now, last) = (motion(hand), self.motion);
        let size = |m: [f64; 2]| m[0].hypot(m[1]);
        let factor = size(now) / size(last);
        let off = (now[0] - factor * last[0]).hypot(now[1] - factor * last[1]);
        let known = !self.departures.is_empty() && factor.is_finite();
        (known && off <= SAME * size(now) && (1.0 / LONGER..=LONGER).contains(&factor)).then_some(factor)
    }

    /// Changes the slid device in `state` by `factor` times what was learnt.
    pub(super) fn apply(&self, factor: f64, elements: &[ElementData], state: &mut RodState) {
        let n = state.elements();
        let first = n - n.min(self.departures.len());
        // Each middle before the tangents on either side change.
        let mut t = state.frames[first].t;
        for e in first..n {
            let by = &self.departures[n - 1 - e];
            let m = middle(state, e) + axes(&state.frames[e]) * by.middle * factor;
            let far = state.frames[e + 1];
            let t1 = (far.t + axes(&far) * by.tangent * factor).normalize();
            state.chords[e] = (m.normalize() + (t + t1) * 0.25) / 1.5;
            state.angles[e + 1] += factor * by.angle;
            state.bubbles[e] += factor * by.bubble;
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
