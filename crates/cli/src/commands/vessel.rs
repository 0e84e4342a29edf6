//! `endowire vessel`: checks and generates surfaces of vessels.

use std::path::Path;

use endowire_core::Error;
use endowire_core::vessel::{
    CentrelineTree, CheckReport, GeneratedWall, RepairOptions, Resolution, SurfaceFrame, SurfaceMesh,
    anatomy, check_repaired,
};
use serde::Serialize;

use super::felt::FeltReport;
use crate::args::{FeltArgs, GenerateArgs, RepairArgs};
use crate::failure::Failure;
use crate::output::answer;
use crate::output::provenance::{Provenance, read_input};

/// The report on a surface file.
#[derive(Serialize)]
pub(super) struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    file: String,
    sound: bool,
    /// Why it is not sound, a few words each.
    faults: Vec<String>,
    /// What is repaired on loading, a line each.
    repaired: Vec<String>,
    /// What is unusual and is kept.
    kept: Vec<String>,
    /// What is left to mend.
    needs_you: Vec<String>,
    #[serde(flatten)]
    report: CheckReport,
    #[serde(skip_serializing_if = "Option::is_none")]
    felt: Option<FeltReport>,
}

/// Reports on a surface file.
pub(crate) fn check_file(
    file: &Path,
    frame: SurfaceFrame,
    septum_mm: f64,
    repair: &RepairArgs,
    felt: &FeltArgs,
    json: bool,
) -> Result<(), Failure> {
    let provenance = Provenance::new(&[&read_input(file)?], 0);
    report_on(file, frame, septum_mm, repair, felt, provenance, json)
}

/// Generates a wall from a tree, writes it, and reports on the written file.
pub(crate) fn generate(args: &GenerateArgs) -> Result<(), Failure> {
    let built_in = args.tree.to_str().filter(|_| !args.tree.exists()).and_then(anatomy::tree);
    let (tree, provenance) = match built_in {
        Some(tree) => (tree, Provenance::of_program(&args.tree.display().to_string())),
        None => (
            CentrelineTree::read(&args.tree).map_err(|e| built_ins(e.into()))?,
            Provenance::new(&[&read_input(&args.tree)?], 0),
        ),
    };
    let resolution = match (args.edge_mm, args.triangles) {
        (Some(edge_mm), _) => Resolution::EdgeMm(edge_mm),
        (None, Some(triangles)) => Resolution::Triangles(triangles),
        (None, None) => Resolution::fitting(&tree),
    };
    let generated = GeneratedWall::new(&tree, resolution).map_err(|e| as_flag(e).at(args.tree.display()))?;
    generated.wall.mesh().write(&args.out)?;
    report_on(&args.out, 1.0.into(), 1.0, &RepairArgs::default(), &FeltArgs::default(), provenance, args.json)
}

/// Replaces the core's name of a parameter in an error by the flag of the command line.
fn as_flag(error: Error) -> Failure {
    Failure::from(match error {
        Error::Parameter { name, value, remedy } if name == "edge_mm" || name == "triangles" => {
            Error::Parameter { name: format!("--{}", name.replace('_', "-")), value, remedy }
        }
        other => other,
    })
}

/// Mentions the built-in anatomies in an error about a missing tree file.
fn built_ins(failure: Failure) -> Failure {
    match failure {
        Failure::Input(text) => {
            Failure::Input(format!("{text} (built-in anatomies: {})", anatomy::NAMES.join(", ")))
        }
        other => other,
    }
}

fn report_on(
    file: &Path,
    frame: SurfaceFrame,
    septum_mm: f64,
    repair: &RepairArgs,
    felt: &FeltArgs,
    provenance: Provenance,
    json: bool,
) -> Result<(), Failure> {
    let document = checked(file, frame, septum_mm, repair, felt, provenance)?;
    answer(&document, json, || text(&document))
}

/// The report on a surface file.
pub(super) fn checked(
    file: &Path,
    frame: SurfaceFrame,
    septum_mm: f64,
    repair: &RepairArgs,
    felt: &FeltArgs,
    provenance: Provenance,
) -> Result<Document, Failure> {
    let surface = SurfaceMesh::read(file, frame)?;
    let options = RepairOptions { mode: repair.repair, keep_open_mm: repair.keep_open_mm.clone() };
    let report =
        check_repaired(&surface, frame.unit_mm, septum_mm, &options).map_err(|error| match error {
            Error::Parameter { name, value, remedy } if name == "septum_mm" || name == "keep_open_mm" => {
                let flag = if name == "septum_mm" { "--septum-mm" } else { "--keep-open" };
                Failure::from(Error::Parameter { name: flag.to_owned(), value, remedy })
            }
            other => Failure::from(other).at(file.display()),
        })?;
    let felt = FeltReport::new(&surface, felt)?;
    let faults = report.faults();
    Ok(Document {
        provenance,
        file: file.display().to_string(),
        sound: faults.is_empty(),
        faults,
        repaired: report.repair.repaired(),
        kept: report.repair.kept(),
        needs_you: report.needs_you(),
        report,
        felt,
    })
}

/// Largest number of openings listed in the text report.
const OPENINGS_LISTED: usize = 20;

/// Largest number of pieces listed in the text report.
const PIECES_LISTED: usize = 20;

