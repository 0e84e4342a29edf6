//! Friction whose normal forces follow the state at once: what its derivatives are then.
//!
//! With lagged normal forces friction has a potential; with those of the state itself it has none, and its Newton matrix is not
//! symmetric (`methods/kirchhoff/settle.rs`). With the normal force f of the state, and a(y) = φ′/y,
//!
//! ```text
//! g  = μ N a u,    N = f                                    friction on the wall, minus that on the device
//! dN = ∇f·dx,    dn = ∇n dx
//! du = P dx + s dθ − dn (n·w) − n (dn·w) + r (θ − θₐ) dn × t,    w = x − a,    s = r n × t
//! dg = μ a u dN + μ N (a du + (φ″ − a) û (û·du)),    d(g·s) = s·dg + g·(r dn × t)
//! ```
//!
//! P dx and s dθ are the symmetric part, which is that of lagged forces. The rest hangs on the position alone: three columns for
//! the force and one row for the moment.

use nalgebra::Matrix3;

use super::{Friction, rates};
use crate::Vec3;

/// Derivatives of a point's friction that lagged normal forces leave out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Of the force in the position, N/mm.
    pub force: Matrix3<f64>,
    /// Of the moment in the position, N.
    pub turn: Vec3,
}

impl Friction {
    /// From now on the normal forces follow the state.
    pub fn couple(&mut self) {
        self.coupled = true;
    }

    /// Whether they do.
    pub fn is_coupled(&self) -> bool {
        self.coupled
    }

    /// Normal forces are lagged again: they stay as they are.
    pub fn uncouple(&mut self) {
        (self.coupled, self.settled) = (false, true);
        for slider in &mut self.sliders {
            slider.force_n = slider.force_n.max(0.0);
        }
    }

    /// Normal forces of the state: for each point the normal, the force of the state, and that in the matrix, where it presses.
    pub fn take(&mut self, pressed: impl Iterator<Item = Option<(Vec3, f64, f64)>>) {
        for (slider, now) in self.sliders.iter_mut().zip(pressed) {
            if let Some((normal, _, _)) = now {
                slider.normal = normal;
            }
            let (force, stiff) = now.map_or((0.0, 0.0), |(_, force, stiff)| (force, stiff));
            slider.seen = (slider.normal, force.max(0.0));
            (slider.force_n, slider.matrix_n) = (force, stiff);
        }
    }

    /// What [`Friction::derivatives`] leaves out where N and n change by `force_rate` and `normal_rate` with the position.
    pub fn coupling(
        &self,
        index: usize,
        x: &Vec3,
        angle: f64,
        radius_mm: f64,
        (force_rate, normal_rate): (&Vec3, &Matrix3<f64>),
    ) -> Option<Coupling> {
        let slider = self.sliders.get(index)?;
        let (slip, spin) = self.slip(index, x, angle, radius_mm);
        let y = slip.norm();
        let (over, second) = rates(y, self.stick_mm);
        let unit = if y > 0.0 { slip / y } else { Vec3::zeros() };
        let size_n = if self.coupled { slider.matrix_n } else { slider.force_n };
        let (n, force) = (slider.normal, self.coefficient * size_n);
        // v ↦ r v × t.
        let cross = slider.along.cross_matrix() * -radius_mm;
        let way = x - slider.from_mm;
        let slip_rate = cross * normal_rate * (angle - slider.from_rad)
            - normal_rate * n.dot(&way)
            - n * normal_rate.tr_mul(&way).transpose();
        let bent = slip_rate * over + unit * (slip_rate.tr_mul(&unit).transpose() * (second - over));
        let derivative = slip * force_rate.transpose() * (self.coefficient * over) + bent * force;
        let gradient = slip * (force * over);
        let turn = derivative.tr_mul(&spin) + (cross * normal_rate).tr_mul(&gradient);
        Some(Coupling { force: derivative, turn })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Slider;
    use super::*;

    const RADIUS_MM: f64 = 0.4;

    /// Force 3 (0.5 − z + 0.2 x²) and normal of a wall.
    fn wall(x: &Vec3) -> (f64, Vec3) {
        (3.0 * (0.5 - x.z + 0.2 * x.x * x.x), Vec3::new(-0.4 * x.x, 0.1 * x.y, 1.0).normalize())
    }

    fn at(x: &Vec3) -> Friction {
        let (force, normal) = wall(x);
        let slider = Slider {
            from_mm: Vec3::new(0.1, 0.2, 0.05),
            from_rad: 0.3,
            along: Vec3::new(0.8, 0.6, 0.1).normalize(),
            normal,
            force_n: force,
            begun: (normal, force),
            seen: (normal, force),
            matrix_n: force,
        };
        let mut friction = Friction {
            coefficient: 0.4,
            stick_mm: 0.3,
            coupled: true,
            sliders: vec![slider],
            ..Friction::default()
        };
        friction.take(std::iter::once(Some((normal, force, force))));
        friction
    }

    #[test]
    fn derivatives_are_those_of_force_and_moment() {
        // Slipping and sticking.
        for x in [Vec3::new(0.7, 0.5, 0.1), Vec3::new(0.2, 0.15, 0.08)] {
            let angle = 0.45;
            let h = 1e-6;
            let rates = [0, 1, 2].map(|k| {
                let (plus, minus) = (wall(&(x + Vec3::ith(k, h))), wall(&(x - Vec3::ith(k, h))));
                ((plus.0 - minus.0) / (2.0 * h), (plus.1 - minus.1) / (2.0 * h))
            });
            let force_rate = Vec3::from(rates.map(|r| r.0));
            let normal_rate = Matrix3::from_columns(&rates.map(|r| r.1));
            let here = at(&x);
            let lagged = here.derivatives(0, &x, angle, RADIUS_MM).unwrap();
            let more = here.coupling(0, &x, angle, RADIUS_MM, (&force_rate, &normal_rate)).unwrap();
            let of = |x: &Vec3| {
                let d = at(x).derivatives(0, x, angle, RADIUS_MM).unwrap();
                (d.gradient, d.turn)
            };
            for k in 0..3 {
                let e = Vec3::ith(k, h);
                let (plus, minus) = (of(&(x + e)), of(&(x - e)));
                let force = (plus.0 - minus.0) / (2.0 * h);
                let turn = (plus.1 - minus.1) / (2.0 * h);
                let expected = lagged.hessian.column(k) + more.force.column(k);
                assert!((force - expected).norm() < 1e-6, "{k}: {force} {expected}");
                assert!((turn - lagged.mixed[k] - more.turn[k]).abs() < 1e-6, "{k}");
                // The symmetric part alone is another derivative.
                assert!(k < 2 || (force - lagged.hessian.column(k)).norm() > 0.05);
            }
        }
    }
}
