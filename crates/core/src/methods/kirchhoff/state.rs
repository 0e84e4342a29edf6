//! The complete state of the exact rod between steps.

use std::fmt::Display;

use serde::{Deserialize, Serialize};

use super::balance::Balance;
use super::extrapolation::Correction;
use super::hands::Hand;
use super::joined::Coils;
use super::mesh::Fineness;
use super::step_control::{StepControl, Stride};
use super::substep::{Effort, Found};
use crate::contact::{ContactSurface, InnerFriction, KnownPoints, NormalForce, PairForce};
use crate::device::Stack;
use crate::methods::{InstrumentReport, Sheath, StepReport, Surroundings};
use crate::rod::RodState;
use crate::solve::Neighbourhood;
use crate::{Error, Result, Vec3};

/// The state of the exact rod: configuration and forces, the predictor's correction, what its contact points know of
/// the wall, and the report of the last step.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct KirchhoffState {
    pub(super) rod: RodState,
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
    /// What ticks have left unfinished.
    pub(super) unfinished: Option<Box<Unfinished>>,
    /// Detached coils.
    #[serde(with = "crate::methods::state::shared")]
    pub(super) coils: Coils,
    pub(super) report: StepReport,
    /// Friction outside the body, for each hand.
    pub(super) outside: Vec<OutsideFriction>,
}

/// Friction of the sheath's mouth and of valves on a hand, part of its forces in the report. It moves nothing inside, so
/// the energy balance of the device leaves it out.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct OutsideFriction {
    /// On its push force, N.
    pub(super) push_n: f64,
    /// On its torque, N·mm.
    pub(super) torque_nmm: f64,
}

/// A command that ticks have begun.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Unfinished {
    /// Step size control.
    pub(super) control: StepControl,
    /// The part of the motion that is being solved for.
    pub(super) part: Option<UnderWay>,
    /// The relaxation in progress.
    pub(super) flight: Option<Flight>,
}

/// The way of a device to an equilibrium, or to where it comes to rest.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Flight {
    /// The largest motion of a hand before it, mm.
    pub(super) part_mm: f64,
    /// Newton iterations taken.
    pub(super) iterations: usize,
    /// Energy balance of the way so far.
    pub(super) balance: Option<Balance>,
    /// Its length, as a sum of fractions of the distance allowed from a prediction.
    off: f64,
    /// Its longest part.
    longest: f64,
    /// The node that moved farthest in that, mm.
    pub(super) farthest_mm: Vec3,
}

impl Flight {
    /// Begins with a motion of the hands.
    pub(super) fn over(part_mm: f64) -> Self {
        let (off, longest, farthest_mm) = (0.0, 0.0, Vec3::zeros());
        Self { part_mm, iterations: 0, balance: None, off, longest, farthest_mm }
    }

    /// Goes on by a part, solved for in so many iterations.
    pub(super) fn with(self, found: &Found, iterations: usize) -> Self {
        let is_longest = found.off > self.longest || self.balance.is_none();
        let (longest, farthest_mm) =
            if is_longest { (found.off, found.farthest_mm) } else { (self.longest, self.farthest_mm) };
        let balance = Some(self.balance.map_or(found.balance, |so_far| so_far.and(&found.balance)));
        let (iterations, off) = (self.iterations + iterations, self.off + found.off);
        Self { iterations, balance, off, longest, farthest_mm, ..self }
    }

    /// Whether the device has jumped: it is far from where its hands have led it, or has released energy.
    pub(super) fn jumps(&self) -> bool {
        self.off > 1.0 || self.balance.is_some_and(|balance| balance.is_set_free())
    }
}

