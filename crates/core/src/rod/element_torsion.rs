//! Twist, rest curvature and skew stiffness of one element: the part of its energy that depends on material frames.
//!
//! Instruments that share the centre line share its geometry; each is turned against it by its own angle. In the
//! first node's triad the energy depends on the chord, the far tangent, and (φ₀, φ₁, b) of every instrument, φ₁ =
//! θ₁ + reference twist. In these local unknowns, energies and derivatives are sums over Gauss points and
//! instruments; at a Gauss point the twist of the reference triad, its derivatives, and their factor, the sum of the
//! torques, are common to all instruments. Then comes the chain rule. Turning either tangent changes all local
//! unknowns, and every φ₁ equally; displacements change the chord alone, and angles change themselves. So the chain
//! rule needs products with four columns instead of all unknowns, and is applied once for any number of instruments.

use super::batch::{Axes, Batch};
use super::element::{ElementSystem, Energy, angles};
use super::lanes::{Lanes, Matrix, Vector};
use super::layout::{Layout, MAX_ANGLES};
use super::quadrature::{GAUSS, Point};
use super::torsion::{AngleDensity, PointDerivatives, ReferenceTwist, Slope};
use pulp::Simd;

/// Derivatives in the chord and the far tangent, both in the first triad.
#[derive(Clone, Copy)]
struct ShapeDerivatives<S: Simd> {
    chord: Vector<S>,
    end: Vector<S>,
    chord_chord: Matrix<S>,
    chord_end: Matrix<S>,
    end_end: Matrix<S>,
}

/// Derivatives in (φ₀, φ₁, b) of one instrument. Mixed derivatives have a row per angle.
#[derive(Clone, Copy)]
struct AngleDerivatives<S: Simd> {
    angles: [Lanes<S>; 3],
    angles_chord: [Vector<S>; 3],
    angles_end: [Vector<S>; 3],
    /// Upper triangle.
    angles_angles: [[Lanes<S>; 3]; 3],
}

impl<S: Simd> ShapeDerivatives<S> {
    /// Adds the products of the gradients of the curvatures along d₁ and d₂ in the energy of a skew stiffness.
    #[inline(always)]
    fn add_square(&mut self, [p, q, c]: [Lanes<S>; 3], along: [Slope<S>; 2], [chord, end]: [(f64, f64); 2]) {
        let [first, second] = along;
        let (c1, e1) = (weighed(first.y, first.z, chord), weighed(first.y, first.z, end));
        let (c2, e2) = (weighed(second.y, second.z, chord), weighed(second.y, second.z, end));
        self.chord_chord += c1.outer(c1) * p + c2.outer(c2) * q + c1.outer(c2).with_transpose() * c;
        self.chord_end += c1.outer(e1) * p + c2.outer(e2) * q + (c1.outer(e2) + c2.outer(e1)) * c;
        self.end_end += e1.outer(e1) * p + e2.outer(e2) * q + e1.outer(e2).with_transpose() * c;
    }
}

impl<S: Simd> AngleDerivatives<S> {
    /// Adds derivatives in φ at a point, with the weights of the angles in φ, and of chord and far tangent in y and z.
    #[inline(always)]
    fn add(&mut self, own: &AngleDensity<S>, weight: &[f64; 3], [chord, end]: [(f64, f64); 2]) {
        let in_chord = weighed(own.along_y, own.along_z, chord);
        let in_end = weighed(own.along_y, own.along_z, end);
        for i in 0..3 {
            self.angles_chord[i] += in_chord * weight[i];
            self.angles_end[i] += in_end * weight[i];
            self.angles[i] += own.first * weight[i];
            for j in i..3 {
                self.angles_angles[i][j] += own.second * (weight[i] * weight[j]);
            }
        }
    }

    /// All zero.
    #[inline(always)]
    fn zeros(simd: S) -> Self {
        let (number, vector) = (Lanes::splat(simd, 0.0), Vector::splat(simd, [0.0; 3]));
        Self {
            angles: [number; 3],
            angles_chord: [vector; 3],
            angles_end: [vector; 3],
            angles_angles: [[number; 3]; 3],
        }
    }
}

/// Changes of chord, far tangent and reference twist by a unit turn of a tangent.
#[derive(Clone, Copy)]
struct Turn<S: Simd> {
    chord: Vector<S>,
    end: Vector<S>,
    twist: Lanes<S>,
}

/// The element's geometry in its first triad.
#[derive(Clone, Copy)]
struct Geometry<S: Simd> {
    chord: Vector<S>,
    end: Vector<S>,
    /// u and v of the second triad.
    across: [Vector<S>; 2],
    /// 1/(1 + t₀·t₁).
    closeness: Lanes<S>,
    /// Rates of the reference twist in turns of the first tangent.
    near: [Lanes<S>; 2],
    /// Rates of the reference twist in turns of the second tangent.
    far: [Lanes<S>; 2],
}

