//! The paper's method as an insertion: commands of a hand as inputs of Algorithm 1, for a catheter that enters through a sheath.
//!
//! The paper does not specify how the chain grows while it is pushed by fractions of an element. Here nodes are at
//! whole multiples of the element length from the tip, as marks on the device, and enter with it; only the first
//! element, between the sheath and the first such node, has another length: between half and one and a half elements,
//! so that no sliver arises.
//!
//! The inputs h of the paper's Table 2 are at most a third of a segment l, and at least a fortieth of a millimetre,
//! with one linear solve each. As printed (`tangents = "free"`) a command is one input of any length. With unit
//! tangents it is divided into inputs within that range: l/3 long, halved where one has not converged; at the end of
//! a command the hand holds still until one has.

use std::sync::Arc;

use endowire_core::contact::ContactSurface;
use endowire_core::contact::extension::check_inside;
use endowire_core::insertion::{Command, StepReport, Surroundings, nodes_from_tip};
use endowire_core::methods::{ChainState, Content, Method, State, check_inserted};
use endowire_core::shape::Shape;
use endowire_core::vessel::WallStore;
use endowire_core::{Error, Result};

use super::chain::Chain;
use super::input::Input;
use super::options::{Li2011Options, LinearSolver};
use super::slide::TangentReading;
use super::wall::{ContactReading, FeltWall};

/// Remaining error of an input, relative to the limit of convergence, from which the wire has been thrown through the
/// wall, by ten radii: wherever it comes to rest then, the command has not converged.
const LOST: f64 = 100.0;
/// Longest input relative to the segment, from Table 2.
const LONGEST_INPUT: f64 = 1.0 / 3.0;
/// Shortest input, mm, from Table 2: a fortieth of a millimetre.
const SHORTEST_INPUT_MM: f64 = 0.025;
/// Tolerance, for rounding, of the ratio of a command's length to the longest input.
const ROUNDING: f64 = 1e-6;
/// Largest number of inputs at the end of a command with the hand held still.
const SETTLING: u32 = 20;
/// Retracting to within this distance of the sheath, mm, counts as retracting completely: the rounding of summed
/// increments.
const ZERO_LENGTH_MM: f64 = 1e-9;

/// The paper's method as an insertion: see the [module docs](super) for its limitations.
#[derive(Debug, Clone)]
pub struct Li2011 {
    state: ChainState,
    input: Input,
}

impl Li2011 {
    /// The method with nothing inserted; the uniform mesh of a smooth wall comes from `store`.
    ///
    /// # Errors
    /// An element length or wall stiffness that is not positive, too many nodes for memory, or a wall with friction
    /// or regions.
    pub fn new(
        options: Li2011Options,
        solver: LinearSolver,
        surroundings: &Surroundings<'_>,
        store: &dyn WallStore,
    ) -> Result<Self> {
        options.check(solver, surroundings)?;
        let wall = match options.contact {
            ContactReading::Triangle => FeltWall::Triangle(Arc::clone(surroundings.lumen.query(store)?)),
            ContactReading::Smooth => {
                let Surroundings { lumen, stack, properties, .. } = surroundings;
                let surface = ContactSurface::of(lumen, stack.radii_mm(), properties, store)?;
                FeltWall::Smooth(Arc::new(surface), None)
            }
        };
        let sheath = surroundings.sheath;
        let shape = Shape {
            positions_mm: vec![sheath.position_mm],
            tangents: vec![sheath.direction],
            from_tip_mm: vec![0.0],
        };
        let report = StepReport { converged: true, ..Default::default() };
        let chain =
            Chain { start_mm: sheath.position_mm, start_tangent: sheath.direction, ..Default::default() };
        Ok(Self {
            state: ChainState { shape, report, touched: Vec::new() },
            input: Input::new(options, solver, wall, chain),
        })
    }

    /// The chain of the last input, with its contacts: the linear system that was solved.
    pub fn chain(&self) -> &Chain {
        &self.input.chain
    }

