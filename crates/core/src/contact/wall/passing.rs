//! Detects a device that has gone through the wall.

use super::WallContact;
use super::clear::Room;
use crate::Vec3;
use crate::rod::{ElementData, RodState};
use crate::solve::External;

impl WallContact<'_> {
    /// Whether a rod has passed through the wall at this state: followed from its start, a piece of it between two
    /// points in the lumen crosses the wall, or emerges on its other side. The side of a point that has sunk in is
    /// known.
    pub(crate) fn passes_through(&mut self, elements: &[ElementData], state: &RodState) -> bool {
        let mut last: Option<(Vec3, f64)> = None;
        let mut sunk = false;
        let tuning = self.cache.tuning;
        for index in (0..self.points.len()).rev() {
            // What lies between two rods is neither of them.
            let next = self.points.get(index + 1);
            if next.is_some_and(|next| next.element > self.points[index].element) {
                (last, sunk) = (None, false);
            }
            let x = self.material(index, elements, state);
            let distance_mm = self.read(index, &x).distance_mm();
            let sunk_mm = tuning.sunk * self.points[index].potential.radius_mm;
            if distance_mm < sunk_mm {
                (last, sunk) = (None, true);
                continue;
            }
            let beyond = || self.surface.is_beyond(&x, sunk_mm);
            if std::mem::take(&mut sunk) && beyond() {
                return true;
            }
            if let Some((from, clearance_mm)) = last
                && (x - from).norm() > tuning.safe * clearance_mm.max(distance_mm) / self.surface.stretch()
            {
                self.counters.queries += 1;
                // A flat triangle may stand into the smooth lumen: a point that has gone through is behind the piece
                // of wall next to it.
                let beside = self.cache.points[index + 1].piece;
                let behind = |triangle| self.surface.distance_from(triangle, &x) < 0.0;
                if self.surface.crossing(&from, &x, 1.0).is_some() && (beside.is_none_or(behind) || beyond())
                {
                    return true;
                }
            }
            last = Some((x, distance_mm));
        }
        false
    }

    /// Whether a guess must be rejected: a point sinks much deeper than at its origin, or passes through the wall on
    /// its way from there.
    pub(crate) fn is_outside(&mut self, elements: &[ElementData], state: &RodState) -> bool {
        let tuning = self.cache.tuning;
        let deep = (0..self.cache.spans.len()).any(|span| {
            let Some(points) = self.near(span, elements, state) else { return false };
            let mut room = Room::UNLIMITED;
            for index in points {
                let radius_mm = self.points[index].potential.radius_mm;
                let known = &self.cache.points[index];
                let sunk_mm = tuning.sunk * radius_mm;
                let was_mm = if known.side.is_some() { known.base_clearance_mm } else { sunk_mm };
                let deeper_mm = tuning.deeper * radius_mm;
                let least_mm = was_mm.min(sunk_mm + deeper_mm) - deeper_mm;
                let x = self.material(index, elements, state);
                let reading = self.read(index, &x);
                if reading.distance_mm() <= least_mm {
                    return true;
                }
                room.take(self.room(index, &x, &reading));
            }
            self.cache.spans[span].look(state, room);
            false
        });
        deep || self.safe_fraction(elements, state) < 1.0
    }
}
