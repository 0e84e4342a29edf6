//! Self-contact of rods, and contact between rods.
//!
//! Sites are quadrature points of the rod, in the middle of pieces about half a radius long. Each has a gap Gᵢ (`gap.rs`) from every other
//! stretch of the rod that is near, and with D the sum of both radii and p = D − G the depth,
//!
//! ```text
//! U = Σ ½ wᵢ ½ k p²  for p > 0
//! ```
//!
//! the wall's law ([`super::potential`]); the factor one half is there because both stretches have sites that feel
//! the other. Two stretches are distinct if they are at least half a turn of the smallest radius apart along the rod:
//! a rod cannot be bent to a radius smaller than its own. Stretches of different rods that are solved together are
//! always distinct.
//!
//! Forces of pairs are unknowns (`contact/set.rs`), with κ = ½ w k.
//!
//! **Pairs** are sought anew at every base (`tree.rs`). **No crossing**: along a step no two points of different
//! stretches come nearer to each other by more than half their distance, by a bound on all pairs of elements, so axes
//! never cross, and anything touching at a trial was nearer than 2 D at the base, where it is a pair. A state that
//! cannot be reached in this way has an infinite energy.

mod clear;
mod contacts;
mod curve;
mod forces;
mod friction;
#[cfg(test)]
mod friction_tests;
mod gap;
mod memory;
#[cfg(test)]
mod tests;
mod tree;

use crate::Vec3;
use crate::contact::set::ContactSet;
use crate::rod::{ElementData, RodState, Stencils};
use crate::solve::{Contacts, External, Sizes};
use crate::tuning::{ContactTuning, PairTuning, Tuning};

use contacts::Difference;
use curve::{Curve, Place};
pub use forces::Touching;
pub(crate) use forces::{Pressing, RodPlace};
pub(crate) use friction::FrictionLaw;
use friction::{FrictionOfPairs, PairFriction};
use gap::Gap;
pub(crate) use memory::PairForce;
use memory::Remembered;
use tree::Tree;

/// The surface of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Capsule {
    /// Radius of the rod, mm.
    pub radius_mm: f64,
    /// k: force per length and depth, N/mm².
    pub modulus_n_per_mm2: f64,
}

impl Capsule {
    /// Default contact modulus of a rod, over EI/r⁴. A solid round wire has E = 4/π EI/r⁴, and two of them in contact
    /// yield by about as much as their material does; ten times as hard they are practically rigid: a plectoneme
    /// under T r²/EI = 10⁻³ sinks in by 10⁻⁴ of its radius.
    pub(crate) const RIGID: f64 = 10.0;

    /// The surface of a gap between two rods.
    pub(crate) const NONE: Self = Self { radius_mm: 0.0, modulus_n_per_mm2: 0.0 };

    /// A practically rigid surface of a rod of this radius, mm, and bending stiffness, N·mm².
    pub(crate) fn rigid(radius_mm: f64, bending_nmm2: f64) -> Self {
        Self { radius_mm, modulus_n_per_mm2: Self::RIGID * bending_nmm2 / radius_mm.powi(4) }
    }
}

/// A quadrature point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Site {
    place: Place,
    weight_mm: f64,
}

/// A site and a stretch that it may touch.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pair {
    site: usize,
    /// The gap at the base.
    gap: Gap,
    /// The difference of both points.
    difference: Difference,
    /// D, the touching distance, mm.
    touch_mm: f64,
    /// κ, N/mm.
    spring_n_per_mm: f64,
    /// ρ, N/mm.
    penalty_n_per_mm: f64,
    /// Arc length of the nearest point of the stretch, mm.
    arc_mm: f64,
    /// Its force unknown, N.
    force_n: f64,
    /// Number of its contact in a step, if there may be one.
    contact: Option<usize>,
    friction: PairFriction,
}

impl Pair {
    /// p at the base, mm.
    fn depth_mm(&self) -> f64 {
        self.touch_mm - self.gap.distance
    }
}

/// Counts of searches and their results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct PairCounters {
    /// Bases at which pairs were looked for.
    pub searches: u64,
    /// Pairs of near elements.
    pub elements: u64,
    /// Pairs of a site and a stretch.
    pub pairs: u64,
}

