//! Blending of the distance in front of the surface into that behind it.
//!
//! In front of the surface windows exclude the other side of a lumen and the back of a septum; behind it depth is
//! unlimited, and the sheet that faces the same way is meant. The two distances differ where a surface is rough. A
//! device can pass from one to the other through a soft wall, so over the depth t behind the surface the first, f,
//! blends into the second, g:
//!
//! ```text
//! F = f + s (g − f),    s = S(−f/t),    S(x) = x³(10 − 15x + 6x²) from 0 to 1.
//! ```
//!
//! F is twice continuously differentiable. In front of the surface it is f alone: there g would extend beyond sharp
//! crests.

use super::{Behind, Distance, Nearness, Reached, SmoothWall};
use crate::Vec3;

/// t, in radii of the thickest device.
pub(super) const PASSING: f64 = 0.2;

impl SmoothWall {
    /// As [`SmoothWall::distance`], with derivatives, the costly part, only where the distance is less than
    /// `limit_mm`. Also returns the coverage: how well the vertices reach.
    pub(crate) fn within(&self, x: &Vec3, triangle: u32, limit_mm: f64) -> Option<(Nearness, f64)> {
        let list = self.list(triangle as usize);
        let front = self.reach_from(x, list, None);
        let derived = |reached: &Reached| self.derive(x, list, reached, |_| {});
        let reported = |value_mm: f64, distance: &dyn Fn() -> Distance| {
            if value_mm < limit_mm { Nearness::Within(distance()) } else { Nearness::Beyond(value_mm) }
        };
        if let Some(front) = front.as_ref().filter(|front| front.value_mm >= 0.0) {
            return Some((reported(front.value_mm, &|| derived(front)), front.coverage));
        }
        let behind = self.behind(list);
        // A point that no vertex reaches in front of the surface need not be behind it.
        let corner = list.first().map(|v| self.quadrics[*v as usize].position);
        if front.is_none() && corner.is_none_or(|corner| behind.facing.dot(&(x - corner)) > 0.0) {
            return None;
        }
        let back = self.reach_from(x, list, Some(behind));
        let (front, back) = match (front, back) {
            (Some(front), Some(back)) => (front, back),
            (one, None) | (None, one) => {
                let one = one?;
                return Some((reported(one.value_mm, &|| derived(&one)), one.coverage));
            }
        };
        let [share, in_f, in_ff] = self.share(front.value_mm);
        let apart = back.value_mm - front.value_mm;
        let value_mm = front.value_mm + share * apart;
        let passing = || {
            if share == 1.0 {
                return derived(&back);
            }
            let (f, g) = (derived(&front), derived(&back));
            let between = g.gradient - f.gradient;
            let turned = f.gradient * between.transpose() * in_f;
            let bend = f.gradient * f.gradient.transpose() * in_ff + f.hessian * in_f;
            let hessian = f.hessian + (g.hessian - f.hessian) * share;
            Distance {
                value_mm,
                gradient: f.gradient + between * share + f.gradient * (in_f * apart),
                hessian: hessian + turned + turned.transpose() + bend * apart,
            }
        };
        // The triangles' share is as in front until the blending is complete.
        let [deep, ..] = self.share(front.value_mm + self.passing_mm);
        let coverage = front.coverage + deep * (back.coverage - front.coverage);
        Some((reported(value_mm, &passing), coverage))
    }

    /// As [`SmoothWall::distance`], with the coverage C and
    ///
    /// ```text
    /// ∇C = Σ [(aᵢ − C) ∇wᵢ + wᵢ ∇aᵢ] / Σ wᵢ
    /// ```
    pub(crate) fn covered(&self, x: &Vec3, triangle: u32) -> Option<(Distance, f64, Vec3)> {
        let (Nearness::Within(distance), coverage) = self.within(x, triangle, f64::INFINITY)? else {
            return None;
        };
        let list = self.list(triangle as usize);
        let Some(front) = self.reach_from(x, list, None) else {
            return Some((distance, coverage, Vec3::zeros()));
        };
        let mut slope = Vec3::zeros();
        let f = self.derive(x, list, &front, |at| {
            slope += at.gradient * (at.support - front.coverage) + at.support_gradient * at.weight;
        });
        slope /= front.weight;
        if coverage != front.coverage {
            // Behind the surface the coverage is 1.
            let [deep, in_f, _] = self.share(front.value_mm + self.passing_mm);
            slope = slope * (1.0 - deep) + f.gradient * (in_f * (1.0 - front.coverage));
        }
        Some((distance, coverage, slope))
    }

    /// The sheet of that triangle, for a point behind it.
    pub(super) fn behind(&self, list: &[u32]) -> Behind {
        // The list begins with the corners.
        let corners = list.iter().take(3).map(|v| self.quadrics[*v as usize].normal);
        Behind { facing: corners.sum::<Vec3>().normalize() }
    }

    /// s at a distance f from the surface, and its derivatives in f.
    fn share(&self, front_mm: f64) -> [f64; 3] {
        let rate = -1.0 / self.passing_mm;
        let [share, first, second] = rise(front_mm * rate);
        [share, first * rate, second * rate * rate]
    }
}

/// S and its derivatives: 10x³ − 15x⁴ + 6x⁵ between 0 and 1.
pub(in crate::contact) fn rise(x: f64) -> [f64; 3] {
    if x <= 0.0 {
        return [0.0; 3];
    }
    if x >= 1.0 {
        return [1.0, 0.0, 0.0];
    }
    let y = 1.0 - x;
    [x * x * x * (10.0 + x * (6.0 * x - 15.0)), 30.0 * x * x * y * y, 60.0 * x * y * (y - x)]
}
