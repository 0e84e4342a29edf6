//! The distance of a device's point from the wall, using what is known of its surroundings.
//!
//! Positions here are material points of the vessel, which differ from the device's positions while the vessel is
//! displaced ([`crate::contact::MovedWall`]). So are lengths between them, and stored clearances; a reading is a
//! distance in space.
//!
//! Between bases a point's reading depends on its position alone, not on earlier trials: within half its radius of
//! the query at the base, it uses the piece of wall found there.

use super::WallContact;
use crate::Vec3;
use crate::contact::cache::TakenReading;
use crate::contact::distance::{Distance, Nearness};
use crate::contact::surface::Hint;

/// The distance of a point from the wall.
#[derive(Debug, Clone, Copy)]
pub(super) enum Reading {
    /// Lower bound of the distance, mm; or the distance, if derivatives are not wanted.
    Free(f64),
    /// In contact, or closer than the limit, with derivatives.
    Pressed(Distance),
}

impl Reading {
    /// A distance with derivatives may have been computed before for a larger limit than `limit_mm`.
    pub(super) fn of(nearness: Nearness, limit_mm: f64) -> Self {
        match nearness {
            Nearness::Within(d) if d.value_mm < limit_mm => Self::Pressed(d),
            near => Self::Free(near.value_mm()),
        }
    }

    /// The distance or a lower bound, mm.
    pub(super) fn distance_mm(&self) -> f64 {
        match self {
            Self::Free(value_mm) | Self::Pressed(Distance { value_mm, .. }) => *value_mm,
        }
    }
}

