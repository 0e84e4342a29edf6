//! Vessels that yield as a whole: a stiff wire straightens the artery in which it lies.
//!
//! The wall gives way locally, as an elastic foundation ([`crate::contact`]). In series with that the vessel's course
//! gives way: its centre line is a beam of bending stiffness B(s) on the support k(s) of the tissue around it, and
//! the points of the wall move and turn with the cross-section in which they lie ([`field`]). With the displacement w of the
//! centre line from its course at rest, the vessel stores
//!
//! ```text
//! V = Σ ½ ∫ (B |w″|² + k |w|²) ds + Σ ½ κ |w(s_t)|²
//! ```
//!
//! summed over the runs of the line and over tethers of stiffness κ: ostia and bones that hold it. All branches share
//! the displacement of the place where they part; a branch is hinged there. Runs end held, or free.
//!
//! # Discrete
//!
//! w(s) = Σ B_k(s) w_k on each run, with quintic B-splines ([`spline`]). The first coefficient of a branch is the
//! displacement of the run from which it comes, at that place; those of held ends are zero. The rest are the unknowns
//! a, three for each free coefficient, and
//!
//! ```text
//! V = ½ aᵀ A a,    ∂V/∂a = A a,    ∂²V/∂a² = A,    A = A₁ ⊗ I₃
//! ```
//!
//! with a constant scalar matrix A₁ that is positive definite, since k > 0: Gauss's rule with six points integrates
//! it exactly where B and k are constant. A force f on the wall at the material point X does the work f·Σ W_j(X) δa_j,
//! so in equilibrium with forces fᵢ at Xᵢ, W_j being the matrices by which unknowns move it,
//!
//! ```text
//! A a = Σ W(Xᵢ)ᵀ fᵢ
//! ```
//!
//! The compliance A₁⁻¹ is computed once: unknowns that no force reaches follow from it.
//!
//! # What it leaves out
//!
//! V is quadratic: B and k do not depend on the displacement, and a vessel that is bent in its rest shape is as stiff
//! as a straight one. It resists displacement along its axis by k alone, neither tension in life nor stretch
//! count. Cross-sections turn with the course to first order: where that turns by an angle α they become longer in its plane, by
//! 1/cos α, 6 % at 20°. Otherwise they keep their shape; muscle, and what lies between two vessels, are not modelled.
//!
//! A beam on a support: M. Hetényi, *Beams on Elastic Foundation*, 1946. Tissue around arteries as springs: P. Moireau
//! et al., Biomech. Model. Mechanobiol. 11 (2012).

mod chains;
mod curve;
mod field;
mod spec;
mod spline;
mod stiffness;
mod straightening;
#[cfg(test)]
mod tests;

pub use spec::{YieldingBranch, YieldingEnds, YieldingPreset, YieldingSpec, YieldingTether};
pub use straightening::{BeforeAfter, Landmark, Straightening, Stretch};

use std::sync::Arc;

use nalgebra::{DMatrix, Matrix3};

use super::{CentrelineTree, Displacement};
use crate::{Result, Vec3};
use chains::{Chain, chains};
use curve::Piece;
use field::{Displaced, Samples};
use stiffness::{Held, Properties};

/// The course of a vessel that yields.
#[derive(Debug)]
pub struct Course {
    spec: YieldingSpec,
    /// Named places of the undisplaced vessel, mm.
    places: Vec<(String, Vec3)>,
    chains: Vec<Chain>,
    /// The first coefficient of each run among all.
    firsts: Vec<usize>,
    /// Each coefficient as a sum of unknowns.
    of_unknowns: Vec<Vec<(usize, f64)>>,
    samples: Samples,
    /// A₁, N/mm, and its inverse, mm/N.
    stiffness: DMatrix<f64>,
    compliance: DMatrix<f64>,
}