/// Contact energy of rods with themselves and each other, with knowledge kept between calls.
#[derive(Debug, Clone, Default)]
pub(crate) struct SelfContact {
    capsules: Vec<Capsule>,
    sites: Vec<Site>,
    /// First site of each element, and one past the last.
    first_sites: Vec<usize>,
    /// Site positions at the base.
    site_positions: Vec<Vec3>,
    largest_radius_mm: f64,
    /// Smallest radius of a rod; infinite if there is none.
    thinnest_radius_mm: f64,
    /// Whether the rod's end is its start.
    closed: bool,
    tree: Tree,
    /// Whether the hierarchy is placed at the base.
    is_placed: bool,
    base: RodState,
    near: Vec<(usize, usize)>,
    pairs: Vec<Pair>,
    /// Gap up to which they are known, in touching distances.
    known: f64,
    /// Forces for the next base: recalled ones of an earlier part, or those of the previous base while pairs are sought.
    before: Vec<Remembered>,
    /// Changes of what points of each element depend on, in the step looked at last: x₀, h t₀, x₁ and h t₁, mm.
    ways: Vec<[Vec3; 4]>,
    /// Contacts in the step from a base.
    set: ContactSet<Difference>,
    /// The last state tested at which nothing was near, if so.
    clear: Option<clear::Clear>,
    /// The last safe trial, and the safe fraction of its way.
    checked: (RodState, f64),
    friction: FrictionOfPairs,
    rounding_n: f64,
    counters: PairCounters,
    tuning: PairTuning,
    /// Numbers shared with the wall.
    contacts: ContactTuning,
}

/// Whether this build has what rods that touch themselves need; `what` asks for it.
///
/// # Errors
/// [`crate::Error::Feature`] if not.
pub(crate) fn check_built(what: &str) -> crate::Result<()> {
    match cfg!(feature = "self-contact") {
        true => Ok(()),
        false => Err(crate::Error::feature("self-contact", what)),
    }
}

impl SelfContact {
    /// For a rod with these elements and their surfaces.
    pub(crate) fn new(elements: &[ElementData], capsules: Vec<Capsule>) -> Self {
        let mut contact = Self::default();
        contact.renew(elements, capsules);
        contact
    }

    /// For no rod yet, with these numbers.
    pub(crate) fn tuned(tuning: &Tuning) -> Self {
        let mut contact = Self { tuning: tuning.pairs, contacts: tuning.contact, ..Self::default() };
        contact.friction.law.tuning = tuning.friction;
        contact
    }

    /// Resets to another rod, about which nothing is known.
    pub(crate) fn renew(&mut self, elements: &[ElementData], capsules: impl IntoIterator<Item = Capsule>) {
        let Self { capsules: known, sites, first_sites, tuning, .. } = self;
        known.clear();
        known.extend(capsules);
        sites.clear();
        first_sites.clear();
        first_sites.push(0);
        for (e, (element, capsule)) in elements.iter().zip(&*known).enumerate() {
            let spaces = (element.length / (tuning.spacing_radii * capsule.radius_mm)).ceil().max(1.0);
            let count = if element.is_break() { 0.0 } else { spaces };
            let site = |k: usize| Site {
                place: Place { element: e, xi: (k as f64 + 0.5) / count },
                weight_mm: element.length / count,
            };
            sites.extend((0..count as usize).map(site));
            first_sites.push(sites.len());
        }
        let radii_mm = || known.iter().map(|capsule| capsule.radius_mm);
        self.largest_radius_mm = radii_mm().fold(0.0, f64::max);
        self.thinnest_radius_mm =
            radii_mm().filter(|radius_mm| *radius_mm > 0.0).fold(f64::INFINITY, f64::min);
        self.pairs.clear();
        self.before.clear();
        self.set.clear();
        self.checked.1 = f64::NAN;
        self.clear = None;
    }

    /// The same for a ring, whose last node coincides with its first.
    #[must_use]
    pub(crate) fn closed(self) -> Self {
        Self { closed: true, ..self }
    }

    fn curve<'a>(&'a self, elements: &'a [ElementData], state: &'a RodState) -> Curve<'a> {
        Curve { elements, state, capsules: &self.capsules, closed: self.closed, tuning: &self.tuning }
    }

    /// Counts so far.
    #[cfg(test)]
    pub(crate) fn counters(&self) -> PairCounters {
        self.counters
    }

    /// Smallest arc length between elements that may touch, mm.
    fn apart_mm(&self) -> f64 {
        tree::half_turn(self.largest_radius_mm)
    }
}

impl External for SelfContact {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        self.look_at_base(elements, state);
        self.follow_pairs(elements, state);
        self.press(elements, state, into);
    }

    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        if self.stays_clear(elements, state) {
            return 0.0;
        }
        if self.safe_part(elements, state) < 1.0 - self.tuning.beyond {
            return f64::INFINITY;
        }
        self.stored_or_merit_mj(elements, state)
    }

    fn safe_fraction(&mut self, elements: &[ElementData], to: &RodState) -> f64 {
        if self.stays_clear(elements, to) { 1.0 } else { self.safe_part(elements, to) }
    }

    fn sizes(&self) -> Sizes {
        Sizes { rounding_n: self.rounding_n, ..Sizes::default() }
    }

    fn visit_contacts(&mut self, ask: &mut dyn FnMut(&mut dyn Contacts)) {
        ask(self);
    }
}
