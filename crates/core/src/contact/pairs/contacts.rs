//! What pairs supply to a [`ContactSet`]: contacts in the difference of their two points.

use super::{Pair, SelfContact};
use crate::Vec3;
use crate::contact::friction::Coulomb;
use crate::contact::set::{
    ContactSet, Geometry, LinearContact, Motion, Slipping, Stencil, Stiffness, System, Wrench,
};
use crate::rod::couples::PLACES;
use crate::rod::{Link, RodState};
use crate::solve::Moved;

/// The difference of two points of a centre line, first minus second.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::contact) struct Difference {
    /// The elements of both.
    pub(super) elements: [usize; 2],
    /// Weights in it of what both points depend on.
    pub(super) weights: [f64; PLACES],
}

impl Stencil for Difference {
    fn add(&self, to: &mut System<'_>, spring: &Wrench, stiffness: &Stiffness) {
        let Self { elements, weights } = *self;
        let link = Link { elements, weights, gradient: spring.0, hessian: stiffness.0 };
        to.into.add_link(to.elements, to.base, &link);
    }
}

impl SelfContact {
    /// Finds the contacts of the pairs at the base: those that are active, and those that a step may close.
    pub(super) fn find_contacts(&mut self) {
        self.set.clear();
        for (key, pair) in self.pairs.iter_mut().enumerate() {
            let contact = LinearContact::new(
                (key, pair.difference),
                (-pair.depth_mm(), pair.gap.direction()),
                (pair.spring_n_per_mm, pair.penalty_n_per_mm),
                pair.force_n,
            );
            pair.contact = None;
            if contact.at_base || -pair.depth_mm() < 0.5 * self.contacts.follow * pair.touch_mm {
                pair.contact = Some(self.set.contacts.len());
                self.set.contacts.push(contact);
            }
            if !contact.at_base {
                pair.force_n = 0.0;
            }
        }
    }

    /// The contact of a pair in a step, if there may be one.
    pub(super) fn contact(&self, pair: &Pair) -> Option<&LinearContact<Difference>> {
        self.set.contacts.get(pair.contact?)
    }
}

impl Geometry for SelfContact {
    type Stencil = Difference;

    fn set(&mut self) -> &mut ContactSet<Difference> {
        &mut self.set
    }

    fn follow(&mut self, moved: &dyn Moved) {
        self.ways.clear();
        self.ways.extend((0..self.capsules.len()).map(|e| moved.element(e)));
    }

    fn motion(&self, difference: &Difference, _moved: &dyn Moved) -> Motion {
        let [a, b] = difference.elements.map(|e| &self.ways[e]);
        let each = difference.weights.iter().zip(a.iter().chain(b));
        (each.fold(Vec3::zeros(), |sum, (weight, way)| sum + way * *weight), 0.0)
    }

    fn law(&mut self) -> &mut Coulomb {
        &mut self.friction.law
    }

    fn find_slipping(&self, _base: &RodState, into: &mut Vec<Slipping<Difference>>) {
        into.extend(self.pairs.iter().filter_map(|pair| {
            let at = (pair.friction.apart_mm, 0.0);
            Slipping::new(pair.difference, &pair.friction.slider, at, &self.friction.law)
        }));
    }

    fn store_forces(&mut self) {
        for pair in &mut self.pairs {
            if let Some(contact) = pair.contact.and_then(|k| self.set.contacts.get(k)) {
                pair.force_n = contact.force_n;
            }
        }
    }

    fn least_force_n(&self) -> f64 {
        0.0
    }

    fn friction_off(&self) -> f64 {
        self.unsettled()
    }
}
