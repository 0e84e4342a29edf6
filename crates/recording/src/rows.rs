//! The rows of tables that have some for each step, read together: they must be of the same steps.
//!
//! A run that was killed may have written its last steps to one table and not to another, or a row in part. These steps
//! are left out. Anything else that is missing would let rows belong to the shapes of other steps, and is refused.

use std::fmt::Display;
use std::path::Path;

use endowire_core::{Error, Result};
use serde::de::DeserializeOwned;

use crate::coils::{COILS, CoilRow};
use crate::columns::Row;
use crate::injections::{INJECTIONS, InjectionRow};
use crate::instruments::{INSTRUMENTS, InstrumentRow};
use crate::packing::{PACKING, PackingRow};
use crate::steps::{STEPS, StepRow};
use crate::summary::{About, SUMMARY};
use crate::table;
use crate::vessel::{PLACES, PlaceRow, UnknownRow, VESSEL};

/// The remedy for tables that do not fit each other.
pub(crate) const AGAIN: &str = "rows are missing, or are of another run: run the scene again (endowire run)";

/// Longer lists of instruments, places or unknowns are shortened in messages.
const MOST_LISTED: usize = 12;

/// Rows of the tables of a recording, of the same steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Those of steps.csv, one step after another.
    pub steps: Vec<StepRow>,
    /// Those of instruments.csv for each of these steps, each time of the same instruments; `None` without that table.
    pub instruments: Option<Vec<Vec<InstrumentRow>>>,
    /// Those of packing.csv, which may begin with a later step and then has every one; `None` without that table.
    pub packing: Option<Vec<PackingRow>>,
    /// Those of injections.csv, in order of time.
    pub injections: Vec<InjectionRow>,
    /// What was left out of a run that was killed, in words.
    pub left_out: Option<String>,
}

impl Rows {
    /// Reads the tables in the folder of a recording with this summary: of a run that was killed, up to the last step that
    /// all of them have.
    ///
    /// # Errors
    /// [`Error::Content`] naming a table that is missing or damaged, or is of other steps than the others, and the line.
    pub fn read(folder: &Path, about: &About) -> Result<Self> {
        let path = folder.join(STEPS);
        let (steps, is_cut) = table::read_cut::<StepRow>(&path)?;
        check_steps(&path, &steps, about)?;
        let is_killed = !about.is_complete();
        if is_cut && !is_killed {
            return refused_cut(&path, steps.len());
        }
        let cut_row = || format!("the row of line {} of {STEPS} is cut", steps.len() + 2);
        let mut left_out = is_cut.then(cut_row);
        let mut whole = steps.len();
        let of = Of { folder, steps: &steps, instruments: &about.instruments, is_killed };
        let mut shorten = |name: &str, count: usize| {
            if count < whole {
                whole = count;
                left_out = Some(format!("{name} has not all rows of a later step"));
            }
        };
        let named = |row: &InstrumentRow| (row.step, row.instrument.clone());
        let instruments = of.rows((INSTRUMENTS, "instrument"), about.instruments.clone(), named)?;
        let unknowns = of.rows((VESSEL, "unknown"), vec![], |row: &UnknownRow| (row.step, row.unknown))?;
        let places = of.rows((PLACES, "place"), vec![], |row: &PlaceRow| (row.step, row.place.clone()))?;
        let (packing, packed) = of.packing()?;
        shorten(PACKING, packed);
        shorten(COILS, of.check_coils()?);
        let (injections, is_shorter) = of.injections()?;
        let yields = steps.iter().any(|row| row.vessel_displacement_mm.is_some_and(|by_mm| by_mm > 0.0));
        for (name, count, is_due) in [
            (INSTRUMENTS, instruments.as_ref().map(Vec::len), !about.instruments.is_empty()),
            (VESSEL, unknowns.as_ref().map(Vec::len), yields),
            // A vessel without named places has no row of them.
            (PLACES, places.as_ref().map(|all| if all.is_empty() { steps.len() } else { all.len() }), yields),
        ] {
            match count {
                Some(count) => shorten(name, count),
                None if is_due && !steps.is_empty() => {
                    return Err(Error::content(
                        &folder.join(name),
                        format!("is missing, and {STEPS} needs it: {AGAIN}"),
                    ));
                }
                None => {}
            }
        }
        if is_shorter {
            left_out.get_or_insert_with(|| format!("{INJECTIONS} has some after later steps"));
        }
        let mut rows = Self { steps, instruments, packing, injections, left_out };
        rows.truncate(whole);
        Ok(rows)
    }

    /// Drops all but the first steps.
    fn truncate(&mut self, steps: usize) {
        self.steps.truncate(steps);
        let last = self.steps.last().map_or(0, |row| row.step);
        if let Some(instruments) = &mut self.instruments {
            instruments.truncate(steps);
        }
        if let Some(packing) = &mut self.packing {
            packing.retain(|row| row.step <= last);
        }
        self.injections.retain(|row| row.after_step <= last);
    }
}

