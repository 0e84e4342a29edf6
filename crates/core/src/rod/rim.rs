//! An element that begins at the end of another instrument, in which what goes on tilts ([`super::play`]).
//!
//! The centre line has a kink at the element's first node: behind it lies the tangent t₀, with the node's triad (t₀, u, v), and beyond
//! it a tangent p of its own. Bending beyond takes p, and everything else (twist, rest curvature, elongation, contact) the smooth
//! cubic from t₀; what rest curvature lacks for that is in W. With B the bending energy of a straight element ([`super::bending`]),
//!
//! ```text
//! E(x₀, t₀, x₁, t₁, θ₀) = min over p of  B(x₀, p, x₁, t₁) + W(ψ, θ₀),    ψ = (p·u, p·v)
//! ```
//!
//! p belongs to this element alone, so it is eliminated here: two unknowns, by Newton's method from p = t₀, and no unknown of the rod is
//! added. The sum is convex in p for kinks of less than a right angle, so there is one minimum. There, by the envelope theorem, the gradient is that at fixed
//! p, and with β the turns of p along the axes e₁, e₂ across it, and z all others,
//!
//! ```text
//! H = H_zz − H_zβ H_ββ⁻¹ H_βz
//! ```
//!
//! The derivatives of ψ follow from how triads move (`Frame::transported`): with α the turns of t₀,
//!
//! ```text
//! ∂ψᵢ/∂βₐ = eₐ·uᵢ,   ∂ψᵢ/∂αⱼ = −δᵢⱼ p·t₀,   ∂²ψᵢ/∂βₐ∂βᵦ = −δₐᵦ ψᵢ,   ∂²ψᵢ/∂αᵢ∂βₐ = −eₐ·t₀
//! ∂²ψᵢ/∂αᵢ² = −ψᵢ,   ∂²ψᵢ/∂α₁∂α₂ = −½ψⱼ (j the other one)
//! ```
//!
//! ψ is the sine of the kink and not the angle: 0.4 % at 0.15 rad, less than what the small deflections of W leave out. The elongation of
//! the smooth cubic makes the element's chord shorter by ψ²/12 of its length, 0.01 mm in 5, which counts by the bending energy of its whole curvature:
//! a hundredth of that at 0.15 rad. Both vanish with its length.

use super::element::{ElementData, ElementState, ElementSystem, Energy};
use super::frame::Frame;
use super::lagrangian::{element_energy, element_system};
use super::layout::{Layout, MAX_ANGLES, PLAIN};
use super::play::{KinkEnergy, Tilt};
use crate::Vec3;

/// Largest number of iterations for p; four to eight are enough.
const ITERATIONS: usize = 40;
/// Largest turn of p in one of them, rad.
const LARGEST_TURN: f64 = 0.5;
/// A turn after which the next one is below rounding.
const LAST_TURN: f64 = 1e-8;
/// Number of unknowns other than p, with all sets of angles.
const OTHERS: usize = 10 + MAX_ANGLES;

/// An element with its kink.
struct Kinked {
    /// A triad at p.
    beyond: Frame,
    kink: [f64; 2],
    /// B, W and their derivatives.
    bent: ElementSystem<PLAIN>,
    held: KinkEnergy,
}

/// The element without what is in [`bent`].
fn soft(data: &ElementData) -> ElementData {
    ElementData { bending: [0.0; 3], tilt: None, ..*data }
}

/// The element's bending alone.
fn bent(data: &ElementData) -> ElementData {
    ElementData { length: data.length, bending: data.bending, ..ElementData::EMPTY }
}

