//! The arms of rings that the tree of a centre line leaves out.
//!
//! The cheapest ways from the root reach every sphere by one arm of a ring. Where the ways to two overlapping spheres
//! close a ring ([`super::classes`]), both of them are followed to the tree: what lies between is the missing arm. It
//! is joined to the tree where it leaves it, as any branch, and its end by a link to the point where it meets the tree
//! again.

use super::classes::{Class, Classes};
use super::growing::Growing;
use super::line;
use super::lumen::{Lumen, Sphere, Spheres};
use super::ways::{Beside, Ways};
use super::{SPACINGS, Target};
use crate::vessel::CentrelineLink;

/// The arms that were added to a tree.
#[derive(Default)]
pub(super) struct Arms {
    pub(super) links: Vec<CentrelineLink>,
    /// The middle of each, by name.
    pub(super) targets: Vec<Target>,
}

/// Radius, over that of the widest sphere, of gaps beside bodies in the lumen that count as closed: flaps are drawn up to
/// the wall, and seldom into it.
const GAP: f64 = 0.15;
/// By how much of the smaller radius spheres may be farther apart than the larger radius: nearly until they no longer
/// overlap. Few spheres lie about the edge of a flap.
const OVERLAP: f64 = 0.9;
/// Largest number of arms beside bodies in the lumen.
const MOST_BESIDE: usize = 8;

/// The rings to look for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Rings {
    /// As many as the surface has handles.
    Handles(usize),
    /// Beside bodies in the lumen, which nearly touch the wall: at least as many as there are handles.
    Beside(usize),
}

impl Rings {
    fn least(self) -> usize {
        match self {
            Self::Handles(count) | Self::Beside(count) => count,
        }
    }
}

/// Adds the arms of rings to the tree from `root`; fewer than wanted if fewer are found.
pub(super) fn add(lumen: &Lumen<'_>, root: Sphere, wanted: Rings, tree: &mut Growing) -> Arms {
    let mut best: Option<(Spheres, Ways, Classes, Vec<[usize; 2]>)> = None;
    for spacing in SPACINGS {
        let mut spheres = Spheres::default();
        let all = lumen.spheres(spacing);
        // The largest come first.
        let least_mm = match wanted {
            Rings::Beside(_) => GAP * all.first().map_or(0.0, |sphere| sphere.radius_mm),
            Rings::Handles(_) => 0.0,
        };
        let wide = all.into_iter().filter(|sphere| sphere.radius_mm >= least_mm);
        [root].into_iter().chain(wide).for_each(|sphere| spheres.push(sphere));
        let beside = Beside::new(&spheres, lumen, OVERLAP);
        let ways = Ways::from(0, &spheres, &beside);
        let Some(classes) = Classes::new(&beside, &ways) else { break };
        let rings = classes.rings(&ways);
        // Few spheres leave gaps that look like rings: then more of them tell. Beside bodies any number may be right.
        let least = wanted.least().max(1);
        let is_right = match wanted {
            Rings::Handles(count) => rings.len() == count,
            Rings::Beside(_) => rings.len() >= least,
        };
        let is_better = best.as_ref().is_none_or(|best| {
            let (now, before) = (rings.len(), best.3.len());
            if before < least { now > before } else { (least..before).contains(&now) }
        });
        if is_better {
            best = Some((spheres, ways, classes, rings));
        }
        if is_right {
            break;
        }
    }
    let Some((spheres, ways, classes, rings)) = best else { return Arms::default() };
    let mut adding =
        Adding { lumen, tree, spheres: &spheres, classes: &classes, rows: Vec::new(), ends: Vec::new() };
    let mut arms = Arms::default();
    let most = match wanted {
        Rings::Handles(count) => count,
        Rings::Beside(count) => count.max(MOST_BESIDE),
    };
    for ring in rings.into_iter().take(most) {
        let [Some(from), Some(to)] = ring.map(|end| ways.to(end)) else { continue };
        let Some((first, link)) = adding.add(&from, &to) else { continue };
        adding.ends.push(link.row);
        arms.links.push(link);
        let name = format!("arm {}", arms.links.len());
        arms.targets.push(Target { name, row: first + (link.row - first) / 2 });
    }
    arms
}

/// A tree to which arms are added.
struct Adding<'a> {
    lumen: &'a Lumen<'a>,
    tree: &'a mut Growing,
    spheres: &'a Spheres,
    classes: &'a Classes,
    /// For each row of the tree the sphere that it is deepest in, and the class of the way to it through the tree
    /// with the cheapest way to that sphere; `None` after a gap between spheres.
    rows: Vec<(usize, Option<Class>)>,
    /// The last rows of the arms so far.
    ends: Vec<usize>,
}

