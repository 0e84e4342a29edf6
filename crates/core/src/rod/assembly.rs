//! Assembly of the banded Newton system.
//!
//! With c the elongations, D the axial flexibilities and N the axial forces, the equilibrium equations are
//!
//!   r(q) + Cᵀ N = 0,   c(q) − D N = 0,   C = ∂c/∂q,
//!
//! and Newton's step solves [K Cᵀ; C −D](dq, dN) = −(r, c). Along the rod K alone has no stiffness (bending energy
//! does not depend on stretch) and an inextensible element has D = 0, so without pivoting that matrix has no LDLᵀ.
//! Adding γCᵀ times the second row to the first, and writing dN = m/(1 − γD), gives the symmetric system
//!
//!   [K + γCᵀC, Cᵀ; C, −D/(1 − γD)](dq, m) = −(r + γCᵀc, c)
//!
//! with the same dq: an augmentation of the linear algebra, not of the mechanics. Its inertia distinguishes minima from saddle
//! points just as that of the first form does.

use super::batch::MOST;
use super::element::{ElementData, ElementSystem, Energy};
use super::lagrangian::{beside, element_system, system};
use super::lanes::Lanes;
use super::layout::Layout;
use super::state::RodState;
use crate::banded::{BandMatrix, Shift};
use crate::coupled::Couplings;
use pulp::{Arch, Scalar, Simd, WithSimd, bytemuck};

/// A rank-one addition p qᵀ to the matrix that is not symmetric: loads that follow the rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RankOne {
    /// First of the three consecutive rows of p.
    pub(crate) row: usize,
    /// Its entries.
    pub(crate) p: [f64; 3],
    /// First of the three consecutive columns of q.
    pub(crate) column: usize,
    /// Its entries.
    pub(crate) q: [f64; 3],
}

/// Matrix, residual and energy at one state. External energies are added through its [`Stencils`](super::Stencils).
#[derive(Debug, Clone)]
pub(crate) struct Assembly<const C: usize> {
    /// The augmented matrix.
    pub(crate) matrix: BandMatrix<C>,
    /// Blocks of the matrix outside its band, which couple nodes in contact.
    pub(crate) couplings: Couplings<C>,
    /// Gradient of the Lagrangian; in the rows of N, c − D N; in support rows, the gaps.
    pub(crate) residual: Vec<f64>,
    /// γCᵀ(c − D N), added to the residual in the right-hand side.
    pub(crate) correction: Vec<f64>,
    /// Elastic energy of the rod.
    pub(crate) energy: Energy,
    /// Energy of everything outside the rod.
    pub(crate) external_energy: f64,
    /// Unsymmetric additions to the matrix.
    pub(crate) rank_ones: Vec<RankOne>,
    /// Largest force and moment an element exerts on a node: the scale of the residual.
    pub(crate) scale: [f64; 2],
    /// Whether the matrix is assembled as well as the residual. If not, it stays empty.
    pub(crate) hessian: bool,
}

impl<const C: usize> Assembly<C> {
    /// Allocates for a rod of `elements` elements.
    pub(crate) fn new(elements: usize) -> Self {
        let n = Layout::<C>::dimension(elements);
        Self {
            matrix: BandMatrix::zeros(n),
            couplings: Couplings::default(),
            residual: vec![0.0; n],
            correction: vec![0.0; n],
            energy: Energy::default(),
            external_energy: 0.0,
            rank_ones: Vec::with_capacity(32),
            scale: [0.0; 2],
            hessian: true,
        }
    }

    /// For the forces alone of a rod of `elements` elements.
    pub(crate) fn forces(elements: usize) -> Self {
        let n = Layout::<C>::dimension(elements);
        let nothing = Self::new(0);
        Self { residual: vec![0.0; n], correction: vec![0.0; n], hessian: false, ..nothing }
    }

