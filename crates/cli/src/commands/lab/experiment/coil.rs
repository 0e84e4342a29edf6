//! `endowire experiment coil`: packing the sac of an aneurysm with coils.
//!
//! A microcatheter lies in a sac, and coils are pushed out of it and detached one after another: first a framing
//! coil, then softer ones with smaller loops that fill and finish the sac ([`endowire_lab::bench::coil`]). The
//! experiment measures packing density against length, push force, kick-back of the catheter, and loops outside the
//! neck.

use std::path::{Path, PathBuf};
use std::time::Instant;

use endowire_core::insertion::Packing;
use endowire_core::vessel::Sac;
use endowire_lab::bench::coil::{CoilReading, CoilTest, Deployment, MOST_PACKING};
use serde::Serialize;

use super::lines::{Line, Lines};
use crate::args::CoilArgs;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress};

/// Distance beyond the catheter's tip to which the end of a coil is pushed, mm.
const BEYOND_MM: f64 = 0.6;

#[derive(Debug, Serialize)]
struct Row {
    /// Number and kind of the coil.
    coil: String,
    inserted_mm: f64,
    /// Packing density.
    packing: f64,
    /// Push force on the coil.
    push_force_n: f64,
    /// Push force on the catheter; `None` where it jumps.
    catheter_force_n: Option<f64>,
    /// Distance of the catheter's tip from its position before this coil.
    kick_back_mm: f64,
    dome_force_n: f64,
    neck_coverage: f64,
    outside_mm: f64,
    herniated: bool,
    /// Largest penetration of loops into each other or into the wall.
    max_penetration_mm: f64,
    /// Number of places where axes are closer than half the touching distance.
    crossings: usize,
    jumped: bool,
    converged: bool,
    /// Time since the start.
    time_s: f64,
}

#[derive(Debug, Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    sac: Sac,
    rows: Vec<Row>,
    /// One per detached coil.
    largest_void_mm: Vec<f64>,
    frames: Vec<PathBuf>,
    /// Why the run ended early, if it did.
    failure: Option<String>,
}

impl Row {
    fn new(coil: String, reading: &CoilReading, time_s: f64) -> Self {
        let CoilReading { packing, .. } = reading;
        Self {
            coil,
            inserted_mm: reading.inserted_mm,
            packing: packing.density,
            push_force_n: reading.push_force_n,
            catheter_force_n: reading.catheter_force_n,
            kick_back_mm: reading.kick_back_mm,
            dome_force_n: packing.dome_force_n,
            neck_coverage: packing.neck_coverage,
            outside_mm: packing.outside_mm,
            herniated: packing.herniated,
            max_penetration_mm: reading.max_penetration_mm,
            crossings: reading.crossings,
            jumped: reading.jumped,
            converged: reading.converged,
            time_s,
        }
    }
}

/// Pushes, detaches and measures coil by coil.
pub(super) fn coil(args: &CoilArgs) -> Result<(), Failure> {
    let test = test(args);
    check(args, &test)?;
    let coils: Vec<_> =
        args.coils.iter().enumerate().map(|(number, kind)| (name(args, number), kind.wound())).collect();
    let mut deployment = test.begin(&coils)?;
    let bar = progress::bar(steps(args) * args.coils.len(), "step");
    let (mut rows, mut largest_void_mm, mut failure) = (Vec::new(), Vec::new(), None);
    let started = Instant::now();
    for number in 0..args.coils.len() {
        let mut read = |reading| {
            rows.push(Row::new(name(args, number), &reading, started.elapsed().as_secs_f64()));
            bar.inc(1);
        };
        let pushed = deployment.push(number, args.length_mm + BEYOND_MM, &mut read);
        match pushed.and_then(|()| left_behind(&mut deployment, number)) {
            Ok(mm) => largest_void_mm.push(mm),
            Err(error) => {
                failure = Some(format!("{}: {error}", name(args, number)));
                break;
            }
        }
    }
    bar.finish_and_clear();
    let provenance = Provenance::of_program(&arguments(args));
    let frames = args.out.as_deref().map_or_else(|| Ok(Vec::new()), |folder| picture(args, &rows, folder))?;
    let document = Document { provenance, sac: deployment.sac, rows, largest_void_mm, frames, failure };
    if let Some(folder) = &args.out {
        super::write(folder, "coil", &document.rows, &document)?;
    }
    answer(&document, args.json, || table(args, &document))?;
    document.failure.map_or(Ok(()), |reason| Err(Failure::Computation(reason)))
}

/// Detaches a coil, and returns the diameter of the largest void, mm.
fn left_behind(deployment: &mut Deployment, number: usize) -> endowire_core::Result<f64> {
    let Deployment { simulation, sac, .. } = deployment;
    simulation.detach(number)?;
    Packing::largest_void_mm(simulation, sac)
}

/// The settings without the coils.
fn test(args: &CoilArgs) -> CoilTest {
    let CoilArgs { volume_mm3, length_mm, step_mm, element_mm, friction, self_friction, tip_height, .. } =
        *args;
    CoilTest { volume_mm3, length_mm, step_mm, element_mm, friction, self_friction, tip_height }
}

