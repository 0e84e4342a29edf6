//! `endowire experiment coil`: packing the sac of an aneurysm with coils.
//!
//! A microcatheter lies in a sac, and coils are pushed out of it and detached one after another: first a framing
//! coil, then softer ones with smaller loops that fill and finish the sac. The vessel is the built-in side-wall
//! aneurysm, scaled to the requested volume of the sac. The experiment measures packing density against length, push
//! force, kick-back of the catheter, and loops outside the neck. Lamano et al., Int. J. CARS 9 (2014), measured push
//! forces: largest for framing coils, smallest for finishing coils.

use std::path::{Path, PathBuf};
use std::time::Instant;

use endowire_core::Vec3;
use endowire_core::device::{Device, DeviceFile, Instrument, Section, Stack};
use endowire_core::file::InMemory;
use endowire_core::insertion::{Command, Move, Packing, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution, Sac, anatomy};
use serde::Serialize;

use super::lines::{Line, Lines};
use crate::args::{CoilArgs, CoilKind};
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress};

/// Volume of the sac of the anatomy, mm³ (`endowire vessel sac`), its centre, the artery beside it, and the position
/// of the catheter's tip, mm.
const SAC_MM3: f64 = 178.4;
const DOME_MM: [f64; 3] = [2.0, 5.81, 36.0];
const ARTERY_MM: [f64; 3] = [2.0, 0.0, 36.0];
const TIP_MM: [f64; 3] = [2.0, 4.4, 36.4];
/// Diameter of the largest inscribed sphere, and edge length of its triangles, mm.
const BALL_MM: f64 = 6.9;
const EDGE_MM: f64 = 0.5;
/// Modulus of the wall, N/mm².
const MODULUS_N_PER_MM2: f64 = 1.0;
/// A 1.7 F microcatheter with a very soft end: outer and inner radius, mm, and bending stiffness, N·mm².
const CATHETER: (f64, f64, f64) = (0.28, 0.2, 0.8);
/// Length of a coil's pusher, longer than any way here, mm.
const PUSHER_MM: f64 = 60.0;
/// Distance beyond the catheter's tip to which the end of a coil is pushed, mm.
const BEYOND_MM: f64 = 0.6;
/// Smallest and largest volume of a sac, mm³.
const SACS_MM3: (f64, f64) = (5.0, 2000.0);
/// Smallest and largest height of the catheter's tip, as fractions of the sac's.
const TIP_HEIGHTS: (f64, f64) = (0.1, 0.8);
/// Largest number of coils: instruments of a stack, less the catheter.
const MOST_COILS: usize = 15;

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

