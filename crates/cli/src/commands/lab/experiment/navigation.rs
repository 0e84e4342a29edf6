//! `endowire experiment navigation`: the paper's experiment 2, figure 3.
//!
//! A straight wire is pushed into the aortic arch and the hepatic arteries by the paper's method and by ours
//! ([`straight`](super::straight)). A shaped wire is steered by our method to every named target by a controller that
//! follows the centre line ([`FollowPath`]). With `--catalogue`, several instruments of the catalogue are steered by
//! controllers that follow or search ([`catalogue`]).

use std::path::{Path, PathBuf};
use std::time::Instant;

use endowire_core::control::{Controller, FollowPath, Outcome, Team, drive};
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{CentrelinePath, CentrelineTree, GeneratedWall, Resolution, anatomy};
use endowire_viewer::{CArmSpec, ViewSpec, XRaySpec};
use serde::Serialize;

use super::camera::Camera;
use super::catalogue::{self, Procedure};
use super::straight::Straight;
use crate::args::NavigationArgs;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress};
use endowire_lab::compare::candidate;
use endowire_lab::studies::{ARCH_TARGETS, HEPATIC_TARGETS, targets};

/// An anatomy, its targets in the order of their rows in the centre-line table, and the properties of its wall and
/// wire.
pub(super) struct Anatomy {
    pub(super) name: &'static str,
    targets: &'static [&'static str],
    edge_mm: f64,
    pub(super) radius_mm: f64,
    tip_curvature_per_mm: f64,
    pub(super) tip_mm: f64,
    primary_deg: f64,
}

const ANATOMIES: [Anatomy; 2] = [
    Anatomy {
        name: "aortic_arch",
        targets: &ARCH_TARGETS,
        edge_mm: 2.25,
        radius_mm: 0.445,
        tip_curvature_per_mm: 0.06,
        tip_mm: 25.0,
        primary_deg: 40.0,
    },
    Anatomy {
        name: "hepatic",
        targets: &HEPATIC_TARGETS,
        edge_mm: 1.1,
        radius_mm: 0.25,
        tip_curvature_per_mm: 0.07,
        tip_mm: 22.0,
        primary_deg: 0.0,
    },
];
/// Largest number of commands for one target.
const COMMANDS: usize = 800;
/// Distance before the end of the way at which the tip has arrived, mm.
const ARRIVED_MM: f64 = 6.0;
/// Number of commands between frames.
const FRAME_EVERY: usize = 50;

