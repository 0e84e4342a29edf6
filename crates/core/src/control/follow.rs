//! A controller that follows the centre line with a shaped wire.
//!
//! It rotates the tail until the tip points along the path, and pushes. If the tip has left the path or does not
//! advance, it pulls back, and until it is past that place points away from the path, each time in another direction.
//! A tip that finds the path while it is pulled back is pushed on from there.

use std::f64::consts::{PI, TAU};

use super::{Action, Controller, Team};
use crate::insertion::{Command, Move, Simulation};
use crate::vessel::CentrelinePath;
use crate::{Result, Vec3};

/// Advance per command, mm.
pub(super) const STEP_MM: f64 = 2.0;
/// Distance along the path of the point at which the hand aims, in radii of the vessel.
const AHEAD_RADII: f64 = 1.5;
const LEAST_AHEAD_MM: f64 = 15.0;
/// Largest rotation per command, rad.
pub(super) const TURN_RAD: f64 = 0.35;
/// Largest number of rotations between two pushes.
const TURNS: usize = 12;
/// Length pulled back after leaving the path, mm.
const BACK_MM: f64 = 30.0;
/// Distance beyond the vessel's wall at which the tip counts as astray, as a fraction of its bent length: as far as a
/// bend dips into the mouth of a branch while the wire behind it continues past.
const ASTRAY: f64 = 0.5;
/// Its smallest value, mm: the axis is a polyline, outside of whose corners the wall bulges.
const LEAST_ASTRAY_MM: f64 = 3.0;
/// Smallest progress along the path, mm.
const FARTHER_MM: f64 = 1.0;
/// Distance beyond the end of the last attempt at which the hand points along the path again, mm.
const PAST_MM: f64 = 10.0;
/// Length pushed without progress, mm, before the hand tries something else.
const PATIENCE_MM: f64 = 24.0;
/// Golden angle: successive rotations by it fill the circle evenly.
pub(super) const GOLDEN_RAD: f64 = PI * (3.0 - 2.236_067_977_499_79);

/// Follows a path with the bent tip of the leading instrument.
#[derive(Debug, Clone)]
pub struct FollowPath {
    path: CentrelinePath,
    team: Team,
    arrived_mm: f64,
    /// Farthest point on the path so far, mm, and the insertion then.
    best_mm: f64,
    best_inserted_mm: f64,
    /// Length still to be pulled back, mm.
    back_mm: f64,
    retries: usize,
    /// Farthest position within the path's vessel since the last pull, mm, and that of the attempt before.
    within_mm: f64,
    failed_mm: f64,
    /// Angle between the path ahead and the target direction of the tip, rad.
    offset_rad: f64,
    /// Rotations since the last push.
    turns: usize,
    /// Initial position on the path of the tip of the whole line, mm: that of a wire over which the lead follows.
    held_mm: Option<f64>,
}

impl FollowPath {
    /// Leads a team along a path until the tip is no more than `arrived_mm` before its end.
    pub fn new(path: CentrelinePath, team: Team, arrived_mm: f64) -> Self {
        Self {
            path,
            team,
            arrived_mm,
            best_mm: 0.0,
            best_inserted_mm: 0.0,
            back_mm: 0.0,
            retries: 0,
            within_mm: 0.0,
            failed_mm: 0.0,
            offset_rad: 0.0,
            turns: 0,
            held_mm: None,
        }
    }

    /// The wire over which the lead follows is held in place: straightening by the lead would push it on, so it is
    /// drawn back by as much.
    fn hold(&mut self, simulation: &Simulation, moves: &mut Vec<Move>) {
        let lengths_mm = simulation.report().lengths_mm();
        let Some(farthest) = (0..lengths_mm.len()).max_by(|a, b| lengths_mm[*a].total_cmp(&lengths_mm[*b]))
        else {
            return;
        };
        if lengths_mm[farthest] <= lengths_mm[self.team.lead]
            || moves.iter().any(|m| m.instrument == farthest)
        {
            return;
        }
        let on = self.path.nearest(&simulation.shape().tip_mm().unwrap_or_default());
        // Beyond the end of the path arc lengths end, and the distance is added.
        let tip_mm = on.arc_mm + (on.distance_mm - on.radius_mm).max(0.0);
        let beyond_mm = tip_mm - *self.held_mm.get_or_insert(tip_mm);
        if beyond_mm > 0.0 {
            moves.push(Move { instrument: farthest, command: Command::retract(beyond_mm.min(STEP_MM)) });
        }
    }

