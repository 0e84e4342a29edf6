//! Statistics of a run over its steps.

use serde::{Deserialize, Serialize};

use super::{Simulation, WallForce};

/// Angle by which an element may bend, degrees: a ring of six elements, 60° each, has a push force off by 0.4 %, one of
/// four by 4 %; at contacts the error is larger.
const COARSE_TURN_DEG: f64 = 60.0;

/// Statistics over the steps of a run, whatever carries it out.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Tally {
    /// Steps that did not meet the method's own convergence test, except ticks on their way to an equilibrium: their
    /// shapes are not equilibria.
    pub unconverged_steps: usize,
    /// The first of them, from 1.
    pub first_unconverged_step: Option<usize>,
    /// Steps in which the device jumped to a lower minimum.
    pub jumps: usize,
    /// Relaxations of all steps ([`StepReport::relaxations`](super::StepReport::relaxations)).
    pub relaxations: u64,
    /// Largest imbalance of any step after which the device lies still
    /// ([`StepReport::imbalance`](super::StepReport::imbalance)).
    pub max_imbalance: f64,
    /// Deepest penetration of the wall in any step, mm.
    pub max_penetration_mm: f64,
    /// The maximum of each of these forces.
    pub max_wall_force: WallForce,
    /// Largest angle by which an element bends in any step, degrees ([`StepReport::largest_bend_rad`](super::StepReport::largest_bend_rad)).
    #[serde(default)]
    pub max_turn_deg: f64,
    /// Largest push force of any step, N; 0 if the hand only pulled.
    #[serde(default)]
    pub max_push_force_n: f64,
    /// Largest torque of any step, N·mm, in either direction.
    #[serde(default)]
    pub max_torque_nmm: f64,
    /// Largest angle by which the tip's rotation differed from the hand's in any step, rad; with several instruments that of
    /// the innermost.
    #[serde(default)]
    pub max_tip_lag_rad: f64,
    /// Whether the last step has left motion to the next ([`StepReport::behind`](super::StepReport::behind)).
    #[serde(default)]
    pub ends_under_way: bool,
}

impl Tally {
    /// Adds step number `step`, from 1, which the simulation has just carried out.
    pub fn count(&mut self, step: usize, simulation: &Simulation) {
        let (report, force) = (simulation.report(), simulation.wall_force());
        if report.has_failed() {
            self.unconverged_steps += 1;
            self.first_unconverged_step.get_or_insert(step);
        }
        self.ends_under_way = report.is_under_way();
        self.jumps += usize::from(report.jumped);
        self.relaxations += u64::from(report.relaxations);
        // Under way forces need not balance. A tally is written as JSON, which has no infinite numbers.
        if report.imbalance.is_finite() && !report.is_under_way() {
            self.max_imbalance = self.max_imbalance.max(report.imbalance);
        }
        self.max_penetration_mm = self.max_penetration_mm.max(report.max_penetration_mm);
        let most = &mut self.max_wall_force;
        most.sum_n = most.sum_n.max(force.sum_n);
        most.largest_n = most.largest_n.max(force.largest_n);
        most.tip_n = most.tip_n.max(force.tip_n);
        self.max_push_force_n = self.max_push_force_n.max(report.push_force_n);
        self.max_torque_nmm = self.max_torque_nmm.max(report.torque_nmm.abs());
        let lag_rad = report.rotation_rad - report.tip_rotation_rad;
        self.max_tip_lag_rad = self.max_tip_lag_rad.max(lag_rad.abs());
        self.max_turn_deg = self.max_turn_deg.max(report.largest_bend_rad.to_degrees());
    }

    /// Irregularities in words: "3 of 60 steps without an equilibrium, the first step 12; 1 jump", and whether elements
    /// are coarse. `None` if there were none.
    pub fn remarks(&self, steps: usize) -> Option<String> {
        let mut remarks = Vec::new();
        if let Some(first) = self.first_unconverged_step {
            let count = self.unconverged_steps;
            remarks.push(format!("{count} of {steps} steps without an equilibrium, the first step {first}"));
        }
        let several = |count: u64, one: &str| format!("{count} {one}{}", if count == 1 { "" } else { "s" });
        if self.jumps > 0 {
            remarks.push(several(self.jumps as u64, "jump"));
        }
        if self.relaxations > 0 {
            remarks.push(several(self.relaxations, "last resort"));
        }
        if self.max_turn_deg > COARSE_TURN_DEG {
            let turn_deg = self.max_turn_deg;
            remarks.push(format!(
                "elements bend by up to {turn_deg:.0}°: compare with shorter ones (method.element_mm)"
            ));
        }
        if self.ends_under_way {
            remarks.push("at its end the device is still behind its hands".to_owned());
        }
        (!remarks.is_empty()).then(|| remarks.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tally_remarks_on_what_went_wrong_and_nothing_else() {
        assert_eq!(Tally::default().remarks(60), None);
        let tally = Tally {
            unconverged_steps: 3,
            first_unconverged_step: Some(12),
            jumps: 1,
            relaxations: 2,
            ..Tally::default()
        };
        let reported = "3 of 60 steps without an equilibrium, the first step 12; 1 jump; 2 last resorts";
        assert_eq!(tally.remarks(60).unwrap(), reported);
        let coarse = Tally { max_turn_deg: 75.0, ..Tally::default() }.remarks(9).unwrap();
        assert!(coarse.contains("bend by up to 75°") && coarse.contains("method.element_mm"), "{coarse}");
        let behind = Tally { ends_under_way: true, ..Tally::default() }.remarks(9).unwrap();
        assert!(behind.contains("behind its hands"), "{behind}");
        assert_eq!(Tally { jumps: 2, max_turn_deg: 45.0, ..Tally::default() }.remarks(9).unwrap(), "2 jumps");
    }
}
