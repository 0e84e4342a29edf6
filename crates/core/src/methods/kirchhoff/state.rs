//! The complete state of the exact rod between steps.

use std::fmt::Display;

use serde::{Deserialize, Serialize};

use super::extrapolation::Correction;
use super::hands::{Hand, HandForce};
use super::joined::Coils;
use super::mesh::Fineness;
use super::step_control::Stride;
use crate::contact::{ContactSurface, InnerFriction, KnownPoints, NormalForce, PairForce, Touch};
use crate::device::Stack;
use crate::methods::{Command, Energy, Sheath, Surroundings};
use crate::rod::RodState;
use crate::solve::Neighbourhood;
use crate::{Error, Result, Vec3};

/// The state of the exact rod: hands, configuration and forces, the predictor's correction, and what its contact
/// points know of the wall.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct KirchhoffState {
    /// Positions of the hands.
    pub(super) hands: Vec<Hand>,
    /// Their forces.
    pub(super) hand_forces: Vec<HandForce>,
    /// Motion of the hands that ticks have not yet carried out; empty if the device is at rest where they are.
    pub(super) behind: Vec<Command>,
    pub(super) rod: RodState,
    /// Whether it has material angles.
    pub(super) has_angles: bool,
    /// Stored energy.
    pub(super) energy: Energy,
    /// Contacts with the wall, in the order of their contact points, whose indices come first; those of coils follow.
    pub(super) touches: Vec<(usize, Touch)>,
    /// Drag of the blood, N.
    pub(super) drag_n: Vec3,
    /// Normal forces at the contact points, tip first; empty without friction.
    pub(super) forces: Vec<NormalForce>,
    /// Friction between instruments: for each node those that have one outside them, the innermost first; empty
    /// without friction.
    pub(super) inner_friction: Vec<InnerFriction>,
    pub(super) known: KnownPoints,
    /// Forces of loops and coils on each other.
    pub(super) pairs: Vec<PairForce>,
    pub(super) correction: Correction,
    /// Step size of the next part of a command.
    pub(super) stride: Stride,
    /// Unfinished work of ticks.
    pub(super) tick: Ticking,
    /// Detached coils.
    #[serde(with = "crate::methods::state::shared")]
    pub(super) coils: Coils,
}

/// Progress of ticks.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) enum Ticking {
    /// The device is at rest, and nothing has begun.
    #[default]
    Rest,
    /// It is at rest, and a part of the motion is being solved for.
    Solving(Box<UnderWay>),
    /// It is relaxing to where it comes to rest; number of Newton iterations so far.
    Moving(usize),
}

/// A part of a command whose solution ticks have begun.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct UnderWay {
    /// The largest motion of a hand in it, mm.
    pub(super) part_mm: f64,
    /// The device's state in the unfinished solution, with its normal forces, and the hands after the part.
    pub(super) state: KirchhoffState,
    /// The neighbourhood of its prediction.
    pub(super) neighbourhood: Neighbourhood,
    /// Shift of the last step.
    pub(super) shift: f64,
    /// Newton iterations taken.
    pub(super) iterations: usize,
}

/// Sizes, given by a mesh, that its states must have.
pub(super) struct Belongs<'a> {
    pub(super) stack: &'a Stack,
    pub(super) surface: &'a ContactSurface,
    pub(super) sheath: &'a Sheath,
    pub(super) fineness: Fineness,
    /// Numbers of elements and contact points of the inserted length.
    pub(super) elements: usize,
    pub(super) points: usize,
    /// Number of sets of angles.
    pub(super) sets: usize,
    pub(super) inner_friction: bool,
    /// Number of instruments with one outside them, if there is friction between any.
    pub(super) inner: usize,
}

