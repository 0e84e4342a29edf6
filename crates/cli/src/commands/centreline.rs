//! `endowire vessel centreline`: the centre line of a surface.

use endowire_core::Error;
use endowire_core::vessel::{
    CentrelineBranch, CentrelineEnd, CentrelineLink, ExtractedCentreline, SurfaceMesh, Wall,
};
use serde::Serialize;

use crate::args::CentrelineArgs;
use crate::failure::Failure;
use crate::output::answer;
use crate::output::provenance::{Provenance, read_input};

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    file: String,
    out: Option<String>,
    rows: usize,
    branches: Vec<CentrelineBranch>,
    links: Vec<CentrelineLink>,
    /// Number of rings by the handles of the surface; `None` where it does not close.
    rings: Option<usize>,
    targets: Vec<NamedRow>,
    unreached_openings: Vec<usize>,
}

#[derive(Serialize)]
struct NamedRow {
    name: String,
    row: usize,
}

/// Extracts the centre line of a surface file, writes its table if requested, and prints its branches.
pub(crate) fn centreline(args: &CentrelineArgs) -> Result<(), Failure> {
    let provenance = Provenance::new(&[&read_input(&args.file)?], 0);
    let wall = Wall::from_surface(&SurfaceMesh::read(&args.file, args.frame)?)?;
    let found = ExtractedCentreline::of(&wall, args.from, &args.to)
        .map_err(|error| as_flag(error).at(args.file.display()))?;
    if let Some(out) = &args.out {
        found.tree.write(out, &format!("centre line of {}, mm", args.file.display()))?;
    }
    let targets = found.tree.targets().iter();
    let document = Document {
        provenance,
        file: args.file.display().to_string(),
        out: args.out.as_ref().map(|out| out.display().to_string()),
        rows: found.tree.nodes().len(),
        branches: found.tree.branches(),
        links: found.tree.links().to_vec(),
        rings: found.rings,
        targets: targets.map(|target| NamedRow { name: target.name.clone(), row: target.row }).collect(),
        unreached_openings: found.unreached,
    };
    answer(&document, args.json, || text(&document))
}

/// Replaces the core's names `from`, `to` and target in an error by the flags of the command line.
pub(super) fn as_flag(error: Error) -> Failure {
    Failure::from(match error {
        Error::Parameter { name, value, remedy }
            if ["from", "to", "target", "via"].contains(&name.as_str()) =>
        {
            let flag = match name.as_str() {
                "from" => "--from",
                "via" => "--via",
                _ => "--to",
            };
            Error::Parameter { name: flag.to_owned(), value, remedy }
        }
        other => other,
    })
}

/// Farthest coordinate of a place, mm, as of a centre line.
const FARTHEST_MM: f64 = 1e6;

/// Parses `--from` and `--to`: the number of an opening, or a place `x,y,z`.
pub(crate) fn parse_end(text: &str) -> Result<CentrelineEnd, String> {
    let remedy =
        "expected the number of an opening (endowire vessel check lists them) or a place x,y,z in mm";
    let numbers: Vec<&str> = text.split(',').map(str::trim).collect();
    match numbers.as_slice() {
        [opening] => opening.parse().map(CentrelineEnd::Opening).map_err(|_| remedy.to_owned()),
        [x, y, z] => match (x.parse(), y.parse(), z.parse()) {
            (Ok(x), Ok(y), Ok(z)) => {
                let place = [x, y, z];
                // A NaN is not within either.
                let is_near = place.iter().all(|x: &f64| x.abs() <= FARTHEST_MM);
                let far = || format!("a place has finite numbers of at most {FARTHEST_MM} mm");
                is_near.then(|| CentrelineEnd::Place(place.into())).ok_or_else(far)
            }
            _ => Err(remedy.to_owned()),
        },
        _ => Err(remedy.to_owned()),
    }
}

/// How many rings there are, and how many of their arms are in the centre line; nothing for a vessel without any.
fn rings(expected: Option<usize>, found: usize) -> Option<String> {
    let of_surface = |count: usize| match count {
        1 => "1 ring".to_owned(),
        count => format!("{count} rings"),
    };
    match expected {
        Some(0) => None,
        Some(count) if count == found => {
            Some(format!("{} by the surface's handles, closed by as many links", of_surface(count)))
        }
        Some(count) => Some(format!(
            "{} by the surface's handles, but only {found} of their arms are found: the others are as thin as faults of the mesh, or              need smaller triangles",
            of_surface(count)
        )),
        None => Some(
            "the surface does not close, so that its rings are not known: branches that meet again are followed by one arm"
                .to_owned(),
        ),
    }
}

/// The branches as text.
fn text(document: &Document) -> String {
    let mut lines = vec![
        format!("{}: {} rows, {} branches", document.file, document.rows, document.branches.len()),
        "    from      to   length mm   least radius mm   end".to_owned(),
    ];
    lines.extend(document.branches.iter().map(|branch| {
        let end = document.targets.iter().find(|target| target.row == branch.to);
        let end = match branch.joins {
            Some(row) => format!("joins {row}"),
            None => end.map_or("fork", |target| target.name.as_str()).to_owned(),
        };
        let (length_mm, radius_mm) = (branch.length_mm, branch.least_radius_mm);
        format!("{:>8}{:>8}{length_mm:>12.1}{radius_mm:>18.3}   {end}", branch.from, branch.to)
    }));
    lines.extend(rings(document.rings, document.links.len()));
    if !document.unreached_openings.is_empty() {
        let numbers: Vec<String> = document.unreached_openings.iter().map(usize::to_string).collect();
        lines.push(format!(
            "no way inside leads to openings {}: they are of other pieces",
            numbers.join(", ")
        ));
    }
    lines.join("\n")
}
