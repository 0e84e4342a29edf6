//! `endowire assess`: measures and scores of sessions and recorded runs, and the progress of a trainee.

mod attempt;
mod course;
mod files;
mod page;
mod text;
mod verified;

use std::path::Path;

use endowire_assess::{Metric, Noticed, SCHEMA, Score, noticed};
use endowire_report::assessed_page;
use serde::Serialize;

use crate::args::AssessArgs;
use crate::failure::Failure;
use crate::output::provenance::{Provenance, read_input};
use crate::output::{answer, tell, whole};
use crate::subjects;
use attempt::{Attempt, Places};
use course::{CourseOf, courses};

/// The output document.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    provenance: Provenance,
    #[serde(flatten)]
    reported: Assessed<'a>,
}

/// One session, or several with their courses.
#[derive(Serialize)]
#[serde(untagged)]
enum Assessed<'a> {
    One(Box<Session<'a>>),
    Several {
        schema: u32,
        sessions: Vec<Session<'a>>,
        courses: &'a [CourseOf<'a>],
        /// Sessions in which nothing was done.
        #[serde(skip_serializing_if = "<[_]>::is_empty")]
        left_out: &'a [&'a Path],
    },
}

/// The results of a session.
#[derive(Serialize)]
struct Session<'a> {
    session: &'a Path,
    /// Time of the recording, seconds since 1970-01-01 UTC; `None` if unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    recorded_unix_s: Option<u64>,
    /// Whether it was carried out again, with the same record.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    verified: bool,
    #[serde(flatten)]
    by: By<'a>,
    noticed: Vec<Noticed>,
}

/// Measures alone, or with a subject's thresholds.
#[derive(Serialize)]
#[serde(untagged)]
enum By<'a> {
    Subject(&'a Score),
    Measures { schema: u32, scene: &'a str, target: Option<&'a str>, metrics: &'a [Metric] },
}

/// Measures each session, scores it if a subject is given, and prints the results.
pub(crate) fn assess(args: &AssessArgs) -> Result<(), Failure> {
    if !(args.within_mm > 0.0 && args.within_mm.is_finite()) {
        return Err(Failure::Input(format!("--within-mm {}: must be a length above 0", args.within_mm)));
    }
    let files = files::of(&args.sessions)?;
    let mut places = Places::new(args);
    let (sessions, left_out) = attempt::read(&files)?;
    let (provenance, mut attempts) = match &args.subject {
        Some(which) => attempt::scored(&subjects::read(which)?, sessions, &mut places, args.verify)?,
        None => {
            let contents = files.iter().map(|file| read_input(&files::content(file)));
            let contents = contents.collect::<Result<Vec<_>, _>>()?;
            let measured = sessions.into_iter().map(|one| attempt::measured(args, one, &mut places));
            (Provenance::new(&contents, 0), measured.collect::<Result<_, _>>()?)
        }
    };
    course::order(&mut attempts);
    let courses = courses(&attempts, &places);
    let reported = match attempts.as_slice() {
        [attempt] if left_out.is_empty() => Assessed::One(Box::new(reported(attempt, &places))),
        all => Assessed::Several {
            schema: SCHEMA,
            sessions: all.iter().map(|attempt| reported(attempt, &places)).collect(),
            courses: &courses,
            left_out: &left_out,
        },
    };
    if let Some(out) = &args.page {
        write_page(out, &page::of(&attempts, &courses, &places, &provenance)?)?;
    }
    answer(&Document { provenance, reported }, args.json, || text::of(&attempts, &courses, &left_out))
}

/// The results of an attempt.
fn reported<'a>(attempt: &'a Attempt, places: &'a Places<'_>) -> Session<'a> {
    let by = match &attempt.score {
        Some(score) => By::Subject(score),
        None => By::Measures {
            schema: SCHEMA,
            scene: &places.of(attempt).scene.name,
            target: attempt.target.as_deref(),
            metrics: &attempt.metrics,
        },
    };
    Session {
        session: &attempt.session,
        recorded_unix_s: attempt.recorded_unix_s,
        verified: attempt.verified,
        by,
        noticed: noticed(&attempt.record, attempt.way.as_ref()),
    }
}

fn write_page(out: &Path, document: &impl Serialize) -> Result<(), Failure> {
    let unwritable = |e| Failure::Computation(format!("the page cannot be written as JSON: {e}"));
    let page = assessed_page(document).map_err(unwritable)?;
    whole::write_bytes(out, page.as_bytes()).map_err(|e| Failure::write(out, &e))?;
    tell(format_args!("{} kB in {}", page.len().div_ceil(1000), out.display()));
    Ok(())
}
