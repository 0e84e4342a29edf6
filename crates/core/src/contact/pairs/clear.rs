//! Fast tests for rods that cannot touch themselves.
//!
//! A curve whose tangent turns by less than K < π between two points has a chord of at least cos(K/2) of the arc
//! between them (A. Schur, Math. Ann. 83 (1921)). Two pieces in contact are at least half a turn of the rod's radius
//! apart along it; a rod that turns by less than two radians in all would have to lie within its own thickness
//! between them. So for most devices the tangents are enough.
//!
//! If no two pieces are nearer than 8 D, and no point has moved since by more than 3/4 D, none are nearer than 6½ D,
//! and no step between such states brings two nearer by more than half of that.

use super::{SelfContact, tree};
use crate::Vec3;
use crate::rod::quadrature::largest_motion;
use crate::rod::{ElementData, RodState};

/// Total rotation of a rod's tangent, rad, up to which it cannot touch itself.
const TURN: f64 = 2.0;

/// Positions and tangents of nodes at a state where nothing was near.
#[derive(Debug, Clone, Default)]
pub(super) struct Clear {
    nodes: Vec<(Vec3, Vec3)>,
}

impl Clear {
    fn of(state: &RodState) -> Self {
        Self { nodes: nodes(state).collect() }
    }

    /// Whether no point of a rod is farther than this from its position in another state, mm.
    fn holds(&self, elements: &[ElementData], state: &RodState, most_mm: f64) -> bool {
        self.nodes.len() == state.positions.len()
            && motions_mm(elements, self.nodes.iter().copied(), state).all(|mm| mm <= most_mm)
    }
}

/// For each element, a bound of the motion of its points from nodes with these positions and tangents to a state, mm.
pub(super) fn motions_mm(
    elements: &[ElementData],
    nodes: impl Iterator<Item = (Vec3, Vec3)>,
    to: &RodState,
) -> impl Iterator<Item = f64> {
    let moved = nodes.zip(&to.positions).zip(&to.frames);
    let mut moved = moved.map(|(((x, t), there), frame)| ((there - x).norm(), (frame.t - t).norm()));
    let mut last = moved.next().unwrap_or_default();
    moved.zip(elements).map(move |(here, element)| {
        let most_mm = largest_motion(element.length, [last, here]);
        last = here;
        most_mm
    })
}

/// Positions and tangents of the nodes of a state.
pub(super) fn nodes(state: &RodState) -> impl Iterator<Item = (Vec3, Vec3)> {
    state.positions.iter().zip(&state.frames).map(|(x, frame)| (*x, frame.t))
}

/// Whether a rod is bent so little that it cannot touch itself.
fn is_open(state: &RodState) -> bool {
    let turns = state.frames.windows(2).zip(&state.chords).map(|(ends, chord)| {
        let along = chord / chord.norm();
        (along - ends[0].t).norm() + (ends[1].t - along).norm()
    });
    // The chord of a rotation is at most the rotation, and at most a twentieth shorter up to a radian.
    1.05 * turns.sum::<f64>() < TURN
}

impl SelfContact {
    /// Whether there is a single rod, which cannot touch itself.
    fn is_alone_and_open(&self, elements: &[ElementData], state: &RodState) -> bool {
        is_open(state) && !elements.iter().any(ElementData::is_break)
    }

    /// Whether nothing is near, at the base and at a state, and no step between them passes anything.
    pub(super) fn stays_clear(&self, elements: &[ElementData], state: &RodState) -> bool {
        let most_mm = self.tuning.free * 2.0 * self.largest_radius_mm;
        self.pairs.is_empty()
            && self.clear.as_ref().is_some_and(|clear| {
                (clear.nodes.is_empty() && self.is_alone_and_open(elements, state))
                    || clear.holds(elements, state, most_mm)
            })
    }

    /// Tests whether nothing is near at a base.
    pub(super) fn look_whether_clear(&mut self, elements: &[ElementData], state: &RodState) -> bool {
        if self.closed {
            return false;
        }
        if self.is_alone_and_open(elements, state) {
            self.clear = Some(Clear::default());
            return true;
        }
        let most_mm = self.tuning.free * 2.0 * self.largest_radius_mm;
        let known = self.clear.as_ref().filter(|clear| !clear.nodes.is_empty());
        if known.is_some_and(|clear| clear.holds(elements, state, most_mm)) {
            return true;
        }
        self.clear = None;
        self.place_tree(elements);
        self.counters.searches += 1;
        let reach_mm = self.tuning.clear * 2.0 * self.largest_radius_mm;
        self.tree.near(reach_mm, self.apart_mm(), |_, _| reach_mm, &mut self.near);
        if self.near.is_empty() {
            self.clear = Some(Clear::of(state));
        }
        self.near.is_empty()
    }

    /// Whether the last `advance_mm` of the rod, pushed straight ahead, would run into the rest of it: come nearer to
    /// its axis than half the touching distance.
    pub(crate) fn blocks_its_tip(
        &mut self,
        elements: &[ElementData],
        state: &RodState,
        advance_mm: f64,
    ) -> bool {
        if advance_mm <= 0.0 || self.capsules.is_empty() || self.is_alone_and_open(elements, state) {
            return false;
        }
        // The tip belongs to the first rod.
        let Some(last) = elements.iter().take_while(|data| !data.is_break()).count().checked_sub(1) else {
            return false;
        };
        self.is_placed = false;
        let Self { capsules, tuning, .. } = self;
        self.tree.place(&super::Curve { elements, state, capsules, closed: false, tuning });
        let tip = state.positions[last + 1];
        let from = tip - state.frames[last + 1].t * advance_mm;
        let reach_mm = |e: usize| 0.5 * (self.capsules[e].radius_mm + self.capsules[last].radius_mm);
        self.tree.is_near_segment((&from, &tip), advance_mm + self.apart_mm(), reach_mm)
    }

    /// Whether the rod passes through itself between two states.
    pub(crate) fn crosses(&mut self, elements: &[ElementData], from: &RodState, to: &RodState) -> bool {
        if self.capsules.is_empty() || (self.is_alone_and_open(elements, from) && is_open(to)) {
            return false;
        }
        self.is_placed = false;
        let Self { capsules, tuning, .. } = self;
        let curve = |state| super::Curve { elements, state, capsules, closed: self.closed, tuning };
        self.tree.place(&curve(from));
        self.tree.move_to(&curve(to));
        self.tree.safe_part(tree::half_turn(self.largest_radius_mm)) < 1.0
    }
}
