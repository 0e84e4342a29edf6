//! Scene files: one TOML document with vessel, device, method, script and what is recorded.
//!
//! The core reads every table but `[view]`, which belongs to the viewer. Paths are relative to the scene file.
//!
//! ```toml
//! name = "curved_tube"
//!
//! [vessel]
//! tree = "../vessels/curved_tube.csv"   # or: file = "wall.stl", with unit_mm
//! edge_mm = 1.0
//!
//! [device]
//! [[device.section]]                    # tip first
//! length_mm = 300.0
//! radius_mm = 0.45
//! bending_stiffness_nmm2 = 10.0
//!
//! [sheath]
//! opening = 0                           # or: position_mm and direction
//!
//! [method]
//! name = "kirchhoff"                    # endowire-methods knows more
//! element_mm = 2.0
//!
//! [[script]]
//! advance_mm = 200.0
//! step_mm = 1.0
//! ```
//!
//! Several coaxial instruments replace `[device]`, the innermost first; lines of the script name theirs:
//!
//! ```toml
//! [[instrument]]
//! name = "wire"
//! file = "../devices/microwire_018.toml"
//! inserted_mm = 20.0                    # at the start; 0 if absent
//!
//! [[instrument]]
//! name = "catheter"
//! file = "../devices/catheter_4f_vertebral.toml"
//! may_lead = false                      # never farther in than the wire in it; it may if absent
//!                                       # `clearance = true` of the wire: it tilts where it comes out
//!
//! [[script]]
//! instrument = "wire"
//! advance_mm = 100.0
//! with = [{ instrument = "catheter", advance_mm = 80.0 }]
//!
//! [[script]]
//! instrument = "wire"
//! withdraw = true                       # all of it
//! ```

mod centreline;
#[cfg(test)]
mod memory_tests;
mod method_table;
mod sac;
mod spec;
mod tables;

pub use sac::SacSpec;
pub use spec::{Scene, SceneOf};
pub use tables::{DeviceSpec, InstrumentSpec, SheathSpec, VesselSpec};