impl Course {
    /// The course of a vessel with this centre line.
    ///
    /// # Errors
    /// As [`YieldingSpec::check`](spec::YieldingSpec), names of no target, and a vessel of too many unknowns.
    pub fn new(tree: &CentrelineTree, spec: &YieldingSpec) -> Result<Self> {
        let of_rows = spec.of_rows(tree)?;
        let chains = chains(tree, |rows| spec.span_mm(rows.iter().map(|row| &of_rows[*row])));
        let mut firsts = Vec::with_capacity(chains.len());
        let mut count = 0;
        for chain in &chains {
            firsts.push(count);
            count += chain.spline.count();
        }
        spec.check_size(count)?;
        let held = Held::of(tree, spec)?;
        let (of_unknowns, unknowns) = stiffness::unknowns(&chains, &firsts, &held);
        let of = Properties { rows: &of_rows, tethers: &held.tethers };
        let stiffness = stiffness::assemble(&chains, &firsts, (&of_unknowns, unknowns), &of);
        let compliance = stiffness::inverse(&stiffness)?;
        let samples = Samples::new(&chains);
        let spec = spec.clone();
        let places = tree.targets().iter();
        let places =
            places.map(|target| (target.name.clone(), tree.nodes()[target.row].position_mm)).collect();
        Ok(Self { spec, places, chains, firsts, of_unknowns, samples, stiffness, compliance })
    }

    /// What it was made from.
    pub fn spec(&self) -> &YieldingSpec {
        &self.spec
    }

    /// Named places of the undisplaced vessel, mm: the targets of its centre line.
    pub fn places(&self) -> &[(String, Vec3)] {
        &self.places
    }

    /// The displacement of a vessel whose course is displaced by these unknowns, mm, on top of its motion.
    pub fn displaced(self: &Arc<Self>, motion: Option<Displacement>, course_mm: &[Vec3]) -> Displacement {
        Displacement::with_course(motion, Bent::new(self, course_mm))
    }

    /// Bound of the displacement of any point of the vessel at these unknowns, mm.
    pub(crate) fn largest_mm(&self, course_mm: &[Vec3]) -> f64 {
        // Splines are means of their coefficients, and these of the unknowns.
        course_mm.iter().map(|by| by.norm()).fold(0.0, f64::max)
    }

    /// Number of unknowns, three numbers each.
    pub fn unknowns(&self) -> usize {
        self.stiffness.nrows()
    }

    /// A₁⁻¹ between two unknowns, mm/N.
    pub(crate) fn compliance(&self, i: usize, j: usize) -> f64 {
        self.compliance[(i, j)]
    }

    /// V, mJ.
    pub(crate) fn energy_mj(&self, amplitudes_mm: &[Vec3]) -> f64 {
        let each = amplitudes_mm.iter().zip(self.forces_n(amplitudes_mm));
        0.5 * each.map(|(a, force)| a.dot(&force)).sum::<f64>()
    }

    /// A a, N.
    pub(crate) fn forces_n(&self, amplitudes_mm: &[Vec3]) -> Vec<Vec3> {
        let row = |i: usize| {
            let each = amplitudes_mm.iter().enumerate();
            each.map(|(j, a)| a * self.stiffness[(i, j)]).sum::<Vec3>()
        };
        (0..self.unknowns()).map(row).collect()
    }

    /// A⁻¹ of forces on some of the unknowns, mm.
    pub(crate) fn yields_mm(&self, forces: &[(usize, Vec3)]) -> Vec<Vec3> {
        let at = |i: usize| forces.iter().map(|(j, force)| force * self.compliance[(i, *j)]).sum::<Vec3>();
        (0..self.unknowns()).map(at).collect()
    }

