//! How far an equilibrium may be from its prediction.
//!
//! A device that is moved slowly follows its path of equilibria. An equilibrium found by Newton's method is the next
//! one on that path if it is close to the prediction, and otherwise may be any other: continuation methods reduce
//! their steps until it is close (E. L. Allgower, K. Georg, *Numerical Continuation Methods*, 1990, chapter 6; P.
//! Deuflhard, *Newton Methods for Nonlinear Problems*, 2004, chapter 5). The vessel determines what is close: the
//! room of a node is its clearance, or the radius of the vessel if it touches the wall.
//!
//! Where the stiffness is indefinite at an iterate, the energy has a saddle between the prediction and the result:
//! there the path bends away to one side, and a stable branch on the other side is as near (an imperfect pitchfork).
//! The neighbourhood is then a part of its size.

use serde::{Deserialize, Serialize};

use crate::Vec3;
use crate::rod::RodState;
use crate::tuning::NewtonTuning;

/// The predicted nodes of a rod, and how far each may be from its prediction.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Neighbourhood {
    nodes: Vec<(Vec3, f64)>,
    angles: Vec<f64>,
    /// Whether Newton's method stops when an iterate leaves the neighbourhood.
    pub(crate) bounds: bool,
    /// Whether the stiffness was indefinite at an iterate.
    is_indefinite: bool,
}

impl Neighbourhood {
    /// Allocates for rods of up to `elements` elements with `sets` sets of angles.
    pub(crate) fn reserve(&mut self, elements: usize, sets: usize) {
        self.nodes.reserve((elements + 1).saturating_sub(self.nodes.len()));
        self.angles.reserve((sets * (elements + 1)).saturating_sub(self.angles.len()));
    }

    /// Centres the neighbourhood on a prediction whose nodes, the first one included, have this room, mm.
    pub(crate) fn begin(&mut self, state: &RodState, room_mm: &[f64], tuning: &NewtonTuning) {
        let places = state.positions.iter().zip(room_mm);
        self.nodes.clear();
        self.nodes.extend(places.map(|(at_mm, room_mm)| (*at_mm, tuning.rooms * room_mm)));
        self.angles.clear();
        self.angles.extend(carried(state));
        self.is_indefinite = false;
    }

    /// The stiffness is indefinite at an iterate.
    pub(crate) fn is_at_a_saddle(&mut self) {
        self.is_indefinite = true;
    }

    /// Largest deviation of a state from the prediction, as a fraction of the allowed one.
    pub(crate) fn off(&self, state: &RodState, tuning: &NewtonTuning) -> f64 {
        let places = state.positions.iter().zip(&self.nodes);
        let off = places.map(|(x, (at_mm, most_mm))| (x - at_mm).norm() / most_mm).fold(0.0, f64::max);
        let turn = |(angle, was): (f64, &f64)| (angle - was).abs() / tuning.room_rad;
        let turns = carried(state).zip(&self.angles).map(turn);
        turns.fold(off, f64::max)
    }

    /// The largest [`Neighbourhood::off`] of an equilibrium.
    pub(crate) fn most_off(&self, tuning: &NewtonTuning) -> f64 {
        if self.is_indefinite { tuning.indefinite_rooms } else { 1.0 }
    }

    /// Position of the node with the largest deviation from its prediction relative to its room, mm.
    pub(crate) fn farthest(&self, state: &RodState) -> Vec3 {
        let off = |(x, (at_mm, most_mm)): (&Vec3, &(Vec3, f64))| (x - at_mm).norm() / most_mm;
        let places = state.positions.iter().zip(&self.nodes);
        let farthest = places.max_by(|a, b| off(*a).total_cmp(&off(*b)));
        farthest.map_or_else(Vec3::zeros, |(x, _)| *x)
    }

    /// Whether Newton's method should stop because this iterate is too far away.
    pub(crate) fn is_left_by(&self, state: &RodState, tuning: &NewtonTuning) -> bool {
        self.bounds && self.off(state, tuning) > tuning.stray * self.most_off(tuning)
    }
}

/// The angles of all sets at all nodes, measured from triads carried along the rod without twist.
fn carried(state: &RodState) -> impl Iterator<Item = f64> {
    let nodes = state.carried_twists().zip(state.angles.chunks(state.sets()));
    nodes.flat_map(|(twist, angles)| angles.iter().map(move |angle| angle + twist))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rod::{ElementData, Frame};

    #[test]
    fn a_node_is_near_within_its_room_and_an_angle_within_a_radian() {
        let elements = [ElementData::plain(2.0, 1.0); 2];
        let rod = RodState::straight(&elements, Vec3::zeros(), Frame::new(Vec3::z(), None));
        let mut near = Neighbourhood { bounds: true, ..Neighbourhood::default() };
        let tuning = NewtonTuning::DEFAULT;
        near.begin(&rod, &[0.5, 0.5, 4.0], &tuning);
        let moved = |node: usize, by_mm: f64| {
            let mut there = rod.clone();
            there.positions[node].x += by_mm;
            there
        };
        assert_eq!(near.off(&rod, &tuning), 0.0);
        assert!(
            (near.off(&moved(1, 0.5), &tuning) - 0.5).abs() < 1e-12
                && (near.off(&moved(2, 0.5), &tuning) - 0.0625).abs() < 1e-12
        );
        assert!(!near.is_left_by(&moved(1, 2.9), &tuning) && near.is_left_by(&moved(1, 3.1), &tuning));
        near.bounds = false;
        assert!(!near.is_left_by(&moved(1, 3.1), &tuning));
        near.is_at_a_saddle();
        near.bounds = true;
        assert_eq!(near.most_off(&tuning), tuning.indefinite_rooms);
        assert!(!near.is_left_by(&moved(1, 1.4), &tuning) && near.is_left_by(&moved(1, 1.6), &tuning));
        near.begin(&rod, &[0.5, 0.5, 4.0], &tuning);
        let mut turned = rod.clone();
        turned.angles[2] += 0.3;
        assert!((near.off(&turned, &tuning) - 0.3).abs() < 1e-12);
        // The reference triads have turned back by the same angle.
        turned.reference_twists[1] -= 0.3;
        assert!(near.off(&turned, &tuning) < 1e-12);
    }
}
