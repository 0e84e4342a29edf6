//! `endowire vessel`: surfaces of vessels, checked and made.

use std::path::Path;

use endowire_core::Error;
use endowire_core::vessel::{
    CentrelineTree, CheckReport, GeneratedWall, Resolution, SurfaceMesh, anatomy, check,
};
use serde::Serialize;

use crate::args::GenerateArgs;
use crate::failure::Failure;
use crate::output::answer;
use crate::output::provenance::{Provenance, read_input};

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    file: String,
    sound: bool,
    #[serde(flatten)]
    report: CheckReport,
}

/// Reports on a surface file.
pub(crate) fn check_file(file: &Path, unit_mm: f64, json: bool) -> Result<(), Failure> {
    let provenance = Provenance::new(&[&read_input(file)?], 0);
    report_on(file, unit_mm, provenance, json)
}

/// Builds a wall from a tree, writes it, and reports on what was written.
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
    report_on(&args.out, 1.0, provenance, args.json)
}

/// Calls what the core calls by its field by the flag of the command line.
fn as_flag(error: Error) -> Failure {
    Failure::from(match error {
        Error::Parameter { name, value, mend } if name == "edge_mm" || name == "triangles" => {
            Error::Parameter { name: format!("--{}", name.replace('_', "-")), value, mend }
        }
        other => other,
    })
}

/// Reminds of the built-in anatomies where a tree file is missing.
fn built_ins(failure: Failure) -> Failure {
    match failure {
        Failure::Input(text) => {
            Failure::Input(format!("{text} (built-in anatomies: {})", anatomy::NAMES.join(", ")))
        }
        other => other,
    }
}

fn report_on(file: &Path, unit_mm: f64, provenance: Provenance, json: bool) -> Result<(), Failure> {
    let surface = SurfaceMesh::read(file, unit_mm)?;
    let report = check(&surface).map_err(|e| Failure::from(e).at(file.display()))?;
    let document =
        Document { provenance, file: file.display().to_string(), sound: report.is_sound(), report };
    answer(&document, json, || text(&document))
}

/// Openings that the report for a person lists.
const OPENINGS_LISTED: usize = 20;

/// The report for a person.
fn text(document: &Document) -> String {
    let r = &document.report;
    let size: Vec<String> = (0..3).map(|k| format!("{:.1}", r.high_mm[k] - r.low_mm[k])).collect();
    let verdict =
        if document.sound { "sound" } else { "faulty: it is repaired on loading as far as possible" };
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
            "    opening {:<3}        radius {:.2} mm at [{x:.2}, {y:.2}, {z:.2}], outward [{u:.2}, {v:.2}, {w:.2}], {} edges",
            opening.index, opening.radius_mm, opening.edges
        ));
    }
    if r.openings.len() > OPENINGS_LISTED {
        lines.push(format!("    … and {} more openings", r.openings.len() - OPENINGS_LISTED));
    }
    let inside_out = if r.inside_out { " (the surface is inside out)" } else { "" };
    let at_least = if r.self_intersections_capped { "at least " } else { "" };
    lines.extend([
        format!("  stray open edges     {}", r.stray_edges),
        format!("  non-manifold edges   {}", r.non_manifold_edges),
        format!("  flipped triangles    {}{inside_out}", r.flipped_triangles),
        format!("  degenerate triangles {}", r.degenerate_triangles),
        format!("  duplicate triangles  {}", r.duplicate_triangles),
        format!("  self-intersections   {at_least}{}", r.self_intersections),
    ]);
    lines.extend(r.intersecting_pairs.iter().map(|[a, b]| format!("    triangles {a} and {b}")));
    lines.join("\n")
}

/// Yes, or which edges stand against it.
fn watertight(report: &CheckReport) -> String {
    let causes: Vec<String> =
        [(report.open_edges, "open edges"), (report.non_manifold_edges, "edges of more than two triangles")]
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
    if causes.is_empty() { "yes".to_owned() } else { format!("no: {}", causes.join(", ")) }
}
