//! The contact surface of a vessel that moves.
//!
//! Queries are made in the reference configuration, where nothing has to be recomputed, and knowledge stays with the
//! vessel's material points: for a point x the wall is queried at X, x = X + u(X) ([`Displacement::material`]). Only
//! distances and their derivatives are transformed to the moved wall.
//!
//! With f the distance in the reference and F = I + ∂u/∂X, the moved wall is f(X(x)) = 0, and the gap along its normal is, to first order in f,
//!
//! ```text
//! d(x) = f s,    s = (1 + q)^(−1/2),    q = ∇fᵀ (F⁻¹F⁻ᵀ − I) ∇f / φ(|∇f|²)
//! ```
//!
//! which is f |∇f|/|F⁻ᵀ∇f| with φ(n) = n: s is a stretch along one direction, however steep f is at the edge of the
//! quadrics' supports. Below n = ½ it is φ(n) = n + 4 (½ − n)³, so that s is smooth where ∇f vanishes. In a rigid
//! motion F⁻¹F⁻ᵀ = I and d = f to rounding. Otherwise the error of d is at most ½ f² (|κ| + |∂²u|) |∂u|, κ the
//! curvature of the wall: some micrometres at a radius of half a millimetre in a vessel of 3 mm with a strain of a
//! twentieth.
//!
//! With D = F⁻¹F⁻ᵀ − I, g = ∇f, H = ∇∇f, p = gᵀDg, n = |g|², Uₖ = ∂²uₖ/∂X², m = F⁻ᵀg and b = F⁻¹m,
//!
//! ```text
//! ∇p  = 2 H D g − 2 (Σ mₖ Uₖ) b,    ∇n = 2 H g,    ∇q = (∇p − q φ′ ∇n)/φ
//! ∇∇p ≈ 2 H D H + 2 (∇H) D g,    (∇H) v ≈ −(g·v) H² − g (H²v)ᵀ − (H²v) gᵀ
//! ∇∇q ≈ (∇∇p − φ′ (∇q ∇nᵀ + ∇n ∇qᵀ) − q φ″ ∇n ∇nᵀ)/φ
//! ∇s  = −½ s³ ∇q,    ∇∇s = ¾ s⁵ ∇q ∇qᵀ − ½ s³ ∇∇q
//! ∇(fs) = s g + f ∇s,    ∇∇(fs) = s H + g ∇sᵀ + ∇s gᵀ + f ∇∇s
//! ```
//!
//! The gradient is exact. In the Hessian f ∇∇s is that of a true distance, H g = 0 and so on, to a wall of constant
//! curvature, and without ∂²u: the neglected terms are f times a strain times |∇κ|, and f κ |∂²u|, thousandths of H.
//! Both are transformed into space by the chain rule ([`Local::in_space`]).
//!
//! Where the vessel's course yields, sections turn with it with little strain, and gaps are those of the vessel at
//! rest, d(x) = f(X(x)), with ∇d = F⁻ᵀ∇f: then the change of d with the unknowns of the course is exactly that of x, so that
//! what device and vessel exert on each other is equal and opposite.

use std::ops::Deref;

use super::distance::Nearness;
use super::regions::Stiffness;
use super::surface::Hint;
use super::{ContactSurface, Distance};
use crate::Vec3;
use crate::products::outer;
use crate::vessel::motion::{Displacement, Local};
use nalgebra::Matrix3;

/// The contact surface at one displacement of its vessel. Methods through [`Deref`] refer to the reference.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MovedWall<'a> {
    surface: &'a ContactSurface,
    displacement: Option<&'a Displacement>,
}

impl<'a> From<&'a ContactSurface> for MovedWall<'a> {
    /// The wall of a vessel that is not displaced.
    fn from(surface: &'a ContactSurface) -> Self {
        Self { surface, displacement: None }
    }
}

impl Deref for MovedWall<'_> {
    type Target = ContactSurface;

    fn deref(&self) -> &ContactSurface {
        self.surface
    }
}

impl<'a> MovedWall<'a> {
    /// The wall displaced.
    pub(crate) fn new(surface: &'a ContactSurface, displacement: Option<&'a Displacement>) -> Self {
        Self { surface, displacement }
    }

