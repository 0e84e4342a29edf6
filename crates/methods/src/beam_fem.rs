//! Incremental beam finite elements: Cotin, Duriez, Lenoir, Neumann and Dawson, *New approaches to catheter navigation for
//! interventional radiology simulation*, MICCAI 2005; Lenoir, Cotin, Duriez and Neumann, *Interactive physically-based simulation of
//! catheter and guidewire*, Computers & Graphics 30, 2006.
//!
//! A device is a chain of straight beam elements (Przemieniecki 1968), six degrees of freedom per node. Each element
//! is linear in a co-moving frame; in every increment the stiffness is assembled at the configuration of the last one
//! and
//!
//! ```text
//! K(U) ΔU = f − f_int(U),    U ← U + ΔU
//! ```
//!
//! is solved once for the block tridiagonal K (6×6 blocks, O(n)). The imbalance is carried over to the next
//! increment. Loads known in advance are applied in equal increments; increments without new load follow until
//! balance.
//!
//! # Limitations
//! The element's stiffness does not depend on its axial force. Where tension stiffens the device more than bending,
//! ΔU overshoots and the increments diverge, however small: on the cantilever of the reference cases beyond PL²/EI of
//! about 2.5, which is reported as no equilibrium. [`BeamFem::damped`] adds, unlike the papers, a viscous force on
//! the nodes over an increment, as later dynamic codes with the same element do; then it settles, and is compared
//! with the published method as `beam-fem-damped`. The elements stretch (EA = ratio·EI/h²).

use endowire_core::Vec3;
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector};

use crate::{Chain, NodalLoad, Outcome, Posture, RodModel, Strain};

type Block = SMatrix<f64, 6, 6>;
type Six = SVector<f64, 6>;

/// The method's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamFem {
    /// Number of increments of a load known in advance.
    pub increments: usize,
    /// Ratio of axial to bending stiffness, EA h²/EI.
    pub axial_ratio: f64,
    /// Viscous damping of the nodes over the time of one increment, in units of EI/L⁴ per length.
    pub damping: f64,
    /// Largest rotation of a node in one increment, rad.
    pub largest_turn_rad: f64,
    /// Largest number of increments in all.
    pub max_iterations: usize,
}

impl Default for BeamFem {
    /// As published: without damping.
    fn default() -> Self {
        Self {
            increments: 1,
            axial_ratio: 1000.0,
            damping: 0.0,
            largest_turn_rad: 1.0,
            max_iterations: 1_000,
        }
    }
}

impl BeamFem {
    /// With viscous damping, unlike the papers. See the [module docs](self).
    pub fn damped() -> Self {
        Self { damping: 80.0, ..Self::default() }
    }
}

impl RodModel for BeamFem {
    fn name(&self) -> &'static str {
        if self.damping > 0.0 { "beam-fem-damped" } else { "beam-fem" }
    }

    fn strain(&self, chain: &Chain, posture: &Posture) -> Strain {
        (0..chain.segments()).fold(Strain::default(), |sum, i| {
            let Element { length, bending, torsion, turns: [p, q], .. } =
                Element::new(self.axial_ratio, chain, posture, i);
            let bent = |p: f64, q: f64| 2.0 * bending / length * (p * p + p * q + q * q);
            let twist = q.x - p.x;
            Strain {
                bend_mj: sum.bend_mj + bent(p.y, q.y) + bent(p.z, q.z),
                twist_mj: sum.twist_mj + 0.5 * torsion / length * twist * twist,
                twist_rad: sum.twist_rad + twist,
            }
        })
    }

    fn relax(
        &self,
        chain: &Chain,
        load: &mut dyn NodalLoad,
        posture: &mut Posture,
        tolerance: f64,
    ) -> Outcome {
        let n = chain.segments();
        let allowed = tolerance * chain.force_unit() / n as f64;
        let increments = if load.is_dead() { self.increments } else { 1 };
        let damping = self.damping * chain.force_unit() / chain.length_mm().powi(2);
        let mut system = System::new(n);
        for iteration in 0..=self.max_iterations {
            let share = ((iteration + 1) as f64 / increments as f64).min(1.0);
            system.assemble(self.axial_ratio, chain, posture);
            let mut out_of_balance: f64 = 0.0;
            for i in 1..=n {
                let push = load.on(i, &posture.positions_mm[i]);
                let rhs = &mut system.residual[i - 1];
                for a in 0..3 {
                    rhs[a] += share * push.force_n[a];
                    // A moment is a force times the length of a segment.
                    out_of_balance =
                        out_of_balance.max(rhs[a].abs()).max(rhs[a + 3].abs() / chain.lengths_mm[i - 1]);
                }
                let length = 0.5 * (chain.lengths_mm[i - 1] + chain.lengths_mm.get(i).unwrap_or(&0.0));
                let damping = Matrix3::from_diagonal_element(damping * length);
                let wall = push.normal * push.normal.transpose() * push.stiffness_n_per_mm;
                let mut corner = system.diagonal[i - 1].fixed_view_mut::<3, 3>(0, 0);
                corner += wall + damping;
            }
            let done = share == 1.0 && out_of_balance <= allowed;
            if done || iteration == self.max_iterations || !system.solve() {
                return Outcome { iterations: iteration, converged: done };
            }
            self.update(&system.residual, load.trusted_mm(), posture);
        }
        unreachable!("the loop returns in its last round")
    }
}

