//! From what is felt in front of the surface to what is felt behind it.
//!
//! In front of the surface windows tell the other side of a lumen and the back of a septum from the wall that is meant; behind it depth has
//! no bound, and the sheet that faces the same way is meant. The two differ where a surface is rough. A soft wall lets a device
//! through from one to the other, so on the depth t behind the surface the first, f, passes into the second, g:
//!
//! ```text
//! F = f + s (g − f),    s = S(−f/t) S(−h/t),    S(x) = x³(10 − 15x + 6x²) from 0 to 1
//! ```
//!
//! with h the least height over the planes at the corners of the triangle that is asked: over a ridge one of its flanks is in front.
//! F is twice continuously differentiable.

use super::{Behind, Distance, Nearness, Reached, SmoothWall};
use crate::Vec3;

/// t over the radius of the thickest device.
pub(super) const PASSING: f64 = 0.2;

/// s with its derivatives in f and h.
struct Share {
    value: f64,
    in_f: f64,
    in_h: f64,
    in_ff: f64,
    in_fh: f64,
    in_hh: f64,
}

impl SmoothWall {
    /// As [`SmoothWall::distance`], with derivatives only where the distance is less than `limit_mm`: they are what it costs. Beside it
    /// the coverage: how well the vertices reach.
    pub fn within(&self, x: &Vec3, triangle: u32, limit_mm: f64) -> Option<(Nearness, f64)> {
        let list = self.list(triangle as usize);
        let front = self.reach_from(x, list, None);
        let derived = |reached: &Reached| self.derive(x, list, reached, |_| {});
        let told = |value_mm: f64, distance: &dyn Fn() -> Distance| {
            if value_mm < limit_mm { Nearness::Within(distance()) } else { Nearness::Beyond(value_mm) }
        };
        if let Some(front) = front.as_ref().filter(|front| front.value_mm >= 0.0) {
            return Some((told(front.value_mm, &|| derived(front)), front.coverage));
        }
        let (height_mm, normal) = self.height(x, list);
        let back = if height_mm < 0.0 { self.reach_from(x, list, Some(self.behind(list))) } else { None };
        let (front, back) = match (front, back) {
            (Some(front), Some(back)) => (front, back),
            (one, None) | (None, one) => {
                let one = one?;
                return Some((told(one.value_mm, &|| derived(&one)), one.coverage));
            }
        };
        let share = self.share(front.value_mm, height_mm);
        let apart = back.value_mm - front.value_mm;
        let value_mm = front.value_mm + share.value * apart;
        let coverage = front.coverage + share.value * (back.coverage - front.coverage);
        let passing = || {
            if share.value == 1.0 {
                return derived(&back);
            }
            let (f, g) = (derived(&front), derived(&back));
            let slope = f.gradient * share.in_f + normal * share.in_h;
            let mixed = f.gradient * normal.transpose() * share.in_fh;
            let bend = f.gradient * f.gradient.transpose() * share.in_ff
                + (mixed + mixed.transpose())
                + (normal * normal.transpose() * share.in_hh + f.hessian * share.in_f);
            let turned = slope * (g.gradient - f.gradient).transpose();
            let hessian = f.hessian + (g.hessian - f.hessian) * share.value;
            Distance {
                value_mm,
                gradient: f.gradient + (g.gradient - f.gradient) * share.value + slope * apart,
                hessian: hessian + turned + turned.transpose() + bend * apart,
            }
        };
        Some((told(value_mm, &passing), coverage))
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
            let (height_mm, normal) = self.height(x, list);
            let share = self.share(front.value_mm, height_mm);
            let turn = f.gradient * share.in_f + normal * share.in_h;
            slope = slope * (1.0 - share.value) + turn * (1.0 - front.coverage);
        }
        Some((distance, coverage, slope))
    }

    /// Least height over the planes at the corners of the triangle whose list this is, mm, and its gradient.
    pub(super) fn height(&self, x: &Vec3, list: &[u32]) -> (f64, Vec3) {
        // The list begins with the corners.
        let corners = list.iter().take(3).map(|v| &self.quadrics[*v as usize]);
        let heights = corners.map(|q| (q.normal.dot(&(x - q.position)), q.normal));
        heights.fold((f64::INFINITY, Vec3::zeros()), |least, h| if h.0 < least.0 { h } else { least })
    }

    /// What a point behind that triangle is behind of.
    pub(super) fn behind(&self, list: &[u32]) -> Behind {
        let corners = list.iter().take(3).map(|v| self.quadrics[*v as usize].normal);
        Behind { facing: corners.sum::<Vec3>().normalize() }
    }

    fn share(&self, front_mm: f64, height_mm: f64) -> Share {
        let rate = -1.0 / self.passing_mm;
        let ([f, f1, f2], [h, h1, h2]) = (rise(front_mm * rate), rise(height_mm * rate));
        let square = rate * rate;
        Share {
            value: f * h,
            in_f: f1 * h * rate,
            in_h: f * h1 * rate,
            in_ff: f2 * h * square,
            in_fh: f1 * h1 * square,
            in_hh: f * h2 * square,
        }
    }
}

/// S and its derivatives.
fn rise(x: f64) -> [f64; 3] {
    if x <= 0.0 {
        return [0.0; 3];
    }
    if x >= 1.0 {
        return [1.0, 0.0, 0.0];
    }
    let y = 1.0 - x;
    [x * x * x * (10.0 + x * (6.0 * x - 15.0)), 30.0 * x * x * y * y, 60.0 * x * y * (y - x)]
}
