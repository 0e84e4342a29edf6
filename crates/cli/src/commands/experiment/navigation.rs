//! `endowire experiment navigation`: the paper's experiment 2, figure 3.
//!
//! A shaped wire is steered to every named target of the aortic arch and the hepatic arteries. The hand is a simple one: it turns
//! the tail until the tip points to where the way goes, pushes on, and where the tip has gone astray or makes no way it
//! pulls back and tries another turn.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::time::Instant;

use endowire_core::Vec3;
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::vessel::{CentrelineTree, GeneratedWall, Resolution, anatomy};
use endowire_viewer::{CArmSpec, ViewSpec, XRaySpec};
use serde::Serialize;

use super::camera::Camera;
use crate::args::NavigationArgs;
use crate::commands::compare::{case::point_at, contender};
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress};

/// An anatomy, its targets in the order of their rows in the centre-line table, and how its wall and wire are made.
struct Anatomy {
    name: &'static str,
    targets: &'static [&'static str],
    edge_mm: f64,
    radius_mm: f64,
    tip_curvature_per_mm: f64,
    tip_mm: f64,
    primary_deg: f64,
}

const ANATOMIES: [Anatomy; 2] = [
    Anatomy {
        name: "aortic_arch",
        targets: &["ascending aorta", "innominate", "left carotid", "left subclavian"],
        edge_mm: 2.25,
        radius_mm: 0.445,
        tip_curvature_per_mm: 0.06,
        tip_mm: 25.0,
        primary_deg: 40.0,
    },
    Anatomy {
        name: "hepatic",
        targets: &["aorta", "splenic", "gastroduodenal", "right hepatic", "left hepatic"],
        edge_mm: 1.1,
        radius_mm: 0.25,
        tip_curvature_per_mm: 0.07,
        tip_mm: 22.0,
        primary_deg: 0.0,
    },
];
/// Most commands for one target.
const COMMANDS: usize = 800;
/// Advance of one command, mm.
const STEP_MM: f64 = 2.0;
/// How far ahead on the way the hand aims, in radii of the vessel.
const AHEAD_RADII: f64 = 1.5;
const LEAST_AHEAD_MM: f64 = 15.0;
/// How far before the way's end the tip has arrived, mm.
const ARRIVED_MM: f64 = 6.0;
/// Largest turn of one command, rad.
const TURN_RAD: f64 = 0.35;
/// Most turns between two pushes.
const TURNS: usize = 12;
/// Pulled back after going astray, mm.
const BACK_MM: f64 = 30.0;
/// How far beyond the vessel's wall the tip has gone astray, mm. The axis is a polyline, outside of whose corners the wall bulges, and
/// a tip that dips into the mouth of a branch slides on past it.
const ASTRAY_MM: f64 = 3.0;
/// Pushed in without getting farther, mm, before the hand tries something else.
const PATIENCE_MM: f64 = 24.0;
/// Every so many commands there is a frame.
const FRAME_EVERY: usize = 50;

#[derive(Debug, Serialize)]
struct Row {
    anatomy: &'static str,
    target: &'static str,
    success: bool,
    commands: usize,
    /// Times that the wire was pulled back.
    retries: usize,
    /// Length of the way.
    path_mm: f64,
    inserted_mm: f64,
    /// Distance of the tip from the end of the way.
    from_target_mm: f64,
    largest_push_n: f64,
    largest_wall_force_n: f64,
    largest_penetration_mm: f64,
    /// Time of the steps alone.
    time_s: f64,
    /// Why it ended, where it did not arrive.
    note: String,
}

#[derive(Debug, Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    rows: Vec<Row>,
    frames: Vec<PathBuf>,
}

