//! Random commands on three coaxial instruments: run by `endowire verify --stress` in addition to the stress test of
//! insertions.
//!
//! A wire in a microcatheter in a catheter are advanced, pulled back and rotated, alone and together, by tenths of a
//! millimetre and by centimetres, and the wire is exchanged for a stiff one. Every command ends in an equilibrium
//! inside the vessel, or is rejected with a reason and leaves the state unchanged, byte for byte.

use std::f64::consts::PI;

use endowire_core::device::{Device, Instrument, Section, Stack};
use endowire_core::insertion::{Command, Move, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};
use endowire_core::{Error, Result};
use serde::Serialize;

use crate::crossing::CrossingTest;
use crate::noise::Noise;

/// Number of commands after which a case restarts with other random numbers.
pub const COURSE: usize = 1_000;
/// Step in which the instruments are first inserted together, mm.
const APPROACH_MM: f64 = 2.0;
/// Initial distances of the wire and the microcatheter ahead of the catheter, mm.
const AHEAD_MM: [f64; 2] = [25.0, 10.0];
/// Longest advance, mm, of small, ordinary and large commands.
const ADVANCES_MM: [f64; 3] = [0.1, 1.5, 8.0];
/// Largest rotations, rad.
const TURNS_RAD: [f64; 3] = [0.05, 0.3, PI];
/// Bias of the hands towards pushing, as a fraction of the longest advance.
const DRIFT: f64 = 0.13;
/// Steps of an exchange, mm.
const EXCHANGE_MM: f64 = 8.0;
/// Friction between instruments, in the sheath's mouth and on the wall, and of the valve, N.
const FRICTION: f64 = 0.15;
const VALVE_N: f64 = 0.2;

/// Where friction acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FrictionAt {
    /// Nowhere.
    Nothing,
    /// Between instruments, and in the sheath.
    Within,
    /// Also on the wall. Three instruments: there is no stiff wire.
    Everywhere,
}

/// A vessel, its mesh, and the friction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct InstrumentCase {
    /// A built-in anatomy.
    pub vessel: &'static str,
    /// Edges of its triangles, mm.
    pub edge_mm: f64,
    /// Element length, mm.
    pub element_mm: f64,
    /// Where friction acts.
    pub friction: FrictionAt,
    /// Initial inserted length of the catheter, mm.
    pub start_mm: f64,
}

/// Result of random commands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InstrumentRow {
    /// The case.
    #[serde(flatten)]
    pub case: InstrumentCase,
    /// Numbers of commands carried out and rejected.
    pub commands: usize,
    /// See [`InstrumentRow::commands`].
    pub refused: usize,
    /// Commands without an equilibrium.
    pub unconverged: usize,
    /// Commands after which the line had passed through the wall.
    pub crossed: usize,
    /// Commands rejected without a reason in the command or the vessel.
    pub unexplained: usize,
    /// Rejected commands that changed the state.
    pub changed: usize,
    /// Newton iterations of the worst command.
    pub most_iterations: u32,
    /// Largest number of sub-steps of a command.
    pub most_substeps: u32,
    /// The first error: course, number of the command, and description.
    pub first: String,
    /// Whether there was no error.
    pub pass: bool,
}

/// The cases: arches and curved vessels, with and without friction, finely and coarsely meshed.
pub fn cases() -> Vec<InstrumentCase> {
    let case = |vessel, edge_mm, element_mm, friction, start_mm| InstrumentCase {
        vessel,
        edge_mm,
        element_mm,
        friction,
        start_mm,
    };
    vec![
        case("aortic_arch", 2.25, 4.0, FrictionAt::Nothing, 165.0),
        case("aortic_arch", 2.25, 4.0, FrictionAt::Within, 165.0),
        case("aortic_arch", 2.25, 4.0, FrictionAt::Everywhere, 165.0),
        case("aortic_arch", 4.5, 4.0, FrictionAt::Nothing, 165.0),
        case("aortic_arch_iii", 2.4, 4.0, FrictionAt::Within, 165.0),
        case("curved_tube", 1.2, 2.0, FrictionAt::Nothing, 90.0),
        case("curved_tube", 1.2, 2.0, FrictionAt::Everywhere, 90.0),
        case("hepatic", 1.1, 2.0, FrictionAt::Within, 60.0),
    ]
}

