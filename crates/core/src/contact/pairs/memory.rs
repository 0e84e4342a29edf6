//! Finding the pairs at a base, and keeping the forces of those of the base before, also from part to part.
//!
//! From part to part a pair is known by how far its two points are from the end of the last rod. There the tip of the
//! line and the coils behind it keep their places when a hand pushes.

use serde::{Deserialize, Serialize};

use super::curve::{Curve, Place};
use super::friction::PairFriction;
use super::gap::{Gap, reach};
use super::{Difference, Pair, SelfContact, Site, tree};
use crate::contact::set::penalty_n_per_mm;
use crate::rod::{ElementData, RodState};

/// A pair of the base before.
#[derive(Debug, Clone, Copy)]
pub(super) struct Remembered {
    site: usize,
    /// Arc length of the nearest point of the stretch, mm.
    arc_mm: f64,
    force_n: f64,
    friction: PairFriction,
}

/// The force of a pair at the end of a part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct PairForce {
    /// Distances of the site and of the nearest point of the stretch from the end of the last rod, along all rods, mm.
    from_end_mm: [f64; 2],
    force_n: f64,
}

impl PairForce {
    /// Whether its numbers are finite: a file may contain anything.
    pub(crate) fn is_finite(&self) -> bool {
        self.force_n.is_finite() && self.from_end_mm.iter().all(|mm| mm.is_finite())
    }
}

impl SelfContact {
    /// Stores the forces at the base.
    pub(crate) fn keep(&self, into: &mut Vec<PairForce>) {
        into.clear();
        let whole_mm = self.tree.length();
        into.extend(self.pairs.iter().filter(|pair| pair.force_n > 0.0).map(|pair| {
            let place = self.sites[pair.site].place;
            let from_end_mm = [self.tree.arc(place.element, place.xi), pair.arc_mm].map(|arc| whole_mm - arc);
            PairForce { from_end_mm, force_n: pair.force_n }
        }));
    }

    /// Begins with the forces of an earlier part; call it after [`Self::renew`] and [`Self::begin_friction`].
    pub(crate) fn recall(&mut self, elements: &[ElementData], kept: &[PairForce]) {
        if kept.is_empty() {
            return;
        }
        let mut whole_mm = 0.0;
        let starts_mm = elements.iter().map(|element| {
            let length_mm = tree::arc_mm(element);
            whole_mm += length_mm;
            whole_mm - length_mm
        });
        let starts_mm: Vec<f64> = starts_mm.collect();
        let arc_mm = |site: &Site| {
            let Place { element, xi } = site.place;
            starts_mm[element] + xi * elements[element].length
        };
        for PairForce { from_end_mm, force_n } in kept {
            let [here_mm, other_mm] = from_end_mm.map(|mm| whole_mm - mm);
            let next = self.sites.partition_point(|site| arc_mm(site) < here_mm);
            let around = next.saturating_sub(1)..(next + 1).min(self.sites.len());
            let off_mm = |site: &usize| (arc_mm(&self.sites[*site]) - here_mm).abs();
            if let Some(site) = around.min_by(|a, b| off_mm(a).total_cmp(&off_mm(b))) {
                let (arc_mm, force_n, friction) = (other_mm, *force_n, self.recalled_friction(*force_n));
                self.before.push(Remembered { site, arc_mm, force_n, friction });
            }
        }
        self.before.sort_by_key(|pair| pair.site);
    }

    /// Makes a state the base, and finds the pairs there.
    pub(super) fn look_at_base(&mut self, elements: &[ElementData], state: &RodState) {
        self.set.clear();
        self.checked.1 = f64::NAN;
        self.base.copy_from(state);
        self.is_placed = false;
        if self.look_whether_clear(elements, state) {
            self.pairs.clear();
            self.before.clear();
            self.known = self.tuning.known;
            return;
        }
        self.place_tree(elements);
        self.counters.searches += 1;
        // At the first base of a part there are no pairs, but perhaps recalled forces.
        self.before.extend(self.pairs.drain(..).map(|pair| {
            let Pair { site, arc_mm, force_n, friction, .. } = pair;
            Remembered { site, arc_mm, force_n, friction }
        }));
        let Self { capsules, tuning, site_positions, .. } = self;
        let curve = Curve { elements, state, capsules, closed: self.closed, tuning };
        site_positions.clear();
        site_positions.extend(self.sites.iter().map(|site| curve.jet(site.place).at));
        self.known = 0.0;
        self.seek(elements, state, self.tuning.near);
        self.remember();
        self.find_contacts();
        self.before.clear();
    }

    /// Before a trial at which points have moved by this much from the base, finds the pairs that may touch there.
    pub(super) fn know_pairs_within(&mut self, elements: &[ElementData], motion_mm: f64) {
        let touch_mm = 2.0 * self.thinnest_radius_mm;
        // Pairs not yet found are `known` touching distances apart, and come nearer by that motion.
        let known = self.tuning.known;
        if self.known < known && motion_mm > (self.known - 1.0) * touch_mm {
            let base = std::mem::take(&mut self.base);
            self.seek(elements, &base, known);
            self.base = base;
        }
    }

