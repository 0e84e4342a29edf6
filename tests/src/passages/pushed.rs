//! What a device does that is pushed into a vessel.

use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::{Error, PhysicalEnd, Result};

use super::Question;

/// A wall that yields very little, N/mm²: what is too thick for it does not squeeze through. It rubs nothing.
const RIGID_N_PER_MM2: f64 = 1e4;
/// Commands, mm.
const STEP_MM: f64 = 2.0;
/// Depth of the sheath's mouth, mm.
const DEPTH_MM: f64 = 1.0;
/// A tip has arrived that is no farther than this before the end of its way, mm.
const ARRIVED_MM: f64 = 0.5;
/// A tip is farther than before by more than this, mm, or it makes no way, …
const FARTHER_MM: f64 = 0.5;
/// … and is stuck that has made none while so much, and so many radii of the lumen, were pushed in, mm.
const PATIENCE_MM: f64 = 10.0;
const PATIENCE_RADII: f64 = 2.0;

/// Why a push ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ended {
    /// The tip is at the end of its way.
    Arrived,
    /// The simulation says that the vessel is narrower than the device.
    Blocked,
    /// The tip makes no way any more: the device folds behind it.
    Stuck,
    /// All of the device is in.
    AllIn,
    /// A computation failed.
    Failed(String),
}

/// How a device was pushed.
#[derive(Debug, Clone, PartialEq)]
pub struct Pushed {
    /// Why that ended.
    pub ended: Ended,
    /// How far along the way the tip was at most, mm.
    pub reached_mm: f64,
    /// Length pushed in, mm.
    pub inserted_mm: f64,
    /// Largest force of the hand, N.
    pub force_n: f64,
    /// Deepest that the device was in the wall, mm.
    pub deep_mm: f64,
}

impl Pushed {
    /// Pushes the device of a question in until its tip is at the end of the way, or goes no farther.
    ///
    /// # Errors
    /// What cannot be simulated, but for a device that is too thick for the vessel's mouth.
    pub fn of(question: &Question) -> Result<Self> {
        let Question { vessel, device, way, .. } = question;
        let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, DEPTH_MM)?;
        let properties = WallProperties { modulus_n_per_mm2: RIGID_N_PER_MM2, ..WallProperties::default() };
        let builder = Simulation::builder(vessel.wall.clone(), device.clone(), sheath).properties(properties);
        let mut pushed =
            Self { ended: Ended::Blocked, reached_mm: 0.0, inserted_mm: 0.0, force_n: 0.0, deep_mm: 0.0 };
        let mut simulation = match builder.build() {
            Ok(simulation) => simulation,
            // The wall is too near to the sheath's mouth.
            Err(Error::Parameter { name, .. }) if name.ends_with("radius_mm") => return Ok(pushed),
            Err(error) => return Err(error),
        };
        let mut farther_at_mm = 0.0;
        pushed.ended = loop {
            let tip_mm = simulation.shape().tip_mm().unwrap_or(sheath.position_mm);
            let on = way.nearest(&tip_mm);
            if on.arc_mm >= way.length_mm() - ARRIVED_MM {
                pushed.reached_mm = way.length_mm();
                break Ended::Arrived;
            }
            if on.arc_mm > pushed.reached_mm + FARTHER_MM {
                (pushed.reached_mm, farther_at_mm) = (on.arc_mm, pushed.inserted_mm);
            }
            if pushed.inserted_mm - farther_at_mm > PATIENCE_MM + PATIENCE_RADII * on.radius_mm {
                break Ended::Stuck;
            }
            let advance_mm = STEP_MM.min(device.length_mm() - pushed.inserted_mm);
            if advance_mm <= 0.0 {
                break Ended::AllIn;
            }
            match simulation.step(Command::advance(advance_mm)) {
                Ok(report) => {
                    pushed.inserted_mm = report.inserted_mm;
                    pushed.force_n = pushed.force_n.max(report.push_force_n);
                    pushed.deep_mm = pushed.deep_mm.max(report.max_penetration_mm);
                }
                // Beyond the opening at the end of the way.
                Err(Error::End(PhysicalEnd::Left { .. })) => break Ended::Arrived,
                Err(Error::End(PhysicalEnd::Blocked { .. })) => break Ended::Blocked,
                Err(error) => break Ended::Failed(error.to_string()),
            }
        };
        Ok(pushed)
    }
}
