//! The displacement of the vessel about its centre line: every cross-section moves with the line's point in it.
//!
//! On one run of the line u(X) = U(s(X), X), s being the section in which X lies, which moves and turns
//! ([`super::curve`]). Where runs meet, u is the mean of theirs,
//!
//! ```text
//! u(X) = Σ M_c U_c(s_c(X), X) / Σ M_c,    M_c = Σ Kᵢ over the samples i of run c
//! Kᵢ = aᵢ (1 − qᵢ²)³  for qᵢ < 1, else 0,    qᵢ = |X − cᵢ|/(ρ rᵢ),    aᵢ = (length of the sample)/rᵢ
//! ```
//!
//! with the vessel's radius rᵢ, which is smooth: a branch takes over where its trunk's samples are no longer felt.
//! Cells of space know the samples felt in them; where those are of one run, as in most, no kernel is computed.

use nalgebra::Matrix3;
use rustc_hash::FxHashMap;

use super::chains::Chain;
use super::curve::{self, Piece};
use super::spline::FELT;
use crate::Vec3;
use crate::products::outer;

/// ρ: a sample is felt within so many radii. Walls are a radius away, those of wide or flat sections up to two.
const REACH_RADII: f64 = 2.5;
/// Longest distance between samples, radii: some ten of them are felt at a place.
const SAMPLE_RADII: f64 = 0.5;
/// Samples go on straight beyond the vessel's ends for so many radii: devices leave through openings.
const BEYOND_RADII: f64 = 20.0;
/// Most cells that a sample is entered in along an axis: wide vessels beside narrow ones would fill many.
const MOST_CELLS: f64 = 12.0;

/// A sample of the centre line.
#[derive(Debug, Clone, Copy)]
struct Sample {
    place: Vec3,
    /// The run's direction there.
    along: Vec3,
    arc_mm: f64,
    chain: u32,
    reach_mm: f64,
    size: f64,
}

/// The samples of all runs, with those that are felt in each cell of space.
#[derive(Debug, Clone)]
pub(super) struct Samples {
    all: Vec<Sample>,
    cell_mm: f64,
    cells: FxHashMap<[i32; 3], Cell>,
}

/// A cell of space.
#[derive(Debug, Clone, Default)]
struct Cell {
    /// Samples felt in it, in ascending order.
    felt: Vec<u32>,
    /// Whether these are of one run.
    is_of_one: bool,
}

/// Of a point on one run: M, s, their derivatives, as far as they are wanted, and the run's curve there.
#[derive(Debug, Clone, Copy)]
struct OnChain {
    chain: usize,
    mass: f64,
    mass1: Vec3,
    mass2: Matrix3<f64>,
    arc_mm: f64,
    arc1: Vec3,
    arc2: Matrix3<f64>,
    curve: [Vec3; 4],
}

/// How many derivatives are wanted.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
enum Order {
    Value,
    First,
    Second,
}