#[derive(Debug, Serialize)]
pub(super) struct Row {
    anatomy: &'static str,
    target: &'static str,
    method: &'static str,
    pub(super) success: bool,
    pub(super) commands: usize,
    /// Number of times the wire was pulled back.
    retries: usize,
    /// Length of the way.
    path_mm: f64,
    pub(super) inserted_mm: f64,
    /// Distance of the tip from the end of the way.
    from_target_mm: f64,
    pub(super) largest_push_n: f64,
    pub(super) largest_wall_force_n: f64,
    pub(super) largest_penetration_mm: f64,
    /// Number of steps that failed the method's own convergence test.
    pub(super) unconverged: usize,
    /// For straight wires: distance between the tips of both methods when the first of them leaves the vessel, and
    /// the largest distance before, mm.
    pub(super) tip_apart_mm: Option<f64>,
    pub(super) largest_tip_apart_mm: Option<f64>,
    /// Time of steps and controller, without frames.
    pub(super) time_s: f64,
    /// Why it ended, if it did not arrive.
    pub(super) note: String,
    /// The steered instruments.
    instruments: String,
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
    if let Some(folder) = &args.catalogue {
        return with_catalogue(args, folder);
    }
    let wanted = |target: &str| args.wants(target);
    let asked = targets().filter(|name| wanted(name)).count();
    let bar = progress::bar(asked, "target");
    let (mut rows, mut frames) = (Vec::new(), Vec::new());
    for anatomy in ANATOMIES.iter().filter(|anatomy| anatomy.targets.iter().any(|name| wanted(name))) {
        let tree = built_in(anatomy.name)?;
        let made = GeneratedWall::new(&tree, Resolution::EdgeMm(anatomy.edge_mm))?;
        let mut ends = made.ends[1..].to_vec();
        ends.sort_unstable();
        bar.set_message(format!("{}: straight wires", anatomy.name));
        let straight = Straight::push(anatomy, &made)?;
        for (target, (end, opening)) in anatomy.targets.iter().zip(ends).filter(|(name, _)| wanted(name)) {
            bar.set_message(format!("{}: {target}", anatomy.name));
            let mut camera = match &args.out {
                Some(folder) => Some(camera(folder, anatomy, target, &made)?),
                None => None,
            };
            let Some(path) = tree.path_to(end) else { continue };
            let of_target = (anatomy, *target, opening);
            rows.extend(straight.rows(of_target, &path, &made, args.out.as_deref(), &mut frames)?);
            rows.push(steer(anatomy, target, &path, &made, camera.as_mut())?);
            frames.extend(camera.into_iter().flat_map(|camera| camera.frames));
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    publish(args, rows, frames)
}

/// Steers instruments of the catalogue to every target.
fn with_catalogue(args: &NavigationArgs, folder: &Path) -> Result<(), Failure> {
    let procedures = catalogue::procedures();
    let asked =
        procedures.iter().flat_map(|procedure| procedure.targets).filter(|name| args.wants(name)).count();
    let bar = progress::bar(asked, "target");
    let mut rows = Vec::new();
    for procedure in procedures.iter().filter(|one| one.targets.iter().any(|name| args.wants(name))) {
        let tree = built_in(procedure.anatomy)?;
        let made = GeneratedWall::new(&tree, anatomy::asset_resolution(procedure.anatomy))?;
        let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0)?;
        let method = KirchhoffOptions { element_mm: procedure.element_mm, ..KirchhoffOptions::default() };
        let simulation =
            Simulation::builder(made.wall, procedure.stack(folder)?, sheath).method(&method).build()?;
        for target in procedure.targets.iter().filter(|name| args.wants(name)) {
            bar.set_message(format!("{}: {target}", procedure.anatomy));
            rows.push(carry_out(procedure, target, &tree, simulation.clone())?);
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    publish(args, rows, Vec::new())
}

fn built_in(name: &str) -> Result<CentrelineTree, Failure> {
    anatomy::tree(name).ok_or_else(|| Failure::Input(format!("{name} is not built in")))
}

fn publish(args: &NavigationArgs, rows: Vec<Row>, frames: Vec<PathBuf>) -> Result<(), Failure> {
    let inputs = match args.catalogue {
        Some(_) => format!("experiment navigation --catalogue {:?}", args.targets),
        None => format!("experiment navigation {:?}", args.targets),
    };
    let document = Document { provenance: Provenance::of_program(&inputs), rows, frames };
    if let Some(folder) = &args.out {
        super::write(folder, "navigation", &document.rows, &document)?;
    }
    answer(&document, args.json, || table(&document.rows))
}

impl Row {
    /// The row of a way that has not been started.
    pub(super) fn new(
        anatomy: &'static str,
        target: &'static str,
        path_mm: f64,
        method: &'static str,
        instruments: String,
    ) -> Self {
        Self {
            anatomy,
            target,
            method,
            success: false,
            commands: 0,
            retries: 0,
            path_mm,
            inserted_mm: 0.0,
            from_target_mm: path_mm,
            largest_push_n: 0.0,
            largest_wall_force_n: 0.0,
            largest_penetration_mm: 0.0,
            unconverged: 0,
            tip_apart_mm: None,
            largest_tip_apart_mm: None,
            time_s: 0.0,
            note: String::new(),
            instruments,
        }
    }

    /// Steers by a controller and records the result; returns whether it arrived.
    fn drive(
        &mut self,
        simulation: &mut Simulation,
        hand: &mut dyn Controller,
        mut seen: impl FnMut(&Simulation) -> Result<(), Failure>,
    ) -> Result<bool, Failure> {
        let (clock, mut drawing_s) = (Instant::now(), 0.0);
        let left = COMMANDS.saturating_sub(self.commands);
        let outcome = drive::<Failure>(simulation, hand, left, |simulation, _| {
            self.commands += 1;
            let report = simulation.report();
            self.largest_push_n = self.largest_push_n.max(report.push_force_n);
            self.largest_penetration_mm = self.largest_penetration_mm.max(report.max_penetration_mm);
            self.unconverged += usize::from(!report.converged);
            let force: f64 = report.contacts.iter().map(|c| c.force_n).sum();
            self.largest_wall_force_n = self.largest_wall_force_n.max(force);
            let clock = Instant::now();
            let drawn = seen(simulation);
            drawing_s += clock.elapsed().as_secs_f64();
            drawn
        })?;
        self.time_s += clock.elapsed().as_secs_f64() - drawing_s;
        self.retries += hand.retries();
        self.inserted_mm = simulation.report().inserted_mm;
        self.note = match outcome {
            Outcome::Arrived => return Ok(true),
            Outcome::GivenUp => "the hand gave up".to_owned(),
            Outcome::Stopped => format!("not there after {COMMANDS} commands"),
            Outcome::Failed(error) => error.to_string(),
        };
        Ok(false)
    }

    /// Sets the distance of the tip from the end of the way.
    pub(super) fn end(&mut self, simulation: &Simulation, path: &CentrelinePath) {
        let tip = simulation.shape().tip_mm().unwrap_or_default();
        self.from_target_mm = (tip - path.end_mm()).norm();
    }
}

/// Steers a shaped wire to a target.
fn steer(
    anatomy: &Anatomy,
    target: &'static str,
    path: &CentrelinePath,
    made: &GeneratedWall,
    mut camera: Option<&mut Camera>,
) -> Result<Row, Failure> {
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
        candidate::insertion("kirchhoff", element_mm, made.wall.clone(), properties, wire, sheath)?;
    let mut row = Row::new(anatomy.name, target, path.length_mm(), "kirchhoff", "shaped wire".to_owned());
    let mut hand = FollowPath::new(path.clone(), Team::default(), ARRIVED_MM);
    let mut number = 0;
    row.success = row.drive(&mut simulation, &mut hand, |simulation| {
        number += 1;
        match camera.as_mut().filter(|_| number % FRAME_EVERY == 0) {
            Some(camera) => camera.take(simulation),
            None => Ok(()),
        }
    })?;
    if let Some(camera) = camera {
        camera.take(&simulation)?;
    }
    row.end(&simulation, path);
    Ok(row)
}

/// Carries out a procedure with the controllers of its stages, one after another.
fn carry_out(
    procedure: &Procedure,
    target: &'static str,
    tree: &CentrelineTree,
    mut simulation: Simulation,
) -> Result<Row, Failure> {
    let path = tree.path_to(tree.target(target)?.row);
    let path = path.ok_or_else(|| Failure::Input(format!("{target} is where the vessel begins")))?;
    let mut row = Row::new(procedure.anatomy, target, path.length_mm(), "kirchhoff", procedure.instruments());
    row.success = true;
    for (number, stage) in procedure.stages.iter().enumerate() {
        let Some(mut hand) = stage.controller(tree, target)? else { continue };
        if !row.drive(&mut simulation, &mut *hand, |_| Ok(()))? {
            row.success = false;
            row.note = format!("part {} of {}: {}", number + 1, procedure.stages.len(), row.note);
            break;
        }
    }
    row.end(&simulation, &path);
    Ok(row)
}

/// A camera for one target.
pub(super) fn camera(
    folder: &Path,
    anatomy: &Anatomy,
    target: &str,
    made: &GeneratedWall,
) -> Result<Camera, Failure> {
    let spec = ViewSpec {
        size_px: [512, 512],
        c_arm: CArmSpec { primary_deg: anatomy.primary_deg, ..CArmSpec::default() },
        xray: XRaySpec { contrast_fraction: 0.04, ..XRaySpec::default() },
        ..ViewSpec::default()
    };
    let stem = format!("{}_{}", anatomy.name, target.replace(' ', "_"));
    Camera::new(&folder.join("frames"), &stem, spec, &made.wall)
}

fn table(rows: &[Row]) -> String {
    let mut lines = vec![format!(
        "{:<15} {:<16} {:<13} {:<25} {:>7} {:>8} {:>7} {:>8} {:>11} {:>7} {:>7} {:>14} {:>11} {:>8} {:>7}  note",
        "anatomy",
        "target",
        "method",
        "instruments",
        "arrived",
        "commands",
        "retries",
        "path mm",
        "inserted mm",
        "push N",
        "wall N",
        "penetration mm",
        "unconverged",
        "apart mm",
        "time s"
    )];
    for row in rows {
        lines.push(
            format!(
                "{:<15} {:<16} {:<13} {:<25} {:>7} {:>8} {:>7} {:>8.1} {:>11.1} {:>7.4} {:>7.4} {:>14.4} {:>11} {:>8} {:>7.2}  {}",
                row.anatomy,
                row.target,
                row.method,
                row.instruments,
                if row.success { "yes" } else { "no" },
                row.commands,
                row.retries,
                row.path_mm,
                row.inserted_mm,
                row.largest_push_n,
                row.largest_wall_force_n,
                row.largest_penetration_mm,
                row.unconverged,
                row.tip_apart_mm.map_or_else(|| "–".to_owned(), |mm| format!("{mm:.3}")),
                row.time_s,
                row.note
            )
            .trim_end()
            .to_owned(),
        );
    }
    let mut who: Vec<(&str, &str)> = Vec::new();
    for row in rows {
        let one =
            (row.method, if row.tip_apart_mm.is_some() { "straight wire, not turned" } else { "steered" });
        if !who.contains(&one) {
            who.push(one);
        }
    }
    for (method, how) in who {
        let own = || {
            let straight = how != "steered";
            rows.iter().filter(move |row| row.method == method && row.tip_apart_mm.is_some() == straight)
        };
        let arrived = own().filter(|row| row.success).count();
        lines.push(format!("{method}, {how}: {arrived} of {} targets reached", own().count()));
    }
    lines.join("\n")
}