/// A hooked wire, a stiff one for exchange, a straight microcatheter and a bent catheter. With friction on the wall
/// every instrument is twisted, which limits their number to three: no stiff wire.
fn stack(friction: FrictionAt) -> Result<Stack> {
    let one = |name: &str, sections: Vec<Section>| {
        Ok(Instrument { name: name.to_owned(), device: Device::new(sections)?, may_lead: true })
    };
    let bent = |section: Section, length_mm, curvature| Section {
        length_mm,
        rest_curvature_per_mm: [curvature, 0.0],
        ..section
    };
    let tube = |length_mm, radius_mm, inner_mm, stiffness| Section {
        inner_radius_mm: Some(inner_mm),
        ..Section::straight(length_mm, radius_mm, stiffness)
    };
    let wire = Section::straight(500.0, 0.2, 6.0);
    let catheter = tube(300.0, 0.8, 0.5, 60.0);
    let mut instruments = vec![one("wire", vec![bent(wire, 12.0, 0.08), wire])?];
    if friction != FrictionAt::Everywhere {
        instruments.push(one("stiff wire", vec![Section::straight(512.0, 0.25, 40.0)])?);
    }
    instruments.push(one("microcatheter", vec![tube(400.0, 0.45, 0.3, 8.0)])?);
    instruments.push(one("catheter", vec![bent(catheter, 25.0, 0.025), catheter])?);
    let count = instruments.len();
    let stack = Stack::new(instruments)?;
    if friction == FrictionAt::Nothing {
        return Ok(stack);
    }
    stack.with_friction((0..count).map(|index| if index + 1 < count { FRICTION } else { 0.0 }).collect())
}

/// Three instruments in a vessel, the thinner farther in.
pub struct InstrumentStress {
    /// Their initial state.
    pub start: Simulation,
    /// The vessel's triangles.
    pub crossing: CrossingTest,
}

impl InstrumentStress {
    /// Inserts them.
    ///
    /// # Errors
    /// An unknown vessel, and errors during insertion.
    pub fn new(case: &InstrumentCase) -> Result<Self> {
        let Some(tree) = anatomy::tree(case.vessel) else {
            return Err(Error::parameter("vessel", case.vessel, "is not built in"));
        };
        let made = GeneratedWall::new(&tree, Resolution::EdgeMm(case.edge_mm))?;
        let crossing = CrossingTest::new(made.wall.mesh());
        let mut sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0)?;
        if case.friction != FrictionAt::Nothing {
            sheath = sheath.with_friction(VALVE_N, FRICTION)?;
        }
        let friction = if case.friction == FrictionAt::Everywhere { FRICTION } else { 0.0 };
        let options = KirchhoffOptions { element_mm: case.element_mm, ..KirchhoffOptions::default() };
        let mut start = Simulation::builder(made.wall, stack(case.friction)?, sheath)
            .properties(WallProperties { friction, ..WallProperties::default() })
            .method(&options)
            .build()?;
        let count = start.stack().instruments().len();
        let each = [0, count - 2, count - 1];
        let push = |lengths: [f64; 3]| {
            let moves = each.into_iter().zip(lengths);
            moves
                .map(|(instrument, mm)| Move { instrument, command: Command::advance(mm) })
                .collect::<Vec<_>>()
        };
        start.step_together(&push([AHEAD_MM[0] + 5.0, AHEAD_MM[1] + 5.0, 5.0]))?;
        for _ in 0..((case.start_mm - 5.0) / APPROACH_MM) as usize {
            start.step_together(&push([APPROACH_MM; 3]))?;
        }
        Ok(Self { start, crossing })
    }

    /// Carries out this many random commands, each [`COURSE`] from the initial state.
    pub fn run(case: &InstrumentCase, commands: usize) -> InstrumentRow {
        let mut row = InstrumentRow::new(case);
        let stress = match Self::new(case) {
            Ok(stress) => stress,
            Err(error) => {
                (row.first, row.pass) = (error.to_string(), false);
                return row;
            }
        };
        for course in 0..commands.div_ceil(COURSE) {
            let count = COURSE.min(commands - course * COURSE);
            stress.course(course as u64, count, &mut row);
        }
        row
    }

    /// A course of commands, counted in `row`. An error does not end it: the next command must succeed all the same.
    fn course(&self, seed: u64, count: usize, row: &mut InstrumentRow) {
        let mut simulation = self.start.clone();
        let mut hands = RandomHands::new(seed);
        let mut wrong = |what: &mut usize, number: usize, moves: &[Move], reported: &str| {
            *what += 1;
            if row.first.is_empty() {
                row.first = format!("course {seed}, command {number}, {moves:?}: {reported}");
            }
        };
        let [mut unconverged, mut crossed, mut unexplained, mut changed] = [0; 4];
        for number in 0..count {
            let moves = hands.next(&simulation);
            let before = bytes(&simulation);
            match simulation.step_together(&moves).map(|report| report.converged) {
                Ok(converged) => {
                    if !converged {
                        wrong(&mut unconverged, number, &moves, "no equilibrium");
                    }
                    if self.crossing.is_crossed_by(&simulation) {
                        wrong(&mut crossed, number, &moves, "through the wall");
                    }
                    let report = simulation.report();
                    row.commands += 1;
                    row.most_iterations = row.most_iterations.max(report.iterations);
                    row.most_substeps = row.most_substeps.max(report.substeps);
                }
                Err(error) => {
                    if !matches!(error, Error::Parameter { .. } | Error::End(_)) {
                        wrong(&mut unexplained, number, &moves, &error.to_string());
                    }
                    if bytes(&simulation) != before {
                        wrong(&mut changed, number, &moves, "refused, and another state");
                    }
                    row.refused += 1;
                    hands.refused();
                }
            }
        }
        row.unconverged += unconverged;
        row.crossed += crossed;
        row.unexplained += unexplained;
        row.changed += changed;
        row.pass = row.first.is_empty();
    }
}

