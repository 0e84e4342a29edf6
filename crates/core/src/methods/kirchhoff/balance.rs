//! Energy balance between two states.
//!
//! Along a path of equilibria a force stays between its values at the ends, so the work of hands, wall and blood lies
//! between bounds from the forces at the ends; and so does the dissipation of friction. Work that is neither stored
//! nor dissipated was released: the device has jumped.

use serde::{Deserialize, Serialize};

use super::hands::HandForce;
use crate::contact::HandMotion;
use crate::device::Stack;
use crate::methods::Energy;
use crate::tuning::StepTuning;

/// Work of the moving wall and blood on a device between two states, mJ.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct OuterWork {
    /// The lower bound from the forces before and after.
    pub(super) least_mj: f64,
    /// The upper bound.
    pub(super) most_mj: f64,
}

impl OuterWork {
    /// The same, and something else that does between these.
    pub(super) fn with(self, [one, other]: [f64; 2]) -> Self {
        Self { least_mj: self.least_mj + one.min(other), most_mj: self.most_mj + one.max(other) }
    }

    /// The same, and blood that does so much at the most, or has it done against it.
    pub(super) fn with_flow(self, most_mj: f64) -> Self {
        self.with([-most_mj, most_mj])
    }
}

/// Energy between two states, mJ.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Balance {
    /// Lower bound of the work put in.
    least_mj: f64,
    /// Work of the mean of the forces at both ends.
    mean_mj: f64,
    /// Upper bound of the work put in.
    most_mj: f64,
    /// Increase of the stored energy.
    stored_mj: f64,
    /// Lower and upper bound of the dissipation by friction.
    friction_mj: (f64, f64),
    /// Threshold of significance.
    notable_mj: f64,
}

impl Balance {
    /// The balance of these motions between two states, of the instruments as they are steered in each, given the work of wall and blood and the bounds of the
    /// dissipation. Friction outside the body is not part of it: what hands do against that is lost at once. Energy is
    /// significant above a fraction of the energy that is stored in the device and the wall, exchanged with
    /// fields, or released from the sheath.
    pub(super) fn new(
        stacks: [&Stack; 2],
        motions: &[HandMotion],
        (before, after): (&[HandForce], &[HandForce]),
        (was, is): (Energy, Energy),
        by_others: OuterWork,
        friction_mj: (f64, f64),
        tuning: &StepTuning,
    ) -> Self {
        let (mut least_mj, mut most_mj) = (by_others.least_mj, by_others.most_mj);
        let mut mean_mj = 0.5 * (least_mj + most_mj);
        // The part that has come out of the sheath was straight in it, steered as it was on the way.
        let each = stacks.into_iter().flat_map(Stack::devices).zip(motions.iter().cycle());
        let each = each.map(|(device, motion)| {
            device.straightening_mj(motion.to_mm) - device.straightening_mj(motion.from_mm)
        });
        let from_sheath_mj = 0.5 * each.sum::<f64>();
        let mut add = |was: f64, is: f64, way: f64| {
            least_mj += (was * way).min(is * way);
            most_mj += (was * way).max(is * way);
            mean_mj += 0.5 * (was + is) * way;
        };
        for ((was, is), motion) in before.iter().zip(after).zip(motions) {
            // Where the force jumps at one end, that at the other counts.
            let first_n = if was.jumps && !is.jumps { is.push_n } else { was.push_n };
            let last_n = if is.jumps && !was.jumps { was.push_n } else { is.push_n };
            // With nothing inserted a hand feels nothing, and all that comes out of the sheath may pull.
            let comes_in = motion.from_mm == 0.0 && motion.to_mm > 0.0;
            let first_n = if comes_in { -from_sheath_mj.abs() / motion.to_mm } else { first_n };
            add(first_n, last_n, motion.advance_mm());
            add(was.torque_nmm, is.torque_nmm, motion.turn_rad);
            add(was.steer_mj, is.steer_mj, motion.steer);
        }
        let stored_mj = is.total() - was.total() - from_sheath_mj;
        // The energy in a field has an arbitrary zero: its change counts.
        let [elastic_was, elastic_is] = [was, is].map(|energy| energy.total() - energy.field);
        let sizes_mj = [elastic_was, elastic_is, (is.field - was.field).abs(), from_sheath_mj.abs()];
        let notable_mj = tuning.notable * sizes_mj.into_iter().fold(tuning.notable_floor_mj, f64::max);
        Self { least_mj, mean_mj, most_mj, stored_mj, friction_mj, notable_mj }
    }

    /// The balance of this way and the next one together.
    pub(super) fn and(&self, next: &Self) -> Self {
        Self {
            least_mj: self.least_mj + next.least_mj,
            mean_mj: self.mean_mj + next.mean_mj,
            most_mj: self.most_mj + next.most_mj,
            stored_mj: self.stored_mj + next.stored_mj,
            friction_mj: (self.friction_mj.0 + next.friction_mj.0, self.friction_mj.1 + next.friction_mj.1),
            notable_mj: self.notable_mj.max(next.notable_mj),
        }
    }

    /// Whether all its numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        let (least_mj, most_mj) = self.friction_mj;
        let work = [self.least_mj, self.mean_mj, self.most_mj];
        work.into_iter().chain([self.stored_mj, least_mj, most_mj, self.notable_mj]).all(f64::is_finite)
    }

    /// Whether energy that had been put in was released.
    pub(super) fn is_set_free(&self) -> bool {
        self.least_mj - self.stored_mj - self.friction_mj.1 > self.notable_mj
    }

    /// Whether more is stored and dissipated than can have been put in.
    pub(super) fn lacks(&self) -> bool {
        self.stored_mj + self.friction_mj.0 - self.most_mj > self.notable_mj
    }

    /// Energy dissipated by friction and energy released by a jump. Without a jump the loss is attributed to friction
    /// within its bounds. In a jump they are not separated: the normal forces on its way are not those at its ends.
    pub(super) fn lost_mj(&self, jumps: bool) -> (f64, f64) {
        let lost_mj = self.mean_mj - self.stored_mj;
        let (least_mj, most_mj) = self.friction_mj;
        if jumps { (0.0, lost_mj.max(0.0)) } else { (lost_mj.clamp(least_mj, most_mj), 0.0) }
    }

    /// Energy that is stored or was dissipated beyond what was put in, mJ: a relaxation that stops on its way may be higher than where it began, and the
    /// rest of it gives the difference back.
    pub(super) fn borrowed_mj(&self, lost_mj: f64) -> f64 {
        (lost_mj - (self.mean_mj - self.stored_mj)).max(0.0)
    }
}
