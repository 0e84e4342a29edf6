//! The order of the unknowns, which makes the Newton matrix block tridiagonal.
//!
//! A rod carries k sets of material angles: none where nothing twists, one for each instrument with a shape or torque of its own where
//! several share the centre line ([`Material`](super::Material)). Node by node the unknowns are
//!
//!   b₁ … b_k, x (3), t (2), θ₁ … θ_k, N
//!
//! where N and the angle bubbles b belong to the element that **ends** at the node. A multiplier comes after every
//! unknown it constrains: an inextensible element has a zero on the diagonal of N, which is filled only by
//! eliminating both its nodes. (Putting N between its nodes would narrow the band by one and break the factorisation
//! of every clamped inextensible rod.) After the last node come six rows for the multipliers of end supports. Unused
//! rows (N and b of the first node, angles where their instrument has ended, supports that are absent) hold the
//! identity.

/// Number of unknowns of two neighbouring nodes without angles.
pub(crate) const PLAIN: usize = 12;
/// Number of unknowns of two neighbouring nodes with one set of angles.
pub(crate) const TWISTED: usize = 16;
/// Largest number of sets of angles.
pub(crate) const MAX_ANGLES: usize = 3;

/// Row numbers of the unknowns where two neighbouring nodes have `C` = 12 + 4k of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Layout<const C: usize>;

impl<const C: usize> Layout<C> {
    /// Number of sets of angles, k.
    pub(crate) const ANGLES: usize = (C - PLAIN) / 4;
    /// Unknowns per node.
    pub(crate) const BLOCK: usize = C / 2;

    /// Number of unknowns of a rod with `elements` elements, with the rows of end supports.
    pub(crate) const fn dimension(elements: usize) -> usize {
        Self::BLOCK * (elements + 2)
    }

    /// First of the three position unknowns of node `i`.
    #[inline]
    pub(crate) const fn position(self, i: usize) -> usize {
        Self::BLOCK * i + Self::ANGLES
    }

    /// First of the two tangent unknowns of node `i`; the first angle, where there is one, comes next.
    #[inline]
    pub(crate) const fn tangent(self, i: usize) -> usize {
        Self::BLOCK * i + Self::ANGLES + 3
    }

    /// The angle of node `i` in a `set` below k.
    #[inline]
    pub(crate) const fn angle(self, i: usize, set: usize) -> usize {
        Self::BLOCK * i + Self::ANGLES + 5 + set
    }

    /// The angle bubble of element `e` in a `set` below k.
    #[inline]
    pub(crate) const fn bubble(self, e: usize, set: usize) -> usize {
        Self::BLOCK * (e + 1) + set
    }

    /// The axial force of element `e`.
    #[inline]
    pub(crate) const fn tension(self, e: usize) -> usize {
        Self::BLOCK * (e + 2) - 1
    }

    /// First of the six rows of end supports: three of position, two of the tangent, one of the angle.
    #[inline]
    pub(crate) const fn support(self, elements: usize) -> usize {
        Self::BLOCK * (elements + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn every_place_is_taken_once<const C: usize>(angles: usize) {
        let l = Layout::<C>;
        assert_eq!(Layout::<C>::ANGLES, angles);
        let n = 3;
        let mut taken = vec![0; Layout::<C>::dimension(n)];
        let mut take =
            |first: usize, count: usize| taken[first..first + count].iter_mut().for_each(|t| *t += 1);
        for i in 0..=n {
            take(l.position(i), 3);
            take(l.tangent(i), 2);
            (0..angles).for_each(|set| take(l.angle(i, set), 1));
        }
        for e in 0..n {
            take(l.tension(e), 1);
            (0..angles).for_each(|set| take(l.bubble(e, set), 1));
        }
        take(l.support(n), 6);
        // Unused rows: b and N of the first node, and spare rows of the supports.
        let first = l.support(n);
        let spare = |row: usize| row < angles || row == Layout::<C>::BLOCK - 1 || row >= first + 6;
        assert!(taken.iter().enumerate().all(|(row, count)| *count == usize::from(!spare(row))), "{taken:?}");
    }

    #[test]
    fn every_unknown_has_a_place_of_its_own() {
        every_place_is_taken_once::<PLAIN>(0);
        every_place_is_taken_once::<TWISTED>(1);
        every_place_is_taken_once::<20>(2);
        every_place_is_taken_once::<24>(3);
    }
}
