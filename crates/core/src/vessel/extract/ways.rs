//! The paths through spheres with the smallest integral of 1/radius.
//!
//! Antiga, Ene-Iordache and Remuzzi, "Computational geometry for patient-specific reconstruction and meshing of blood
//! vessels from MR and CT angiography", IEEE Transactions on Medical Imaging 22, 2003: a centre line is the path with
//! the smallest ∫ ds/R, R being the radius of the inscribed sphere. Shortest paths by Dijkstra's method.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::lumen::{Lumen, Sphere, Spheres};

/// The shortest paths from one sphere to all others.
pub(super) struct Ways {
    /// The sphere before each on its path; its own index for the first, `None` if not reached.
    before: Vec<Option<usize>>,
    cost: Vec<f64>,
    /// The spheres that are reached, the cheapest first.
    order: Vec<usize>,
}

/// The end of a path, cheapest first.
#[derive(PartialEq)]
struct Reached {
    cost: f64,
    sphere: usize,
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then_with(|| other.sphere.cmp(&self.sphere))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Number of spheres above which a part is a lumen of its own, and is not joined to others.
const MANY: usize = 200;
/// Largest number of spheres of other parts to which the part of an end is joined, one after the other.
const MOST_JOINTS: usize = 32;

/// The spheres beside each sphere, with which it overlaps.
pub(super) struct Beside(pub(super) Vec<Vec<usize>>);

impl Beside {
    /// Those that are not farther apart than the larger radius and this part of the smaller.
    pub(super) fn new(spheres: &Spheres, lumen: &Lumen<'_>, overlap: f64) -> Self {
        let all = &spheres.all;
        let mut beside: Vec<Vec<usize>> = vec![Vec::new(); all.len()];
        for (k, sphere) in all.iter().enumerate() {
            let is_beside =
                |other: &usize| *other != k && !lumen.leaves(&sphere.centre_mm, &all[*other].centre_mm);
            for other in spheres.overlapping(sphere, overlap).filter(is_beside) {
                beside[k].push(other);
                beside[other].push(k);
            }
        }
        Self(beside)
    }

    /// Joins the parts of the first so many spheres, the ends, to the spheres of other parts that they see, the nearest
    /// first: in a pointed corner no spheres lead from one to the next. Parts of many spheres are left as they are.
    pub(super) fn join_ends(&mut self, count: usize, spheres: &Spheres, lumen: &Lumen<'_>) {
        for end in 0..count.min(spheres.all.len()) {
            for _ in 0..MOST_JOINTS {
                let is_own = self.part(end);
                let own: Vec<usize> = (0..is_own.len()).filter(|k| is_own[*k]).collect();
                if own.len() > MANY {
                    break;
                }
                let nearest = own.iter().filter_map(|from| nearest_seen(*from, &is_own, spheres, lumen));
                let Some((_, from, to)) = nearest.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
                self.0[from].push(to);
                self.0[to].push(from);
            }
        }
    }

    /// Whether each sphere is in the same part as this one.
    fn part(&self, of: usize) -> Vec<bool> {
        let mut is_in = vec![false; self.0.len()];
        let mut open = vec![of];
        while let Some(at) = open.pop() {
            if !std::mem::replace(&mut is_in[at], true) {
                open.extend(&self.0[at]);
            }
        }
        is_in
    }
}

/// The nearest sphere outside a part that one of it sees: the distance, mm, the one and the other.
fn nearest_seen(
    from: usize,
    is_own: &[bool],
    spheres: &Spheres,
    lumen: &Lumen<'_>,
) -> Option<(f64, usize, usize)> {
    let all = &spheres.all;
    let away_mm = |k: usize| (all[k].centre_mm - all[from].centre_mm).norm();
    let mut others: Vec<(f64, usize)> =
        (0..all.len()).filter(|k| !is_own[*k]).map(|k| (away_mm(k), k)).collect();
    others.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let seen = others.into_iter().find(|(_, k)| lumen.sees(&all[from].centre_mm, &all[*k].centre_mm));
    seen.map(|(mm, to)| (mm, from, to))
}

impl Ways {
    pub(super) fn from(first: usize, spheres: &Spheres, beside: &Beside) -> Self {
        let all = &spheres.all;
        let mut cost = vec![f64::INFINITY; all.len()];
        let mut before = vec![None; all.len()];
        (cost[first], before[first]) = (0.0, Some(first));
        let mut open = BinaryHeap::from([Reached { cost: 0.0, sphere: first }]);
        while let Some(at) = open.pop() {
            if at.cost > cost[at.sphere] {
                continue;
            }
            for &next in &beside.0[at.sphere] {
                let through = at.cost + length_over_radius(&all[at.sphere], &all[next]);
                if through < cost[next] {
                    (cost[next], before[next]) = (through, Some(at.sphere));
                    open.push(Reached { cost: through, sphere: next });
                }
            }
        }
        let mut order: Vec<usize> = (0..all.len()).filter(|k| before[*k].is_some()).collect();
        order.sort_by(|a, b| cost[*a].total_cmp(&cost[*b]).then(a.cmp(b)));
        Self { before, cost, order }
    }

    /// The spheres that are reached, the cheapest first.
    pub(super) fn order(&self) -> &[usize] {
        &self.order
    }

    /// The sphere before one on its path; its own index for the first.
    pub(super) fn before(&self, sphere: usize) -> Option<usize> {
        self.before[sphere]
    }

    /// The integral of 1/radius up to a sphere.
    pub(super) fn cost(&self, sphere: usize) -> f64 {
        self.cost[sphere]
    }

    /// The spheres from the first to this one; `None` without a path.
    pub(super) fn to(&self, sphere: usize) -> Option<Vec<usize>> {
        let mut way = vec![sphere];
        loop {
            let last = way[way.len() - 1];
            match self.before[last]? {
                before if before == last => break,
                before => way.push(before),
            }
        }
        way.reverse();
        Some(way)
    }
}

/// ∫ ds/R between two centres, with a linear radius.
fn length_over_radius(a: &Sphere, b: &Sphere) -> f64 {
    let length_mm = (b.centre_mm - a.centre_mm).norm();
    let ratio = b.radius_mm / a.radius_mm;
    let mean_mm = match (ratio - 1.0).abs() < 1e-6 {
        true => a.radius_mm,
        false => (b.radius_mm - a.radius_mm) / libm::log(ratio),
    };
    length_mm / mean_mm
}