/// A part of a command whose solution ticks have begun.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct UnderWay {
    /// Positions of the hands after it.
    pub(super) hands: Vec<Hand>,
    /// The largest motion of a hand in it, mm.
    pub(super) part_mm: f64,
    /// How it is solved.
    pub(super) effort: Effort,
    /// The device's state in the unfinished solution, with its normal forces.
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
    pub(super) fn at(surroundings: &Surroundings<'_>) -> Self {
        let (sheath, stack) = (surroundings.sheath, surroundings.stack);
        let mut rod = RodState::default();
        rod.frames.push(sheath.frame());
        rod.angles.resize(stack.angles().max(1), 0.0);
        rod.positions.push(sheath.position_mm);
        let instruments = if stack.is_several() {
            vec![InstrumentReport::default(); stack.instruments().len()]
        } else {
            Vec::new()
        };
        Self {
            rod,
            forces: Vec::new(),
            inner_friction: Vec::new(),
            known: KnownPoints::default(),
            pairs: Vec::new(),
            correction: Correction::default(),
            coils: Coils::default(),
            stride: Stride { part_mm: stack.length_mm(), held: false },
            unfinished: None,
            outside: vec![OutsideFriction::default(); instruments.len().max(1)],
            report: StepReport { converged: true, instruments, ..StepReport::default() },
        }
    }

    /// The report of the step that led to this state.
    pub fn report(&self) -> &StepReport {
        &self.report
    }

    /// Motion and forces of a hand without friction outside the body.
    pub(super) fn inside(&self, index: usize) -> InstrumentReport {
        let (hand, outside) = (self.report.hand(index), self.outside[index]);
        InstrumentReport {
            push_force_n: hand.push_force_n.map(|force_n| force_n - outside.push_n),
            torque_nmm: hand.torque_nmm - outside.torque_nmm,
            ..hand
        }
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
        let contacts = &mut self.report.contacts;
        contacts.reserve(points.saturating_sub(contacts.len()));
    }

    /// Resets to nothing inserted: only the angles of the tails remain.
    pub(super) fn withdraw(&mut self, stack: &Stack, hands: &[Hand]) {
        self.rod.truncate(1);
        self.turn_tails(stack, hands);
        self.forces.clear();
        self.inner_friction.clear();
        self.known.clear();
        self.pairs.clear();
        self.correction.clear();
    }

    /// Sets the angles of the tails to those of the hands.
    pub(super) fn turn_tails(&mut self, stack: &Stack, hands: &[Hand]) {
        if !stack.is_several() {
            self.rod.angles[0] = hands[0].turn_rad;
            return;
        }
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
        if self.report.angles != (belongs.sets > 0) {
            let mend = "it has material angles where this simulation has none, or none where it has: another device or friction";
            return Err(other("angles", self.report.angles, mend));
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
        if self.outside.len() != hands {
            return Err(other("outside", self.outside.len(), format!("there are {hands} instruments here")));
        }
        if let Some(unfinished) = self.unfinished.as_deref() {
            unfinished.check()?;
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
        let mut outside = self.outside.iter().flat_map(|friction| [friction.push_n, friction.torque_nmm]);
        let is_finite =
            r.is_finite() && outside.all(f64::is_finite) && self.pairs.iter().all(PairForce::is_finite);
        if !(is_finite && inner_friction.all(f64::is_finite)) {
            return Err(other("rod", "not finite", "all its numbers must be finite"));
        }
        Ok(())
    }
}

impl Unfinished {
    fn check(&self) -> Result<()> {
        let length = |what: &str, value: f64| match value >= 0.0 && value.is_finite() {
            true => Ok(()),
            false => Err(other(&format!("unfinished.{what}"), value, "must be finite and at least 0")),
        };
        length("control.part_mm", self.control.stride().part_mm)?;
        length("control.flight_mm", self.control.flight_mm().unwrap_or(0.0))?;
        if let Some(part) = &self.part {
            length("part.shift", part.shift)?;
            length("part.part_mm", part.part_mm)?;
        }
        let Some(flight) = &self.flight else { return Ok(()) };
        length("flight.part_mm", flight.part_mm)?;
        length("flight.off", flight.off)?;
        if flight.balance.is_some_and(|balance| !balance.is_finite()) {
            return Err(other("unfinished.flight", "not finite", "all its numbers must be finite"));
        }
        Ok(())
    }
}

/// Rounding of the length of a unit vector.
const SAME_DIRECTION: f64 = 1e-12;

fn show(v: &Vec3) -> String {
    crate::error::vector(v)
}

fn other(what: &str, value: impl Display, mend: impl Display) -> Error {
    Error::parameter(format!("state.{what}"), value, format!("{mend}: restore a state of this scene"))
}
