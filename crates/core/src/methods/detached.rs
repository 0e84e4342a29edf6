//! Coils that were detached from their pushers.

use serde::{Deserialize, Serialize};

use crate::shape::Shape;

/// A coil that was detached and lies in the vessel: a rod that nothing holds. What is pushed on touches it and moves it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DetachedCoil {
    /// Number of the instrument whose coil it was.
    pub instrument: usize,
    /// Its centre line, from the end that was detached to its tip.
    pub shape: Shape,
}
