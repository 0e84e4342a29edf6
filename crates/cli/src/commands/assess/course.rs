//! Attempts in their order, and the course of those at one task.

use std::path::Path;

use endowire_assess::{Attempt as Of, Course};
use serde::Serialize;

use super::attempt::{Attempt, Places};

/// What attempts are ordered by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum OrderedBy {
    /// When they were recorded.
    Recorded,
    /// The command line: not all say when they were recorded.
    Given,
}

impl OrderedBy {
    /// For people.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Recorded => "in the order in which they were recorded",
            Self::Given => "in the order given, for not all say when they were recorded",
        }
    }
}

/// The attempts at one task: in one scene, with one target.
#[derive(Serialize)]
pub(super) struct CourseOf<'a> {
    pub(super) scene: &'a str,
    pub(super) target: Option<&'a str>,
    pub(super) ordered_by: OrderedBy,
    /// The sessions, the first one first.
    pub(super) sessions: Vec<&'a Path>,
    /// Their numbers among all attempts.
    #[serde(skip)]
    pub(super) attempts: Vec<usize>,
    #[serde(flatten)]
    pub(super) course: Course,
}

/// Puts attempts into the order in which they were recorded, if all of them say when; sessions of one second stay as they were given.
pub(super) fn order(attempts: &mut [Attempt]) {
    if ordered_by(attempts.iter()) == OrderedBy::Recorded {
        attempts.sort_by_key(|attempt| attempt.recorded_unix_s);
    }
}

fn ordered_by<'a>(attempts: impl IntoIterator<Item = &'a Attempt>) -> OrderedBy {
    let all = attempts.into_iter().all(|attempt| attempt.recorded_unix_s.is_some());
    if all { OrderedBy::Recorded } else { OrderedBy::Given }
}

/// The courses of all tasks that were done more than once.
pub(super) fn courses<'a>(attempts: &'a [Attempt], places: &'a Places<'_>) -> Vec<CourseOf<'a>> {
    let mut tasks: Vec<Vec<usize>> = vec![];
    for (number, attempt) in attempts.iter().enumerate() {
        let alike = |other: &Attempt| (other.place, &other.target) == (attempt.place, &attempt.target);
        match tasks.iter_mut().find(|task| alike(&attempts[task[0]])) {
            Some(task) => task.push(number),
            None => tasks.push(vec![number]),
        }
    }
    let several = tasks.into_iter().filter(|task| task.len() > 1);
    several.map(|task| of_task(task, attempts, places)).collect()
}

fn of_task<'a>(mut task: Vec<usize>, attempts: &'a [Attempt], places: &'a Places<'_>) -> CourseOf<'a> {
    let ordered_by = ordered_by(task.iter().map(|number| &attempts[*number]));
    if ordered_by == OrderedBy::Recorded {
        task.sort_by_key(|number| attempts[*number].recorded_unix_s);
    }
    let of = |number: &usize| {
        let attempt = &attempts[*number];
        Of { metrics: &attempt.metrics, score: attempt.score.as_deref() }
    };
    let course = Course::of(&task.iter().map(of).collect::<Vec<_>>());
    let first = &attempts[task[0]];
    CourseOf {
        scene: &places.of(first).scene.name,
        target: first.target.as_deref(),
        ordered_by,
        sessions: task.iter().map(|number| attempts[*number].session.as_path()).collect(),
        attempts: task,
        course,
    }
}
