//! Elements of the rod that are clear of the wall.
//!
//! All of a device is visited several times in every iteration, and most of it is far from the wall. If no point of
//! an element can touch as long as it moves by less than s in any direction, its points are skipped until it has
//! moved farther. The motion of its nodes bounds that of its points ([`largest_motion`]).
//!
//! The points of a skipped element would read what they have read before: they are free within s, their [`Room`], in
//! any direction. So skipping does not change the forces. Only their positions at the base are not recorded; they are
//! evaluated there before any trial. A point that has queried the wall at two near positions may then use the other
//! result, which changes distances by rounding.

use std::ops::Range;

use super::{Reading, WallContact};
use crate::Vec3;
use crate::contact::point::ContactPoint;
use crate::contact::surface::Hint;
use crate::rod::quadrature::largest_motion;
use crate::rod::{ElementData, RodState};

/// Places and tangents of the two nodes of an element.
type Nodes = [Vec3; 4];

/// Distance of points from touching anything.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    /// s: none touches the wall while they move by less than this, mm; 0 where they may touch.
    free_mm: f64,
    /// Lower bound of their distances to the wall, mm.
    clearance_mm: f64,
}

impl Room {
    /// Room without any points.
    pub(super) const UNLIMITED: Self = Self { free_mm: f64::INFINITY, clearance_mm: f64::INFINITY };
    /// Room of points about which nothing is known.
    const NONE: Self = Self { free_mm: 0.0, clearance_mm: 0.0 };

    /// Reduces the room to the smaller of both.
    pub(super) fn take(&mut self, other: Self) {
        self.free_mm = self.free_mm.min(other.free_mm);
        self.clearance_mm = self.clearance_mm.min(other.clearance_mm);
    }
}

/// The contact points of one element.
#[derive(Debug, Clone)]
pub(in crate::contact) struct Span {
    /// Its points.
    pub(super) points: Range<usize>,
    /// Number of the element.
    pub(super) element: usize,
    /// Its nodes when all of its points were last evaluated, and at the base.
    looked_at: Nodes,
    base: Nodes,
    room: Room,
    /// Whether the positions of its points at the base are known. A step begins with those of the last equilibrium.
    pub(super) at_base: bool,
}

impl Span {
    /// The spans of `points`, about which nothing is known.
    pub(in crate::contact) fn all(points: &[ContactPoint]) -> impl Iterator<Item = Self> {
        let mut begin = 0;
        points.chunk_by(|a, b| a.element == b.element).map(move |group| {
            let span = begin..begin + group.len();
            begin = span.end;
            Self {
                points: span,
                element: group[0].element,
                looked_at: UNKNOWN,
                base: UNKNOWN,
                room: Room::NONE,
                at_base: true,
            }
        })
    }

    /// Lessens the room of its points by so much, mm.
    pub(in crate::contact) fn narrow(&mut self, by_mm: f64) {
        self.room.free_mm = (self.room.free_mm - by_mm).max(0.0);
        self.room.clearance_mm -= by_mm;
    }

    /// Records the room of its points, which have been evaluated at a state.
    pub(super) fn look(&mut self, state: &RodState, room: Room) {
        (self.looked_at, self.room) = (nodes(self.element, state), room);
    }
}

/// Nodes of elements that have not been evaluated.
const UNKNOWN: Nodes = [Vec3::new(f64::NAN, f64::NAN, f64::NAN); 4];

fn nodes(element: usize, state: &RodState) -> Nodes {
    let (x, frames) = (&state.positions, &state.frames);
    [x[element], x[element + 1], frames[element].t, frames[element + 1].t]
}

