//! Numbers of the search for a way ahead.

/// How it is decided that a device is blocked (`contact/passage.rs`, `kirchhoff/blocked.rs`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassageTuning {
    /// Penetration, as a fraction of its radius, from which a device counts as wedged.
    pub wedged: f64,
    /// Length of the device searched for its front, in radii: a hooked tip that is folded back is as long.
    pub front: usize,
    /// Grid spacings, in radii of the device.
    pub spacings: [f64; 2],
    /// A path ends at this distance from the front, in radii of the device: what is farther ahead does not block it.
    pub ahead: f64,
    /// Smallest length of the front, and distance beside it within which paths begin, in radii.
    pub beside: f64,
    /// Largest number of grid points per query: if undecided by then, the passage counts as wide.
    pub most_asked: usize,
}

impl PassageTuning {
    /// The numbers the method is tested with.
    pub(crate) const DEFAULT: Self = Self {
        wedged: 0.5,
        front: 60,
        spacings: [0.25, 0.0625],
        ahead: 6.0,
        beside: 2.0,
        most_asked: 400_000,
    };
}

impl Default for PassageTuning {
    fn default() -> Self {
        Self::DEFAULT
    }
}
