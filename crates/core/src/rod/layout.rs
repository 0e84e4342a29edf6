//! The order of the unknowns, which makes the Newton matrix block tridiagonal.
//!
//! Node by node: without twist x (3), t (2), N — with it b, x (3), t (2), θ, N — where N and b belong to the element
//! that **ends** at the node. A multiplier comes after every unknown it constrains: an inextensible element has
//! a zero on the diagonal of N, and only elimination of both its nodes fills it. (Putting N between its nodes would
//! narrow the band by one and break the factorisation of every clamped inextensible rod.) After the last node come six
//! rows for the multipliers of end supports. Rows without meaning (N and b of the first node, supports that are absent)
//! hold the identity.

/// Unknowns of two neighbouring nodes without twist.
pub const PLAIN: usize = 12;
/// Unknowns of two neighbouring nodes with twist.
pub const TWISTED: usize = 16;

/// Places of the unknowns where two neighbouring nodes have `C`: [`PLAIN`] or [`TWISTED`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout<const C: usize>;

impl<const C: usize> Layout<C> {
    /// Whether there are angles.
    pub const TWIST: bool = C > PLAIN;
    /// Unknowns a node.
    pub const BLOCK: usize = C / 2;
    /// Place of the position among the unknowns of a node.
    pub(super) const X: usize = if Self::TWIST { 1 } else { 0 };

    /// Number of unknowns of a rod with `elements` elements, with the rows of end supports.
    pub const fn dimension(elements: usize) -> usize {
        Self::BLOCK * (elements + 2)
    }

    /// First of the three position unknowns of node `i`.
    #[inline]
    pub const fn position(self, i: usize) -> usize {
        Self::BLOCK * i + Self::X
    }

    /// First of the two tangent unknowns of node `i`.
    #[inline]
    pub const fn tangent(self, i: usize) -> usize {
        Self::BLOCK * i + Self::X + 3
    }

    /// The angle of node `i`; only with twist.
    #[inline]
    pub const fn angle(self, i: usize) -> usize {
        Self::BLOCK * i + Self::X + 5
    }

    /// The angle bubble of element `e`; only with twist.
    #[inline]
    pub const fn bubble(self, e: usize) -> usize {
        Self::BLOCK * (e + 1)
    }

    /// The axial force of element `e`.
    #[inline]
    pub const fn tension(self, e: usize) -> usize {
        Self::BLOCK * (e + 2) - 1
    }

    /// First of the six rows of end supports: three of position, two of the tangent, one of the angle.
    #[inline]
    pub const fn support(self, elements: usize) -> usize {
        Self::BLOCK * (elements + 1)
    }
}
