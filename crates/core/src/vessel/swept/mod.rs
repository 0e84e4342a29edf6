//! A vessel given by its centre line, for queries and contact without a mesh.
//!
//! The wall is the surface from which a mesh of the vessel is made ([`GeneratedWall`](super::GeneratedWall)):
//! position, curvature and inside follow from the centre line alone. A mesh is made only if triangles are needed, for
//! rendering or export.

mod axis;
mod blocks;
mod closest;
mod field;
#[cfg(test)]
mod tests;
mod tube;

use std::f64::consts::TAU;
use std::sync::{Arc, OnceLock};

use super::generate::curve::{self, Branch};
use super::generate::{
    TreeEnd, any_perpendicular, check_end_is_free, check_resolution, open_ends, wall_cuts_itself,
};
use super::lumen::Meshed;
use super::opening::{self, Opening};
use super::{CentrelineTree, Resolution, WallRecipe, WallStore};
use crate::{Error, Result, Vec3};
use axis::{Axis, End};
use blocks::Blocks;
pub(crate) use closest::From as ClosestFrom;
use closest::From;
pub(crate) use field::SweptField;
pub(crate) use tube::{InTube, Tube};

/// Number of sample points on a cross-section, from which extensions of openings are kept apart.
const AROUND: usize = 12;
/// Number of knots between such cross-sections: half of the branch's smallest radius.
const BETWEEN: usize = 2;
/// Ratio of the path between two stretches of a tube to π/2 times their distance above which they are not neighbours
/// in a bend.
const NEIGHBOURS: f64 = 1.05;

/// A vessel swept by circles along a centre-line tree.
#[derive(Debug)]
pub struct SweptVessel {
    tree: CentrelineTree,
    resolution: Resolution,
    field: SweptField,
    openings: Vec<Opening>,
    inlet: usize,
    /// Its mesh, once needed.
    meshed: OnceLock<Meshed>,
}

impl SweptVessel {
    /// The vessel of `tree`, with this resolution of its mesh.
    ///
    /// # Errors
    /// As [`GeneratedWall::new`](super::GeneratedWall::new), except those of meshing.
    pub fn new(tree: CentrelineTree, resolution: Resolution) -> Result<Self> {
        let branches = curve::branches(&tree)?;
        check_resolution(&branches, resolution)?;
        let ends = open_ends(&branches);
        let mut axes: Vec<Axis> = branches.iter().map(|branch| Axis::new(branch, ends_of(branch))).collect();
        let mut openings = openings(&axes, &ends);
        let inlet = opening_at(&openings, &ends[0]);
        for end in &ends {
            let open = End::Open(openings[opening_at(&openings, end)].beyond_mm);
            axes[end.branch].ends[usize::from(end.row != ends[0].row)] = open;
        }
        let field = SweptField::new(axes.into(), 0.0);
        match &*field.axes {
            [only] if ends.len() == 2 => check_apart(only)?,
            _ => ends.iter().try_for_each(|end| check_end_is_free(end, |x| field.value_at(x)))?,
        }
        openings.shrink_to_fit();
        Ok(Self { tree, resolution, field, openings, inlet, meshed: OnceLock::new() })
    }

    /// Its centre line.
    pub fn tree(&self) -> &CentrelineTree {
        &self.tree
    }

    /// The resolution of its mesh.
    pub fn resolution(&self) -> Resolution {
        self.resolution
    }

    /// Its smallest radius, mm.
    pub(crate) fn least_radius_mm(&self) -> f64 {
        let knots = self.field.axes.iter().flat_map(|axis| (0..axis.len()).map(|knot| axis.radius(knot)));
        knots.fold(f64::INFINITY, f64::min)
    }

    /// Its openings, numbered as those of its mesh; without a mesh they have no boundary.
    pub(crate) fn openings(&self) -> &[Opening] {
        &self.openings
    }

    /// The opening at the root of its tree.
    pub fn inlet(&self) -> usize {
        self.inlet
    }

    /// Whether a position is in the lumen.
    pub(crate) fn contains(&self, x: &Vec3) -> bool {
        let is_beyond = |opening: &Opening| {
            let (beyond_mm, lateral_mm) = opening.beyond_and_off_axis_mm(x);
            beyond_mm > 0.0
                && beyond_mm <= opening.beyond_mm + opening.radius_mm
                && lateral_mm < 1.5 * opening.radius_mm
        };
        self.field.contains(x) && !self.openings.iter().any(is_beyond)
    }

