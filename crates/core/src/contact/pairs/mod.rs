//! A rod that touches itself.
//!
//! Sites are quadrature points of the rod, in the middle of pieces about half a radius long. Each has a gap Gᵢ (`gap.rs`) from every other
//! stretch of the rod that is near, and with D the sum of both radii and p = D − G the depth,
//!
//! ```text
//! U = Σ ½ wᵢ ½ k p²  for p > 0
//! ```
//!
//! the wall's law ([`super::potential`]), where the half stands since each of two stretches has sites that feel the other. Stretches are other ones where they are
//! at least half a turn of the least radius apart along the rod: a rod cannot be bent to a smaller one than its own. Stretches of other rods, where several are solved
//! for together, are other ones too.
//!
//! Forces of pairs are unknowns of their own, as those of the wall are: derived in [`super::wall`] (`wall/forces.rs`), with G in the place of d,
//!
//! ```text
//! (∇∇E − Σ f ∇∇G + Σ κ ∇G ∇Gᵀ) δx = −(∇E − Σ κ p ∇G),    f⁺ = κ (p − ∇G·δx),    κ = ½ w k
//! ```
//!
//! **Which pairs there are** is asked anew at every base (`tree.rs`). **No crossing**: along a step no two points of different stretches come nearer to each other by more
//! than half their distance, by a bound on all pairs of elements, so that axes stay apart at any step, and what touches at a trial was nearer than 2 D at the base, where it is a pair.
//! A state that is not reached like that has an infinite energy.

mod clear;
mod curve;
mod forces;
mod gap;
mod memory;
mod model;
mod rubbing;
#[cfg(test)]
mod rubbing_tests;
#[cfg(test)]
mod tests;
mod tree;

use crate::Vec3;
use crate::rod::{ElementData, RodState, Stencils};
use crate::solve::{ContactMerit, Contacts, External, Moved, Sizes};

use curve::{Curve, Place};
pub use forces::Touching;
pub(crate) use forces::{Pressing, RodPlace};
use gap::Gap;
pub(crate) use rubbing::Rubs;
use rubbing::{Rub, Rubbing};
use tree::Tree;

/// Most distance of sites, in radii.
const SPACING_RADII: f64 = 0.5;
/// Pairs are known up to this many times the distance of touch: a step brings none nearer by more than half.
const KNOWN: f64 = 2.0;
/// Elements are looked at up to this many times that distance: a site may slide by as much as it is near.
const LOOKED_AT: f64 = 4.0;
/// Where nothing is nearer than that, motions of up to `FREE` of the distance of touch change nothing.
const CLEAR: f64 = 8.0;
/// Rounding by which a trial may go beyond what is safe.
const BEYOND: f64 = 0.1;

/// The surface of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Skin {
    /// Radius of the rod, mm.
    pub radius_mm: f64,
    /// k: force per length per depth, N/mm².
    pub modulus_n_per_mm2: f64,
}

impl Skin {
    /// Modulus of the contact of a rod without one of its own, over EI/r⁴. A solid round wire has E = 4/π EI/r⁴, and two of them in contact give
    /// way by about what their own material says; ten times as hard they are rigid: a plectoneme under T r²/EI = 10⁻³ sinks in by 10⁻⁴ of its radius.
    pub const RIGID: f64 = 10.0;

    /// That of a gap between two rods.
    pub(crate) const NONE: Self = Self { radius_mm: 0.0, modulus_n_per_mm2: 0.0 };

    /// That of a rod of this radius, mm, and bending stiffness, N·mm², as hard as a rod can tell.
    pub fn rigid(radius_mm: f64, bending_nmm2: f64) -> Self {
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
    /// At the base.
    gap: Gap,
    /// D, mm.
    touch_mm: f64,
    /// κ, N/mm.
    spring_n_per_mm: f64,
    /// ρ, N/mm.
    penalty_n_per_mm: f64,
    /// Arc length of the nearest point of the stretch, mm.
    arc_mm: f64,
    /// Force of its own, N.
    force_n: f64,
    /// Whether it presses in the system at the base, …
    at_base: bool,
    /// … and whether it does now.
    presses: bool,
    /// Whether a step may have it press.
    foreseen: bool,
    /// Change of the gap by a whole step, to first order, mm, …
    change_mm: f64,
    /// … and by another one.
    end_mm: f64,
    /// The force that the rod's own stiffness is in balance with, N, less than 0 where it presses.
    carried_n: f64,
    /// f⁺: the force that the step leads to, N.
    aim_n: f64,
    rub: Rub,
}

impl Pair {
    /// p at the base, mm.
    fn depth_mm(&self) -> f64 {
        self.touch_mm - self.gap.distance
    }
}

/// How much was asked, and found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PairCounters {
    /// Bases at which pairs were looked for.
    pub searches: u64,
    /// Pairs of elements that were near.
    pub elements: u64,
    /// Pairs of a site and a stretch that were kept.
    pub pairs: u64,
}

