//! The memory of a step. Nothing in it affects the next step: it can be dropped and rebuilt at any time.

use super::configuration::{Configuration, largest};
use super::guess::Guess;
use super::hands::{Hand, Way};
use super::joined::Joined;
use super::mesh::Mesh;
use super::state::KirchhoffState;
use super::tail::Tails;
use super::{Environment, meshed};
use crate::contact::{ContactCache, Counters, Drag, Friction, SelfContact};
use crate::methods::StepReport;
use crate::solve::Newton;

/// The workspace of a simulation.
pub(super) struct Workspace<const C: usize> {
    pub(super) tools: Tools<C>,
    /// Mesh of the state at the start of commands.
    pub(super) mesh: Mesh,
    /// Configuration within the current command, after its first sub-step.
    pub(super) now: Configuration,
    /// Configuration of the current sub-step.
    pub(super) next: Configuration,
    /// Largest numbers of elements and contact points.
    pub(super) most: (usize, usize),
    /// Motion of the hands in the current command.
    pub(super) way: Way,
    /// Their positions in the current sub-step.
    pub(super) hands: Vec<Hand>,
}

/// The tools of a sub-step.
pub(super) struct Tools<const C: usize> {
    pub(super) newton: Newton<C>,
    pub(super) guess: Guess,
    pub(super) friction: Friction,
    pub(super) cache: ContactCache,
    pub(super) tails: Tails,
    /// Energy dissipated outside the body by turning, in the sub-step, at least and at most, mJ.
    pub(super) around_mj: [f64; 2],
    /// Drag of the flow on the device.
    pub(super) drag: Drag,
    /// Self-contact; empty if loops do not touch.
    pub(super) loops: SelfContact,
    /// Detached coils, solved together with the line.
    pub(super) joined: Joined,
    /// Work of the command's sub-steps.
    pub(super) work: Work,
    /// Wall queries.
    pub(super) counters: Counters,
}

/// Work of sub-steps, including failed ones.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Work {
    /// Newton iterations.
    pub(super) iterations: usize,
    /// Linear solves.
    pub(super) solves: usize,
    /// Nodes of the sub-steps in which the device moved.
    pub(super) nodes_solved: u64,
}

impl Work {
    /// Adds the iterations and linear solves of a sub-step with this number of elements.
    pub(super) fn add(&mut self, (iterations, solves): (usize, usize), elements: usize) {
        self.iterations += iterations;
        self.solves += solves;
        self.nodes_solved += if iterations > 0 { elements as u64 + 1 } else { 0 };
    }

    /// Newton iterations since then; an attempt that fails before its first one costs something as well.
    pub(super) fn since(&self, before: &Self) -> usize {
        (self.iterations - before.iterations).max(1)
    }

    /// Writes the work into the report of the step before; nodes are added to those solved until then.
    pub(super) fn write(&self, report: &mut StepReport) {
        (report.iterations, report.solves) = (self.iterations as u32, self.solves as u32);
        report.nodes_solved = report.nodes_solved.saturating_add(self.nodes_solved);
    }
}

impl<const C: usize> Workspace<C> {
    /// Allocates for the whole device, so that steps do not allocate.
    pub(super) fn new(environment: &Environment<'_>, state: &KirchhoffState) -> Box<Self> {
        let surroundings = environment.surroundings;
        let (elements, points) = largest(surroundings.stack, environment.options.fineness());
        let nothing = Configuration::at(&surroundings, state.has_angles);
        let tuning = &environment.options.tuning;
        let mut tools = Tools {
            newton: Newton::new(1),
            guess: Guess::default(),
            friction: Friction::tuned(surroundings.properties.largest_friction(), &tuning.friction),
            cache: ContactCache::new(environment.surface),
            tails: Tails::default(),
            around_mj: [0.0; 2],
            drag: Drag::default(),
            loops: SelfContact::tuned(tuning),
            joined: Joined::default(),
            work: Work::default(),
            counters: Counters::default(),
        };
        tools.newton.reserve(elements);
        tools.guess.reserve(elements);
        tools.friction.reserve(points);
        tools.cache.reserve(points);
        let mut mesh = Mesh::default();
        meshed(environment, &state.hands, &mut mesh);
        Box::new(Self {
            tools,
            mesh,
            now: nothing.clone(),
            next: nothing,
            most: (elements, points),
            way: Way::default(),
            hands: state.hands.clone(),
        })
    }
}
