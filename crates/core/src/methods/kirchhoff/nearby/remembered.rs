//! How the forces at the end of a part change with the state in which it began.
//!
//! They depend on that state by where friction begins to slip, and by the twist of the tails. What is remembered of a part is therefore
//! the motion m of its end: a change of the rod's unknowns, then of the numbers of each tail's twist, then of the force across at the
//! mouth. A place on the curve of the rod before, and its direction, are local in m. Angles are not: they are measured from triads that
//! are carried along the rod without twist, before the part and once the device has slid. When both ends of a smallest rotation
//! from t₀ to t₁ turn a little, each of their triads by its own smallest rotation, what lies between is twisted by
//!
//! ```text
//! dψ = c · (dt₀ + dt₁),    c = (t₀ × t₁)/(1 + t₀·t₁)
//! ```
//!
//! So with ψₑ along the rod before and ψ′ₑ along the slid one, an angle θ′ of the slid device has spun by dθ′ = dθ + Σ dψₑ − Σ dψ′ₑ, and the
//! slip of the device at a node, measured by the smallest rotation from its slid triad to that at the end, by
//!
//! ```text
//! dφ = dθ + c·dt − dθ′ + c·dt′
//! ```
//!
//! Sums along the rod are the only long ones; with them as intermediates all is sparse ([`Chain`]).

use nalgebra::Matrix3;

use super::super::configuration::Start;
use super::super::mesh::Mesh;
use super::super::tail::TWIST;
use super::super::tails::Tails;
use super::chain::{Chain, Memory, WRENCH};
use super::sparse::{Row, Sparse};
use crate::Vec3;
use crate::contact::{CarriedSlopes, FrictionSlopes, HandMotion, Place, PressingSlopes};
use crate::device::Stack;
use crate::methods::kirchhoff::carried::Passage;
use crate::rod::quadrature::{Point, hermite};
use crate::rod::scatter::{angle_weights, point_columns};
use crate::rod::{Frame, Layout, RodState};

/// Step of differences in the numbers of a tail's twist.
pub(super) const TAIL_STEP: f64 = 1e-6;

/// Where a force and a moment at a point act on the rod.
pub(super) struct Scatter {
    pub(super) columns: [(usize, Vec3); 10],
    /// None without angles.
    turning: Option<[(usize, f64); 3]>,
}

impl Scatter {
    /// At a contact point.
    pub(super) fn at<const C: usize>(rod: &RodState, mesh: &Mesh, index: usize) -> Self {
        let (e, xi, set) = mesh.points[index].place();
        Self {
            columns: point_columns::<C>(rod, &mesh.elements[e], e, xi),
            turning: (Layout::<C>::ANGLES > 0).then(|| angle_weights::<C>((e, xi, set))),
        }
    }

    /// Tells the rows of a force and a moment.
    pub(super) fn add(&self, (force, moment): (Vec3, f64), mut tell: impl FnMut(usize, f64)) {
        self.columns.iter().for_each(|(row, way)| tell(*row, way.dot(&force)));
        self.turning.iter().flatten().for_each(|(row, weight)| tell(*row, weight * moment));
    }
}

/// A part of the angle that a point had before: that of material in a tail.
pub(super) struct Entered {
    pub(super) instrument: usize,
    pub(super) from_tip_mm: f64,
    pub(super) weight: f64,
}

/// Derivatives of a vector.
type Vectors = Vec<(usize, Vec3)>;

/// A part from the state before it to its end.
pub(super) struct Between<'a> {
    pub(super) before: Start<'a>,
    /// Mesh and rod at the end.
    pub(super) mesh: &'a Mesh,
    pub(super) rod: &'a RodState,
    /// Triads of the slid device, before the vessel moved; none without friction.
    pub(super) slid: &'a [Frame],
    pub(super) stack: &'a Stack,
    pub(super) tails: &'a Tails,
    pub(super) passage: Option<Passage<'a>>,
    /// Motions of the hands in the part.
    pub(super) motions: &'a [HandMotion],
}

