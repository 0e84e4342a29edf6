//! A wall with variable modulus and friction, given per vertex.
//!
//! Vertex i has sᵢ = ln(kᵢ/k₀) and a friction coefficient μᵢ, blended by the weights of the distance
//! ([`super::distance`]), so both are twice continuously differentiable wherever the distance is:
//!
//! ```text
//! s(x)  = Σ wᵢsᵢ / W,    k(x) = k₀ eˢ
//! ∇s    = Σ (sᵢ − s) ∇wᵢ / W
//! ∇∇s   = [Σ (sᵢ − s) ∇∇wᵢ − ∇W ∇sᵀ − ∇s ∇Wᵀ] / W
//! ```
//!
//! With ψ(d) the energy per length on a wall of modulus k₀ ([`super::potential`]), that on the graded one is eˢψ, and
//!
//! ```text
//! ∇(eˢψ)  = eˢ (ψ′ ∇d + ψ ∇s)
//! ∇∇(eˢψ) = eˢ (ψ″ ∇d ∇dᵀ + ψ′ ∇∇d + ψ′ (∇d ∇sᵀ + ∇s ∇dᵀ) + ψ (∇s ∇sᵀ + ∇∇s))
//! ```
//!
//! for a foundation, ψ = ½k₀p²: ½p²∇k beside −kp∇d. The first is along the wall, towards the softer side: a device
//! that is pushed on there gains energy. It is the wall's elastic force, not a pressure, and is not part of the
//! normal force in Coulomb's law.
//!
//! The logarithm is blended because moduli differ by powers of ten (see [`WallProperties::at`]); |∇k|/k is at most
//! |Δ ln k| over the width of a transition, and k stays between those of the vertices. Friction may be 0 and is blended as it is. It
//! is lagged with the normal force ([`super::friction`]), and needs no derivatives.

use nalgebra::Matrix3;

use super::properties::WallProperties;
use super::{Distance, SmoothWall, WallPotential};
use crate::Vec3;
use crate::vessel::WallQuery;

/// A quantity given at the vertices, with derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Blend {
    value: f64,
    gradient: Vec3,
    hessian: Matrix3<f64>,
}

impl Blend {
    /// A uniform quantity.
    fn constant(value: f64) -> Self {
        Self { value, gradient: Vec3::zeros(), hessian: Matrix3::zeros() }
    }
}

/// The wall's modulus at a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stiffness {
    /// eˢ: ratio to the modulus k₀ of the potential.
    pub factor: f64,
    /// ∇s, 1/mm, and ∇∇s, 1/mm², where moduli differ.
    pub slope: Option<(Vec3, Matrix3<f64>)>,
}

impl Stiffness {
    /// Gradient in N and Hessian in N/mm of `length_mm` eˢψ at an allowed distance.
    pub(crate) fn derivatives(
        &self,
        potential: &WallPotential,
        d: &Distance,
        length_mm: f64,
    ) -> (Vec3, Matrix3<f64>) {
        let w = self.factor * length_mm;
        let (first, second) = potential.derivatives(d.value_mm);
        let even = d.gradient * (w * first);
        let (along, graded) = self.graded(w * potential.value(d.value_mm), &even);
        let plane = d.gradient * d.gradient.transpose();
        (even + along, plane * (w * second) + d.hessian * (w * first) + graded)
    }

    /// Contribution of the modulus gradient to gradient and Hessian of the energy `stored_mj`, whose gradient at
    /// constant modulus is `even`.
    pub(super) fn graded(&self, stored_mj: f64, even: &Vec3) -> (Vec3, Matrix3<f64>) {
        let Some((s1, s2)) = &self.slope else { return (Vec3::zeros(), Matrix3::zeros()) };
        let mixed = even * s1.transpose();
        (s1 * stored_mj, mixed + mixed.transpose() + (s1 * s1.transpose() + s2) * stored_mj)
    }
}

/// Modulus and friction of a wall with regions.
#[derive(Debug, Clone)]
pub(crate) struct RegionMap {
    /// ln(kᵢ/k₀) of every vertex; none if all are 0.
    ln_moduli: Vec<f64>,
    /// μᵢ over the largest of all coefficients; none if all are 1.
    rough: Vec<f64>,
}

impl RegionMap {
    /// The values of `properties` at the vertices of a wall; `None` if uniform.
    pub(super) fn new(wall: &WallQuery, properties: &WallProperties) -> Option<Self> {
        let largest = properties.largest_friction();
        let share = |friction: f64| if largest > 0.0 { friction / largest } else { 1.0 };
        let (mut ln_moduli, mut rough): (Vec<f64>, Vec<f64>) =
            properties.at_vertices(wall).into_iter().map(|(ln, friction)| (ln, share(friction))).unzip();
        if ln_moduli.iter().all(|s| *s == 0.0) {
            ln_moduli.clear();
        }
        if rough.iter().all(|r| *r == 1.0) {
            rough.clear();
        }
        (!ln_moduli.is_empty() || !rough.is_empty()).then_some(Self { ln_moduli, rough })
    }