impl<S: Simd> Geometry<S> {
    #[inline(always)]
    fn new(s: &Batch<S>) -> Self {
        let (f0, f1) = (&s.first, &s.second);
        let (chord, end) = (f0.local(s.chord), f0.local(f1.t));
        let across = [f0.local(f1.u), f0.local(f1.v)];
        let closeness = (end.x + 1.0).inverse();
        // K = t₀ × t₁/(1 + t₀·t₁): the reference twist turns by K·(turn of either tangent).
        let k = Vector::new(end.x.like(0.0), -end.z * closeness, end.y * closeness);
        let far = [k.dot(across[0]), k.dot(across[1])];
        Self { chord, end, across, closeness, near: [k.y, k.z], far }
    }

    /// Turns of the first tangent along u and v, and of the second.
    #[inline(always)]
    fn turns(&self) -> [Turn<S>; 4] {
        let (chord, end, zero) = (self.chord, self.end, self.end.x.like(0.0));
        let none = Vector::new(zero, zero, zero);
        [
            Turn {
                chord: Vector::new(chord.y, -chord.x, zero),
                end: Vector::new(end.y, -end.x, zero),
                twist: self.near[0],
            },
            Turn {
                chord: Vector::new(chord.z, zero, -chord.x),
                end: Vector::new(end.z, zero, -end.x),
                twist: self.near[1],
            },
            Turn { chord: none, end: self.across[0], twist: self.far[0] },
            Turn { chord: none, end: self.across[1], twist: self.far[1] },
        ]
    }
}