impl Kinked {
    /// Finds p; `None` without play.
    fn of(data: &ElementData, s: &ElementState) -> Option<Self> {
        let tilt = data.tilt?;
        let data = bent(data);
        let mut at = Self::at(&data, &tilt, s, s.first);
        for _ in 0..ITERATIONS {
            let (gradient, hessian) = at.derivatives(s);
            let Some(inverse) = inverse(&hessian) else { break };
            let mut step = [0, 1].map(|a| -(inverse[a][0] * gradient[0] + inverse[a][1] * gradient[1]));
            let size = libm::hypot(step[0], step[1]);
            if size > LARGEST_TURN {
                step = step.map(|part| part * LARGEST_TURN / size);
            }
            let slope = gradient[0] * step[0] + gradient[1] * step[1];
            let before = at.value();
            let mut part = 1.0;
            let mut next = Self::at(&data, &tilt, s, at.beyond.transported(step[0], step[1]));
            // Near the minimum values do not differ by more than their rounding.
            while next.value() > before + 1e-4 * part * slope + 1e-12 * before.abs()
                && part > 1e-6
                && size > 1e-5
            {
                part *= 0.5;
                let turned = at.beyond.transported(part * step[0], part * step[1]);
                next = Self::at(&data, &tilt, s, turned);
            }
            at = next;
            if size < LAST_TURN {
                break;
            }
        }
        Some(at)
    }

    fn at(data: &ElementData, tilt: &Tilt, s: &ElementState, beyond: Frame) -> Self {
        let kink = [beyond.t.dot(&s.first.u), beyond.t.dot(&s.first.v)];
        let mut system = ElementSystem::zeros();
        element_system::<PLAIN, true>(data, &bent_state(s, beyond), 0.0, &mut system);
        Self { beyond, kink, bent: system, held: tilt.energy(kink, s.angles.map(|[first, ..]| first)) }
    }

    fn value(&self) -> f64 {
        self.bent.energy.bend + self.held.value
    }

    /// ∂ψᵢ/∂βₐ, by i.
    fn ways(&self, s: &ElementState) -> [[f64; 2]; 2] {
        let axes = [self.beyond.u, self.beyond.v];
        [s.first.u, s.first.v].map(|across| axes.map(|axis| axis.dot(&across)))
    }

    /// Gradient and Hessian in the turns β of p.
    fn derivatives(&self, s: &ElementState) -> ([f64; 2], [[f64; 2]; 2]) {
        let (ways, held, l) = (self.ways(s), &self.held, Layout::<PLAIN>);
        let at = |a: usize| l.tangent(0) + a;
        let gradient = [0, 1]
            .map(|a| self.bent.gradient[at(a)] + held.first[0] * ways[0][a] + held.first[1] * ways[1][a]);
        let back = held.first[0] * self.kink[0] + held.first[1] * self.kink[1];
        let mut hessian = [[0.0; 2]; 2];
        for a in 0..2 {
            for b in 0..2 {
                let mut sum = self.bent.rows[at(a.min(b))][at(a.max(b))];
                for i in 0..2 {
                    for j in 0..2 {
                        sum += ways[i][a] * held.second[i][j] * ways[j][b];
                    }
                }
                hessian[a][b] = if a == b { sum - back } else { sum };
            }
        }
        (gradient, hessian)
    }
}

/// The state of the straight element beyond the kink.
fn bent_state(s: &ElementState, beyond: Frame) -> ElementState {
    ElementState { first: beyond, tension: 0.0, angles: [[0.0; 3]; MAX_ANGLES], ..*s }
}

