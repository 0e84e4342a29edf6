//! What a trainee is scored by: measures of a recorded procedure, as studies of novices and experts have them.
//!
//! A [`Record`] is what hands, beam and injector have done and what came of it; a [`Way`] is where it was to go. [`assess`] measures both in
//! seven groups. Every measure says its unit, how it is defined, whether less or more of it is better and in which study it was used; one
//! that needs what was not recorded has no value.
//!
//! A [`Subject`] is a task for trainees: a goal in a scene, limits, and thresholds of measures. An [`Exam`] follows a record until the goal
//! is reached or a limit is passed, and gives its [`Score`].
//!
//! What stood out of a record is [`noticed`], a [`Timeline`] is what of it can be drawn over time, and a [`Course`] says where measures go from
//! one attempt to the next.
//!
//! ```
//! use endowire_assess::{Record, assess};
//!
//! let metrics = assess(&Record::default(), None);
//! assert!(metrics.iter().all(|metric| !metric.definition.is_empty()));
//! ```

// A score has the same bits on every machine.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod course;
mod exam;
mod goal;
mod groups;
mod metric;
mod note;
mod noticed;
mod reach;
mod record;
mod score;
mod session;
mod smoothness;
mod spectrum;
mod stretch;
mod subject;
mod timeline;
mod unjudged;
mod way;
mod words;

pub use course::{Attempt, Course, Line, MetricLine, Trend};
pub use exam::{Ended, EndedBy, Exam, Standing, Used};
pub use goal::{Goal, PackingGoal, PlaceGoal};
pub use groups::assess;
pub use metric::{Better, Group, Metric};
pub use noticed::{Noticed, NoticedKind, noticed};
pub use reach::Site;
pub use record::{BEAM, BeamState, Hand, Injection, Packed, Record, Sample};
pub use score::{Score, Scored, Verdict};
pub use session::SessionFile;
pub use subject::{Limits, Subject, Threshold};
pub use timeline::{HandLine, Timeline};
pub use unjudged::Unjudged;
pub use way::Way;
