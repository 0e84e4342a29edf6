//! `endowire vessel passable`: checks whether a device can follow a way.

mod glass;
mod picture;

use std::path::Path;

use endowire_core::device::DeviceFile;
use endowire_core::passable::{Passable, Passage, WayPoint, passable};
use endowire_core::vessel::{
    CentrelineEnd, CentrelinePath, CentrelineTree, ExtractedCentreline, SurfaceMesh, Wall,
};
use endowire_core::{Error, Vec3};
use serde::Serialize;

use super::centreline::{as_flag, parse_end};
use crate::args::PassableArgs;
use crate::failure::Failure;
use crate::output::answer;
use crate::output::provenance::{Provenance, read_input};

/// Number of table rows, evenly spaced along the way.
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

/// Checks a device on its way to a target in a surface, and prints the result.
pub(crate) fn passable_file(args: &PassableArgs) -> Result<(), Failure> {
    let mut inputs = vec![read_input(&args.file)?, read_input(&args.device)?];
    if let Some(table) = &args.centreline {
        inputs.push(read_input(table)?);
    }
    let device = DeviceFile::read(&args.device)?;
    args.picture.as_deref().map_or(Ok(()), check_name)?;
    let wall = || Ok::<_, Failure>(Wall::from_surface(&SurfaceMesh::read(&args.file, args.frame)?)?);
    let (way, wall) = match &args.centreline {
        // Without a picture the surface is not needed, so it is not repaired.
        Some(table) => {
            let way = way_in_table(&CentrelineTree::read(table)?, args)?;
            (way, args.picture.as_ref().map(|_| wall()).transpose()?)
        }
        None => {
            let wall = wall()?;
            (way_in_surface(args, &wall)?, Some(wall))
        }
    };
    let found = passable(&way, &device.device, args.force_n).map_err(|error| match error {
        endowire_core::Error::Parameter { name, value, remedy } if name == "force_n" => {
            Failure::from(endowire_core::Error::Parameter { name: "--force-n".into(), value, remedy })
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
    if let (Some(path), Some(wall)) = (&args.picture, &wall) {
        let title = format!(
            "{} to {} in {}: {}",
            name_of(&args.device),
            document.to,
            name_of(&args.file),
            word(&document.found)
        );
        picture::write(path, title, &document.found, wall.mesh())?;
    }
    answer(&document, args.json, || text(&document))
}

/// The place of a target by name, or a place itself; `flag` gave it.
fn place(tree: &CentrelineTree, flag: &str, name: &str) -> Result<Vec3, Failure> {
    let of_flag = |error| match error {
        Error::Parameter { value, remedy, .. } => Error::Parameter { name: flag.to_owned(), value, remedy },
        other => other,
    };
    match parse_end(name) {
        Ok(CentrelineEnd::Place(place_mm)) => Ok(place_mm),
        _ => Ok(tree.nodes()[tree.target(name).map_err(of_flag)?.row].position_mm),
    }
}

/// The way over a place to another.
fn way_via(tree: &CentrelineTree, via: &str, to_mm: &Vec3) -> Result<CentrelinePath, Failure> {
    tree.path_via(&place(tree, "--via", via)?, to_mm).map_err(as_flag)
}

/// The way to a named row of a table, or to the point of its line nearest to a place.
fn way_in_table(tree: &CentrelineTree, args: &PassableArgs) -> Result<CentrelinePath, Failure> {
    let to = args.to.as_str();
    if let Some(via) = &args.via {
        return way_via(tree, via, &place(tree, "--to", to)?);
    }
    let way = match parse_end(to) {
        Ok(CentrelineEnd::Place(place)) => tree.path_to_place(&place),
        _ => tree.path_to(tree.target(to).map_err(as_flag)?.row),
    };
    way.ok_or_else(|| {
        Failure::Input(format!("--to = {to}: is the root of the centre line, where the way begins"))
    })
}

/// Refuses a picture format other than PNG: a vessel of a hundred thousand pixels is not suited to SVG.
fn check_name(path: &Path) -> Result<(), Failure> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("png") => Ok(()),
        _ => Err(Failure::Input(format!("--picture {}: name a file .png", path.display()))),
    }
}

/// The name of a file without its folder.
fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// The way extracted from the surface.
fn way_in_surface(args: &PassableArgs, wall: &Wall) -> Result<CentrelinePath, Failure> {
    let opening = args.to.strip_prefix("opening ").unwrap_or(&args.to);
    let to = parse_end(opening).map_err(|remedy| {
        let more = "a name needs the table that has it: --centreline FILE";
        Failure::Input(format!("--to = {:?}: {remedy}; {more}", args.to))
    })?;
    let found = ExtractedCentreline::of(wall, args.from, &[to])
        .map_err(|error| as_flag(error).at(args.file.display()))?;
    let row = found.tree.targets().first().map_or(0, |target| target.row);
    if let Some(via) = &args.via {
        return way_via(&found.tree, via, &found.tree.nodes()[row].position_mm);
    }
    found.tree.path_to(row).ok_or_else(|| Failure::Input("--to: is where the way begins".into()))
}

/// The result in a few words.
fn word(found: &Passable) -> String {
    match found.passage {
        Passage::Passes => "passes".to_owned(),
        Passage::Tight => "tight".to_owned(),
        Passage::Blocked => format!("blocked: the tip comes to {:.1} mm", found.reaches_mm),
        Passage::Short => format!("short: the tip comes to {:.1} mm", found.reaches_mm),
    }
}

/// The table as text.
fn text(document: &Document) -> String {
    let found = &document.found;
    let passage = word(found);
    let mut lines = vec![
        format!("{} to {} in {}: {passage}", document.device, document.to, document.file),
        format!(
            "  {:.1} mm of way, {:.1} mm of device; bends that take at most {} N are none",
            found.length_mm, found.taken_mm, document.force_n
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
