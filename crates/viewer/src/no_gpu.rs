//! Substitute for wgpu in a build without the feature `gpu`.

use crate::engine::Engines;
use crate::scene::Setup;

/// No adapter is ever available.
///
/// # Errors
/// That there is none, as a clause.
pub(crate) fn engines(_: &Setup, _software: bool) -> Result<Engines, String> {
    Err("built without the feature gpu: cargo build --release --features gpu".into())
}