    /// Moves the hand to a new inserted length by inputs. Returns their number, including those that were halved, how
    /// many were accepted, and whether the last of these has converged and none has lost the wire.
    fn carry(&mut self, surroundings: &Surroundings<'_>, target_mm: f64) -> Result<(u32, u32, bool)> {
        let (mut solves, mut inputs, mut lost) = (0, 0, false);
        let Li2011Options { element_mm, tangents, .. } = self.input.options;
        let whole_mm = (target_mm - self.state.report.inserted_mm).abs();
        let longest_mm = match tangents {
            TangentReading::Unit => {
                let inputs = whole_mm / (LONGEST_INPUT * element_mm);
                whole_mm / (inputs - ROUNDING).ceil().max(1.0)
            }
            TangentReading::Free => whole_mm,
        };
        let mut input_mm = longest_mm;
        let mut settling = SETTLING;
        loop {
            let now_mm = self.state.report.inserted_mm;
            let way_mm = target_mm - now_mm;
            let last = way_mm.abs() <= input_mm + ZERO_LENGTH_MM;
            let next_mm = if last { target_mm } else { now_mm + input_mm.copysign(way_mm) };
            let left_over = self.input.work_out(surroundings, &self.state, next_mm)?;
            solves += 1;
            let off = left_over > 1.0;
            let half_mm = 0.5 * (next_mm - now_mm).abs();
            if off && tangents == TangentReading::Unit && half_mm >= SHORTEST_INPUT_MM {
                input_mm = half_mm;
                continue;
            }
            lost |= left_over > LOST;
            self.input.read_out(surroundings, &mut self.state);
            inputs += 1;
            if last {
                // The hand holds still until the remaining error is gone.
                if off && tangents == TangentReading::Unit && settling > 0 {
                    settling -= 1;
                    continue;
                }
                return Ok((solves, inputs, !off && !lost));
            }
            input_mm = (2.0 * input_mm).min(longest_mm);
        }
    }
}

impl Method for Li2011 {
    fn step(&mut self, surroundings: &Surroundings<'_>, command: Command) -> Result<()> {
        let target_mm = self.state.report.inserted_mm + command.advance_mm;
        let target_mm = if target_mm < ZERO_LENGTH_MM { 0.0 } else { target_mm };
        let travel_mm = target_mm - self.state.report.inserted_mm;
        if travel_mm > 0.0 {
            let line = self.state.shape.positions_mm.iter().copied();
            check_inside(surroundings.lumen.openings(), line, travel_mm)?;
        }
        let before = self.state.clone();
        match self.carry(surroundings, target_mm) {
            Ok((solves, inputs, converged)) => {
                let ChainState { report, shape, .. } = &mut self.state;
                report.largest_bend_rad = shape.largest_turn_rad();
                report.rotation_rad += command.rotate_rad;
                // Without twist the tip rotates with the hand.
                (report.mouth_rotation_rad, report.tip_rotation_rad) =
                    (report.rotation_rad, report.rotation_rad);
                (report.iterations, report.substeps, report.converged) = (solves, inputs, converged);
                report.write_alone();
                Ok(())
            }
            Err(error) => {
                self.state = before;
                Err(error)
            }
        }
    }

    fn shape(&self) -> &Shape {
        &self.state.shape
    }

    fn report(&self) -> &StepReport {
        &self.state.report
    }

    fn state(&self) -> State {
        State::new(self.input.solver.method(), Content::Chain(Box::new(self.state.clone())))
    }

    fn restore(&mut self, surroundings: &Surroundings<'_>, state: &State) -> Result<()> {
        let name = self.input.solver.method();
        let Content::Chain(state) = state.of(name)? else { return Err(state.of_another(name)) };
        let inserted_mm = state.report.inserted_mm;
        check_inserted(inserted_mm, surroundings.device)?;
        let from_tip_mm = &mut self.input.from_tip_mm;
        nodes_from_tip(inserted_mm, self.input.options.element_mm, from_tip_mm);
        let (shape, nodes) = (&state.shape, from_tip_mm.len());
        let moved = shape.positions_mm.first() != Some(&surroundings.sheath.position_mm)
            || shape.tangents.first() != Some(&surroundings.sheath.direction);
        let planes = [0, nodes - 1].contains(&state.touched.len());
        if shape.from_tip_mm != *from_tip_mm || shape.tangents.len() != nodes || !planes || moved {
            let remedy =
                format!("{nodes} nodes are in this vessel from this sheath: restore a state of this scene");
            return Err(Error::parameter("state.nodes", shape.len(), remedy));
        }
        self.state.clone_from(state);
        Ok(())
    }

    fn drop_workspace(&mut self) {
        self.input.wall.forget();
    }

    fn boxed_clone(&self) -> Box<dyn Method> {
        Box::new(self.clone())
    }
}
