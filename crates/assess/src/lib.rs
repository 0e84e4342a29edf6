//! Assessment of trainees: measures of a recorded procedure, as used in studies of novices and experts.
//!
//! A [`Record`] holds what the operator did with instruments, beam and injector, and the result; a [`Way`] leads to the
//! target. [`assess`] computes measures of both in seven groups. Every measure states its unit, its definition, whether
//! less or more of it is better, and the study that used it. It has no value if the data that it needs were not recorded.
//!
//! A [`Subject`] is a task for trainees: a goal in a scene, limits, and thresholds of measures. An [`Exam`] follows a
//! record until the goal is reached or a limit is passed, and gives its [`Score`].
//!
//! [`noticed`] lists remarkable moments of a record, a [`Timeline`] holds what can be drawn over time, and a [`Course`]
//! shows how measures change over attempts.
//!
//! ```
//! use endowire_assess::{Record, assess};
//!
//! let metrics = assess(&Record::default(), None);
//! assert!(metrics.iter().all(|metric| !metric.definition.is_empty()));
//! ```

// Scores must have the same bits on every machine.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod auc;
mod check;
mod course;
mod exam;
mod folder;
mod goal;
mod groups;
mod hands;
mod injection;
mod metric;
mod note;
mod noticed;
mod reach;
mod record;
mod rules;
mod score;
mod session;
mod smoothness;
mod spectrum;
mod stretch;
mod subject;
mod timeline;
mod titles;
mod total;
mod unjudged;
mod way;
mod words;

pub use auc::auc;
pub use course::{Attempt, Course, Line, MetricLine, Trend};
pub use endowire_recording::Outlet;
pub use exam::{Ended, EndedBy, Exam, Standing, Used};
pub use goal::{Goal, PackingGoal, PlaceGoal};
pub use groups::assess;
pub use injection::Injection;
pub use metric::{Better, Group, Metric};
pub use noticed::{Noticed, NoticedKind, noticed};
pub use reach::{Site, thinnest_mm};
pub use record::{BEAM, BeamMode, BeamState, Hand, Packed, Record, Sample};
pub use score::{Band, SCHEMA, Score, Scored, Verdict};
pub use session::SessionFile;
pub use subject::{Limits, Subject, Threshold};
pub use timeline::{HandLine, Timeline};
pub use unjudged::Unjudged;
pub use way::Way;
