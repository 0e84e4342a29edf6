//! The path of the injecting tip.
//!
//! Medium from a tip appears where the tip was at that time, whichever moments were drawn. So the path is stored: a
//! position, in the vessel at rest, for each reported moment, linear in between, and constant before the first and
//! after the last. Only what is needed is kept: without injection through the tip its path is irrelevant.

use endowire_core::Vec3;

use crate::spec::InjectionSpec;

/// Positions closer than this are equal, mm: the same curve given by other points.
const SAME_MM: f64 = 1e-6;

/// The path of a tip.
#[derive(Debug, Clone)]
pub(super) struct TipWay {
    /// Start and end times of the injections through it, s.
    flowing_s: Vec<[f64; 2]>,
    /// Times, ascending, and positions, mm.
    places: Vec<(f64, Vec3)>,
}

impl TipWay {
    pub(super) fn new(injections: &[InjectionSpec]) -> Self {
        let through = injections.iter().filter(|one| one.at_tip);
        let flowing_s = through.map(|one| [one.start_s, one.start_s + one.duration_s]).collect();
        Self { flowing_s, places: vec![] }
    }

    /// Records the tip position. If another one was known for that time, everything known from then on belongs to
    /// another run, and is discarded. Returns the time up to which the path is unchanged, s.
    pub(super) fn follow(&mut self, time_s: f64, place_mm: Vec3) -> f64 {
        if self.flowing_s.is_empty() {
            return f64::INFINITY;
        }
        let after = self.places.partition_point(|known| known.0 < time_s);
        let before_s = |place: usize| place.checked_sub(1).map_or(f64::NEG_INFINITY, |k| self.places[k].0);
        let since_s = before_s(after);
        if let Some(&(known_s, known_mm)) = self.places.get(after) {
            let same = known_s == time_s && (known_mm - place_mm).norm() <= SAME_MM;
            // The first is always kept.
            let idle = after > 0 && known_s > time_s && !self.flows(since_s, known_s);
            if same || idle {
                return f64::INFINITY;
            }
        } else if after > 1 && !self.flows(before_s(after - 1), time_s) {
            self.places.pop();
        }
        self.places.truncate(after);
        self.places.push((time_s, place_mm));
        since_s
    }

    /// The tip position at a time; `None` if nothing is known.
    pub(super) fn at(&self, time_s: f64) -> Option<Vec3> {
        let after = self.places.partition_point(|known| known.0 < time_s);
        let Some(&(to_s, to_mm)) = self.places.get(after) else {
            return self.places.last().map(|last| last.1);
        };
        let Some(&(from_s, from_mm)) = after.checked_sub(1).and_then(|k| self.places.get(k)) else {
            return Some(to_mm);
        };
        Some(from_mm + (to_mm - from_mm) * ((time_s - from_s) / (to_s - from_s)))
    }

    /// Whether anything is injected between two times.
    fn flows(&self, from_s: f64, to_s: f64) -> bool {
        self.flowing_s.iter().any(|[begin, end]| *begin <= to_s && from_s <= *end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The path of a tip that injects from 1 to 2 s.
    fn way() -> TipWay {
        let injection =
            InjectionSpec { start_s: 1.0, duration_s: 1.0, rate_ml_per_s: 1.0, at_mm: None, at_tip: true };
        TipWay::new(&[InjectionSpec { start_s: 5.0, at_tip: false, ..injection.clone() }, injection])
    }

    fn at(x: f64) -> Vec3 {
        Vec3::x() * x
    }

    #[test]
    fn the_tip_way_is_straight_between_known_places_and_rests_beyond() {
        let mut way = way();
        assert_eq!(way.at(1.5), None);
        assert_eq!(way.follow(1.2, at(1.0)), f64::NEG_INFINITY);
        assert_eq!(way.follow(1.6, at(3.0)), 1.2);
        let close = |time_s: f64, x: f64| (way.at(time_s).unwrap() - at(x)).norm() < 1e-12;
        assert!(close(0.0, 1.0) && close(1.2, 1.0) && close(1.3, 1.5) && close(1.6, 3.0) && close(9.0, 3.0));
    }

    #[test]
    fn a_repeated_tip_place_changes_nothing_and_another_run_begins_where_it_departs() {
        let mut way = way();
        for k in 0..10 {
            way.follow(1.0 + 0.1 * f64::from(k), at(f64::from(k)));
        }
        let known = way.places.clone();
        assert_eq!(way.follow(known[4].0, at(4.0 + 1e-9)), f64::INFINITY);
        assert_eq!(way.places, known);
        assert_eq!(way.follow(known[4].0, at(7.0)), known[3].0);
        assert_eq!((way.places.len(), way.at(3.0)), (5, Some(at(7.0))));
        assert_eq!(way.follow(-9.0, at(0.0)), f64::NEG_INFINITY);
        assert_eq!(way.places, [(-9.0, at(0.0))]);
    }

    #[test]
    fn where_nothing_is_injected_the_way_is_of_no_account() {
        let mut way = way();
        let steps = 5000;
        let reported = |way: &mut TipWay| {
            (0..steps).for_each(|k| {
                way.follow(0.002 * f64::from(k), at(f64::from(k)));
            });
        };
        reported(&mut way);
        // A tenth of them, and a few on either side.
        let kept = way.places.len();
        assert!((500..508).contains(&kept), "{kept}");
        let place = way.at(1.5).unwrap();
        assert!((place - at(750.0)).norm() < 1e-9, "{place}");
        // The same run once more, as for another plane.
        reported(&mut way);
        assert_eq!(way.places.len(), kept);
        let mut never = TipWay::new(&[]);
        assert_eq!(never.follow(1.0, at(1.0)), f64::INFINITY);
        assert!(never.places.is_empty());
    }
}