/// All that the result depends on.
fn arguments(args: &CoilArgs) -> String {
    let CoilArgs {
        coils,
        volume_mm3,
        length_mm,
        step_mm,
        element_mm,
        friction,
        self_friction,
        tip_height,
        ..
    } = args;
    format!(
        "experiment coil {coils:?} {volume_mm3} {length_mm} {step_mm} {element_mm} {friction} {self_friction} {tip_height:?}"
    )
}

fn check(args: &CoilArgs, test: &CoilTest) -> Result<(), Failure> {
    for (name, value, (low, high)) in test.ranges() {
        if !(low..=high).contains(&value) {
            let flag = name.replace('_', "-");
            return Err(Failure::Input(format!("--{flag} {value}: give a number from {low} to {high}")));
        }
    }
    if args.coils.is_empty() || args.coils.len() > CoilTest::MOST_COILS {
        return Err(Failure::Input(format!("--coils: give 1 to {}", CoilTest::MOST_COILS)));
    }
    let most_mm3: f64 = args.coils.iter().map(|kind| kind.wound().volume_mm3(args.length_mm)).sum();
    if most_mm3 > MOST_PACKING * args.volume_mm3 {
        return Err(Failure::Input(format!(
            "--length-mm {}: {} coils of it have {most_mm3:.1} mm³, and a sac of {} mm³ holds no more than {:.0} % of its volume: use shorter or \
             fewer coils",
            args.length_mm,
            args.coils.len(),
            args.volume_mm3,
            100.0 * MOST_PACKING
        )));
    }
    Ok(())
}

/// Name of a coil.
fn name(args: &CoilArgs, number: usize) -> String {
    format!("{} {}", number + 1, args.coils[number].name())
}

/// Number of steps per coil.
fn steps(args: &CoilArgs) -> usize {
    ((args.length_mm + BEYOND_MM) / args.step_mm).ceil() as usize
}

/// Draws packing density against the total length of coils.
fn picture(args: &CoilArgs, rows: &[Row], folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let line = |number: usize| {
        let (name, before_mm) = (name(args, number), args.length_mm * number as f64);
        let own = rows.iter().filter(|row| row.coil == name);
        let points = own.map(|row| (before_mm + row.inserted_mm, 100.0 * row.packing)).collect();
        Line { method: name, of: String::new(), points }
    };
    let lines = Lines {
        title: "coils in a sac: packing density",
        across: "length of coils, mm",
        up: "%",
        logarithmic: false,
        lines: (0..args.coils.len()).map(line).filter(|line| !line.points.is_empty()).collect(),
    };
    lines.write(folder, "coil")
}

/// The table as text, with a row for each coil.
fn table(args: &CoilArgs, document: &Document) -> String {
    let sac = &document.sac;
    let mut lines = vec![
        format!("a sac of {:.1} mm³ with a neck of {:.2} mm", sac.volume_mm3, sac.neck_diameter_mm),
        format!(
            "{:<14} {:>9} {:>9} {:>12} {:>12} {:>10} {:>8} {:>8} {:>9} {:>7}",
            "coil",
            "out mm",
            "packing",
            "push N mean",
            "push N most",
            "kick mm",
            "neck",
            "void mm",
            "outside",
            "time s"
        ),
    ];
    for number in 0..args.coils.len() {
        let name = name(args, number);
        let own: Vec<&Row> = document.rows.iter().filter(|row| row.coil == name).collect();
        let Some(last) = own.last() else { continue };
        let forces = own.iter().map(|row| row.push_force_n).filter(|n| n.is_finite());
        let most_n = forces.clone().fold(f64::MIN, f64::max);
        let mean_n = forces.clone().sum::<f64>() / forces.count().max(1) as f64;
        let kick_mm = own.iter().map(|row| row.kick_back_mm).fold(0.0, f64::max);
        let void =
            document.largest_void_mm.get(number).map_or_else(|| "–".to_owned(), |mm| format!("{mm:.2}"));
        lines.push(format!(
            "{name:<14} {:>9.1} {:>8.1}% {mean_n:>12.5} {most_n:>12.5} {kick_mm:>10.3} {:>7.0}% {void:>8} {:>9.1} {:>7.1}",
            last.inserted_mm,
            100.0 * last.packing,
            100.0 * last.neck_coverage,
            last.outside_mm,
            last.time_s
        ));
    }
    let lost = document.rows.iter().filter(|row| !row.converged).count();
    let jumps = document.rows.iter().filter(|row| row.jumped).count();
    let crossings: usize = document.rows.iter().map(|row| row.crossings).sum();
    let deepest_mm = document.rows.iter().map(|row| row.max_penetration_mm).fold(0.0, f64::max);
    lines.push(format!(
        "{} steps: {jumps} jumps, {lost} without an equilibrium, {crossings} crossings, deepest {deepest_mm:.4} mm",
        document.rows.len()
    ));
    lines.extend(document.failure.clone());
    lines.join("\n")
}
