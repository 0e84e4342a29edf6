//! The folder of a run as a record: steps.csv and the tables beside it, which must be of the same steps.

use std::collections::BTreeMap;
use std::path::Path;

use endowire_core::{Error, Result, Vec3};
use endowire_recording::table::read_other;
use endowire_recording::{
    About, INJECTIONS, INSTRUMENTS, InjectionRow, InstrumentRow, Outlet, PACKING, PackingRow, Rows, STEPS,
    SUMMARY, StepRow,
};

use crate::check;
use crate::injection::Injection;
use crate::record::{BEAM, BeamState, Hand, Packed, Record, Sample};
use crate::score::SCHEMA;
use crate::session::SessionFile;

/// The remedy for tables that do not fit each other.
const AGAIN: &str = "rows are missing, or are of another run: run the scene again (endowire run)";

/// Reads the record of a run from its folder.
///
/// # Errors
/// [`Error::Content`] naming a file that is missing or invalid, with the step, key and value.
pub(crate) fn read_record(folder: &Path) -> Result<Record> {
    // Without a summary nothing says that the run has ended.
    let unknown = || About { complete: Some(false), ..About::default() };
    let about = About::read_if_any(folder)?.unwrap_or_else(unknown);
    let rows = Rows::read(folder, &about)?;
    let (instruments, mut hands) = hands(folder, rows.instruments)?;
    let steps = steps(folder, rows.steps)?;
    let mut packing = packing(folder, rows.packing, &steps)?;
    let mut samples = Vec::with_capacity(steps.len());
    let table = folder.join(STEPS);
    for step in &steps {
        let entry = entry(step.row.step);
        let hands = match hands.remove(&step.row.step) {
            Some(hands) => hands,
            None => {
                let hand = hand_of(&step.row);
                in_table(&table, check::hand(&entry, &hand))?;
                vec![hand]
            }
        };
        let sample = Sample { packing: packing.remove(&step.row.step), ..step.sample(hands) };
        in_table(&table, check::sample(&entry, &sample))?;
        samples.push(sample);
    }
    in_table(&table, check::forward("step", steps.iter().map(|step| (step.row.step, step.time_s))))?;
    let injections = rows.injections.into_iter().map(injection).collect();
    let beam = beam(&folder.join(BEAM))?;
    in_table(&folder.join(BEAM), beam.as_deref().map_or(Ok(()), check::beam))?;
    in_table(&folder.join(SUMMARY), check::place("start_mm", about.start_mm))?;
    let record = Record { instruments, start_mm: about.start_mm, samples, injections, beam };
    in_table(&folder.join(INJECTIONS), check::injections(&record))?;
    Ok(record.flowed_out())
}

