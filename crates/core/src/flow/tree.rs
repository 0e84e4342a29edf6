//! A centre-line tree directed from its inlet, and the division of flow in it.
//!
//! Blood enters at the inlet and divides at bifurcations in proportion to radiusⁿ: n = 2 gives all branches the same
//! mean velocity, as in large arteries, n = 3 is Murray's law for small ones (Proceedings of the National Academy of
//! Sciences 12, 1926). The inflow of a sac comes back: it has a share of its own, and the other branches divide the
//! whole.

use super::OUTSIDE_RADII;
use crate::vessel::{CentrelineNode, CentrelineTree};
use crate::{Error, Result, Vec3, error};

/// Largest distance of a given inlet from its end of the tree, in radii.
const INLET_RADII: f64 = 5.0;
/// Largest distance between points, mm.
const SPACING_MM: f64 = 2.0;
/// Largest number of points: every cell of a lumen searches all of them for the nearest.
const MOST_NODES: f64 = 50_000.0;
/// Ratio of radii from which an end counts as about as wide as the widest.
const ABOUT_AS_WIDE: f64 = 0.95;

/// Fraction of the flow past a sac that circulates through it: an estimate.
const EXCHANGE: f64 = 0.2;

/// A point of the tree; points upstream of it come before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowNode {
    /// Position, mm.
    pub position_mm: Vec3,
    /// Radius of the lumen, mm.
    pub radius_mm: f64,
    /// The point before it, towards the inlet; `None` for the inlet.
    pub upstream: Option<usize>,
    /// Local share of the inflow.
    pub share: f64,
    /// Distance from the point before, mm.
    pub length_mm: f64,
    /// Radius at the start of the stretch from the point before, mm: a side branch starts in the middle of the trunk
    /// with its own radius.
    pub from_radius_mm: f64,
    /// Whether the stretch is still within the trunk.
    pub within_trunk: bool,
}

/// The points of a tree, with intermediate ones, from the inlet downstream.
///
/// # Errors
/// A tree with too many points, or without an end, and an inlet that is not next to its nearest end; `keys` are those
/// that gave the tree and the inlet.
pub fn flow_nodes(
    tree: &CentrelineTree,
    inlet_mm: Option<Vec3>,
    split_exponent: f64,
    keys: [&str; 2],
) -> Result<Vec<FlowNode>> {
    let points = tree.nodes();
    let pieces = |a: &Vec3, b: &Vec3| ((b - a).norm() / SPACING_MM).ceil().max(1.0);
    let parent = |i: usize| points[i].parent.map(|parent| points[parent].position_mm);
    let count: f64 = (0..points.len())
        .filter_map(|i| parent(i).map(|before| pieces(&before, &points[i].position_mm)))
        .sum();
    if count > MOST_NODES {
        let remedy = format!(
            "with a point each {SPACING_MM} mm it has {count:.0} points, at most {MOST_NODES} are followed: mend the unit (mm), or \
             leave out branches or points"
        );
        return Err(Error::parameter(keys[0], format!("{} rows", points.len()), remedy));
    }
    let mut neighbours: Vec<Vec<usize>> = vec![vec![]; points.len()];
    for (i, point) in points.iter().enumerate() {
        if let Some(parent) = point.parent {
            neighbours[i].push(parent);
            neighbours[parent].push(i);
        }
    }
    let in_sac = tree.in_sacs();
    let ends = (0..points.len()).filter(|&i| neighbours[i].len() == 1 && !in_sac[i]);
    let inlet = match inlet_mm {
        None => supplying(points, ends),
        Some(near) => {
            let distance = |i: &usize| (points[*i].position_mm - near).norm();
            ends.min_by(|a, b| distance(a).total_cmp(&distance(b)))
        }
    };
    let inlet = inlet.ok_or_else(|| {
        Error::parameter(keys[0], format!("{} rows", points.len()), "has no end where blood comes in")
    })?;
    let place = |i: usize| (points[i].position_mm, points[i].radius_mm);
    let (position_mm, radius_mm) = place(inlet);
    let away_mm = |near: &Vec3| (position_mm - near).norm();
    if let Some(near) = inlet_mm.filter(|near| away_mm(near) > INLET_RADII * radius_mm) {
        let remedy = format!(
            "the nearest end of the centre line, at {}, is {:.3} mm away, and at most {INLET_RADII} of its radii may be: give a \
             place next to the end where blood comes in",
            error::vector(&position_mm),
            away_mm(&near)
        );
        return Err(Error::parameter(keys[1], error::vector(&near), remedy));
    }
    let mut nodes = vec![FlowNode {
        position_mm,
        radius_mm,
        upstream: None,
        share: 1.0,
        length_mm: 0.0,
        from_radius_mm: radius_mm,
        within_trunk: false,
    }];
    // Points with downstream neighbours to be processed, with the point before and their node.
    let mut open = vec![(inlet, usize::MAX, 0_usize)];
    while let Some((at, before, becomes)) = open.pop() {
        let onwards: Vec<usize> = neighbours[at].iter().copied().filter(|&n| n != before).collect();
        let weight = |i: usize| libm::pow(points[i].radius_mm, split_exponent);
        // Everything within a sac belongs to it.
        let is_sac = |i: usize| in_sac[i] && !in_sac[at];
        let total: f64 = onwards.iter().filter(|&&i| !is_sac(i)).map(|&i| weight(i)).sum();
        let widest = onwards.iter().map(|&i| points[i].radius_mm).fold(0.0, f64::max);
        for &next in &onwards {
            let part = if is_sac(next) { EXCHANGE } else { weight(next) / total };
            let share = nodes[becomes].share * part;
            let ((x0, r0), (x1, r1)) = (place(at), place(next));
            // A side branch starts where it leaves the trunk, and has its own radius from there on.
            let is_side = r1 < widest;
            let steps = pieces(&x0, &x1) as usize;
            let mut last = becomes;
            for k in 1..=steps {
                let w = k as f64 / steps as f64;
                nodes.push(FlowNode {
                    position_mm: x0 + (x1 - x0) * w,
                    radius_mm: if is_side { r1 } else { r0 + (r1 - r0) * w },
                    upstream: Some(last),
                    share,
                    length_mm: (x1 - x0).norm() / steps as f64,
                    from_radius_mm: if is_side { r1 } else { nodes[last].radius_mm },
                    within_trunk: is_side && w * (x1 - x0).norm() < r0,
                });
                last = nodes.len() - 1;
            }
            open.push((next, at, last));
        }
    }
    Ok(nodes)
}

