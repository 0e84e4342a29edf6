//! Several external energies combined into one.

use super::external::{ContactMerit, Contacts, External, Moved, Sizes};
use crate::rod::{ElementData, RodState, Stencils};

/// External energies that act together: loads, a wall, and self-contact of the rod.
pub struct Together<'a>(pub Vec<&'a mut dyn External>);

impl Together<'_> {
    /// The contacts of all energies that have some.
    fn each(&mut self) -> impl Iterator<Item = &mut dyn Contacts> {
        self.0.iter_mut().filter_map(|part| part.contacts())
    }
}

impl External for Together<'_> {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        self.0.iter_mut().for_each(|part| part.linearise(elements, state, into));
    }

    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        self.0.iter_mut().map(|part| part.value(elements, state)).sum()
    }

    fn safe_fraction(&mut self, elements: &[ElementData], to: &RodState) -> f64 {
        self.0.iter_mut().map(|part| part.safe_fraction(elements, to)).fold(1.0, f64::min)
    }

    fn sizes(&self) -> Sizes {
        self.0.iter().map(|part| part.sizes()).fold(Sizes::default(), |a, b| Sizes {
            force_n: a.force_n.max(b.force_n),
            moment_nmm: a.moment_nmm.max(b.moment_nmm),
            rounding_n: a.rounding_n.max(b.rounding_n),
        })
    }

    fn is_conservative(&self) -> bool {
        self.0.iter().all(|part| part.is_conservative())
    }

    fn work(&self, from: &RodState, to: &RodState) -> f64 {
        self.0.iter().map(|part| part.work(from, to)).sum()
    }

    fn contacts(&mut self) -> Option<&mut dyn Contacts> {
        if self.each().next().is_some() { Some(self) } else { None }
    }
}

impl Contacts for Together<'_> {
    fn predict(&mut self, elements: &[ElementData], base: &RodState, moved: &dyn Moved) {
        self.each().for_each(|part| part.predict(elements, base, moved));
    }

    fn update_active_set(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &dyn Moved,
        into: &mut dyn Stencils,
    ) -> usize {
        self.each().map(|part| part.update_active_set(elements, base, moved, into)).sum()
    }

    fn set_direction(&mut self, moved: &dyn Moved) {
        self.each().for_each(|part| part.set_direction(moved));
    }

    fn slope(&mut self, part: f64) -> f64 {
        self.each().map(|one| one.slope(part)).sum()
    }

    fn advance(&mut self, part: f64) {
        self.each().for_each(|one| one.advance(part));
    }

    fn merit(&mut self, moved: &dyn Moved) -> ContactMerit {
        self.each().map(|part| part.merit(moved)).fold(ContactMerit::default(), |a, b| ContactMerit {
            excess_mj: a.excess_mj + b.excess_mj,
            slope_mj: a.slope_mj + b.slope_mj,
            size_mj: a.size_mj + b.size_mj,
        })
    }

    fn accept_forces(&mut self, part: f64) {
        self.each().for_each(|one| one.accept_forces(part));
    }

    fn settled(&mut self, tolerance: f64) -> bool {
        // Every part must be called, since the call also releases contacts that pull.
        self.each().filter_map(|part| (!part.settled(tolerance)).then_some(())).count() == 0
    }
}
