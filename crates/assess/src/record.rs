//! Records of procedures.

use std::path::Path;

use endowire_core::device::Stack;
use endowire_core::insertion::Simulation;
use endowire_core::{Result, Vec3};
use endowire_recording::start_mm;
use serde::{Deserialize, Serialize};

use crate::injection::Injection;
use crate::session::SessionFile;
use crate::total::total;
use crate::{check, folder};

/// Name of the beam log, beside steps.csv or a session's script; absent if the beam was not recorded.
pub const BEAM: &str = "beam.csv";

/// Motions below these count as rest: advance, mm, rotation, rad, and change of the steering.
pub(crate) const REST_MM: f64 = 1e-9;
const REST_RAD: f64 = 1e-9;
const REST_STEER: f64 = 1e-9;
/// Tip force above which a tip counts as pressed against a wall, N.
pub(crate) const AGAINST_WALL_N: f64 = 1e-3;

/// Motion of one instrument in a step, and its state after the step.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hand {
    /// Advance; negative when pulled back.
    pub advance_mm: f64,
    /// Rotation.
    pub rotate_rad: f64,
    /// Change of the value to which it is steered.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub steer_by: f64,
    /// Inserted length after the step.
    pub inserted_mm: f64,
    /// Push force; `None` where it is undefined.
    pub push_force_n: Option<f64>,
    /// Torque that holds the instrument.
    pub torque_nmm: f64,
    /// Position of the instrument's tip; `None` while it is outside, for a single device ([`Sample::tip_mm`]), and if
    /// it was not recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_mm: Option<Vec3>,
    /// Material position of that tip, in the undisplaced vessel; `None` if the vessel does not move, or if it was not
    /// recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_at_rest_mm: Option<Vec3>,
}

/// Packing of a sac with coils.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Packed {
    /// Volume of the coils in the sac over the volume of the sac.
    pub density: f64,
    /// Length of coil that has left the catheter and lies outside the neck, mm.
    pub outside_mm: f64,
}

/// The record of one step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sample {
    /// Time of its end, since the start.
    pub time_s: f64,
    /// Position of the foremost tip; `None` while nothing is inserted.
    pub tip_mm: Option<Vec3>,
    /// Material position of that tip, in the undisplaced vessel; `None` if the vessel does not move, or if it was not
    /// recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_at_rest_mm: Option<Vec3>,
    /// The instruments, innermost first.
    pub hands: Vec<Hand>,
    /// Sum of the magnitudes of all wall forces.
    pub wall_force_n: f64,
    /// Sum of the magnitudes of wall forces at the tip.
    pub tip_force_n: f64,
    /// Whether the device jumped from one equilibrium to another.
    pub jumped: bool,
    /// Packing of the vessel's sac; `None` if there is no sac.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<Packed>,
    /// Whether the session went to another of its states before this step, as by undo: from the tip of the sample
    /// before to this one leads no motion.
    #[serde(default, skip_serializing_if = "is_false")]
    pub undone: bool,
    /// Whether the tip of an instrument that moved was outside the picture: beside the detector or behind a blade.
    #[serde(default, skip_serializing_if = "is_false")]
    pub out_of_picture: bool,
}

/// Whether a flag is left out of a session file.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_false(flag: &bool) -> bool {
    !*flag
}

/// Whether a number is left out of a session file.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

impl Sample {
    /// Position of the tip to be compared with the centre line, which belongs to the undisplaced vessel.
    pub(crate) fn on_centreline_mm(&self) -> Option<Vec3> {
        self.tip_at_rest_mm.or(self.tip_mm)
    }

    /// The same for the tip of one of several instruments; for the foremost tip if `hand` is `None`.
    pub(crate) fn tip_of_mm(&self, hand: Option<usize>) -> Option<Vec3> {
        match hand {
            Some(hand) => self.hands.get(hand).and_then(|hand| hand.tip_at_rest_mm.or(hand.tip_mm)),
            None => self.on_centreline_mm(),
        }
    }

    /// Whether no instrument moves.
    pub(crate) fn rests(&self) -> bool {
        let turns = |hand: &Hand| hand.rotate_rad.abs() > REST_RAD || hand.steer_by.abs() > REST_STEER;
        let moves = |hand: &Hand| hand.advance_mm.abs() > REST_MM || turns(hand);
        !self.hands.iter().any(moves)
    }

    /// Whether an outer instrument is inserted farther than the one inside it.
    pub(crate) fn is_ahead(&self) -> bool {
        self.hands.windows(2).any(|pair| pair[1].inserted_mm > pair[0].inserted_mm + REST_MM)
    }
}

