//! Several rods in one state, one behind the other, with a gap between each and the next
//! ([`ElementData::BREAK`](super::ElementData::BREAK)).

use std::ops::Range;

use super::element::ElementData;
use super::state::RodState;

impl RodState {
    /// Appends another rod with the same number of sets of angles.
    pub(crate) fn join(&mut self, other: &Self) {
        let across = other.positions[0] - self.positions[self.elements()];
        self.chords.push(across / ElementData::BREAK.length);
        self.tensions.push(0.0);
        self.bubbles.resize(self.bubbles.len() + other.sets(), 0.0);
        self.reference_twists.push(0.0);
        self.frames.extend_from_slice(&other.frames);
        self.chords.extend_from_slice(&other.chords);
        self.tensions.extend_from_slice(&other.tensions);
        self.angles.extend_from_slice(&other.angles);
        self.bubbles.extend_from_slice(&other.bubbles);
        self.reference_twists.extend_from_slice(&other.reference_twists);
        self.positions.extend_from_slice(&other.positions);
    }

    /// The rod that consists of these nodes.
    pub(crate) fn part(&self, nodes: Range<usize>) -> Self {
        let sets = self.sets();
        let elements = nodes.start..nodes.end - 1;
        let of_nodes = sets * nodes.start..sets * nodes.end;
        let of_elements = sets * elements.start..sets * elements.end;
        Self {
            frames: self.frames[nodes.clone()].to_vec(),
            chords: self.chords[elements.clone()].to_vec(),
            tensions: self.tensions[elements.clone()].to_vec(),
            angles: self.angles[of_nodes].to_vec(),
            bubbles: self.bubbles[of_elements].to_vec(),
            reference_twists: self.reference_twists[elements].to_vec(),
            positions: self.positions[nodes].to_vec(),
        }
    }

    /// Keeps the first nodes only, at least one. Keeps the memory.
    pub(crate) fn truncate(&mut self, nodes: usize) {
        let sets = self.sets();
        self.angles.truncate(sets * nodes);
        self.frames.truncate(nodes);
        self.positions.truncate(nodes);
        self.chords.truncate(nodes - 1);
        self.bubbles.truncate(sets * (nodes - 1));
        for list in [&mut self.tensions, &mut self.reference_twists] {
            list.truncate(nodes - 1);
        }
    }

    /// Whether its lists have the sizes for this number of elements and sets of angles.
    pub(crate) fn fits(&self, elements: usize, sets: usize) -> bool {
        let nodes = [self.frames.len(), self.positions.len()];
        let each = [self.chords.len(), self.tensions.len(), self.reference_twists.len()];
        nodes == [elements + 1; 2]
            && each == [elements; 3]
            && self.angles.len() == sets * (elements + 1)
            && self.bubbles.len() == sets * elements
    }

    /// Whether all its numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        let triads = self.frames.iter().flat_map(|f| [&f.t, &f.u, &f.v]);
        let vectors = self.positions.iter().chain(&self.chords).chain(triads);
        let numbers =
            [&self.tensions, &self.angles, &self.bubbles, &self.reference_twists].into_iter().flatten();
        vectors.flat_map(|v| v.iter()).chain(numbers).all(|x| x.is_finite())
    }
}
