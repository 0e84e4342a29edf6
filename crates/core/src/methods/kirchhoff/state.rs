//! The complete state of the exact rod between steps.

use std::fmt::Display;

use serde::{Deserialize, Serialize};

use super::balance::Balance;
use super::extrapolation::Correction;
use super::hands::{Hand, HandForce};
use super::joined::Coils;
use super::mesh::Fineness;
use super::part::{Effort, Found};
use super::step_control::{StepControl, Stride};
use super::tail::Twist;
use crate::contact::{ContactSurface, InnerFriction, KnownPoints, MovedWall, NormalForce, PairForce, Touch};
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
    /// The twist of their tails.
    pub(super) twists: Vec<Twist>,
    /// Force between device and sheath across the axis, N.
    pub(super) across_n: f64,
    /// Motion of the hands that commands have not yet carried out; empty if the device is in equilibrium where they are.
    pub(super) behind: Vec<Command>,
    pub(super) rod: RodState,
    /// Displacements of the unknowns of the vessel's course, mm; empty if it does not yield.
    pub(super) course_mm: Vec<Vec3>,
    /// Their change in the last part, mm.
    pub(super) course_change_mm: Vec<Vec3>,
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
    /// What commands have left unfinished.
    pub(super) unfinished: Option<Box<Unfinished>>,
    /// Detached coils.
    #[serde(with = "crate::methods::state::shared")]
    pub(super) coils: Coils,
}

/// A command that has begun and is not done.
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

