//! What a page is given.

use std::path::Path;

use endowire_core::Vec3;
use endowire_core::device::Stack;
use endowire_core::vessel::SurfaceMesh;
use endowire_sweep::{EndedBy, UntilOutcome};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::base64::base64;
use super::wall;
use crate::failure::Failure;
use crate::output::instruments::Lengths;
use crate::output::recording::Recording;

/// Most nodes of all shapes together: what fits into a page of a few megabytes.
const MOST_NODES: usize = 120_000;
/// Most bytes of all frames together, and most frames.
const MOST_FRAME_BYTES: usize = 2_000_000;
const MOST_FRAMES: usize = 24;

/// The document in the page.
#[derive(Serialize)]
pub(super) struct Data {
    summary: Value,
    instruments: Vec<String>,
    /// Coordinates x y z of the vessel's vertices, tenths of a millimetre.
    vertices: Vec<i32>,
    triangles: Vec<[u32; 3]>,
    steps: Vec<StepData>,
    series: Series,
    events: Vec<EventData>,
    frames: Vec<FrameData>,
}

/// One step in 3D.
#[derive(Serialize)]
struct StepData {
    step: usize,
    /// Coordinates x y z of the line, sheath first, hundredths of a millimetre.
    line: Vec<i32>,
    /// Length of each instrument along the line, as a share of it.
    shares: Vec<f32>,
    /// Place and force of contacts: hundredths of a millimetre, and newton.
    contacts: Vec<([i32; 3], [f32; 3])>,
}

/// Columns of steps.csv.
#[derive(Serialize, Default)]
struct Series {
    inserted_mm: Vec<f64>,
    push_force_n: Vec<f64>,
    torque_nmm: Vec<f64>,
    energy_mj: Vec<f64>,
    wall_mj: Vec<f64>,
    max_penetration_mm: Vec<f64>,
    /// None in recordings of versions that did not tell them.
    wall_force_sum_n: Vec<Option<f64>>,
    wall_force_largest_n: Vec<Option<f64>>,
    wall_force_tip_n: Vec<Option<f64>>,
    imbalance: Vec<Option<f64>>,
}

#[derive(Serialize)]
struct EventData {
    step: usize,
    what: &'static str,
    text: String,
}

#[derive(Serialize)]
struct FrameData {
    step: usize,
    view: String,
    png: String,
}

/// The columns of steps.csv that are shown.
#[derive(Deserialize)]
struct Row {
    step: usize,
    inserted_mm: f64,
    push_force_n: f64,
    torque_nmm: f64,
    bend_mj: f64,
    twist_mj: f64,
    wall_mj: f64,
    max_penetration_mm: f64,
    jumped: bool,
    left_through: Option<usize>,
    converged: bool,
    #[serde(default)]
    relaxations: u32,
    imbalance: Option<f64>,
    wall_force_sum_n: Option<f64>,
    wall_force_largest_n: Option<f64>,
    wall_force_tip_n: Option<f64>,
}