impl KirchhoffState {
    /// Nothing inserted.
    pub(super) fn at(surroundings: &Surroundings<'_>, has_angles: bool) -> Self {
        let (sheath, stack) = (surroundings.sheath, surroundings.stack);
        let mut rod = RodState::default();
        rod.frames.push(sheath.frame());
        rod.angles.resize(stack.angles().max(1), 0.0);
        rod.positions.push(sheath.position_mm);
        let hands = stack.instruments().len();
        Self {
            hands: vec![Hand::default(); hands],
            hand_forces: vec![HandForce { jumps: stack.is_several(), ..HandForce::default() }; hands],
            behind: Vec::new(),
            rod,
            has_angles,
            energy: Energy::default(),
            touches: Vec::new(),
            drag_n: Vec3::zeros(),
            forces: Vec::new(),
            inner_friction: Vec::new(),
            known: KnownPoints::default(),
            pairs: Vec::new(),
            correction: Correction::default(),
            coils: Coils::default(),
            stride: Stride { part_mm: stack.length_mm(), held: false },
            tick: Ticking::Rest,
        }
    }

    /// Deepest penetration of the device's surface into the wall, mm; 0 without contact.
    pub(super) fn deepest_mm(&self) -> f64 {
        self.touches.iter().fold(0.0, |deepest_mm, (_, touch)| touch.contact.penetration_mm.max(deepest_mm))
    }

    /// Position of the tip, mm.
    pub(super) fn tip_mm(&self) -> Vec3 {
        self.rod.positions[self.rod.elements()]
    }

    /// Allocates for up to `elements` elements and `points` contact points.
    pub(super) fn reserve(&mut self, elements: usize, points: usize) {
        self.rod.reserve(elements);
        self.forces.reserve(points.saturating_sub(self.forces.len()));
        self.known.reserve(points);
        self.correction.reserve(elements);
        self.touches.reserve((points / TOUCHING).saturating_sub(self.touches.len()));
    }

    /// Resets to nothing inserted: only the angles of the tails remain.
    pub(super) fn withdraw(&mut self, stack: &Stack, hands: &[Hand]) {
        self.rod.truncate(1);
        self.move_hands(stack, hands);
        self.touches.clear();
        self.forces.clear();
        self.inner_friction.clear();
        self.known.clear();
        self.pairs.clear();
        self.correction.clear();
    }

    /// Sets the positions of the hands, and the angles of the tails to theirs.
    pub(super) fn move_hands(&mut self, stack: &Stack, hands: &[Hand]) {
        self.hands.clear();
        self.hands.extend_from_slice(hands);
        // Where coils share a set of angles, it is that of the inserted one.
        for is_in in [false, true] {
            for (set, hand) in stack.sets().iter().zip(hands) {
                if let Some(set) = set.filter(|_| is_in == (hand.inserted_mm > 0.0)) {
                    self.rod.angles[set] = hand.turn_rad;
                }
            }
        }
    }

