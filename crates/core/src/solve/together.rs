//! Several external energies combined into one.

use super::external::{Contacts, External, Sizes};
use crate::rod::{ElementData, RodState, Stencils};

/// External energies that act together: loads, a wall, and self-contact of the rod; those that there are.
pub(crate) struct Together<'a, const N: usize>(pub [Option<&'a mut dyn External>; N]);

impl<const N: usize> External for Together<'_, N> {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        self.0.iter_mut().flatten().for_each(|part| part.linearise(elements, state, into));
    }

    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        self.0.iter_mut().flatten().map(|part| part.value(elements, state)).sum()
    }

    fn safe_fraction(&mut self, elements: &[ElementData], to: &RodState) -> f64 {
        self.0.iter_mut().flatten().map(|part| part.safe_fraction(elements, to)).fold(1.0, f64::min)
    }

    fn sizes(&self) -> Sizes {
        self.0.iter().flatten().map(|part| part.sizes()).fold(Sizes::default(), |a, b| Sizes {
            force_n: a.force_n.max(b.force_n),
            moment_nmm: a.moment_nmm.max(b.moment_nmm),
            rounding_n: a.rounding_n.max(b.rounding_n),
        })
    }

    fn is_conservative(&self) -> bool {
        self.0.iter().flatten().all(|part| part.is_conservative())
    }

    fn work(&self, from: &RodState, to: &RodState) -> f64 {
        self.0.iter().flatten().map(|part| part.work(from, to)).sum()
    }

    fn visit_contacts(&mut self, ask: &mut dyn FnMut(&mut dyn Contacts)) {
        self.0.iter_mut().flatten().for_each(|part| part.visit_contacts(ask));
    }
}