    /// Changes the size without releasing memory.
    pub(crate) fn resize(&mut self, elements: usize) {
        let n = Layout::<C>::dimension(elements);
        self.matrix.resize(n);
        self.residual.resize(n, 0.0);
        self.correction.resize(n, 0.0);
    }

    /// Clears everything and adds the rod's elements.
    pub(crate) fn assemble(&mut self, elements: &[ElementData], state: &RodState) {
        if self.hessian {
            self.matrix.begin_blocks();
            self.couplings.clear();
        }
        self.residual.fill(0.0);
        self.correction.fill(0.0);
        self.energy = Energy::default();
        self.external_energy = 0.0;
        self.rank_ones.clear();
        self.scale = [0.0; 2];
        if !self.hessian {
            return Arch::new().dispatch(AddElements::<C, false> { to: self, elements, state });
        }
        Arch::new().dispatch(AddElements::<C, true> { to: self, elements, state });
        let l = Layout::<C>;
        // Unused rows hold the identity.
        self.matrix.add(Layout::<C>::BLOCK - 1, Layout::<C>::BLOCK - 1, 1.0);
        for set in 0..Layout::<C>::ANGLES {
            self.matrix.add(set, set, 1.0);
        }
        self.add_absent(elements);
        let first = l.support(elements.len());
        for row in first + 6..first + Layout::<C>::BLOCK {
            self.matrix.add(row, row, 1.0);
        }
    }

    /// Slope of the energy, constraints included, along a step.
    pub(crate) fn slope(&self, step: &[f64]) -> f64 {
        let l = Layout::<C>;
        let elements = self.residual.len() / Layout::<C>::BLOCK - 2;
        let mut slope = 0.0;
        for i in 0..l.support(elements) {
            slope += self.residual[i] * step[i];
        }
        for e in 0..elements {
            let row = l.tension(e);
            slope -= self.residual[row] * step[row];
        }
        slope
    }

    /// Holds the angles of instruments that have ended: they have no meaning.
    fn add_absent(&mut self, elements: &[ElementData]) {
        let l = Layout::<C>;
        if Layout::<C>::ANGLES == 0 {
            return;
        }
        for (e, data) in elements.iter().enumerate() {
            for set in (0..Layout::<C>::ANGLES).filter(|set| !data.materials[*set].is_present()) {
                self.matrix.add(l.bubble(e, set), l.bubble(e, set), 1.0);
                // The instrument may begin behind a gap, in the next rod.
                let begins = data.is_break()
                    && elements.get(e + 1).is_some_and(|next| next.materials[set].is_present());
                if !begins {
                    self.matrix.add(l.angle(e + 1, set), l.angle(e + 1, set), 1.0);
                }
            }
        }
    }

    /// Sets `shift` to ∫|δr′|² (and ∫δθ²) of a rod whose rows in `held` are held: the stiffness of a uniform unit
    /// tension. It removes negative curvature due to compression, the commonest kind. It also acts across the gap
    /// between two rods, so that the shift keeps an unsupported rod in place.
    pub(crate) fn unit_shift(elements: &[ElementData], held: &[Option<usize>], shift: &mut Shift) {
        let l = Layout::<C>;
        shift.reset(Layout::<C>::dimension(elements.len()));
        for (e, data) in elements.iter().enumerate() {
            let across = 1.5 / data.length;
            let along = 0.5 * data.length;
            for a in 0..3 {
                let (p, q) = (l.position(e) + a, l.position(e + 1) + a);
                shift.diagonal[p] += across;
                shift.diagonal[q] += across;
                shift.next[p] -= across;
            }
            for i in [e, e + 1] {
                for a in 0..2 {
                    shift.diagonal[l.tangent(i) + a] += along;
                }
                for set in 0..Layout::<C>::ANGLES {
                    shift.diagonal[l.angle(i, set)] += along;
                }
            }
            for set in 0..Layout::<C>::ANGLES {
                shift.diagonal[l.bubble(e, set)] += along;
            }
        }
        for row in held.iter().flatten() {
            shift.diagonal[*row] = 0.0;
            shift.next[*row] = 0.0;
        }
    }
}

