//! Assessments as text.

use std::fmt::Write;
use std::path::Path;

use endowire_assess::{Metric, Trend};

use super::attempt::{Attempt, LEFT_OUT};
use super::course::CourseOf;
use crate::subjects;

/// Largest number of sessions shown side by side; of more, only the first and the last ones are shown.
const COLUMNS: usize = 8;

/// Scores or measures of sessions; several sessions are followed by their courses, and by those that are left out.
pub(super) fn of(attempts: &[Attempt], courses: &[CourseOf<'_>], left_out: &[&Path]) -> String {
    let scores = attempts.iter().filter_map(|attempt| {
        let score = attempt.score.as_ref()?;
        Some(format!("{}\n{}", attempt.session.display(), subjects::text(score)))
    });
    let mut parts: Vec<String> = scores.collect();
    let alone = |number: &usize| !courses.iter().any(|course| course.attempts.contains(number));
    if parts.is_empty() {
        let single = (0..attempts.len()).filter(alone);
        parts.extend(single.map(|number| {
            let title = if attempts.len() > 1 {
                format!("{}\n", attempts[number].session.display())
            } else {
                String::new()
            };
            format!("{title}{}", table(&[&attempts[number]], |_| String::new()))
        }));
    }
    parts.extend(courses.iter().map(|course| of_course(attempts, course)));
    parts.extend(left_out.iter().map(|session| format!("{}: {LEFT_OUT}", session.display())));
    parts.join("\n\n")
}

/// A course: its sessions, the score, and a row for each measure with its change.
fn of_course(attempts: &[Attempt], course: &CourseOf<'_>) -> String {
    let to = course.target.map_or_else(String::new, |target| format!(", {target}"));
    let mut text =
        format!("{}{to}: {} sessions, {}\n", course.scene, course.sessions.len(), course.ordered_by.words());
    for (number, session) in course.sessions.iter().enumerate() {
        let _ = writeln!(text, "  {}  {}", number + 1, session.display());
    }
    if let Some(score) = &course.course.score {
        let values: Vec<String> = score.values.iter().flatten().map(|value| format!("{value:.0}")).collect();
        let _ = writeln!(text, "score  {}{}", values.join(", "), went(score.per_attempt, score.trend));
    }
    let all: Vec<&Attempt> = course.attempts.iter().map(|number| &attempts[*number]).collect();
    let lines = &course.course.metrics;
    text += &table(&all, |index| went(lines[index].line.per_attempt, lines[index].line.trend));
    text
}

/// The change from one attempt to the next.
fn went(per_attempt: Option<f64>, trend: Trend) -> String {
    let change = per_attempt.filter(|change| *change != 0.0);
    let change = change.map_or_else(String::new, |change| {
        // Three significant digits.
        let digits = (2.0 - change.abs().log10().floor()).clamp(0.0, 6.0) as usize;
        format!("  {change:+.digits$} each")
    });
    let trend = if trend == Trend::None { String::new() } else { format!(", {}", trend.words()) };
    format!("{change}{trend}")
}

/// A table with a row for each measure, and a column for each session.
fn table(attempts: &[&Attempt], went: impl Fn(usize) -> String) -> String {
    let mut text = String::new();
    let Some(first) = attempts.first() else { return text };
    for (index, metric) in first.metrics.iter().enumerate() {
        let before = index.checked_sub(1).map(|before| first.metrics[before].group);
        if before != Some(metric.group) {
            let _ = writeln!(text, "{}", metric.group.name());
        }
        let _ = write!(text, "  {:<24}", metric.name);
        for (number, attempt) in attempts.iter().enumerate() {
            let left_out =
                attempts.len() > COLUMNS && number >= COLUMNS / 2 && number + COLUMNS / 2 < attempts.len();
            match (left_out, number == COLUMNS / 2) {
                (true, true) => text += " …",
                (true, false) => {}
                (false, _) => text += &cell(&attempt.metrics[index]),
            }
        }
        let _ = writeln!(text, "  {:<8} {} is better{}", metric.unit, metric.better.words(), went(index));
    }
    text.pop();
    text
}

fn cell(metric: &Metric) -> String {
    match metric.value {
        Some(value) => format!(" {value:>11.4}"),
        None => format!(" {:>11}", "-"),
    }
}
