//! Bench tests of a device, as its engineers carry them out: [torque response](torque), [push] along a tortuous
//! [track], [tip load](tip_load) and [three-point bending](bend), and the deployment of a [coil] in a sac.
//!
//! Every test is a sequence of equilibria of the exact rod: no speed, no damping, no time.

pub mod bend;
pub mod coil;
pub mod push;
pub mod tip_load;
pub mod torque;
pub mod track;

use endowire_core::{Error, Result};

/// Newtons in a gram-force, the unit in which makers state tip loads.
pub const NEWTONS_PER_GRAM_FORCE: f64 = 9.806_65e-3;

/// Refuses a parameter that is not a number above 0 and up to `most`.
fn check_positive(name: &str, value: f64, most: f64, unit: &str) -> Result<()> {
    if value > 0.0 && value <= most {
        return Ok(());
    }
    Err(Error::parameter(name, value, format!("must be above 0 and at most {most} {unit}")))
}

/// Refuses a coefficient of friction that no pair of materials has.
fn check_friction(friction: f64) -> Result<()> {
    if (0.0..=2.0).contains(&friction) {
        return Ok(());
    }
    Err(Error::parameter("friction", friction, "must be a coefficient of 0 to 2"))
}
