//! Supports of the ends: the first node is held directly, the last one through multipliers.
//!
//! The first node is fixed unless it is entirely free; its tangent and angle are held or free. Conditions on the last
//! node are equations with multipliers, so the initial shape need not satisfy them and the multipliers are the
//! reactions. Their rows carry a flexibility far below that of the rod: it does not affect the result (each Newton
//! step removes the error of the last), but allows the factorisation of a rod that is held twice along its axis.

use super::assembly::Assembly;
use super::element::ElementData;
use super::layout::{Layout, MAX_ANGLES};
use super::state::RodState;
use crate::Vec3;

/// Flexibility of the end supports, as a fraction of the rod's own: above rounding, and so far below the permanent
/// shift that a shape which can turn freely between its supports still counts as neutral.
const SUPPORT_FLEXIBILITY: f64 = 1e-12;

/// Supports of both ends.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Supports {
    /// The first node is as free as any other.
    pub(crate) start_free: bool,
    /// The first node's tangent is held.
    pub start_tangent: bool,
    /// Whether the first node's angle of each set is held.
    pub start_angles: [bool; MAX_ANGLES],
    /// Directions (orthonormal) in which the last node's position is held; none to three.
    pub end_directions: Vec<Vec3>,
    /// The position at which it is held.
    pub end_position: Vec3,
    /// Tangent of the last node, if held.
    pub end_tangent: Option<Vec3>,
    /// First material direction d₁ of the last node and the angle it is held at, if held.
    pub(crate) end_angle: Option<EndAngle>,
    /// Multipliers: along the directions, about u and v of the end triad, about the tangent.
    pub(crate) multipliers: [f64; 6],
}

/// A held end angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct EndAngle {
    /// Direction d₁ at zero `turns`, across the end tangent.
    pub(crate) normal: Vec3,
    /// Further rotation about the tangent, any number of turns.
    pub(crate) turns: f64,
    /// The target angle against the current reference triad, whole turns included.
    pub(crate) target: f64,
}

impl Supports {
    /// Number of conditions at the last node.
    pub(crate) fn conditions(&self) -> usize {
        self.end_directions.len()
            + 2 * usize::from(self.end_tangent.is_some())
            + usize::from(self.end_angle.is_some())
    }

    /// Errors of the last node in each condition: three of position, two of the tangent, one of the angle.
    pub(crate) fn gaps(&self, state: &RodState) -> [f64; 6] {
        let mut gaps = [0.0; 6];
        let n = state.elements();
        for (j, q) in self.end_directions.iter().enumerate() {
            gaps[j] = q.dot(&(state.positions[n] - self.end_position));
        }
        if let Some(t) = &self.end_tangent {
            let (a, b) = state.frames[n].log(t);
            (gaps[3], gaps[4]) = (-a, -b);
        }
        if self.end_angle.is_some() {
            gaps[5] = state.angles[n] - self.angle_target(state);
        }
        gaps
    }

    /// The target end angle, on the branch nearest to the last one used.
    fn angle_target(&self, state: &RodState) -> f64 {
        let Some(end) = &self.end_angle else { return 0.0 };
        let frame = &state.frames[state.elements()];
        let frame = self.end_tangent.map_or(*frame, |t| frame.transported_to(&t));
        let angle = libm::atan2(frame.v.dot(&end.normal), frame.u.dot(&end.normal)) + end.turns;
        angle + ((end.target - angle) / std::f64::consts::TAU).round() * std::f64::consts::TAU
    }

    /// Chooses the branch of the end angle for an initial shape: the one nearest to `turns` beyond an untwisted rod.
    pub(crate) fn begin(&mut self, state: &RodState) {
        let n = state.elements();
        let untwisted = state.angles[0] - state.reference_twists.iter().sum::<f64>();
        if let Some(end) = &mut self.end_angle {
            end.target = untwisted + end.turns;
        }
        let target = self.angle_target(state);
        if let Some(end) = &mut self.end_angle {
            end.target = target;
        }
        debug_assert!(n > 0);
    }

    /// Updates the branch of the end angle after an accepted step.
    pub(crate) fn follow(&mut self, state: &RodState) {
        let target = self.angle_target(state);
        if let Some(end) = &mut self.end_angle {
            end.target = target;
        }
    }

    /// Adds the rows of the end conditions.
    pub(crate) fn add<const C: usize>(
        &self,
        elements: &[ElementData],
        state: &RodState,
        assembly: &mut Assembly<C>,
    ) {
        let l = Layout::<C>;
        let n = elements.len();
        let first = l.support(n);
        let gaps = self.gaps(state);
        let (mut forward, mut turning) = (0.0, 0.0);
        let scaling = if self.conditions() > 0 { elements } else { &[] };
        for data in scaling {
            forward += 1.0 / data.augmentation();
            turning += data.length / data.bending[1];
        }
        for j in 0..3 {
            if let Some(q) = self.end_directions.get(j) {
                for a in 0..3 {
                    assembly.matrix.add(l.position(n) + a, first + j, q[a]);
                    assembly.residual[l.position(n) + a] += self.multipliers[j] * q[a];
                }
                assembly.matrix.add(first + j, first + j, -SUPPORT_FLEXIBILITY * forward);
                assembly.residual[first + j] += gaps[j];
            } else {
                assembly.matrix.add(first + j, first + j, 1.0);
            }
        }
        for j in 3..5 {
            if self.end_tangent.is_some() {
                let row = l.tangent(n) + j - 3;
                assembly.matrix.add(row, first + j, 1.0);
                assembly.residual[row] += self.multipliers[j];
                assembly.matrix.add(first + j, first + j, -SUPPORT_FLEXIBILITY * turning);
                assembly.residual[first + j] += gaps[j];
            } else {
                assembly.matrix.add(first + j, first + j, 1.0);
            }
        }
        if Layout::<C>::ANGLES > 0 && self.end_angle.is_some() {
            assembly.matrix.add(l.angle(n, 0), first + 5, 1.0);
            assembly.residual[l.angle(n, 0)] += self.multipliers[5];
            assembly.matrix.add(first + 5, first + 5, -SUPPORT_FLEXIBILITY * turning);
            assembly.residual[first + 5] += gaps[5];
        } else {
            assembly.matrix.add(first + 5, first + 5, 1.0);
        }
    }

    /// Rows of the first node's unknowns that are held.
    pub(crate) fn held<const C: usize>(&self) -> [Option<usize>; 5 + MAX_ANGLES] {
        let l = Layout::<C>;
        let mut held = [None; 5 + MAX_ANGLES];
        if self.start_free {
            return held;
        }
        for (a, row) in held.iter_mut().enumerate().take(3) {
            *row = Some(l.position(0) + a);
        }
        if self.start_tangent {
            held[3] = Some(l.tangent(0));
            held[4] = Some(l.tangent(0) + 1);
        }
        for set in (0..Layout::<C>::ANGLES).filter(|set| self.start_angles[*set]) {
            held[5 + set] = Some(l.angle(0, set));
        }
        held
    }

    /// Holds the rows of the first node and clears their residual.
    pub(crate) fn hold<const C: usize>(&self, assembly: &mut Assembly<C>) {
        for row in self.held::<C>().into_iter().flatten() {
            if assembly.hessian {
                assembly.matrix.hold(row);
                assembly.couplings.hold(row);
            }
            assembly.residual[row] = 0.0;
            assembly.correction[row] = 0.0;
        }
    }
}
