//! States of a beam that are alike but for time and pedal.

use endowire_assess::{BeamMode, BeamState};

/// On or off from there on.
pub(crate) fn beam(time_s: f64, on: bool) -> BeamState {
    BeamState {
        time_s,
        on,
        frames_per_s: 10.0,
        dose_ngy: 30.0,
        field_mm2: 1e4,
        primary_deg: 0.0,
        secondary_deg: 0.0,
        mode: Some(BeamMode::Fluoro),
        ..BeamState::default()
    }
}