    fn command(&mut self, simulation: &Simulation, tip_mm: f64) -> Command {
        let inserted = self.team.inserted_mm(simulation);
        let (on, within) = self.team.on_and_in(simulation, &self.path);
        let is_within = within.distance_mm < within.radius_mm;
        if self.back_mm > 0.0 {
            if is_within && within.arc_mm > self.failed_mm + FARTHER_MM {
                self.back_mm = 0.0;
                (self.best_mm, self.best_inserted_mm) = (on.arc_mm, inserted);
            } else {
                self.back_mm -= STEP_MM;
                if self.back_mm <= 0.0 {
                    (self.best_mm, self.best_inserted_mm) = (0.0, inserted - STEP_MM);
                }
                return Command {
                    advance_mm: -STEP_MM,
                    rotate_rad: GOLDEN_RAD * STEP_MM / BACK_MM,
                    ..Command::default()
                };
            }
        }
        if on.arc_mm > self.best_mm + FARTHER_MM {
            (self.best_mm, self.best_inserted_mm) = (on.arc_mm, inserted);
        }
        if is_within {
            self.within_mm = self.within_mm.max(within.arc_mm);
            if within.arc_mm > self.failed_mm + PAST_MM {
                self.offset_rad = 0.0;
            }
        }
        let astray_mm = (ASTRAY * tip_mm).max(LEAST_ASTRAY_MM);
        let astray = within.distance_mm > within.radius_mm + astray_mm;
        let stuck = inserted - self.best_inserted_mm > PATIENCE_MM;
        if (astray || stuck) && inserted > BACK_MM + tip_mm {
            self.retries += 1;
            self.back_mm = BACK_MM;
            self.failed_mm = std::mem::take(&mut self.within_mm);
            self.offset_rad = (self.offset_rad + GOLDEN_RAD) % TAU;
            return Command::rotate(0.0);
        }
        // The two differ at the mouths of branches. Which of them leads on is not known in advance: attempts
        // alternate between them.
        let from = if self.retries.is_multiple_of(2) { on } else { within };
        let turn = self.aim(simulation, from.arc_mm, from.radius_mm, tip_mm);
        // If far from the target direction, the hand rotates before it pushes on.
        if turn.abs() > 0.5 * TURN_RAD && self.turns < TURNS {
            self.turns += 1;
            return Command::rotate(turn);
        }
        self.turns = 0;
        Command { advance_mm: STEP_MM, rotate_rad: turn, ..Command::default() }
    }

    /// Rotation of the tail that turns the bend of the tip towards the path ahead, or away from it.
    fn aim(&self, simulation: &Simulation, reached_mm: f64, radius_mm: f64, tip_mm: f64) -> f64 {
        if tip_mm == 0.0 || self.team.inserted_mm(simulation) < tip_mm + 2.0 * STEP_MM {
            return 0.0;
        }
        let shape = self.team.shape(simulation);
        let tip = shape.tip_mm().unwrap_or_default();
        // The line from which the tip bends away.
        let at = |from_tip_mm: f64| shape.position_at(from_tip_mm).unwrap_or_default();
        let root = at(tip_mm);
        let axis = (root - at(tip_mm + 2.0)).normalize();
        let across = |v: Vec3| v - axis * axis.dot(&v);
        let ahead = (AHEAD_RADII * radius_mm).max(LEAST_AHEAD_MM);
        let (bend, wish) = (across(tip - root), across(self.path.at(reached_mm + ahead) - root));
        // A straight path needs no rotation.
        if wish.norm() < 0.15 * (ahead + tip_mm) || bend.norm() < 1e-3 {
            return 0.0;
        }
        let angle = libm::atan2(axis.dot(&bend.cross(&wish)), bend.dot(&wish)) + self.offset_rad;
        let nearest_way = (angle + PI).rem_euclid(TAU) - PI;
        nearest_way.clamp(-TURN_RAD, TURN_RAD)
    }
}

impl Controller for FollowPath {
    fn next(&mut self, simulation: &Simulation) -> Result<Action> {
        self.team.check(simulation)?;
        if self.team.has_arrived(simulation, &self.path, self.arrived_mm) {
            return Ok(Action::Arrived);
        }
        let command = self.command(simulation, self.team.bent_mm(simulation));
        let room_mm = simulation.stack().instruments()[self.team.lead].device.length_mm();
        if self.team.inserted_mm(simulation) + command.advance_mm > room_mm {
            return Ok(Action::GivenUp);
        }
        let mut moves = self.team.moves(simulation, command);
        self.hold(simulation, &mut moves);
        Ok(Action::Move(moves))
    }

    fn retries(&self) -> usize {
        self.retries
    }
}
