//! Twist and rest curvature of one element: the part of its energy that sees material frames.
//!
//! Instruments that share the centre line share its geometry, each turned against it by an angle of its own. In the first node's triad
//! the energy depends on the chord, on the far tangent, and on (φ₀, φ₁, b) of every instrument, φ₁ = θ₁ + reference twist: local
//! unknowns, of which energies and derivatives are sums over Gauss points and instruments; at a point the twist of the reference triad, its
//! derivatives and what they are multiplied with, the sum of torques, are those of all instruments. Then comes the chain rule. Turns of either
//! tangent move all local unknowns, and every φ₁ by the same; displacements move the chord alone and angles themselves. So it needs
//! products with four columns, not with all unknowns, and is gone through once, however many instruments there are.

use super::element::{ElementData, ElementState, ElementSystem, Energy, Material, angles};
use super::frame::Frame;
use super::layout::{Layout, MAX_ANGLES};
use super::quadrature::GAUSS;
use super::torsion::{PointDerivatives, ReferenceTwist};
use crate::Vec3;
use crate::products::{outer, product, times, transposed_times};
use nalgebra::Matrix3;

/// Derivatives in the chord and the far tangent, both in the first triad.
#[derive(Clone, Copy, Default)]
struct ShapeDerivatives {
    chord: Vec3,
    end: Vec3,
    chord_chord: Matrix3<f64>,
    chord_end: Matrix3<f64>,
    end_end: Matrix3<f64>,
}

/// Derivatives in (φ₀, φ₁, b) of one instrument.
#[derive(Clone, Copy, Default)]
struct AngleDerivatives {
    angles: Vec3,
    chord_angles: Matrix3<f64>,
    end_angles: Matrix3<f64>,
    angles_angles: Matrix3<f64>,
}

/// What a unit turn of a tangent changes: chord and far tangent, and the reference twist.
#[derive(Clone, Copy)]
struct Turn {
    chord: Vec3,
    end: Vec3,
    twist: f64,
}

/// The element's geometry in its first triad.
struct Geometry {
    chord: Vec3,
    end: Vec3,
    /// u and v of the second triad.
    across: [Vec3; 2],
    /// 1/(1 + t₀·t₁).
    closeness: f64,
    /// Rates of the reference twist in turns of the first tangent, …
    near: [f64; 2],
    /// … and of the second.
    far: [f64; 2],
}

impl Geometry {
    #[inline(always)]
    fn new(s: &ElementState) -> Self {
        let (f0, f1) = (&s.first, &s.second);
        let (chord, end) = (f0.local(&s.chord), f0.local(&f1.t));
        let across = [f0.local(&f1.u), f0.local(&f1.v)];
        let closeness = 1.0 / (1.0 + end.x);
        // K = t₀ × t₁/(1 + t₀·t₁): the reference twist turns by K·(turn of either tangent).
        let k = Vec3::new(0.0, -end.z * closeness, end.y * closeness);
        Self { chord, end, across, closeness, near: [k.y, k.z], far: across.map(|w| k.dot(&w)) }
    }

    /// Turns of the first tangent along u and v, and of the second.
    #[inline(always)]
    fn turns(&self) -> [Turn; 4] {
        let swing = |w: &Vec3, a: usize| {
            if a == 0 { Vec3::new(w.y, -w.x, 0.0) } else { Vec3::new(w.z, 0.0, -w.x) }
        };
        let near = |a| Turn { chord: swing(&self.chord, a), end: swing(&self.end, a), twist: self.near[a] };
        let far = |a: usize| Turn { chord: Vec3::zeros(), end: self.across[a], twist: self.far[a] };
        [near(0), near(1), far(0), far(1)]
    }
}

