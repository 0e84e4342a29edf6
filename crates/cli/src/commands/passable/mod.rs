//! `endowire vessel passable`: whether a device can follow a way.

use endowire_core::device::DeviceFile;
use endowire_core::passable::{Passable, Passage, WayPoint, passable};
use endowire_core::vessel::{
    CentrelineEnd, CentrelinePath, CentrelineTree, ExtractedCentreline, SurfaceMesh, Wall,
};
use serde::Serialize;

use super::centreline::{as_flag, parse_end};
use crate::args::PassableArgs;
use crate::failure::Failure;
use crate::output::answer;
use crate::output::provenance::{Provenance, read_input};

/// Rows of the table for a person, evenly along the way.
const ROWS: usize = 20;

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    file: String,
    device: String,
    to: String,
    force_n: f64,
    #[serde(flatten)]
    found: Passable,
}

/// Looks at a device on its way to a target in a surface, and tells what it finds there.
pub(crate) fn passable_file(args: &PassableArgs) -> Result<(), Failure> {
    let mut inputs = vec![read_input(&args.file)?, read_input(&args.device)?];
    if let Some(table) = &args.centreline {
        inputs.push(read_input(table)?);
    }
    let device = DeviceFile::read(&args.device)?;
    let way = match &args.centreline {
        Some(table) => way_in_table(&CentrelineTree::read(table)?, &args.to)?,
        None => way_in_surface(args)?,
    };
    let found = passable(&way, &device.device, args.force_n).map_err(|error| match error {
        endowire_core::Error::Parameter { name, value, mend } if name == "force_n" => {
            Failure::from(endowire_core::Error::Parameter { name: "--force-n".into(), value, mend })
        }
        other => other.into(),
    })?;
    let document = Document {
        provenance: Provenance::new(&inputs, 0),
        file: args.file.display().to_string(),
        device: args.device.display().to_string(),
        to: args.to.clone(),
        force_n: args.force_n,
        found,
    };
    answer(&document, args.json, || text(&document))
}

/// The way to a named row of a table, or to the row nearest to a place.
fn way_in_table(tree: &CentrelineTree, to: &str) -> Result<CentrelinePath, Failure> {
    let row = match parse_end(to) {
        Ok(CentrelineEnd::Place(place)) => tree.nearest_row(&place),
        _ => tree.target(to).map_err(as_flag)?.row,
    };
    tree.path_to(row).ok_or_else(|| {
        Failure::Input(format!("--to = {to}: is the root of the centre line, where the way begins"))
    })
}

/// The way that is found in the surface.
fn way_in_surface(args: &PassableArgs) -> Result<CentrelinePath, Failure> {
    let opening = args.to.strip_prefix("opening ").unwrap_or(&args.to);
    let to = parse_end(opening).map_err(|mend| {
        let more = "a name needs the table that has it: --centreline FILE";
        Failure::Input(format!("--to = {:?}: {mend}; {more}", args.to))
    })?;
    let wall = Wall::from_surface(&SurfaceMesh::read(&args.file, args.frame)?)?;
    let found = ExtractedCentreline::of(&wall, args.from, &[to])
        .map_err(|error| as_flag(error).at(args.file.display()))?;
    let row = found.tree.targets().first().map_or(0, |target| target.row);
    found.tree.path_to(row).ok_or_else(|| Failure::Input("--to: is where the way begins".into()))
}

/// The table for a person.
fn text(document: &Document) -> String {
    let found = &document.found;
    let passage = match found.passage {
        Passage::Passes => "passes",
        Passage::Tight => "tight",
        Passage::Blocked => "blocked",
        Passage::Short => "short: the device does not reach the target",
    };
    let mut lines = vec![
        format!("{} to {} in {}: {passage}", document.device, document.to, document.file),
        format!(
            "  {:.1} mm of way; bends that take at most {} N are none",
            found.length_mm, document.force_n
        ),
        "     way mm   lumen mm   device mm   clearance mm   bend mm   cut mm   bears mm".into(),
    ];
    let step = (found.way.len() / ROWS).max(1);
    lines.extend(found.way.iter().step_by(step).map(|point| row(point, "")));
    lines.push(row(&found.narrowest, "narrowest"));
    lines.push(row(&found.sharpest, "sharpest bend"));
    lines.join("\n")
}

fn row(point: &WayPoint, note: &str) -> String {
    let bend = |mm: f64| if mm < 1e4 { format!("{mm:.1}") } else { "straight".to_owned() };
    let line = format!(
        "{:>11.1}{:>11.2}{:>12.3}{:>15.2}{:>10}{:>9}{:>11}   {note}",
        point.arc_mm,
        point.lumen_radius_mm,
        point.device_radius_mm,
        point.clearance_mm,
        bend(point.bend_radius_mm),
        bend(point.cut_radius_mm),
        bend(point.bears_radius_mm)
    );
    line.trim_end().to_owned()
}
