//! Torque response: the angle of the tip against that of the hand, which turns a device whose tip lies at the end of a
//! track.

use endowire_core::Result;
use endowire_core::device::Device;
use endowire_core::insertion::{Command, Simulation};
use endowire_core::vessel::WallStore;
use serde::Serialize;

use super::check_positive;
use super::push::{ADVANCE_MM, advance};
use super::track::Track;

/// Settings of the test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueTest {
    /// Coefficient of friction of the track.
    pub friction: f64,
    /// Angle through which the hand turns, degrees.
    pub turn_deg: f64,
    /// Angle of the hand between two readings, degrees.
    pub step_deg: f64,
}

impl Default for TorqueTest {
    /// Two turns: in the first one friction and bends wind the device up, the second repeats what is then periodic.
    fn default() -> Self {
        Self { friction: 0.1, turn_deg: 720.0, step_deg: 7.5 }
    }
}

/// A reading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TorquePoint {
    /// Angle of the hand, degrees.
    pub hand_deg: f64,
    /// Angle of the tip about the device's axis, degrees, from where it was before the hand turned.
    pub tip_deg: f64,
    /// Torque of the hand, N·mm.
    pub torque_nmm: f64,
}

/// Result of the test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TorqueResponse {
    /// Inserted length, mm.
    pub inserted_mm: f64,
    /// The readings, from an angle of 0 on.
    pub points: Vec<TorquePoint>,
    /// Largest angle by which the tip is behind the hand, degrees.
    pub largest_lag_deg: f64,
    /// Angle by which the tip is behind the hand, degrees, averaged over the last turn.
    pub mean_lag_deg: f64,
    /// Largest whip: the angle by which the tip jumps ahead while the hand turns almost not at all, degrees; 0 if it never jumps.
    pub largest_whip_deg: f64,
    /// Angle of the hand, degrees, at the largest whip.
    pub whip_at_deg: Option<f64>,
    /// Number of jumps.
    pub jumps: usize,
    /// Largest torque of the hand, N·mm.
    pub largest_torque_nmm: f64,
    /// Steps of turning that found no equilibrium.
    pub unconverged: usize,
    /// Why the test ended early; `None` if it did not.
    pub ended: Option<String>,
}

impl TorqueTest {
    /// Pushes `device` to the end of `track` and turns it.
    ///
    /// # Errors
    /// Settings out of range, and a device that is too thick for the track. A step without an equilibrium ends the
    /// test, not with an error.
    pub fn run(&self, device: &Device, track: &Track, store: &dyn WallStore) -> Result<TorqueResponse> {
        let reach_mm = track.reach_mm(device);
        let mut simulation = track.simulation(&held_at(device, reach_mm)?, self.friction, store)?;
        match advance(&mut simulation, reach_mm, ADVANCE_MM, |_| ()) {
            Ok(()) => self.turn(&mut simulation),
            Err(reason) => {
                let inserted_mm = simulation.report().inserted_mm;
                Ok(TorqueResponse { ended: Some(reason), ..TorqueResponse::of(vec![], &[], inserted_mm) })
            }
        }
    }

    /// Turns a device that is in place.
    ///
    /// # Errors
    /// Settings out of range.
    pub fn turn(&self, simulation: &mut Simulation) -> Result<TorqueResponse> {
        check_positive("turn_deg", self.turn_deg, 36_000.0, "degrees")?;
        check_positive("step_deg", self.step_deg, 45.0, "degrees")?;
        let count = (self.turn_deg / self.step_deg).ceil().max(1.0) as usize;
        let step_rad = self.turn_deg.to_radians() / count as f64;
        let [hand_rad, tip_rad] = angles_rad(simulation);
        let read = |simulation: &Simulation| {
            let [hand, tip] = angles_rad(simulation);
            TorquePoint {
                hand_deg: (hand - hand_rad).to_degrees(),
                tip_deg: (tip - tip_rad).to_degrees(),
                torque_nmm: simulation.report().torque_nmm,
            }
        };
        let mut points = vec![read(simulation)];
        let mut whips = Vec::new();
        let (mut unconverged, mut ended) = (0, None);
        for _ in 0..count {
            let jumped = match simulation.step(Command::rotate(step_rad)) {
                Ok(report) => {
                    unconverged += usize::from(report.has_failed());
                    report.jumped
                }
                Err(error) => {
                    ended = Some(error.to_string());
                    break;
                }
            };
            let (before, now) = (points[points.len() - 1], read(simulation));
            let ahead_deg = (now.tip_deg - before.tip_deg) - (now.hand_deg - before.hand_deg);
            // A jump elsewhere along the device moves the tip little.
            if jumped && ahead_deg > 0.0 {
                whips.push((now.hand_deg, ahead_deg));
            }
            points.push(now);
        }
        let inserted_mm = simulation.report().inserted_mm;
        Ok(TorqueResponse { unconverged, ended, ..TorqueResponse::of(points, &whips, inserted_mm) })
    }
}

/// A device without what lies behind `length_mm` from its tip: the hand holds it there, and no tail twists between hand and
/// track, so that devices of different lengths are compared over the same stretch.
fn held_at(device: &Device, length_mm: f64) -> Result<Device> {
    let mut left_mm = length_mm;
    let mut sections = device.sections().to_vec();
    sections.retain_mut(|section| {
        section.length_mm = section.length_mm.min(left_mm);
        left_mm -= section.length_mm;
        section.length_mm > 0.0
    });
    Device::new(sections)
}

/// Angles of hand and tip.
fn angles_rad(simulation: &Simulation) -> [f64; 2] {
    let report = simulation.report();
    [report.rotation_rad, report.tip_rotation_rad]
}

impl TorqueResponse {
    fn of(points: Vec<TorquePoint>, whips: &[(f64, f64)], inserted_mm: f64) -> Self {
        let lags = |from_deg: f64| {
            points.iter().filter(move |p| p.hand_deg >= from_deg).map(|p| p.hand_deg - p.tip_deg)
        };
        let last_deg = points.last().map_or(0.0, |point| point.hand_deg);
        let turn: Vec<f64> = lags(last_deg - 360.0 + 1e-6).collect();
        let largest = whips.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
        Self {
            inserted_mm,
            largest_lag_deg: lags(0.0).fold(0.0, f64::max),
            mean_lag_deg: turn.iter().sum::<f64>() / turn.len().max(1) as f64,
            largest_whip_deg: largest.map_or(0.0, |whip| whip.1),
            whip_at_deg: largest.map(|whip| whip.0),
            jumps: whips.len(),
            largest_torque_nmm: points.iter().map(|p| p.torque_nmm.abs()).fold(0.0, f64::max),
            unconverged: 0,
            ended: None,
            points,
        }
    }
}