    /// Whether material points are displaced.
    pub(super) fn is_displaced(&self) -> bool {
        self.displacement.is_some()
    }

    /// The material point at position `x`.
    pub(crate) fn material(&self, x: &Vec3) -> Vec3 {
        self.displacement.map_or(*x, |displacement| displacement.material(x))
    }

    /// The material point at position `x`, given one nearby.
    #[inline]
    pub(crate) fn material_near(&self, x: &Vec3, nearby: &Vec3) -> Vec3 {
        self.displacement.map_or(*x, |displacement| displacement.material_near(x, nearby))
    }

    /// Position of a material point.
    pub(crate) fn place(&self, material: &Vec3) -> Vec3 {
        self.displacement.map_or(*material, |displacement| displacement.place(material))
    }

    /// A unit direction in the reference, at a material point, transformed to space.
    pub(super) fn carried(&self, material: &Vec3, direction: &Vec3) -> Vec3 {
        let Some(displacement) = self.displacement else { return *direction };
        (direction + displacement.gradient(material) * direction).normalize()
    }

    /// Upper bound of the ratio of motions in space and in the reference, either way.
    pub(super) fn motion_stretch(&self) -> f64 {
        self.displacement.map_or(1.0, Displacement::stretch)
    }

    /// Upper bound of the ratio of distances from the wall and lengths in the reference, either way.
    pub(super) fn stretch(&self) -> f64 {
        self.displacement.filter(|moved| !moved.has_course()).map_or(1.0, Displacement::stretch)
    }

    /// As [`ContactSurface::nearness`] of a material point, with the distance in space.
    pub(super) fn nearness(&self, material: &Vec3, hint: Hint, limit_mm: f64) -> Nearness {
        let Some(displacement) = self.displacement else {
            return self.surface.nearness(material, hint, limit_mm);
        };
        if displacement.has_course() {
            let near = self.surface.nearness(material, hint, limit_mm);
            let Nearness::Within(Distance { value_mm, gradient, hessian }) = near else { return near };
            let (gradient, hessian) = displacement.local(material).in_space(&gradient, &hessian);
            return Nearness::Within(Distance { value_mm, gradient, hessian });
        }
        // The value in space needs the gradient in the reference.
        let wanted_mm = limit_mm.max(self.surface.reach_mm) * displacement.stretch();
        match self.surface.nearness(material, hint, wanted_mm) {
            Nearness::Beyond(value_mm) => Nearness::Beyond(value_mm / displacement.stretch()),
            Nearness::Clear(value_mm) => Nearness::Clear(value_mm / displacement.stretch()),
            Nearness::Within(distance) => {
                let moved = moved(&distance, &displacement.local(material));
                if moved.value_mm < limit_mm {
                    Nearness::Within(moved)
                } else {
                    Nearness::Beyond(moved.value_mm)
                }
            }
        }
    }

    /// As [`ContactSurface::stiffness`] of a material point, with derivatives in space.
    pub(super) fn stiffness(&self, material: &Vec3, triangle: Option<u32>) -> Stiffness {
        let Stiffness { factor, slope } = self.surface.stiffness(material, triangle);
        let slope = slope.map(|(s1, s2)| match self.displacement {
            Some(displacement) => displacement.local(material).in_space(&s1, &s2),
            None => (s1, s2),
        });
        Stiffness { factor, slope }
    }
}

/// The modified |∇f|² with its derivatives: unchanged except near zero, where it stays positive.
fn size(n: f64) -> [f64; 3] {
    let below = (0.5 - n).max(0.0);
    [n + 4.0 * below.powi(3), 1.0 - 12.0 * below * below, 24.0 * below]
}