/// Inverse of a symmetric positive definite matrix.
fn inverse([[a, b], [c, d]]: &[[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let determinant = a * d - b * c;
    let is_positive = determinant > 0.0 && a + d > 0.0;
    is_positive.then(|| [[d / determinant, -b / determinant], [-c / determinant, a / determinant]])
}

/// The state of what goes on beyond the end: its tangent there is that beyond the kink; and the kink's tilt φ. `None` without play.
pub(crate) fn beyond(data: &ElementData, s: &ElementState) -> Option<(ElementState, f64)> {
    let kinked = Kinked::of(data, s)?;
    let tilt = data.tilt.map_or(0.0, |tilt| tilt.tilt(kinked.kink));
    // Carried by the smallest rotation, the triad keeps what angles are counted from.
    Some((ElementState { first: s.first.transported_to(&kinked.beyond.t), ..*s }, tilt))
}

/// Energy of an element with play; `None` without.
pub(super) fn rim_energy<const C: usize>(data: &ElementData, s: &ElementState) -> Option<Energy> {
    let kinked = Kinked::of(data, s)?;
    let mut energy = element_energy::<C>(&soft(data), s);
    energy.bend += kinked.value();
    Some(energy)
}

/// The element's Lagrangian with derivatives, as [`element_system`] has it without play.
pub(super) fn rim_system<const C: usize, const HESSIAN: bool>(
    data: &ElementData,
    s: &ElementState,
    gamma: f64,
    out: &mut ElementSystem<C>,
) {
    element_system::<C, HESSIAN>(&soft(data), s, gamma, out);
    let Some(kinked) = Kinked::of(data, s) else { return };
    out.energy.bend += kinked.value();
    let (l, plain) = (Layout::<C>, Layout::<PLAIN>);
    // Rows of the others: x₀, α, x₁, t₁ and the angles at the end; where the straight element has them; and the two of p.
    let sets = Layout::<C>::ANGLES;
    let mut rows = [0; OTHERS];
    let mut of_bent = [None; OTHERS];
    for a in 0..3 {
        (rows[a], of_bent[a]) = (l.position(0) + a, Some(plain.position(0) + a));
        (rows[5 + a], of_bent[5 + a]) = (l.position(1) + a, Some(plain.position(1) + a));
    }
    for a in 0..2 {
        rows[3 + a] = l.tangent(0) + a;
        (rows[8 + a], of_bent[8 + a]) = (l.tangent(1) + a, Some(plain.tangent(1) + a));
    }
    (0..sets).for_each(|set| rows[10 + set] = l.angle(0, set));
    let count = 10 + sets;
    let (held, kink) = (&kinked.held, kinked.kink);
    let along = kinked.beyond.t.dot(&s.first.t);
    for k in 0..count {
        out.gradient[rows[k]] += match (of_bent[k], k) {
            (Some(row), _) => kinked.bent.gradient[row],
            (None, 3 | 4) => -along * held.first[k - 3],
            _ => held.angles[k - 10].0[0],
        };
    }
    if !HESSIAN {
        return;
    }
    let ways = kinked.ways(s);
    let axes: [Vec3; 2] = [kinked.beyond.u, kinked.beyond.v];
    let back = axes.map(|axis| axis.dot(&s.first.t));
    let bent_at = |row: usize, column: usize| kinked.bent.rows[row.min(column)][row.max(column)];
    // Mixed with the turns of p.
    let mut mixed = [[0.0; 2]; OTHERS];
    for k in 0..count {
        for a in 0..2 {
            mixed[k][a] = match (of_bent[k], k) {
                (Some(row), _) => bent_at(row, plain.tangent(0) + a),
                (None, 3 | 4) => {
                    let i = k - 3;
                    let across = held.second[i][0] * ways[0][a] + held.second[i][1] * ways[1][a];
                    -held.first[i] * back[a] - along * across
                }
                _ => {
                    let rate = held.angles[k - 10].1;
                    rate[0] * ways[0][a] + rate[1] * ways[1][a]
                }
            };
        }
    }
    let Some(inverse) = inverse(&kinked.derivatives(s).1) else { return };
    let direct = |k: usize, m: usize| -> f64 {
        match (of_bent[k], of_bent[m]) {
            (Some(row), Some(column)) => return bent_at(row, column),
            (None, None) => {}
            _ => return 0.0,
        }
        let is_turn = |k: usize| k < 5;
        match (is_turn(k), is_turn(m)) {
            (true, true) => {
                let (i, j) = (k - 3, m - 3);
                let curved = if i == j {
                    -held.first[i] * kink[i]
                } else {
                    -0.5 * (held.first[0] * kink[1] + held.first[1] * kink[0])
                };
                curved + along * along * held.second[i][j]
            }
            (true, false) => -along * held.angles[m - 10].1[k - 3],
            (false, true) => -along * held.angles[k - 10].1[m - 3],
            (false, false) if k == m => held.angles[k - 10].0[1],
            (false, false) => 0.0,
        }
    };
    for k in 0..count {
        let solved = [0, 1].map(|a| inverse[a][0] * mixed[k][0] + inverse[a][1] * mixed[k][1]);
        for m in k..count {
            let value = direct(k, m) - (solved[0] * mixed[m][0] + solved[1] * mixed[m][1]);
            let (row, column) = (rows[k].min(rows[m]), rows[k].max(rows[m]));
            out.rows[row][column] += value;
        }
    }
}
