//! Twist and rest curvature of one element: the part of its energy that sees the material frame.

use super::element::{ElementData, ElementState, ElementSystem, Energy, angles};
use super::layout::Layout;
use super::quadrature::GAUSS;
use super::torsion::torsion;
use crate::Vec3;
use nalgebra::Matrix3;

/// A derivative of the local unknowns: of the chord and the far tangent, both in the first triad, and of (φ₀, φ₁, b).
#[derive(Clone, Copy)]
struct Local {
    chord: Vec3,
    end: Vec3,
    angles: Vec3,
}

/// Adds twist and rest curvature of the instrument in a `set` of angles: 9 local unknowns (chord, far tangent, φ₀, φ₁, b), then the chain rule.
///
/// Turns of either tangent move all local unknowns; displacements move the chord alone and angles themselves, so the
/// chain rule needs products with four columns, not thirteen.
#[inline]
pub(super) fn add_torsion<const C: usize, const HESSIAN: bool>(
    data: &ElementData,
    s: &ElementState,
    set: usize,
    out: &mut ElementSystem<C>,
    energy: &mut Energy,
) {
    let l = Layout::<C>;
    let (x0, t0, x1, t1) = (l.position(0), l.tangent(0), l.position(1), l.tangent(1));
    let (angle0, bubble, angle1) = (l.angle(0, set), l.bubble(0, set), l.angle(1, set));
    let material = &data.materials[set];
    let (f0, f1) = (&s.first, &s.second);
    let (chord, end) = (f0.local(&s.chord), f0.local(&f1.t));
    let zero = Matrix3::zeros();
    let (mut gc, mut gt, mut ga) = (Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
    // Blocks of the local Hessian: rows and columns chord, end, angles.
    let (mut hcc, mut hce, mut hee, mut hca, mut hea, mut haa) = (zero, zero, zero, zero, zero, zero);
    for (k, point) in GAUSS.iter().enumerate() {
        let (y, z) = point.derivatives(&chord, &Vec3::x(), &end);
        let (phi, dphi) = angles(&s.angles[set], point);
        let f = torsion(&y, &z, phi, dphi, &material.torsion_input(k, data.length));
        energy.bend += f.bend;
        energy.twist += f.twist;
        let ([yc, _, ye], [zc, _, ze]) = (point.y, point.z);
        gc += f.gy * yc + f.gz * zc;
        gt += f.gy * ye + f.gz * ze;
        let hzy = f.hyz.transpose();
        // Half products: derivative along y and z of the gradient in each vector.
        let (cy, cz) = (f.hyy * yc + hzy * zc, f.hyz * yc + f.hzz * zc);
        hcc += cy * yc + cz * zc;
        hce += cy * ye + cz * ze;
        hee += f.hyy * (ye * ye) + (f.hyz + hzy) * (ye * ze) + f.hzz * (ze * ze);
        let (weight, slope) = (Vec3::from(point.phi), Vec3::from(point.dphi));
        let both = |p: &[Vec3; 2]| p[0] * weight.transpose() + p[1] * slope.transpose();
        let (hya, hza) = (both(&f.hyp), both(&f.hzp));
        hca += hya * yc + hza * zc;
        hea += hya * ye + hza * ze;
        ga += weight * f.gp[0] + slope * f.gp[1];
        haa += weight * weight.transpose() * f.hpp[0] + slope * slope.transpose() * f.hpp[1];
    }
    energy.bend += material.rest_energy(data.length);

    let ih = 1.0 / data.length;
    let (u1, v1) = (f0.local(&f1.u), f0.local(&f1.v));
    let c = 1.0 / (1.0 + end.x);
    // K = t₀ × t₁/(1 + t₀·t₁), in the first triad: the reference twist turns by K·(turn of either tangent).
    let k = Vec3::new(0.0, -end.z * c, end.y * c);
    let k0 = [k.y, k.z];
    let k1 = [k.dot(&u1), k.dot(&v1)];
    let swing = |w: &Vec3, a: usize| {
        if a == 0 { Vec3::new(w.y, -w.x, 0.0) } else { Vec3::new(w.z, 0.0, -w.x) }
    };
    let spin = |rate: f64| Vec3::new(0.0, rate, 0.0);
    let turns = [
        Local { chord: swing(&chord, 0), end: swing(&end, 0), angles: spin(k0[0]) },
        Local { chord: swing(&chord, 1), end: swing(&end, 1), angles: spin(k0[1]) },
        Local { chord: Vec3::zeros(), end: u1, angles: spin(k1[0]) },
        Local { chord: Vec3::zeros(), end: v1, angles: spin(k1[1]) },
    ];
    let rows = [t0, t0 + 1, t1, t1 + 1];
    let angle_rows = [angle0, angle1, bubble];
    // From the first triad back to space.
    let axes = Matrix3::from_columns(&[f0.t, f0.u, f0.v]);
    let force = axes * gc * ih;
    for i in 0..3 {
        out.gradient[x0 + i] -= force[i];
        out.gradient[x1 + i] += force[i];
        out.gradient[angle_rows[i]] += ga[i];
    }
    for (d, row) in turns.iter().zip(rows) {
        out.gradient[row] += gc.dot(&d.chord) + gt.dot(&d.end) + ga.dot(&d.angles);
    }
    if !HESSIAN {
        return;
    }

    let products = turns.map(|d| Local {
        chord: hcc * d.chord + hce * d.end + hca * d.angles,
        end: hce.tr_mul(&d.chord) + hee * d.end + hea * d.angles,
        angles: hca.tr_mul(&d.chord) + hea.tr_mul(&d.end) + haa * d.angles,
    });

    let stiffness = axes * hcc * axes.transpose() * (ih * ih);
    let crossed = axes * hca * ih;
    for i in 0..3 {
        for j in 0..3 {
            out.rows[x0 + i][x1 + j] -= stiffness[(i, j)];
            if j >= i {
                out.rows[x0 + i][x0 + j] += stiffness[(i, j)];
                out.rows[x1 + i][x1 + j] += stiffness[(i, j)];
            }
            out.rows[x0 + i][angle_rows[j]] -= crossed[(i, j)];
        }
        // θ₀ and b stand before x₁, θ₁ behind it.
        out.rows[angle0][x1 + i] += crossed[(i, 0)];
        out.rows[x1 + i][angle1] += crossed[(i, 1)];
        out.rows[bubble][x1 + i] += crossed[(i, 2)];
    }
    for (i, j, value) in [
        (angle0, angle0, haa[(0, 0)]),
        (angle0, angle1, haa[(0, 1)]),
        (angle0, bubble, haa[(0, 2)]),
        (angle1, angle1, haa[(1, 1)]),
        (bubble, angle1, haa[(1, 2)]),
        (bubble, bubble, haa[(2, 2)]),
    ] {
        out.rows[i][j] += value;
    }
    for (a, &row) in rows.iter().enumerate() {
        let product = axes * products[a].chord * ih;
        for i in 0..3 {
            out.rows[x0 + i][row] -= product[i];
            let (first, last) = if row < x1 { (row, x1 + i) } else { (x1 + i, row) };
            out.rows[first][last] += product[i];
            let (first, last) = if row < angle_rows[i] { (row, angle_rows[i]) } else { (angle_rows[i], row) };
            out.rows[first][last] += products[a].angles[i];
        }
        for b in a..4 {
            let q = &turns[b];
            out.rows[row][rows[b]] += products[a].chord.dot(&q.chord)
                + products[a].end.dot(&q.end)
                + products[a].angles.dot(&q.angles);
        }
    }

    // Second derivatives of the local unknowns.
    let gp = ga[1];
    for (w, gw) in [(&chord, &gc), (&end, &gt)] {
        let along = gw.dot(w);
        out.rows[t0][t0] += gw.z * w.z - along;
        out.rows[t0 + 1][t0 + 1] += gw.y * w.y - along;
        out.rows[t0][t0 + 1] -= 0.5 * (gw.y * w.z + gw.z * w.y);
    }
    let turn = [
        (f0.u * gc.x - f0.t * gc.y) * ih, // along u
        (f0.v * gc.x - f0.t * gc.z) * ih, // along v
    ];
    let ends = [u1, v1];
    let bends = gt.dot(&end);
    // t₀ + t₁ and t₀, t₁ in the first triad.
    let sum = Vec3::new(1.0 + end.x, end.y, end.z);
    let first = [Vec3::y(), Vec3::z()];
    for a in 0..2 {
        for i in 0..3 {
            out.rows[x0 + i][t0 + a] -= turn[a][i];
            out.rows[t0 + a][x1 + i] += turn[a][i];
        }
        out.rows[t1 + a][t1 + a] -= bends;
        for b in 0..2 {
            let p = ends[b];
            // −ω × p for ω along the turn of the first triad.
            let swing = if a == 0 { gt.x * p.y - gt.y * p.x } else { gt.x * p.z - gt.z * p.x };
            let twist = 0.5 * c * (first[a].dot(&sum.cross(&p)) - (k0[a] * ends[b].x + k1[b] * end[1 + a]));
            out.rows[t0 + a][t1 + b] += swing + gp * twist;
            if b >= a {
                out.rows[t0 + a][t0 + b] -= 0.5 * c * gp * (k0[a] * end[1 + b] + k0[b] * end[1 + a]);
                out.rows[t1 + a][t1 + b] -= 0.5 * c * gp * (k1[a] * ends[b].x + k1[b] * ends[a].x);
            }
        }
    }
}
