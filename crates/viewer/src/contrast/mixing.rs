//! Mixing of blood: the shares of the tree's points at a position in the lumen.
//!
//! Blood is mixed across a vessel and from a trunk into its branches, so the composition at a position is a mean over
//! nearby points. The closeness to a point of radius r is measured by its power over the radius, p = (|x − c|² −
//! r²)/r, which is smallest for the vessel containing the position. Shares decrease from that smallest p to zero with
//! the difference, so they are continuous everywhere: along a vessel, and from one into another. Only points
//! connected by a short path through the tree have shares: a vessel that merely passes by has none.

use endowire_core::Vec3;
use rustc_hash::FxHashMap;

use super::flow::{Link, Node};
use crate::tails::{fade_mm, left};

/// Difference of p over which shares decrease to zero, mm: medium released at a position is mixed with the blood of a
/// vessel of radius r over √(20 r) on either side.
const MIXED_MM: f64 = 20.0;
/// Smallest radius used in mixing, since points are 2 mm apart.
const THINNEST_MM: f64 = 1.0;
/// Longest step along a line of queries, and side of the cells that cache their nearest point, mm.
pub(super) const STEP_MM: f64 = 1.25;

/// The shares of a tree's points.
#[derive(Debug)]
pub(super) struct Mixing {
    points: Vec<Point>,
    /// Place, radius and number of the points that are no ends, beside each other: all of them are asked for each cell.
    inner: Vec<([f64; 4], u32)>,
    /// The ends.
    ends: Vec<u32>,
    /// The nearest point of each cached cell.
    cells: FxHashMap<[i32; 3], u32>,
}

#[derive(Debug)]
struct Point {
    position_mm: Vec3,
    radius_mm: f64,
    /// Outward direction at an end of the tree, including the inlet: beyond it medium fades.
    outward: Option<Vec3>,
    /// Points that may have a share where this is nearest.
    about: Vec<u32>,
}

impl Point {
    /// The power over the radius: of an end the least along the line by which it continues.
    fn power_mm(&self, place: &Vec3) -> f64 {
        let mut off = place - self.position_mm;
        if let Some(outward) = self.outward {
            off -= outward * off.dot(&outward).clamp(0.0, fade_mm(self.radius_mm));
        }
        (off.norm_squared() - self.radius_mm * self.radius_mm) / self.radius_mm.max(THINNEST_MM)
    }

    /// 1 within the tree, decreasing beyond its end.
    fn left(&self, place: &Vec3) -> f64 {
        let Some(outward) = self.outward else { return 1.0 };
        left((place - self.position_mm).dot(&outward) / fade_mm(self.radius_mm))
    }
}

impl Mixing {
    pub(super) fn new(nodes: &[Node], links: &[Link]) -> Self {
        let mut neighbours: Vec<Vec<usize>> = vec![vec![]; nodes.len()];
        let sides = nodes.iter().enumerate().filter_map(|(i, node)| Some((i, node.upstream?)));
        for (i, other) in sides.chain(links.iter().map(|link| (link.from, link.to))) {
            neighbours[i].push(other);
            neighbours[other].push(i);
        }
        let point = |i: usize| {
            let outward = match neighbours[i][..] {
                [only] => (nodes[i].position_mm - nodes[only].position_mm).try_normalize(0.0),
                _ => None,
            };
            let Node { position_mm, radius_mm, .. } = nodes[i];
            Point { position_mm, radius_mm, outward, about: about(nodes, &neighbours, i) }
        };
        let points: Vec<Point> = (0..nodes.len()).map(point).collect();
        let (mut inner, mut ends) = (vec![], vec![]);
        for (number, point) in (0..).zip(&points) {
            let [x, y, z] = point.position_mm.into();
            match point.outward {
                None => inner.push(([x, y, z, point.radius_mm], number)),
                Some(_) => ends.push(number),
            }
        }
        Self { points, inner, ends, cells: FxHashMap::default() }
    }

    /// Sets `shares` to those of a position. Their sum is 1, or less beyond the ends of the tree.
    pub(super) fn shares(&self, place: &Vec3, shares: &mut Vec<(u32, f32)>) {
        let cell = cell(place);
        let nearest = self.cells.get(&cell).copied().unwrap_or_else(|| self.nearest(cell));
        shares.clear();
        let about = &self.points[nearest as usize].about;
        shares.extend(about.iter().map(|&i| (i, self.points[i as usize].power_mm(place) as f32)));
        let least = shares.iter().map(|share| share.1).fold(f32::INFINITY, f32::min);
        let weight = |power: f32| (1.0 - (power - least) / MIXED_MM as f32).max(0.0).powi(2);
        shares.iter_mut().for_each(|share| share.1 = weight(share.1));
        shares.retain(|share| share.1 > 0.0);
        let all: f32 = shares.iter().map(|share| share.1).sum();
        let each = self.points[nearest as usize].left(place) as f32 / all;
        shares.iter_mut().for_each(|share| share.1 *= each);
    }

    /// Caches the nearest point for all queries in the cell of a position.
    pub(super) fn remember(&mut self, place: &Vec3) {
        let cell = cell(place);
        if !self.cells.contains_key(&cell) {
            let nearest = self.nearest(cell);
            self.cells.insert(cell, nearest);
        }
    }

    /// The point nearest to the middle of a cell.
    fn nearest(&self, cell: [i32; 3]) -> u32 {
        let middle = Vec3::from(cell.map(|i| (f64::from(i) + 0.5) * STEP_MM));
        let mut best = (f64::INFINITY, 0);
        for &([x, y, z, radius_mm], number) in &self.inner {
            let squared = (middle.x - x).powi(2) + (middle.y - y).powi(2) + (middle.z - z).powi(2);
            let power = (squared - radius_mm * radius_mm) / radius_mm.max(THINNEST_MM);
            if power < best.0 {
                best = (power, number);
            }
        }
        for &number in &self.ends {
            let power = self.points[number as usize].power_mm(&middle);
            if power < best.0 {
                best = (power, number);
            }
        }
        best.1
    }
}

fn cell(place: &Vec3) -> [i32; 3] {
    [place.x, place.y, place.z].map(|x| (x / STEP_MM).floor() as i32)
}

/// The points on short paths from a point: within reach of shares in the wider of both, plus a radius, since a branch
/// starts in the middle of its trunk.
fn about(nodes: &[Node], neighbours: &[Vec<usize>], from: usize) -> Vec<u32> {
    let reach = |i: usize| {
        let radius = nodes[from].radius_mm.max(nodes[i].radius_mm).max(THINNEST_MM);
        (MIXED_MM * radius).sqrt() + radius
    };
    let mut found = vec![from as u32];
    let mut open = vec![(from, usize::MAX, 0.0)];
    while let Some((at, before, way_mm)) = open.pop() {
        for &next in neighbours[at].iter().filter(|&&next| next != before) {
            let way_mm = way_mm + (nodes[next].position_mm - nodes[at].position_mm).norm();
            // By the two arms of a small ring a point may be reached twice.
            if way_mm <= reach(next) && !found.contains(&(next as u32)) {
                found.push(next as u32);
                open.push((next, at, way_mm));
            }
        }
    }
    found
}