/// c of two directions.
pub(super) fn twisting(first: &Vec3, second: &Vec3) -> Vec3 {
    first.cross(second) / (1.0 + first.dot(second))
}

fn dotted(by: &Vec3, vectors: &Vectors) -> Row {
    vectors.iter().map(|(column, vector)| (*column, by.dot(vector))).collect()
}

fn plus(to: &mut Row, row: &[(usize, f64)], times: f64) {
    to.extend(row.iter().map(|(column, value)| (*column, value * times)));
}

impl Between<'_> {
    /// Where its numbers are.
    pub(super) fn memory<const C: usize>(&self) -> Memory {
        let rows = Layout::<C>::dimension(self.before.state.rod.elements());
        Memory { rows, instruments: self.before.state.hands.len() }
    }

    /// Column of the sum of twists before, up to a node.
    fn carried<const C: usize>(&self, node: usize) -> usize {
        self.memory::<C>().len() + node
    }

    /// Column of the sum of twists of the slid device, up to a node.
    fn spun<const C: usize>(&self, node: usize) -> usize {
        self.carried::<C>(self.before.state.rod.elements() + 1) + node
    }

    /// The element before and the place in it, 0 to 1, at this distance from the sheath; none beyond the tip.
    fn on_curve(&self, from_sheath_mm: f64) -> Option<(usize, f64)> {
        let Start { mesh, state } = self.before;
        let (last, s) = (state.rod.elements(), mesh.from_tip_mm[0] - from_sheath_mm);
        if last == 0 || s <= 0.0 {
            return None;
        }
        let e = mesh.from_tip_mm[1..=last].partition_point(|end| *end > s).min(last - 1);
        Some((e, ((mesh.from_tip_mm[e] - s) / mesh.elements[e].length).clamp(0.0, 1.0)))
    }

    /// Of the direction of the curve before at this distance from the sheath.
    fn direction<const C: usize>(&self, from_sheath_mm: f64) -> Vectors {
        let (l, rod) = (Layout::<C>, &self.before.state.rod);
        let last = rod.elements();
        let Some((e, xi)) = self.on_curve(from_sheath_mm) else {
            let frame = &rod.frames[last];
            return if last == 0 {
                Vec::new()
            } else {
                vec![(l.tangent(last), frame.u), (l.tangent(last) + 1, frame.v)]
            };
        };
        let (first, second, point) = (&rod.frames[e], &rod.frames[e + 1], Point::at(xi, 0.0));
        let slope = point.derivatives(rod.chords[e], first.t, second.t).0;
        let (size, t) = (slope.norm(), slope.normalize());
        let across = (Matrix3::identity() - t * t.transpose()) / size;
        let [chord, near, far] = point.y;
        let chord = chord / self.before.mesh.elements[e].length;
        let mut all = Vec::with_capacity(10);
        for axis in 0..3 {
            let way = across.column(axis) * chord;
            all.extend([(l.position(e) + axis, -way), (l.position(e + 1) + axis, way)]);
        }
        for (node, frame, share) in [(e, first, near), (e + 1, second, far)] {
            all.extend([
                (l.tangent(node), across * frame.u * share),
                (l.tangent(node) + 1, across * frame.v * share),
            ]);
        }
        all
    }

    /// Of the place on the curve before at this distance from the sheath.
    fn place<const C: usize>(&self, from_sheath_mm: f64) -> Vectors {
        let (l, rod) = (Layout::<C>, &self.before.state.rod);
        let last = rod.elements();
        let ends: Vec<(usize, f64, f64)> = match self.on_curve(from_sheath_mm) {
            Some((e, xi)) => {
                let ([w0, s0, w1, s1], h) = (hermite(xi), self.before.mesh.elements[e].length);
                vec![(e, w0, s0 * h), (e + 1, w1, s1 * h)]
            }
            None if last == 0 => Vec::new(),
            None => vec![(last, 1.0, from_sheath_mm - self.before.mesh.from_tip_mm[0])],
        };
        let mut all = Vec::with_capacity(10);
        for (node, share, ahead) in ends {
            let frame = &rod.frames[node];
            all.extend((0..3).map(|axis| (l.position(node) + axis, Vec3::ith(axis, share))));
            all.extend([(l.tangent(node), frame.u * ahead), (l.tangent(node) + 1, frame.v * ahead)]);
        }
        all
    }

    /// Of the direction of the slid device at a node.
    fn slid_direction<const C: usize>(&self, node: usize) -> Vectors {
        match node {
            0 => Vec::new(),
            _ => self.direction::<C>(self.mesh.from_tip_mm[0] - self.mesh.from_tip_mm[node]),
        }
    }

    /// Of the angle that material of an instrument had in its tail.
    fn in_tail<const C: usize>(&self, instrument: usize, from_tip_mm: f64) -> Row {
        let (twist, inserted_mm) = &self.tails.each()[instrument].before;
        if *inserted_mm == 0.0 {
            return Row::new();
        }
        let device = &self.stack.instruments()[instrument].device;
        let at = |number: usize, by: f64| twist.with(number, by).angle_rad(device, *inserted_mm, from_tip_mm);
        let each = (0..TWIST).map(|number| {
            let slope = (at(number, TAIL_STEP) - at(number, -TAIL_STEP)) / (2.0 * TAIL_STEP);
            (self.memory::<C>().twist(instrument, number), slope)
        });
        each.collect()
    }

    /// The instrument that has a set at this distance from the line's tip, how far from its own tip that is, and how far it was in before.
    fn instrument_at(&self, set: usize, from_line_tip: f64) -> Option<(usize, f64, f64)> {
        let (to, sets) = (self.mesh, self.stack.sets());
        let is_in = |index: &usize| to.inserted_mm[*index] > 0.0;
        let of_set: Vec<usize> = (0..sets.len()).filter(|index| sets[*index] == Some(set)).collect();
        let index = of_set.iter().rev().copied().find(is_in).or(of_set.last().copied())?;
        let inserted = self.before.mesh.inserted_mm.get(index).copied().unwrap_or(0.0);
        let from_tip = (from_line_tip - (to.from_tip_mm[0] - to.inserted_mm[index])).max(0.0);
        Some((index, from_tip, inserted))
    }

    /// Of the angle of the slid device in a set at this distance from the line's tip, against triads that are carried without twist.
    fn slid_angle_at<const C: usize>(&self, set: usize, from_line_tip: f64) -> Row {
        let (from, l) = (self.before.mesh, Layout::<C>);
        let Some((index, from_tip, inserted)) = self.instrument_at(set, from_line_tip) else {
            return Row::new();
        };
        if inserted <= from_tip {
            return self.in_tail::<C>(index, from_tip);
        }
        let place = from.from_tip_mm[0] - (inserted - from_tip);
        let old = self.before.state.rod.elements();
        let e = from.from_tip_mm[1..=old].partition_point(|end| *end > place).min(old - 1);
        let xi = ((from.from_tip_mm[e] - place) / from.elements[e].length).clamp(0.0, 1.0);
        let [w0, w1, wb] = Point::at(xi, 0.0).phi;
        vec![
            (l.angle(e, set), w0),
            (self.carried::<C>(e), w0),
            (l.angle(e + 1, set), w1),
            (self.carried::<C>(e + 1), w1),
            (l.bubble(e, set), wb),
        ]
    }

    /// The same at a node.
    fn slid_angle<const C: usize>(&self, node: usize, set: usize) -> Row {
        if self.stack.is_several() {
            return self.slid_angle_at::<C>(set, self.mesh.from_tip_mm[node]);
        }
        let (n, old) = (self.mesh.line(), self.before.state.rod.elements());
        match (node + old).checked_sub(n) {
            Some(was) if node > 0 => vec![(Layout::<C>.angle(was, set), 1.0), (self.carried::<C>(was), 1.0)],
            _ => self.in_tail::<C>(0, self.mesh.from_tip_mm[node]),
        }
    }

    /// Of the bubble of an element of the slid device.
    fn slid_bubble<const C: usize>(&self, e: usize, set: usize) -> Row {
        if self.stack.is_several() {
            let ends = [e, e + 1].map(|node| self.mesh.from_tip_mm[node]);
            let mut row = self.slid_angle_at::<C>(set, 0.5 * (ends[0] + ends[1]));
            plus(&mut row, &self.slid_angle::<C>(e, set), -0.5);
            plus(&mut row, &self.slid_angle::<C>(e + 1, set), -0.5);
            return row;
        }
        let (n, old) = (self.mesh.line(), self.before.state.rod.elements());
        match (e + old).checked_sub(n) {
            Some(was) if was > 0 => vec![(Layout::<C>.bubble(was, set), 1.0)],
            _ => Row::new(),
        }
    }

    /// Material at this distance from the line's tip that was in the tail before.
    fn entered_at(&self, set: usize, from_line_tip: f64, weight: f64) -> Option<Entered> {
        let (instrument, from_tip_mm, inserted_mm) = self.instrument_at(set, from_line_tip)?;
        (inserted_mm <= from_tip_mm).then_some(Entered { instrument, from_tip_mm, weight })
    }

    /// What of the angle of a point before the part was that of material in tails.
    pub(super) fn entered(&self, index: usize) -> Vec<Entered> {
        let (e, xi, set) = self.mesh.points[index].place();
        let [w0, w1, wb] = Point::at(xi, 0.0).phi;
        let ends = [e, e + 1].map(|node| self.mesh.from_tip_mm[node]);
        if self.stack.is_several() {
            // The bubble is the angle in the middle less the mean of both ends.
            let middle = self.entered_at(set, 0.5 * (ends[0] + ends[1]), wb);
            let [first, second] = [(ends[0], w0 - 0.5 * wb), (ends[1], w1 - 0.5 * wb)]
                .map(|(from_tip_mm, weight)| self.entered_at(set, from_tip_mm, weight));
            return [first, second, middle].into_iter().flatten().collect();
        }
        let gone = (self.mesh.line()).saturating_sub(self.before.state.rod.elements());
        let each = [(e, w0), (e + 1, w1)].into_iter().filter(|(node, _)| *node == 0 || *node < gone);
        each.map(|(node, weight)| Entered { instrument: 0, from_tip_mm: self.mesh.from_tip_mm[node], weight })
            .collect()
    }

    /// Of how far the device has spun at a node, as far as it is remembered.
    fn spin<const C: usize>(&self, node: usize, set: usize) -> Row {
        let mut row = Row::new();
        plus(&mut row, &self.slid_angle::<C>(node, set), -1.0);
        if !self.slid.is_empty() {
            row.push((self.spun::<C>(node), 1.0));
            let by = twisting(&self.slid[node].t, &self.rod.frames[node].t);
            plus(&mut row, &dotted(&by, &self.slid_direction::<C>(node)), 1.0);
        }
        row
    }

    /// Derivatives of the forces on the rod in what is remembered, by friction on the wall. From row `beyond` on, those of the force and the
    /// moment at each point that rubs there, and of the angle from which each place between instruments slips, for what follows from these.
    pub(super) fn chain<const C: usize>(
        &self,
        pressing: &[PressingSlopes],
        places: &[Place],
        beyond: usize,
    ) -> Chain {
        let l = Layout::<C>;
        let rod = &self.before.state.rod;
        let elements = [rod.elements(), self.mesh.line()];
        let mut chain = Chain { memory: self.memory::<C>().len(), elements, ..Chain::default() };
        if Layout::<C>::ANGLES == 0 {
            return chain;
        }
        for e in 0..elements[0] {
            let (first, second) = (&rod.frames[e], &rod.frames[e + 1]);
            let by = twisting(&first.t, &second.t);
            for (node, frame) in [(e, first), (e + 1, second)] {
                chain.turns.add(e, l.tangent(node), by.dot(&frame.u));
                chain.turns.add(e, l.tangent(node) + 1, by.dot(&frame.v));
            }
        }
        for (e, ends) in self.slid.windows(2).enumerate() {
            let by = twisting(&ends[0].t, &ends[1].t);
            for node in [e, e + 1] {
                chain.turns.add_row(elements[0] + e, &dotted(&by, &self.slid_direction::<C>(node)), 1.0);
            }
        }
        let rubbing = pressing.iter().filter_map(|at| Some((at.index, at.friction.as_ref()?)));
        let mut first = beyond;
        for (index, friction) in rubbing {
            self.add_friction::<C>(index, friction, (&mut chain.rows, first));
            first += WRENCH;
        }
        for (k, place) in places.iter().enumerate() {
            let Some((inner, outer)) = place.sets else { continue };
            let mut from = self.slid_angle::<C>(place.node, inner);
            plus(&mut from, &self.slid_angle::<C>(place.node, outer), -1.0);
            chain.rows.add_row(first + k, &from, 1.0);
        }
        chain
    }

    /// Adds the derivatives of the friction of a point on the wall.
    fn add_friction<const C: usize>(
        &self,
        index: usize,
        friction: &FrictionSlopes,
        (rows, first): (&mut Sparse, usize),
    ) {
        let point = &self.mesh.points[index];
        let (e, xi, set) = point.place();
        let [w0, w1, wb] = Point::at(xi, 0.0).phi;
        let mut spin = Row::new();
        plus(&mut spin, &self.spin::<C>(e, set), w0);
        plus(&mut spin, &self.spin::<C>(e + 1, set), w1);
        plus(&mut spin, &self.slid_bubble::<C>(e, set), -wb);
        let from_sheath_mm = self.mesh.from_tip_mm[0] - point.from_tip_mm;
        let advance_mm = self.motions[point.instrument].advance_mm();
        let mut direction = self.direction::<C>(from_sheath_mm);
        let mut place = self.place::<C>(from_sheath_mm);
        place.extend(direction.iter().map(|(column, way)| (*column, way * -advance_mm)));
        if let Some(passage) = self.passage {
            let Start { mesh, state } = self.before;
            let (x, along) = super::super::transport::place_on_curve(mesh, &state.rod, from_sheath_mm);
            let moved = CarriedSlopes::at((x - along * advance_mm, along), passage);
            plus(&mut spin, &dotted(&moved.spin[0], &place), -1.0);
            plus(&mut spin, &dotted(&moved.spin[1], &direction), -1.0);
            let times = |matrix: &Matrix3<f64>, vectors: &Vectors| -> Vectors {
                vectors.iter().map(|(column, way)| (*column, matrix * way)).collect()
            };
            direction = times(&moved.direction[1], &direction);
            direction.extend(times(&moved.direction[0], &place));
            place = times(&moved.place, &place);
        }
        let mut all: Vec<(usize, Vec3, f64)> = Vec::with_capacity(spin.len() + place.len() + direction.len());
        all.extend(
            spin.iter().map(|(column, by)| (*column, friction.by_spin.0 * *by, friction.by_spin.1 * by)),
        );
        for (vectors, (force, moment)) in [(&place, &friction.by_place), (&direction, &friction.by_direction)]
        {
            all.extend(vectors.iter().map(|(column, way)| (*column, force * way, moment.dot(way))));
        }
        all.sort_unstable_by_key(|(column, ..)| *column);
        let scatter = Scatter::at::<C>(self.rod, self.mesh, index);
        for same in all.chunk_by(|a, b| a.0 == b.0) {
            let force: Vec3 = same.iter().map(|(_, force, _)| force).sum();
            let moment: f64 = same.iter().map(|(.., moment)| moment).sum();
            (0..3).for_each(|axis| rows.add(first + axis, same[0].0, force[axis]));
            rows.add(first + 3, same[0].0, moment);
            scatter.add((force, moment), |row, own| rows.add(row, same[0].0, own));
        }
    }
}