    /// Distance of a position from the wall, mm, on either side.
    pub(crate) fn distance_mm(&self, x: &Vec3) -> f64 {
        let near = self.field.near(x);
        self.field.closest(x, From::Space(near.piece)).map_or(f64::NAN, |closest| closest.distance_mm().abs())
    }

    /// The bounding box of the vessel, mm.
    pub(crate) fn bounds_mm(&self) -> (Vec3, Vec3) {
        let nodes = self.tree.nodes().iter();
        let balls = nodes.map(|node| (node.position_mm, Vec3::repeat(node.radius_mm)));
        let nowhere = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        balls.fold(nowhere, |(low, high), (x, r)| (low.inf(&(x - r)), high.sup(&(x + r))))
    }

    /// Its wall, for queries up to `reach_mm` outside the lumen.
    pub(crate) fn field(&self, reach_mm: f64) -> SweptField {
        SweptField::new(Arc::clone(&self.field.axes), reach_mm)
    }

    /// Its mesh, made when first needed or found in `store`.
    ///
    /// # Errors
    /// As [`GeneratedWall::new`](super::GeneratedWall::new).
    pub(super) fn meshed(&self, store: &dyn WallStore) -> Result<&Meshed> {
        if let Some(known) = self.meshed.get() {
            return Ok(known);
        }
        let recipe = WallRecipe::Generated { tree: &self.tree, resolution: self.resolution };
        let mut wall = store.wall(&recipe)?;
        wall.number_openings_as(&self.openings)?;
        let made = Meshed::new(wall);
        Ok(self.meshed.get_or_init(|| made))
    }
}

impl SweptField {
    /// Number of knots of all branches.
    pub(crate) fn pieces(&self) -> usize {
        self.axes.iter().map(Axis::len).sum()
    }

    /// The field of these axes, for positions up to `reach_mm` outside the lumen.
    fn new(axes: Arc<[Axis]>, reach_mm: f64) -> Self {
        let blocks = Blocks::new(&axes, reach_mm);
        Self { axes, blocks }
    }
}

/// The kinds of a branch's ends, with openings still unknown.
fn ends_of(branch: &Branch) -> [End; 2] {
    [branch.root_row, branch.leaf_row].map(|row| row.map_or(End::Round, |_| End::Open(0.0)))
}

/// The opening of an end.
fn opening_at(openings: &[Opening], end: &TreeEnd) -> usize {
    openings.iter().position(|opening| opening.centre_mm == end.centre).unwrap_or(0)
}

/// The openings of the ends, numbered, with the lengths of their extensions.
fn openings(axes: &[Axis], ends: &[TreeEnd]) -> Vec<Opening> {
    let mut openings: Vec<Opening> =
        ends.iter().map(|end| Opening::at_end(end.centre, end.radius, end.outward)).collect();
    opening::number(&mut openings);
    let sections =
        axes.iter().flat_map(|axis| (0..axis.len()).step_by(BETWEEN).map(move |knot| (axis, knot)));
    let walls = sections.flat_map(|(axis, knot)| {
        let place = axis.at(axis.step() * knot as f64);
        let tangent = place.first.normalize();
        let u = any_perpendicular(&tangent);
        let v = tangent.cross(&u);
        (0..AROUND).map(move |k| {
            let angle = TAU * k as f64 / AROUND as f64;
            place.position + (u * libm::cos(angle) + v * libm::sin(angle)) * place.radius[0]
        })
    });
    let walls: Vec<Vec3> = walls.collect();
    let see = |_: usize, _: &Opening, see: &mut dyn FnMut(Vec3, bool)| {
        walls.iter().for_each(|x| see(*x, true));
    };
    opening::keep_apart(see, &vec![0.0; ends.len()], &mut openings);
    openings
}

/// Rejects a tube that intersects itself.
fn check_apart(axis: &Axis) -> Result<()> {
    let widest = (0..axis.len()).map(|knot| axis.radius(knot)).fold(0.0, f64::max);
    for knot in 0..axis.len() {
        let (x, radius) = (axis.position(knot), axis.radius(knot));
        let apart = NEIGHBOURS * std::f64::consts::FRAC_PI_2 * (radius + widest);
        let from = knot + (apart / axis.step()).ceil() as usize;
        if from >= axis.len() {
            break;
        }
        let other = axis.nearest(&x, from, axis.len() - 1).knot.max(from);
        if (axis.position(other) - x).norm() < radius + axis.radius(other) {
            return Err(Error::Mesh(wall_cuts_itself(&x)));
        }
    }
    Ok(())
}
