//! Instruments moved by hand under fluoroscopy: a session as a state machine, without a window, a thread or a clock.
//!
//! A [`Session`] takes [`Input`]s (one line of JSON each, if they come from outside) and ticks of a sixtieth of a second. It tells its
//! [`Readout`], and a [`Snapshot`] of which [`Pictures`] draws what a cath lab shows. All motions are kept, so that a session can go back to any
//! moment and becomes a script that carries the same motions out to the bit ([`Session::script`]).

mod demonstration;
mod hand;
mod history;
mod input;
mod keys;
mod lab;
mod pad;
mod pictures;
mod readout;
mod script;
mod session;
mod telemetry;

pub use hand::Motion;
pub use input::Input;
pub use keys::{KEYS, Keys, Modifiers};
pub use lab::Lab;
pub use pad::{Button, PAD, Pad};
pub use pictures::{Pictures, Sharpened, Sharpening};
pub use readout::{Event, EventKind, InstrumentReadout, LabReadout, Limits, Readout, Went};
pub use script::script_head;
pub use session::{Delivered, Session, Snapshot, TICK_SOLVES};

/// Ticks of a session in a second.
pub const TICKS_PER_S: f64 = 60.0;

/// How fast a key moves an instrument, mm/s; steps of a script without times are shown as fast.
pub const USUAL_MM_PER_S: f64 = 10.0;

/// How fast a key turns one, degrees/s, likewise.
pub const USUAL_DEG_PER_S: f64 = 90.0;