/// Steers to every target.
pub(super) fn navigation(args: &NavigationArgs) -> Result<(), Failure> {
    let wanted = |target: &str| args.targets.is_empty() || args.targets.iter().any(|name| name == target);
    let asked = targets().into_iter().filter(|name| wanted(name)).count();
    let bar = progress::bar(asked, "target");
    let (mut rows, mut frames) = (Vec::new(), Vec::new());
    for anatomy in ANATOMIES.iter().filter(|anatomy| anatomy.targets.iter().any(|name| wanted(name))) {
        let tree = anatomy::tree(anatomy.name)
            .ok_or_else(|| Failure::Input(format!("{} is not built in", anatomy.name)))?;
        let made = GeneratedWall::new(&tree, Resolution::EdgeMm(anatomy.edge_mm))?;
        let mut ends: Vec<usize> = made.ends.iter().skip(1).map(|end| end.0).collect();
        ends.sort_unstable();
        for (target, end) in anatomy.targets.iter().zip(ends).filter(|(name, _)| wanted(name)) {
            bar.set_message(format!("{}: {target}", anatomy.name));
            let mut camera = match &args.out {
                Some(folder) => Some(camera(folder, anatomy, target, &made)?),
                None => None,
            };
            rows.push(steer(anatomy, target, &way(&tree, end), &made, camera.as_mut())?);
            frames.extend(camera.into_iter().flat_map(|camera| camera.frames));
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    let document = Document {
        provenance: Provenance::of_program(&format!("experiment navigation {:?}", args.targets)),
        rows,
        frames,
    };
    if let Some(folder) = &args.out {
        super::write(folder, "navigation", &document.rows, &document)?;
    }
    answer(&document, args.json, || table(&document.rows))
}

/// Names of all targets.
pub(crate) fn targets() -> Vec<&'static str> {
    ANATOMIES.iter().flat_map(|anatomy| anatomy.targets.iter().copied()).collect()
}

/// The way from the inlet to a row of the table: points, and the vessel's radius there.
fn way(tree: &CentrelineTree, end: usize) -> Vec<(Vec3, f64)> {
    let nodes = tree.nodes();
    let mut way = Vec::new();
    let mut at = Some(end);
    while let Some(row) = at {
        way.push((nodes[row].position_mm, nodes[row].radius_mm));
        at = nodes[row].parent;
    }
    way.reverse();
    way
}

/// Arc length on the way of the point nearest to `x`, its distance, and the vessel's radius there.
fn nearest(way: &[(Vec3, f64)], x: &Vec3) -> (f64, f64, f64) {
    let mut best = (0.0, f64::MAX, 0.0);
    let mut before = 0.0;
    for pair in way.windows(2) {
        let piece = pair[1].0 - pair[0].0;
        let length = piece.norm();
        let u = ((x - pair[0].0).dot(&piece) / (length * length)).clamp(0.0, 1.0);
        let distance = (x - pair[0].0 - piece * u).norm();
        if distance < best.1 {
            best = (before + u * length, distance, pair[0].1.max(pair[1].1));
        }
        before += length;
    }
    best
}

/// The point of the way at an arc length.
fn along(way: &[(Vec3, f64)], mut s: f64) -> Vec3 {
    for pair in way.windows(2) {
        let piece = pair[1].0 - pair[0].0;
        let length = piece.norm();
        if s <= length {
            return pair[0].0 + piece * (s / length);
        }
        s -= length;
    }
    way[way.len() - 1].0
}

fn steer(
    anatomy: &Anatomy,
    target: &'static str,
    way: &[(Vec3, f64)],
    made: &GeneratedWall,
    mut camera: Option<&mut Camera>,
) -> Result<Row, Failure> {
    let path_mm: f64 = way.windows(2).map(|pair| (pair[1].0 - pair[0].0).norm()).sum();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0)?;
    let radius = anatomy.radius_mm;
    let tip = Section {
        rest_curvature_per_mm: [anatomy.tip_curvature_per_mm, 0.0],
        ..Section::straight(anatomy.tip_mm, radius, 4.0)
    };
    let wire =
        Device::new(vec![tip, Section::straight(60.0, radius, 8.0), Section::straight(600.0, radius, 20.0)])?;
    let element_mm = anatomy.tip_mm / 6.0;
    let properties = WallProperties::default();
    let mut simulation =
        contender::insertion("kirchhoff", element_mm, made.wall.clone(), properties, wire, sheath)?;
    let mut row = Row {
        anatomy: anatomy.name,
        target,
        success: false,
        commands: 0,
        retries: 0,
        path_mm,
        inserted_mm: 0.0,
        from_target_mm: path_mm,
        largest_push_n: 0.0,
        largest_wall_force_n: 0.0,
        largest_penetration_mm: 0.0,
        time_s: 0.0,
        note: format!("not there after {COMMANDS} commands"),
    };
    let mut hand = Hand::default();
    for number in 0..COMMANDS {
        let command = hand.next(&simulation, way, anatomy.tip_mm);
        let clock = Instant::now();
        if let Err(error) = simulation.step(command) {
            row.note = error.to_string();
            break;
        }
        row.time_s += clock.elapsed().as_secs_f64();
        row.commands += 1;
        let report = simulation.report();
        row.largest_push_n = row.largest_push_n.max(report.push_force_n);
        row.largest_penetration_mm = row.largest_penetration_mm.max(report.max_penetration_mm);
        let force: f64 = report.contacts.iter().map(|c| c.force_n).sum();
        row.largest_wall_force_n = row.largest_wall_force_n.max(force);
        if let Some(camera) = camera.as_mut().filter(|_| number % FRAME_EVERY == FRAME_EVERY - 1) {
            camera.take(&simulation)?;
        }
        let tip = simulation.shape().tip_mm().unwrap_or_default();
        let (reached, off, radius) = nearest(way, &tip);
        if reached > path_mm - ARRIVED_MM && off < radius {
            (row.success, row.note) = (true, String::new());
            break;
        }
    }
    if let Some(camera) = camera {
        camera.take(&simulation)?;
    }
    row.retries = hand.retries;
    row.inserted_mm = simulation.report().inserted_mm;
    let tip = simulation.shape().tip_mm().unwrap_or_default();
    row.from_target_mm = (tip - way[way.len() - 1].0).norm();
    Ok(row)
}