    /// Checks that this is a state of a simulation with such a mesh: a file may contain anything.
    pub(super) fn check(&self, belongs: &Belongs<'_>) -> Result<()> {
        let n = belongs.elements;
        let elements = self.rod.elements();
        if elements != n {
            return Err(other("elements", elements, format!("the inserted length has {n} here")));
        }
        let r = &self.rod;
        let sets = belongs.sets.max(1);
        if !r.fits(n, sets) {
            let mend = format!("its lists are not those of {n} elements");
            return Err(other("rod", r.positions.len(), mend));
        }
        if self.has_angles != (belongs.sets > 0) {
            let mend = "it has material angles where this simulation has none, or none where it has: another device or friction";
            return Err(other("has_angles", self.has_angles, mend));
        }
        let forces = if belongs.inner_friction { belongs.points } else { 0 };
        if self.forces.len() != forces {
            return Err(other(
                "forces",
                self.forces.len(),
                format!("{forces} contact points feel friction here"),
            ));
        }
        if !self.inner_friction.is_empty() && self.inner_friction.len() != belongs.inner * (n + 1) {
            let mend = format!("at {} nodes {} instruments may rub in others here", n + 1, belongs.inner);
            return Err(other("inner_friction", self.inner_friction.len(), mend));
        }
        if !self.known.fits(belongs.points, belongs.surface.pieces()) {
            let mend = format!(
                "{} contact points on {} pieces of wall are here: another vessel, device or wall",
                belongs.points,
                belongs.surface.pieces()
            );
            return Err(other("known", self.known.len(), mend));
        }
        let felt = (belongs.fineness, belongs.surface.pieces());
        self.coils
            .iter()
            .try_for_each(|coil| coil.check(belongs.stack, felt, (sets, belongs.inner_friction)))?;
        let hands = belongs.stack.instruments().len();
        let counts = [self.hands.len(), self.hand_forces.len(), self.behind.len()];
        if counts != [hands, hands, if self.behind.is_empty() { 0 } else { hands }] {
            return Err(other("hands", format!("{counts:?}"), format!("there are {hands} instruments here")));
        }
        let points = belongs.points + self.coils.iter().map(|coil| coil.known.len()).sum::<usize>();
        let is_next = |touches: &[(usize, Touch)]| touches[0].0 < touches[1].0;
        if !self.touches.windows(2).all(is_next) || self.touches.last().is_some_and(|last| last.0 >= points) {
            return Err(other(
                "touches",
                self.touches.len(),
                format!("there are {points} contact points here"),
            ));
        }
        if let Ticking::Solving(under_way) = &self.tick
            && !(0.0..f64::INFINITY).contains(&under_way.shift)
        {
            return Err(other("tick.shift", under_way.shift, "must be finite and at least 0"));
        }
        let part_mm = self.stride.part_mm;
        if !(part_mm.is_finite() && part_mm > 0.0) {
            return Err(other("stride.part_mm", part_mm, "a way that is longer than 0"));
        }
        if !self.correction.fits(n, sets) {
            return Err(other(
                "correction",
                self.correction.len(),
                format!("{n} elements or none have learnt"),
            ));
        }
        let (position, frame, was) = (belongs.sheath.position_mm, belongs.sheath.frame(), &r.frames[0]);
        let turned = (frame.t - was.t).norm().max((frame.u - was.u).norm());
        if r.positions[0] != position || turned > SAME_DIRECTION {
            let mend = format!(
                "the sheath's mouth is at {} here, and its direction and bends_towards must be the same",
                show(&position)
            );
            return Err(other("sheath", show(&r.positions[0]), mend));
        }
        let mut inner_friction =
            self.inner_friction.iter().flat_map(|rub| [rub.along, rub.around, rub.pressure_n_per_mm]);
        let motions = self.behind.iter().flat_map(|left| [left.advance_mm, left.rotate_rad]);
        let turns = self.hands.iter().flat_map(|hand| [hand.inserted_mm, hand.turn_rad]);
        let is_finite = r.is_finite()
            && motions
                .chain(turns)
                .chain([self.energy.total()])
                .chain(self.drag_n.iter().copied())
                .all(f64::is_finite)
            && self.hand_forces.iter().all(HandForce::is_finite)
            && self.touches.iter().all(|(_, touch)| touch.is_finite())
            && self.pairs.iter().all(PairForce::is_finite);
        if !(is_finite && inner_friction.all(|part| part.is_finite())) {
            return Err(other("rod", "not finite", "all its numbers must be finite"));
        }
        Ok(())
    }
}

/// Memory is kept for one contact in as many contact points, as few touch the wall at a time.
pub(super) const TOUCHING: usize = 8;
/// Rounding of the length of a unit vector.
const SAME_DIRECTION: f64 = 1e-12;

fn show(v: &Vec3) -> String {
    crate::error::vector(v)
}

fn other(what: &str, value: impl Display, mend: impl Display) -> Error {
    Error::parameter(format!("state.{what}"), value, format!("{mend}: restore a state of this scene"))
}
