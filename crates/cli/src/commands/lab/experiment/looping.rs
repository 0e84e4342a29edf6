//! `endowire experiment loop`: what [`endowire_lab::experiment::looping`] measures, drawn and written.

use std::path::{Path, PathBuf};

use endowire_core::vessel::{NoStore, Wall};
use endowire_lab::experiment::looping::{self as experiment, Row, STEPS};
use endowire_viewer::ViewSpec;
use indicatif::ProgressBar;
use serde::Serialize;

use super::camera::Camera;
use super::lines::{Line, Lines};
use crate::args::LoopArgs;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress};

/// Advances after the stop of the tip at which pictures are taken, mm: four, as in the paper's figure 4.
const PICTURES_MM: [f64; 4] = [15.0, 40.0, 65.0, 90.0];

#[derive(Debug, Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    rows: Vec<Row>,
    frames: Vec<PathBuf>,
    /// Why the insertion ended early, if it did.
    failure: Option<String>,
}

/// Pushes, measures and draws, method by method.
pub(super) fn looping(args: &LoopArgs) -> Result<(), Failure> {
    let wall = experiment::wall()?;
    let bar = progress::bar(args.methods.len() * STEPS, "step");
    let (mut rows, mut frames, mut failure) = (Vec::new(), Vec::new(), None);
    for method in &args.methods {
        bar.set_message(method.clone());
        if let Err(error) = push(method, &wall, args.out.as_deref(), (&mut rows, &mut frames), &bar)? {
            failure = failure.or(Some(format!("{method}: {error}")));
        }
    }
    bar.finish_and_clear();
    if let Some(folder) = &args.out {
        frames.extend(growth(&rows).write(folder, "loop")?);
    }
    let provenance = Provenance::of_program(&format!("experiment loop {:?}", args.methods));
    let document = Document { provenance, rows, frames, failure };
    if let Some(folder) = &args.out {
        super::write(folder, "loop", &document.rows, &document)?;
    }
    answer(&document, args.json, || table(&document))?;
    match document.failure {
        Some(reason) => Err(Failure::Computation(reason)),
        None => Ok(()),
    }
}

/// Pushes the wire by one method. The inner error is that of a step; results of earlier steps are kept.
fn push(
    method: &str,
    wall: &Wall,
    out: Option<&Path>,
    (rows, frames): (&mut Vec<Row>, &mut Vec<PathBuf>),
    bar: &ProgressBar,
) -> Result<endowire_core::Result<()>, Failure> {
    let mut simulation = experiment::begin(method, wall)?;
    let mut camera = match out {
        Some(folder) => {
            let spec = ViewSpec { size_px: [480, 720], ..ViewSpec::default() };
            Some(Camera::new(folder, &format!("loop_{method}"), spec, simulation.lumen().wall(&NoStore)?)?)
        }
        None => None,
    };
    let done = experiment::push(method, &mut simulation, |simulation, row| {
        let due =
            |camera: &&mut Camera| PICTURES_MM.get(camera.taken()).is_some_and(|mm| row.advance_mm >= *mm);
        if let Some(camera) = camera.as_mut().filter(due) {
            camera.take(simulation)?;
        }
        rows.push(row);
        bar.inc(1);
        Ok::<_, Failure>(())
    })?;
    frames.extend(camera.into_iter().flat_map(|camera| camera.frames));
    Ok(done)
}

/// Loop size against advance.
fn growth(rows: &[Row]) -> Lines {
    type Value = fn(&Row) -> f64;
    let values: [(&str, Value); 2] = [("depth", |row| row.loop_depth_mm), ("width", |row| row.loop_width_mm)];
    let mut methods: Vec<&str> = rows.iter().map(|row| row.method.as_str()).collect();
    methods.dedup();
    let line = |method: &str, (name, value): &(&str, Value)| {
        let own = rows.iter().filter(|row| row.method == method && row.advance_mm > 0.0);
        let points = own.map(|row| (row.advance_mm, value(row))).collect();
        Line { method: method.to_owned(), of: (*name).to_owned(), points }
    };
    Lines {
        title: "experiment 3: growth of the loop after the tip was stopped",
        across: "advance, mm",
        up: "mm",
        logarithmic: false,
        lines: methods.iter().flat_map(|method| values.iter().map(|value| line(method, value))).collect(),
    }
}

fn table(document: &Document) -> String {
    let mut lines = vec![format!(
        "{:<22} {:>11} {:>11} {:>9} {:>9} {:>11} {:>9} {:>15}",
        "method",
        "inserted mm",
        "advance mm",
        "depth mm",
        "width mm",
        "turned deg",
        "push N",
        "penetration mm"
    )];
    for row in document.rows.iter().filter(|row| row.advance_mm > 0.0 && row.inserted_mm % 10.0 < 1e-6) {
        lines.push(format!(
            "{:<22} {:>11.1} {:>11.1} {:>9.2} {:>9.2} {:>11.1} {:>9.4} {:>15.4}",
            row.method,
            row.inserted_mm,
            row.advance_mm,
            row.loop_depth_mm,
            row.loop_width_mm,
            row.turned_deg,
            row.push_force_n,
            row.max_penetration_mm
        ));
    }
    let mut methods: Vec<&str> = document.rows.iter().map(|row| row.method.as_str()).collect();
    methods.dedup();
    for method in methods {
        let own = document.rows.iter().filter(|row| row.method == method);
        let unconverged = own.clone().filter(|row| !row.converged).count();
        lines.push(format!("{method}: {unconverged} of {} steps unconverged", own.count()));
    }
    lines.join("\n")
}
