//! Random vessels with one way through each: what a device does in them is not decided by steering.

use std::f64::consts::TAU;

use endowire_core::vessel::{
    CentrelineNode, CentrelineTree, GeneratedWall, Opening, Resolution, Wall, anatomy,
};
use endowire_core::{Error, Result, Vec3};

use super::between;
use crate::noise::Noise;
use crate::spoiled::WAYS;

/// Vessels of anatomies whose branches have names; the carotids are those of the arches.
const ANATOMIES: [&str; 4] = ["aortic_arch", "aortic_arch_ii", "aortic_arch_iii", "hepatic"];
/// A branch begins where the radius falls below this part of the trunk's.
const BRANCH: f64 = 0.5;
/// Radii of a tube's lumen, mm.
const LUMEN_MM: [f64; 2] = [0.8, 5.0];
/// Radii of a tube's bends at least, in radii of its lumen, and at most, mm.
const BEND_RADII: f64 = 2.0;
const BEND_MOST_MM: f64 = 60.0;
/// Points of a tube are so far apart, mm.
const SPACING_MM: f64 = 1.0;
/// What a stenosis leaves of the lumen's radius, and half of its length, mm.
const LEFT: [f64; 2] = [0.05, 0.9];
const HALF_LENGTH_MM: [f64; 2] = [3.0, 12.0];
/// Edges of a wall: in mean radii of its lumen, and their limits, mm.
const EDGE_RADII: f64 = 0.2;
const EDGE_MM: [f64; 2] = [0.25, 2.5];
/// Courses that are drawn until one does not come back to itself.
const COURSES: usize = 100;

/// A vessel without branches.
pub struct Vessel {
    /// What it is.
    pub what: String,
    /// Its centre line, as it was drawn.
    pub tree: CentrelineTree,
    /// Its wall, repaired if that was spoiled.
    pub wall: Wall,
    /// The opening where its centre line begins.
    pub inlet: usize,
}

impl Vessel {
    /// A tube, or the way to a target of an anatomy, with none to two stenoses; the wall of one in three is spoiled.
    ///
    /// # Errors
    /// Bends tighter than the vessel is wide, stenoses on each other, a spoiled wall that cannot be repaired.
    pub(super) fn draw(random: &mut Noise) -> Result<Self> {
        let (mut what, mut nodes) = if random.happens(0.6) { tube(random) } else { way(random)? };
        for _ in 0..random.below(3) {
            what += &stenosis(random, &mut nodes);
        }
        let mean_mm = nodes.iter().map(|node| node.radius_mm).sum::<f64>() / nodes.len() as f64;
        let edge_mm = (EDGE_RADII * mean_mm).clamp(EDGE_MM[0], EDGE_MM[1]);
        let tree = CentrelineTree::new(nodes)?;
        let made = GeneratedWall::new(&tree, Resolution::EdgeMm(edge_mm))?;
        if random.below(3) > 0 {
            return Ok(Self { what, tree, wall: made.wall, inlet: made.inlet });
        }
        let (name, spoil) = WAYS[random.below(WAYS.len())];
        what += &format!(", {name}");
        let wall = Wall::from_surface(&spoil(made.wall.mesh(), random.0))?;
        let mut vessel = Self { what, tree, wall, inlet: 0 };
        let lost = || Error::Mesh(format!("{}: has lost its openings", vessel.what));
        vessel.inlet = vessel.opening_near(&vessel.tree.nodes()[0].position_mm).ok_or_else(lost)?;
        Ok(vessel)
    }

    /// The opening nearest to a place.
    pub(super) fn opening_near(&self, place_mm: &Vec3) -> Option<usize> {
        let away_mm = |opening: &&Opening| (opening.centre_mm - place_mm).norm();
        let openings = self.wall.openings().iter();
        openings.min_by(|a, b| away_mm(a).total_cmp(&away_mm(b))).map(|opening| opening.index)
    }
}