    /// At a material point of the undisplaced vessel: unknowns in ascending order, each with the matrix W by which it moves the
    /// point, and P, for which P δa is the gradient of `force`·W δa in the point.
    pub(crate) fn weights(&self, material: &Vec3, force: &Vec3) -> Vec<(usize, [Matrix3<f64>; 2])> {
        let of_all = self.samples.weights(material, force, (&self.chains, &self.firsts));
        let each = of_all.iter().flat_map(|(number, both)| {
            self.of_unknowns[*number]
                .iter()
                .map(move |(unknown, share)| (*unknown, both.map(|one| one * *share)))
        });
        let mut all: Vec<(usize, [Matrix3<f64>; 2])> = each.collect();
        if all.is_sorted_by(|one, next| one.0 < next.0) {
            return all;
        }
        all.sort_unstable_by_key(|(unknown, _)| *unknown);
        all.dedup_by(|later, kept| {
            let same = later.0 == kept.0;
            if same {
                kept.1[0] += later.1[0];
                kept.1[1] += later.1[1];
            }
            same
        });
        all
    }
}

/// The course of a vessel where it has been displaced.
#[derive(Debug, Clone)]
pub(crate) struct Bent {
    course: Arc<Course>,
    /// The polynomials of w on all runs, and the first of each.
    pieces: Arc<[Piece]>,
    firsts: Arc<[usize]>,
    amplitudes_mm: Arc<[Vec3]>,
    /// Estimate of the largest |∂u/∂X|.
    steepest: f64,
}

/// Derivatives of the field of a course reach this times the largest slope of a run: where the course bends, the inner
/// side is nearer together.
const OF_SLOPE: f64 = 1.5;
/// Ratios of lengths are bounded as for a vessel that is strained so much at the most.
const MOST_STEEP: f64 = 0.75;

impl Bent {
    /// The course at these displacements of its unknowns, mm.
    pub(crate) fn new(course: &Arc<Course>, amplitudes_mm: &[Vec3]) -> Self {
        let value = |shares: &Vec<(usize, f64)>| {
            shares.iter().map(|(unknown, share)| amplitudes_mm[*unknown] * *share).sum::<Vec3>()
        };
        let values_mm: Vec<Vec3> = course.of_unknowns.iter().map(value).collect();
        let (mut pieces, mut firsts, mut steepest) = (Vec::new(), Vec::new(), 0.0f64);
        for (chain, first) in course.chains.iter().zip(&course.firsts) {
            let own = &values_mm[*first..first + chain.spline.count()];
            firsts.push(pieces.len());
            chain.spline.pieces(own, &mut pieces);
            steepest = steepest.max(chain.spline.steepest(own));
        }
        Self {
            course: Arc::clone(course),
            pieces: pieces.into(),
            firsts: firsts.into(),
            amplitudes_mm: amplitudes_mm.into(),
            steepest: (OF_SLOPE * steepest).min(MOST_STEEP),
        }
    }

    fn displaced(&self) -> Displaced<'_> {
        Displaced { chains: &self.course.chains, pieces: &self.pieces, firsts: &self.firsts }
    }

    /// See [`MOST_STEEP`].
    pub(crate) fn steepest(&self) -> f64 {
        self.steepest
    }

    /// The material point at a place in space, given one nearby, if it is where one run alone is felt.
    #[inline]
    pub(crate) fn material(&self, place: &Vec3, nearby: &Vec3) -> Option<Vec3> {
        self.course.samples.material(place, nearby, self.displaced())
    }

    /// u, mm.
    pub(crate) fn displacement_mm(&self, material: &Vec3) -> Vec3 {
        self.course.samples.displacement_mm(material, self.displaced())
    }

    /// u, mm, and ∂u/∂X.
    pub(crate) fn with_gradient(&self, material: &Vec3) -> (Vec3, Matrix3<f64>) {
        self.course.samples.with_gradient(material, self.displaced())
    }

    /// Adds ∂u/∂X and ∂²uₖ/∂X².
    pub(crate) fn add_local(&self, material: &Vec3, f: &mut Matrix3<f64>, second: &mut [Matrix3<f64>; 3]) {
        self.course.samples.add_local(material, self.displaced(), f, second);
    }
}

impl PartialEq for Bent {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.course, &other.course) && self.amplitudes_mm == other.amplitudes_mm
    }
}