/// Refuses a place so far from the tree that no blood of it flows there; `key` gave the place.
///
/// # Errors
/// [`Error::Parameter`] with the nearest stretch of the tree, relative to its radius, and how far away it is.
pub fn check_place(tree: &CentrelineTree, place_mm: Vec3, key: &str) -> Result<()> {
    let points = tree.nodes();
    // Distance and radius of the stretch from a point's parent, and its nearest place.
    let stretch = |point: &CentrelineNode| {
        let from = point.parent.map_or(point, |parent| &points[parent]);
        let way = point.position_mm - from.position_mm;
        let along = (place_mm - from.position_mm).dot(&way) / way.norm_squared().max(f64::MIN_POSITIVE);
        let along = along.clamp(0.0, 1.0);
        let nearest_mm = from.position_mm + way * along;
        let radius_mm = from.radius_mm + (point.radius_mm - from.radius_mm) * along;
        ((place_mm - nearest_mm).norm(), radius_mm, nearest_mm)
    };
    let in_radii = |one: &(f64, f64, Vec3)| one.0 / one.1;
    let nearest = points.iter().map(stretch).min_by(|a, b| in_radii(a).total_cmp(&in_radii(b)));
    match nearest {
        Some((away_mm, radius_mm, nearest_mm)) if away_mm > OUTSIDE_RADII * radius_mm => {
            let remedy = format!(
                "is {away_mm:.1} mm from the centre line at {}, where the vessel has a radius of {radius_mm:.1} mm: give a place in \
                 the vessel, in mm, at most {OUTSIDE_RADII} radii from its centre line",
                error::vector(&nearest_mm)
            );
            Err(Error::parameter(key, error::vector(&place_mm), remedy))
        }
        _ => Ok(()),
    }
}

/// The inlet end: the widest, or of several about as wide the one nearest to the head.
fn supplying(points: &[CentrelineNode], ends: impl Iterator<Item = usize> + Clone) -> Option<usize> {
    let widest = ends.clone().map(|i| points[i].radius_mm).fold(0.0, f64::max);
    let wide = ends.filter(|&i| points[i].radius_mm >= ABOUT_AS_WIDE * widest);
    wide.max_by(|&a, &b| points[a].position_mm.z.total_cmp(&points[b].position_mm.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_outside_the_vessel_is_refused_and_one_between_two_points_is_not() {
        let node = |x: f64, radius_mm: f64, parent| CentrelineNode {
            position_mm: Vec3::new(x, 0.0, 0.0),
            radius_mm,
            parent,
        };
        let tree = CentrelineTree::new(vec![node(0.0, 10.0, None), node(200.0, 5.0, Some(0))]).unwrap();
        let asked = |x: f64, y: f64| check_place(&tree, Vec3::new(x, y, 0.0), "at_mm");
        assert!(asked(100.0, 0.0).is_ok() && asked(100.0, 14.9).is_ok() && asked(-19.0, 0.0).is_ok());
        let refused = asked(100.0, 15.1).unwrap_err().to_string();
        assert!(refused.starts_with("at_mm = [100, 15.1, 0]: is 15.1 mm from the centre line"), "{refused}");
        assert!(refused.contains("radius of 7.5 mm"), "{refused}");
        assert!(asked(900.0, 0.0).is_err());
    }
}
