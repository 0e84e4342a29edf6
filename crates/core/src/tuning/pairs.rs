//! Numbers of contact of rods with themselves and each other.

/// How pairs of points in contact are sought, and what their gap is (`crate::contact::pairs`).
///
/// Distances in touching distances are relative to the sum of both radii.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairTuning {
    /// Largest distance between sites, in radii.
    pub spacing_radii: f64,
    /// Relative change of the radius between neighbouring elements above which the surface has a shoulder: elements of
    /// a taper differ by less.
    pub shoulder: f64,

    /// Pairs at a base are sought up to this many touching distances, more than a step may close.
    pub near: f64,
    /// They are sought up to this many before a trial that moves points so far that others may touch. No less than 2: a
    /// step approaches by at most half.
    pub known: f64,
    /// If nothing is nearer than this many touching distances, motions of up to `free` need no new search.
    pub clear: f64,
    /// Distance by which points may move since nothing was near, as a fraction of the touching distance. Below 0 every
    /// base is searched.
    pub free: f64,
    /// Tolerance, for rounding, by which a trial may exceed the safe fraction.
    pub beyond: f64,
    /// Largest number of halvings of an element before the bound of its distance from another is accepted: its remaining
    /// bulge is then below 10⁻⁴ of the original.
    pub splits: usize,

    /// Stiffness of the spring against which a site slides along its rod, relative to that of the distance. Sites at a
    /// crossing differ in depth by a fourth of it times their distance squared over that of the axes; arcs bent away
    /// from each other by more than it over that distance touch at their ends alone.
    pub slide: f64,
    /// Largest slide of a site, in touching distances.
    pub window: f64,
    /// Largest number of steps to the nearest points.
    pub descents: usize,
    /// Length of a step, in touching distances, after which the descent ends: the next would be its square.
    pub short: f64,
    /// Length of a step, in touching distances, within which the squared distance is nearly the parabola of Newton's
    /// step: rods bend little on a tenth of their thickness.
    pub parabolic: f64,
    /// From there the descent ends where even this many times the decrease that the step promises leaves the gap too
    /// wide. If infinite, it does not.
    pub promised: f64,
    /// Smallest Hessian of a minimum, as a fraction of the stiffness of straight lines.
    pub convex: f64,

    /// Two pairs of successive bases are the same if the nearest points of the stretch are within this distance, in
    /// touching distances. At 0 no force is remembered.
    pub same: f64,
    /// Two minima this close along the rod, in touching distances, are one.
    pub twice: f64,
}

impl PairTuning {
    /// The numbers the method is tested with.
    pub(crate) const DEFAULT: Self = Self {
        spacing_radii: 0.5,
        shoulder: 0.1,
        near: 1.5,
        known: 2.0,
        clear: 8.0,
        free: 0.75,
        beyond: 0.1,
        splits: 7,
        slide: 0.1,
        window: 2.0,
        descents: 40,
        short: 1e-7,
        parabolic: 0.1,
        promised: 4.0,
        convex: 1e-3,
        same: 2.0,
        twice: 1e-3,
    };
}

impl Default for PairTuning {
    fn default() -> Self {
        Self::DEFAULT
    }
}
