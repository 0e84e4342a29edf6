//! Numbers of contact with the wall.

/// Where a device is evaluated against the wall, when a point counts as in contact, and how far it may move
/// ([`crate::contact`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactTuning {
    /// Distance from the wall, beyond its radius and as a fraction of it, within which a point is tracked.
    pub follow: f64,
    /// Distance, as a fraction of a point's radius, over which the piece of wall that was found is used again as the
    /// nearest or a close one. At 0 it is sought anew for every position.
    pub look_again: f64,
    /// Distance beyond the necessary reach up to which a point seeks the wall, mm: while it moves less, no new query is
    /// needed. For a point on the axis of a tube all triangles are at one distance, and a query that reaches them visits
    /// all: a small extra reach is enough.
    pub look_mm: f64,
    /// Number of times the radius of a search is multiplied before it becomes unlimited …
    pub farther: i32,
    /// … by this.
    pub farther_by: f64,

    /// Penalty of a contact, over the stiffness of its element. With a larger one contacts activate and release at
    /// smaller depths, with a smaller one at smaller forces.
    pub penalty: f64,
    /// Assumed bound of the gradient of the distance: the smooth wall of a mesh is steeper than 1 near crests.
    pub steepest: f64,
    /// Radius of the gentlest relevant bend, mm: the force and the moment of the softest piece bent to it are the least
    /// that others are compared with.
    pub gentlest_bend_mm: f64,

    /// Fraction of its clearance by which a point may move in one Newton step.
    pub safe: f64,
    /// A point whose axis is nearer to the wall than this fraction of its radius has sunk into it: the side of the wall
    /// follows from where it came from, and the nearest piece is sought along the wall, not through space. Far below 0
    /// none has.
    pub sunk: f64,
    /// Increase of depth over the last equilibrium, as a fraction of the radius, from which a prediction is rejected.
    pub deeper: f64,
}

impl ContactTuning {
    /// The numbers the method is tested with.
    pub(crate) const DEFAULT: Self = Self {
        follow: 0.5,
        look_again: 0.5,
        look_mm: 0.5,
        farther: 6,
        farther_by: 4.0,
        penalty: 0.1,
        steepest: 2.0,
        gentlest_bend_mm: 100.0,
        safe: 0.9,
        sunk: 0.3,
        deeper: 0.3,
    };
}

impl Default for ContactTuning {
    fn default() -> Self {
        Self::DEFAULT
    }
}
