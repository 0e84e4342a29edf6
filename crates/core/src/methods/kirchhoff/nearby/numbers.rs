//! What is read after a part, and where forces and readings are taken beside it.

use super::super::configuration::{Configuration, Start};
use super::super::hands::{Hand, HandForce};
use super::super::readout::{across_n, alone_push_n};
use super::super::tail::{TWIST, Twist};
use super::super::workspace::Tools;
use super::forces::{entering, rows};
use super::recorded::Piece;
use super::{End, Scene};
use crate::methods::kirchhoff::Environment;
use crate::rod::Clamp;

/// How push forces are read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Push {
    #[default]
    Unread,
    /// By each unknown.
    Rows,
    /// Those of several instruments, which depend on all of the line, along each direction; of one by each unknown.
    Along,
}

/// What is read, beside places: what costs more.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Wanted {
    pub(super) push: Push,
    pub(super) energy: bool,
    /// Motions of the hands.
    pub(super) hands: bool,
}

/// Where the numbers are that are read after a part: the memory of tails, and in the last part of a command places, forces and energy.
#[derive(Debug, Clone, Default)]
pub(super) struct Numbers {
    pub(super) instruments: usize,
    pub(super) nodes: usize,
    /// Contact points that touch.
    pub(super) touches: Vec<usize>,
}

impl Numbers {
    pub(super) fn memory(&self) -> usize {
        TWIST * self.instruments + 1
    }

    pub(super) fn place(&self, node: usize) -> usize {
        self.memory() + 3 * node
    }

    pub(super) fn push(&self, instrument: usize) -> usize {
        self.place(self.nodes) + instrument
    }

    pub(super) fn torque(&self, instrument: usize) -> usize {
        self.push(self.instruments) + instrument
    }

    pub(super) fn energy(&self) -> usize {
        self.torque(self.instruments)
    }

    pub(super) fn contact(&self, k: usize) -> usize {
        self.energy() + 1 + k
    }

    pub(super) fn len(&self) -> usize {
        self.contact(self.touches.len())
    }
}

/// A part beside which forces are taken.
pub(super) struct Around<'a> {
    pub(super) environment: Environment<'a>,
    pub(super) piece: &'a Piece,
    pub(super) end: End<'a>,
    /// Whether forces at the mouth are read.
    pub(super) reads: bool,
    pub(super) touches: Vec<usize>,
}

/// Forces and numbers beside a part.
pub(super) struct Found {
    pub(super) rows: Vec<f64>,
    pub(super) numbers: Vec<f64>,
    pub(super) along: Option<Vec<f64>>,
    pub(super) same_contacts: bool,
}

impl Around<'_> {
    /// Forces and numbers at the end of the part in another scene, from another start to other hands; none where the mesh is another one.
    pub(super) fn found<const C: usize>(
        &self,
        tools: &mut Tools<C>,
        scene: &Scene,
        (start, hands): (Start<'_>, &[Hand]),
        next: &mut Configuration,
    ) -> Option<Found> {
        self.piece.with(&self.environment, scene, (start, hands), |acting, own| {
            let found = tools.beside(acting, &self.end, next, |search, lagged, _| {
                search.assemble(lagged, false);
                rows(search)
            });
            let along = entering::<C>(acting.environment.surroundings.sheath, &self.end.state.rod);
            found.map(|(rows, _)| {
                let numbers = self.numbers(tools, &own, next);
                let touches = next.state.touches.iter().map(|(point, _)| *point);
                Found { rows, numbers, along, same_contacts: touches.eq(self.touches.iter().copied()) }
            })
        })
    }

    /// The numbers that are read after the last assembly.
    pub(super) fn numbers<const C: usize>(
        &self,
        tools: &mut Tools<C>,
        own: &Environment<'_>,
        next: &mut Configuration,
    ) -> Vec<f64> {
        if self.reads {
            tools.write_forces(own, next);
        }
        let state = &*next.state;
        let mut all = Vec::new();
        all.extend(twists(tools, next));
        all.push(if self.reads { state.across_n } else { 0.0 });
        if !self.piece.is_last {
            return all;
        }
        all.extend(state.rod.positions.iter().flat_map(|place| place.iter().copied()));
        // What a residual adds to the push force does not change along equilibria.
        let single = state.hand_forces.len() == 1;
        let unbalanced_n = if single { tools.newton.unbalanced_along_n(&state.rod) } else { 0.0 };
        all.extend(state.hand_forces.iter().map(|force| force.push_n + force.outside_n - unbalanced_n));
        all.extend(state.hand_forces.iter().map(|force| force.torque_nmm));
        all.push(state.energy.total());
        let touching = |index: &usize| {
            let found = state.touches.binary_search_by_key(index, |(point, _)| *point);
            found.map_or(0.0, |k| state.touches[k].1.contact.force_n)
        };
        all.extend(self.touches.iter().map(touching));
        all
    }
}

/// The numbers of the twists of tails.
fn twists<'a, const C: usize>(tools: &'a Tools<C>, at: &'a Configuration) -> impl Iterator<Item = f64> + 'a {
    let rod = &at.state.rod;
    tools.tails.each().iter().flat_map(move |tail| {
        let twist = match tail.is_in {
            true => tail.twist(rod, &tail.on(rod)),
            false => Twist::relaxed(tail.hand_rad),
        };
        twist.numbers()
    })
}

/// The part of the numbers that tails make, all else being as it is.
pub(super) fn tail_numbers<const C: usize>(
    tools: &Tools<C>,
    own: &Environment<'_>,
    numbers: &Numbers,
    at: &Configuration,
) -> Vec<f64> {
    let mut all: Vec<f64> = twists(tools, at).collect();
    all.resize(numbers.len(), 0.0);
    if numbers.nodes == 0 {
        return all;
    }
    let mut forces = vec![HandForce::default(); numbers.instruments];
    let on = (own.surroundings.sheath, at.state.across_n);
    let (stored_mj, _) = tools.tails.write(on, &at.state.rod, &mut Vec::new(), &mut forces);
    for (k, force) in forces.iter().enumerate() {
        (all[numbers.push(k)], all[numbers.torque(k)]) = (force.push_n + force.outside_n, force.torque_nmm);
    }
    all[numbers.energy()] = stored_mj;
    if numbers.instruments == 1 {
        all[numbers.push(0)] = mouth_of_one(tools, own, at)[1];
    }
    all
}

/// The force across at the mouth, and the push force of a single device, with the forces there that were assembled last.
pub(super) fn mouth_of_one<const C: usize>(
    tools: &Tools<C>,
    own: &Environment<'_>,
    at: &Configuration,
) -> [f64; 2] {
    let (rod, sheath) = (&at.state.rod, own.surroundings.sheath);
    let clamp = Clamp::new::<C>(&tools.newton.start_residual, rod);
    let clamp = Clamp { torque: tools.tails.body_nmm(rod), ..clamp };
    let across_n = across_n(sheath, &clamp);
    let mut forces = [HandForce::default()];
    tools.tails.write((sheath, across_n), rod, &mut Vec::new(), &mut forces);
    [across_n, alone_push_n(own, at.start(), &clamp) + forces[0].push_n + forces[0].outside_n]
}
