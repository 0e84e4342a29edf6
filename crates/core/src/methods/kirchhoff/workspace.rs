//! What a step works with. None of it reaches the next step: it can be dropped and made anew at any moment.

use super::configuration::{Configuration, largest};
use super::guess::Guess;
use super::hands::{Hand, Way};
use super::joined::Joined;
use super::mesh::Mesh;
use super::state::KirchhoffState;
use super::{Environment, meshed};
use crate::contact::{ContactCache, Counters, Drag, Friction, SelfContact, Touch};
use crate::methods::StepReport;
use crate::solve::Newton;

/// The workspace of a simulation.
pub(super) struct Workspace<const C: usize> {
    pub(super) tools: Tools<C>,
    /// Mesh of the state that commands start from.
    pub(super) mesh: Mesh,
    /// Where the command under way has come to, once its first sub-step is taken.
    pub(super) now: Configuration,
    /// The sub-step under way.
    pub(super) next: Configuration,
    /// Most elements and contact points.
    pub(super) most: (usize, usize),
    /// Where the hands go in the command under way.
    pub(super) way: Way,
    /// Where they are in the sub-step under way.
    pub(super) hands: Vec<Hand>,
}

/// What a sub-step works with.
pub(super) struct Tools<const C: usize> {
    pub(super) newton: Newton<C>,
    pub(super) guess: Guess,
    pub(super) friction: Friction,
    pub(super) cache: ContactCache,
    /// What the flow does along the device.
    pub(super) drag: Drag,
    /// What its loops do to each other; nothing is known of them where they do not touch.
    pub(super) loops: SelfContact,
    /// Coils that were detached, which are solved for together with the line.
    pub(super) joined: Joined,
    /// Points that press in the equilibrium found last, and what happens there.
    pub(super) touches: Vec<(usize, Touch)>,
    /// What the sub-steps of the command took.
    pub(super) work: Work,
    /// Questions about the wall.
    pub(super) counters: Counters,
}

/// What sub-steps take, those in vain included.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Work {
    /// Newton iterations, …
    pub(super) iterations: usize,
    /// … and linear solves.
    pub(super) solves: usize,
    /// Nodes of the sub-steps in which the device moved.
    pub(super) nodes_solved: u64,
}

impl Work {
    /// Adds the iterations and linear solves of a sub-step of so many elements.
    pub(super) fn add(&mut self, (iterations, solves): (usize, usize), elements: usize) {
        self.iterations += iterations;
        self.solves += solves;
        self.nodes_solved += if iterations > 0 { elements as u64 + 1 } else { 0 };
    }

    /// Newton iterations since then; what is given up before its first one has its price as well.
    pub(super) fn since(&self, before: &Self) -> usize {
        (self.iterations - before.iterations).max(1)
    }

    /// Tells what it took beside the nodes that were solved for before.
    pub(super) fn write(&self, report: &mut StepReport, nodes_solved: u64) {
        (report.iterations, report.solves) = (self.iterations as u32, self.solves as u32);
        report.nodes_solved = nodes_solved + self.nodes_solved;
    }
}

impl<const C: usize> Workspace<C> {
    /// Memory for the whole device, so that steps take none.
    pub(super) fn new(environment: &Environment<'_>, state: &KirchhoffState) -> Box<Self> {
        let surroundings = environment.surroundings;
        let (elements, points) = largest(surroundings.stack, environment.options.fineness());
        let nothing = Configuration::at(&surroundings);
        let mut tools = Tools {
            newton: Newton::new(1),
            guess: Guess::default(),
            friction: Friction::new(surroundings.properties.largest_friction()),
            cache: ContactCache::new(environment.surface),
            drag: Drag::default(),
            loops: SelfContact::default(),
            joined: Joined::default(),
            touches: Vec::new(),
            work: Work::default(),
            counters: Counters::default(),
        };
        tools.newton.reserve(elements);
        tools.guess.reserve(elements);
        tools.friction.reserve(points);
        tools.cache.reserve(points);
        tools.touches.reserve(points);
        let mut mesh = Mesh::default();
        let mut hands = Vec::new();
        super::hands::read(state.report(), &mut hands);
        meshed(environment, &hands, &mut mesh);
        Box::new(Self {
            tools,
            mesh,
            now: nothing.clone(),
            next: nothing,
            most: (elements, points),
            way: Way::default(),
            hands,
        })
    }
}
