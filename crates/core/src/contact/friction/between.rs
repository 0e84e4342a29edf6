//! Coulomb friction between coaxial instruments, as an incremental potential.
//!
//! Instruments are inextensible and share the line, so in a step one slips in another along the line by the
//! difference Δ of their hands' advances, everywhere, whatever the solution. Around the line it slips by its radius
//! times the relative rotation of the two. Both angles of a node are measured from the same triad, which is parallel
//! transported along the line, so their difference is that of the instruments, however the line moves, and
//!
//! ```text
//! u = (Δ, r (ϑ − ϑₐ)),    ϑ = θ_inner − θ_outer
//! D = Σ μ Nᵢ φ(|uᵢ|)
//! ```
//!
//! over the nodes, with φ of [`super`], the force N across the line between the two at the node, and ϑₐ the ϑ of the
//! same pieces of both before the step: sliding along the line without rotation keeps the angle. With a(y) = φ′/y
//!
//! ```text
//! ∂D/∂Δ = μ N a Δ             friction along the line, against the slip; felt by the hands, bends nothing
//! ∂D/∂ϑ = μ N a r² (ϑ − ϑₐ)   couple about the line, on the inner one and against it on the outer one
//! ∂²D/∂ϑ² = μ N r² (a + (φ″ − a) r² (ϑ − ϑₐ)²/y²) ≥ 0
//! ```
//!
//! The squares of both components sum to (μN)² where one slips, and to less where it sticks, so an instrument that is
//! turned slides more easily. N is lagged, as on the wall: it is renewed between solutions until the couples no
//! longer change. An instrument without angles of its own (a straight one in a list of more than three) takes no
//! couple: for it u = (Δ, 0), and it turns freely.

use serde::{Deserialize, Serialize};

use super::LEAST_STICK_MM;
use super::coulomb::{phi, rates};
use crate::rod::{RodState, Stencils};
use crate::tuning::FrictionTuning;

/// Friction of one instrument on the next one outside it at a node, at the end of the last step.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct InnerFriction {
    /// Component along the line, against the slip, as a fraction of the largest friction.
    pub along: f64,
    /// Component around the line: by Coulomb's law the squares of both sum to 1 where one slips, and to less where it
    /// sticks.
    pub around: f64,
    /// Force across the line per length, N/mm, over the length that the node represents.
    pub pressure_n_per_mm: f64,
}

/// A node with friction between two instruments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    /// The node.
    pub node: usize,
    /// The inner instrument.
    pub inner: usize,
    /// The outer one.
    pub outer: usize,
    /// Their sets of angles, if both have one.
    pub sets: Option<(usize, usize)>,
    /// μ.
    pub coefficient: f64,
    /// r, that of the inner one, mm.
    pub radius_mm: f64,
    /// Δ, mm.
    pub advance_mm: f64,
    /// Rotation of the inner instrument's hand minus that of the outer one, rad.
    pub turn_rad: f64,
    /// ϑₐ.
    pub from_rad: f64,
    /// Length that the node represents, mm.
    pub length_mm: f64,
    /// N.
    pub force_n: f64,
    /// ε, mm, as `Between::push` sets it.
    pub stick_mm: f64,
}

impl Place {
    /// A node of two instruments, with slip and normal force still unknown.
    pub(crate) fn new((node, inner, outer): (usize, usize, usize), coefficient: f64, radius_mm: f64) -> Self {
        Self {
            node,
            inner,
            outer,
            sets: None,
            coefficient,
            radius_mm,
            advance_mm: 0.0,
            turn_rad: 0.0,
            from_rad: 0.0,
            length_mm: 0.0,
            force_n: 0.0,
            stick_mm: LEAST_STICK_MM,
        }
    }

    /// ϑ at a state; 0 for instruments that turn freely.
    pub(crate) fn turned_rad(&self, state: &RodState) -> f64 {
        self.sets.map_or(0.0, |(inner, outer)| state.angle(self.node, inner) - state.angle(self.node, outer))
    }

    /// Slip around the line, and total slip, mm.
    fn slip_mm(&self, state: &RodState) -> (f64, f64) {
        let around = self.radius_mm * (self.turned_rad(state) - self.from_rad);
        (around, libm::hypot(self.advance_mm, around))
    }

    /// Components of friction along and around the line, as fractions of the largest friction.
    pub(crate) fn parts(&self, state: &RodState) -> [f64; 2] {
        let (around, slip) = self.slip_mm(state);
        let over = rates(slip, self.stick_mm).0;
        [over * self.advance_mm, over * around]
    }

    /// D, mJ.
    fn value(&self, state: &RodState) -> f64 {
        match self.force_n {
            0.0 => 0.0,
            force_n => self.coefficient * force_n * phi(self.slip_mm(state).1, self.stick_mm),
        }
    }