/// The distance in space, given that in the reference.
fn moved(f: &Distance, local: &Local) -> Distance {
    let Distance { value_mm, gradient: g, hessian: h } = f;
    let back = local.inverse.transpose();
    let metric = local.inverse * back - Matrix3::identity();
    let (strained, m) = (metric * g, back * g);
    let p = g.dot(&strained);
    let [size, size1, size2] = size(g.norm_squared());
    let q = p / size;
    // s⁻² is the square of |F⁻ᵀ| along one direction, or nearer to 1.
    let s = 1.0 / (1.0 + q).sqrt();
    let square = h * h;
    let turned = square * strained;
    let along = outer(g, &turned);
    let p1 = (h * strained - local.bent(&m) * (local.inverse * m)) * 2.0;
    let p2 = (h * metric * h - square * p - along - along.transpose()) * 2.0;
    let n1 = h * g * 2.0;
    let q1 = (p1 - n1 * (q * size1)) / size;
    let across = outer(&q1, &n1) * size1;
    let q2 = (p2 - across - across.transpose() - outer(&n1, &n1) * (q * size2)) / size;
    let s1 = q1 * (-0.5 * s * s * s);
    let s2 = outer(&q1, &q1) * (0.75 * s.powi(5)) - q2 * (0.5 * s * s * s);
    let mixed = outer(g, &s1);
    let hessian = h * s + mixed + mixed.transpose() + s2 * *value_mm;
    let (gradient, hessian) = local.in_space(&(g * s + s1 * *value_mm), &hessian);
    Distance { value_mm: value_mm * s, gradient, hessian }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{WallProperties, WallRegion};
    use crate::vessel::motion::{Around, MotionMode, Turn, Waveform};
    use crate::vessel::{GeneratedWall, NoStore, Resolution, VesselMotion, anatomy};
    use nalgebra::{Rotation3, Unit};

    /// The distance inside a torus about z: a tube of radius 3 mm around a circle of 20 mm.
    fn torus(x: &Vec3) -> Distance {
        let value = |x: &Vec3| 3.0 - ((x.xy().norm() - 20.0).powi(2) + x.z * x.z).sqrt();
        let gradient = |x: &Vec3| {
            let ring = Vec3::new(x.x, x.y, 0.0).normalize() * 20.0;
            -(x - ring).normalize()
        };
        let h = 1e-5;
        let column =
            |k: usize| (gradient(&(x + Vec3::ith(k, h))) - gradient(&(x - Vec3::ith(k, h)))) / (2.0 * h);
        let hessian = Matrix3::from_columns(&[column(0), column(1), column(2)]);
        Distance { value_mm: value(x), gradient: gradient(x), hessian: (hessian + hessian.transpose()) * 0.5 }
    }

    fn mode() -> MotionMode {
        MotionMode {
            waveform: Waveform::Steady,
            period_s: None,
            phase: 0.0,
            displacement_mm: [1.0, 2.0, 10.0],
            turn: None,
            still: None,
            within: None,
        }
    }

    /// A field with a strain of a tenth at the torus.
    fn breathing() -> Displacement {
        let still = Some(Around { centre_mm: [-70.0, 5.0, -10.0], radius_mm: 20.0, fade_mm: 120.0 });
        VesselMotion::new(&[MotionMode { still, ..mode() }]).unwrap().unwrap().at(0.0)
    }

    /// Positions near the wall of the torus, seen from its tube's middle.
    fn places(depth_mm: f64) -> impl Iterator<Item = Vec3> {
        (0..60).map(move |k| {
            let (around, along) = (0.7 * f64::from(k), 0.31 * f64::from(k));
            let ring = Vec3::new(along.cos(), along.sin(), 0.0);
            ring * (20.0 + (3.0 - depth_mm) * around.cos()) + Vec3::z() * ((3.0 - depth_mm) * around.sin())
        })
    }

    #[test]
    fn derivatives_are_those_of_the_gap() {
        let field = breathing();
        let gap = |x: &Vec3| {
            let material = field.material(x);
            moved(&torus(&material), &field.local(&material))
        };
        let h = 1e-4;
        let mut strain: f64 = 0.0;
        for material in places(0.5) {
            let x = field.place(&material);
            let here = gap(&x);
            strain = strain.max((field.gradient(&material) - Matrix3::identity()).norm());
            // Without the change of the normal the gradient would be that of f alone.
            let plain = field.local(&material).in_space(&torus(&material).gradient, &Matrix3::zeros()).0;
            assert!((plain - here.gradient).norm() > 1e-5);
            for k in 0..3 {
                let (plus, minus) = (gap(&(x + Vec3::ith(k, h))), gap(&(x - Vec3::ith(k, h))));
                let slope = (plus.value_mm - minus.value_mm) / (2.0 * h);
                assert!((slope - here.gradient[k]).abs() < 1e-8, "{slope} {}", here.gradient[k]);
                let bend = (plus.gradient - minus.gradient) / (2.0 * h);
                // Neglected terms: f times a strain of 0.15 times |∇κ| = 1/60, and f κ |∂²u|.
                assert!((bend - here.hessian.column(k)).norm() < 2e-3, "{bend} {}", here.hessian);
            }
            assert!((here.gradient.norm() - 1.0).abs() < 0.02, "{}", here.gradient.norm());
        }
        assert!(strain > 0.1, "{strain}");
    }

    /// At the edge of the quadrics' supports the distance is steep, and flat on a vessel's axis.
    #[test]
    fn what_is_no_distance_is_stretched_as_one_and_has_its_own_gradient() {
        let field = breathing();
        // k d, plus curvature.
        let felt = |k: f64, x: &Vec3| {
            let Distance { value_mm: d, gradient, hessian } = torus(x);
            let (slope, bend) = (k * (1.0 + 0.8 * (d - 0.5)), 0.8 * k);
            let value_mm = k * (d + 0.4 * (d - 0.5).powi(2));
            Distance {
                value_mm,
                gradient: gradient * slope,
                hessian: hessian * slope + outer(&gradient, &gradient) * bend,
            }
        };
        for k in [0.05, 0.3, 0.71, 1.0, 3.0, 12.0] {
            let gap = |x: &Vec3| {
                let material = field.material(x);
                moved(&felt(k, &material), &field.local(&material))
            };
            let mut least_stretch: f64 = 1.0;
            for material in places(0.5).step_by(7) {
                let x = field.place(&material);
                let (here, f) = (gap(&x), felt(k, &material));
                let stretch = here.value_mm / f.value_mm;
                assert!((1.0 / field.stretch()..=field.stretch()).contains(&stretch), "{k}: {stretch}");
                least_stretch = least_stretch.min(stretch);
                let h = 1e-5;
                for axis in 0..3 {
                    let (plus, minus) = (gap(&(x + Vec3::ith(axis, h))), gap(&(x - Vec3::ith(axis, h))));
                    let slope = (plus.value_mm - minus.value_mm) / (2.0 * h);
                    assert!((slope - here.gradient[axis]).abs() < 1e-7 * k.max(1.0), "{k}: {slope}");
                }
            }
            assert!(k < 0.5 || least_stretch < 0.97, "{k}: {least_stretch}");
        }
    }

    #[test]
    fn the_gap_is_that_of_the_moved_surface() {
        let field = breathing();
        // The distance to the moved surface, from its points near the closest.
        let exact = |x: &Vec3| {
            let at = |a: f64, b: f64| {
                let ring = Vec3::new(a.cos(), a.sin(), 0.0);
                (field.place(&(ring * (20.0 + 3.0 * b.cos()) + Vec3::z() * (3.0 * b.sin()))) - x).norm()
            };
            let material = field.material(x);
            let (mut a, mut b) =
                (material.y.atan2(material.x), material.z.atan2(material.xy().norm() - 20.0));
            let mut size = 0.05;
            while size > 1e-9 {
                let steps = [(0.0, 0.0), (size, 0.0), (-size, 0.0), (0.0, size), (0.0, -size)];
                let better =
                    steps.into_iter().min_by(|p, q| at(a + p.0, b + p.1).total_cmp(&at(a + q.0, b + q.1)));
                match better.unwrap() {
                    (0.0, 0.0) => size *= 0.5,
                    step => (a, b) = (a + step.0, b + step.1),
                }
            }
            at(a, b)
        };
        let (mut off, mut plain): (f64, f64) = (0.0, 0.0);
        for material in places(0.5) {
            let x = field.place(&material);
            let f = torus(&material);
            let true_mm = exact(&x);
            off = off.max((moved(&f, &field.local(&material)).value_mm - true_mm).abs());
            plain = plain.max((f.value_mm - true_mm).abs());
        }
        // The error if the distance in the reference were used.
        assert!(plain > 0.03, "{plain}");
        assert!(off < 0.002, "{off}");
    }

    #[test]
    fn regions_of_the_wall_go_with_it() {
        let tree = anatomy::tree("straight_tube").unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(1.0)).unwrap().wall;
        let region = WallRegion {
            centre_mm: Some([4.0, 0.0, 50.0]),
            radius_mm: Some(6.0),
            transition_mm: Some(8.0),
            modulus_n_per_mm2: Some(10.0),
            ..WallRegion::default()
        };
        let properties =
            WallProperties { deviation_mm: 0.0, region: vec![region], ..WallProperties::default() };
        let surface = ContactSurface::new(&wall, (0.5, 0.5), &properties, &NoStore).unwrap();
        let still = Some(Around { centre_mm: [0.0, 0.0, 0.0], radius_mm: 10.0, fade_mm: 90.0 });
        let field = VesselMotion::new(&[MotionMode { still, ..mode() }]).unwrap().unwrap().at(0.0);
        let moved = MovedWall::new(&surface, Some(&field));
        let mut steepest: f64 = 0.0;
        for k in 0..12 {
            let material = Vec3::new(3.4, 0.2 * f64::from(k) - 1.0, 42.0 + f64::from(k));
            let triangle = surface.nearest_piece(&material, 5.0).map(|(piece, _)| piece);
            let at = |x: &Vec3| moved.stiffness(&moved.material(x), triangle);
            let x = field.place(&material);
            assert_eq!(at(&x).factor, surface.stiffness(&moved.material(&x), triangle).factor);
            let (s1, s2) = at(&x).slope.unwrap();
            let h = 1e-4;
            for k in 0..3 {
                let (plus, minus) = (at(&(x + Vec3::ith(k, h))), at(&(x - Vec3::ith(k, h))));
                let slope = (plus.factor.ln() - minus.factor.ln()) / (2.0 * h);
                assert!((slope - s1[k]).abs() < 1e-6, "{slope} {}", s1[k]);
                let bend = (plus.slope.unwrap().0 - minus.slope.unwrap().0) / (2.0 * h);
                assert!((bend - s2.column(k)).norm() < 1e-5, "{bend} {s2}");
            }
            steepest = steepest.max(s1.norm());
        }
        assert!(steepest > 0.1, "{steepest}");
    }

    #[test]
    fn a_rigid_motion_moves_the_distance_with_it() {
        let tree = anatomy::tree("curved_tube").unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(1.5)).unwrap().wall;
        let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
        let surface = ContactSurface::new(&wall, (0.5, 0.5), &properties, &NoStore).unwrap();
        let turn = Some(Turn { centre_mm: [5.0, 0.0, 20.0], axis: [1.0, 2.0, 0.5], angle_deg: 12.0 });
        let field = VesselMotion::new(&[MotionMode { turn, ..mode() }]).unwrap().unwrap().at(0.0);
        let (at_rest, displaced) = (MovedWall::from(&surface), MovedWall::new(&surface, Some(&field)));
        let rotation =
            Rotation3::from_axis_angle(&Unit::new_normalize(Vec3::new(1.0, 2.0, 0.5)), 12f64.to_radians());
        let mut seen = 0;
        for (index, vertex) in wall.mesh().vertices_mm.iter().enumerate().step_by(17) {
            let material = vertex + Vec3::new(0.3, -0.2, 0.1) * f64::from(index as u32 % 3);
            let Some((piece, _)) = surface.nearest_piece(&material, 5.0) else { continue };
            let x = field.place(&material);
            let found = displaced.nearness(&displaced.material(&x), Hint::Near(piece), 0.5);
            match (at_rest.nearness(&material, Hint::Near(piece), 0.5), found) {
                (Nearness::Within(was), Nearness::Within(is)) => {
                    seen += 1;
                    assert!((was.value_mm - is.value_mm).abs() < 1e-12);
                    assert!((rotation * was.gradient - is.gradient).norm() < 1e-12);
                    let turned = rotation.matrix() * was.hessian * rotation.matrix().transpose();
                    assert!((turned - is.hessian).norm() < 1e-11);
                }
                (Nearness::Beyond(_), Nearness::Beyond(is)) => assert!(is >= 0.5),
                (was, is) => panic!("{was:?} {is:?}"),
            }
        }
        assert!(seen > 20, "{seen}");
    }
}