/// Adds the elements of a rod to its assembly, several lanes at once.
pub(super) struct AddElements<'a, const C: usize, const HESSIAN: bool> {
    pub(super) to: &'a mut Assembly<C>,
    pub(super) elements: &'a [ElementData],
    pub(super) state: &'a RodState,
}

impl<const C: usize, const HESSIAN: bool> WithSimd for AddElements<'_, C, HESSIAN> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { to, elements, state } = self;
        let mut all = ElementSystem::<C, S::f64s>::filled(simd.splat_f64s(0.0));
        for first in (0..elements.len()).step_by(S::F64_LANES) {
            let (batch, count) = beside::<S, C>(simd, elements, state, first);
            let mut gammas = [0.0; MOST];
            for lane in 0..count {
                gammas[lane] = elements[first + lane].augmentation();
            }
            system::<S, C, HESSIAN>(&batch, Lanes::gather(simd, |lane| gammas[lane]), &mut all);
            for lane in 0..count {
                if elements[first + lane].is_break() {
                    to.add_break::<HESSIAN>(first + lane);
                } else if elements[first + lane].tilt.is_some() {
                    to.add_rim::<HESSIAN>(first + lane, &elements[first + lane], state, gammas[lane]);
                } else {
                    to.add_lane::<S, HESSIAN>(first + lane, lane, gammas[lane], &all);
                }
            }
        }
    }
}

impl<const C: usize> Assembly<C> {
    /// Adds nothing at the gap between two rods: its axial force does not exist, so its row is held.
    #[inline(always)]
    fn add_break<const HESSIAN: bool>(&mut self, e: usize) {
        if HESSIAN {
            let at = Layout::<C>::BLOCK * e;
            self.matrix.lay_blocks(at, |i, j| f64::from(u8::from(i == j && i == C - 1)));
        }
    }

    /// Adds element `e`, in which there is play: it is computed alone.
    #[inline(never)]
    fn add_rim<const HESSIAN: bool>(&mut self, e: usize, data: &ElementData, state: &RodState, gamma: f64) {
        let mut own = ElementSystem::<C>::zeros();
        element_system::<C, HESSIAN>(data, &state.element::<C>(e), gamma, &mut own);
        self.add_lane::<Scalar, HESSIAN>(e, 0, gamma, &own);
    }

    /// Adds element `e`, which is in this lane of `all`.
    #[inline(always)]
    fn add_lane<S: Simd, const HESSIAN: bool>(
        &mut self,
        e: usize,
        lane: usize,
        gamma: f64,
        all: &ElementSystem<C, S::f64s>,
    ) {
        let l = Layout::<C>;
        let lanes = S::F64_LANES;
        let of = |list: &[S::f64s; C], i: usize| bytemuck::cast_slice::<_, f64>(list)[i * lanes + lane];
        let Energy { bend, twist, axial } = all.energy;
        let [bend, twist, axial] =
            [bend, twist, axial].map(|kind| bytemuck::cast_slice::<_, f64>(&[kind])[lane]);
        self.energy.add(&Energy { bend, twist, axial });
        let g = |i: usize| of(&all.gradient, i);
        let (x, t) = (l.position(0), l.tangent(0));
        let force = g(x).abs().max(g(x + 1).abs()).max(g(x + 2).abs());
        let moment = g(t).abs().max(g(t + 1).abs());
        self.scale = [self.scale[0].max(force), self.scale[1].max(moment)];
        let at = Layout::<C>::BLOCK * e;
        let gap = gamma * g(C - 1);
        let (residual, correction) = (&mut self.residual[at..at + C], &mut self.correction[at..at + C]);
        for i in 0..C {
            residual[i] += g(i);
            correction[i] += gap * of(&all.stretch, i);
        }
        if HESSIAN {
            self.matrix.lay_blocks(at, |i, j| of(&all.rows[i], j));
        }
    }
}
