//! Coils detached from their pushers.

use serde::{Deserialize, Serialize};

use crate::shape::Shape;

/// A detached coil in the vessel: a rod that nothing holds. Devices that are pushed on touch and move it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DetachedCoil {
    /// Index of the instrument whose coil it was.
    pub instrument: usize,
    /// Its centre line, from the detached end to the tip.
    pub shape: Shape,
}