/// Checks that steps follow one another, and are as many as the summary counts. A run that was killed may have recorded
/// more of them, and no run fewer.
fn check_steps(path: &Path, steps: &[StepRow], about: &About) -> Result<()> {
    for (index, pair) in steps.windows(2).enumerate() {
        if pair[1].step != pair[0].step + 1 {
            let name = format!("line {}: step", index + 3);
            return refused(path, &name, pair[1].step, &format!("comes after step {}", pair[0].step));
        }
    }
    let last = steps.last().map_or(0, |row| row.step);
    let wrong = |count: &usize| last < *count || about.complete == Some(true) && last > *count;
    let Some(count) = about.steps.filter(wrong) else { return Ok(()) };
    if steps.is_empty() {
        return refused(path, "steps", "[]", &format!("it has no step, and {SUMMARY} counts {count} steps"));
    }
    refused(path, "step", last, &format!("is the last one, and {SUMMARY} counts {count} steps"))
}

/// The steps whose rows are wanted of other tables.
struct Of<'a> {
    folder: &'a Path,
    steps: &'a [StepRow],
    /// Names of the instruments; empty where nothing says them.
    instruments: &'a [String],
    is_killed: bool,
}

impl Of<'_> {
    /// The rows of a table for each of these steps in turn; `None` without the table. `key` are the step of a row, and what
    /// is different in each row of a step: these are the same in every step, and are `known` if they are not empty.
    fn rows<T: DeserializeOwned + Row, K: PartialEq + Display>(
        &self,
        (name, what): (&str, &str),
        known: Vec<K>,
        key: impl Fn(&T) -> (usize, K),
    ) -> Result<Option<Vec<Vec<T>>>> {
        let path = self.folder.join(name);
        if !path.exists() {
            return Ok(None);
        }
        let read = table::read_cut::<T>(&path)?;
        self.grouped((name, what), read, known, key).map(Some)
    }

    /// As [`Self::rows`], of rows that were read, with whether the last one is cut.
    fn grouped<T, K: PartialEq + Display>(
        &self,
        (name, what): (&str, &str),
        (rows, is_cut): (Vec<T>, bool),
        mut known: Vec<K>,
        key: impl Fn(&T) -> (usize, K),
    ) -> Result<Vec<Vec<T>>> {
        let path = self.folder.join(name);
        let mut all: Vec<Vec<T>> = Vec::new();
        let mut line = 2;
        let mut rows = rows.into_iter().peekable();
        while let Some(step) = rows.peek().map(|row| key(row).0) {
            let group: Vec<T> = std::iter::from_fn(|| rows.next_if(|row| key(row).0 == step)).collect();
            let keys: Vec<K> = group.iter().map(|row| key(row).1).collect();
            let Some(due) = self.steps.get(all.len()).map(|row| row.step) else {
                // The table of steps is written last.
                if self.is_killed {
                    break;
                }
                return refused(
                    &path,
                    &format!("line {line}: step"),
                    step,
                    &format!("is no step of {STEPS}"),
                );
            };
            if step != due {
                return refused(
                    &path,
                    &format!("line {line}: step"),
                    step,
                    &format!("{STEPS} has step {due} there"),
                );
            }
            if !known.is_empty() && keys != known {
                if self.is_killed && rows.peek().is_none() && known.starts_with(&keys) {
                    break;
                }
                let name = format!("line {line}: step[{step}].{what}");
                let but = format!("those of the run are [{}]", list(&known));
                return refused(&path, &name, format!("[{}]", list(&keys)), &but);
            }
            line += group.len();
            all.push(group);
            known = keys;
        }
        let is_whole = all.len() == self.steps.len() && !is_cut;
        // A table without any row has not even a first line, as that of a vessel without named places.
        let has_none = all.is_empty() && name == PLACES;
        if !is_whole && !has_none && !self.is_killed {
            let step = self.steps.get(all.len()).map_or(0, |row| row.step);
            return refused(
                &path,
                "step",
                step,
                &format!("is missing from line {line} on, and {STEPS} has it"),
            );
        }
        Ok(all)
    }

    /// The rows of packing.csv, and the number of steps that it allows: it has a row for each step from its first one on.
    fn packing(&self) -> Result<(Option<Vec<PackingRow>>, usize)> {
        let path = self.folder.join(PACKING);
        let count = self.steps.len();
        if !path.exists() {
            return Ok((None, count));
        }
        let (rows, is_cut) = table::read_cut::<PackingRow>(&path)?;
        let Some(first) = rows.first().map(|row| row.step) else { return Ok((Some(rows), count)) };
        let before = self.steps.iter().take_while(|row| row.step < first).count();
        let later = Of { steps: &self.steps[before..], ..*self };
        let packed = |row: &PackingRow| (row.step, "packing");
        let rows = later.grouped((PACKING, "rows"), (rows, is_cut), vec!["packing"], packed)?;
        let count = before + rows.len();
        Ok((Some(rows.into_iter().flatten().collect()), count))
    }

    /// Checks coils.csv, and returns the number of steps that it allows: its rows are in order of steps and coils, those of
    /// a coil after a step lead to the coil's tip, and a coil is the next one where it first appears.
    fn check_coils(&self) -> Result<usize> {
        let path = self.folder.join(COILS);
        let count = self.steps.len();
        if !path.exists() {
            return Ok(count);
        }
        let (rows, is_cut) = table::read_cut::<CoilRow>(&path)?;
        if is_cut && !self.is_killed {
            return refused_cut(&path, rows.len());
        }
        let (mut line, mut coils, mut before) = (2, 0, None);
        let mut groups = rows.chunk_by(|a, b| (a.step, a.coil) == (b.step, b.coil)).peekable();
        while let Some(group) = groups.next() {
            let CoilRow { step, coil, ref instrument, .. } = group[0];
            let refused = |name: &str, value: &dyn Display, but: &str| {
                refused(&path, &format!("line {line}: {name}"), value, but)
            };
            if !self.steps.iter().any(|row| row.step == step) {
                if self.is_killed && self.steps.last().is_none_or(|last| step > last.step) {
                    break;
                }
                return refused("step", &step, &format!("is no step of {STEPS}"));
            }
            if before.is_some_and(|before| (step, coil) <= before) {
                return refused("coil", &coil, &format!("of step {step} comes after coils of later rows"));
            }
            if coil > coils {
                return refused("coil", &coil, &format!("comes first, and {coils} is the next one"));
            }
            self.check_instrument(&path, line, instrument)?;
            let end_mm = group.last().map_or(0.0, |row| row.from_tip_mm);
            if end_mm != 0.0 {
                if self.is_killed && groups.peek().is_none() {
                    return Ok(self.steps.iter().take_while(|row| row.step < step).count());
                }
                let but = format!("is where coil {coil} ends in step {step}, and not its tip");
                return refused("from_tip_mm", &end_mm, &but);
            }
            (before, coils) = (Some((step, coil)), coils.max(coil + 1));
            line += group.len();
        }
        Ok(count)
    }

    /// The rows of injections.csv, which are in order of time and of steps, and whether there are some after later steps.
    fn injections(&self) -> Result<(Vec<InjectionRow>, bool)> {
        let path = self.folder.join(INJECTIONS);
        let mut rows = table::read_if_any::<InjectionRow>(&path)?.unwrap_or_default();
        let last = self.steps.last().map_or(0, |row| row.step);
        let count = rows.len();
        if self.is_killed {
            // These are synced at once, and steps once a second: a power failure may have taken the steps before them.
            rows.retain(|row| row.after_step <= last);
        }
        let is_shorter = rows.len() < count;
        let (mut after_step, mut time_s) = (0, 0.0);
        for (row, line) in rows.iter().zip(2..) {
            let refused = |name: &str, value: &dyn Display, but: &str| {
                refused(&path, &format!("line {line}: {name}"), value, but)
            };
            if row.after_step > last {
                return refused("after_step", &row.after_step, &format!("{STEPS} ends with step {last}"));
            }
            if row.after_step < after_step {
                return refused("after_step", &row.after_step, &format!("comes after {after_step}"));
            }
            if row.time_s < time_s {
                return refused("time_s", &row.time_s, &format!("comes after {time_s}"));
            }
            self.check_instrument(&path, line, &row.instrument)?;
            (after_step, time_s) = (row.after_step, row.time_s);
        }
        Ok((rows, is_shorter))
    }

    fn check_instrument(&self, path: &Path, line: usize, name: &str) -> Result<()> {
        if self.instruments.is_empty() || self.instruments.iter().any(|one| one == name) {
            return Ok(());
        }
        let but = format!("those of the run are [{}]", list(self.instruments));
        refused(path, &format!("line {line}: instrument"), name, &but)
    }
}

/// Keys in words; of more than a line has room for, the first and the last.
fn list(keys: &[impl Display]) -> String {
    let texts: Vec<String> = keys.iter().map(ToString::to_string).collect();
    match texts.as_slice() {
        [first, second, .., last] if texts.len() > MOST_LISTED => {
            format!("{first}, {second}, …, {last}: {} in all", texts.len())
        }
        _ => texts.join(", "),
    }
}

/// Refuses a table of a run that has ended and has so many whole rows, and then part of one.
fn refused_cut<T>(path: &Path, rows: usize) -> Result<T> {
    let but = format!("{SUMMARY} says that the run has ended, and this row is cut");
    refused(path, "line", rows + 2, &but)
}

/// Refuses a table with a value that contradicts what the others say.
fn refused<T>(path: &Path, name: &str, value: impl Display, but: &str) -> Result<T> {
    let error = Error::parameter(name, value, format!("{but}: {AGAIN}"));
    Err(Error::content(path, error.to_string()))
}