/// What the beam is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BeamMode {
    /// Fluoroscopy.
    #[default]
    Fluoro,
    /// A run that is stored, with ten times the dose.
    Cine,
    /// Subtraction angiography.
    Dsa,
    /// Fluoroscopy over an angiogram.
    Roadmap,
}

impl BeamMode {
    /// Whether its pictures are acquired to be stored.
    pub(crate) fn acquires(self) -> bool {
        matches!(self, Self::Cine | Self::Dsa)
    }
}

/// State of the beam and the C-arm from a time on: a row of beam.csv.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeamState {
    /// Time since the start, increasing from row to row.
    pub time_s: f64,
    /// Whether the pedal is down: `true` or `false`.
    pub on: bool,
    /// Frame rate while the pedal is down.
    pub frames_per_s: f64,
    /// Air kerma at the detector per frame.
    pub dose_ngy: f64,
    /// Area at the detector that the collimator leaves open.
    pub field_mm2: f64,
    /// Primary angle of the C-arm (LAO/RAO).
    pub primary_deg: f64,
    /// Secondary angle of the C-arm (cranial/caudal).
    pub secondary_deg: f64,
    /// Air kerma at the patient entrance reference point per frame; `None` if it was not recorded. It grows with the
    /// thickness behind the C-arm's angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub entrance_ngy: Option<f64>,
    /// Area at that point that the collimator leaves open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub entrance_mm2: Option<f64>,
    /// What it is used for; `None` if it was not recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<BeamMode>,
}

/// The record of a procedure.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Names of the instruments, innermost first; empty if they were not recorded.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instruments: Vec<String>,
    /// Position of the foremost tip at time 0, before the first step ([`Self::begin`]); `None` if it was not recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_mm: Option<Vec3>,
    /// Its steps, in order of time.
    pub samples: Vec<Sample>,
    /// Injections, in order of time.
    pub injections: Vec<Injection>,
    /// The beam, if it was recorded.
    pub beam: Option<Vec<BeamState>>,
}

impl Record {
    /// Reads a session of `endowire play` (*.session.json), or the folder of a run: steps.csv and, if they exist,
    /// instruments.csv, injections.csv, packing.csv and beam.csv. Hands rest after the last step of a run until all
    /// medium has flowed. The tables must be of the same steps, and of as many as summary.json counts, if it exists.
    ///
    /// # Errors
    /// [`Error::Content`](endowire_core::Error::Content) naming a file that is missing or invalid, with the key and value
    /// that are impossible, and a session in which nothing was done.
    pub fn read(path: &Path) -> Result<Self> {
        if path.is_file() { SessionFile::read(path)?.done(path) } else { folder::read_record(path) }
    }

    /// Reads a session from the bytes of its file; `path` is for messages.
    ///
    /// # Errors
    /// [`Error::Content`](endowire_core::Error::Content) if it is not a session, has an impossible value, or nothing
    /// was done in it.
    pub fn from_session(bytes: &[u8], path: &Path) -> Result<Self> {
        SessionFile::parse(bytes, path)?.done(path)
    }

    /// Begins the record at the state of a simulation before its first step.
    pub fn begin(&mut self, simulation: &Simulation) {
        self.start_mm = Some(start_mm(simulation));
    }

    /// Whether nothing was done: no step was carried out and no time went by. Such a record has no score.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Refuses impossible values, and samples and injections that do not fit the named instruments.
    ///
    /// # Errors
    /// [`Error::Parameter`](endowire_core::Error::Parameter) with key and value.
    pub(crate) fn check(&self) -> Result<()> {
        check::place("start_mm", self.start_mm)?;
        check::samples(self)?;
        check::injections(self)?;
        // A session in which nothing was done has seen no beam.
        self.beam.as_deref().filter(|_| !self.is_empty()).map_or(Ok(()), check::beam)
    }

    /// Refuses a record of other instruments than those of its scene: the places of tips and the lengths that are in
    /// would be those of something else.
    ///
    /// # Errors
    /// [`Error::Parameter`](endowire_core::Error::Parameter) with key and value.
    pub fn check_in(&self, stack: &Stack) -> Result<()> {
        check::in_scene(self, stack)
    }

    /// Largest number of instruments in a sample.
    pub(crate) fn hand_count(&self) -> usize {
        self.samples.iter().map(|sample| sample.hands.len()).max().unwrap_or(0)
    }

    /// The record with a rest at its end, if medium still flows there: a run ends with its last step, but not what it
    /// has injected.
    pub(crate) fn flowed_out(mut self) -> Self {
        let end_s = self.injections.iter().map(Injection::end_s).fold(0.0, f64::max);
        if let Some(last) = self.samples.last().filter(|last| last.time_s < end_s) {
            let rests = |hand: &Hand| Hand { advance_mm: 0.0, rotate_rad: 0.0, steer_by: 0.0, ..*hand };
            let hands = last.hands.iter().map(rests).collect();
            self.samples.push(Sample { time_s: end_s, hands, jumped: false, ..last.clone() });
        }
        self
    }