/// The way to a target of an anatomy from where its last narrow branch leaves, its other branches left out, of another size.
fn way(random: &mut Noise) -> Result<(String, Vec<CentrelineNode>)> {
    let name = ANATOMIES[random.below(ANATOMIES.len())];
    let tree = anatomy::tree(name).ok_or_else(|| Error::parameter("vessel", name, "is not built in"))?;
    let target = &tree.targets()[random.below(tree.targets().len())];
    let scale = between(random, [0.8, 1.2]);
    let mut rows = vec![target.row];
    loop {
        let node = &tree.nodes()[rows[rows.len() - 1]];
        match node.parent {
            Some(parent) if node.radius_mm > BRANCH * tree.nodes()[parent].radius_mm => rows.push(parent),
            _ => break,
        }
    }
    let node = |(place, row): (usize, usize)| {
        let node = tree.nodes()[row];
        let parent = place.checked_sub(1);
        CentrelineNode { position_mm: scale * node.position_mm, radius_mm: scale * node.radius_mm, parent }
    };
    let nodes = rows.into_iter().rev().enumerate().map(node).collect();
    Ok((format!("{name} to {} × {scale:.2}", target.name), nodes))
}

/// A tube of one to four bends in any planes.
fn tube(random: &mut Noise) -> (String, Vec<CentrelineNode>) {
    let radius_mm = between(random, LUMEN_MM);
    let least_mm = BEND_RADII * radius_mm;
    let mut points = vec![Vec3::zeros()];
    let mut bends = 0;
    for _ in 0..COURSES {
        points = vec![Vec3::zeros()];
        bends = 1 + random.below(4);
        let mut along = Vec3::z();
        straight(&mut points, along, between(random, [10.0, 40.0]));
        for _ in 0..bends {
            let bend_mm = least_mm + (BEND_MOST_MM - least_mm) * between(random, [0.0, 1.0]).powi(2);
            along =
                bend(&mut points, along, bend_mm, between(random, [0.3, 2.0]), between(random, [0.0, TAU]));
            straight(&mut points, along, between(random, [5.0, 40.0]));
        }
        if is_clear(&points, least_mm) {
            break;
        }
    }
    let node =
        |(k, position_mm): (usize, Vec3)| CentrelineNode { position_mm, radius_mm, parent: k.checked_sub(1) };
    (format!("tube of {radius_mm:.2} mm, {bends} bends"), points.into_iter().enumerate().map(node).collect())
}

fn straight(points: &mut Vec<Vec3>, along: Vec3, length_mm: f64) {
    let (from, count) = (points[points.len() - 1], (length_mm / SPACING_MM).ceil());
    points.extend((1..=count as usize).map(|k| from + along * (length_mm * k as f64 / count)));
}

/// Goes on around a bend in a plane turned by `plane_rad`; the direction after it.
fn bend(points: &mut Vec<Vec3>, along: Vec3, bend_mm: f64, turn_rad: f64, plane_rad: f64) -> Vec3 {
    let from = points[points.len() - 1];
    let one = along.cross(&Vec3::ith_axis(along.iamin())).normalize();
    let across = plane_rad.cos() * one + plane_rad.sin() * along.cross(&one);
    let count = (bend_mm * turn_rad / SPACING_MM).ceil();
    points.extend((1..=count as usize).map(|k| {
        let (sin, cos) = (turn_rad * k as f64 / count).sin_cos();
        from + along * (bend_mm * sin) + across * (bend_mm * (1.0 - cos))
    }));
    along * turn_rad.cos() + across * turn_rad.sin()
}

/// Whether no two places of a course are nearer than this but for those that follow each other.
fn is_clear(points: &[Vec3], apart_mm: f64) -> bool {
    let after = (3.0 * apart_mm / SPACING_MM) as usize;
    (0..points.len()).all(|k| {
        points[(k + after).min(points.len())..].iter().all(|x| (x - points[k]).norm() > 1.3 * apart_mm)
    })
}

/// Narrows a vessel at a random place away from its ends; says how.
fn stenosis(random: &mut Noise, nodes: &mut [CentrelineNode]) -> String {
    let mut arcs = vec![0.0];
    for pair in nodes.windows(2) {
        arcs.push(arcs[arcs.len() - 1] + (pair[1].position_mm - pair[0].position_mm).norm());
    }
    let length_mm = arcs[arcs.len() - 1];
    let at_mm = between(random, [0.2, 0.85]) * length_mm;
    let (left, half_mm) = (between(random, LEFT), between(random, HALF_LENGTH_MM));
    for (node, arc_mm) in nodes.iter_mut().zip(&arcs) {
        let off = ((arc_mm - at_mm) / half_mm).clamp(-1.0, 1.0);
        node.radius_mm *= 1.0 - (1.0 - left) * 0.5 * (1.0 + (0.5 * TAU * off).cos());
    }
    format!(", {left:.2} left at {at_mm:.0} mm")
}