/// Adds twist and rest curvature of all instruments that have angles.
#[inline]
pub(super) fn add_torsion<const C: usize, const HESSIAN: bool>(
    data: &ElementData,
    s: &ElementState,
    out: &mut ElementSystem<C>,
    energy: &mut Energy,
) {
    let l = Layout::<C>;
    if !data.materials[..Layout::<C>::ANGLES].iter().any(Material::is_present) {
        return;
    }
    let geometry = Geometry::new(s);
    let mut shape = ShapeDerivatives::default();
    let mut spins = [AngleDerivatives::default(); MAX_ANGLES];
    for k in 0..GAUSS.len() {
        add_point::<C>(k, data, s, &geometry, &mut shape, &mut spins, energy);
    }
    for material in data.materials[..Layout::<C>::ANGLES].iter().filter(|material| material.is_present()) {
        energy.bend += material.rest_energy(data.length);
    }
    let ih = 1.0 / data.length;
    // From the first triad back to space.
    let axes = Matrix3::from_columns(&[s.first.t, s.first.u, s.first.v]);
    let turns = geometry.turns();
    let force = times(&axes, &shape.chord) * ih;
    for i in 0..3 {
        out.gradient[l.position(0) + i] -= force[i];
        out.gradient[l.position(1) + i] += force[i];
    }
    // The torque at the second node turns with the reference twist.
    let mut torque = 0.0;
    for (set, spin) in spins.iter().enumerate().take(Layout::<C>::ANGLES) {
        for (i, row) in angle_rows::<C>(set).into_iter().enumerate() {
            out.gradient[row] += spin.angles[i];
        }
        torque += spin.angles[1];
    }
    for (d, row) in turns.iter().zip(turn_rows::<C>()) {
        out.gradient[row] += shape.chord.dot(&d.chord) + shape.end.dot(&d.end) + torque * d.twist;
    }
    if HESSIAN {
        add_displacements(&axes, ih, &shape, &spins, out);
        add_turns(&axes, ih, &shape, &spins, &turns, out);
        add_curvature(&s.first, &geometry, &shape, torque, ih, out);
    }
}

/// Rows of the turns of both tangents.
#[inline(always)]
const fn turn_rows<const C: usize>() -> [usize; 4] {
    let l = Layout::<C>;
    [l.tangent(0), l.tangent(0) + 1, l.tangent(1), l.tangent(1) + 1]
}

/// Rows of (θ₀, θ₁, b).
#[inline(always)]
const fn angle_rows<const C: usize>(set: usize) -> [usize; 3] {
    let l = Layout::<C>;
    [l.angle(0, set), l.angle(1, set), l.bubble(0, set)]
}

/// Adds the energy of all instruments at a Gauss point, and its derivatives in chord, far tangent and angles.
#[inline(always)]
fn add_point<const C: usize>(
    k: usize,
    data: &ElementData,
    s: &ElementState,
    geometry: &Geometry,
    shape: &mut ShapeDerivatives,
    spins: &mut [AngleDerivatives; MAX_ANGLES],
    energy: &mut Energy,
) {
    let point = &GAUSS[k];
    let (y, z) = point.derivatives(&geometry.chord, &Vec3::x(), &geometry.end);
    let twist = ReferenceTwist::new(&y, &z);
    let (weight, slope) = (Vec3::from(point.phi), Vec3::from(point.dphi));
    let ([yc, _, ye], [zc, _, ze]) = (point.y, point.z);
    let in_chord = |p: &Vec3, q: &Vec3| p * yc + q * zc;
    let in_end = |p: &Vec3, q: &Vec3| p * ye + q * ze;
    // The gradient of the twist, of which all stiffness against it is a multiple of the square.
    let (tc, te) = (in_chord(&twist.along_y, &twist.along_z), in_end(&twist.along_y, &twist.along_z));
    let (mut torques, mut stiffness) = (0.0, 0.0);
    let mut f = PointDerivatives::default();
    for set in 0..Layout::<C>::ANGLES {
        let material = &data.materials[set];
        if !material.is_present() {
            continue;
        }
        let input = material.torsion_input(k, data.length);
        let (phi, dphi) = angles(&s.angles[set], point);
        let torque = twist.torque(dphi, &input);
        energy.twist += twist.energy(dphi, &input);
        torques += torque;
        stiffness += input.stiffness;
        let spin = &mut spins[set];
        let stiff = slope * input.stiffness;
        spin.chord_angles += outer(&tc, &stiff);
        spin.end_angles += outer(&te, &stiff);
        spin.angles += slope * torque;
        spin.angles_angles += outer(&slope, &stiff);
        if input.moment != [0.0; 2] {
            let (bend, own) = twist.add_rest_curvature(phi, input.moment, &mut f);
            energy.bend += bend;
            spin.chord_angles += outer(&in_chord(&own.along_y, &own.along_z), &weight);
            spin.end_angles += outer(&in_end(&own.along_y, &own.along_z), &weight);
            spin.angles += weight * own.first;
            spin.angles_angles += outer(&weight, &weight) * own.second;
        }
    }
    twist.add_twist(torques, &mut f);
    shape.chord += in_chord(&f.gy, &f.gz);
    shape.end += in_end(&f.gy, &f.gz);
    let (hyz, hzy) = (f.hyz, f.hyz.transpose());
    let both = hyz + hzy;
    let (stiff_chord, stiff_end) = (tc * stiffness, te * stiffness);
    shape.chord_chord += outer(&stiff_chord, &tc) + (f.hyy * (yc * yc) + both * (yc * zc));
    shape.chord_end += outer(&stiff_chord, &te) + (f.hyy * (yc * ye) + hyz * (yc * ze) + hzy * (zc * ye));
    shape.end_end += outer(&stiff_end, &te) + (f.hyy * (ye * ye) + both * (ye * ze));
}

