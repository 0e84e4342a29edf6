//! A centre-line tree directed from its inlet, and how the flow divides in it.
//!
//! Blood enters at the inlet and divides at bifurcations in proportion to radiusⁿ: n = 2 gives all branches the same mean velocity, as in
//! large arteries, n = 3 is Murray's law for small ones (Proceedings of the National Academy of Sciences 12, 1926). What a sac takes in
//! comes back: it has a share of its own, and the other branches divide the whole.

use crate::vessel::{CentrelineNode, CentrelineTree};
use crate::{Error, Result, Vec3, error};

/// An inlet is at most so many radii from the end that it tells.
const INLET_RADII: f64 = 5.0;
/// Points are set at most this far apart, mm.
const SPACING_MM: f64 = 2.0;
/// Most points: every cell of a lumen asks all of them which is nearest.
const MOST_NODES: f64 = 50_000.0;
/// Ends of at least this part of the widest's radius are about as wide.
const ABOUT_AS_WIDE: f64 = 0.95;

/// Part of the flow past a sac that turns around in it: an estimate.
const EXCHANGE: f64 = 0.2;

/// A point of the tree, after those upstream of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowNode {
    /// Position, mm.
    pub position_mm: Vec3,
    /// Radius of the lumen, mm.
    pub radius_mm: f64,
    /// The point before it, towards the inlet; none of the inlet.
    pub upstream: Option<usize>,
    /// Share of the inflow that passes here.
    pub share: f64,
    /// Distance from the point before, mm.
    pub length_mm: f64,
    /// Radius where the stretch from the point before begins, mm: a side branch begins with its own in the middle of the trunk, …
    pub from_radius_mm: f64,
    /// … and this says whether it is still within that.
    pub within_trunk: bool,
}

/// The points of a tree and some between them, from the inlet downstream.
///
/// # Errors
/// A tree of too many points, one that has no end, and an inlet that is not next to the end nearest to it; `keys` are those that gave the tree
/// and the inlet.
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
        let mend = format!(
            "with a point each {SPACING_MM} mm it has {count:.0} points, at most {MOST_NODES} are followed: mend the unit (mm), or \
             leave out branches or points"
        );
        return Err(Error::parameter(keys[0], format!("{} rows", points.len()), mend));
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
        let mend = format!(
            "the nearest end of the centre line, at {}, is {:.3} mm away, and at most {INLET_RADII} of its radii may be: give a \
             place next to the end where blood comes in",
            error::vector(&position_mm),
            away_mm(&near)
        );
        return Err(Error::parameter(keys[1], error::vector(&near), mend));
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
    // Points whose downstream neighbours are still to come, with the point before and the node they became.
    let mut open = vec![(inlet, usize::MAX, 0_usize)];
    while let Some((at, before, becomes)) = open.pop() {
        let onwards: Vec<usize> = neighbours[at].iter().copied().filter(|&n| n != before).collect();
        let weight = |i: usize| libm::pow(points[i].radius_mm, split_exponent);
        // Within a sac all is of it.
        let is_sac = |i: usize| in_sac[i] && !in_sac[at];
        let total: f64 = onwards.iter().filter(|&&i| !is_sac(i)).map(|&i| weight(i)).sum();
        let widest = onwards.iter().map(|&i| points[i].radius_mm).fold(0.0, f64::max);
        for &next in &onwards {
            let part = if is_sac(next) { EXCHANGE } else { weight(next) / total };
            let share = nodes[becomes].share * part;
            let ((x0, r0), (x1, r1)) = (place(at), place(next));
            // A side branch begins where it leaves the trunk, and has its own radius from there on.
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

/// The end where an artery is supplied: the widest, and of those about as wide the one nearest to the head.
fn supplying(points: &[CentrelineNode], ends: impl Iterator<Item = usize> + Clone) -> Option<usize> {
    let widest = ends.clone().map(|i| points[i].radius_mm).fold(0.0, f64::max);
    let wide = ends.filter(|&i| points[i].radius_mm >= ABOUT_AS_WIDE * widest);
    wide.max_by(|&a, &b| points[a].position_mm.z.total_cmp(&points[b].position_mm.z))
}
