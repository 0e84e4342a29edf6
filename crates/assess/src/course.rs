//! The course of a trainee: how each measure changes over attempts, and whether the change is more than chance.
//!
//! The change per attempt is the median of the slopes of all pairs of attempts (Theil 1950, Sen 1968), which is
//! robust against a single bad day. A trend is reported if at most one in twenty permutations of the same values
//! rises, or falls, as steadily (Mann 1945, Kendall 1975). Three attempts are too few for a trend: one permutation in
//! six is monotonic.

use serde::Serialize;

use crate::metric::{Better, Group, Metric};
use crate::score::Score;

/// Largest probability, under chance, of a change as steady as a reported trend.
const CHANCE: f64 = 0.05 + 1e-9;
/// Relative difference up to which two values count as equal.
const ROUNDING: f64 = 1e-9;
/// Largest number of attempts for which permutations are counted exactly; beyond it, the normal approximation is
/// used.
const COUNTED: usize = 60;

/// One attempt.
#[derive(Debug, Clone, Copy)]
pub struct Attempt<'a> {
    /// Its measures.
    pub metrics: &'a [Metric],
    /// Its score, if it was an attempt at a subject.
    pub score: Option<&'a Score>,
}

/// Direction in which a measure changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Trend {
    /// Towards the values of experts.
    Better,
    /// Away from the values of experts.
    Worse,
    /// Neither, or too few attempts to decide.
    None,
}

impl Trend {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Better => "gets better",
            Self::Worse => "gets worse",
            Self::None => "no trend",
        }
    }
}

/// The values of a measure or score over attempts, and their trend.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// One per attempt; `None` where it was not measured.
    pub values: Vec<Option<f64>>,
    /// The first measured value.
    pub first: Option<f64>,
    /// The last measured value.
    pub last: Option<f64>,
    /// The best value.
    pub best: Option<f64>,
    /// Change per attempt: median of the slopes of all pairs.
    pub per_attempt: Option<f64>,
    /// Fraction of all permutations of these values that change at least as steadily in this direction; `None` for
    /// fewer than two values.
    pub chance: Option<f64>,
    /// Their trend.
    pub trend: Trend,
}

/// A measure over attempts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MetricLine {
    /// Name of the measure.
    pub name: &'static str,
    /// Its group.
    pub group: Group,
    /// Its unit.
    pub unit: &'static str,
    /// Which values are better.
    pub better: Better,
    /// Its values.
    #[serde(flatten)]
    pub line: Line,
}

/// All measures over attempts, in order of attempts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Course {
    /// Scores, in percent; `None` if the attempts are not at a subject.
    pub score: Option<Line>,
    /// Whether each attempt was passed; `None` if the attempts are not at a subject.
    pub passed: Option<Vec<bool>>,
    /// The measures, ordered by group.
    pub metrics: Vec<MetricLine>,
}

impl Course {
    /// The course of attempts in order. All of them have the measures of the first.
    pub fn of(attempts: &[Attempt<'_>]) -> Self {
        let scores: Option<Vec<&Score>> = attempts.iter().map(|attempt| attempt.score).collect();
        let scores = scores.filter(|scores| !scores.is_empty());
        let known = attempts.first().map_or(&[][..], |first| first.metrics);
        let metrics = known.iter().map(|metric| {
            let value = |attempt: &Attempt<'_>| {
                attempt.metrics.iter().find(|one| one.name == metric.name).and_then(|one| one.value)
            };
            let line = Line::of(attempts.iter().map(value).collect(), metric.better);
            let Metric { name, group, unit, better, .. } = *metric;
            MetricLine { name, group, unit, better, line }
        });
        Self {
            score: scores.as_ref().map(|scores| {
                Line::of(scores.iter().map(|one| Some(one.verdict.score)).collect(), Better::Higher)
            }),
            passed: scores.map(|scores| scores.iter().map(|one| one.verdict.passed).collect()),
            metrics: metrics.collect(),
        }
    }

    /// The measures with this trend.
    pub fn going(&self, trend: Trend) -> impl Iterator<Item = &MetricLine> {
        self.metrics.iter().filter(move |one| one.line.trend == trend)
    }
}

