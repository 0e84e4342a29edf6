//! The folder of a run as a record: steps.csv and the tables beside it, which must be of the same steps.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use endowire_core::{Error, Result, Vec3};
use serde::Deserialize;

use crate::check;
use crate::injection::{Injection, Outlet};
use crate::record::{BEAM, BeamState, Hand, Packed, Record, Sample};
use crate::score::SCHEMA;
use crate::session::SessionFile;

/// Tables of a folder, and its summary.
const STEPS: &str = "steps.csv";
const INSTRUMENTS: &str = "instruments.csv";
const INJECTIONS: &str = "injections.csv";
const PACKING: &str = "packing.csv";
const SUMMARY: &str = "summary.json";

/// The remedy for tables that do not fit each other.
const AGAIN: &str = "rows are missing, or are of another run: run the scene again (endowire run)";

/// Reads the record of a run from its folder.
///
/// # Errors
/// [`Error::Content`] naming a file that is missing or invalid, with the step, key and value.
pub(crate) fn read(folder: &Path) -> Result<Record> {
    let summary = summary(folder)?.unwrap_or_default();
    let steps = steps(folder, &summary)?;
    let (instruments, mut hands) = hands(folder, &steps)?;
    let mut packing = packing(folder, &steps)?;
    let mut samples = Vec::with_capacity(steps.len());
    let table = folder.join(STEPS);
    for step in &steps {
        let entry = entry(step.step);
        let hands = match hands.remove(&step.step) {
            Some(hands) => hands,
            None => {
                let hand = step.hand();
                in_table(&table, check::hand(&entry, &hand))?;
                vec![hand]
            }
        };
        let sample = Sample { packing: packing.remove(&step.step), ..step.sample(hands) };
        in_table(&table, check::sample(&entry, &sample))?;
        samples.push(sample);
    }
    in_table(&table, check::forward("step", steps.iter().map(|step| (step.step, step.time_s))))?;
    let last = steps.last().map_or(0, |step| step.step);
    let injections = injections(folder, last)?;
    let beam: Option<Vec<BeamState>> = optional(&folder.join(BEAM))?;
    in_table(&folder.join(BEAM), beam.as_deref().map_or(Ok(()), check::beam))?;
    in_table(&folder.join(SUMMARY), check::place("start_mm", summary.start_mm))?;
    let record = Record { instruments, start_mm: summary.start_mm, samples, injections, beam };
    in_table(&folder.join(INJECTIONS), check::injections(&record))?;
    Ok(record.flowed_out())
}

/// Reads the record of a run with its scene, which summary.json names.
///
/// # Errors
/// As [`read`], and a summary that is missing or names no scene.
pub(crate) fn read_in_scene(folder: &Path) -> Result<SessionFile> {
    let named = summary(folder)?.and_then(|summary| Some((summary.scene_file?, summary.set)));
    let Some((scene_file, set)) = named else {
        let remedy =
            "says which scene the run is of, and is missing or names none; give the folder of a recorded run";
        return Err(Error::content(&folder.join(SUMMARY), remedy));
    };
    let record = read(folder)?;
    Ok(SessionFile { schema: SCHEMA, scene_file, set, recorded_unix_s: None, inputs: None, record })
}

/// Name of a step in messages.
fn entry(step: usize) -> String {
    format!("step[{step}]")
}

/// The error of a table's content.
fn in_table<T>(path: &Path, checked: Result<T>) -> Result<T> {
    checked.map_err(|error| Error::content(path, error.to_string()))
}

/// Refuses a table with a value that contradicts what the others say.
fn refused<T>(path: &Path, name: &str, value: impl std::fmt::Display, but: &str) -> Result<T> {
    in_table(path, Err(Error::parameter(name, value, format!("{but}: {AGAIN}"))))
}

/// The part of summary.json that is read here.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Summary {
    scene_file: Option<PathBuf>,
    set: Vec<String>,
    start_mm: Option<Vec3>,
    steps: Option<usize>,
    complete: bool,
}

/// The summary, if there is one.
fn summary(folder: &Path) -> Result<Option<Summary>> {
    let path = folder.join(SUMMARY);
    if !path.exists() {
        return Ok(None);
    }
    let read: std::io::Result<Summary> =
        std::fs::read(&path).and_then(|text| Ok(serde_json::from_slice(&text)?));
    let unreadable = |error| Error::content(&path, format!("{error}; give the folder of a recorded run"));
    read.map(Some).map_err(unreadable)
}

