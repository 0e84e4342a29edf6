//! A centre-line tree directed from its inlet, and the division of flow in it.
//!
//! Blood enters at the inlet and divides at bifurcations in proportion to radiusⁿ: n = 2 gives all branches the same
//! mean velocity, as in large arteries, n = 3 is Murray's law for small ones (Proceedings of the National Academy of
//! Sciences 12, 1926). The inflow of a sac comes back: it has a share of its own, and the other branches divide the
//! whole.
//!
//! Where branches meet again, each end has the share that it has in the tree without the closing arms: what is beyond
//! an end decides how much it takes, not the way there. The ways there share it by their resistances ([`Rings`]).

use super::OUTSIDE_RADII;
use super::rings::{Rings, resistance_per_mm3};
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
    /// Local share of the inflow; negative where blood flows towards the point before it, as it may in a ring.
    pub share: f64,
    /// Distance from the point before, mm.
    pub length_mm: f64,
    /// Radius at the start of the stretch from the point before, mm: a side branch starts in the middle of the trunk
    /// with its own radius.
    pub from_radius_mm: f64,
    /// Whether the stretch is still within the trunk.
    pub within_trunk: bool,
}

/// The end of an arm that joins another branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowLink {
    /// The last point of the arm.
    pub from: usize,
    /// The point that it joins.
    pub to: usize,
    /// Share of the inflow that leaves the arm there; negative if it enters.
    pub share: f64,
    /// Resistance of the stretch between the two outside the branch that is joined, as [`FlowNode::resistance_per_mm3`].
    pub resistance_per_mm3: f64,
}

/// A centre line directed from its inlet.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowGraph {
    /// Its points; those upstream come before those downstream in the tree.
    pub nodes: Vec<FlowNode>,
    /// Where arms join other branches; empty for a vessel without rings.
    pub links: Vec<FlowLink>,
}

impl FlowNode {
    /// Resistance of the stretch from the point before, without the factor 8 μ/π; 0 within a trunk.
    pub fn resistance_per_mm3(&self) -> f64 {
        match self.within_trunk {
            true => 0.0,
            false => resistance_per_mm3(self.length_mm, [self.from_radius_mm, self.radius_mm]),
        }
    }
}

