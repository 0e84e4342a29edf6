//! Coils that were detached from their pushers.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::{Skin, Still};
use crate::device::{Device, Stack};
use crate::shape::Shape;
use crate::{Error, Result};

/// A coil that was detached and lies in the vessel. It stays where it came to rest: what is pushed on touches it, and does not move it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DetachedCoil {
    /// Number of the instrument whose coil it was.
    pub instrument: usize,
    /// Its centre line, from the end that was detached to its tip.
    pub shape: Shape,
}

impl DetachedCoil {
    /// The elements of all coils of the instruments of a stack, as a rod beside them feels them.
    pub(crate) fn elements(coils: &[Self], stack: &Stack) -> Vec<Still> {
        let each = coils.iter().enumerate().flat_map(|(rod, coil)| {
            let device = &stack.instruments()[coil.instrument].device;
            still(&coil.shape, rod, move |from_tip_mm| skin(device, from_tip_mm))
        });
        each.collect()
    }

    /// Checks that a coil that is restored may be one of these instruments.
    pub(crate) fn check(&self, stack: &Stack) -> Result<()> {
        let coil_mm = stack.instruments().get(self.instrument).map_or(0.0, |one| one.device.coil_mm());
        let Shape { positions_mm, tangents, from_tip_mm } = &self.shape;
        let numbers = positions_mm.iter().chain(tangents).flat_map(|v| v.iter()).chain(from_tip_mm);
        let falls = from_tip_mm.windows(2).all(|ends| ends[0] > ends[1]) && from_tip_mm.last() == Some(&0.0);
        let lengths = [positions_mm.len(), tangents.len()] == [from_tip_mm.len(); 2] && from_tip_mm.len() > 1;
        if coil_mm > 0.0 && lengths && falls && numbers.clone().all(|x| x.is_finite()) {
            return Ok(());
        }
        let mend = "is no coil of this scene's instruments: restore a state of this scene";
        Err(Error::parameter("state.coils", self.instrument, mend))
    }
}

/// The surface of a device at a distance from its tip, mm.
fn skin(device: &Device, from_tip_mm: f64) -> Skin {
    let section = device.section_at(from_tip_mm);
    Skin::rigid(section.radius_mm, section.bending_stiffness_nmm2)
}

/// The elements of a line that stays where it is, the `rod`th of all; its surface by the distance from its tip, mm.
pub(crate) fn still(shape: &Shape, rod: usize, skin: impl Fn(f64) -> Skin) -> impl Iterator<Item = Still> {
    let node = |i: usize| (shape.positions_mm[i], shape.tangents[i]);
    let whole_mm = shape.from_tip_mm.first().copied().unwrap_or(0.0);
    (0..shape.len().saturating_sub(1)).map(move |e| {
        let [from_mm, to_mm] = [e, e + 1].map(|i| shape.from_tip_mm[i]);
        Still {
            nodes: [node(e), node(e + 1)],
            length_mm: from_mm - to_mm,
            skin: skin(0.5 * (from_mm + to_mm)),
            rod,
            begin_mm: whole_mm - from_mm,
        }
    })
}

/// What all that was detached so far is made of; shared, since it changes with a coil alone.
pub(crate) type Coils = Arc<Vec<DetachedCoil>>;
