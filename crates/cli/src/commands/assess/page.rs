//! Data of the page of assessed sessions.

use endowire_assess::{Better, Course, Group, Noticed, Threshold, Timeline, noticed};
use endowire_core::Vec3;
use endowire_report::Vessel;
use endowire_viewer::ViewSpec;
use serde::Serialize;

use super::attempt::{Attempt, Places};
use super::course::{CourseOf, OrderedBy};
use crate::failure::Failure;
use crate::output::provenance::Provenance;

/// Numbers of time intervals: of all sessions together, and the smallest and largest of one session.
const PIECES: (usize, usize, usize) = (30_000, 300, 1500);

/// The document of the page.
#[derive(Serialize)]
pub(super) struct Page<'a> {
    title: String,
    source: String,
    vessels: Vec<Vessel>,
    courses: Vec<CourseShown<'a>>,
    sessions: Vec<Shown>,
}

/// A course with the indices of its sessions on the page.
#[derive(Serialize)]
struct CourseShown<'a> {
    scene: &'a str,
    target: Option<&'a str>,
    ordered_by: OrderedBy,
    attempts: &'a [usize],
    #[serde(flatten)]
    course: &'a Course,
}

/// A session.
#[derive(Serialize)]
struct Shown {
    name: String,
    scene: String,
    target: Option<String>,
    target_mm: Option<Vec3>,
    within_mm: Option<f64>,
    recorded_unix_s: Option<u64>,
    /// Index of its vessel.
    vessel: usize,
    /// Angles of the C-arm if no beam was recorded.
    pose: [f64; 2],
    instruments: Vec<String>,
    /// Index of the instrument whose tip must arrive; `None` for the foremost tip.
    arriving: Option<usize>,
    limits: endowire_assess::Limits,
    verdict: Option<String>,
    passed: Option<bool>,
    unjudged: Vec<String>,
    metrics: Vec<Measure>,
    noticed: Vec<Noticed>,
    timeline: Timeline,
}

/// A measure with its threshold.
#[derive(Serialize)]
struct Measure {
    name: &'static str,
    group: Group,
    value: Option<f64>,
    unit: &'static str,
    better: Better,
    definition: &'static str,
    asked: Option<String>,
    passed: Option<bool>,
    /// Why the threshold cannot be judged.
    unjudged: Option<&'static str>,
}

/// The page of attempts and their courses.
pub(super) fn of<'a>(
    attempts: &[Attempt],
    courses: &'a [CourseOf<'_>],
    places: &Places<'_>,
    provenance: &Provenance,
) -> Result<Page<'a>, Failure> {
    let mut known: Vec<usize> = vec![];
    let mut vessels = vec![];
    let mut sessions = vec![];
    let (all, fewest, most) = PIECES;
    let pieces = (all / attempts.len().max(1)).clamp(fewest, most);
    for attempt in attempts {
        let vessel = match known.iter().position(|place| *place == attempt.place) {
            Some(vessel) => vessel,
            None => {
                let place = places.of(attempt);
                let wall = place.scene.wall(&places.cache);
                let wall = wall.map_err(|e| Failure::from(e).at(place.path.display()))?;
                vessels.push(Vessel::of(wall.mesh()));
                known.push(attempt.place);
                known.len() - 1
            }
        };
        sessions.push(shown(attempt, places, vessel, pieces)?);
    }
    Ok(Page {
        title: title(attempts, places),
        source: provenance.words(),
        vessels,
        courses: courses.iter().map(course).collect(),
        sessions,
    })
}

/// Title: the subject, or the scenes.
fn title(attempts: &[Attempt], places: &Places<'_>) -> String {
    if let Some(score) = attempts.first().and_then(|first| first.score.as_ref()) {
        return score.subject.clone();
    }
    let mut scenes: Vec<&str> = attempts.iter().map(|one| places.of(one).scene.name.as_str()).collect();
    scenes.dedup();
    scenes.join(", ")
}

fn course<'a>(of: &'a CourseOf<'_>) -> CourseShown<'a> {
    let CourseOf { scene, target, ordered_by, attempts, course, .. } = of;
    CourseShown { scene, target: *target, ordered_by: *ordered_by, attempts, course }
}

fn shown(attempt: &Attempt, places: &Places<'_>, vessel: usize, pieces: usize) -> Result<Shown, Failure> {
    let place = places.of(attempt);
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(place.path.display());
    let stack = place.scene.stack().map_err(in_scene)?;
    let view = ViewSpec::of_scene(&place.scene, &place.path)?;
    let (target_mm, within_mm) = attempt.way.as_ref().and_then(endowire_assess::Way::target_mm).unzip();
    let score = attempt.score.as_deref();
    let measures = attempt.metrics.iter().enumerate().map(|(index, metric)| {
        let scored = score.map(|score| &score.metrics[index]);
        Measure {
            name: metric.name,
            group: metric.group,
            value: metric.value,
            unit: metric.unit,
            better: metric.better,
            definition: metric.definition,
            asked: scored.and_then(|one| one.threshold.as_ref()).map(Threshold::words),
            passed: scored.and_then(|one| one.passed),
            unjudged: scored.and_then(|one| one.unjudged),
        }
    });
    Ok(Shown {
        name: attempt.session.display().to_string(),
        scene: place.scene.name.clone(),
        target: attempt.target.clone(),
        target_mm,
        within_mm,
        recorded_unix_s: attempt.recorded_unix_s,
        vessel,
        pose: view.c_arm.angles_deg(),
        instruments: stack.instruments().iter().map(|one| one.name.clone()).collect(),
        arriving: attempt.way.as_ref().and_then(endowire_assess::Way::instrument),
        limits: score.map(|score| score.limits).unwrap_or_default(),
        verdict: score.map(|score| score.verdict.words()),
        passed: score.map(|score| score.verdict.passed),
        unjudged: score.map(endowire_assess::Score::unjudged_words).unwrap_or_default(),
        metrics: measures.collect(),
        noticed: noticed(&attempt.record, attempt.way.as_ref()),
        timeline: Timeline::of(&attempt.record, attempt.way.as_ref(), pieces),
    })
}