impl Samples {
    pub(super) fn new(chains: &[Chain]) -> Self {
        let mut all = Vec::new();
        for (index, chain) in chains.iter().enumerate() {
            sample(chain, index as u32, &mut all);
        }
        let (least_mm, most_mm) = all.iter().fold((f64::INFINITY, 0.0f64), |(least, most), one: &Sample| {
            (least.min(one.reach_mm), most.max(one.reach_mm))
        });
        let cell_mm = least_mm.max(2.0 * most_mm / MOST_CELLS);
        let mut cells: FxHashMap<[i32; 3], Cell> = FxHashMap::default();
        for (index, one) in all.iter().enumerate() {
            let [low, high] =
                [-1.0, 1.0].map(|sign| cell_of(&one.place.add_scalar(sign * one.reach_mm), cell_mm));
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        if one.reaches([x, y, z], cell_mm) {
                            cells.entry([x, y, z]).or_default().felt.push(index as u32);
                        }
                    }
                }
            }
        }
        for cell in cells.values_mut() {
            let run = |index: u32| all[index as usize].chain;
            cell.is_of_one = cell.felt.iter().all(|index| run(*index) == run(cell.felt[0]));
        }
        Self { all, cell_mm, cells }
    }

    /// Calls `with` for each run near a point, in their order; the nearest sample's where none is near.
    #[inline]
    fn each_chain(&self, x: &Vec3, chains: &[Chain], order: Order, mut with: impl FnMut(&OnChain)) {
        let mut on = |mut sum: OnChain| {
            // The mean of what its samples say.
            (sum.arc_mm, sum.curve) = chains[sum.chain].curve.place(x, sum.arc_mm / sum.mass);
            if order > Order::Value {
                sum.arc1 = curve::slope(x, &sum.curve);
            }
            if order > Order::First {
                sum.arc2 = curve::bend(x, &sum.curve);
            }
            with(&sum);
        };
        let Some(here) = self.cells.get(&cell_of(x, self.cell_mm)) else {
            return on(OnChain::alone(self.nearest(x), x));
        };
        if here.is_of_one {
            return on(OnChain::alone(&self.all[here.felt[here.felt.len() / 2] as usize], x));
        }
        let mut sum: Option<OnChain> = None;
        for index in &here.felt {
            let one = &self.all[*index as usize];
            let off = x - one.place;
            let square = off.norm_squared() / (one.reach_mm * one.reach_mm);
            if square >= 1.0 {
                continue;
            }
            if let Some(done) = sum.take_if(|sum| sum.chain != one.chain as usize) {
                on(done);
            }
            sum.get_or_insert_with(|| OnChain::none(one)).add(one, &off, square, order);
        }
        match sum {
            Some(done) => on(done),
            None => on(OnChain::alone(self.nearest(x), x)),
        }
    }

    /// The sample nearest to a point, in reaches.
    fn nearest(&self, x: &Vec3) -> &Sample {
        let off = |one: &Sample| (x - one.place).norm_squared() / (one.reach_mm * one.reach_mm);
        self.all.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(&self.all[0])
    }

    /// The material point at x, if one run alone is felt at it, given one nearby.
    #[inline]
    pub(super) fn material(&self, x: &Vec3, nearby: &Vec3, of: Displaced<'_>) -> Option<Vec3> {
        let here = self.cells.get(&cell_of(nearby, self.cell_mm)).filter(|cell| cell.is_of_one)?;
        let one = &self.all[here.felt[here.felt.len() / 2] as usize];
        let chain = one.chain as usize;
        let material = of.chains[chain].curve.material(x, one.arc_near(nearby), |s| of.at(chain, s));
        let there = self.cells.get(&cell_of(&material, self.cell_mm))?;
        let is_same = there.is_of_one && self.all[there.felt[0] as usize].chain == one.chain;
        is_same.then_some(material)
    }

    /// u at a material point, with the coefficients of each run one after the other, from the first of each run on, mm.
    pub(super) fn displacement_mm(&self, x: &Vec3, of: Displaced<'_>) -> Vec3 {
        let (mut mass, mut sum) = (0.0, Vec3::zeros());
        self.each_chain(x, of.chains, Order::Value, |on| {
            mass += on.mass;
            sum += of.moved(on, x).value * on.mass;
        });
        sum / mass
    }

    /// u, mm, and ∂u/∂X.
    pub(super) fn with_gradient(&self, x: &Vec3, of: Displaced<'_>) -> (Vec3, Matrix3<f64>) {
        let (mut mass, mut mass1) = (0.0, Vec3::zeros());
        let (mut sum, mut sum1) = (Vec3::zeros(), Matrix3::zeros());
        self.each_chain(x, of.chains, Order::First, |on| {
            let moved = of.moved(on, x);
            mass += on.mass;
            mass1 += on.mass1;
            sum += moved.value * on.mass;
            sum1 += outer(&moved.value, &on.mass1) + moved.gradient(on) * on.mass;
        });
        let u = sum / mass;
        (u, (sum1 - outer(&u, &mass1)) / mass)
    }

    /// ∂u/∂X and ∂²uₖ/∂X², added to those of a field: F and its bends.
    pub(super) fn add_local(
        &self,
        x: &Vec3,
        of: Displaced<'_>,
        f: &mut Matrix3<f64>,
        second: &mut [Matrix3<f64>; 3],
    ) {
        let (mut mass, mut mass1, mut mass2) = (0.0, Vec3::zeros(), Matrix3::zeros());
        let (mut sum, mut sum1) = (Vec3::zeros(), Matrix3::zeros());
        let mut sum2 = [Matrix3::zeros(); 3];
        self.each_chain(x, of.chains, Order::Second, |on| {
            let moved = of.moved(on, x);
            let (w, w1) = (moved.value, moved.gradient(on));
            mass += on.mass;
            mass1 += on.mass1;
            mass2 += on.mass2;
            sum += w * on.mass;
            sum1 += outer(&w, &on.mass1) + w1 * on.mass;
            let along = outer(&on.arc1, &on.arc1);
            for (k, of) in sum2.iter_mut().enumerate() {
                let mixed = outer(&on.mass1, &w1.row(k).transpose());
                let turned = outer(&(moved.w1 * -moved.c2[k] - moved.w2 * moved.c1[k]), &on.arc1);
                let own = along * moved.by_arc2[k] + on.arc2 * moved.by_arc[k] + turned + turned.transpose();
                *of += on.mass2 * w[k] + mixed + mixed.transpose() + own * on.mass;
            }
        });
        let u = sum / mass;
        let u1 = (sum1 - outer(&u, &mass1)) / mass;
        *f += u1;
        for (k, of) in second.iter_mut().enumerate() {
            let across = outer(&u1.row(k).transpose(), &mass1);
            *of += (sum2[k] - across - across.transpose() - mass2 * u[k]) / mass;
        }
    }

    /// How each coefficient moves a material point: its number with W, and with the matrix P for which P δ is the gradient
    /// of g·W δ in the point, g being this vector.
    ///
    /// On one run W = B I − B′ c′ ρᵀ, and
    ///
    /// ```text
    /// P = ∇s [B′ g − (B″ c′ + B′ c″)·g ρ + B′ (c′·g) c′]ᵀ − B′ (c′·g) I
    /// ```
    pub(super) fn weights(
        &self,
        x: &Vec3,
        g: &Vec3,
        (chains, firsts): (&[Chain], &[usize]),
    ) -> Vec<(usize, [Matrix3<f64>; 2])> {
        let (mut mass, mut mass1, mut all) = (0.0, Vec3::zeros(), Vec::new());
        self.each_chain(x, chains, Order::First, |on| {
            let basis = chains[on.chain].spline.at(on.arc_mm);
            let [c, c1, c2, _] = on.curve;
            let rho = x - c;
            let (along, bent) = (c1.dot(g), c2.dot(g));
            let turns = outer(&c1, &rho);
            mass += on.mass;
            mass1 += on.mass1;
            all.extend((0..FELT).map(|k| {
                let [b, b1, b2, _] = [0, 1, 2, 3].map(|order| basis.derivatives[order][k]);
                let weight = Matrix3::identity() * b - turns * b1;
                let by_arc = g * b1 - rho * (b2 * along + b1 * bent) + c1 * (b1 * along);
                let by_place = outer(&on.arc1, &by_arc) - Matrix3::identity() * (b1 * along);
                let by_place = by_place * on.mass + outer(&on.mass1, &weight.tr_mul(g));
                (firsts[on.chain] + basis.first + k, [weight * on.mass, by_place])
            }));
        });
        for (_, [weight, by_place]) in &mut all {
            *weight /= mass;
            *by_place = (*by_place - outer(&mass1, &weight.tr_mul(g))) / mass;
        }
        all
    }
}