/// Pushes, detaches and measures coil by coil.
pub(super) fn coil(args: &CoilArgs) -> Result<(), Failure> {
    check(args)?;
    let (mut simulation, sac) = begin(args)?;
    let bar = progress::bar(steps(args) * args.coils.len(), "step");
    let (mut rows, mut largest_void_mm, mut failure) = (Vec::new(), Vec::new(), None);
    let started = Instant::now();
    for number in 0..args.coils.len() {
        let mut reported = |row: Row| {
            rows.push(row);
            bar.inc(1);
        };
        let done = push((args, number), &mut simulation, &sac, &started, &mut reported);
        let void = done.and_then(|()| Packing::largest_void_mm(&simulation, &sac));
        match void {
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
    let document = Document { provenance, sac, rows, largest_void_mm, frames, failure };
    if let Some(folder) = &args.out {
        super::write(folder, "coil", &document.rows, &document)?;
    }
    answer(&document, args.json, || table(args, &document))?;
    document.failure.map_or(Ok(()), |reason| Err(Failure::Computation(reason)))
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

fn check(args: &CoilArgs) -> Result<(), Failure> {
    let within = |flag: &str, value: f64, (low, high): (f64, f64)| {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        Err(Failure::Input(format!("{flag} {value}: give a number from {low} to {high}")))
    };
    within("--volume-mm3", args.volume_mm3, SACS_MM3)?;
    within("--length-mm", args.length_mm, (1.0, 1000.0))?;
    within("--step-mm", args.step_mm, (0.05, 5.0))?;
    within("--element-mm", args.element_mm, (0.1, 2.0))?;
    within("--friction", args.friction, (0.0, 2.0))?;
    within("--self-friction", args.self_friction, (0.0, 2.0))?;
    args.tip_height.map_or(Ok(()), |height| within("--tip-height", height, TIP_HEIGHTS))?;
    if args.coils.is_empty() || args.coils.len() > MOST_COILS {
        return Err(Failure::Input(format!("--coils: give 1 to {MOST_COILS}")));
    }
    let most_mm3 = args.coils.iter().map(|kind| kind.wound().0.powi(2)).sum::<f64>()
        * std::f64::consts::FRAC_PI_4
        * args.length_mm;
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

/// Largest packing density that was ever reached.
const MOST_PACKING: f64 = 0.5;

impl CoilKind {
    /// Outer diameter and diameter of the stock wire, mm, and diameter of the loops relative to that of the sac.
    fn wound(self) -> (f64, f64, f64) {
        match self {
            Self::Framing => (0.3175, 0.0508, 0.9),
            Self::Filling => (0.254, 0.04445, 0.7),
            Self::Finishing => (0.254, 0.03175, 0.45),
        }
    }

    /// A coil of this length for a sac of this diameter, mm.
    fn device(self, length_mm: f64, sac_mm: f64) -> endowire_core::Result<Device> {
        let (diameter_mm, wire_mm, loops) = self.wound();
        let loop_mm = loops * sac_mm;
        let secondary = match self {
            Self::Framing => {
                format!(
                    "{{ shape = \"complex\", diameter_mm = {loop_mm}, tilt_deg = 60.0, turn_deg = 50.0 }}"
                )
            }
            _ => format!("{{ shape = \"helix\", diameter_mm = {loop_mm}, pitch_mm = 0.5 }}"),
        };
        let text = format!(
            "kind = \"coil\"\n[[part]]\nname = \"coil\"\nlength_mm = {length_mm}\nouter_diameter_mm = {diameter_mm}\n\
             winding = {{ wire_diameter_mm = {wire_mm}, modulus_gpa = 170.0, poisson_ratio = 0.38 }}\nsecondary = {secondary}\n\
             [[part]]\nname = \"pusher\"\nlength_mm = {PUSHER_MM}\nouter_diameter_mm = {diameter_mm}\nbending_stiffness_nmm2 = 0.5\n"
        );
        let path = PathBuf::from("coil.toml");
        let files = InMemory([(path.clone(), text.into_bytes())].into());
        Ok(DeviceFile::read_of(&files, &path)?.device)
    }
}

/// Name of a coil.
fn name(args: &CoilArgs, number: usize) -> String {
    format!("{} {}", number + 1, args.coils[number].name())
}

/// Scale factor of the vessel relative to the anatomy.
fn scale(args: &CoilArgs) -> f64 {
    (args.volume_mm3 / SAC_MM3).cbrt()
}

/// Number of steps per coil.
fn steps(args: &CoilArgs) -> usize {
    ((args.length_mm + BEYOND_MM) / args.step_mm).ceil() as usize
}

/// The vessel with the catheter in the sac, and the sac.
fn begin(args: &CoilArgs) -> Result<(Simulation, Sac), Failure> {
    let by = scale(args);
    let tree = anatomy::tree("sidewall_aneurysm")
        .ok_or_else(|| Failure::Input("no sidewall_aneurysm".to_owned()))?;
    let nodes = tree.nodes().iter().map(|node| CentrelineNode {
        position_mm: node.position_mm * by,
        radius_mm: node.radius_mm * by,
        parent: node.parent,
    });
    let scaled = CentrelineTree::new(nodes.collect())?.with_closed_ends(tree.closed_ends().to_vec())?;
    let generated = GeneratedWall::new(&scaled, Resolution::EdgeMm(EDGE_MM * by))?;
    let place = |[x, y, z]: [f64; 3]| Vec3::new(x, y, z) * by;
    let sac = Sac::measure(&generated.wall, place(DOME_MM), place(ARTERY_MM))?;
    let mouth = place(ARTERY_MM);
    let sheath = Sheath::new(mouth, place(TIP_MM) - mouth)?;
    let way_mm = match args.tip_height {
        Some(height) => {
            let above_mm = height * sac.height_mm + (sac.neck_mm - mouth).dot(&sac.normal);
            above_mm / sheath.direction.dot(&sac.normal)
        }
        None => (place(TIP_MM) - mouth).norm(),
    };
    let mut instruments = Vec::new();
    for (number, kind) in args.coils.iter().enumerate() {
        let device = kind.device(args.length_mm, BALL_MM * by)?;
        instruments.push(Instrument { name: name(args, number), device, may_lead: true });
    }
    let (radius_mm, lumen_mm, stiffness_nmm2) = CATHETER;
    let section =
        Section { inner_radius_mm: Some(lumen_mm), ..Section::straight(50.0, radius_mm, stiffness_nmm2) };
    let catheter = Device::new(vec![section])?;
    instruments.push(Instrument { name: "microcatheter".to_owned(), device: catheter, may_lead: true });
    let method = KirchhoffOptions {
        element_mm: args.element_mm,
        tolerance: 1e-6,
        self_contact: true,
        self_friction: args.self_friction,
        ..KirchhoffOptions::default()
    };
    let properties = WallProperties {
        modulus_n_per_mm2: MODULUS_N_PER_MM2,
        friction: args.friction,
        ..WallProperties::default()
    };
    let builder = Simulation::builder(generated.wall, Stack::new(instruments)?, sheath);
    let mut simulation = builder.properties(properties).method(&method).build()?;
    let count = (way_mm / args.step_mm).ceil();
    for _ in 0..count as usize {
        let command = Command::advance(way_mm / count);
        simulation.step_together(&[Move { instrument: args.coils.len(), command }])?;
    }
    Ok((simulation, sac))
}

/// Pushes a coil through the catheter and out, records each step, and detaches the coil.
fn push(
    (args, number): (&CoilArgs, usize),
    simulation: &mut Simulation,
    sac: &Sac,
    started: &Instant,
    reported: &mut impl FnMut(Row),
) -> endowire_core::Result<()> {
    let catheter = args.coils.len();
    let tip = |simulation: &Simulation| simulation.tip_of_mm(catheter).unwrap_or_default();
    let (rests_at, name) = (tip(simulation), name(args, number));
    let covered_mm = simulation.report().lengths_mm()[catheter];
    let count = steps(args);
    let moved = |simulation: &mut Simulation, advance_mm: f64| {
        let command = Command::advance(advance_mm);
        simulation.step_together(&[Move { instrument: number, command }]).map(drop)
    };
    // Within the catheter it touches nothing, so that one step suffices.
    moved(simulation, covered_mm)?;
    for _ in 0..count {
        moved(simulation, (args.length_mm + BEYOND_MM) / count as f64)?;
        let (report, packing) = (simulation.report(), Packing::of(simulation, sac)?);
        let touching = simulation.touching();
        let deepest_mm = touching.iter().map(|touch| touch.penetration_mm);
        let is_crossed = |touch: &&endowire_core::contact::Touching| {
            let [a, b] = touch.positions_mm;
            (a - b).norm() < touch.penetration_mm
        };
        reported(Row {
            coil: name.clone(),
            inserted_mm: report.lengths_mm()[number] - covered_mm,
            packing: packing.density,
            push_force_n: report.hand(number).push_force_n.unwrap_or(f64::NAN),
            catheter_force_n: report.hand(catheter).push_force_n,
            kick_back_mm: (tip(simulation) - rests_at).norm(),
            dome_force_n: packing.dome_force_n,
            neck_coverage: packing.neck_coverage,
            outside_mm: packing.outside_mm,
            herniated: packing.herniated,
            max_penetration_mm: deepest_mm.fold(report.max_penetration_mm, f64::max),
            crossings: touching.iter().filter(is_crossed).count(),
            jumped: report.jumped,
            converged: report.converged,
            time_s: started.elapsed().as_secs_f64(),
        });
    }
    simulation.detach(number).map(drop)
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
