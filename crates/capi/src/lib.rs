//! endowire for C and for everything that calls C: `include/endowire.h`, which is made from this source.
//!
//! Nothing is computed here. A scene becomes a simulation, which is stepped, read, saved and drawn through functions with
//! addresses and numbers. Three rules hold everywhere:
//!
//! - **No panic leaves.** Every function runs in `call` (`status.rs`), which catches it and returns `INTERNAL`.
//! - **Addresses are looked at in one place.** `border.rs` alone reads and writes through what callers give; it refuses NULL,
//!   addresses that are not aligned, and buffers that are too small.
//! - **One thread at a time.** What changes is behind a lock that is never waited for: a second thread is refused.
//!
//! Functions are tested as Rust functions and from C and C++ (`tests`).

mod border;
mod picture;
mod report;
mod scene;
mod shape;
mod simulation;
mod state;
mod status;
mod version;

pub use picture::{
    EndowireRenderer, endowire_fluoroscopy_new, endowire_inject, endowire_picture, endowire_renderer_free,
    endowire_turn_c_arm, endowire_view_3d_new,
};
pub use report::{
    EndowireContact, EndowireInstrument, EndowireReport, endowire_contacts, endowire_instrument,
    endowire_report,
};
pub use scene::{EndowireScene, endowire_scene_free, endowire_scene_from_text, endowire_scene_read};
pub use shape::{
    endowire_coil_positions_mm, endowire_positions_mm, endowire_radii_mm, endowire_vessel_triangles,
    endowire_vessel_vertices_mm, endowire_vessel_vertices_now_mm,
};
pub use simulation::{
    EndowireMove, EndowireSimulation, endowire_detach, endowire_forget, endowire_simulation_clone,
    endowire_simulation_free, endowire_simulation_new, endowire_step, endowire_step_until, endowire_tick,
    endowire_tick_until,
};
pub use state::{endowire_state_restore, endowire_state_save};
pub use status::{EndowireStatus, endowire_last_error};
pub use version::{ENDOWIRE_ABI_VERSION, endowire_abi_version, endowire_version};
