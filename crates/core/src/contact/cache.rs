//! What the contact points of a device know of the wall around them, kept between queries.
//!
//! The knowledge at an equilibrium ([`KnownPoints`]) belongs to the state of an insertion. A step copies it, shifts
//! it along the device and updates it in its own memory ([`ContactCache`]), so that a failed step changes nothing.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::distance::{Distance, Nearness};
use super::proximity::ProximityCache;
use super::set::ContactSet;
use super::surface::Hint;
use super::wall::{PointPlace, Span};
use super::{ContactPoint, ContactSurface};
use crate::Vec3;
use crate::tuning::ContactTuning;

/// What a point knows of its surroundings. Positions are material points of the vessel, and clearances are distances
/// between these.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct KnownPoint {
    /// Where the wall was last queried.
    pub(super) looked_at: Vec3,
    /// Arc length from the tip of the piece of device now there, mm.
    pub(super) from_tip_mm: f64,
    /// A lower bound of the distance from that position to the wall, mm.
    pub(super) clearance_mm: f64,
    /// The nearest piece at that query ([`super::surface`]), if the wall was near.
    pub(super) piece: Option<u32>,
    /// Within this distance of that position, mm, the point is free of contact.
    pub(super) free_mm: f64,
    /// For a point that has sunk into the wall at its base: a piece of the wall into which it has sunk.
    pub(super) side: Option<u32>,
    /// The material point of the vessel where it is at the base, the state from which Newton's step starts.
    pub(super) base: Vec3,
    /// Where the wall was queried when the base was assembled, and the piece found: forces at trials from there
    /// depend only on their positions, not on other trials.
    pub(super) base_looked_at: Vec3,
    /// See `base_looked_at`.
    pub(super) base_piece: Option<u32>,
    /// See `base_looked_at`.
    pub(super) base_looked_clearance_mm: f64,
    /// See `base_looked_at`.
    pub(super) base_free_mm: f64,
    /// A lower bound of its distance to the wall at the base, mm.
    pub(super) base_clearance_mm: f64,
    /// Whether it is active at the base ([`super::wall`]): its reading is the one taken there.
    pub(super) presses: bool,
    /// Its force on the wall, N; 0 where it is not active.
    pub(super) force_n: f64,
}

/// No place, since nothing is equal to NaN.
const NOWHERE: (Vec3, Vec3) = {
    let nan = Vec3::new(f64::NAN, f64::NAN, f64::NAN);
    (nan, nan)
};

const NOTHING: KnownPoint = KnownPoint {
    looked_at: Vec3::new(0.0, 0.0, 0.0),
    from_tip_mm: 0.0,
    clearance_mm: -1.0,
    piece: None,
    free_mm: 0.0,
    side: None,
    base: Vec3::new(f64::NAN, f64::NAN, f64::NAN),
    base_looked_at: Vec3::new(f64::NAN, f64::NAN, f64::NAN),
    base_piece: None,
    base_looked_clearance_mm: -1.0,
    base_free_mm: 0.0,
    base_clearance_mm: 0.0,
    presses: false,
    force_n: 0.0,
};

/// A distance that a point has read in a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct TakenReading {
    /// Position of the reading, mm.
    pub(super) at_mm: Vec3,
    /// The piece of wall from which the distance was computed: between two close pieces the result depends on it.
    pub(super) hint: Hint,
    /// The distance to the wall.
    pub(super) nearness: Nearness,
}

impl TakenReading {
    /// No reading since the step began.
    const NONE: Self = Self {
        at_mm: Vec3::new(f64::NAN, f64::NAN, f64::NAN),
        hint: Hint::Near(0),
        nearness: Nearness::Beyond(0.0),
    };
}

/// Memory of all contact points of a device in a step.
#[derive(Debug, Clone)]
pub(crate) struct ContactCache {
    pub(super) points: Vec<KnownPoint>,
    /// The points element by element.
    pub(super) spans: Vec<Span>,
    /// The last reading of each point near the wall. Stored apart from `points` for speed: most points are free, and
    /// all of them are visited many times per step.
    pub(super) readings: Vec<TakenReading>,
    /// Where each point was last, and the material point of the displaced vessel there.
    pub(super) places: Vec<(Vec3, Vec3)>,
    pub(super) proximity: ProximityCache,
    /// Contacts in the step from a base.
    pub(super) set: ContactSet<PointPlace>,
    /// The numbers of the surface.
    pub(super) tuning: ContactTuning,
}

/// What the points of a device know of the wall at an equilibrium.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct KnownPoints {
    points: Vec<KnownPoint>,
}

impl KnownPoints {
    /// Allocates for `points` points.
    pub(crate) fn reserve(&mut self, points: usize) {
        self.points.reserve(points.saturating_sub(self.points.len()));
    }