/// The steps, one after another. A run that was killed may have recorded more of them than its summary counts, and no
/// run fewer.
fn steps(folder: &Path, summary: &Summary) -> Result<Vec<Step>> {
    let path = folder.join(STEPS);
    let steps: Vec<Step> = rows(&path)?;
    let Some(last) = steps.last().map(|last| last.step) else {
        return refused(&path, "steps", "[]", "it has no step");
    };
    if let Some(pair) = steps.windows(2).find(|pair| pair[1].step != pair[0].step + 1) {
        return refused(&path, "step", pair[1].step, &format!("comes after step {}", pair[0].step));
    }
    match summary.steps.filter(|count| last < *count || summary.complete && last > *count) {
        Some(count) => {
            refused(&path, "step", last, &format!("is the last one, and {SUMMARY} counts {count} steps"))
        }
        None => Ok(steps),
    }
}

/// Rows by the number of their step. A run that was killed may have rows of a step that it has not finished.
fn by_step<T>(rows: Vec<T>, step: impl Fn(&T) -> usize, most: usize) -> BTreeMap<usize, Vec<T>> {
    let mut all: BTreeMap<usize, Vec<T>> = BTreeMap::new();
    for row in rows.into_iter().filter(|row| step(row) <= most) {
        all.entry(step(&row)).or_default().push(row);
    }
    all
}

/// Hands by step.
type Hands = BTreeMap<usize, Vec<Hand>>;

/// Names and motions of the instruments, by step; none if there is no table of them, as in recordings of a single device
/// by earlier versions.
fn hands(folder: &Path, steps: &[Step]) -> Result<(Vec<String>, Hands)> {
    let path = folder.join(INSTRUMENTS);
    let Some(rows) = optional::<InstrumentRow>(&path)? else { return Ok((vec![], BTreeMap::new())) };
    let most = steps.last().map_or(0, |step| step.step);
    let mut rows = by_step(rows, |row| row.step, most);
    let mut known: Option<Vec<String>> = None;
    let (mut all, mut steered) = (BTreeMap::new(), vec![]);
    for Step { step, .. } in steps {
        let rows = rows.remove(step).unwrap_or_default();
        let names: Vec<String> = rows.iter().map(|row| row.instrument.clone()).collect();
        let known = known.get_or_insert_with(|| names.clone());
        if names.is_empty() || names != *known {
            let but = match known.as_slice() {
                [] => format!("{STEPS} has this step"),
                known => format!("those of the steps before are [{}]", known.join(", ")),
            };
            let name = format!("{}.instrument", entry(*step));
            return refused(&path, &name, format!("[{}]", names.join(", ")), &but);
        }
        steered.resize(rows.len(), 0.0);
        let mut hands = Vec::with_capacity(rows.len());
        for (row, from) in rows.iter().zip(&mut steered) {
            let entry = format!("{}.{}", entry(*step), row.instrument);
            let hand = row.hand(std::mem::replace(from, row.steer));
            in_table(&path, check::hand(&entry, &hand))?;
            hands.push(hand);
        }
        all.insert(*step, hands);
    }
    match rows.first_key_value() {
        Some((step, _)) => refused(&path, "step", step, &format!("is no step of {STEPS}")),
        None => Ok((known.unwrap_or_default(), all)),
    }
}

/// How much of a sac coils fill, by step; nothing if there is no table of it.
fn packing(folder: &Path, steps: &[Step]) -> Result<BTreeMap<usize, Packed>> {
    let path = folder.join(PACKING);
    let Some(rows) = optional::<PackingRow>(&path)? else { return Ok(BTreeMap::new()) };
    let all: BTreeMap<usize, Packed> = rows.into_iter().map(|row| (row.step, row.packed())).collect();
    for (step, packed) in &all {
        in_table(&path, check::packed(&entry(*step), packed))?;
    }
    match steps.iter().find(|step| !all.contains_key(&step.step)) {
        Some(step) => refused(&path, "step", step.step, &format!("is missing, and {STEPS} has it")),
        None => Ok(all),
    }
}

/// The injections, none of them after the last step.
fn injections(folder: &Path, last: usize) -> Result<Vec<Injection>> {
    let path = folder.join(INJECTIONS);
    let rows = optional::<InjectionRow>(&path)?.unwrap_or_default();
    match rows.iter().find(|row| row.after_step > last) {
        Some(row) => refused(&path, "after_step", row.after_step, &format!("{STEPS} ends with step {last}")),
        None => Ok(rows.into_iter().map(InjectionRow::injection).collect()),
    }
}

#[derive(Debug, Deserialize)]
struct Step {
    step: usize,
    advance_mm: f64,
    rotate_rad: f64,
    inserted_mm: f64,
    nodes: usize,
    tip_x_mm: f64,
    tip_y_mm: f64,
    tip_z_mm: f64,
    push_force_n: f64,
    torque_nmm: f64,
    jumped: bool,
    wall_force_sum_n: f64,
    wall_force_tip_n: f64,
    time_s: f64,
}

impl Step {
    fn hand(&self) -> Hand {
        Hand {
            advance_mm: self.advance_mm,
            rotate_rad: self.rotate_rad,
            inserted_mm: self.inserted_mm,
            push_force_n: self.push_force_n.is_finite().then_some(self.push_force_n),
            torque_nmm: self.torque_nmm,
            ..Hand::default()
        }
    }