impl Line {
    /// The line of `values`; `better` says which values are better.
    pub fn of(values: Vec<Option<f64>>, better: Better) -> Self {
        let known: Vec<(f64, f64)> =
            values.iter().enumerate().filter_map(|(at, value)| Some((at as f64, (*value)?))).collect();
        let only: Vec<f64> = known.iter().map(|(_, value)| *value).collect();
        let best = only.iter().copied().reduce(|a, b| match better {
            Better::Lower => a.min(b),
            Better::Higher => a.max(b),
        });
        let rises = rises(&only);
        let chance = (only.len() > 1).then(|| chance(&only, rises.unsigned_abs()));
        let reported = chance.is_some_and(|chance| chance <= CHANCE);
        let trend = match (reported, (rises > 0) == (better == Better::Higher)) {
            (false, _) => Trend::None,
            (true, true) => Trend::Better,
            (true, false) => Trend::Worse,
        };
        Self {
            first: only.first().copied(),
            last: only.last().copied(),
            best,
            per_attempt: median_slope(&known),
            chance,
            trend,
            values,
        }
    }
}

/// Whether two values are equal up to rounding.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
}

/// Number of rising pairs minus number of falling pairs.
fn rises(values: &[f64]) -> i64 {
    let pairs = values.iter().enumerate().flat_map(|(at, a)| values[at + 1..].iter().map(move |b| (a, b)));
    let apart = pairs.filter(|(a, b)| !same(**a, **b));
    apart.map(|(a, b)| if b > a { 1 } else { -1 }).sum()
}

/// Median of the slopes of all pairs.
fn median_slope(known: &[(f64, f64)]) -> Option<f64> {
    let pairs = known.iter().enumerate().flat_map(|(at, a)| known[at + 1..].iter().map(move |b| (a, b)));
    let mut slopes: Vec<f64> = pairs.map(|(a, b)| (b.1 - a.1) / (b.0 - a.0)).collect();
    slopes.sort_by(f64::total_cmp);
    let middle = slopes.len() / 2;
    match (slopes.len(), slopes.len() % 2) {
        (0, _) => None,
        (_, 1) => Some(slopes[middle]),
        _ => Some(0.5 * (slopes[middle - 1] + slopes[middle])),
    }
}

/// Fraction of the permutations of these values in which the rising pairs outnumber the falling ones by at least
/// `rises`. Pairs of equal values count as neither.
fn chance(values: &[f64], rises: u64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let equal: Vec<usize> = sorted.chunk_by(|a, b| same(*a, *b)).map(<[f64]>::len).collect();
    if values.len() > COUNTED {
        let spread = |n: f64| n * (n - 1.0) * (2.0 * n + 5.0);
        let ties: f64 = equal.iter().map(|count| spread(*count as f64)).sum();
        let deviation = ((spread(values.len() as f64) - ties).max(1.0) / 18.0).sqrt();
        return 0.5 * libm::erfc((rises as f64 - 1.0).max(0.0) / deviation * std::f64::consts::FRAC_1_SQRT_2);
    }
    // Distribution of permutations by their number of falling pairs: each set of equal values is merged with the
    // smaller values.
    let (mut smaller, mut pairs) = (0, 0);
    let mut parts = vec![1.0];
    for count in equal {
        parts = product(&parts, &falls_between(smaller, count));
        pairs += smaller * count;
        smaller += count;
    }
    let most_falls = (pairs - rises as usize) / 2;
    parts[..=most_falls].iter().sum::<f64>().min(1.0)
}

/// Fractions of the orderings of `smaller` smaller and `larger` larger values that have 0, 1, 2, … falling pairs. If
/// the last value is a larger one, it adds no falling pair; if it is a smaller one, it adds one for each larger
/// value.
fn falls_between(smaller: usize, larger: usize) -> Vec<f64> {
    let mut with_fewer: Vec<Vec<f64>> = vec![vec![1.0]; smaller + 1];
    for l in 1..=larger {
        let mut now: Vec<Vec<f64>> = vec![vec![1.0]];
        for s in 1..=smaller {
            let all = (s + l) as f64;
            let mut parts = vec![0.0; s * l + 1];
            with_fewer[s].iter().enumerate().for_each(|(falls, part)| parts[falls] += part * l as f64 / all);
            now[s - 1].iter().enumerate().for_each(|(falls, part)| parts[falls + l] += part * s as f64 / all);
            now.push(parts);
        }
        with_fewer = now;
    }
    with_fewer.pop().unwrap_or_default()
}