impl Adding<'_> {
    /// Adds the arm between the ends of two ways from the root; its first row, and the link at its end. The tree stays
    /// as it is if there is none.
    fn add(&mut self, from: &[usize], to: &[usize]) -> Option<(usize, CentrelineLink)> {
        let before = self.tree.nodes.len();
        let added = self.added(from, to);
        if added.is_none() {
            self.tree.forget_after(before);
            self.rows.truncate(before);
        }
        added
    }

    fn added(&mut self, from: &[usize], to: &[usize]) -> Option<(usize, CentrelineLink)> {
        self.know_rows();
        // A ring on a branch that the tree does not have: first the branch.
        let shared = from.iter().zip(to).take_while(|(a, b)| a == b).count();
        let (entry, left) = self.leaves(&from[..shared]);
        let mut stem_end = None;
        if left < shared {
            let stem = self.of(&from[left..shared]);
            let stem = line::centred(self.lumen, &line::divided(&stem), [false; 2]);
            stem_end = self.tree.join(Some(self.open(entry)), &stem);
            self.know_rows();
        }
        let ((mut start, a), (mut end, b)) = (self.leaves(from), self.leaves(to));
        let mut way: Vec<usize> = from[a..].to_vec();
        way.extend(to[b..].iter().rev());
        if self.away_mm(end) < self.away_mm(start) {
            std::mem::swap(&mut start, &mut end);
            way.reverse();
        }
        let fine = line::divided(&self.of(&way));
        let holding: Vec<Option<usize>> =
            fine.iter().map(|point| self.tree.holding(&point.centre_mm)).collect();
        let leading = holding.iter().take_while(|row| row.is_some()).count();
        let own = match leading == fine.len() {
            // All of it is near the tree: a short arm.
            true => fine.len() / 2..(fine.len() / 2 + 1).min(fine.len()),
            false => leading..fine.len() - holding.iter().rev().take_while(|row| row.is_some()).count(),
        };
        let first = self.tree.nodes.len();
        let arm = line::centred(self.lumen, fine.get(own).filter(|own| !own.is_empty())?, [false; 2]);
        let backwards: Vec<Sphere> = arm.iter().rev().copied().collect();
        start = self.tree.joint(self.lumen, line::behind(&arm)?, arm.first()?).unwrap_or(start);
        end = self.tree.joint(self.lumen, line::behind(&backwards)?, arm.last()?).unwrap_or(end);
        if let Some(fork) = stem_end {
            // The stem ends where the ways part: nothing of it may be left over as an end.
            (start, end) = (fork, fork);
        }
        let row = self.tree.join(Some(self.open(start)), &arm).filter(|row| *row >= first)?;
        // A point that begins and ends at the same row is no arm.
        if self.tree.nodes[row].parent == Some(end) {
            return None;
        }
        Some((first, CentrelineLink { row, joins: end }))
    }

    /// The row, or the one before it if it is the last of an arm, which it stays.
    fn open(&self, row: usize) -> usize {
        let before = self.tree.nodes[row].parent.filter(|_| self.ends.contains(&row));
        before.unwrap_or(row)
    }

    fn of(&self, way: &[usize]) -> Vec<Sphere> {
        way.iter().map(|sphere| self.spheres.all[*sphere]).collect()
    }

    /// The length of the tree from the root to a row, mm.
    fn away_mm(&self, row: usize) -> f64 {
        let nodes = &self.tree.nodes;
        let rows = std::iter::successors(Some(row), |row| nodes[*row].parent);
        let step = |row: usize| {
            nodes[row].parent.map(|before| (nodes[before].position_mm - nodes[row].position_mm).norm())
        };
        rows.filter_map(step).sum()
    }

    /// The last row that holds a point of a way from the root, and lies on the same side of all rings as the way does
    /// there, and the number of points of the way up to it.
    fn leaves(&self, way: &[usize]) -> (usize, usize) {
        for (k, &sphere) in way.iter().enumerate().rev() {
            let x = self.spheres.all[sphere].centre_mm;
            let holds = |row: &usize| {
                let node = &self.tree.nodes[*row];
                let (own, class) = self.rows[*row];
                (node.position_mm - x).norm() < node.radius_mm
                    && class.is_some_and(|class| self.classes.between(own, sphere) == Some(class))
            };
            let away_mm = |row: usize| (self.tree.nodes[row].position_mm - x).norm();
            let held = (0..self.rows.len()).filter(holds);
            if let Some(row) = held.min_by(|a, b| away_mm(*a).total_cmp(&away_mm(*b))) {
                return (row, k + 1);
            }
        }
        (0, 0)
    }

    /// Finds the spheres and classes of rows that are new.
    fn know_rows(&mut self) {
        for row in self.rows.len()..self.tree.nodes.len() {
            let node = self.tree.nodes[row];
            let own = match node.parent {
                None => 0,
                Some(_) => self.spheres.deepest(&node.position_mm).unwrap_or(0),
            };
            let class = node.parent.map_or(Some(0), |before| {
                let (sphere, class) = self.rows[before];
                Some(class? ^ self.classes.between(sphere, own)?)
            });
            self.rows.push((own, class));
        }
    }
}
