//! `endowire experiment navigation`: the paper's experiment 2, figure 3.
//!
//! A straight wire is pushed into the aortic arch and the hepatic arteries by the paper's method and by ours
//! ([`Straight`]). A shaped wire is steered by our method to every named target by a controller that
//! follows the centre line ([`FollowPath`]). With `--catalogue`, several instruments of the catalogue are steered by
//! controllers that follow or search ([`catalogue`](super::catalogue)).

use std::path::Path;
use std::time::Instant;

use endowire_core::control::{Controller, FollowPath, Outcome, Team, drive};
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{CentrelinePath, CentrelineTree, GeneratedWall, anatomy};
use endowire_core::{Error, Result};
use serde::Serialize;

pub use super::straight::Straight;

use super::catalogue::Procedure;
use crate::compare::candidate;
use crate::studies::{ARCH_TARGETS, HEPATIC_TARGETS};

/// An anatomy, its targets in the order of their rows in the centre-line table, and the properties of its wall and
/// wire.
#[derive(Debug)]
pub struct Anatomy {
    /// Its name.
    pub name: &'static str,
    /// Targets.
    pub targets: &'static [&'static str],
    /// Edge length of the wall's triangles, mm.
    pub edge_mm: f64,
    pub(super) radius_mm: f64,
    tip_curvature_per_mm: f64,
    pub(super) tip_mm: f64,
    /// Angle of the C-arm for pictures, degrees.
    pub primary_deg: f64,
}

/// Both anatomies.
pub const ANATOMIES: [Anatomy; 2] = [
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
/// What an insertion has reached.
#[derive(Debug, Serialize)]
pub struct Row {
    /// The anatomy.
    pub anatomy: &'static str,
    /// The target.
    pub target: &'static str,
    /// The method.
    pub method: &'static str,
    /// Whether it has arrived.
    pub success: bool,
    /// Commands it took.
    pub commands: usize,
    /// Number of times the wire was pulled back.
    pub retries: usize,
    /// Length of the way, mm.
    pub path_mm: f64,
    /// Inserted length, mm.
    pub inserted_mm: f64,
    /// Distance of the tip from the end of the way, mm.
    pub from_target_mm: f64,
    /// Largest force of the hand, N.
    pub largest_push_n: f64,
    /// Largest sum of contact forces, N.
    pub largest_wall_force_n: f64,
    /// Largest penetration into the wall, mm.
    pub largest_penetration_mm: f64,
    /// Number of steps that failed the method's own convergence test.
    pub unconverged: usize,
    /// For straight wires: distance between the tips of both methods when the first of them leaves the vessel, mm.
    pub tip_apart_mm: Option<f64>,
    /// The largest distance before, mm.
    pub largest_tip_apart_mm: Option<f64>,
    /// Time of steps and controller, without frames, s.
    pub time_s: f64,
    /// Why it ended, if it did not arrive.
    pub note: String,
    /// The steered instruments.
    pub instruments: String,
}

/// A built-in anatomy by its name.
///
/// # Errors
/// A name that is not built in.
pub fn built_in(name: &str) -> Result<CentrelineTree> {
    anatomy::tree(name).ok_or_else(|| Error::parameter("anatomy", name, "is not built in"))
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
    fn drive<E: From<Error>>(
        &mut self,
        simulation: &mut Simulation,
        hand: &mut dyn Controller,
        mut seen: impl FnMut(&Simulation) -> std::result::Result<(), E>,
    ) -> std::result::Result<bool, E> {
        let (clock, mut drawing_s) = (Instant::now(), 0.0);
        let left = COMMANDS.saturating_sub(self.commands);
        let outcome = drive::<E>(simulation, hand, left, |simulation, _| {
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

/// Steers a shaped wire to a target; `seen` gets the insertion after every command. The insertion at its end comes with the row.
///
/// # Errors
/// A wire that cannot be set up, and those of `seen`.
pub fn steer<E: From<Error>>(
    anatomy: &Anatomy,
    target: &'static str,
    path: &CentrelinePath,
    made: &GeneratedWall,
    seen: impl FnMut(&Simulation) -> std::result::Result<(), E>,
) -> std::result::Result<(Row, Simulation), E> {
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
    row.success = row.drive(&mut simulation, &mut hand, seen)?;
    row.end(&simulation, path);
    Ok((row, simulation))
}

/// The instruments of a procedure, outside the vessel.
///
/// # Errors
/// Devices that are not in `folder`.
pub fn begin(procedure: &Procedure, tree: &CentrelineTree, folder: &Path) -> Result<Simulation> {
    let made = GeneratedWall::new(tree, anatomy::asset_resolution(procedure.anatomy))?;
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0)?;
    let method = KirchhoffOptions { element_mm: procedure.element_mm, ..KirchhoffOptions::default() };
    Simulation::builder(made.wall, procedure.stack(folder)?, sheath).method(&method).build()
}

/// Carries out a procedure with the controllers of its stages, one after another.
///
/// # Errors
/// A target that the anatomy has not.
pub fn carry_out(
    procedure: &Procedure,
    target: &'static str,
    tree: &CentrelineTree,
    mut simulation: Simulation,
) -> Result<Row> {
    let path = tree.path_to(tree.target(target)?.row);
    let path = path.ok_or_else(|| Error::parameter("target", target, "is where the vessel begins"))?;
    let mut row = Row::new(procedure.anatomy, target, path.length_mm(), "kirchhoff", procedure.instruments());
    row.success = true;
    for (number, stage) in procedure.stages.iter().enumerate() {
        let Some(mut hand) = stage.controller(tree, target)? else { continue };
        if !row.drive(&mut simulation, &mut *hand, |_| Ok::<_, Error>(()))? {
            row.success = false;
            row.note = format!("part {} of {}: {}", number + 1, procedure.stages.len(), row.note);
            break;
        }
    }
    row.end(&simulation, &path);
    Ok(row)
}
