//! Forces of pairs: in the system of a step, in the merit along it, and in reports.

use super::clear::{motions_mm, nodes};
use super::curve::{Curve, Place};
use super::gap::Gap;
use super::{Pair, SelfContact};
use crate::Vec3;
use crate::contact::ROUNDING;
use crate::contact::set::merit;
use crate::rod::{Couple, ElementData, RodState, Stencils};

/// A contact of a rod with itself or with another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touching {
    /// Arc lengths of the two points from the first node of their rod, mm.
    pub arcs_mm: [f64; 2],
    /// Indices of the rods of both points: 0 for the device, and from 1 on for detached coils, in order.
    pub rods: [usize; 2],
    /// Their positions, mm.
    pub positions_mm: [Vec3; 2],
    /// From the second to the first, unit length.
    pub normal: Vec3,
    /// Force on the first along the normal, and on the second against it, N.
    pub force_n: f64,
    /// Penetration of the surfaces, mm.
    pub penetration_mm: f64,
}

/// Element and ξ.
pub(crate) type RodPlace = (usize, f64);

/// A pair of points in contact, in terms of elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pressing {
    /// Element and ξ of both points.
    pub(crate) places: [RodPlace; 2],
    /// Force on the first; on the second it is the opposite, N.
    pub(crate) force_n: Vec3,
    /// Element of the site that feels the contact, whose length weights it.
    pub(crate) site: usize,
    /// Contact energy there, mJ.
    pub(crate) energy_mj: f64,
}

impl SelfContact {
    /// The pairs in contact at the base, the last state of a solution.
    pub(crate) fn pressing(&self) -> impl Iterator<Item = Pressing> + '_ {
        let pressed = self.pairs.iter().filter(|pair| pair.depth_mm() > 0.0);
        pressed.map(|pair| Pressing {
            places: pair.gap.at.map(|place| (place.element, place.xi)),
            force_n: pair.gap.direction() * (pair.spring_n_per_mm * pair.depth_mm()) + self.friction_n(pair),
            site: self.sites[pair.site].place.element,
            energy_mj: 0.5 * pair.spring_n_per_mm * pair.depth_mm().powi(2),
        })
    }

    /// Adds the active pairs at the base.
    pub(super) fn press(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        let mut rounding_n: f64 = 0.0;
        let curve = self.curve(elements, state);
        for pair in &self.pairs {
            let at_base = self.contact(pair).is_some_and(|contact| contact.at_base);
            if !(at_base || pair.is_held()) {
                continue;
            }
            let mut couple = Couple::none(pair.gap.at.map(|place| place.element));
            if at_base {
                let depth_mm = pair.depth_mm();
                into.add_value(0.5 * pair.spring_n_per_mm * depth_mm.max(0.0).powi(2));
                let farthest_mm =
                    pair.gap.at.map(|place| curve.jet(place).at.amax()).into_iter().fold(0.0, f64::max);
                rounding_n = rounding_n.max(ROUNDING * f64::EPSILON * pair.spring_n_per_mm * farthest_mm);
                let force_n = pair.spring_n_per_mm * depth_mm;
                couple = pair.couple(&curve, -force_n, pair.force_n, pair.spring_n_per_mm);
            }
            if pair.is_held() {
                into.add_value(self.add_friction(pair, &mut couple));
            }
            into.add_couple(elements, state, &couple);
        }
        self.rounding_n = rounding_n;
    }

    /// Merit of all pairs at a state, or their energy if forces have no target, mJ.
    pub(super) fn stored_or_merit_mj(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        // The distance of two stretches changes by at most the sum of their motions.
        let motion_mm = 2.0 * motions_mm(elements, nodes(&self.base), state).fold(0.0, f64::max);
        self.know_pairs_within(elements, motion_mm);
        let curve = self.curve(elements, state);
        let of = |pair: &Pair| {
            let force_n = self.contact(pair).map_or(0.0, |contact| contact.target_n);
            if -pair.depth_mm() > motion_mm && force_n == 0.0 {
                return 0.0;
            }
            let [_, to] = pair.gap.at;
            let site = self.sites[pair.site].place;
            let gap = Gap::find(&curve, site, pair.gap.slide, to, (pair.touch_mm, f64::INFINITY));
            let depth_mm = pair.touch_mm - gap.distance;
            if !self.set.has_targets {
                return 0.5 * pair.spring_n_per_mm * depth_mm.max(0.0).powi(2);
            }
            if force_n == 0.0 && depth_mm <= 0.0 {
                return 0.0;
            }
            merit(pair.spring_n_per_mm, pair.penalty_n_per_mm, force_n, depth_mm).0
        };
        self.pairs.iter().map(|pair| of(pair) + self.friction_mj(pair, &curve)).sum()
    }

    /// Contact energy at the base, mJ.
    pub(crate) fn stored_mj(&self) -> f64 {
        let of = |pair: &Pair| 0.5 * pair.spring_n_per_mm * pair.depth_mm().max(0.0).powi(2);
        self.pairs.iter().map(of).sum()
    }

    /// Contacts of the rod with itself at a state about which nothing is known.
    pub(crate) fn touching_at(&mut self, elements: &[ElementData], state: &RodState) -> Vec<Touching> {
        self.look_at_base(elements, state);
        self.touching(elements, state)
    }

    /// Contacts of the rod with itself at the base, the last state of a solution.
    pub(crate) fn touching(&self, elements: &[ElementData], state: &RodState) -> Vec<Touching> {
        let curve = self.curve(elements, state);
        let gaps: Vec<usize> = (0..elements.len()).filter(|e| curve.is_break(*e)).collect();
        let rod = |place: Place| gaps.partition_point(|gap| *gap < place.element);
        let arc_mm = |place: Place| {
            let first = rod(place).checked_sub(1).map_or(0, |k| gaps[k] + 1);
            self.tree.arc(place.element, place.xi) - self.tree.arc(first, 0.0)
        };
        let of = |pair: &Pair| Touching {
            arcs_mm: pair.gap.at.map(arc_mm),
            rods: pair.gap.at.map(rod),
            positions_mm: pair.gap.at.map(|place| curve.jet(place).at),
            normal: pair.gap.between / pair.gap.between.norm(),
            force_n: pair.spring_n_per_mm * pair.depth_mm() * pair.gap.direction().norm(),
            penetration_mm: pair.touch_mm - pair.gap.between.norm(),
        };
        self.pairs.iter().filter(|pair| pair.depth_mm() > 0.0).map(of).collect()
    }
}

impl Pair {
    /// Derivatives of an energy with first and second derivative `first` and `second` in the gap, including the
    /// curvature of the gap under a force.
    pub(super) fn couple(&self, curve: &Curve<'_>, first: f64, force_n: f64, second: f64) -> Couple {
        let mut of = self.gap.derivatives(curve);
        for k in 0..of.gradient.len() {
            for l in k..of.gradient.len() {
                let along = of.gradient[k] * (second * of.gradient[l].transpose());
                of.hessian[k][l] = along - of.hessian[k][l] * force_n;
            }
        }
        Couple {
            first: self.gap.at[0].element,
            second: self.gap.at[1].element,
            gradient: of.gradient.map(|g| g * first),
            carried: of.gradient.map(|g| g * -force_n),
            hessian: of.hessian,
        }
    }
}