/// Coefficients of a product of polynomials.
fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut all = vec![0.0; a.len() + b.len() - 1];
    for (i, a) in a.iter().enumerate() {
        all[i..i + b.len()].iter_mut().zip(b).for_each(|(sum, b)| *sum += a * b);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(values: &[f64], better: Better) -> Line {
        Line::of(values.iter().copied().map(Some).collect(), better)
    }

    #[test]
    fn chances_are_those_of_all_orders() {
        let of = |count: u32, rises: u64| chance(&(0..count).map(f64::from).collect::<Vec<_>>(), rises);
        // Of the 24 permutations of four values, one rises throughout, and four have at most one falling pair.
        assert!((of(4, 6) - 1.0 / 24.0).abs() < 1e-12);
        assert!((of(4, 4) - 4.0 / 24.0).abs() < 1e-12);
        assert!((of(3, 3) - 1.0 / 6.0).abs() < 1e-12);
        assert!((of(2, 1) - 0.5).abs() < 1e-12);
        // From the table of Kendall's tau: for ten values, S ≥ 21 in 0.036 of all permutations.
        assert!((of(10, 21) - 0.036).abs() < 5e-4, "{}", of(10, 21));
        // Three equal values and three other equal values have 20 orderings; in one of them all of the first come
        // first.
        assert!((chance(&[4.0, 4.0, 4.0, 0.0, 0.0, 0.0], 9) - 0.05).abs() < 1e-12);
        // The values 1 1 2 3 have twelve orderings: one has five rising and no falling pairs, two have one falling
        // pair.
        assert!((chance(&[1.0, 1.0, 2.0, 3.0], 5) - 1.0 / 12.0).abs() < 1e-12);
        assert!((chance(&[1.0, 1.0, 2.0, 3.0], 3) - 3.0 / 12.0).abs() < 1e-12);
        assert_eq!(chance(&[7.0; 5], 0), 1.0);
        // The normal approximation agrees with counting where it takes over, with and without ties.
        let tied =
            |count: u32, rises: u64| chance(&(0..count).map(|k| f64::from(k / 3)).collect::<Vec<_>>(), rises);
        for (counted, beyond) in [(of(60, 300), of(61, 308)), (tied(60, 300), tied(61, 308))] {
            assert!((counted - beyond).abs() < 0.002, "{counted} {beyond}");
        }
    }

    #[test]
    fn a_trend_needs_four_attempts_and_a_direction() {
        let falls = line(&[40.0, 30.0, 25.0, 24.0], Better::Lower);
        assert_eq!(
            (falls.trend, falls.best, falls.first, falls.last),
            (Trend::Better, Some(24.0), Some(40.0), Some(24.0))
        );
        // Slopes of pairs: −10, −7.5, −16/3, −5, −3, −1.
        assert!((falls.per_attempt.unwrap() + 0.5 * (16.0 / 3.0 + 5.0)).abs() < 1e-12);
        assert_eq!(line(&[40.0, 30.0, 25.0, 24.0], Better::Higher).trend, Trend::Worse);
        assert_eq!(line(&[40.0, 30.0, 25.0], Better::Lower).trend, Trend::None, "one order of six");
        assert_eq!(line(&[40.0, 30.0, 35.0, 24.0], Better::Lower).trend, Trend::None);
        assert_eq!(line(&[4.0, 4.0, 4.0, 0.0, 0.0, 0.0], Better::Lower).trend, Trend::Better);
        // One bad day among seven does not hide the learning.
        let bad_day = line(&[40.0, 36.0, 33.0, 90.0, 30.0, 28.0, 27.0], Better::Lower);
        assert_eq!(bad_day.trend, Trend::Better);
        assert!((-4.0..-1.0).contains(&bad_day.per_attempt.unwrap()), "{:?}", bad_day.per_attempt);
    }

    #[test]
    fn what_stays_or_was_not_measured_has_no_trend() {
        let stays = line(&[3.0; 8], Better::Lower);
        assert_eq!((stays.trend, stays.per_attempt), (Trend::None, Some(0.0)));
        // A difference of rounding size is no trend.
        let rounded = line(&[3.0, 3.0 - 1e-15, 3.0 - 2e-15, 3.0 - 3e-15], Better::Lower);
        assert_eq!((rounded.trend, rounded.chance), (Trend::None, Some(1.0)));
        let gaps = Line::of(vec![None, Some(2.0), None, Some(1.0)], Better::Lower);
        assert_eq!((gaps.first, gaps.last, gaps.per_attempt), (Some(2.0), Some(1.0), Some(-0.5)));
        let none = Line::of(vec![None, None], Better::Lower);
        assert_eq!((none.first, none.chance, none.trend), (None, None, Trend::None));
    }
}