impl FlowGraph {
    /// The points of a tree, with intermediate ones, from the inlet downstream, and its links.
    ///
    /// # Errors
    /// A tree with too many points, or without an end, and an inlet that is not next to its nearest end; `keys` are those
    /// that gave the tree and the inlet.
    pub fn new(
        tree: &CentrelineTree,
        inlet_mm: Option<Vec3>,
        split_exponent: f64,
        keys: [&str; 2],
    ) -> Result<Self> {
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
        let is_joined = |i: usize| tree.links().iter().any(|link| link.row == i || link.joins == i);
        let is_end = |i: usize| neighbours[i].len() == 1 && !is_joined(i);
        let ends = (0..points.len()).filter(|&i| is_end(i) && !in_sac[i]);
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
        let supplies = supplying_points(&neighbours, inlet, is_end);
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
        let mut node_of = vec![0; points.len()];
        while let Some((at, before, becomes)) = open.pop() {
            node_of[at] = becomes;
            let onwards: Vec<usize> = neighbours[at].iter().copied().filter(|&n| n != before).collect();
            let weight = |i: usize| libm::pow(points[i].radius_mm, split_exponent);
            // Everything within a sac belongs to it.
            let is_sac = |i: usize| in_sac[i] && !in_sac[at];
            let total: f64 = onwards.iter().filter(|&&i| supplies[i] && !is_sac(i)).map(|&i| weight(i)).sum();
            let widest = onwards.iter().map(|&i| points[i].radius_mm).fold(0.0, f64::max);
            for &next in &onwards {
                let part = match supplies[next] {
                    false => 0.0,
                    true if is_sac(next) => EXCHANGE,
                    true => weight(next) / total,
                };
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
        let links = tree.links().iter().map(|link| join(&mut nodes, node_of[link.row], node_of[link.joins]));
        let links = links.collect();
        let mut graph = Self { nodes, links };
        graph.settle();
        Ok(graph)
    }

    /// Its rings.
    fn rings(&self) -> Rings {
        let upstream: Vec<Option<usize>> = self.nodes.iter().map(|node| node.upstream).collect();
        let links: Vec<[usize; 2]> = self.links.iter().map(|link| [link.from, link.to]).collect();
        let nodes = self.nodes.iter().map(FlowNode::resistance_per_mm3);
        let resistances = nodes.chain(self.links.iter().map(|link| link.resistance_per_mm3)).collect();
        Rings::new(&upstream, &links, resistances)
    }

    /// Divides the shares among the arms of rings.
    fn settle(&mut self) {
        if self.links.is_empty() {
            return;
        }
        let rings = self.rings();
        let shares = self.nodes.iter().map(|node| node.share).chain(self.links.iter().map(|link| link.share));
        let mut shares: Vec<f64> = shares.collect();
        rings.settle(&mut shares);
        let (of_nodes, of_links) = shares.split_at(self.nodes.len());
        self.nodes.iter_mut().zip(of_nodes).for_each(|(node, share)| node.share = *share);
        self.links.iter_mut().zip(of_links).for_each(|(link, share)| link.share = *share);
    }
}

/// Whether each point is on the way from the inlet to an end, in the tree without links.
fn supplying_points(neighbours: &[Vec<usize>], inlet: usize, is_end: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut order = vec![(inlet, usize::MAX)];
    let mut k = 0;
    while let Some(&(at, before)) = order.get(k) {
        order.extend(neighbours[at].iter().filter(|next| **next != before).map(|next| (*next, at)));
        k += 1;
    }
    let mut supplies = vec![false; neighbours.len()];
    for (at, before) in order.into_iter().skip(1).rev() {
        supplies[at] |= is_end(at);
        supplies[before] |= supplies[at];
    }
    supplies
}

/// Adds the points of the stretch by which an arm joins a branch, up to the last before it.
fn join(nodes: &mut Vec<FlowNode>, arm: usize, joined: usize) -> FlowLink {
    let (a, b) = (nodes[arm], nodes[joined]);
    let whole_mm = (b.position_mm - a.position_mm).norm();
    let steps = (whole_mm / SPACING_MM).ceil().max(1.0) as usize;
    let radius_mm = a.radius_mm.min(b.radius_mm);
    let length_mm = whole_mm / steps as f64;
    let mut from = arm;
    for k in 1..steps {
        let w = k as f64 / steps as f64;
        nodes.push(FlowNode {
            position_mm: a.position_mm + (b.position_mm - a.position_mm) * w,
            radius_mm,
            upstream: Some(from),
            share: 0.0,
            length_mm,
            from_radius_mm: radius_mm,
            within_trunk: (1.0 - w) * whole_mm < b.radius_mm,
        });
        from = nodes.len() - 1;
    }
    let outside_mm = (length_mm - b.radius_mm).max(0.0);
    FlowLink {
        from,
        to: joined,
        share: 0.0,
        resistance_per_mm3: resistance_per_mm3(outside_mm, [radius_mm; 2]),
    }
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
    use crate::vessel::{CentrelineLink, CentrelineNode};

    /// A ring of arms of 40 and 120 mm between an inlet and an outlet of 30 mm; the long arm is this wide.
    fn ring(long_mm: f64) -> CentrelineTree {
        let places = [
            ([0.0, 0.0], 3.0, None),
            ([30.0, 0.0], 3.0, Some(0)),
            ([70.0, 0.0], 3.0, Some(1)),
            ([100.0, 0.0], 3.0, Some(2)),
            ([30.0, 40.0], long_mm, Some(1)),
            ([70.0, 40.0], long_mm, Some(4)),
        ];
        let node = |&([x, y], radius_mm, parent): &([f64; 2], f64, Option<usize>)| CentrelineNode {
            position_mm: Vec3::new(x, y, 0.0),
            radius_mm,
            parent,
        };
        let tree = CentrelineTree::new(places.iter().map(node).collect()).unwrap();
        tree.with_links(vec![CentrelineLink { row: 5, joins: 2 }]).unwrap()
    }

    /// The shares in the middle of the short and of the long arm.
    fn shares(tree: &CentrelineTree, inlet_mm: Option<Vec3>) -> [f64; 2] {
        let graph = FlowGraph::new(tree, inlet_mm, 3.0, ["a", "b"]).unwrap();
        let near = |x: f64, y: f64| {
            let away = |node: &&FlowNode| (node.position_mm - Vec3::new(x, y, 0.0)).norm();
            graph.nodes.iter().min_by(|a, b| away(a).total_cmp(&away(b))).unwrap().share
        };
        [near(50.0, 0.0), near(50.0, 40.0)]
    }

    #[test]
    fn arms_share_the_stream_as_their_conductances() {
        // Both leave the trunk at its edge: a side branch has its own radius from there on.
        let [short, long] = shares(&ring(2.0), Some(Vec3::zeros()));
        let conductance = |length_mm: f64, radius_mm: f64| radius_mm.powi(4) / length_mm;
        // Points are at most 2 mm apart, and the first and last within the trunk have no resistance.
        let part = conductance(120.0 - 2.0 * 3.0, 2.0) / conductance(40.0, 3.0);
        assert!((long / short / part - 1.0).abs() < 0.04, "{long} {short} {part}");
        assert!((short + long - 1.0).abs() < 1e-12);
        // The twin: a wider arm takes more.
        assert!((shares(&ring(2.2), Some(Vec3::zeros()))[1] / long - 1.1_f64.powi(4)).abs() < 0.1);
        // From the other end blood flows against the order of the tree, by the same parts.
        let [back, arm] = shares(&ring(2.0), Some(Vec3::new(100.0, 0.0, 0.0)));
        assert!((back - short).abs() < 0.01 && (arm.abs() - long).abs() < 0.01, "{back} {arm}");
    }

    #[test]
    fn without_its_link_an_arm_is_a_branch_with_an_end() {
        let open = ring(2.0).with_links(vec![]).unwrap();
        let [short, long] = shares(&open, Some(Vec3::zeros()));
        assert!((long - 8.0 / 35.0).abs() < 1e-12 && (short - 27.0 / 35.0).abs() < 1e-12, "{short} {long}");
    }

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
