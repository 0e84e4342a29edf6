//! Computes the centre line of a surface from its lumen.
//!
//! The lumen is filled with spheres about chords across it ([`lumen`]); the cheapest paths through them, length being
//! expensive where spheres are small, lead from one end to all others ([`ways`]); each is moved to the middle of the
//! lumen and smoothed ([`line`]). Where a path enters the spheres of another it is joined to it ([`growing`]). If the
//! surface has handles ([`handles`]), branches meet again: ways that close a ring ([`classes`]) lead to the arms that
//! the tree lacks ([`arms`]).

mod arms;
mod classes;
mod growing;
mod handles;
mod line;
mod lumen;
#[cfg(test)]
mod ring_tests;
#[cfg(test)]
mod tests;
mod ways;

use self::arms::{Arms, Rings};
pub(super) use self::growing::Growing;
pub(super) use self::handles::handles;
pub(super) use self::lumen::Sphere;
use self::lumen::{Lumen, Spheres};
use self::ways::{Beside, Ways};
use super::{CentrelineTree, Target, Wall};
use crate::{Error, Result, Vec3};

/// Largest pieces of a triangle, in radii of the local lumen; if an end is not reached, the next value is used.
const SPACINGS: [f64; 3] = [0.5, 0.25, 0.125];

/// By how much of the smaller radius spheres that a way leads through may be farther apart than the larger radius: it
/// stays well inside the two.
const OVERLAP: f64 = 0.5;
/// How much larger spheres must be for each millimetre by which the points of a line with rings are moved to them, mm.
const STRAY_COST: f64 = 0.05;

/// An end of a centre line.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub enum CentrelineEnd {
    /// An opening of the wall, by its index.
    Opening(usize),
    /// A position in the lumen, mm; the line ends in the middle of the lumen there.
    Place(Vec3),
}

/// A centre line computed from a wall.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtractedCentreline {
    /// The tree, from the first end on, with a link for each arm of a ring. Its ends are targets: `opening 3`, `place 1`
    /// (counted from 1, as given); so is the middle of each such arm, `arm 1`.
    pub tree: CentrelineTree,
    /// Number of rings that the surface has by its handles, and so of links that there should be; `None` where the
    /// surface does not close, so that it is not known.
    pub rings: Option<usize>,
    /// Openings without a path: of another piece of the surface.
    pub unreached: Vec<usize>,
}

/// A stretch of a tree without a bifurcation.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct CentrelineBranch {
    /// Row of the root or bifurcation where it starts.
    pub from: usize,
    /// Row of the end or bifurcation where it ends.
    pub to: usize,
    /// Row that its end joins, if it is the arm of a ring.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joins: Option<usize>,
    /// Its length, mm, up to the point that it joins.
    pub length_mm: f64,
    /// The smallest radius of its points, except the bifurcation where it starts, mm.
    pub least_radius_mm: f64,
}

impl ExtractedCentreline {
    /// Computes the centre line of `wall` from one end to others: from its inlet ([`Wall::inlet`]) without `from`, to
    /// all other openings if `to` is empty.
    ///
    /// Radii are those of the largest spheres in the lumen about each point. Lines are the paths with the smallest
    /// integral of 1/radius (Antiga et al., IEEE Transactions on Medical Imaging 22, 2003), moved to where the sphere
    /// is the largest of its cross-section.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming `from` or `to` for a nonexistent opening, a position outside the lumen, or one
    /// without a path, and for a surface without the openings needed.
    pub fn of(wall: &Wall, from: Option<CentrelineEnd>, to: &[CentrelineEnd]) -> Result<Self> {
        let mut lumen = Lumen::new(wall)?;
        let contents = wall.report().bodies_in_lumen + wall.report().sheets_in_lumen;
        let has_rings = contents > 0 || handles(wall, &[]).is_some_and(|count| count > 0);
        // Where there is no ring, the line is the same to the bit as ever.
        lumen.stray_cost = if has_rings { STRAY_COST } else { 0.0 };
        let first = from.or_else(|| wall.inlet().map(|inlet| CentrelineEnd::Opening(inlet.index)));
        let first = first.ok_or_else(|| {
            Error::parameter("from", "none", "the surface has no opening: give a place inside to begin at")
        })?;
        let root = end(&lumen, &first, "from")?;
        let all: Vec<CentrelineEnd> = match to {
            [] => {
                (0..wall.openings().len()).map(CentrelineEnd::Opening).filter(|end| *end != first).collect()
            }
            given => given.to_vec(),
        };
        if all.is_empty() {
            let remedy = "the surface has no other opening to lead to: give places inside";
            return Err(Error::parameter("to", "none", remedy));
        }
        if let Some(k) = all.iter().position(|to| *to == first) {
            return Err(Error::parameter("to", name(&first, k), "the way begins there: name another end"));
        }
        let ends = all.iter().map(|to| end(&lumen, to, "to")).collect::<Result<Vec<Sphere>>>()?;
        let ways = found_ways(&lumen, root, &ends);
        if let Some(missed) = (0..all.len()).find(|&k| ways[k].is_none() && !to.is_empty()) {
            let remedy =
                "no way inside the vessel leads there: check that it is in the same piece of the surface";
            return Err(Error::parameter("to", name(&all[missed], missed), remedy));
        }
        let is_missed = |(k, end): (usize, &CentrelineEnd)| match end {
            CentrelineEnd::Opening(opening) if ways[k].is_none() => Some(*opening),
            _ => None,
        };
        let unreached: Vec<usize> = all.iter().enumerate().filter_map(is_missed).collect();
        let mut order: Vec<usize> = (0..ends.len()).filter(|&k| ways[k].is_some()).collect();
        // Narrower branches are joined to wider ones.
        order.sort_by(|&a, &b| ends[b].radius_mm.total_cmp(&ends[a].radius_mm).then(a.cmp(&b)));
        let (mut growing, mut targets) = (Growing::default(), Vec::new());
        for k in order {
            let (mut entry, own) = growing.own_part(ways[k].as_deref().unwrap_or_default());
            let line = line::centred(&lumen, &own, [entry.is_none(), true]);
            if let [first, ..] = line[..]
                && has_rings
                && entry.is_some()
            {
                let joint = line::behind(&line).and_then(|from| growing.joint(&lumen, from, &first));
                entry = joint.or(entry);
            }
            let row = growing.join(entry, &line);
            targets.extend(row.map(|row| Target { name: name(&all[k], k), row }));
        }
        if growing.nodes.is_empty() {
            let remedy = "no way leads from there to any other opening: choose another with `from`";
            return Err(Error::parameter("from", name(&first, 0), remedy));
        }
        let mut rings = handles(wall, &unreached);
        let arms = match rings {
            Some(count) if contents > 0 => arms::add(&lumen, root, Rings::Beside(count), &mut growing),
            Some(count) if count > 0 => arms::add(&lumen, root, Rings::Handles(count), &mut growing),
            _ => Arms::default(),
        };
        // Beside a flap that stops short of the wall there is one without a handle.
        rings = rings.map(|count| count.max(arms.links.len()));
        targets.extend(arms.targets);
        let tree = CentrelineTree::new(growing.nodes)?.with_links(arms.links)?.with_targets(targets)?;
        Ok(Self { tree, rings, unreached })
    }
}

