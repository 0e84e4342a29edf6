//! Injections of contrast medium: how much of it has flowed at a time. Medium counts
//! when and where it flows, not when the injector is started.

use endowire_recording::Outlet;
use serde::{Deserialize, Serialize};

use crate::total::total;

/// Volumes that differ by less count as equal, ml: sums are rounded.
const SAME_ML: f64 = 1e-9;

/// An injection of contrast medium.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Injection {
    /// Time of its begin.
    pub time_s: f64,
    /// Volume that the injector is set to give.
    pub volume_ml: f64,
    /// Flow rate.
    pub rate_ml_per_s: f64,
    /// Where the medium leaves; `None` if it was not recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outlet: Option<Outlet>,
}

impl Injection {
    /// Time at which all of it has flowed, s.
    pub fn end_s(&self) -> f64 {
        let took_s = if self.rate_ml_per_s > 0.0 { self.volume_ml / self.rate_ml_per_s } else { 0.0 };
        self.time_s + took_s
    }

    /// What of it has flowed by a time, ml.
    pub fn flowed_ml(&self, by_s: f64) -> f64 {
        if by_s >= self.end_s() {
            return self.volume_ml;
        }
        (self.rate_ml_per_s * (by_s - self.time_s).max(0.0)).min(self.volume_ml)
    }
}

/// What of several injections has flowed by a time, ml.
pub(crate) fn flowed_ml<'a>(injections: impl IntoIterator<Item = &'a Injection>, by_s: f64) -> f64 {
    total(injections.into_iter().map(|one| one.flowed_ml(by_s)))
}

/// Time at which this volume has flowed in all, s; `None` if less was injected.
pub(crate) fn reaches_s<'a>(injections: impl Iterator<Item = &'a Injection>, ml: f64) -> Option<f64> {
    first_s(injections, ml, |flowed_ml| flowed_ml >= ml - SAME_ML)
}

/// Time at which more than this volume has flowed in all, s; `None` if no more was injected.
pub(crate) fn exceeds_s<'a>(injections: impl Iterator<Item = &'a Injection>, ml: f64) -> Option<f64> {
    first_s(injections, ml, |flowed_ml| flowed_ml > ml + SAME_ML)
}

/// Time from which the volume that has flowed satisfies a condition, which it does from `ml` on, s.
fn first_s<'a>(
    injections: impl Iterator<Item = &'a Injection>,
    ml: f64,
    is_so: impl Fn(f64) -> bool,
) -> Option<f64> {
    let rates = |one: &Injection| [(one.time_s, one.rate_ml_per_s), (one.end_s(), -one.rate_ml_per_s)];
    let mut changes: Vec<(f64, f64)> = injections.flat_map(rates).collect();
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut at_s, mut rate_ml_per_s, mut sum_ml) = (0.0, 0.0, 0.0);
    for (time_s, change) in changes {
        let more_ml = rate_ml_per_s * (time_s - at_s);
        if is_so(sum_ml + more_ml) {
            return Some((at_s + (ml - sum_ml).max(0.0) / rate_ml_per_s).min(time_s));
        }
        (at_s, rate_ml_per_s, sum_ml) = (time_s, rate_ml_per_s + change, sum_ml + more_ml);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn injection(time_s: f64, volume_ml: f64, rate_ml_per_s: f64) -> Injection {
        Injection { time_s, volume_ml, rate_ml_per_s, outlet: None }
    }

    #[test]
    fn medium_counts_when_it_flows() {
        let all = [injection(2.0, 8.0, 4.0), injection(3.0, 2.0, 1.0), injection(9.0, 1.0, 5.0)];
        assert_eq!(all[0].end_s(), 4.0);
        for (by_s, ml) in [(1.0, 0.0), (2.5, 2.0), (3.5, 6.5), (4.5, 9.5), (9.1, 10.5), (20.0, 11.0)] {
            assert!((flowed_ml(&all, by_s) - ml).abs() < 1e-12, "{by_s}");
        }
        // Two at once, and a pause between them.
        for (ml, reached_s, exceeded_s) in [
            (4.0, Some(3.0), Some(3.0)),
            (6.5, Some(3.5), Some(3.5)),
            (10.0, Some(5.0), Some(9.0)),
            (11.0, Some(9.2), None),
            (11.5, None, None),
        ] {
            let near = |time_s: Option<f64>, by_hand: Option<f64>| match (time_s, by_hand) {
                (Some(a), Some(b)) => assert!((a - b).abs() < 1e-9, "{ml} ml: {a}, by hand {b}"),
                (a, b) => assert_eq!(a, b, "{ml} ml"),
            };
            near(reaches_s(all.iter(), ml), reached_s);
            near(exceeds_s(all.iter(), ml), exceeded_s);
        }
        assert_eq!(reaches_s([].iter(), 1.0), None);
    }
}
