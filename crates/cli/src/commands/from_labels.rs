//! `endowire vessel from-labels`: a surface of a segmentation.

use endowire_core::Error;
use endowire_core::vessel::{EndKind, LabelOptions, LabelReport, LabelSurface};
use endowire_viewer::read_label_map;
use serde::Serialize;

use super::vessel;
use crate::args::{FeltArgs, FromLabelsArgs, RepairArgs};
use crate::failure::Failure;
use crate::output::provenance::{Provenance, read_input};
use crate::output::{answer, progress};

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    file: String,
    out: String,
    #[serde(flatten)]
    report: LabelReport,
    notes: Vec<String>,
    /// What `vessel check` says of the file that was written.
    check: vessel::Document,
}

/// Makes the surface, writes it, and reports on label map and written file.
pub(crate) fn from_labels(args: &FromLabelsArgs) -> Result<(), Failure> {
    let provenance = || Ok::<_, Failure>(Provenance::new(&[&read_input(&args.file)?], 0));
    let waiting = progress::waiting("reads the label map");
    let map = read_label_map(&args.file)?;
    waiting.set_message("makes a surface of it");
    let options = LabelOptions { labels: args.label.clone(), parts: args.parts, ends: args.ends };
    let surface = LabelSurface::of(&map, &options).map_err(|error| as_flag(error).at(args.file.display()))?;
    drop(map);
    surface.mesh.write(&args.out)?;
    waiting.set_message("checks the surface");
    let check = vessel::checked(
        &args.out,
        1.0.into(),
        1.0,
        &RepairArgs::default(),
        &FeltArgs::default(),
        provenance()?,
    )?;
    waiting.finish_and_clear();
    let document = Document {
        provenance: provenance()?,
        file: args.file.display().to_string(),
        out: args.out.display().to_string(),
        notes: surface.report.notes(),
        report: surface.report,
        check,
    };
    answer(&document, args.json, || text(&document))
}

/// Replaces the core's name of a parameter in an error by the flag of the command line.
fn as_flag(error: Error) -> Failure {
    Failure::from(match error {
        Error::Parameter { name, value, remedy } if name == "label" => {
            Error::Parameter { name: "--label".to_owned(), value, remedy }
        }
        other => other,
    })
}

/// The report as text.
fn text(document: &Document) -> String {
    let report = &document.report;
    let labels: Vec<String> =
        report.labels.iter().map(|(label, voxels)| format!("{label} ({voxels} voxels)")).collect();
    let sides: Vec<String> = report.voxel_mm.iter().map(|side| format!("{side:.3}")).collect();
    let mut lines = vec![
        format!("{}: a vessel of label {}", document.file, labels.join(" and ")),
        format!("  voxels               {} mm", sides.join(" × ")),
        format!(
            "  smoothing            within half a voxel; volume {:+.2} % of that of the voxels",
            100.0 * report.volume_error
        ),
    ];
    for end in &report.ends {
        let [x, y, z] = end.centre_mm;
        let kind = match end.kind {
            EndKind::Border => "at the picture's border",
            EndKind::Blunt => "within the picture",
        };
        let is_open = if end.direction.is_some() { "opened" } else { "left closed" };
        lines.push(format!(
            "  end {kind:<23} {is_open} at [{x:.2}, {y:.2}, {z:.2}], radius about {:.2} mm",
            end.radius_mm
        ));
    }
    lines.extend(document.notes.iter().map(|note| format!("  {note}")));
    lines.push(vessel::text(&document.check));
    lines.join("\n")
}
