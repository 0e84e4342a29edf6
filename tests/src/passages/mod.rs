//! Whether what `endowire vessel passable` says of a device in a vessel is what a simulation does: random devices in random vessels.
//!
//! ```text
//! seed ──► Question (vessel, device, way) ──► passable ──┐
//!                     └──► Pushed: a simulation ─────────┴──► disagreement, or none
//! ```
//! Vessels have no branches and walls do not rub, so that neither steering nor friction, of which `passable` knows nothing, decides.

mod pushed;
mod question;
mod vessels;

use std::fmt;

use endowire_core::Result;
use endowire_core::device::Device;
use endowire_core::passable::{NO_FORCE_N, Passable, Passage, passable};

use crate::noise::Noise;
pub use pushed::{Ended, Pushed};
pub use question::Question;
pub use vessels::Vessel;

/// A tip stops where it was reported if it is no farther from there than this and a radius of the lumen, mm: a command and a half.
const PLACE_MM: f64 = 3.0;
/// What passes takes no more force than this, N: some times that which was taken for none, since a tip that is being bent takes more than the
/// rest of the device.
const LITTLE_FORCE_N: f64 = 5.0 * NO_FORCE_N;
/// A lumen is tight for a section of more than this part of its radius.
const TIGHT: f64 = 1.0 / 1.1;

/// A number between two, evenly.
fn between(random: &mut Noise, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * 0.5 * (random.next() + 1.0)
}

/// A number between two, its logarithm evenly.
fn decades(random: &mut Noise, [low, high]: [f64; 2]) -> f64 {
    low * (high / low).powf(between(random, [0.0, 1.0]))
}

/// A question with what was said and what was done.
pub struct Row {
    /// Its number.
    pub seed: u64,
    /// What was asked.
    pub question: Question,
    /// What was said.
    pub reported: Passable,
    /// What was done.
    pub pushed: Pushed,
    /// What is against both being the same; none where they are.
    pub against: Option<String>,
}

impl Row {
    /// Asks and simulates.
    ///
    /// # Errors
    /// A way that is not found, and what cannot be simulated.
    pub fn new(seed: u64) -> Result<Self> {
        let question = Question::new(seed)?;
        let reported = passable(&question.way, &question.device, NO_FORCE_N)?;
        let pushed = Pushed::of(&question)?;
        let against = disagreement(&reported, &question.device, &pushed);
        Ok(Self { seed, question, reported, pushed, against })
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (reported, pushed) = (format!("{:?}", self.reported.passage), &self.pushed);
        let ended = match &pushed.ended {
            Ended::Failed(why) => why.clone(),
            other => format!("{other:?}"),
        };
        write!(
            f,
            "{:>4}  {reported:<8} {:>8.1} {:>8.1}  {ended:<8} {:>8.1} {:>8.1} {:>9.4} {:>9.5}  {}",
            self.seed,
            self.reported.length_mm,
            self.reported.reaches_mm,
            pushed.reached_mm,
            pushed.inserted_mm,
            pushed.force_n,
            pushed.deep_mm,
            self.question.what
        )?;
        match &self.against {
            Some(against) => write!(f, "\n      AGAINST: {against}"),
            None => Ok(()),
        }
    }
}

/// The heads of what a row shows.
pub const HEAD: &str =
    "seed  told       way mm reaches mm  ended    tip at mm    in mm    most N   deep mm  what";

/// What is against the answer, if a device that was pushed does something else.
///
/// - What passes arrives, and takes little force.
/// - What is tight arrives, or its tip stops where a section of it comes to a place that is said to be tight.
/// - What is blocked is blocked, or its tip makes no way any more, where that was reported.
/// - What is too short is all in with its tip where that was reported.
pub fn disagreement(reported: &Passable, device: &Device, pushed: &Pushed) -> Option<String> {
    let Pushed { ended, reached_mm, force_n, deep_mm, .. } = pushed;
    let near_mm = |stop_mm: f64| {
        let behind = reported.way.partition_point(|point| point.arc_mm < stop_mm).min(reported.way.len() - 1);
        PLACE_MM + reported.way[behind].lumen_radius_mm
    };
    let stops_at = |stop_mm: f64| (reached_mm - stop_mm).abs() <= near_mm(stop_mm);
    let agrees = match (reported.passage, ended) {
        (_, Ended::Failed(_)) => false,
        (Passage::Passes, ended) => *ended == Ended::Arrived && *force_n <= LITTLE_FORCE_N,
        (Passage::Tight, Ended::Arrived) => true,
        (Passage::Tight, _) => tight_stops_mm(reported, device).into_iter().any(stops_at),
        (Passage::Blocked, ended) => {
            matches!(ended, Ended::Blocked | Ended::Stuck | Ended::AllIn) && stops_at(reported.reaches_mm)
        }
        (Passage::Short, ended) => *ended == Ended::AllIn && stops_at(reported.reaches_mm),
    };
    (!agrees).then(|| {
        let narrow = &reported.narrowest;
        format!(
            "said {:?} to {:.1} mm, least clearance {:.3} mm of {:.3} at {:.1} mm, least bend {:.1} mm where {:.1} takes no force; \
             {ended:?} at {reached_mm:.1} mm with {force_n:.3} N and {deep_mm:.4} mm deep",
            reported.passage,
            reported.reaches_mm,
            narrow.clearance_mm,
            narrow.lumen_radius_mm,
            narrow.arc_mm,
            reported.sharpest.cut_radius_mm,
            reported.sharpest.bears_radius_mm
        )
    })
}

/// Where the tip is when a section of a device comes to a place that is tight for it, mm of way.
fn tight_stops_mm(reported: &Passable, device: &Device) -> Vec<f64> {
    let begins = device.sections().iter().scan(0.0, |end_mm, section| {
        let begin_mm = *end_mm;
        *end_mm += section.length_mm;
        Some((begin_mm, section.radius_mm))
    });
    let begins: Vec<(f64, f64)> = begins.collect();
    let stops = reported.way.iter().flat_map(|point| {
        let narrow = begins.iter().filter(|(_, radius_mm)| *radius_mm > TIGHT * point.lumen_radius_mm);
        let bends = (point.cut_radius_mm < point.bears_radius_mm).then_some(point.arc_mm);
        narrow.map(|(begin_mm, _)| point.arc_mm + begin_mm).chain(bends)
    });
    stops.collect()
}