    /// First and second derivative of D in ϑ, N·mm.
    pub(crate) fn couple(&self, state: &RodState) -> (f64, f64) {
        let (around, slip) = self.slip_mm(state);
        let (over, second) = rates(slip, self.stick_mm);
        let part = if slip > 0.0 { around / slip } else { 0.0 };
        let most = self.coefficient * self.force_n * self.radius_mm;
        (most * over * around, most * self.radius_mm * (over + (second - over) * part * part))
    }
}

/// Friction between instruments in one step.
#[derive(Debug, Clone, Default)]
pub(crate) struct Between {
    places: Vec<Place>,
    tuning: FrictionTuning,
}

impl Between {
    /// None yet.
    pub(super) fn new(tuning: &FrictionTuning) -> Self {
        Self { places: Vec::new(), tuning: *tuning }
    }

    /// Removes all friction.
    pub(crate) fn clear(&mut self) {
        self.places.clear();
    }

    /// Adds a node. `ways_mm` is the largest motion of a hand: ε is a fraction of that.
    pub(crate) fn push(&mut self, place: Place, ways_mm: f64) {
        let own_mm = place.advance_mm.abs() + place.radius_mm * place.turn_rad.abs();
        let FrictionTuning { stick, stick_at_rest, .. } = self.tuning;
        let stick_mm = (stick * own_mm.max(stick_at_rest * ways_mm)).max(LEAST_STICK_MM);
        self.places.push(Place { stick_mm, ..place });
    }

    /// The nodes.
    pub(crate) fn places(&self) -> &[Place] {
        &self.places
    }

    /// Changes the angle from which a node slips by so much.
    pub(crate) fn slip_from(&mut self, place: usize, by_rad: f64) {
        self.places[place].from_rad += by_rad;
    }

    /// Renews the force across the line of each node and the length it represents, N and mm; returns the change of
    /// couples relative to the largest.
    pub(crate) fn renew(&mut self, state: &RodState, forces: impl Fn(&Place) -> (f64, f64)) -> f64 {
        let (mut change, mut sum) = (0.0, 0.0);
        for place in &mut self.places {
            let (force_n, length_mm) = forces(place);
            let arm = place.coefficient * place.radius_mm;
            if place.sets.is_some() {
                change += arm * (place.parts(state)[1] * (force_n - place.force_n)).abs();
                sum += arm * force_n;
            }
            (place.force_n, place.length_mm) = (force_n, length_mm);
        }
        if sum > 0.0 { change / sum } else { 0.0 }
    }

    /// Dissipated energy, mJ.
    pub(crate) fn taken_mj(&self, state: &RodState) -> f64 {
        self.places.iter().map(|place| place.value(state)).sum()
    }

    /// Adds the terms in the angles.
    pub(crate) fn add(&self, state: &RodState, into: &mut dyn Stencils) {
        for place in self.places.iter().filter(|place| place.force_n > 0.0) {
            into.add_value(place.value(state));
            if let Some(sets) = place.sets {
                into.add_turning(place.node, sets, place.couple(state));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::rod::Frame;

    /// Two sets of angles at two nodes, the second rotated by these, with friction there.
    fn turned(advance_mm: f64, angles: [f64; 2]) -> (Place, RodState) {
        let frames = vec![Frame::new(Vec3::z(), None); 2];
        let state = RodState { frames, angles: vec![0.0, 0.0, angles[0], angles[1]], ..RodState::default() };
        let place = Place {
            sets: Some((0, 1)),
            advance_mm,
            turn_rad: 0.3,
            from_rad: 0.1,
            force_n: 2.0,
            ..Place::new((1, 0, 1), 0.25, 0.4)
        };
        let mut between = Between::default();
        between.push(place, 0.5);
        (between.places[0], state)
    }

    #[test]
    fn couples_are_slopes_of_the_energy() {
        // Slipping, sticking, and slipping along the line alone.
        for (advance_mm, first) in [(0.2, 0.5), (0.0, 0.5), (0.0, 0.2001), (0.3, 0.2)] {
            let h = 1e-8;
            let at = |by: f64| {
                let (place, state) = turned(advance_mm, [first + by, 0.1]);
                (place.value(&state), place.couple(&state))
            };
            let (minus, here, plus) = (at(-h), at(0.0), at(h));
            let slope = (plus.0 - minus.0) / (2.0 * h);
            assert!((slope - here.1.0).abs() < 1e-7, "{slope} {here:?}");
            let slope = (plus.1.0 - minus.1.0) / (2.0 * h);
            assert!((slope - here.1.1).abs() < 1e-4 * (1.0 + here.1.1), "{slope} {here:?}");
        }
    }

    #[test]
    fn what_slips_uses_all_of_its_cone_and_what_sticks_less() {
        let (place, state) = turned(0.3, [0.7, 0.1]);
        let [along, around] = place.parts(&state);
        assert!((along.hypot(around) - 1.0).abs() < 1e-12);
        // r (0.6 − 0.1) around to 0.3 along.
        assert!((around / along - 0.4 * 0.5 / 0.3).abs() < 1e-12);
        let (place, state) = turned(0.0, [0.2001, 0.1]);
        assert!(place.parts(&state)[1] < 0.9);
    }
}