    /// Each sample with its duration, s.
    pub(crate) fn timed(&self) -> impl Iterator<Item = (f64, &Sample)> {
        let mut before_s = 0.0;
        self.samples.iter().map(move |sample| {
            let took_s = (sample.time_s - before_s).max(0.0);
            before_s = sample.time_s;
            (took_s, sample)
        })
    }

    /// The path of the foremost tip: times, s, and places. It begins before the first step, or without that place at the
    /// end of the first step with a tip. Where the session went to another of its states, as by undo,
    /// the path goes on from where the tip was: what follows is shifted by the distance that no hand has moved it.
    pub(crate) fn path_of_tip(&self) -> Vec<(f64, Vec3)> {
        let mut path: Vec<(f64, Vec3)> = self.start_mm.map(|start| (0.0, start)).into_iter().collect();
        let (mut shift, mut undone) = (Vec3::zeros(), false);
        for sample in &self.samples {
            undone |= sample.undone;
            let Some(tip) = sample.tip_mm else { continue };
            if let Some((_, last)) = path.last().filter(|_| undone) {
                shift = last - tip;
            }
            undone = false;
            path.push((sample.time_s, tip + shift));
        }
        path
    }

    /// Duration of the procedure, s.
    pub(crate) fn end_s(&self) -> f64 {
        self.samples.last().map_or(0.0, |last| last.time_s)
    }

    /// Beam-on time between two times, s; `None` if the beam was not recorded.
    pub(crate) fn beam_on_s(&self, from_s: f64, to_s: f64) -> Option<f64> {
        let on = self.beam_stretches()?.filter(|(state, _)| state.on);
        let each = on.map(|(state, end_s)| (end_s.min(to_s) - state.time_s.max(from_s)).max(0.0));
        Some(total(each))
    }

    /// Time at which the beam has been on for `limit_s`, s; `None` if it has not, or was not recorded.
    pub(crate) fn beam_used_up_s(&self, limit_s: f64) -> Option<f64> {
        let mut left_s = limit_s;
        self.beam_stretches()?.filter(|(state, _)| state.on).find_map(|(state, end_s)| {
            let took_s = end_s - state.time_s;
            let used_up = (took_s > left_s).then_some(state.time_s + left_s);
            left_s -= took_s;
            used_up
        })
    }

    /// Wall force at the tip that an injection leaves, when it began, N. An earlier version recorded only that at the
    /// foremost tip; `None` if the medium may have left another one.
    fn outlet_force_n(&self, injection: &Injection) -> Option<f64> {
        let recorded = injection.outlet.as_ref().and_then(|outlet| outlet.tip_force_n);
        let during = self.samples.iter().find(|sample| sample.time_s >= injection.time_s);
        let sample = during.or(self.samples.last());
        let foremost = sample.filter(|sample| sample.hands.len() <= 1).map(|sample| sample.tip_force_n);
        recorded.or(foremost)
    }

    /// Whether an injection began with the tip that it leaves pressed against a wall; `None` if it was not recorded.
    pub(crate) fn is_against_wall(&self, injection: &Injection) -> Option<bool> {
        self.outlet_force_n(injection).map(|force_n| force_n > AGAINST_WALL_N)
    }

    /// The record up to `time_s`, which lies in the sample of this index.
    pub(crate) fn until(&self, sample: usize, time_s: f64) -> Self {
        let mut samples = self.samples[..=sample].to_vec();
        samples[sample].time_s = time_s;
        let injections = self.injections.iter().filter(|one| one.time_s <= time_s).cloned().collect();
        let states =
            |beam: &Vec<BeamState>| beam.iter().filter(|one| one.time_s <= time_s).copied().collect();
        let beam = self.beam.as_ref().map(states);
        Self { instruments: self.instruments.clone(), start_mm: self.start_mm, samples, injections, beam }
    }

    /// The record up to a time.
    pub fn before(&self, time_s: f64) -> Self {
        let after = self.samples.partition_point(|sample| sample.time_s < time_s);
        match self.samples.get(after) {
            Some(_) => self.until(after, time_s),
            None => self.clone(),
        }
    }

    /// States of the beam, each with the time of its end.
    pub(crate) fn beam_stretches(&self) -> Option<impl Iterator<Item = (&BeamState, f64)>> {
        let beam = self.beam.as_ref()?;
        let ends = beam.iter().skip(1).map(|state| state.time_s).chain([f64::INFINITY]);
        let end_s = self.end_s();
        Some(beam.iter().zip(ends).map(move |(state, end)| (state, end.min(end_s).max(state.time_s))))
    }
}
