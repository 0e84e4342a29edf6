//! Instruments that move together: one leads, and others follow over it or in it.

use crate::insertion::{Command, Move, Simulation};
use crate::shape::Shape;
use crate::vessel::{CentrelinePath, OnPath};
use crate::{Error, Result};

/// An instrument whose tip stays behind that of the leading one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follower {
    /// Its index.
    pub instrument: usize,
    /// Distance behind, mm.
    pub behind_mm: f64,
}

/// One instrument that is steered, and its followers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Team {
    /// Index of the leading instrument; 0 for a single device.
    pub lead: usize,
    /// The followers.
    pub followers: Vec<Follower>,
}

impl Team {
    /// Rejects instruments that do not exist or are in the team twice.
    pub(super) fn check(&self, simulation: &Simulation) -> Result<()> {
        let count = simulation.stack().instruments().len();
        let mut members = vec![self.lead];
        members.extend(self.followers.iter().map(|follower| follower.instrument));
        for (index, member) in members.iter().enumerate() {
            if *member >= count || members[..index].contains(member) {
                let remedy = format!("there are {count}, the innermost is 0, and each is in a team once");
                return Err(Error::parameter("team, instrument", member, remedy));
            }
        }
        Ok(())
    }

    /// Inserted length of the leading instrument, mm.
    pub(super) fn inserted_mm(&self, simulation: &Simulation) -> f64 {
        simulation.report().lengths_mm()[self.lead]
    }

    /// The line up to the tip of the leading instrument.
    pub(super) fn shape(&self, simulation: &Simulation) -> Shape {
        simulation.shape().behind(simulation.report().inserted_mm - self.inserted_mm(simulation))
    }

    /// Position of the leading instrument's tip on a path.
    pub(super) fn on_path(&self, simulation: &Simulation, path: &CentrelinePath) -> OnPath {
        path.nearest(&self.shape(simulation).tip_mm().unwrap_or_default())
    }

    /// Position of the leading instrument's tip on a path, and within the path's vessel.
    pub(super) fn on_and_in(&self, simulation: &Simulation, path: &CentrelinePath) -> (OnPath, OnPath) {
        let tip = self.shape(simulation).tip_mm().unwrap_or_default();
        (path.nearest(&tip), path.deepest(&tip))
    }

    /// Whether the tip of the leading instrument is in the vessel and no more than `arrived_mm` before the end of a
    /// path.
    pub(super) fn has_arrived(
        &self,
        simulation: &Simulation,
        path: &CentrelinePath,
        arrived_mm: f64,
    ) -> bool {
        let on = self.on_path(simulation, path);
        on.arc_mm > path.length_mm() - arrived_mm && on.distance_mm < on.radius_mm
    }

    /// Length of the tip of the leading instrument, up to the end of its last bend, mm; 0 if straight.
    pub(super) fn bent_mm(&self, simulation: &Simulation) -> f64 {
        let (mut end_mm, mut bent_mm) = (0.0, 0.0);
        for section in simulation.stack().instruments()[self.lead].device.sections() {
            end_mm += section.length_mm;
            if section.rest_curvature_per_mm != [0.0; 2] {
                bent_mm = end_mm;
            }
        }
        bent_mm
    }

    /// The moves in which the leading instrument follows `command`, and the others move to their positions behind it:
    /// forwards by at most as much, and backwards by at most twice as much.
    pub(super) fn moves(&self, simulation: &Simulation, command: Command) -> Vec<Move> {
        let lengths_mm = simulation.report().lengths_mm();
        let lead_mm = lengths_mm[self.lead] + command.advance_mm;
        let mut moves = vec![Move { instrument: self.lead, command }];
        for follower in &self.followers {
            let to_go = (lead_mm - follower.behind_mm).max(0.0) - lengths_mm[follower.instrument];
            let advance_mm = match command.advance_mm {
                forwards if forwards > 0.0 => to_go.clamp(-forwards, forwards),
                back if back < 0.0 => to_go.clamp(2.0 * back, 0.0),
                _ => 0.0,
            };
            if advance_mm != 0.0 {
                moves.push(Move { instrument: follower.instrument, command: Command::advance(advance_mm) });
            }
        }
        moves
    }
}
