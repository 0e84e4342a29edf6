//! `endowire vessel sac`: the sac of an aneurysm.

use endowire_core::vessel::{ExtractedCentreline, Sac, SurfaceMesh, Wall};
use endowire_core::{Error, Vec3};
use serde::Serialize;

use crate::args::SacArgs;
use crate::failure::Failure;
use crate::output::answer;
use crate::output::provenance::{Provenance, read_input};

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    file: String,
    #[serde(flatten)]
    sac: Sac,
}

/// Measures the sac of a surface file.
pub(crate) fn sac(args: &SacArgs) -> Result<(), Failure> {
    let provenance = Provenance::new(&[&read_input(&args.file)?], 0);
    let wall = Wall::from_surface(&SurfaceMesh::read(&args.file, args.frame)?)?;
    let at_file = |error: Error| as_flag(error).at(args.file.display());
    let sac = match args.parent {
        Some(parent_mm) => Sac::measure(&wall, args.dome, parent_mm).map_err(at_file)?,
        None => {
            let line = ExtractedCentreline::of(&wall, None, &[]).map_err(at_file)?.tree;
            Sac::on_artery(&wall, args.dome, &line).map_err(at_file)?
        }
    };
    let document = Document { provenance, file: args.file.display().to_string(), sac };
    answer(&document, args.json, || text(&document))
}

/// Replaces the core's names in an error by the flags of the command line. A surface without two openings has no centre
/// line that says where the artery is.
fn as_flag(error: Error) -> Failure {
    Failure::from(match error {
        Error::Parameter { name, value, .. } if ["from", "to"].contains(&name.as_str()) => {
            let remedy = "no centre line is found between two openings, by which the artery would be known: give a place in the artery";
            Error::parameter("--parent", value, remedy)
        }
        Error::Parameter { name, value, remedy } if ["dome", "parent"].contains(&name.as_str()) => {
            Error::Parameter { name: format!("--{name}"), value, remedy }
        }
        other => other,
    })
}

fn text(Document { file, sac, .. }: &Document) -> String {
    let vector = |v: &Vec3| format!("({:.2}, {:.2}, {:.2})", v.x, v.y, v.z);
    let rows = [
        ("volume", format!("{:.1} mm³", sac.volume_mm3)),
        ("neck", format!("{:.2} mm wide, {:.2} mm²", sac.neck_diameter_mm, sac.neck_area_mm2)),
        ("neck at", format!("{} mm, into the sac along {}", vector(&sac.neck_mm), vector(&sac.normal))),
        ("height", format!("{:.2} mm, {:.2} times the neck's width", sac.height_mm, sac.aspect_ratio)),
        ("largest ball", format!("{:.2} mm", sac.dome_diameter_mm)),
    ];
    let lines = rows.iter().map(|(name, value)| format!("  {name:<14} {value}"));
    std::iter::once(format!("{file}: a sac")).chain(lines).collect::<Vec<_>>().join("\n")
}