impl WallContact<'_> {
    /// Whether no point of a span can touch the wall at a state.
    fn is_free(&self, span: &Span, elements: &[ElementData], state: &RodState) -> bool {
        span.room.free_mm > 0.0 && {
            let to = nodes(span.element, state);
            self.motion_mm(&span.looked_at, &to, elements[span.element].length) < span.room.free_mm
        }
    }

    /// Upper bound of the motion of a material point of the vessel under a point of an element, mm.
    fn motion_mm(&self, from: &Nodes, to: &Nodes, length_mm: f64) -> f64 {
        let [x0, x1, t0, t1] = [0, 1, 2, 3].map(|k| (to[k] - from[k]).norm());
        largest_motion(length_mm, [(x0, t0), (x1, t1)]) * self.surface.motion_stretch()
    }

    /// The points of a span, unless none can touch the wall at a state; their positions at the base are known
    /// afterwards.
    pub(super) fn near(
        &mut self,
        span: usize,
        elements: &[ElementData],
        state: &RodState,
    ) -> Option<Range<usize>> {
        let known = &self.cache.spans[span];
        if self.is_free(known, elements, state) {
            return None;
        }
        Some(self.know_base(span, elements))
    }

    /// The points of a span, unless all can go `part` of the straight way from the base to a state without coming
    /// near a wall; the positions of the returned points at the base are known afterwards.
    pub(super) fn near_way(
        &mut self,
        span: usize,
        elements: &[ElementData],
        state: &RodState,
        part: f64,
    ) -> Option<Range<usize>> {
        let known = &self.cache.spans[span];
        if known.room.free_mm > 0.0 {
            let (to, length_mm) = (nodes(known.element, state), elements[known.element].length);
            let clearance_mm =
                known.room.clearance_mm - self.motion_mm(&known.looked_at, &known.base, length_mm);
            if part * self.motion_mm(&known.base, &to, length_mm) <= self.cache.tuning.safe * clearance_mm {
                return None;
            }
        }
        Some(self.know_base(span, elements))
    }

    /// The points of a span, after recording their positions at the base.
    fn know_base(&mut self, span: usize, elements: &[ElementData]) -> Range<usize> {
        let known = &mut self.cache.spans[span];
        let (points, base, length_mm) = (known.points.clone(), known.base, elements[known.element].length);
        if !std::mem::replace(&mut known.at_base, true) {
            for index in points.clone() {
                let x = self.points[index].between(&base, length_mm);
                let material = self.material_at(index, &x);
                self.read_base(index, elements, &material);
            }
        }
        points
    }

    /// Records the positions of all points at the base, which must be known before they are stored or evaluated
    /// elsewhere.
    pub(crate) fn know_whole_base(&mut self, elements: &[ElementData]) {
        for span in 0..self.cache.spans.len() {
            self.know_base(span, elements);
        }
    }

    /// The room of each node of a device at a state, mm: how far it can move without coming near a wall, as known
    /// from the points on the element before it, or their radius if that is larger.
    pub(crate) fn rooms(&self, elements: &[ElementData], state: &RodState, room_mm: &mut Vec<f64>) {
        room_mm.clear();
        room_mm.resize(elements.len() + 1, f64::INFINITY);
        for span in &self.cache.spans {
            let e = span.element;
            let motion_mm = self.motion_mm(&span.looked_at, &nodes(e, state), elements[e].length);
            // NaN where nothing is known.
            let clearance_mm = (span.room.clearance_mm - motion_mm).max(0.0);
            let radius_mm = self.points[span.points.start].potential.radius_mm;
            room_mm[e + 1] = clearance_mm.max(radius_mm);
        }
        // The first node of a rod gets the room of its second.
        room_mm[0] = room_mm[1];
        for e in (0..elements.len()).filter(|e| elements[*e].is_break()) {
            room_mm[e + 1] = room_mm[e + 2];
        }
    }

    /// Makes a state the base, and evaluates the points that may touch there.
    pub(super) fn look_at_base(&mut self, elements: &[ElementData], state: &RodState) {
        self.cache.set.clear();
        for span in 0..self.cache.spans.len() {
            let free = self.is_free(&self.cache.spans[span], elements, state);
            let known = &mut self.cache.spans[span];
            known.base = nodes(known.element, state);
            known.at_base = !free;
            if free {
                continue;
            }
            let points = known.points.clone();
            let mut room = Room::UNLIMITED;
            for index in points {
                let x = self.material(index, elements, state);
                let reading = self.read_base(index, elements, &x);
                if let (Reading::Pressed(d), true) = (&reading, self.cache.points[index].presses) {
                    let penalty_n_per_mm = self.penalty_n_per_mm(index, elements);
                    let contact = self.contact(index, (d.value_mm, d.gradient), penalty_n_per_mm);
                    self.cache.set.contacts.push(contact);
                }
                room.take(self.room(index, &x, &reading));
            }
            self.cache.spans[span].look(state, room);
        }
    }

    /// Distance of point `index`, at `x` with this reading, from touching anything.
    pub(super) fn room(&self, index: usize, x: &Vec3, reading: &Reading) -> Room {
        let known = &self.cache.points[index];
        let moved_mm = (x - known.looked_at).norm();
        // A reading within the room must not change what is known, so a point with a triangle has no room; neither
        // has one that pressed at the last equilibrium and may be held to the wall, nor one with NaN.
        let free = matches!(reading, Reading::Free(_))
            && known.piece.is_none()
            && known.side.is_none()
            && !known.presses
            && self.friction.is_free(index)
            && known.free_mm > moved_mm;
        let free_mm = if free { known.free_mm - moved_mm } else { 0.0 };
        Room { free_mm, clearance_mm: known.clearance_mm - moved_mm }
    }

    /// Records the position `x` of a point at the base and its reading there, also off the wall while it has a force.
    fn read_base(&mut self, index: usize, elements: &[ElementData], x: &Vec3) -> Reading {
        let radius_mm = self.points[index].potential.radius_mm;
        let force_n = self.cache.points[index].force_n;
        let limit_mm = if force_n > 0.0 { self.followed_mm(radius_mm) } else { radius_mm };
        let reading = self.read_within(index, x, limit_mm);
        let presses = match &reading {
            Reading::Free(_) => false,
            Reading::Pressed(d) => {
                force_n + self.penalty_n_per_mm(index, elements) * (radius_mm - d.value_mm) > 0.0
            }
        };
        let known = &mut self.cache.points[index];
        known.base = *x;
        known.base_clearance_mm = reading.distance_mm();
        (known.base_looked_at, known.base_piece) = (known.looked_at, known.piece);
        (known.base_looked_clearance_mm, known.base_free_mm) = (known.clearance_mm, known.free_mm);
        let hint = known.piece.map(if known.side.is_some() { Hint::Side } else { Hint::Near });
        let sunk = hint.filter(|_| known.base_clearance_mm < self.cache.tuning.sunk * radius_mm);
        known.side = sunk.map(|hint| self.surface.side(x, hint));
        known.presses = presses;
        if !presses {
            known.force_n = 0.0;
        }
        reading
    }
}

#[cfg(test)]
mod tests;
