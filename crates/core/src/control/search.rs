//! A controller that tries rotations on copies of the simulation before it makes one.
//!
//! It copies the simulation, rotates one of the instruments, pushes or pulls for a while and measures the progress
//! along the path; it carries out the best trial, up to its point of largest progress, and repeats. Pulling lets a
//! bent catheter beyond a branch fall into it. If no trial makes progress, it pulls back.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use super::follow::{GOLDEN_RAD, STEP_MM, TURN_RAD};
use super::{Action, Controller, Team};
use crate::insertion::{Command, Move, Simulation};
use crate::vessel::CentrelinePath;
use crate::{Error, Result};

/// Length of a trial, mm.
const AHEAD_MM: f64 = 20.0;
/// Number of rotations tried per instrument, evenly around the circle.
const TURNS: usize = 6;
/// Smallest progress of a plan along the path, mm.
const LEAST_GAIN_MM: f64 = 1.0;
/// Cost of a millimetre beyond the wall of the path's vessel, mm of progress.
const ASTRAY_COST: f64 = 2.0;
/// Cost of a newton of push force, and of a radian of rotation, mm of progress: among equal trials the gentlest wins.
const PUSH_COST_MM_PER_N: f64 = 2.0;
const TURN_COST_MM_PER_RAD: f64 = 0.2;
/// Length pulled back if no rotation helps, mm; multiplied by one, two or three in turn.
const BACK_MM: f64 = 15.0;
/// Number of times it pulls back without progress before it gives up.
const MOST_BACKS: usize = 12;

/// Searches its way along a path by trial rotations.
#[derive(Debug, Clone)]
pub struct SearchAhead {
    path: CentrelinePath,
    team: Team,
    /// Instruments that are rotated.
    turned: Vec<usize>,
    arrived_mm: f64,
    plan: VecDeque<Vec<Move>>,
    /// Farthest point on the path so far, mm, and the number of pulls since.
    best_mm: f64,
    backs: usize,
    retries: usize,
}

/// Moves tried on a copy, and their progress, mm.
struct Trial {
    plan: VecDeque<Vec<Move>>,
    worth_mm: f64,
}

impl SearchAhead {
    /// Leads a team along a path until the tip is no more than `arrived_mm` before its end; `turned` are the
    /// instruments that are rotated, of which the first is also rotated while it pulls back.
    pub fn new(path: CentrelinePath, team: Team, turned: Vec<usize>, arrived_mm: f64) -> Self {
        let plan = VecDeque::new();
        Self { path, team, turned, arrived_mm, plan, best_mm: f64::MIN, backs: 0, retries: 0 }
    }

    /// Progress of the tip along the path, mm, reduced by its distance from the path's vessel.
    fn progress_mm(&self, simulation: &Simulation) -> f64 {
        let on = self.team.on_path(simulation, &self.path);
        on.arc_mm - ASTRAY_COST * (on.distance_mm - on.radius_mm).max(0.0)
    }

    /// Rotates an instrument on a copy and pushes, or pulls, as far as possible; returns the better of the two.
    fn try_turn(&self, simulation: &Simulation, instrument: usize, turn_rad: f64) -> Option<Trial> {
        let mut turned = simulation.clone();
        let mut plan = VecDeque::new();
        let parts = (turn_rad.abs() / TURN_RAD).ceil();
        let turn = vec![Move { instrument, command: Command::rotate(turn_rad / parts) }];
        for _ in 0..parts as usize {
            turned.step_together(&turn).ok()?;
            plan.push_back(turn.clone());
        }
        let cost_mm = TURN_COST_MM_PER_RAD * turn_rad.abs();
        let [push, pull] = [STEP_MM, -STEP_MM].map(|step_mm| {
            let plan = plan.clone();
            let trial = self.try_length(turned.clone(), step_mm, plan);
            Trial { worth_mm: trial.worth_mm - cost_mm, ..trial }
        });
        Some(if pull.worth_mm > push.worth_mm { pull } else { push })
    }