/// The displacements of all runs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Displaced<'a> {
    pub(super) chains: &'a [Chain],
    /// The polynomials of w, run by run, and the first of each run.
    pub(super) pieces: &'a [Piece],
    pub(super) firsts: &'a [usize],
}

impl Displaced<'_> {
    /// w and its derivatives in arc length on a run.
    #[inline]
    fn at(&self, chain: usize, s_mm: f64) -> [Vec3; 4] {
        let span = self.chains[chain].spline.piece(s_mm);
        self.pieces[self.firsts[chain] + span].at(s_mm)
    }

    /// How a run moves a point: U = w − c′ q with q = w′·ρ, q_s = w″·ρ − w′·c′, q_ss = w‴·ρ − 2 w″·c′ − w′·c″.
    #[inline]
    fn moved(&self, on: &OnChain, x: &Vec3) -> MovedBy {
        let [c, c1, c2, c3] = on.curve;
        let [w, w1, w2, w3] = self.at(on.chain, on.arc_mm);
        let rho = x - c;
        let (q, q1) = (w1.dot(&rho), w2.dot(&rho) - w1.dot(&c1));
        let q2 = w3.dot(&rho) - 2.0 * w2.dot(&c1) - w1.dot(&c2);
        MovedBy {
            value: w - c1 * q,
            by_arc: w1 - c2 * q - c1 * q1,
            by_arc2: w2 - c3 * q - c2 * (2.0 * q1) - c1 * q2,
            c1,
            c2,
            w1,
            w2,
        }
    }
}

/// U of a run at a point, its derivatives in arc length, and what those in the point follow from.
struct MovedBy {
    value: Vec3,
    by_arc: Vec3,
    by_arc2: Vec3,
    c1: Vec3,
    c2: Vec3,
    w1: Vec3,
    w2: Vec3,
}

