//! Interactive sessions under fluoroscopy: a state machine without a window, a thread or a clock.
//!
//! A [`Session`] takes [`Input`]s (in JSON, one line each) and ticks of 1/60 s. It gives a [`Readout`] for the
//! operator, and a [`Snapshot`] from which [`Pictures`] draws the images of a cath lab. All motions are kept, so a
//! session can return to any step, and can be written as a script that repeats the motions to the bit
//! ([`Session::script`]).

mod demonstration;
mod fitting;
mod hand;
mod history;
mod input;
mod keys;
mod lab;
mod lumens;
mod meter;
mod pad;
mod pictures;
mod readout;
mod replay;
mod script;
mod session;
mod telemetry;

pub use fitting::fitting_side;
pub use hand::Motion;
pub use input::{INPUTS, Input};
pub use keys::{KEYS, Keys, Modifiers, idle_words};
pub use lab::Lab;
pub use lumens::lumens;
pub use pad::{Button, PAD, Pad};
pub use pictures::{Pictures, Sharpened, Sharpening};
pub use readout::{Event, EventKind, InstrumentReadout, LabReadout, Limits, Readout, Went};
pub use replay::Inputs;
pub use script::script_head;
pub use session::{IdleKey, Session, Snapshot, TICK_SOLVES};

/// Ticks per second.
pub const TICKS_PER_S: f64 = 60.0;

/// Speed of an instrument moved by a key, mm/s, and of script steps without times.
pub const USUAL_MM_PER_S: f64 = 10.0;

/// Rotation speed of an instrument moved by a key, degrees/s, and of script steps without times.
pub const USUAL_DEG_PER_S: f64 = 90.0;

/// Rate at which a key steers an instrument, 1/s, and script steps without times do: two seconds from straight to the
/// largest bend.
pub const USUAL_STEER_PER_S: f64 = 0.5;