    /// Continues in steps of this length, as far as possible: an impossible step ends the trial, not the run.
    ///
    /// The plan ends at its largest progress, so every plan carried out brings the tip farther and none repeats for
    /// ever.
    fn try_length(&self, mut copy: Simulation, step_mm: f64, mut plan: VecDeque<Vec<Move>>) -> Trial {
        let (mut worth_mm, mut worthy) = (f64::MIN, 0);
        for _ in 0..(AHEAD_MM / STEP_MM) as usize {
            let moves = self.team.moves(&copy, Command::advance(step_mm));
            if copy.step_together(&moves).is_err() {
                break;
            }
            plan.push_back(moves);
            let worth = self.progress_mm(&copy) - PUSH_COST_MM_PER_N * copy.report().push_force_n.abs();
            if worth > worth_mm {
                (worth_mm, worthy) = (worth, plan.len());
            }
            if self.team.has_arrived(&copy, &self.path, self.arrived_mm) {
                break;
            }
        }
        plan.truncate(worthy);
        Trial { plan, worth_mm }
    }

    /// Pulls back, with a rotation that has not been tried yet.
    fn back(&mut self, simulation: &Simulation) -> VecDeque<Vec<Move>> {
        let mut copy = simulation.clone();
        let parts = (BACK_MM * (1 + self.backs % 3) as f64 / STEP_MM).round();
        let rotate_rad = GOLDEN_RAD / parts;
        (self.backs, self.retries) = (self.backs + 1, self.retries + 1);
        let mut plan = VecDeque::new();
        for _ in 0..parts as usize {
            let back_mm = STEP_MM.min(self.team.inserted_mm(&copy));
            let mut moves = self.team.moves(&copy, Command::retract(back_mm));
            match moves.iter_mut().find(|one| Some(&one.instrument) == self.turned.first()) {
                Some(one) => one.command.rotate_rad += rotate_rad,
                None => moves.extend(
                    self.turned
                        .first()
                        .map(|i| Move { instrument: *i, command: Command::rotate(rotate_rad) }),
                ),
            }
            if copy.step_together(&moves).is_err() {
                break;
            }
            plan.push_back(moves);
        }
        plan
    }
}

impl Controller for SearchAhead {
    fn next(&mut self, simulation: &Simulation) -> Result<Action> {
        self.team.check(simulation)?;
        let count = simulation.stack().instruments().len();
        if let Some(absent) = self.turned.iter().find(|instrument| **instrument >= count) {
            let remedy = format!("there are {count}, the innermost is 0");
            return Err(Error::parameter("turned", absent, remedy));
        }
        if self.team.has_arrived(simulation, &self.path, self.arrived_mm) {
            return Ok(Action::Arrived);
        }
        if let Some(moves) = self.plan.pop_front() {
            return Ok(Action::Move(moves));
        }
        let here_mm = self.progress_mm(simulation);
        if here_mm > self.best_mm + LEAST_GAIN_MM {
            (self.best_mm, self.backs) = (here_mm, 0);
        }
        let turns = |instrument: &usize| {
            let instrument = *instrument;
            // Both directions, small rotations first: among equals the first wins.
            (1..TURNS).map(move |k| {
                let part = if k % 2 == 1 { k.div_ceil(2) as f64 } else { -(k as f64) / 2.0 };
                (instrument, TAU * part / TURNS as f64)
            })
        };
        let mut best: Option<Trial> = None;
        let straight_on = std::iter::once((self.team.lead, 0.0));
        for (instrument, turn_rad) in straight_on.chain(self.turned.iter().flat_map(turns)) {
            let Some(trial) = self.try_turn(simulation, instrument, turn_rad) else { continue };
            if best.as_ref().is_none_or(|best| trial.worth_mm > best.worth_mm) {
                best = Some(trial);
            }
        }
        self.plan = match best {
            Some(best) if best.worth_mm > here_mm + LEAST_GAIN_MM => best.plan,
            _ if self.backs < MOST_BACKS => self.back(simulation),
            _ => return Ok(Action::GivenUp),
        };
        Ok(self.plan.pop_front().map_or(Action::GivenUp, Action::Move))
    }

    fn retries(&self) -> usize {
        self.retries
    }
}
