//! `endowire experiment navigation`: what [`endowire_lab::experiment::navigation`] measures, drawn and written.

use std::path::{Path, PathBuf};

use endowire_core::vessel::{GeneratedWall, Resolution};
use endowire_lab::experiment::catalogue;
use endowire_lab::experiment::navigation::{self as experiment, ANATOMIES, Anatomy, Row, Straight};
use endowire_lab::studies::targets;
use endowire_viewer::{CArmSpec, ViewSpec, XRaySpec};
use serde::Serialize;

use super::camera::Camera;
use crate::args::NavigationArgs;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress};

/// Number of commands between frames.
const FRAME_EVERY: usize = 50;

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
        let tree = experiment::built_in(anatomy.name)?;
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
            for (row, simulation) in straight.rows(of_target, &path) {
                if let Some(folder) = args.out.as_deref().filter(|_| row.success) {
                    let mut camera =
                        self::camera(folder, anatomy, &format!("{target}_{}", row.method), &made)?;
                    camera.take(simulation)?;
                    frames.extend(camera.frames);
                }
                rows.push(row);
            }
            let mut number = 0;
            let (row, simulation) =
                experiment::steer::<Failure>(anatomy, target, &path, &made, |simulation| {
                    number += 1;
                    match camera.as_mut().filter(|_| number % FRAME_EVERY == 0) {
                        Some(camera) => camera.take(simulation),
                        None => Ok(()),
                    }
                })?;
            rows.push(row);
            if let Some(mut camera) = camera {
                camera.take(&simulation)?;
                frames.extend(camera.frames);
            }
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
        let tree = experiment::built_in(procedure.anatomy)?;
        let simulation = experiment::begin(procedure, &tree, folder)?;
        for target in procedure.targets.iter().filter(|name| args.wants(name)) {
            bar.set_message(format!("{}: {target}", procedure.anatomy));
            rows.push(experiment::carry_out(procedure, target, &tree, simulation.clone())?);
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    publish(args, rows, Vec::new())
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

/// A camera for one target.
fn camera(folder: &Path, anatomy: &Anatomy, target: &str, made: &GeneratedWall) -> Result<Camera, Failure> {
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