impl CentrelineTree {
    /// The stretches of the tree between its root, bifurcations and ends, in the order of their last rows. Where a
    /// link joins a row, branches meet, and one ends.
    pub fn branches(&self) -> Vec<CentrelineBranch> {
        let (nodes, children) = (self.nodes(), self.children());
        let is_joined = |row: usize| self.links().iter().any(|link| link.joins == row);
        let is_end = |row: usize| children[row].len() != 1 || is_joined(row);
        (1..nodes.len())
            .filter(|&row| is_end(row))
            .map(|to| {
                let joins = self.joined_by(to);
                let apart_mm = |row: usize| (nodes[row].position_mm - nodes[to].position_mm).norm();
                let mut branch = CentrelineBranch {
                    from: to,
                    to,
                    joins,
                    length_mm: joins.map_or(0.0, apart_mm),
                    least_radius_mm: nodes[to].radius_mm,
                };
                while let Some(parent) = nodes[branch.from].parent {
                    branch.least_radius_mm = branch.least_radius_mm.min(nodes[branch.from].radius_mm);
                    branch.length_mm += (nodes[parent].position_mm - nodes[branch.from].position_mm).norm();
                    branch.from = parent;
                    if is_end(parent) {
                        break;
                    }
                }
                branch
            })
            .collect()
    }
}

/// Name of an end as a target.
fn name(end: &CentrelineEnd, index: usize) -> String {
    match end {
        CentrelineEnd::Opening(opening) => format!("opening {opening}"),
        CentrelineEnd::Place(_) => format!("place {}", index + 1),
    }
}

/// The sphere at an end.
fn end(lumen: &Lumen<'_>, end: &CentrelineEnd, key: &str) -> Result<Sphere> {
    let openings = lumen.wall.openings();
    let centre_mm = match *end {
        CentrelineEnd::Opening(number) => {
            let opening = openings.get(number).ok_or_else(|| {
                let remedy = match openings.len() {
                    0 => "the surface has no opening: give a place inside".to_owned(),
                    count => format!("the surface has {count} openings, counted from 0"),
                };
                Error::parameter(key, format!("opening {number}"), remedy)
            })?;
            opening.centre_mm
        }
        CentrelineEnd::Place(place) => place,
    };
    let radius_mm = lumen.clearance_mm(&centre_mm);
    let sphere = Sphere { centre_mm, radius_mm };
    match *end {
        CentrelineEnd::Place(_) if radius_mm > 0.0 => Ok(lumen.about(&sphere)),
        CentrelineEnd::Opening(_) if radius_mm > 0.0 => Ok(sphere),
        // The middle of an irregular rim may be outside the lumen; nearby points are not.
        CentrelineEnd::Opening(number) => Ok(Sphere { centre_mm, radius_mm: openings[number].radius_mm }),
        CentrelineEnd::Place(place) => Err(Error::parameter(
            key,
            crate::error::vector(&place),
            "is not inside the vessel: give a place in the lumen, mm",
        )),
    }
}

/// The paths from the first sphere to the ends, through more closely spaced spheres if needed.
fn found_ways(lumen: &Lumen<'_>, root: Sphere, ends: &[Sphere]) -> Vec<Option<Vec<Sphere>>> {
    let mut found = vec![None; ends.len()];
    for (level, spacing) in SPACINGS.into_iter().enumerate() {
        let mut spheres = Spheres::default();
        for sphere in [root].iter().chain(ends).copied().chain(lumen.spheres(spacing)) {
            spheres.push(sphere);
        }
        let mut beside = Beside::new(&spheres, lumen, OVERLAP);
        let mut take = |beside: &Beside| {
            let ways = Ways::from(0, &spheres, beside);
            for (k, way) in found.iter_mut().enumerate().filter(|(_, way)| way.is_none()) {
                let numbers = ways.to(k + 1);
                *way = numbers.map(|way| way.into_iter().map(|sphere| spheres.all[sphere]).collect());
            }
            found.iter().all(Option::is_some)
        };
        if take(&beside) {
            break;
        }
        if level + 1 == SPACINGS.len() {
            beside.join_ends(1 + ends.len(), &spheres, lumen);
            take(&beside);
        }
    }
    found
}