    /// The modulus at `x`, given a triangle near it.
    pub(super) fn stiffness(&self, wall: &SmoothWall, x: &Vec3, triangle: u32) -> Stiffness {
        if self.ln_moduli.is_empty() {
            return Stiffness { factor: 1.0, slope: None };
        }
        let s = blend(wall, x, triangle, |v| self.ln_moduli[v as usize]);
        Stiffness { factor: libm::exp(s.value), slope: Some((s.gradient, s.hessian)) }
    }

    /// Coefficient of friction at `x`, relative to the largest.
    pub(super) fn rough(&self, wall: &SmoothWall, x: &Vec3, triangle: u32) -> f64 {
        if self.rough.is_empty() { 1.0 } else { blend(wall, x, triangle, |v| self.rough[v as usize]).value }
    }
}

/// The vertex values of `of`, blended at `x`.
fn blend(wall: &SmoothWall, x: &Vec3, triangle: u32, of: impl Fn(u32) -> f64) -> Blend {
    let list = wall.list(triangle as usize);
    let first = of(list[0]);
    if list.iter().all(|&v| of(v) == first) {
        return Blend::constant(first);
    }
    let (mut weight, mut value) = (0.0, 0.0);
    let (mut weight1, mut value1) = (Vec3::zeros(), Vec3::zeros());
    let (mut weight2, mut value2) = (Matrix3::zeros(), Matrix3::zeros());
    let reached = wall.weigh(x, triangle, |at| {
        let s = of(at.vertex);
        weight += at.weight;
        weight1 += at.gradient;
        weight2 += at.hessian;
        value += at.weight * s;
        value1 += at.gradient * s;
        value2 += at.hessian * s;
    });
    if reached.is_none() {
        // A torn surface without reaching vertices: use the triangle. The list begins with its corners.
        let corners = &list[..list.len().min(3)];
        return Blend::constant(corners.iter().map(|&v| of(v)).sum::<f64>() / corners.len() as f64);
    }
    mean((weight, weight1, weight2), (value, value1, value2))
}