/// Adds the Hessian in displacements and angles.
#[inline(always)]
fn add_displacements<const C: usize>(
    axes: &Matrix3<f64>,
    ih: f64,
    shape: &ShapeDerivatives,
    spins: &[AngleDerivatives; MAX_ANGLES],
    out: &mut ElementSystem<C>,
) {
    let l = Layout::<C>;
    let (x0, x1) = (l.position(0), l.position(1));
    let stiffness = product(&product(axes, &shape.chord_chord), &axes.transpose()) * (ih * ih);
    for i in 0..3 {
        for j in 0..3 {
            out.rows[x0 + i][x1 + j] -= stiffness[(i, j)];
            if j >= i {
                out.rows[x0 + i][x0 + j] += stiffness[(i, j)];
                out.rows[x1 + i][x1 + j] += stiffness[(i, j)];
            }
        }
    }
    for (set, spin) in spins.iter().enumerate().take(Layout::<C>::ANGLES) {
        let rows = angle_rows::<C>(set);
        let [angle0, angle1, bubble] = rows;
        let crossed = product(axes, &spin.chord_angles) * ih;
        for i in 0..3 {
            for j in 0..3 {
                out.rows[x0 + i][rows[j]] -= crossed[(i, j)];
            }
            // θ₀ and b stand before x₁, θ₁ behind it.
            out.rows[angle0][x1 + i] += crossed[(i, 0)];
            out.rows[x1 + i][angle1] += crossed[(i, 1)];
            out.rows[bubble][x1 + i] += crossed[(i, 2)];
        }
        let own = &spin.angles_angles;
        for (i, j, value) in [
            (angle0, angle0, own[(0, 0)]),
            (angle0, angle1, own[(0, 1)]),
            (angle0, bubble, own[(0, 2)]),
            (angle1, angle1, own[(1, 1)]),
            (bubble, angle1, own[(1, 2)]),
            (bubble, bubble, own[(2, 2)]),
        ] {
            out.rows[i][j] += value;
        }
    }
}

