//! Whether a step that is recorded is the next one.

use endowire_core::insertion::{Command, InstrumentReport, Move, Simulation};
use endowire_core::{Error, Result};

/// Hands add up but for rounding, which is far below this, mm and rad.
const ROUNDING: f64 = 1e-6;

/// Checks what is given for a step: the time at its end, s, which comes not before that of the step before, and its moves.
///
/// # Errors
/// [`Error::Parameter`] for a time that is earlier, and numbers that are not finite.
pub fn check_step(moves: &[Move], time_s: f64, last_s: f64) -> Result<()> {
    for Move { command: Command { advance_mm, rotate_rad, steer }, .. } in moves {
        for (name, number) in [("advance_mm", *advance_mm), ("rotate_rad", *rotate_rad), ("steer", *steer)] {
            if !number.is_finite() {
                return Err(Error::parameter(name, number, "must be a finite number"));
            }
        }
    }
    if time_s >= last_s && time_s.is_finite() {
        return Ok(());
    }
    let remedy = format!("must be a time from that of the last step, {last_s} s, on");
    Err(Error::parameter("time_s", time_s, remedy))
}

/// Where a simulation is, for the step that follows.
#[derive(Debug)]
pub(crate) struct Reached {
    scene: u64,
    hands: Vec<InstrumentReport>,
    behind: Vec<Command>,
    coils: usize,
}

impl Reached {
    pub(crate) fn of(simulation: &Simulation) -> Self {
        let report = simulation.report();
        let (scene, coils) = (simulation.scene_number(), simulation.coils().len());
        Self { scene, hands: report.hands(), behind: report.behind.clone(), coils }
    }

    /// What is wrong with a simulation that these moves should have led to from here, in words.
    pub(crate) fn not_next(&self, moves: &[Move], simulation: &Simulation) -> Option<String> {
        let now = Self::of(simulation);
        if now.scene != self.scene {
            return Some("the simulation has another vessel, wall, sheath or other instruments".to_owned());
        }
        // Detaching a coil withdraws its pusher.
        let detached: Vec<usize> = simulation
            .coils()
            .get(self.coils..)
            .unwrap_or_default()
            .iter()
            .map(|coil| coil.instrument)
            .collect();
        // What was behind may have been dropped before the step (`forget`).
        let wrong = [true, false].map(|is_behind| {
            let hands = (0..self.hands.len()).filter(|hand| !detached.contains(hand));
            hands.into_iter().find_map(|hand| self.wrong_hand(hand, is_behind, moves, &now))
        });
        let [Some((hand, [due_mm, due_rad, _], [is_mm, is_rad, _])), Some(_)] = wrong else { return None };
        Some(format!(
            "the moves lead instrument {hand} to {due_mm} mm and {due_rad} rad, and it is at {is_mm} mm and {is_rad} rad"
        ))
    }

    /// A hand that is not where these moves lead it: its number, where it should be, and where it is: length, mm, rotation,
    /// rad, and steering.
    fn wrong_hand(
        &self,
        hand: usize,
        is_behind: bool,
        moves: &[Move],
        now: &Self,
    ) -> Option<(usize, [f64; 3], [f64; 3])> {
        let by = moves.iter().find(|one| one.instrument == hand).map(|one| one.command).unwrap_or_default();
        let before = self.at(hand, is_behind);
        let due = [before[0] + by.advance_mm, before[1] + by.rotate_rad, before[2] + by.steer];
        let is = now.at(hand, true);
        let differs = |(due, is): (&f64, &f64)| (due - is).abs() > ROUNDING * (1.0 + due.abs());
        due.iter().zip(&is).any(differs).then_some((hand, due, is))
    }

    /// Length, rotation and steering that a hand has asked for, or, without what is behind, has reached.
    fn at(&self, hand: usize, is_behind: bool) -> [f64; 3] {
        let reached = self.hands[hand];
        let left = self.behind.get(hand).copied().filter(|_| is_behind).unwrap_or_default();
        [
            reached.inserted_mm + left.advance_mm,
            reached.rotation_rad + left.rotate_rad,
            reached.steer + left.steer,
        ]
    }
}
