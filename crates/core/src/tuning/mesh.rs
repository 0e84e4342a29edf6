//! Numbers of a device's mesh.

/// Where elements and contact points of a device are (`methods/kirchhoff/mesh.rs`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshTuning {
    /// Largest angle by which the rest shape bends in an element, rad.
    pub largest_turn_rad: f64,
    /// Sections whose stiffnesses and radii differ by at most this fraction need no node between them.
    pub alike: f64,
    /// The same for rest curvatures: the angle by which their difference bends an element of the requested length, rad.
    pub alike_rad: f64,
    /// Spacing of contact points at the tip, in radii, from which it doubles: a tip that touches the wall at an angle
    /// leaves it within a tenth of its radius.
    pub tip_spacing_radii: f64,
    /// Smallest number of intervals between contact points in an element: a wire that is thick relative to its
    /// elements needs points within them too.
    pub fewest_intervals: f64,
}

impl MeshTuning {
    /// The numbers the method is tested with.
    pub(crate) const DEFAULT: Self = Self {
        largest_turn_rad: 0.5,
        alike: 0.25,
        alike_rad: 0.1,
        tip_spacing_radii: 1.0 / 256.0,
        fewest_intervals: 2.0,
    };
}

impl Default for MeshTuning {
    fn default() -> Self {
        Self::DEFAULT
    }
}
