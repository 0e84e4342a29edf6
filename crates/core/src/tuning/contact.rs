//! Numbers of contact.

/// How contact with the wall and between loops is found and solved for (`contact/wall`, `contact/pairs`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactTuning {
    /// Penalty ρ of a contact force over the stiffness of the element. With a larger one points activate and release
    /// at smaller depths, with a smaller one at smaller forces.
    pub penalty: f64,
    /// Fraction of its clearance by which a point may move in one Newton step.
    pub safe: f64,
    /// A point whose axis is nearer to the wall than this fraction of its radius has sunk into it: the side of the
    /// wall follows from where it came from, and the nearest piece is sought along the wall, not through space.
    pub sunk: f64,
    /// Assumed bound of the distance's gradient: the smooth wall of a mesh is steeper than 1 near crests.
    pub steepest: f64,
    /// Increase of depth over the last equilibrium, as a fraction of the radius, from which a prediction is rejected.
    pub deeper: f64,
    /// Largest distance between sites on a loop, in radii.
    pub pair_spacing_radii: f64,
    /// Pairs at a base are sought up to this many touching distances, more than a step foresees.
    pub pair_near: f64,
    /// They are sought up to this many before a trial that moves points so far that others may touch: a step
    /// approaches by at most half.
    pub pair_known: f64,
    /// If nothing is nearer than this many touching distances, motions of up to `pair_free` of one need no new search.
    pub pair_clear: f64,
    /// Distance by which points may move since nothing was near, as a fraction of the touching distance.
    pub pair_free: f64,
    /// Two pairs of successive bases are the same if the nearest points of the stretch are within this distance, in
    /// touching distances.
    pub pair_same: f64,
    /// How far sites at a crossing slide: they differ in depth by a quarter of this times their distance squared over
    /// that of the axes.
    pub pair_slide: f64,
    /// Largest slide of a site, in touching distances.
    pub pair_window: f64,
}

impl ContactTuning {
    /// The numbers the method is tested with.
    pub const DEFAULT: Self = Self {
        penalty: 0.1,
        safe: 0.9,
        sunk: 0.3,
        steepest: 2.0,
        deeper: 0.3,
        pair_spacing_radii: 0.5,
        pair_near: 1.5,
        pair_known: 2.0,
        pair_clear: 8.0,
        pair_free: 0.75,
        pair_same: 2.0,
        pair_slide: 0.1,
        pair_window: 2.0,
    };
}

impl Default for ContactTuning {
    fn default() -> Self {
        Self::DEFAULT
    }
}