/// A weighted mean with derivatives: the sum of weighted values over that of the weights.
fn mean(
    (weight, weight1, weight2): (f64, Vec3, Matrix3<f64>),
    (value, value1, value2): (f64, Vec3, Matrix3<f64>),
) -> Blend {
    let inv = 1.0 / weight;
    let f = value * inv;
    let gradient = (value1 - weight1 * f) * inv;
    let mixed = weight1 * gradient.transpose();
    let hessian = (value2 - weight2 * f - mixed - mixed.transpose()) * inv;
    Blend { value: f, gradient, hessian }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::WallRegion;
    use crate::vessel::{GeneratedWall, Resolution, anatomy};

    /// A tube of radius 4 mm about the z axis from 0 to 100 mm, triangles with edges of 1 mm.
    struct Tube {
        smooth: SmoothWall,
        query: WallQuery,
        regions: Option<RegionMap>,
    }

    fn tube(properties: &WallProperties) -> Tube {
        let wall = GeneratedWall::new(&anatomy::tree("straight_tube").unwrap(), Resolution::EdgeMm(1.0))
            .unwrap()
            .wall;
        let smooth = SmoothWall::new(&wall, 4.0);
        let query = WallQuery::new(&wall).unwrap();
        let regions = RegionMap::new(&query, properties);
        Tube { smooth, query, regions }
    }

    fn region(height_mm: f64, modulus: Option<f64>, friction: Option<f64>) -> WallRegion {
        WallRegion {
            centre_mm: Some([4.0, 0.0, height_mm]),
            radius_mm: Some(6.0),
            modulus_n_per_mm2: modulus,
            friction,
            ..WallRegion::default()
        }
    }

    impl Tube {
        fn triangle(&self, x: &Vec3) -> u32 {
            self.query.nearest(x, 10.0).unwrap().triangle
        }

        /// eˢψ with gradient and Hessian.
        fn energy(&self, potential: &WallPotential, x: &Vec3) -> (f64, Vec3, Matrix3<f64>) {
            let triangle = self.triangle(x);
            let d = self.smooth.distance(x, triangle).unwrap();
            let stiffness = self.regions.as_ref().unwrap().stiffness(&self.smooth, x, triangle);
            let (gradient, hessian) = stiffness.derivatives(potential, &d, 1.0);
            (stiffness.factor * potential.value(d.value_mm), gradient, hessian)
        }
    }

    /// Points about the edges of a region, from deep in the wall to outside contact, and near the axis.
    fn points() -> impl Iterator<Item = Vec3> {
        (0..400).map(|i| {
            let i = f64::from(i);
            let (angle, r) = (0.9 * (2.399 * i).sin(), 2.0 + 1.84 * (0.37 * i).sin());
            Vec3::new(r * angle.cos(), r * angle.sin(), 50.0 + 8.0 * (0.71 * i).sin())
        })
    }

    #[test]
    fn derivatives_are_those_of_the_value() {
        let h = 1e-5;
        let mut across = 0;
        for (soft, stiff) in [(1.0, 3.0), (1e-3, 1e4), (1e4, 1e-3)] {
            for radius_mm in [0.5, 3.5] {
                let regions = vec![region(50.0, Some(stiff), None)];
                let wall = tube(&WallProperties {
                    modulus_n_per_mm2: soft,
                    region: regions,
                    ..WallProperties::default()
                });
                let potential = WallPotential { modulus_n_per_mm2: soft, radius_mm };
                for x in points() {
                    let here = wall.energy(&potential, &x);
                    let triangle = wall.triangle(&x);
                    let d = wall.smooth.distance(&x, triangle).unwrap().value_mm;
                    if d - 10.0 * h < 0.0 {
                        continue;
                    }
                    let regions = wall.regions.as_ref().unwrap();
                    let s = regions.stiffness(&wall.smooth, &x, triangle);
                    across += u32::from(d < radius_mm && s.slope.unwrap().0.norm() > 0.1);
                    // Finite differences have the rounding of the energy and its gradient.
                    let scale = here.2.norm() + 10.0 * (here.1.norm() + here.0);
                    for k in 0..3 {
                        let e = Vec3::ith(k, h);
                        let plus = wall.energy(&potential, &(x + e));
                        let minus = wall.energy(&potential, &(x - e));
                        let slope = (plus.0 - minus.0) / (2.0 * h);
                        assert!((slope - here.1[k]).abs() <= 1e-6 * scale, "{x}: {slope} {}", here.1[k]);
                        let column = (plus.1 - minus.1) / (2.0 * h);
                        let error = (column - here.2.column(k)).norm();
                        assert!(error <= 1e-4 * scale, "{x} at {d}: {error:e} of {scale:e}");
                    }
                }
            }
        }
        assert!(across > 400, "{across}");
    }

    #[test]
    fn without_its_slope_the_modulus_gives_another_gradient() {
        let wall =
            tube(&WallProperties { region: vec![region(50.0, Some(30.0), None)], ..Default::default() });
        let potential = WallPotential { modulus_n_per_mm2: 1.0, radius_mm: 0.5 };
        let x = Vec3::new(3.7, 0.0, 56.0);
        let triangle = wall.triangle(&x);
        let d = wall.smooth.distance(&x, triangle).unwrap();
        let with = wall.regions.as_ref().unwrap().stiffness(&wall.smooth, &x, triangle);
        let without = Stiffness { slope: None, ..with };
        let off = with.derivatives(&potential, &d, 1.0).0 - without.derivatives(&potential, &d, 1.0).0;
        let h = 1e-5;
        let value = |x: Vec3| wall.energy(&potential, &x).0;
        let slope = (value(x + Vec3::z() * h) - value(x - Vec3::z() * h)) / (2.0 * h);
        // Softer ahead: the wall pushes forwards.
        assert!(
            off.z < -0.1 * potential.derivatives(d.value_mm).0.abs() && (slope / off.z - 1.0).abs() < 0.05
        );
    }

    #[test]
    fn moduli_are_those_of_the_last_region_and_rise_evenly_in_decades() {
        let regions = vec![region(50.0, Some(1e4), Some(0.2)), region(54.0, Some(10.0), None)];
        let properties = WallProperties {
            modulus_n_per_mm2: 1e-2,
            friction: 0.1,
            region: regions,
            ..WallProperties::default()
        };
        let wall = tube(&properties);
        let at = |x: f64, z: f64| {
            let place = Vec3::new(x, 0.0, z);
            let (regions, triangle) = (wall.regions.as_ref().unwrap(), wall.triangle(&place));
            let k = 1e-2 * regions.stiffness(&wall.smooth, &place, triangle).factor;
            (k, 0.2 * regions.rough(&wall.smooth, &place, triangle))
        };
        let near = |found: (f64, f64), k: f64, friction: f64| {
            assert!((found.0 / k - 1.0).abs() < 1e-12 && (found.1 - friction).abs() < 1e-15, "{found:?}");
        };
        near(at(3.7, 54.0), 10.0, 0.2);
        near(at(3.7, 46.0), 1e4, 0.2);
        near(at(3.7, 58.0), 10.0, 0.1);
        near(at(-3.7, 50.0), 1e-2, 0.1);
        near(at(3.7, 30.0), 1e-2, 0.1);
        // In the middle of the edge the modulus is halfway in decades, friction halfway.
        let (k, friction) = at(4.0, 44.0);
        assert!((k.log10() - 1.0).abs() < 0.3 && (friction - 0.15).abs() < 5e-3, "{k} {friction}");
    }

    #[test]
    fn walls_that_are_the_same_everywhere_store_nothing() {
        let alike = WallProperties { region: vec![region(50.0, Some(1.0), Some(0.0))], ..Default::default() };
        assert!(tube(&alike).regions.is_none());
        let rough = WallProperties { region: vec![region(50.0, None, Some(0.1))], ..Default::default() };
        let regions = tube(&rough).regions.unwrap();
        assert!(regions.ln_moduli.is_empty() && !regions.rough.is_empty());
    }
}