/// Gathers what was recorded in `folder`.
pub(super) fn collect(
    folder: &Path,
    recording: &Recording,
    stack: &Stack,
    vessel: &SurfaceMesh,
) -> Result<Data, Failure> {
    let path = folder.join("summary.json");
    // A damaged summary is no reason to show nothing.
    let summary = std::fs::read(&path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
    let summary: Value = summary.unwrap_or(Value::Null);
    let rows = rows(folder)?;
    let vessel = wall::simplified(vessel);
    Ok(Data {
        instruments: stack.instruments().iter().map(|one| one.name.clone()).collect(),
        vertices: vessel.vertices_mm.iter().flat_map(|v| scaled(v, 10.0)).collect(),
        triangles: vessel.triangles,
        steps: steps(folder, recording, stack)?,
        events: events(&rows, &summary),
        series: Series {
            inserted_mm: rows.iter().map(|row| row.inserted_mm).collect(),
            push_force_n: rows.iter().map(|row| row.push_force_n).collect(),
            torque_nmm: rows.iter().map(|row| row.torque_nmm).collect(),
            energy_mj: rows.iter().map(|row| row.bend_mj + row.twist_mj + row.wall_mj).collect(),
            wall_mj: rows.iter().map(|row| row.wall_mj).collect(),
            max_penetration_mm: rows.iter().map(|row| row.max_penetration_mm).collect(),
            wall_force_sum_n: rows.iter().map(|row| row.wall_force_sum_n).collect(),
            wall_force_largest_n: rows.iter().map(|row| row.wall_force_largest_n).collect(),
            wall_force_tip_n: rows.iter().map(|row| row.wall_force_tip_n).collect(),
            imbalance: rows.iter().map(|row| row.imbalance).collect(),
        },
        frames: frames(folder),
        summary,
    })
}

fn scaled(point_mm: &Vec3, per_mm: f64) -> [i32; 3] {
    [point_mm.x, point_mm.y, point_mm.z].map(|x| (x * per_mm).round() as i32)
}

fn rows(folder: &Path) -> Result<Vec<Row>, Failure> {
    let path = folder.join("steps.csv");
    let unreadable = |e: csv::Error| Failure::Input(format!("{}: {e}", path.display()));
    let mut reader = csv::Reader::from_path(&path).map_err(unreadable)?;
    // The last row of a run that was killed may be cut.
    Ok(reader.deserialize().map_while(Result::ok).collect())
}

/// Steps in 3D: all, or as many as fit, the last one among them.
fn steps(folder: &Path, recording: &Recording, stack: &Stack) -> Result<Vec<StepData>, Failure> {
    let count = recording.steps();
    let nodes: usize = (1..=count).map(|step| recording.shape(step).len()).sum();
    let every = nodes.div_ceil(MOST_NODES).max(1);
    let lengths = Lengths::read(folder, stack)?;
    let wanted = (1..=count).filter(|step| (count - step).is_multiple_of(every));
    wanted
        .map(|step| {
            let shape = recording.shape(step);
            let inserted_mm = lengths.after(step, &shape)?;
            let whole_mm = inserted_mm.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            let contacts = recording.contacts(step);
            let contact = |c: &endowire_viewer::ContactView| {
                (scaled(&c.position_mm, 100.0), [c.force_n.x, c.force_n.y, c.force_n.z].map(|x| x as f32))
            };
            Ok(StepData {
                step,
                line: shape.positions_mm.iter().flat_map(|p| scaled(p, 100.0)).collect(),
                shares: inserted_mm.iter().map(|mm| (mm / whole_mm) as f32).collect(),
                contacts: contacts.iter().map(contact).collect(),
            })
        })
        .collect()
}

fn events(rows: &[Row], summary: &Value) -> Vec<EventData> {
    let mut events = Vec::new();
    let mut out = None;
    for row in rows {
        let mut happened =
            |what: &'static str, text: String| events.push(EventData { step: row.step, what, text });
        if row.jumped {
            happened("jumped", format!("at {:.1} mm: let go of energy", row.inserted_mm));
        }
        if let (Some(opening), None) = (row.left_through, out) {
            happened("left", format!("at {:.1} mm: the tip is out of opening {opening}", row.inserted_mm));
        }
        if !row.converged {
            happened("not converged", format!("at {:.1} mm: the step found no equilibrium", row.inserted_mm));
        }
        if row.relaxations > 0 {
            let left = row.imbalance.unwrap_or_default();
            let text =
                format!("at {:.1} mm: left to come to rest, {left:.1e} out of balance", row.inserted_mm);
            happened("last resort", text);
        }
        out = row.left_through;
    }
    if let (Some(step), Some(reason)) =
        (summary["failure"]["step"].as_u64(), summary["failure"]["reason"].as_str())
    {
        // Earlier versions told no kind.
        let kind = serde_json::from_value::<EndedBy>(summary["failure"]["kind"].clone());
        let blocked = reason.starts_with("blocked");
        let what = kind.map_or(if blocked { "blocked" } else { "ended" }, EndedBy::name);
        events.push(EventData { step: step as usize, what, text: reason.to_owned() });
    }
    for line in serde_json::from_value::<Vec<UntilOutcome>>(summary["until"].clone()).unwrap_or_default() {
        let (what, how) = match line.met {
            Some(met) => (EndedBy::from(met).name(), "its condition (until) was met"),
            None => ("went on", "its condition (until) was not met on all of its way"),
        };
        let text = format!("{}: {how}, {} steps", line.line, line.steps);
        events.push(EventData { step: line.after_step, what, text });
    }
    events.sort_by_key(|event| event.step);
    events
}

/// Frames of the run, evenly chosen, as far as they fit.
fn frames(folder: &Path) -> Vec<FrameData> {
    let Ok(entries) = std::fs::read_dir(folder.join("frames")) else { return Vec::new() };
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let every = paths.len().div_ceil(MOST_FRAMES).max(1);
    let mut left = MOST_FRAME_BYTES;
    let mut frames = Vec::new();
    // From the end: the last frame is the one that is wanted most.
    for path in paths.iter().rev().step_by(every) {
        let name = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let Some((step, view)) = name.strip_prefix("step_").and_then(|rest| rest.split_once('_')) else {
            continue;
        };
        let (Ok(step), Ok(png)) = (step.parse(), std::fs::read(path)) else { continue };
        if png.len() > left {
            break;
        }
        left -= png.len();
        frames.push(FrameData { step, view: view.to_owned(), png: base64(&png) });
    }
    frames.reverse();
    frames
}
