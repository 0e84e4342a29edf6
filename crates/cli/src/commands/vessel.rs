//! `endowire vessel`: surfaces of vessels, checked and made.

use std::path::Path;

use endowire_core::vessel::{
    CentrelineTree, CheckReport, GeneratedWall, Resolution, SurfaceMesh, anatomy, check,
};
use serde::Serialize;

use crate::args::GenerateArgs;
use crate::failure::Failure;
use crate::output::print_json;
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
    tell(file, unit_mm, provenance, json)
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
    let generated =
        GeneratedWall::new(&tree, resolution).map_err(|e| Failure::from(e).at(args.tree.display()))?;
    generated.wall.mesh().write(&args.out)?;
    tell(&args.out, 1.0, provenance, args.json)
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

fn tell(file: &Path, unit_mm: f64, provenance: Provenance, json: bool) -> Result<(), Failure> {
    let surface = SurfaceMesh::read(file, unit_mm)?;
    let report = check(&surface).map_err(|e| Failure::from(e).at(file.display()))?;
    let document =
        Document { provenance, file: file.display().to_string(), sound: report.is_sound(), report };
    if json {
        return print_json(&document);
    }
    print_report(&document);
    Ok(())
}

fn print_report(document: &Document) {
    let r = &document.report;
    let size: Vec<String> = (0..3).map(|k| format!("{:.1}", r.high_mm[k] - r.low_mm[k])).collect();
    let verdict =
        if document.sound { "sound" } else { "faulty: it is repaired on loading as far as possible" };
    println!("{}: {verdict}", document.file);
    println!("  triangles            {}", r.triangles);
    println!("  vertices             {} ({} duplicates welded)", r.vertices, r.duplicate_vertices);
    println!("  pieces               {}", r.components);
    println!("  size                 {} mm", size.join(" × "));
    println!("  enclosed volume      {:.2} mm³", r.volume_mm3);
    println!("  area                 {:.2} mm²", r.area_mm2);
    println!(
        "  edges                {:.3} to {:.3} mm, median {:.3} mm",
        r.edge_min_mm, r.edge_max_mm, r.edge_median_mm
    );
    println!(
        "  watertight           {}",
        if r.watertight { "yes".to_owned() } else { format!("no: {} open edges", r.open_edges) }
    );
    for opening in &r.openings {
        let [x, y, z] = opening.centre_mm;
        let [u, v, w] = opening.direction;
        println!(
            "    opening {:<3}        radius {:.2} mm at [{x:.2}, {y:.2}, {z:.2}], outward [{u:.2}, {v:.2}, {w:.2}], {} edges",
            opening.index, opening.radius_mm, opening.edges
        );
    }
    println!("  stray open edges     {}", r.stray_edges);
    println!("  non-manifold edges   {}", r.non_manifold_edges);
    println!(
        "  flipped triangles    {}{}",
        r.flipped_triangles,
        if r.inside_out { " (the surface is inside out)" } else { "" }
    );
    println!("  degenerate triangles {}", r.degenerate_triangles);
    println!("  duplicate triangles  {}", r.duplicate_triangles);
    println!("  self-intersections   {}", r.self_intersections);
    for [a, b] in &r.intersecting_pairs {
        println!("    triangles {a} and {b}");
    }
}
