//! Push, or trackability: the force of the hand that pushes a device along a track, without and with friction.

use endowire_core::Result;
use endowire_core::device::Device;
use endowire_core::insertion::{Command, Simulation};
use endowire_core::vessel::WallStore;
use serde::Serialize;

use super::check_positive;
use super::track::Track;

/// Length of a push between two readings, mm.
pub(super) const ADVANCE_MM: f64 = 2.5;

/// Settings of the test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PushTest {
    /// Coefficient of friction of the track.
    pub friction: f64,
    /// Length between two readings, mm.
    pub step_mm: f64,
}

impl Default for PushTest {
    fn default() -> Self {
        Self { friction: 0.1, step_mm: ADVANCE_MM }
    }
}

/// A reading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PushPoint {
    /// Inserted length, mm.
    pub inserted_mm: f64,
    /// Push force of the hand, N; negative where it holds back a device that springs forwards.
    pub push_force_n: f64,
    /// Force of the wall on the tip, N.
    pub tip_force_n: f64,
}

/// Push force over inserted length, with one friction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PushCurve {
    /// Coefficient of friction.
    pub friction: f64,
    /// The readings, from a length of 0 on.
    pub points: Vec<PushPoint>,
    /// Largest push force, N.
    pub largest_push_n: f64,
    /// Inserted length at the largest push force, mm.
    pub largest_at_mm: f64,
    /// Mean push force, N: the work of the hand over the inserted length.
    pub mean_push_n: f64,
    /// Largest force of the wall on the tip, N.
    pub largest_tip_force_n: f64,
    /// Steps that found no equilibrium.
    pub unconverged: usize,
    /// Why the test ended early; `None` if it did not.
    pub ended: Option<String>,
}

/// Pushes the tip to `reach_mm` in steps of at most `step_mm`, with a reading after each.
///
/// # Errors
/// Why it got no farther.
pub(super) fn advance(
    simulation: &mut Simulation,
    reach_mm: f64,
    step_mm: f64,
    mut read: impl FnMut(&Simulation),
) -> std::result::Result<(), String> {
    let count = (reach_mm / step_mm).ceil().max(1.0);
    for _ in 0..count as usize {
        simulation.step(Command::advance(reach_mm / count)).map_err(|error| error.to_string())?;
        read(simulation);
    }
    Ok(())
}

impl PushTest {
    /// Pushes `device` along `track`.
    ///
    /// # Errors
    /// Settings out of range, and a device that is too thick for the track. A step without an equilibrium ends the
    /// test, not with an error.
    pub fn run(&self, device: &Device, track: &Track, store: &dyn WallStore) -> Result<PushCurve> {
        check_positive("step_mm", self.step_mm, 100.0, "mm")?;
        let mut simulation = track.simulation(device, self.friction, store)?;
        Ok(self.push(&mut simulation, track.reach_mm(device)))
    }

    /// Pushes a device that is at the mouth of a track.
    pub fn push(&self, simulation: &mut Simulation, reach_mm: f64) -> PushCurve {
        let mut points = vec![PushPoint { inserted_mm: 0.0, push_force_n: 0.0, tip_force_n: 0.0 }];
        let mut unconverged = 0;
        let read = |simulation: &Simulation| {
            unconverged += usize::from(simulation.report().has_failed());
            points.push(PushPoint {
                inserted_mm: simulation.report().inserted_mm,
                push_force_n: simulation.report().push_force_n,
                tip_force_n: simulation.wall_force().tip_n,
            });
        };
        let ended = advance(simulation, reach_mm, self.step_mm, read).err();
        PushCurve { ended, unconverged, ..PushCurve::of(self.friction, points) }
    }
}

impl PushCurve {
    fn of(friction: f64, points: Vec<PushPoint>) -> Self {
        let largest = points.iter().max_by(|a, b| a.push_force_n.total_cmp(&b.push_force_n));
        let work_mj: f64 = points
            .windows(2)
            .map(|p| 0.5 * (p[0].push_force_n + p[1].push_force_n) * (p[1].inserted_mm - p[0].inserted_mm))
            .sum();
        let way_mm = points.last().map_or(0.0, |point| point.inserted_mm).max(f64::MIN_POSITIVE);
        Self {
            friction,
            largest_push_n: largest.map_or(0.0, |point| point.push_force_n),
            largest_at_mm: largest.map_or(0.0, |point| point.inserted_mm),
            mean_push_n: work_mj / way_mm,
            largest_tip_force_n: points.iter().map(|point| point.tip_force_n).fold(0.0, f64::max),
            unconverged: 0,
            ended: None,
            points,
        }
    }
}