impl InstrumentRow {
    fn new(case: &InstrumentCase) -> Self {
        Self {
            case: *case,
            commands: 0,
            refused: 0,
            unconverged: 0,
            crossed: 0,
            unexplained: 0,
            changed: 0,
            most_iterations: 0,
            most_substeps: 0,
            first: String::new(),
            pass: true,
        }
    }
}

/// The bytes of a saved state.
pub fn bytes(simulation: &Simulation) -> Vec<u8> {
    // Writing into memory does not fail; if it did, all states would be equal, which the tests would detect.
    postcard::to_allocvec(&simulation.state()).unwrap_or_default()
}

/// A wire exchanged for another, which is inserted as far as the first was.
#[derive(Debug, Clone, Copy)]
struct Exchange {
    out: usize,
    into: usize,
    to_mm: f64,
}

/// Random hands with a bias towards pushing, one or several at a time, which often repeat themselves, and sometimes
/// exchange the wire.
#[derive(Debug, Clone)]
pub struct RandomHands {
    noise: Noise,
    last: Vec<Move>,
    exchange: Option<Exchange>,
}

impl RandomHands {
    /// Different hands for every seed.
    pub fn new(seed: u64) -> Self {
        Self { noise: Noise::new(seed), last: Vec::new(), exchange: None }
    }

    /// The last moves were rejected: they are not repeated.
    pub fn refused(&mut self) {
        (self.last, self.exchange) = (Vec::new(), None);
    }

    /// The next moves.
    pub fn next(&mut self, simulation: &Simulation) -> Vec<Move> {
        let lengths_mm = simulation.report().lengths_mm();
        if let Some(step) = self.exchange.and_then(|exchange| exchange.next(&lengths_mm)) {
            return vec![step];
        }
        self.exchange = None;
        if !self.last.is_empty() && self.noise.happens(0.5) {
            return self.last.clone();
        }
        // Two wires, one of them inserted, and two catheters; or one wire.
        let count = lengths_mm.len();
        let wire = usize::from(count > 3 && lengths_mm[1] > 0.0);
        if count > 3 && lengths_mm[wire] > 0.0 && self.noise.happens(0.005) {
            let exchange = Exchange { out: wire, into: 1 - wire, to_mm: lengths_mm[wire] };
            self.exchange = Some(exchange);
            self.last.clear();
            return exchange.next(&lengths_mm).into_iter().collect();
        }
        self.last.clear();
        for instrument in [wire, count - 2, count - 1] {
            if self.noise.happens(0.5) {
                let command = self.command();
                self.last.push(Move { instrument, command });
            }
        }
        self.last.clone()
    }

    fn command(&mut self) -> Command {
        let size = match self.noise.below(20) {
            0..=3 => 0,
            4..=18 => 1,
            _ => 2,
        };
        let rests = self.noise.happens(0.2);
        let advance_mm = if rests { 0.0 } else { ADVANCES_MM[size] * (self.noise.next() + DRIFT) };
        let turns = self.noise.happens(0.4);
        let rotate_rad = if turns { TURNS_RAD[size] * self.noise.next() } else { 0.0 };
        Command { advance_mm, rotate_rad, ..Command::default() }
    }
}

impl Exchange {
    /// The next step; `None` when complete.
    fn next(&self, lengths_mm: &[f64]) -> Option<Move> {
        let (out_mm, rest_mm) = (lengths_mm[self.out], self.to_mm - lengths_mm[self.into]);
        if out_mm > 0.0 {
            let command = Command::retract(out_mm.min(EXCHANGE_MM));
            return Some(Move { instrument: self.out, command });
        }
        let command = Command::advance(rest_mm.min(EXCHANGE_MM));
        (rest_mm > 0.0).then_some(Move { instrument: self.into, command })
    }
}