/// Adds the Hessian in turns of the tangents, and in turns and everything else.
#[inline(always)]
fn add_turns<const C: usize>(
    axes: &Matrix3<f64>,
    ih: f64,
    shape: &ShapeDerivatives,
    spins: &[AngleDerivatives; MAX_ANGLES],
    turns: &[Turn; 4],
    out: &mut ElementSystem<C>,
) {
    let l = Layout::<C>;
    let (x0, x1) = (l.position(0), l.position(1));
    let rows = turn_rows::<C>();
    for (a, (d, &row)) in turns.iter().zip(&rows).enumerate() {
        // The Hessian times what the turn changes.
        let mut chord = times(&shape.chord_chord, &d.chord) + times(&shape.chord_end, &d.end);
        let mut end = transposed_times(&shape.chord_end, &d.chord) + times(&shape.end_end, &d.end);
        let mut twist = 0.0;
        for (set, spin) in spins.iter().enumerate().take(Layout::<C>::ANGLES) {
            chord += spin.chord_angles.column(1) * d.twist;
            end += spin.end_angles.column(1) * d.twist;
            let angles = transposed_times(&spin.chord_angles, &d.chord)
                + transposed_times(&spin.end_angles, &d.end)
                + spin.angles_angles.column(1) * d.twist;
            twist += angles[1];
            for (i, angle) in angle_rows::<C>(set).into_iter().enumerate() {
                let (first, last) = if row < angle { (row, angle) } else { (angle, row) };
                out.rows[first][last] += angles[i];
            }
        }
        let pull = times(axes, &chord) * ih;
        for i in 0..3 {
            out.rows[x0 + i][row] -= pull[i];
            let (first, last) = if row < x1 { (row, x1 + i) } else { (x1 + i, row) };
            out.rows[first][last] += pull[i];
        }
        for b in a..4 {
            let q = &turns[b];
            out.rows[row][rows[b]] += chord.dot(&q.chord) + end.dot(&q.end) + twist * q.twist;
        }
    }
}

/// Adds the gradient times second derivatives of the local unknowns.
#[inline(always)]
fn add_curvature<const C: usize>(
    first: &Frame,
    geometry: &Geometry,
    shape: &ShapeDerivatives,
    torque: f64,
    ih: f64,
    out: &mut ElementSystem<C>,
) {
    let l = Layout::<C>;
    let (x0, t0, x1, t1) = (l.position(0), l.tangent(0), l.position(1), l.tangent(1));
    let Geometry { chord, end, across, closeness, near, far } = geometry;
    let (gc, gt) = (&shape.chord, &shape.end);
    for (w, gw) in [(chord, gc), (end, gt)] {
        let along = gw.dot(w);
        out.rows[t0][t0] += gw.z * w.z - along;
        out.rows[t0 + 1][t0 + 1] += gw.y * w.y - along;
        out.rows[t0][t0 + 1] -= 0.5 * (gw.y * w.z + gw.z * w.y);
    }
    let turn = [
        (first.u * gc.x - first.t * gc.y) * ih, // along u
        (first.v * gc.x - first.t * gc.z) * ih, // along v
    ];
    let bends = gt.dot(end);
    // t₀ + t₁ and u₀, v₀ in the first triad.
    let sum = Vec3::new(1.0 + end.x, end.y, end.z);
    let axes = [Vec3::y(), Vec3::z()];
    for a in 0..2 {
        for i in 0..3 {
            out.rows[x0 + i][t0 + a] -= turn[a][i];
            out.rows[t0 + a][x1 + i] += turn[a][i];
        }
        out.rows[t1 + a][t1 + a] -= bends;
        for b in 0..2 {
            let p = across[b];
            // −ω × p for ω along the turn of the first triad.
            let swing = if a == 0 { gt.x * p.y - gt.y * p.x } else { gt.x * p.z - gt.z * p.x };
            let twist =
                0.5 * closeness * (axes[a].dot(&sum.cross(&p)) - (near[a] * p.x + far[b] * end[1 + a]));
            out.rows[t0 + a][t1 + b] += swing + torque * twist;
            if b >= a {
                let half = 0.5 * closeness * torque;
                out.rows[t0 + a][t0 + b] -= half * (near[a] * end[1 + b] + near[b] * end[1 + a]);
                out.rows[t1 + a][t1 + b] -= half * (far[a] * p.x + far[b] * across[a].x);
            }
        }
    }
}
