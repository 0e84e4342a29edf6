//! What was put in on the way from one state to the next, and where it went.
//!
//! Along a way of equilibria a force stays between what it is at the ends, so what hands, wall and blood put in lies between the least and
//! the most of what the forces at the ends do. What is not stored, friction took; of more that is lost, the device has jumped.

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
    /// What counts.
    notable_mj: f64,
}

impl Balance {
    /// That from the state before to the one after, with what wall and blood did.
    pub(super) fn new(
        stack: &Stack,
        (before, after): (&StepReport, &StepReport),
        by_wall: WallWork,
    ) -> Self {
        let (mut least_mj, mut most_mj) = (by_wall.least_mj, by_wall.most_mj);
        let mut mean_mj = 0.5 * (least_mj + most_mj);
        let mut add = |was: f64, is: f64, way: f64| {
            least_mj += (was * way).min(is * way);
            most_mj += (was * way).max(is * way);
            mean_mj += 0.5 * (was + is) * way;
        };
        for index in 0..after.instruments.len().max(1) {
            let (was, is) = (before.hand(index), after.hand(index));
            let push = |hand: &InstrumentReport| hand.push_force_n.unwrap_or(0.0);
            add(push(&was), push(&is), is.inserted_mm - was.inserted_mm);
            add(was.torque_nmm, is.torque_nmm, is.rotation_rad - was.rotation_rad);
        }
        let (was, is) = (before.energy.total(), after.energy.total());
        // What has come out of the sheath was straight in it.
        let each = stack.devices().enumerate().map(|(index, device)| {
            let straightening = |report: &StepReport| device.straightening_mj(report.hand(index).inserted_mm);
            straightening(after) - straightening(before)
        });
        let from_sheath_mj: f64 = each.sum();
        let notable_mj = NOTABLE * is.max(was).max(from_sheath_mj.abs()).max(NOTABLE_FLOOR_MJ);
        Self { least_mj, mean_mj, most_mj, stored_mj: is - was - from_sheath_mj, notable_mj }
    }

    /// Whether energy was set free that had been put in, beside what friction is said to have taken.
    pub(super) fn is_set_free(&self, dissipated_mj: f64) -> bool {
        self.least_mj - self.stored_mj - dissipated_mj > self.notable_mj
    }

    /// Whether more is stored and said to be taken by friction than can have been put in.
    pub(super) fn lacks(&self, dissipated_mj: f64) -> bool {
        self.stored_mj + dissipated_mj - self.most_mj > self.notable_mj
    }

    /// What friction took and what a jump set free. In a jump they are not told apart: the normal forces on its way are not those at its end.
    pub(super) fn lost_mj(&self, dissipated_mj: f64, jumps: bool) -> (f64, f64) {
        if jumps {
            return (0.0, (self.mean_mj - self.stored_mj).max(0.0));
        }
        (dissipated_mj.min((self.most_mj - self.stored_mj + self.notable_mj).max(0.0)), 0.0)
    }
}