    /// Clears all knowledge; keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.points.clear();
    }

    /// The knowledge of some of the points.
    pub(crate) fn part(&self, points: Range<usize>) -> Self {
        Self { points: self.points.get(points).unwrap_or_default().to_vec() }
    }

    /// Keeps the first points only. Keeps the memory.
    pub(crate) fn truncate(&mut self, points: usize) {
        self.points.truncate(points);
    }

    /// Keeps the knowledge of the last points only; their distances from the tip change by `farther_mm`.
    pub(crate) fn keep_last(&mut self, points: usize, farther_mm: f64) {
        self.points.drain(..self.points.len().saturating_sub(points));
        self.points.iter_mut().for_each(|known| known.from_tip_mm += farther_mm);
    }

    /// Lower bounds of the gaps between the wall and points of these radii that do not press, mm.
    pub(crate) fn gaps_mm(&self, radii_mm: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
        let free = self.points.iter().zip(radii_mm).filter(|(known, _)| !known.presses);
        free.map(|(known, radius_mm)| (known.base_clearance_mm - radius_mm).max(0.0))
    }

    /// Number of points.
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether it fits a device of `points` points and a wall of `pieces` pieces.
    pub(crate) fn fits(&self, points: usize, pieces: usize) -> bool {
        let there = |piece: Option<u32>| piece.is_none_or(|piece| (piece as usize) < pieces);
        self.points.len() == points
            && self.points.iter().all(|p| there(p.piece) && there(p.side) && there(p.base_piece))
    }
}

impl ContactCache {
    /// An empty cache for `surface`.
    pub(crate) fn new(surface: &ContactSurface) -> Self {
        Self {
            points: Vec::new(),
            spans: Vec::new(),
            readings: Vec::new(),
            places: Vec::new(),
            proximity: ProximityCache::of(surface),
            set: ContactSet::default(),
            tuning: surface.tuning,
        }
    }

    /// Allocates for `points` points.
    pub(crate) fn reserve(&mut self, points: usize) {
        self.points.reserve(points.saturating_sub(self.points.len()));
        self.spans.reserve(points.saturating_sub(self.spans.len()));
        self.set.reserve(points);
        self.readings.reserve(points.saturating_sub(self.readings.len()));
        self.places.reserve(points.saturating_sub(self.places.len()));
    }

    /// Resets to these points, without knowledge of their clearance.
    pub(super) fn look_at(&mut self, points: &[ContactPoint]) {
        self.points.resize(points.len(), NOTHING);
        self.readings.resize(points.len(), TakenReading::NONE);
        self.places.clear();
        self.places.resize(points.len(), NOWHERE);
        self.spans.clear();
        self.spans.extend(Span::all(points));
        self.set.clear();
    }

    /// Goes on with the same points where material points have moved under them by at most so much, mm.
    pub(super) fn look_again(&mut self, moved_mm: f64) {
        self.readings.fill(TakenReading::NONE);
        self.places.fill(NOWHERE);
        self.spans.iter_mut().for_each(|span| span.narrow(moved_mm));
        self.set.clear();
    }

    /// The distance that point `index` read at its base, if it is active there.
    pub(super) fn pressed(&self, index: usize) -> Option<&Distance> {
        match &self.readings[index].nearness {
            Nearness::Within(distance) if self.points[index].presses => Some(distance),
            _ => None,
        }
    }

    /// Transfers the knowledge from before the device advanced along its own curve: the wall does not move, so what
    /// was known of a position goes to the point of `after` that is then nearest to it. Beyond the tip each of the
    /// points `before` keeps its own.
    pub(crate) fn begin(
        &mut self,
        known: &KnownPoints,
        before: &[ContactPoint],
        after: &[ContactPoint],
        advance_mm: f64,
    ) {
        self.points.clear();
        let count = before.len().min(known.points.len());
        let mut k = 0;
        for (index, point) in after.iter().enumerate() {
            let was = point.from_tip_mm - advance_mm;
            while k + 1 < count && before[k + 1].from_tip_mm <= was {
                k += 1;
            }
            let off = |known: &KnownPoint| (known.from_tip_mm + advance_mm - point.from_tip_mm).abs();
            let places = if was < 0.0 { index..index + 1 } else { k.saturating_sub(1)..(k + 3).min(count) };
            let near = known.points.get(places.clone()).unwrap_or_default();
            let nearest = near.iter().zip(before.get(places).unwrap_or_default());
            let nearest = nearest.min_by(|(a, _), (b, _)| off(a).total_cmp(&off(b)));
            let slid = nearest.map(|(n, was)| {
                // Where a thinner piece was free, a thicker one is free within a smaller distance.
                let thicker_mm = (point.potential.radius_mm - was.potential.radius_mm).max(0.0);
                let less_mm = (1.0 + self.tuning.follow) * thicker_mm;
                KnownPoint {
                    from_tip_mm: n.from_tip_mm + advance_mm,
                    free_mm: n.free_mm - less_mm,
                    base_free_mm: n.base_free_mm - less_mm,
                    ..*n
                }
            });
            self.points.push(slid.unwrap_or(NOTHING));
        }
        self.readings.clear();
        self.readings.resize(self.points.len(), TakenReading::NONE);
    }

    /// Continues with the points of another rod, which have not moved.
    pub(crate) fn go_on(&mut self, known: &KnownPoints) {
        self.points.extend_from_slice(&known.points);
        self.readings.resize(self.points.len(), TakenReading::NONE);
    }

    /// Continues with the stored knowledge of the same points.
    pub(crate) fn resume(&mut self, known: &KnownPoints) {
        self.points.clear();
        self.readings.clear();
        self.go_on(known);
    }

    /// Stores the knowledge at the end of a step.
    pub(crate) fn keep(&self, known: &mut KnownPoints) {
        known.points.clone_from(&self.points);
    }
}