impl MovedBy {
    /// ∂U/∂X, through s and beside it.
    #[inline]
    fn gradient(&self, on: &OnChain) -> Matrix3<f64> {
        outer(&self.by_arc, &on.arc1) - outer(&self.c1, &self.w1)
    }
}

impl Sample {
    /// Whether it is felt anywhere in a cell.
    fn reaches(&self, cell: [i32; 3], cell_mm: f64) -> bool {
        let low = Vec3::from(cell.map(|part| f64::from(part) * cell_mm));
        let nearest = self.place.zip_map(&low, |part, low| part.clamp(low, low + cell_mm));
        (nearest - self.place).norm() <= self.reach_mm
    }

    /// Estimate of s at a point.
    fn arc_near(&self, x: &Vec3) -> f64 {
        self.arc_mm + self.along.dot(&(x - self.place))
    }
}

impl OnChain {
    /// Nothing yet of the run of a sample.
    fn none(one: &Sample) -> Self {
        let (zero, zeros) = (Vec3::zeros(), Matrix3::zeros());
        Self {
            chain: one.chain as usize,
            mass: 0.0,
            mass1: zero,
            mass2: zeros,
            arc_mm: 0.0,
            arc1: zero,
            arc2: zeros,
            curve: [zero; 4],
        }
    }

    /// The only run near a point, that of a sample.
    fn alone(one: &Sample, x: &Vec3) -> Self {
        Self { mass: 1.0, arc_mm: one.arc_near(x), ..Self::none(one) }
    }

    /// Adds a sample at q².
    #[inline]
    fn add(&mut self, one: &Sample, off: &Vec3, square: f64, order: Order) {
        let left = 1.0 - square;
        let mass = one.size * left * left * left;
        self.mass += mass;
        self.arc_mm += mass * (one.arc_mm + one.along.dot(off));
        if order == Order::Value {
            return;
        }
        let by_square = 2.0 / (one.reach_mm * one.reach_mm);
        let slope = -3.0 * one.size * left * left * by_square;
        self.mass1 += off * slope;
        if order == Order::First {
            return;
        }
        let bend = 6.0 * one.size * left * by_square * by_square;
        self.mass2 += outer(off, off) * bend + Matrix3::identity() * slope;
    }
}

fn cell_of(x: &Vec3, cell_mm: f64) -> [i32; 3] {
    [x.x, x.y, x.z].map(|part| (part / cell_mm).floor() as i32)
}

/// Adds the samples of a run, and those beyond its ends that are the vessel's.
fn sample(chain: &Chain, index: u32, into: &mut Vec<Sample>) {
    let length_mm = chain.length_mm();
    let one = |place: Vec3, along: Vec3, (arc_mm, piece_mm): (f64, f64), radius_mm: f64| Sample {
        place,
        along,
        arc_mm,
        chain: index,
        reach_mm: REACH_RADII * radius_mm,
        size: piece_mm / radius_mm,
    };
    let mut beyond = |end: usize, next: usize, arc_mm: f64, sign: f64| {
        let radius_mm = chain.radii_mm[end];
        let out = (chain.points[end] - chain.points[next]).normalize();
        let piece_mm = SAMPLE_RADII * radius_mm;
        let count = (BEYOND_RADII / SAMPLE_RADII) as usize;
        into.extend((0..count).map(|k| {
            let off_mm = (k as f64 + 0.5) * piece_mm;
            let place = chain.points[end] + out * off_mm;
            one(place, out * sign, (arc_mm + sign * off_mm, piece_mm), radius_mm)
        }));
    };
    let last = chain.points.len() - 1;
    if chain.off.is_none() {
        beyond(0, 1, 0.0, -1.0);
    }
    beyond(last, last - 1, length_mm, 1.0);
    for k in 0..last {
        let (from, to) = (chain.points[k], chain.points[k + 1]);
        let (radius_mm, next_mm) = (chain.radii_mm[k], chain.radii_mm[k + 1]);
        let piece_mm = chain.arcs_mm[k + 1] - chain.arcs_mm[k];
        let count = (piece_mm / (SAMPLE_RADII * radius_mm.min(next_mm))).ceil().max(1.0);
        into.extend((0..count as usize).map(|i| {
            let part = (i as f64 + 0.5) / count;
            let arc_mm = chain.arcs_mm[k] + part * piece_mm;
            let radius_mm = radius_mm + part * (next_mm - radius_mm);
            one(from + (to - from) * part, (to - from).normalize(), (arc_mm, piece_mm / count), radius_mm)
        }));
    }
}
