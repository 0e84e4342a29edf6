//! `endowire vessel`: surfaces of vessels, checked and made.

use std::path::Path;

use endowire_core::vessel::{CentrelineTree, CheckReport, GeneratedWall, Resolution, SurfaceMesh, anatomy};
use serde::Serialize;

use crate::failure::Failure;
use crate::output::print_json;
use crate::output::provenance::{Provenance, read_input};

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    #[serde(flatten)]
    report: CheckReport,
}

/// Reports on a surface file.
pub(crate) fn check(file: &Path, unit_mm: f64, json: bool) -> Result<(), Failure> {
    let report = check_file(file, unit_mm)?;
    let provenance = Provenance::new(&[&read_input(file)?], 0);
    tell(report, provenance, json)
}

fn check_file(file: &Path, unit_mm: f64) -> Result<CheckReport, Failure> {
    let surface = SurfaceMesh::read(file, unit_mm)?;
    check::check(&surface).map_err(|e| Failure::from(e).at(file.display()))
}

/// Builds a wall from a tree, writes it, and reports on what was written.
pub(crate) fn generate(tree: &Path, out: &Path, edge_mm: Option<f64>, json: bool) -> Result<(), Failure> {
    let built_in = tree.to_str().filter(|_| !tree.exists()).and_then(anatomy::tree);
    let (centreline, provenance) = match built_in {
        Some(centreline) => (centreline, Provenance::of_program(&tree.display().to_string())),
        None => (CentrelineTree::read(tree)?, Provenance::new(&[&read_input(tree)?], 0)),
    };
    generate_wall(&centreline, edge_mm).map_err(|e| Failure::from(e).at(tree.display()))?.write(out)?;
    tell(check_file(out, 1.0)?, provenance, json)
}

fn tell(report: CheckReport, provenance: Provenance, json: bool) -> Result<(), Failure> {
    if json {
        print_json(&Document { provenance, report })
    } else {
        print!("{report}");
        Ok(())
    }
}
