//! Instruments through which contrast medium can be injected.

use endowire_core::device::Stack;
use endowire_viewer::ViewSpec;

/// Whether each instrument has a lumen through which medium can be injected, innermost first. The lumen of a single
/// device may be given by the view alone.
pub fn lumens(stack: &Stack, view: &ViewSpec) -> Vec<bool> {
    let in_view = !stack.is_several() && view.device.iter().any(|part| part.inner_radius_mm > 0.0);
    let each = stack.instruments().iter().map(|one| one.device.sections());
    each.map(|sections| in_view || sections.iter().all(|section| section.inner_radius_mm.is_some())).collect()
}
