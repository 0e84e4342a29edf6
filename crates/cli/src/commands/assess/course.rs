//! Order of attempts, and courses of those at one task.

use std::path::Path;

use endowire_assess::{Attempt as Of, Course};
use serde::Serialize;

use super::attempt::{Attempt, Places};

/// Order of attempts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum OrderedBy {
    /// By time of recording.
    Recorded,
    /// As on the command line, because some have no time of recording.
    Given,
}

impl OrderedBy {
    /// In words.
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
    /// The sessions, in order.
    pub(super) sessions: Vec<&'a Path>,
    /// Their indices among all attempts.
    #[serde(skip)]
    pub(super) attempts: Vec<usize>,
    #[serde(flatten)]
    pub(super) course: Course,
}

/// Sorts attempts by time of recording, if all of them have one; those of the same second keep their order.
pub(super) fn order(attempts: &mut [Attempt]) {
    if ordered_by(attempts.iter()) == OrderedBy::Recorded {
        attempts.sort_by_key(|attempt| attempt.recorded_unix_s);
    }
}

fn ordered_by<'a>(attempts: impl IntoIterator<Item = &'a Attempt>) -> OrderedBy {
    let all = attempts.into_iter().all(|attempt| attempt.recorded_unix_s.is_some());
    if all { OrderedBy::Recorded } else { OrderedBy::Given }
}

/// The courses of all tasks that were attempted more than once.
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