/// The energy of a rod that touches itself, with what is known from one question to the next.
#[derive(Debug, Clone, Default)]
pub struct SelfContact {
    skins: Vec<Skin>,
    sites: Vec<Site>,
    /// First site of each element, and one past the last.
    first_sites: Vec<usize>,
    /// Where they are at the base.
    site_positions: Vec<Vec3>,
    largest_radius_mm: f64,
    /// Whether the rod's end is its start.
    closed: bool,
    tree: Tree,
    /// Whether the hierarchy is that of the base.
    is_placed: bool,
    base: RodState,
    near: Vec<(usize, usize)>,
    pairs: Vec<Pair>,
    /// Those of the base before, for their forces.
    before: Vec<Pair>,
    /// Whether forces are aimed at.
    aimed: bool,
    /// Where nothing was near, if that was so where it was looked last.
    clear: Option<clear::Clear>,
    /// The trial that was found safe last, and the part of its way that is.
    checked: (RodState, f64),
    rubbing: Rubbing,
    /// Whether friction at the base is known in a step.
    slips_known: bool,
    rounding_n: f64,
    counters: PairCounters,
}

impl SelfContact {
    /// That of a rod with these elements and their surfaces.
    pub fn new(elements: &[ElementData], skins: Vec<Skin>) -> Self {
        let mut contact = Self::default();
        contact.renew(elements, skins);
        contact
    }

    /// Is that of another rod from here on: nothing is known of it.
    pub(crate) fn renew(&mut self, elements: &[ElementData], skins: impl IntoIterator<Item = Skin>) {
        let Self { skins: known, sites, first_sites, .. } = self;
        known.clear();
        known.extend(skins);
        sites.clear();
        first_sites.clear();
        first_sites.push(0);
        for (e, (element, skin)) in elements.iter().zip(&*known).enumerate() {
            let spaces = (element.length / (SPACING_RADII * skin.radius_mm)).ceil().max(1.0);
            let count = if element.is_break() { 0.0 } else { spaces };
            let site = |k: usize| Site {
                place: Place { element: e, xi: (k as f64 + 0.5) / count },
                weight_mm: element.length / count,
            };
            sites.extend((0..count as usize).map(site));
            first_sites.push(sites.len());
        }
        self.largest_radius_mm = known.iter().map(|skin| skin.radius_mm).fold(0.0, f64::max);
        self.pairs.clear();
        self.before.clear();
        self.aimed = false;
        self.checked.1 = f64::NAN;
        self.clear = None;
    }

    /// The same of a rod that is a ring: its last node is held where its first one is.
    #[must_use]
    pub fn closed(self) -> Self {
        Self { closed: true, ..self }
    }

    fn curve<'a>(&self, elements: &'a [ElementData], state: &'a RodState) -> Curve<'a> {
        Curve { elements, state, closed: self.closed }
    }

    /// What was asked so far.
    pub fn counters(&self) -> PairCounters {
        self.counters
    }

    /// Arc length that elements which may touch are apart along the rod at least, mm.
    fn apart_mm(&self) -> f64 {
        tree::half_turn(self.largest_radius_mm)
    }
}

impl External for SelfContact {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        self.look_at_base(elements, state);
        self.rub_with_pairs(elements, state);
        self.press(elements, state, into);
    }

    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        if self.stays_clear(elements, state) {
            return 0.0;
        }
        if self.safe_part(elements, state) < 1.0 - BEYOND {
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

    fn contacts(&mut self) -> Option<&mut dyn Contacts> {
        Some(self)
    }
}

impl Contacts for SelfContact {
    fn foresee(&mut self, _elements: &[ElementData], _base: &RodState, moved: &Moved<'_>) {
        self.foresee_pairs(moved);
        self.foresee_slipping(moved);
    }

    fn press_or_let_go(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &Moved<'_>,
        into: &mut dyn Stencils,
    ) -> usize {
        self.press_or_let_go_pairs(elements, base, moved, into) + self.slip_on(elements, base, moved, into)
    }

    fn look_towards(&mut self, moved: &Moved<'_>) {
        for pair in &mut self.pairs {
            pair.end_mm = pair.change(moved);
        }
        self.look_towards_slips(moved);
    }

    fn slope_towards(&mut self, part: f64) -> f64 {
        self.pairs.iter().map(|pair| pair.slope_towards(part)).sum::<f64>() + self.slipping_slope(part)
    }

    fn go_towards(&mut self, part: f64) {
        for pair in &mut self.pairs {
            pair.carried_n += part * (pair.linear_n(pair.end_mm) - pair.carried_n);
        }
        self.carry_slipping(part);
    }

    fn merit(&mut self, moved: &Moved<'_>) -> ContactMerit {
        self.aim(moved)
    }

    fn take(&mut self, part: f64) {
        for pair in &mut self.pairs {
            pair.force_n += part * (pair.aim_n - pair.force_n);
        }
    }

    fn settled(&mut self, tolerance: f64) -> bool {
        self.let_go_of_pulling(tolerance) && self.friction_settles()
    }
}
