//! What a bench test prints, draws and writes.

use serde::Serialize;

use crate::args::BenchOutputArgs;
use crate::commands::device::table::columns;
use crate::commands::lab::devices::NamedDevice;
use crate::failure::Failure;
use crate::output::curves::{Curves, Entry, Stroke, colour};
use crate::output::provenance::Provenance;
pub(super) use crate::output::study::Table;
use crate::output::{chart, print, print_json, printable, study, tell};

/// A test of several devices, ready to be shown.
pub(super) struct Shown {
    pub(super) title: String,
    /// How it was tested, and what the words mean: a paragraph each.
    pub(super) about: Vec<String>,
    /// The results: a row for each device, or for each of its parts.
    pub(super) table: Table,
    /// Every reading.
    pub(super) readings: Table,
    pub(super) curves: Curves,
    /// What went wrong, each with its device.
    pub(super) troubles: Vec<String>,
}

/// The JSON document of a test.
#[derive(Serialize)]
pub(super) struct Document<S: Serialize, R: Serialize> {
    #[serde(flatten)]
    pub(super) provenance: Provenance,
    pub(super) test: &'static str,
    #[serde(flatten)]
    pub(super) settings: S,
    pub(super) devices: Vec<Tested<R>>,
}

/// A device and its result.
#[derive(Serialize)]
pub(super) struct Tested<R: Serialize> {
    pub(super) device: String,
    pub(super) name: String,
    #[serde(flatten)]
    pub(super) result: R,
}

/// Prints and writes what was asked for; then fails if a test did not come to its end.
pub(super) fn give<S: Serialize, R: Serialize>(
    args: &BenchOutputArgs,
    document: &Document<S, R>,
    shown: &Shown,
) -> Result<(), Failure> {
    if let Some(out) = &args.out {
        chart::write_file(out, shown.curves.size(), &shown.curves)?;
        tell(format_args!("wrote {}", out.display()));
    }
    if let Some(page) = &args.page {
        let Shown { title, about, table, curves, .. } = shown;
        let source = document.provenance.words();
        study::write(page, study::Page { title, about, curves, table, source })?;
        tell(format_args!("wrote {}", page.display()));
    }
    if args.json {
        print_json(document)?;
    } else if args.csv {
        print(csv_text(&shown.readings)?.trim_end())?;
    } else {
        let rows = shown.table.rows.iter().cloned();
        print(printable(format!("{}\n{}", shown.title, columns(&shown.table.columns, rows))))?;
    }
    match shown.troubles.as_slice() {
        [] => Ok(()),
        troubles => Err(Failure::Computation(troubles.join("; "))),
    }
}

fn csv_text(table: &Table) -> Result<String, Failure> {
    let unwritable = |e: String| Failure::Computation(format!("the readings cannot be written: {e}"));
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&table.columns).map_err(|e| unwritable(e.to_string()))?;
    for row in &table.rows {
        writer.write_record(row).map_err(|e| unwritable(e.to_string()))?;
    }
    let bytes = writer.into_inner().map_err(|e| unwritable(e.to_string()))?;
    String::from_utf8(bytes).map_err(|e| unwritable(e.to_string()))
}

/// Names of devices for tables and legends: those of their files, with the files' own names where several agree.
pub(super) fn names(devices: &[NamedDevice]) -> Vec<String> {
    let name = |device: &NamedDevice| {
        let own = &device.file.name;
        let alike = devices.iter().filter(|other| other.file.name == *own).count();
        if own.is_empty() {
            device.stem.clone()
        } else if alike > 1 {
            format!("{own} ({})", device.stem)
        } else {
            own.clone()
        }
    };
    devices.iter().map(name).collect()
}

/// Legend of devices, each with its colour.
pub(super) fn legend(names: &[String]) -> Vec<Entry> {
    let entry = |(index, name): (usize, &String)| Entry {
        name: name.clone(),
        colour: colour(index),
        stroke: Stroke::Solid,
    };
    names.iter().enumerate().map(entry).collect()
}

/// An error of a device's test, which names the device's file, and parameters as flags.
pub(super) fn of_device(error: endowire_core::Error, device: &NamedDevice) -> Failure {
    let is_setting = matches!(&error, endowire_core::Error::Parameter { name, .. } if flag(name).is_some());
    let failure = as_flag(error);
    if is_setting { failure } else { failure.at(&device.stem) }
}

/// The flag of a setting: its name has neither the dots of a key in a file nor the spaces of a description.
fn flag(name: &str) -> Option<String> {
    (!name.contains(['.', ' ', '['])).then(|| format!("--{}", name.replace('_', "-")))
}

/// Replaces the library's name of a setting in an error by the flag of the command line.
pub(super) fn as_flag(error: endowire_core::Error) -> Failure {
    Failure::from(match error {
        endowire_core::Error::Parameter { name, value, remedy } => {
            endowire_core::Error::Parameter { name: flag(&name).unwrap_or(name), value, remedy }
        }
        other => other,
    })
}

/// What a test reports of itself: steps without an equilibrium, and why it ended early.
pub(super) fn troubles(name: &str, test: &str, unconverged: usize, ended: Option<&String>) -> Vec<String> {
    let mut all = Vec::new();
    if unconverged > 0 {
        all.push(format!("{name}, {test}: {unconverged} readings are no equilibrium"));
    }
    all.extend(ended.map(|reason| format!("{name}, {test}: ended early: {reason}")));
    all
}