    fn sample(&self, hands: Vec<Hand>) -> Sample {
        let tip_mm = Vec3::new(self.tip_x_mm, self.tip_y_mm, self.tip_z_mm);
        Sample {
            time_s: self.time_s,
            tip_mm: (self.nodes > 0).then_some(tip_mm),
            tip_at_rest_mm: None,
            hands,
            wall_force_n: self.wall_force_sum_n,
            tip_force_n: self.wall_force_tip_n,
            jumped: self.jumped,
            packing: None,
            undone: false,
            out_of_picture: false,
        }
    }
}

#[derive(Debug, Deserialize)]
struct InstrumentRow {
    step: usize,
    instrument: String,
    advance_mm: f64,
    rotate_rad: f64,
    inserted_mm: f64,
    /// Value to which it is steered after the step; absent in recordings of earlier versions.
    #[serde(default)]
    steer: f64,
    tip_x_mm: Option<f64>,
    tip_y_mm: Option<f64>,
    tip_z_mm: Option<f64>,
    push_force_n: Option<f64>,
    torque_nmm: f64,
}

impl InstrumentRow {
    /// The hand, after a step that began with the instrument steered to `from`.
    fn hand(&self, from: f64) -> Hand {
        let &Self { advance_mm, rotate_rad, inserted_mm, push_force_n, torque_nmm, .. } = self;
        let steer_by = self.steer - from;
        let tip_mm = match (self.tip_x_mm, self.tip_y_mm, self.tip_z_mm) {
            (Some(x), Some(y), Some(z)) => Some(Vec3::new(x, y, z)),
            _ => None,
        };
        Hand {
            advance_mm,
            rotate_rad,
            steer_by,
            inserted_mm,
            push_force_n,
            torque_nmm,
            tip_mm,
            tip_at_rest_mm: None,
        }
    }
}

#[derive(Debug, Deserialize)]
struct PackingRow {
    step: usize,
    packing: f64,
    outside_mm: f64,
}

impl PackingRow {
    fn packed(&self) -> Packed {
        Packed { density: self.packing, outside_mm: self.outside_mm }
    }
}

#[derive(Debug, Deserialize)]
struct InjectionRow {
    after_step: usize,
    time_s: f64,
    instrument: String,
    volume_ml: f64,
    rate_ml_per_s: f64,
    tip_x_mm: f64,
    tip_y_mm: f64,
    tip_z_mm: f64,
    #[serde(default)]
    tip_force_n: Option<f64>,
}

impl InjectionRow {
    fn injection(self) -> Injection {
        let Self { time_s, instrument, volume_ml, rate_ml_per_s, tip_force_n, .. } = self;
        let at_mm = Vec3::new(self.tip_x_mm, self.tip_y_mm, self.tip_z_mm);
        let outlet = Some(Outlet { instrument: Some(instrument), at_mm, tip_force_n });
        Injection { time_s, volume_ml, rate_ml_per_s, outlet }
    }
}

fn optional<T: for<'de> Deserialize<'de>>(path: &Path) -> Result<Option<Vec<T>>> {
    if path.exists() { rows(path).map(Some) } else { Ok(None) }
}

/// Reads the rows of a table. An incomplete last row, left by a run that was killed, is dropped.
fn rows<T: for<'de> Deserialize<'de>>(path: &Path) -> Result<Vec<T>> {
    let mut text = std::fs::read(path).map_err(|error| {
        Error::content(path, format!("{error}; give a session of endowire play or the folder of a run"))
    })?;
    text.truncate(text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1));
    let mut reader = csv::Reader::from_reader(text.as_slice());
    let columns = reader.headers().cloned().unwrap_or_default();
    let rows: std::result::Result<_, _> = reader.into_deserialize().collect();
    rows.map_err(|error| Error::content(path, format!("{}; {}", wrong_row(&error, &columns), remedy(path))))
}

/// What is wrong with a row: its line, its column if that is known, and the reason.
fn wrong_row(error: &csv::Error, columns: &csv::StringRecord) -> String {
    let csv::ErrorKind::Deserialize { pos, err } = error.kind() else { return error.to_string() };
    let line = pos.as_ref().map_or_else(String::new, |pos| format!("line {}: ", pos.line()));
    let column = err.field().and_then(|field| columns.get(usize::try_from(field).ok()?));
    let column = column.map_or_else(String::new, |name| format!("{name}: "));
    format!("{line}{column}{}", err.kind())
}

/// The remedy for a table with an invalid row.
fn remedy(path: &Path) -> &'static str {
    if path.file_name().is_some_and(|name| name == BEAM) {
        return "a row of this log has time_s, on (true or false), frames_per_s, dose_ngy, field_mm2, primary_deg and secondary_deg";
    }
    "give the folder of a recorded run (endowire run)"
}
