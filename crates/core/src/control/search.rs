//! A hand that tries turns on copies of the simulation before it makes one.
//!
//! It copies the simulation, turns one of the instruments, pushes or pulls for a while and sees how far along the way that leads; of all
//! that it has tried it takes the best, goes up to where that brought the most, and looks again. Pulling is how a bent catheter
//! that lies beyond a branch falls into it. Where nothing leads on it pulls back.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use super::follow::{GOLDEN_RAD, STEP_MM, TURN_RAD};
use super::{Action, Controller, Team};
use crate::insertion::{Command, Move, Simulation};
use crate::vessel::CentrelinePath;
use crate::{Error, Result};

/// How far it looks ahead, mm.
const AHEAD_MM: f64 = 20.0;
/// Turns that are tried of each instrument, evenly around the circle.
const TURNS: usize = 6;
/// Progress on the way that a plan must bring, mm.
const LEAST_GAIN_MM: f64 = 1.0;
/// A millimetre beyond the wall of the way's vessel costs so many of progress.
const ASTRAY_COST: f64 = 2.0;
/// A newton of push costs so many mm of progress, and a radian of turn so many: of equal ways the gentle one.
const PUSH_COST_MM_PER_N: f64 = 2.0;
const TURN_COST_MM_PER_RAD: f64 = 0.2;
/// Pulled back where no turn leads on, mm: once, twice or three times as far, in turns.
const BACK_MM: f64 = 15.0;
/// Pulled back so often without getting farther, it gives up.
const MOST_BACKS: usize = 12;

/// Searches its way along a path by turning and looking ahead.
#[derive(Debug, Clone)]
pub struct SearchAhead {
    path: CentrelinePath,
    team: Team,
    /// Instruments that are turned.
    turned: Vec<usize>,
    arrived_mm: f64,
    plan: VecDeque<Vec<Move>>,
    /// Farthest point on the way so far, mm, and how often it was pulled back since.
    best_mm: f64,
    backs: usize,
    retries: usize,
}

/// Moves that were tried on a copy, and what they bring, mm.
struct Trial {
    plan: VecDeque<Vec<Move>>,
    worth_mm: f64,
}

impl SearchAhead {
    /// Leads a team along a path until the tip is no more than `arrived_mm` before its end; `turned` are the instruments that are turned
    /// on the way, of which the first is also turned while it pulls back.
    pub fn new(path: CentrelinePath, team: Team, turned: Vec<usize>, arrived_mm: f64) -> Self {
        let plan = VecDeque::new();
        Self { path, team, turned, arrived_mm, plan, best_mm: f64::MIN, backs: 0, retries: 0 }
    }

    /// How far along the way the tip is, mm, less for what is beside it.
    fn progress_mm(&self, simulation: &Simulation) -> f64 {
        let on = self.team.on_path(simulation, &self.path);
        on.arc_mm - ASTRAY_COST * (on.distance_mm - on.radius_mm).max(0.0)
    }

    /// Turns an instrument on a copy and pushes on, or pulls, as far as that goes; the better of the two.
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

    /// Goes on in steps of so much, as far as that goes: what cannot be done is the end of the trial, not of the way.
    ///
    /// The plan ends where it has brought the most, so that every plan carried out brings the tip farther and none leads in a circle.
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

    /// Pulls back, with a turn that has not been tried yet.
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
            let mend = format!("there are {count}, the innermost is 0");
            return Err(Error::parameter("turned", absent, mend));
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
            // Both ways around, the small turns first: of equal ones the first is taken.
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
