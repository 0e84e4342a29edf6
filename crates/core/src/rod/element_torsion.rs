//! Twist and rest curvature of one element: the part of its energy that sees the material frame.

use super::element::{ElementData, ElementState, ElementSystem, Energy, angles};
use super::quadrature::GAUSS;
use super::torsion::torsion;
use crate::Vec3;

/// Adds twist and rest curvature: 9 local unknowns (e, t₁ in the first triad, φ₀, φ₁, b), then the chain rule.
#[inline]
pub(super) fn add_torsion<const M: usize>(
    data: &ElementData,
    s: &ElementState,
    out: &mut ElementSystem<M>,
    energy: &mut Energy,
) {
    let (f0, f1) = (&s.first, &s.second);
    let (chord, end) = (f0.local(&s.chord), f0.local(&f1.t));
    let mut g = [0.0; 9];
    let mut hess = [[0.0; 9]; 9];
    for (k, point) in GAUSS.iter().enumerate() {
        let (y, z) = point.derivatives(&chord, &Vec3::x(), &end);
        let (phi, dphi) = angles(&s.angles, point);
        let f = torsion(&y, &z, phi, dphi, &data.torsion_input(k));
        energy.bend += f.bend;
        energy.twist += f.twist;
        let (y_of, z_of) = ([point.y[0], point.y[2]], [point.z[0], point.z[2]]);
        for a in 0..2 {
            for i in 0..3 {
                g[3 * a + i] += y_of[a] * f.gy[i] + z_of[a] * f.gz[i];
            }
            for b in a..2 {
                let (yy, yz, zy, zz) =
                    (y_of[a] * y_of[b], y_of[a] * z_of[b], z_of[a] * y_of[b], z_of[a] * z_of[b]);
                for i in 0..3 {
                    for j in 0..3 {
                        hess[3 * a + i][3 * b + j] +=
                            yy * f.hyy[(i, j)] + yz * f.hyz[(i, j)] + zy * f.hyz[(j, i)] + zz * f.hzz[(i, j)];
                    }
                }
            }
            for p in 0..3 {
                for i in 0..3 {
                    hess[3 * a + i][6 + p] += point.phi[p] * (y_of[a] * f.hyp[0][i] + z_of[a] * f.hzp[0][i])
                        + point.dphi[p] * (y_of[a] * f.hyp[1][i] + z_of[a] * f.hzp[1][i]);
                }
            }
        }
        for p in 0..3 {
            g[6 + p] += point.phi[p] * f.gp[0] + point.dphi[p] * f.gp[1];
            for q in p..3 {
                hess[6 + p][6 + q] +=
                    point.phi[p] * point.phi[q] * f.hpp[0] + point.dphi[p] * point.dphi[q] * f.hpp[1];
            }
        }
    }
    energy.bend += data.rest_energy();
    for i in 1..9 {
        for j in 0..i {
            hess[i][j] = hess[j][i];
        }
    }

    // First derivatives of the local unknowns in the element's 13: rows local, columns x₀ t₀ θ₀ b x₁ t₁ θ₁.
    let ih = 1.0 / data.length;
    let rows = [f0.t, f0.u, f0.v];
    let (u1, v1) = (f0.local(&f1.u), f0.local(&f1.v));
    let c = 1.0 / (1.0 + end.x);
    // K = t₀ × t₁/(1 + t₀·t₁), in the first triad.
    let k = Vec3::new(0.0, -end.z * c, end.y * c);
    let k0 = [k.y, k.z];
    let k1 = [k.dot(&u1), k.dot(&v1)];
    let mut jac = [[0.0; 13]; 9];
    for i in 0..3 {
        for j in 0..3 {
            jac[i][j] = -rows[i][j] * ih;
            jac[i][7 + j] = rows[i][j] * ih;
        }
        jac[3 + i][10] = u1[i];
        jac[3 + i][11] = v1[i];
    }
    for (at, w) in [(0, &chord), (3, &end)] {
        (jac[at][3], jac[at + 1][3]) = (w.y, -w.x);
        (jac[at][4], jac[at + 2][4]) = (w.z, -w.x);
    }
    jac[6][5] = 1.0;
    jac[7][12] = 1.0;
    jac[8][6] = 1.0;
    jac[7][3..5].copy_from_slice(&k0);
    jac[7][10..12].copy_from_slice(&k1);
    for j in 0..13 {
        let mut column = [0.0; 9];
        for l in 0..9 {
            let value = jac[l][j];
            if value != 0.0 {
                out.gradient[j] += g[l] * value;
                for i in 0..9 {
                    column[i] += hess[l][i] * value;
                }
            }
        }
        for i in 0..=j {
            let mut sum = 0.0;
            for l in 0..9 {
                sum += jac[l][i] * column[l];
            }
            out.hessian[i][j] += sum;
        }
    }

    // Second derivatives of the local unknowns.
    let (ge, gt, gp) = (Vec3::new(g[0], g[1], g[2]), Vec3::new(g[3], g[4], g[5]), g[7]);
    for (w, gw) in [(&chord, &ge), (&end, &gt)] {
        let along = gw.dot(w);
        out.hessian[3][3] += gw.z * w.z - along;
        out.hessian[4][4] += gw.y * w.y - along;
        out.hessian[3][4] -= 0.5 * (gw.y * w.z + gw.z * w.y);
    }
    let turn = [
        (f0.u * ge.x - f0.t * ge.y) * ih, // along u
        (f0.v * ge.x - f0.t * ge.z) * ih, // along v
    ];
    let ends = [u1, v1];
    let bends = gt.dot(&end);
    // t₀ + t₁ and t₀, t₁ in the first triad.
    let sum = Vec3::new(1.0 + end.x, end.y, end.z);
    let first = [Vec3::y(), Vec3::z()];
    for a in 0..2 {
        for i in 0..3 {
            out.hessian[i][3 + a] -= turn[a][i];
            out.hessian[3 + a][7 + i] += turn[a][i];
        }
        out.hessian[10 + a][10 + a] -= bends;
        for b in 0..2 {
            let p = ends[b];
            // −ω × p for ω along the turn of the first triad.
            let swing = if a == 0 { gt.x * p.y - gt.y * p.x } else { gt.x * p.z - gt.z * p.x };
            let twist = 0.5 * c * (first[a].dot(&sum.cross(&p)) - (k0[a] * ends[b].x + k1[b] * end[1 + a]));
            out.hessian[3 + a][10 + b] += swing + gp * twist;
            if b >= a {
                out.hessian[3 + a][3 + b] -= 0.5 * c * gp * (k0[a] * end[1 + b] + k0[b] * end[1 + a]);
                out.hessian[10 + a][10 + b] -= 0.5 * c * gp * (k1[a] * ends[b].x + k1[b] * ends[a].x);
            }
        }
    }
}
