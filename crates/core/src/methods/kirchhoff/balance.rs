//! What was put in on the way from one state to the next, and where it went.
//!
//! Along a way of equilibria a force stays between what it is at the ends, so what hands, wall and blood put in lies between the least and
//! the most of what the forces at the ends do; and so does what friction took. What is put in and neither stored nor taken was set free: the
//! device has jumped.

use super::carried::WallWork;
use crate::device::Stack;
use crate::methods::{InstrumentReport, StepReport};

/// Energy is set free, or comes from nowhere, if it is more than this part of what is stored or came out of the sheath.
const NOTABLE: f64 = 0.02;
/// Energy below which none is, mJ.
const NOTABLE_FLOOR_MJ: f64 = 1e-6;

/// Energy between two states, mJ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Balance {
    /// The least that was put in, …
    least_mj: f64,
    /// … what the mean of the forces at both ends puts in, …
    mean_mj: f64,
    /// … and the most.
    most_mj: f64,
    /// What is stored more than before.
    stored_mj: f64,
    /// What friction took, at least and at most.
    rubbed_mj: (f64, f64),
    /// What counts.
    notable_mj: f64,
}

impl Balance {
    /// That from the state before to the one after, with what wall and blood did and what friction took, at least and at most.
    pub(super) fn new(
        stack: &Stack,
        (before, after): (&StepReport, &StepReport),
        by_wall: WallWork,
        rubbed_mj: (f64, f64),
    ) -> Self {
        let (mut least_mj, mut most_mj) = (by_wall.least_mj, by_wall.most_mj);
        let mut mean_mj = 0.5 * (least_mj + most_mj);
        // What has come out of the sheath was straight in it.
        let each = stack.devices().enumerate().map(|(index, device)| {
            let straightening = |report: &StepReport| device.straightening_mj(report.hand(index).inserted_mm);
            straightening(after) - straightening(before)
        });
        let from_sheath_mj: f64 = each.sum();
        let mut add = |was: f64, is: f64, way: f64| {
            least_mj += (was * way).min(is * way);
            most_mj += (was * way).max(is * way);
            mean_mj += 0.5 * (was + is) * way;
        };
        for index in 0..after.instruments.len().max(1) {
            let (was, is) = (before.hand(index), after.hand(index));
            let push = |hand: &InstrumentReport| hand.push_force_n.unwrap_or(0.0);
            // With nothing inserted a hand feels nothing, and all that comes out of the sheath may pull at it.
            let comes_in = was.inserted_mm == 0.0 && is.inserted_mm > 0.0;
            let at_first = if comes_in { -from_sheath_mj.abs() / is.inserted_mm } else { push(&was) };
            add(at_first, push(&is), is.inserted_mm - was.inserted_mm);
            add(was.torque_nmm, is.torque_nmm, is.rotation_rad - was.rotation_rad);
        }
        let (was, is) = (before.energy.total(), after.energy.total());
        let notable_mj = NOTABLE * is.max(was).max(from_sheath_mj.abs()).max(NOTABLE_FLOOR_MJ);
        Self { least_mj, mean_mj, most_mj, stored_mj: is - was - from_sheath_mj, rubbed_mj, notable_mj }
    }

    /// Whether energy was set free that had been put in.
    pub(super) fn is_set_free(&self) -> bool {
        self.least_mj - self.stored_mj - self.rubbed_mj.1 > self.notable_mj
    }

    /// Whether more is stored and taken by friction than can have been put in.
    pub(super) fn lacks(&self) -> bool {
        self.stored_mj + self.rubbed_mj.0 - self.most_mj > self.notable_mj
    }

    /// What friction took and what a jump set free. Without a jump friction took what was lost, as far as its forces reach. In one they are not
    /// distinguished: the normal forces on its way are not those at its ends.
    pub(super) fn lost_mj(&self, jumps: bool) -> (f64, f64) {
        let lost_mj = self.mean_mj - self.stored_mj;
        let (least_mj, most_mj) = self.rubbed_mj;
        if jumps { (0.0, lost_mj.max(0.0)) } else { (lost_mj.clamp(least_mj, most_mj), 0.0) }
    }

    /// What is stored or was lost in this way without having been put in: what stops on its way may be higher than it began, and the rest of the way
    /// gives that back.
    pub(super) fn borrowed_mj(&self, (dissipated_mj, released_mj): (f64, f64)) -> f64 {
        (dissipated_mj + released_mj - (self.mean_mj - self.stored_mj)).max(0.0)
    }
}