/// What the hand remembers.
#[derive(Default)]
struct Hand {
    /// Farthest point on the way so far, mm, and the insertion then.
    best_mm: f64,
    best_inserted_mm: f64,
    /// Length that is still to be pulled back, mm, and turn to go with it, rad.
    back_mm: f64,
    turn_rad: f64,
    retries: usize,
    /// Until so much is inserted again, mm, the other turn is kept.
    keep_until_mm: f64,
    /// Turns since the last push.
    turns: usize,
}

impl Hand {
    fn next(&mut self, simulation: &Simulation, way: &[(Vec3, f64)], tip_mm: f64) -> Command {
        let (shape, report) = (simulation.shape(), simulation.report());
        let inserted = report.inserted_mm;
        if self.back_mm > 0.0 && inserted > STEP_MM + tip_mm {
            self.back_mm -= STEP_MM;
            if self.back_mm <= 0.0 {
                (self.best_mm, self.best_inserted_mm) = (0.0, inserted - STEP_MM);
            }
            let parts = BACK_MM / STEP_MM;
            return Command { advance_mm: -STEP_MM, rotate_rad: self.turn_rad / parts };
        }
        let tip = shape.tip_mm().unwrap_or_default();
        let (reached, off, radius) = nearest(way, &tip);
        if reached > self.best_mm + 1.0 {
            (self.best_mm, self.best_inserted_mm) = (reached, inserted);
        }
        let astray = off > radius + ASTRAY_MM && inserted > BACK_MM;
        if astray || inserted - self.best_inserted_mm > PATIENCE_MM {
            self.retries += 1;
            self.keep_until_mm = inserted + STEP_MM;
            self.back_mm = BACK_MM;
            // Each time another turn: golden angles fill the circle evenly.
            self.turn_rad = PI * (3.0 - 5.0f64.sqrt());
            return Command::rotate(0.0);
        }
        let kept = inserted < self.keep_until_mm;
        let turn = if kept { 0.0 } else { self.aim(simulation, way, reached, tip, tip_mm) };
        // Far off the mark, the hand turns before it pushes on.
        if turn.abs() > 0.5 * TURN_RAD && self.turns < TURNS {
            self.turns += 1;
            return Command::rotate(turn);
        }
        self.turns = 0;
        Command { advance_mm: STEP_MM, rotate_rad: turn }
    }

    /// Turn of the tail that brings the bend of the tip towards the way ahead.
    fn aim(&self, simulation: &Simulation, way: &[(Vec3, f64)], reached: f64, tip: Vec3, tip_mm: f64) -> f64 {
        let shape = simulation.shape();
        if simulation.report().inserted_mm < tip_mm + 2.0 * STEP_MM {
            return 0.0;
        }
        // The line from which the tip bends away.
        let root = point_at(shape, tip_mm);
        let axis = (root - point_at(shape, tip_mm + 2.0)).normalize();
        let across = |v: Vec3| v - axis * axis.dot(&v);
        let ahead = (AHEAD_RADII * nearest(way, &tip).2).max(LEAST_AHEAD_MM);
        let (bend, wish) = (across(tip - root), across(along(way, reached + ahead) - root));
        // A way that goes straight on needs no turn.
        if wish.norm() < 0.15 * (ahead + tip_mm) || bend.norm() < 1e-3 {
            return 0.0;
        }
        let angle = axis.dot(&bend.cross(&wish)).atan2(bend.dot(&wish));
        angle.clamp(-TURN_RAD, TURN_RAD)
    }
}

/// A camera for one target.
fn camera(folder: &Path, anatomy: &Anatomy, target: &str, made: &GeneratedWall) -> Result<Camera, Failure> {
    let spec = ViewSpec {
        size_px: [512, 512],
        c_arm: CArmSpec { primary_deg: anatomy.primary_deg, ..CArmSpec::default() },
        xray: XRaySpec { contrast_fraction: 0.04, ..XRaySpec::default() },
        ..ViewSpec::default()
    };
    let stem = format!("{}_{}", anatomy.name, target.replace(' ', "_"));
    Camera::new(&folder.join("frames"), &stem, spec, &made.wall.closed_mesh())
}

fn table(rows: &[Row]) -> String {
    let mut lines = vec![format!(
        "{:<12} {:<16} {:>7} {:>8} {:>7} {:>8} {:>11} {:>7} {:>7} {:>14} {:>7}  note",
        "anatomy",
        "target",
        "arrived",
        "commands",
        "retries",
        "path mm",
        "inserted mm",
        "push N",
        "wall N",
        "penetration mm",
        "time s"
    )];
    for row in rows {
        lines.push(
            format!(
                "{:<12} {:<16} {:>7} {:>8} {:>7} {:>8.1} {:>11.1} {:>7.4} {:>7.4} {:>14.4} {:>7.2}  {}",
                row.anatomy,
                row.target,
                if row.success { "yes" } else { "no" },
                row.commands,
                row.retries,
                row.path_mm,
                row.inserted_mm,
                row.largest_push_n,
                row.largest_wall_force_n,
                row.largest_penetration_mm,
                row.time_s,
                row.note
            )
            .trim_end()
            .to_owned(),
        );
    }
    let arrived = rows.iter().filter(|row| row.success).count();
    lines.push(format!("{arrived} of {} targets reached", rows.len()));
    lines.join("\n")
}