    /// Finds the pairs at the base whose gap is between the distance known so far and another, in touching distances.
    fn seek(&mut self, elements: &[ElementData], base: &RodState, known: f64) {
        let (mut near, mut pairs) = (std::mem::take(&mut self.near), std::mem::take(&mut self.pairs));
        let curve = self.curve(elements, base);
        let reach = reach(known, &self.tuning);
        let reach_mm = |a: usize, b: usize| reach * self.touch_mm(a, b);
        self.tree.near(2.0 * self.largest_radius_mm * reach, self.apart_mm(), reach_mm, &mut near);
        for (a, b) in &near {
            self.find_between(&curve, (*a, *b), known, &mut pairs);
            self.find_between(&curve, (*b, *a), known, &mut pairs);
        }
        // Pairs are large, so their places are sorted; arc lengths are not negative, so their bits have their order.
        pairs.sort_by_cached_key(|pair| (pair.site, pair.arc_mm.to_bits()));
        pairs.dedup_by(|q, p| {
            let same = p.site == q.site && (q.arc_mm - p.arc_mm).abs() < self.tuning.twice * p.touch_mm;
            // At a shoulder the thicker side is felt.
            if same && q.depth_mm() > p.depth_mm() {
                std::mem::swap(q, p);
            }
            same
        });
        self.counters.elements += near.len() as u64;
        self.counters.pairs += (pairs.len() - self.pairs.len()) as u64;
        (self.near, self.pairs, self.known) = (near, pairs, known);
    }

    /// Distance of the axes of two elements whose surfaces touch, mm.
    fn touch_mm(&self, a: usize, b: usize) -> f64 {
        self.capsules[a].radius_mm + self.capsules[b].radius_mm
    }

    /// Finds the pairs of the sites of element `a` with element `b`: minima within `b` of the distance from a site.
    pub(super) fn find_between(
        &self,
        curve: &Curve<'_>,
        (a, b): (usize, usize),
        known: f64,
        into: &mut Vec<Pair>,
    ) {
        let touch_mm = self.touch_mm(a, b);
        let known_mm = [self.known, known].map(|known| known * touch_mm);
        let stretch = curve.piece(b);
        let [from, to] = [0.0, 1.0].map(|xi| stretch.jet(xi));
        for site in self.first_sites[a]..self.first_sites[a + 1] {
            let x = self.site_positions[site];
            let rises = |end: &super::curve::Jet| -(x - end.at).dot(&end.first);
            let (down, up) = (rises(&from), rises(&to));
            let starts_here = down < 0.0 || (up >= 0.0 && curve.before(b).is_none());
            let ends_here = up >= 0.0 || (down < 0.0 && curve.after(b).is_none());
            if !(starts_here && ends_here) {
                continue;
            }
            let xi = if down < 0.0 && up > 0.0 { down / (down - up) } else { f64::from(u8::from(up < 0.0)) };
            let place = self.sites[site].place;
            let gap = Gap::find(curve, place, 0.0, Place { element: b, xi }, (touch_mm, known_mm[1]));
            if (known_mm[0]..known_mm[1]).contains(&gap.distance) {
                into.extend(self.pair(curve, site, gap, touch_mm));
            }
        }
    }

    /// The pair of a site with this gap, unless the gap is to its own stretch.
    fn pair(&self, curve: &Curve<'_>, site: usize, gap: Gap, touch_mm: f64) -> Option<Pair> {
        let [a, b] = gap.at.map(|place| place.element);
        let [here_mm, arc_mm] = gap.at.map(|place| self.tree.arc(place.element, place.xi));
        if a.abs_diff(b) < 2 || self.tree.between(here_mm, arc_mm) < self.apart_mm() {
            return None;
        }
        let [one, other] = [a, b].map(|e| self.capsules[e]);
        let softer = 2.0 / (1.0 / one.modulus_n_per_mm2 + 1.0 / other.modulus_n_per_mm2);
        // Both stretches have sites that feel the other.
        let weight_mm = 0.5 * self.sites[site].weight_mm;
        Some(Pair {
            site,
            difference: Difference { elements: [a, b], weights: gap.weights() },
            gap,
            touch_mm,
            spring_n_per_mm: weight_mm * softer,
            penalty_n_per_mm: penalty_n_per_mm(weight_mm, &curve.elements[a], self.contacts.penalty),
            arc_mm,
            force_n: 0.0,
            contact: None,
            friction: PairFriction::default(),
        })
    }

    /// Transfers forces from the pairs of the previous base.
    fn remember(&mut self) {
        for pair in &mut self.pairs {
            let first = self.before.partition_point(|old| old.site < pair.site);
            let same = self.before[first..].iter().take_while(|old| old.site == pair.site);
            let nearest =
                same.min_by(|p, q| (p.arc_mm - pair.arc_mm).abs().total_cmp(&(q.arc_mm - pair.arc_mm).abs()));
            let kept =
                nearest.filter(|old| (old.arc_mm - pair.arc_mm).abs() < self.tuning.same * pair.touch_mm);
            pair.force_n = kept.map_or(0.0, |old| old.force_n);
            pair.friction = kept.map_or_else(PairFriction::default, |old| old.friction);
        }
    }

    /// Places the hierarchy at the base, if it is not there yet.
    pub(super) fn place_tree(&mut self, elements: &[ElementData]) {
        if !std::mem::replace(&mut self.is_placed, true) {
            self.tree.place(&Curve {
                elements,
                state: &self.base,
                capsules: &self.capsules,
                closed: self.closed,
                tuning: &self.tuning,
            });
        }
    }

    /// Fraction of the straight way from the base to a state on which no two stretches come close to crossing.
    pub(super) fn safe_part(&mut self, elements: &[ElementData], to: &RodState) -> f64 {
        let (known, part) = &self.checked;
        if !part.is_nan() && known.positions == to.positions && known.frames == to.frames {
            return *part;
        }
        self.place_tree(elements);
        let Self { capsules, tuning, .. } = self;
        self.tree.move_to(&Curve { elements, state: to, capsules, closed: self.closed, tuning });
        let part = self.tree.safe_part(self.apart_mm());
        self.checked.0.copy_from(to);
        self.checked.1 = part;
        part
    }
}