impl BeamFem {
    fn update(&self, change: &[Six], trusted_mm: f64, posture: &mut Posture) {
        let largest = |row| change.iter().map(|u| u.fixed_rows::<3>(row).norm()).fold(0.0, f64::max);
        let scale = (self.largest_turn_rad / largest(3)).min(trusted_mm / largest(0)).min(1.0);
        for (i, u) in change.iter().enumerate() {
            posture.positions_mm[i + 1] += u.fixed_rows::<3>(0) * scale;
            let turn: Vec3 = u.fixed_rows::<3>(3) * scale;
            posture.frames[i + 1] = Rotation3::new(turn) * posture.frames[i + 1];
            posture.frames[i + 1].renormalize();
        }
    }
}

/// The smallest rotation that takes unit vector `a` to unit vector `b`.
pub(crate) fn smallest_rotation(a: &Vec3, b: &Vec3) -> Rotation3<f64> {
    let (axis, cosine) = (a.cross(b), a.dot(b));
    if cosine < -1.0 + 1e-12 {
        return Rotation3::identity();
    }
    let w = axis.cross_matrix();
    Rotation3::from_matrix_unchecked(Matrix3::identity() + w + w * w / (1.0 + cosine))
}

/// The rotation vector of a rotation by less than π, also if rounding has made it slightly non-orthogonal.
fn rotation_vector(rotation: &Rotation3<f64>) -> Vec3 {
    let m = rotation.matrix();
    let axis = Vec3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)]) * 0.5;
    let sine = axis.norm();
    if sine < 1e-12 { axis } else { axis * (sine.atan2(0.5 * (m.trace() - 1.0)) / sine) }
}

/// The block tridiagonal system of the nodes after the clamp.
struct System {
    diagonal: Vec<Block>,
    /// Rows of a node, columns of the next one.
    above: Vec<Block>,
    residual: Vec<Six>,
}

impl System {
    fn new(n: usize) -> Self {
        Self {
            diagonal: vec![Block::zeros(); n],
            above: vec![Block::zeros(); n],
            residual: vec![Six::zeros(); n],
        }
    }

    /// Stiffness and minus the internal forces.
    fn assemble(&mut self, axial_ratio: f64, chain: &Chain, posture: &Posture) {
        self.diagonal.fill(Block::zeros());
        self.residual.fill(Six::zeros());
        for i in 0..chain.segments() {
            let element = Element::new(axial_ratio, chain, posture, i);
            let [aa, ab, bb] = element.stiffness();
            let [fa, fb] = element.forces();
            self.diagonal[i] += bb;
            self.residual[i] -= fb;
            if i > 0 {
                self.diagonal[i - 1] += aa;
                self.above[i - 1] = ab;
                self.residual[i - 1] -= fa;
            }
        }
    }

    /// Solves in place; the residual is replaced by the increment. Returns false if the matrix is not positive
    /// definite.
    fn solve(&mut self) -> bool {
        let n = self.diagonal.len();
        for i in 0..n {
            let Some(factor) = self.diagonal[i].cholesky() else { return false };
            factor.solve_mut(&mut self.residual[i]);
            if i + 1 < n {
                // Becomes D⁻¹ U.
                let upper = self.above[i];
                factor.solve_mut(&mut self.above[i]);
                self.diagonal[i + 1] -= upper.transpose() * self.above[i];
                let before = upper.transpose() * self.residual[i];
                self.residual[i + 1] -= before;
            }
        }
        for i in (0..n.saturating_sub(1)).rev() {
            let beyond = self.above[i] * self.residual[i + 1];
            self.residual[i] -= beyond;
        }
        true
    }
}

