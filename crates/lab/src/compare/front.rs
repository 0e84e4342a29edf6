//! Pareto fronts of the methods, and their relative speed.

use serde::Serialize;

use super::Row;

/// The front of one case.
#[derive(Debug, Clone, Serialize)]
pub struct Front {
    /// Name of the case.
    pub case: String,
    /// Rows that no other row of the case beats in both error and time: method and resolution, by decreasing time.
    pub rows: Vec<(String, usize)>,
    /// Methods with such rows.
    pub methods: Vec<String>,
    /// Smallest error of the other methods on the front; below it the first of `methods` is alone.
    pub alone_below: Option<f64>,
    /// Error at which times are compared, in the case's unit.
    pub at_error: f64,
    /// Time at which each method reaches this error, s, fastest first; interpolated logarithmically between its rows.
    pub time_s: Vec<(String, f64)>,
}

/// The front of `rows`, all of one case.
pub fn front(case: &str, rows: &[&Row], at_error: f64) -> Front {
    let points: Vec<(&Row, f64, f64)> = rows
        .iter()
        .filter_map(|row| Some((*row, row.error.filter(|e| e.is_finite())?, row.time_s?)))
        .collect();
    let beaten = |error: f64, time: f64| {
        points.iter().any(|(_, e, t)| *e <= error && *t <= time && (*e < error || *t < time))
    };
    let mut best: Vec<_> = points.iter().filter(|(_, e, t)| !beaten(*e, *t)).collect();
    best.sort_by(|a, b| b.2.total_cmp(&a.2));
    let mut methods: Vec<String> = Vec::new();
    for (row, ..) in &best {
        if !methods.contains(&row.method) {
            methods.push(row.method.clone());
        }
    }
    let others = best.iter().filter(|(row, ..)| Some(&row.method) != methods.first()).map(|(_, e, _)| *e);
    let alone_below = others.min_by(f64::total_cmp);
    let mut names: Vec<&str> = points.iter().map(|(row, ..)| row.method.as_str()).collect();
    names.dedup();
    let mut time_s: Vec<(String, f64)> = names
        .into_iter()
        .filter_map(|name| {
            let own: Vec<(f64, f64)> =
                points.iter().filter(|(row, ..)| row.method == name).map(|(_, e, t)| (*e, *t)).collect();
            Some((name.to_owned(), time_at(&own, at_error)?))
        })
        .collect();
    time_s.sort_by(|a, b| a.1.total_cmp(&b.1));
    let rows = best.iter().map(|(row, ..)| (row.method.clone(), row.resolution)).collect();
    Front { case: case.to_owned(), rows, methods, alone_below, at_error, time_s }
}

/// Smallest time in which a method has at most `at_error`, from its (error, time) by increasing resolution.
fn time_at(points: &[(f64, f64)], at_error: f64) -> Option<f64> {
    let mut least: Option<f64> = None;
    let mut consider = |time: f64| least = Some(least.map_or(time, |t: f64| t.min(time)));
    for (k, (error, time)) in points.iter().enumerate() {
        if *error <= at_error {
            consider(*time);
        }
        let Some((next_error, next_time)) = points.get(k + 1) else { continue };
        if *error > at_error && *next_error < at_error {
            let share = (error / at_error).ln() / (error / next_error).ln();
            consider(time * (next_time / time).powf(share));
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(method: &str, resolution: usize, error: f64, time_s: f64) -> Row {
        Row {
            case: "c".to_owned(),
            method: method.to_owned(),
            resolution,
            error: Some(error),
            time_s: Some(time_s),
            iterations: Some(1),
            note: String::new(),
        }
    }

    #[test]
    fn only_what_is_beaten_in_both_is_off_the_front() {
        let rows =
            [row("a", 1, 1e-2, 1.0), row("a", 2, 1e-4, 4.0), row("b", 1, 1e-2, 2.0), row("b", 2, 1e-6, 9.0)];
        let all: Vec<&Row> = rows.iter().collect();
        let found = front("c", &all, 1e-3);
        assert_eq!(found.rows, [("b".to_owned(), 2), ("a".to_owned(), 2), ("a".to_owned(), 1)]);
        assert_eq!(found.methods, ["b", "a"]);
        assert_eq!(found.alone_below, Some(1e-4));
        // The middle on both logarithmic scales.
        assert!((found.time_s[0].1 - 2.0).abs() < 1e-12, "{:?}", found.time_s);
        assert_eq!(front("c", &all[..1], 1e-3).time_s, []);
    }
}
