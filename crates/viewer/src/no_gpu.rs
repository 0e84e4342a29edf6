//! What a build without the feature `gpu` has in place of wgpu.

use crate::engine::Engines;
use crate::scene::Setup;

/// No adapter ever fits.
///
/// # Errors
/// That there is none, as a clause.
pub(crate) fn engines(_: &Setup, _software: bool) -> Result<Engines, String> {
    Err("this program was built without graphics processors (feature gpu)".into())
}