/// A part of a command whose solution has begun.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct UnderWay {
    /// The largest motion of a hand in it, mm.
    pub(super) part_mm: f64,
    /// How it is solved.
    pub(super) effort: Effort,
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
    /// Unknowns of the vessel's course.
    pub(super) course: usize,
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
        let still = vec![Vec3::zeros(); surroundings.course.map_or(0, |course| course.unknowns())];
        Self {
            hands: vec![Hand::default(); hands],
            hand_forces: vec![HandForce { jumps: stack.is_several(), ..HandForce::default() }; hands],
            twists: vec![Twist::default(); hands],
            across_n: 0.0,
            behind: Vec::new(),
            rod,
            course_mm: still.clone(),
            course_change_mm: still,
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
            unfinished: None,
        }
    }

    /// Drops motion of the hands that is left, and the solution that was begun for it. A relaxation in progress goes on:
    /// where the device is seen on its way it is in no equilibrium.
    pub(super) fn forget(&mut self) {
        if let Some(unfinished) = self.unfinished.as_deref_mut()
            && unfinished.flight.is_some()
        {
            unfinished.part = None;
            self.behind.fill(Command::default());
        } else {
            (self.unfinished, self.behind) = (None, Vec::new());
        }
    }

    /// Deepest penetration of the device's surface into the wall, mm; 0 without contact.
    pub(super) fn deepest_mm(&self) -> f64 {
        self.touches.iter().fold(0.0, |deepest_mm, (_, touch)| touch.contact.penetration_mm.max(deepest_mm))
    }

    /// Places of its nodes in the undisplaced vessel, mm, from the entry to the tip.
    pub(super) fn material_line(&self, wall: MovedWall<'_>) -> impl Iterator<Item = Vec3> {
        self.rod.positions[..=self.rod.elements()].iter().map(move |x| wall.material(x))
    }

    /// Allocates for up to `elements` elements and `points` contact points.
    pub(super) fn reserve(&mut self, elements: usize, points: usize) {
        self.rod.reserve(elements);
        self.forces.reserve(points.saturating_sub(self.forces.len()));
        self.known.reserve(points);
        self.correction.reserve(elements);
        self.touches.reserve((points / TOUCHING).saturating_sub(self.touches.len()));
    }

    /// Resets to nothing inserted: only the angles of the hands remain.
    pub(super) fn withdraw(&mut self, stack: &Stack, hands: &[Hand]) {
        self.rod.truncate(1);
        self.move_hands(hands);
        for (set, hand) in stack.sets().iter().zip(hands) {
            if let Some(set) = *set {
                self.rod.angles[set] = hand.turn_rad;
            }
        }
        self.touches.clear();
        self.forces.clear();
        self.inner_friction.clear();
        self.known.clear();
        self.pairs.clear();
        self.correction.clear();
        self.course_mm.fill(Vec3::zeros());
        self.course_change_mm.fill(Vec3::zeros());
    }

    /// Sets the positions of the hands.
    pub(super) fn move_hands(&mut self, hands: &[Hand]) {
        self.hands.clear();
        self.hands.extend_from_slice(hands);
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
            let remedy = format!("its lists are not those of {n} elements");
            return Err(other("rod", r.positions.len(), remedy));
        }
        if [self.course_mm.len(), self.course_change_mm.len()] != [belongs.course; 2] {
            let remedy = format!("the vessel's course has {} unknowns here", belongs.course);
            return Err(other("course_mm", self.course_mm.len(), remedy));
        }
        if self.has_angles != (belongs.sets > 0) {
            let remedy = "it has material angles where this simulation has none, or none where it has: another device or friction";
            return Err(other("has_angles", self.has_angles, remedy));
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
            let remedy = format!("at {} nodes {} instruments may rub in others here", n + 1, belongs.inner);
            return Err(other("inner_friction", self.inner_friction.len(), remedy));
        }
        if !self.known.fits(belongs.points, belongs.surface.pieces()) {
            let remedy = format!(
                "{} contact points on {} pieces of wall are here: another vessel, device or wall",
                belongs.points,
                belongs.surface.pieces()
            );
            return Err(other("known", self.known.len(), remedy));
        }
        let felt = (belongs.fineness, belongs.surface.pieces());
        self.coils
            .iter()
            .try_for_each(|coil| coil.check(belongs.stack, felt, (sets, belongs.inner_friction)))?;
        let hands = belongs.stack.instruments().len();
        let counts = [self.hands.len(), self.hand_forces.len(), self.twists.len(), self.behind.len()];
        if counts != [hands, hands, hands, if self.behind.is_empty() { 0 } else { hands }] {
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
            let remedy = format!(
                "the sheath's mouth is at {} here, and its direction and bends_towards must be the same",
                show(&position)
            );
            return Err(other("sheath", show(&r.positions[0]), remedy));
        }
        let mut inner_friction =
            self.inner_friction.iter().flat_map(|rub| [rub.along, rub.around, rub.pressure_n_per_mm]);
        let motions = self.behind.iter().flat_map(|left| [left.advance_mm, left.rotate_rad, left.steer]);
        let turns = self.hands.iter().flat_map(|hand| [hand.inserted_mm, hand.turn_rad, hand.steer]);
        let course = self.course_mm.iter().chain(&self.course_change_mm);
        let is_finite = r.is_finite()
            && motions
                .chain(turns)
                .chain([self.energy.total(), self.across_n])
                .chain(self.drag_n.iter().chain(course.flatten()).copied())
                .all(f64::is_finite)
            && self.hand_forces.iter().all(HandForce::is_finite)
            && self.twists.iter().all(Twist::is_finite)
            && self.touches.iter().all(|(_, touch)| touch.is_finite())
            && self.pairs.iter().all(PairForce::is_finite);
        if !(is_finite && inner_friction.all(|part| part.is_finite())) {
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
        let count = |what: &str, value: usize| match value <= LARGEST_COUNT {
            true => Ok(()),
            false => {
                Err(other(&format!("unfinished.{what}"), value, format!("must be at most {LARGEST_COUNT}")))
            }
        };
        count("control.again", self.control.again())?;
        length("control.part_mm", self.control.stride().part_mm)?;
        length("control.flight_mm", self.control.flight_mm().unwrap_or(0.0))?;
        if let Some(part) = &self.part {
            count("part.iterations", part.iterations)?;
            length("part.shift", part.shift)?;
            length("part.part_mm", part.part_mm)?;
        }
        let Some(flight) = &self.flight else { return Ok(()) };
        count("flight.iterations", flight.iterations)?;
        length("flight.part_mm", flight.part_mm)?;
        length("flight.off", flight.off)?;
        length("flight.longest", flight.longest)?;
        let is_finite = flight.farthest_mm.iter().all(|x| x.is_finite());
        if !is_finite || flight.balance.is_some_and(|balance| !balance.is_finite()) {
            return Err(other("unfinished.flight", "not finite", "all its numbers must be finite"));
        }
        Ok(())
    }
}

/// Largest number of iterations or attempts in a restored state.
const LARGEST_COUNT: usize = 1_000_000;
/// Memory is kept for one contact in as many contact points, as few touch the wall at a time.
pub(super) const TOUCHING: usize = 8;
/// Rounding of the length of a unit vector.
const SAME_DIRECTION: f64 = 1e-12;

fn show(v: &Vec3) -> String {
    crate::error::vector(v)
}

fn other(what: &str, value: impl Display, remedy: impl Display) -> Error {
    Error::parameter(format!("state.{what}"), value, format!("{remedy}: restore a state of this scene"))
}