/// The report as text.
pub(super) fn text(document: &Document) -> String {
    let r = &document.report;
    let size: Vec<String> = (0..3).map(|k| format!("{:.1}", r.high_mm[k] - r.low_mm[k])).collect();
    let verdict = match (document.faults.join(", "), document.needs_you.is_empty()) {
        (faults, _) if faults.is_empty() => "sound".to_owned(),
        (faults, _) if r.flat => format!("faulty: {faults}: no device can be in it"),
        (faults, true) => format!("faulty: {faults}; it is repaired on loading, as told below"),
        (faults, false) => {
            format!("faulty: {faults}; loading does not mend all of it: see \"needs you\" below")
        }
    };
    let mut lines = vec![
        format!("{}: {verdict}", document.file),
        format!("  triangles            {}", r.triangles),
        format!("  vertices             {} ({} duplicates welded)", r.vertices, r.duplicate_vertices),
        format!("  pieces               {}", r.components),
        format!("  size                 {} mm", size.join(" × ")),
        format!("  enclosed volume      {:.2} mm³", r.volume_mm3),
        format!("  area                 {:.2} mm²", r.area_mm2),
        format!(
            "  edges                {:.3} to {:.3} mm, median {:.3} mm",
            r.edge_min_mm, r.edge_max_mm, r.edge_median_mm
        ),
        format!("  watertight           {}", watertight(r)),
    ];
    for opening in r.openings.iter().take(OPENINGS_LISTED) {
        let [x, y, z] = opening.centre_mm;
        let [u, v, w] = opening.direction;
        lines.push(format!(
            "    opening {:<3}        radius {:.2} mm at [{x:.2}, {y:.2}, {z:.2}], outward [{u:.2}, {v:.2}, {w:.2}], {} edges{}",
            opening.index,
            opening.radius_mm,
            opening.edges,
            if r.inlet == Some(opening.index) { "; devices come in here unless told" } else { "" }
        ));
    }
    if r.openings.len() > OPENINGS_LISTED {
        lines.push(format!("    … and {} more openings", r.openings.len() - OPENINGS_LISTED));
    }
    let inside_out = if r.inside_out { " (the surface is inside out)" } else { "" };
    let at_least = if r.self_intersections_capped { "at least " } else { "" };
    match r.rings {
        Some(0) => {}
        Some(count) => lines.push(format!("  rings                {count}: vessels meet again")),
        None => lines.push("  rings                not known: the wall does not close".to_owned()),
    }
    lines.extend([
        format!("  stray open edges     {}", r.stray_edges),
        format!("  non-manifold edges   {}", r.non_manifold_edges),
        format!("  flipped triangles    {}{inside_out}", r.flipped_triangles),
        format!("  degenerate triangles {}", r.degenerate_triangles),
        format!("  duplicate triangles  {}", r.duplicate_triangles),
        format!("  self-intersections   {at_least}{}", r.self_intersections),
    ]);
    lines.extend(r.intersecting_pairs.iter().map(|[a, b]| format!("    triangles {a} and {b}")));
    let headed = [
        ("repaired on loading:", &document.repaired),
        ("kept as it is:", &document.kept),
        ("needs you:", &document.needs_you),
    ];
    for (heading, told) in headed.into_iter().filter(|(_, told)| !told.is_empty()) {
        lines.push(heading.to_owned());
        lines.extend(told.iter().map(|line| format!("  {line}")));
    }
    lines.extend(simulated(r));
    lines.extend(document.felt.iter().flat_map(FeltReport::text));
    lines.extend(r.hints.iter().map(|hint| format!("  {hint}")));
    lines.join("\n")
}

/// Properties of the surface in the simulation.
fn simulated(r: &CheckReport) -> Vec<String> {
    let list = |v: &[f64; 3]| format!("[{:.2}, {:.2}, {:.2}]", v[0], v[1], v[2]);
    let mut lines = vec!["as it is simulated:".to_owned()];
    if let Some(lumen) = &r.survey.lumen {
        lines.push(format!(
            "  half of the lumen    {:.3} mm at {}; one place in a hundred below {:.3}, one in twenty below {:.3}, median {:.3}",
            lumen.smallest_mm,
            list(&lumen.smallest_at_mm),
            lumen.percentile_1_mm,
            lumen.percentile_5_mm,
            lumen.median_mm
        ));
    }
    for piece in r.pieces.iter().take(PIECES_LISTED) {
        let [x, y, z] = piece.size_mm;
        lines.push(format!(
            "  piece                {x:.1} × {y:.1} × {z:.1} mm, {} triangles; piece_at_mm = {}",
            piece.triangles,
            list(&piece.at_mm)
        ));
    }
    if r.pieces.len() > PIECES_LISTED {
        lines.push(format!("    … and {} more pieces", r.pieces.len() - PIECES_LISTED));
    }
    let septa = &r.survey.septa;
    let thinnest = septa
        .thinnest_mm
        .zip(septa.thinnest_at_mm.as_ref())
        .map_or_else(String::new, |(mm, at)| format!(", the thinnest {mm:.3} mm at {}", list(at)));
    lines.push(format!(
        "  septa below {:.1} mm   {} of {} triangles{thinnest}",
        septa.below_mm, septa.thin, septa.asked
    ));
    if let Some(start) = &r.survey.start {
        lines.push(format!(
            "  a place inside       {}, {:.2} mm from the wall; {:.1} mm are free along [{:.2}, {:.2}, {:.2}]",
            list(&start.position_mm),
            start.clearance_mm,
            start.free_mm,
            start.direction[0],
            start.direction[1],
            start.direction[2]
        ));
    }
    let contrast =
        if r.contrast { "with contrast medium" } else { "without contrast medium: the wall does not close" };
    lines.push(format!("  fluoroscopy          {contrast}"));
    lines
}

/// Yes, or the edges that prevent it.
fn watertight(report: &CheckReport) -> String {
    let causes: Vec<String> =
        [(report.open_edges, "open edges"), (report.non_manifold_edges, "edges of more than two triangles")]
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
    if causes.is_empty() { "yes".to_owned() } else { format!("no: {}", causes.join(", ")) }
}