impl WallContact<'_> {
    /// The reading of point `index` at the material point `x`.
    pub(super) fn read(&mut self, index: usize, x: &Vec3) -> Reading {
        self.read_within(index, x, self.points[index].potential.radius_mm)
    }

    /// As [`Self::read`], with derivatives nearer than `limit_mm`.
    pub(super) fn read_within(&mut self, index: usize, x: &Vec3, limit_mm: f64) -> Reading {
        if let Some(side) = self.cache.points[index].side {
            let reading = self.read_from_side(index, x, side, limit_mm);
            // A point that has come back out has no side any more: the nearest wall may be the other one.
            if reading.distance_mm() < self.cache.tuning.sunk * self.points[index].potential.radius_mm {
                return reading;
            }
            return self.read_anew(index, x, limit_mm);
        }
        self.read_known(index, x, limit_mm).unwrap_or_else(|| self.read_anew(index, x, limit_mm))
    }

    /// Distance below which a trial computes derivatives: with friction, for the assembly that follows; otherwise it
    /// would be evaluated twice.
    pub(super) fn asked_mm(&self, radius_mm: f64) -> f64 {
        if self.friction.acts() { radius_mm } else { f64::NEG_INFINITY }
    }

    /// The reading taken at `x` with that hint, if it is sufficient.
    pub(super) fn read_there(&self, index: usize, x: &Vec3, hint: Hint, limit_mm: f64) -> Option<Reading> {
        let TakenReading { at_mm, hint: taken, nearness } = self.cache.readings[index];
        let reported = matches!(nearness, Nearness::Within(_)) || nearness.value_mm() >= limit_mm;
        (at_mm == *x && taken == hint && reported).then(|| Reading::of(nearness, limit_mm))
    }

    /// Reading of a point that has sunk into the wall: follows the surface from there.
    pub(super) fn read_from_side(&mut self, index: usize, x: &Vec3, side: u32, limit_mm: f64) -> Reading {
        let point = &self.points[index];
        let again_mm = self.cache.tuning.look_again * point.potential.radius_mm;
        let known = &mut self.cache.points[index];
        let piece = match known.base_piece {
            Some(piece) if (x - known.base_looked_at).norm() < again_mm => {
                known.looked_at = known.base_looked_at;
                piece
            }
            _ => {
                known.looked_at = *x;
                self.surface.follow(side, x)
            }
        };
        known.from_tip_mm = point.from_tip_mm;
        (known.clearance_mm, known.piece, known.free_mm) = (0.0, Some(piece), 0.0);
        let hint = Hint::Side(piece);
        if let Some(reading) = self.read_there(index, x, hint, limit_mm) {
            self.counters.avoided += 1;
            return reading;
        }
        self.counters.near += 1;
        let nearness = self.surface.nearness(x, hint, limit_mm);
        self.cache.readings[index] = TakenReading { at_mm: *x, hint, nearness };
        Reading::of(nearness, limit_mm)
    }

    /// What clearances and the last piece yield without a query.
    pub(super) fn read_known(&mut self, index: usize, x: &Vec3, limit_mm: f64) -> Option<Reading> {
        let radius = self.points[index].potential.radius_mm;
        let stretch = self.surface.stretch();
        let near = self.followed_mm(radius) * stretch;
        let again_mm = self.cache.tuning.look_again * radius;
        let known = &mut self.cache.points[index];
        let moved = (x - known.base_looked_at).norm();
        if moved < known.base_free_mm {
            self.counters.avoided += 1;
            (known.looked_at, known.piece) = (known.base_looked_at, None);
            (known.clearance_mm, known.free_mm) = (known.base_looked_clearance_mm, known.base_free_mm);
            return Some(Reading::Free((known.clearance_mm - moved) / stretch));
        }
        let moved = (x - known.looked_at).norm();
        let free_mm = known.clearance_mm - near - self.surface.deepest_inset_mm();
        if moved < free_mm {
            self.counters.avoided += 1;
            known.free_mm = free_mm;
            return Some(Reading::Free((known.clearance_mm - moved) / stretch));
        }
        if (x - known.base_looked_at).norm() < again_mm && known.base_piece.is_some() {
            (known.looked_at, known.piece) = (known.base_looked_at, known.base_piece);
            (known.clearance_mm, known.free_mm) = (known.base_looked_clearance_mm, 0.0);
        }
        let (hint, looked_at) = (Hint::Near(known.piece?), known.looked_at);
        // A point within a ball that contains no wall is free.
        if let TakenReading { at_mm, nearness: Nearness::Clear(ball_mm), .. } = self.cache.readings[index] {
            let left_mm = ball_mm - (x - at_mm).norm() * stretch;
            if left_mm >= limit_mm.max(radius) {
                self.counters.avoided += 1;
                return Some(Reading::Free(left_mm));
            }
        }
        if let Some(reading) = self.read_there(index, x, hint, limit_mm) {
            self.counters.avoided += 1;
            return Some(reading);
        }
        if (x - looked_at).norm() >= again_mm {
            return None;
        }
        let nearness = self.surface.nearness(x, hint, limit_mm);
        if nearness.value_mm() <= 0.0 {
            return None;
        }
        self.counters.near += 1;
        self.cache.readings[index] = TakenReading { at_mm: *x, hint, nearness };
        Some(Reading::of(nearness, limit_mm))
    }

    /// Reading from the nearest piece through space.
    pub(super) fn read_anew(&mut self, index: usize, x: &Vec3, limit_mm: f64) -> Reading {
        let radius = self.points[index].potential.radius_mm;
        let stretch = self.surface.stretch();
        let near = self.followed_mm(radius) * stretch;
        let known = &mut self.cache.points[index];
        let proximity = &mut self.cache.proximity;
        let asked = proximity.queries;
        let place = proximity.around(&self.surface, x);
        self.counters.avoided += u64::from(proximity.queries == asked);
        (known.looked_at, known.from_tip_mm) = (place.middle, self.points[index].from_tip_mm);
        (known.clearance_mm, known.piece) = (place.clearance_mm, None);
        let clearance = place.clearance(x) / stretch;
        let Some(piece) = place.piece else {
            // Past an opening there is no wall.
            known.free_mm = (x - place.middle).norm() + self.cache.tuning.look_again * radius;
            return Reading::Free(clearance);
        };
        known.free_mm = place.clearance_mm - near - self.surface.inset_mm(piece);
        if (x - place.middle).norm() < known.free_mm {
            return Reading::Free(clearance);
        }
        (known.piece, known.free_mm) = (Some(piece), 0.0);
        let hint = Hint::Near(piece);
        let nearness = self.surface.nearness(x, hint, limit_mm);
        self.cache.readings[index] = TakenReading { at_mm: *x, hint, nearness };
        Reading::of(nearness, limit_mm)
    }
}