/// One beam in its own frame.
struct Element {
    frame: Matrix3<f64>,
    length: f64,
    bending: f64,
    torsion: f64,
    axial: f64,
    tension: f64,
    /// Rotations of the two ends from their rest shape, in the frame.
    turns: [Vec3; 2],
}

impl Element {
    fn new(axial_ratio: f64, chain: &Chain, posture: &Posture, i: usize) -> Self {
        let h = chain.lengths_mm[i];
        let (a, b) = (&posture.frames[i], &posture.frames[i + 1]);
        let chord = posture.chord(i);
        let length = chord.norm();
        let middle = a * Rotation3::new(rotation_vector(&(a.inverse() * b)) * 0.5);
        let t: Vec3 = middle.matrix().column(0).into();
        let frame = smallest_rotation(&t, &(chord / length)) * middle;
        let [k1, k2] = chain.rest_curvature_per_mm[i];
        // Half of the rotation vector t × t′ of the rest shape.
        let rest = Vec3::new(0.0, -k2, k1) * (0.5 * h);
        let inverse = frame.inverse();
        let turns = [rotation_vector(&(inverse * a)) + rest, rotation_vector(&(inverse * b)) - rest];
        let axial = axial_ratio * chain.bending_nmm2[i] / (h * h);
        // The chord of an arc.
        let chord_at_rest = h * (1.0 - (k1 * k1 + k2 * k2) * h * h / 24.0);
        Self {
            frame: *frame.matrix(),
            length: h,
            bending: chain.bending_nmm2[i],
            torsion: chain.torsion_nmm2[i],
            axial,
            tension: axial * (length - chord_at_rest) / h,
            turns,
        }
    }

    /// Internal forces and moments on both nodes.
    fn forces(&self) -> [Six; 2] {
        let k = self.bending / self.length;
        let [p, q] = self.turns;
        let torque = self.torsion / self.length * (q.x - p.x);
        let (y, z) = (p.y + q.y, p.z + q.z);
        let shear = 6.0 * k / self.length;
        let force = self.frame * Vec3::new(self.tension, -shear * z, shear * y);
        let moment = |own: &Vec3, other: &Vec3, twist: f64| {
            let bend = |own: f64, other: f64| k * (4.0 * own + 2.0 * other);
            self.frame * Vec3::new(twist, bend(own.y, other.y), bend(own.z, other.z))
        };
        let join =
            |force: Vec3, moment: Vec3| Six::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);
        [join(-force, moment(&p, &q, -torque)), join(force, moment(&q, &p, torque))]
    }

    /// Blocks aa, ab and bb of the linear beam's stiffness.
    fn stiffness(&self) -> [Block; 3] {
        let (h, k) = (self.length, self.bending);
        let (s, c) = (12.0 * k / (h * h * h), 6.0 * k / (h * h));
        let xx = self.rotate(&Vec3::new(self.axial / h, s, s));
        // Deflection y is coupled to rotation z, deflection z to rotation −y.
        let coupling = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, c, 0.0, -c, 0.0);
        let xr = self.frame * coupling * self.frame.transpose();
        let near = self.rotate(&Vec3::new(self.torsion / h, 4.0 * k / h, 4.0 * k / h));
        let far = self.rotate(&Vec3::new(-self.torsion / h, 2.0 * k / h, 2.0 * k / h));
        [
            blocks(&xx, &xr, &xr.transpose(), &near),
            blocks(&-xx, &xr, &-xr.transpose(), &far),
            blocks(&xx, &-xr, &-xr.transpose(), &near),
        ]
    }

    fn rotate(&self, diagonal: &Vec3) -> Matrix3<f64> {
        self.frame * Matrix3::from_diagonal(diagonal) * self.frame.transpose()
    }
}

fn blocks(xx: &Matrix3<f64>, xr: &Matrix3<f64>, rx: &Matrix3<f64>, rr: &Matrix3<f64>) -> Block {
    let mut block = Block::zeros();
    block.fixed_view_mut::<3, 3>(0, 0).copy_from(xx);
    block.fixed_view_mut::<3, 3>(0, 3).copy_from(xr);
    block.fixed_view_mut::<3, 3>(3, 0).copy_from(rx);
    block.fixed_view_mut::<3, 3>(3, 3).copy_from(rr);
    block
}