/// Adds twist and rest curvature of all instruments with angles.
#[inline(always)]
pub(super) fn add_torsion<S: Simd, const C: usize, const HESSIAN: bool>(
    s: &Batch<S>,
    out: &mut ElementSystem<C, S::f64s>,
    energy: &mut Energy<Lanes<S>>,
) {
    let l = Layout::<C>;
    let none = (Vector::splat(s.simd, [0.0; 3]), Matrix::zeros(s.simd));
    let geometry = Geometry::new(s);
    let mut shape = ShapeDerivatives {
        chord: none.0,
        end: none.0,
        chord_chord: none.1,
        chord_end: none.1,
        end_end: none.1,
    };
    let mut spins = [AngleDerivatives::zeros(s.simd); MAX_ANGLES];
    for k in 0..GAUSS.len() {
        add_point::<S, C>(k, s, &geometry, &mut shape, &mut spins, energy);
    }
    for set in 0..Layout::<C>::ANGLES {
        if s.instruments[set].curved {
            energy.bend += s.instruments[set].rest_energy(s.length);
        }
    }
    let ih = s.length.inverse();
    // From the first triad back to space.
    let axes = Matrix::of_columns(s.first.t, s.first.u, s.first.v);
    let turns = geometry.turns();
    let force = (axes.times(shape.chord) * ih).components();
    for i in 0..3 {
        force[i].take_from(&mut out.gradient[l.position(0) + i]);
        force[i].add_to(&mut out.gradient[l.position(1) + i]);
    }
    // The torque at the second node turns with the reference twist.
    let mut torque = Lanes::splat(s.simd, 0.0);
    for set in 0..Layout::<C>::ANGLES {
        let rows = angle_rows::<C>(set);
        for i in 0..3 {
            spins[set].angles[i].add_to(&mut out.gradient[rows[i]]);
        }
        torque += spins[set].angles[1];
    }
    let rows = turn_rows::<C>();
    for a in 0..4 {
        let d = &turns[a];
        let along = shape.chord.dot(d.chord) + shape.end.dot(d.end) + torque * d.twist;
        along.add_to(&mut out.gradient[rows[a]]);
    }
    if HESSIAN {
        add_displacements(axes, ih, &shape, &spins, out);
        add_turns(axes, ih, &shape, &spins, &turns, out);
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

/// Turns derivatives in y and z into those in chord or far tangent, given its weights in y and z at a point.
#[inline(always)]
fn weighed<S: Simd>(p: Vector<S>, q: Vector<S>, (y, z): (f64, f64)) -> Vector<S> {
    p * y + q * z
}

/// Adds the energy of all instruments at a Gauss point, and its derivatives in chord, far tangent and angles.
#[inline(always)]
fn add_point<S: Simd, const C: usize>(
    k: usize,
    s: &Batch<S>,
    geometry: &Geometry<S>,
    shape: &mut ShapeDerivatives<S>,
    spins: &mut [AngleDerivatives<S>; MAX_ANGLES],
    energy: &mut Energy<Lanes<S>>,
) {
    let point: &Point = &GAUSS[k];
    let along = Vector::splat(s.simd, [1.0, 0.0, 0.0]);
    let (y, z) = point.derivatives(geometry.chord, along, geometry.end);
    let twist = ReferenceTwist::new(y, z);
    let (weight, slope) = (point.phi, point.dphi);
    let ([yc, _, ye], [zc, _, ze]) = (point.y, point.z);
    // Gradient of the twist: the twist stiffness is a multiple of its square.
    let tc = weighed(twist.along_y, twist.along_z, (yc, zc));
    let te = weighed(twist.along_y, twist.along_z, (ye, ze));
    let mut torques = Lanes::splat(s.simd, 0.0);
    let mut stiffness = torques;
    let mut f = PointDerivatives::zeros(s.simd);
    for set in 0..Layout::<C>::ANGLES {
        let instrument = &s.instruments[set];
        if !instrument.present {
            continue;
        }
        let input = instrument.torsion_input(k, s.length);
        let (phi, dphi) = angles(&instrument.angles, point);
        let torque = twist.torque(dphi, &input);
        energy.twist += twist.energy(dphi, &input);
        torques += torque;
        stiffness += input.stiffness;
        let spin = &mut spins[set];
        for i in 0..3 {
            let stiff = input.stiffness * slope[i];
            spin.angles_chord[i] += tc * stiff;
            spin.angles_end[i] += te * stiff;
            spin.angles[i] += torque * slope[i];
            for j in i..3 {
                spin.angles_angles[i][j] += stiff * slope[j];
            }
        }
        if instrument.curved {
            let (bend, own) = twist.add_rest_curvature(phi, input.moment, &mut f);
            energy.bend += bend;
            spin.add(&own, &weight, [(yc, zc), (ye, ze)]);
        }
        if instrument.skewed {
            let skew = instrument.skew_input(k, s.length);
            let (bend, own, along) = twist.add_skew(phi, skew, &mut f);
            energy.bend += bend;
            spin.add(&own, &weight, [(yc, zc), (ye, ze)]);
            shape.add_square(skew, along, [(yc, zc), (ye, ze)]);
        }
    }
    twist.add_twist(torques, &mut f);
    shape.chord += weighed(f.gy, f.gz, (yc, zc));
    shape.end += weighed(f.gy, f.gz, (ye, ze));
    let (hyz, hzy) = (f.hyz, f.hyz.transpose());
    let both = hyz + hzy;
    let (stiff_chord, stiff_end) = (tc * stiffness, te * stiffness);
    shape.chord_chord += stiff_chord.outer(tc) + (f.hyy * (yc * yc) + both * (yc * zc));
    shape.chord_end += stiff_chord.outer(te) + (f.hyy * (yc * ye) + hyz * (yc * ze) + hzy * (zc * ye));
    shape.end_end += stiff_end.outer(te) + (f.hyy * (ye * ye) + both * (ye * ze));
}

/// Adds the Hessian in displacements and angles.
#[inline(always)]
fn add_displacements<S: Simd, const C: usize>(
    axes: Matrix<S>,
    ih: Lanes<S>,
    shape: &ShapeDerivatives<S>,
    spins: &[AngleDerivatives<S>; MAX_ANGLES],
    out: &mut ElementSystem<C, S::f64s>,
) {
    let l = Layout::<C>;
    let (x0, x1) = (l.position(0), l.position(1));
    let stiffness = (axes.product(shape.chord_chord).product(axes.transpose()) * (ih * ih)).entries();
    for i in 0..3 {
        for j in 0..3 {
            stiffness[i][j].take_from(&mut out.rows[x0 + i][x1 + j]);
            if j >= i {
                stiffness[i][j].add_to(&mut out.rows[x0 + i][x0 + j]);
                stiffness[i][j].add_to(&mut out.rows[x1 + i][x1 + j]);
            }
        }
    }
    for set in 0..Layout::<C>::ANGLES {
        let rows = angle_rows::<C>(set);
        for j in 0..3 {
            let crossed = (axes.times(spins[set].angles_chord[j]) * ih).components();
            for i in 0..3 {
                crossed[i].take_from(&mut out.rows[x0 + i][rows[j]]);
                // θ₀ and b stand before x₁, θ₁ behind it.
                let (first, last) = ordered(rows[j], x1 + i);
                crossed[i].add_to(&mut out.rows[first][last]);
            }
        }
        for i in 0..3 {
            for j in i..3 {
                let (first, last) = ordered(rows[i], rows[j]);
                spins[set].angles_angles[i][j].add_to(&mut out.rows[first][last]);
            }
        }
    }
}

/// Two rows, the one above first.
#[inline(always)]
const fn ordered(a: usize, b: usize) -> (usize, usize) {
    if a < b { (a, b) } else { (b, a) }
}

/// Adds the Hessian in turns of the tangents, and in turns and everything else.
#[inline(always)]
fn add_turns<S: Simd, const C: usize>(
    axes: Matrix<S>,
    ih: Lanes<S>,
    shape: &ShapeDerivatives<S>,
    spins: &[AngleDerivatives<S>; MAX_ANGLES],
    turns: &[Turn<S>; 4],
    out: &mut ElementSystem<C, S::f64s>,
) {
    let l = Layout::<C>;
    let (x0, x1) = (l.position(0), l.position(1));
    let rows = turn_rows::<C>();
    for a in 0..4 {
        let (d, row) = (&turns[a], rows[a]);
        // The Hessian times what the turn changes.
        let mut chord = shape.chord_chord.times(d.chord) + shape.chord_end.times(d.end);
        let mut end = shape.chord_end.transposed_times(d.chord) + shape.end_end.times(d.end);
        let mut twist = ih.like(0.0);
        for set in 0..Layout::<C>::ANGLES {
            let spin = &spins[set];
            chord += spin.angles_chord[1] * d.twist;
            end += spin.angles_end[1] * d.twist;
            let of = angle_rows::<C>(set);
            for i in 0..3 {
                let (low, high) = ordered(i, 1);
                let angle = spin.angles_chord[i].dot(d.chord)
                    + spin.angles_end[i].dot(d.end)
                    + spin.angles_angles[low][high] * d.twist;
                if i == 1 {
                    twist += angle;
                }
                let (first, last) = ordered(row, of[i]);
                angle.add_to(&mut out.rows[first][last]);
            }
        }
        let pull = (axes.times(chord) * ih).components();
        for i in 0..3 {
            pull[i].take_from(&mut out.rows[x0 + i][row]);
            let (first, last) = ordered(row, x1 + i);
            pull[i].add_to(&mut out.rows[first][last]);
        }
        for b in a..4 {
            let q = &turns[b];
            let value = chord.dot(q.chord) + end.dot(q.end) + twist * q.twist;
            value.add_to(&mut out.rows[row][rows[b]]);
        }
    }
}

/// Adds the gradient times second derivatives of the local unknowns.
#[inline(always)]
fn add_curvature<S: Simd, const C: usize>(
    first: &Axes<S>,
    geometry: &Geometry<S>,
    shape: &ShapeDerivatives<S>,
    torque: Lanes<S>,
    ih: Lanes<S>,
    out: &mut ElementSystem<C, S::f64s>,
) {
    let l = Layout::<C>;
    let (x0, t0, x1, t1) = (l.position(0), l.tangent(0), l.position(1), l.tangent(1));
    let Geometry { chord, end, across, closeness, near, far } = *geometry;
    let (gc, gt) = (shape.chord, shape.end);
    for (w, gw) in [(chord, gc), (end, gt)] {
        let along = gw.dot(w);
        (gw.z * w.z - along).add_to(&mut out.rows[t0][t0]);
        (gw.y * w.y - along).add_to(&mut out.rows[t0 + 1][t0 + 1]);
        ((gw.y * w.z + gw.z * w.y) * 0.5).take_from(&mut out.rows[t0][t0 + 1]);
    }
    let turn = [
        ((first.u * gc.x - first.t * gc.y) * ih).components(), // along u
        ((first.v * gc.x - first.t * gc.z) * ih).components(), // along v
    ];
    let bends = gt.dot(end);
    // t₀ + t₁ and u₀, v₀ in the first triad.
    let sum = Vector::new(end.x + 1.0, end.y, end.z);
    let bent = [end.y, end.z];
    let half = closeness * 0.5;
    for a in 0..2 {
        for i in 0..3 {
            turn[a][i].take_from(&mut out.rows[x0 + i][t0 + a]);
            turn[a][i].add_to(&mut out.rows[t0 + a][x1 + i]);
        }
        bends.take_from(&mut out.rows[t1 + a][t1 + a]);
        for b in 0..2 {
            let p = across[b];
            // −ω × p for ω along the turn of the first triad.
            let (swing, crossed) = if a == 0 {
                (gt.x * p.y - gt.y * p.x, sum.cross(p).y)
            } else {
                (gt.x * p.z - gt.z * p.x, sum.cross(p).z)
            };
            let twist = half * (crossed - (near[a] * p.x + far[b] * bent[a]));
            (swing + torque * twist).add_to(&mut out.rows[t0 + a][t1 + b]);
            if b >= a {
                let half = half * torque;
                (half * (near[a] * bent[b] + near[b] * bent[a])).take_from(&mut out.rows[t0 + a][t0 + b]);
                (half * (far[a] * p.x + far[b] * across[a].x)).take_from(&mut out.rows[t1 + a][t1 + b]);
            }
        }
    }
}