/// Reads the record of a run with its scene, which summary.json names.
///
/// # Errors
/// As [`read_record`], and a summary that is missing or names no scene.
pub(crate) fn read_in_scene(folder: &Path) -> Result<SessionFile> {
    let named = About::read_if_any(folder)?.and_then(|about| Some((about.scene_file?, about.set)));
    let Some((scene_file, set)) = named else {
        let remedy =
            "says which scene the run is of, and is missing or names none; give the folder of a recorded run";
        return Err(Error::content(&folder.join(SUMMARY), remedy));
    };
    let record = read_record(folder)?;
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

/// A row of the table of steps, with the columns that it may lack elsewhere.
struct Step {
    row: StepRow,
    wall_force_n: f64,
    tip_force_n: f64,
    time_s: f64,
}

/// The steps, of which there is one at least.
fn steps(folder: &Path, rows: Vec<StepRow>) -> Result<Vec<Step>> {
    let path = folder.join(STEPS);
    if rows.is_empty() {
        return refused(&path, "steps", "[]", "it has no step");
    }
    let number = |column: &str, number: Option<f64>| {
        let lacking = || Error::content(&path, format!("has no column {column}: {AGAIN}"));
        number.ok_or_else(lacking)
    };
    let step = |row: StepRow| {
        Ok(Step {
            wall_force_n: number("wall_force_sum_n", row.wall_force_sum_n)?,
            tip_force_n: number("wall_force_tip_n", row.wall_force_tip_n)?,
            time_s: number("time_s", row.time_s)?,
            row,
        })
    };
    rows.into_iter().map(step).collect()
}

/// Hands by step.
type Hands = BTreeMap<usize, Vec<Hand>>;

/// Names and motions of the instruments, by step; none if there is no table of them, as in what was written by hand.
fn hands(folder: &Path, rows: Option<Vec<Vec<InstrumentRow>>>) -> Result<(Vec<String>, Hands)> {
    let path = folder.join(INSTRUMENTS);
    let rows = rows.unwrap_or_default();
    let known = rows.first().into_iter().flatten().map(|row| row.instrument.clone()).collect();
    let (mut all, mut steered) = (BTreeMap::new(), vec![]);
    for rows in &rows {
        let Some(step) = rows.first().map(|row| row.step) else { continue };
        steered.resize(rows.len(), 0.0);
        let mut hands = Vec::with_capacity(rows.len());
        for (row, from) in rows.iter().zip(&mut steered) {
            let entry = format!("{}.{}", entry(step), row.instrument);
            let hand = hand_from(row, from);
            in_table(&path, check::hand(&entry, &hand))?;
            hands.push(hand);
        }
        all.insert(step, hands);
    }
    Ok((known, all))
}

/// How much of a sac coils fill, by step; nothing if there is no table of it.
fn packing(folder: &Path, rows: Option<Vec<PackingRow>>, steps: &[Step]) -> Result<BTreeMap<usize, Packed>> {
    let path = folder.join(PACKING);
    let Some(rows) = rows else { return Ok(BTreeMap::new()) };
    let all: BTreeMap<usize, Packed> = rows.into_iter().map(|row| (row.step, packed(&row))).collect();
    for (step, packed) in &all {
        in_table(&path, check::packed(&entry(*step), packed))?;
    }
    match steps.iter().find(|step| !all.contains_key(&step.row.step)) {
        Some(step) => refused(&path, "step", step.row.step, &format!("is missing, and {STEPS} has it")),
        None => Ok(all),
    }
}

impl Step {
    fn sample(&self, hands: Vec<Hand>) -> Sample {
        let row = &self.row;
        let tip_mm = Vec3::new(row.tip_x_mm, row.tip_y_mm, row.tip_z_mm);
        Sample {
            time_s: self.time_s,
            tip_mm: (row.nodes > 0).then_some(tip_mm),
            tip_at_rest_mm: None,
            hands,
            wall_force_n: self.wall_force_n,
            tip_force_n: self.tip_force_n,
            jumped: row.jumped,
            packing: None,
            undone: false,
            out_of_picture: false,
        }
    }
}

/// The hand of a single device.
fn hand_of(row: &StepRow) -> Hand {
    Hand {
        advance_mm: row.advance_mm,
        rotate_rad: row.rotate_rad,
        inserted_mm: row.inserted_mm,
        push_force_n: Some(row.push_force_n),
        torque_nmm: row.torque_nmm,
        ..Hand::default()
    }
}

/// The hand of an instrument, after a step that began with it steered to `from`, which becomes the value after it.
fn hand_from(row: &InstrumentRow, from: &mut f64) -> Hand {
    let tip_mm = match (row.tip_x_mm, row.tip_y_mm, row.tip_z_mm) {
        (Some(x), Some(y), Some(z)) => Some(Vec3::new(x, y, z)),
        _ => None,
    };
    let steer = row.steer.unwrap_or_default();
    Hand {
        advance_mm: row.advance_mm,
        rotate_rad: row.rotate_rad,
        steer_by: steer - std::mem::replace(from, steer),
        inserted_mm: row.inserted_mm,
        push_force_n: row.push_force_n,
        torque_nmm: row.torque_nmm,
        tip_mm,
        tip_at_rest_mm: None,
    }
}

fn packed(row: &PackingRow) -> Packed {
    Packed { density: row.packing, outside_mm: row.outside_mm }
}

fn injection(row: InjectionRow) -> Injection {
    let InjectionRow { time_s, instrument, volume_ml, rate_ml_per_s, tip_force_n, .. } = row;
    let at_mm = Vec3::new(row.tip_x_mm, row.tip_y_mm, row.tip_z_mm);
    let outlet = Some(Outlet { instrument: Some(instrument), at_mm, tip_force_n });
    Injection { time_s, volume_ml, rate_ml_per_s, outlet }
}

/// The log of the beam, which no run writes.
fn beam(path: &Path) -> Result<Option<Vec<BeamState>>> {
    const COLUMNS: &str = "a row of this log has time_s, on (true or false), frames_per_s, dose_ngy, field_mm2, primary_deg and secondary_deg";
    if path.exists() { read_other(path, COLUMNS).map(Some) } else { Ok(None) }
}
