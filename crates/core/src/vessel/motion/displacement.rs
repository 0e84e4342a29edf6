//! The displacement field of a motion at one time: forward and inverse map, and transformation of derivatives.

use nalgebra::Matrix3;

use super::fade::Fade;
use crate::Vec3;
use crate::vessel::yielding::Bent;

/// A weighted rotation and displacement: w(X) (A X + b).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Affine {
    pub(super) matrix: Matrix3<f64>,
    pub(super) offset: Vec3,
    pub(super) fade: Option<Fade>,
}

/// The displacement of a vessel at one time: of its motion, and of its course where that yields.
#[derive(Debug, Clone, PartialEq)]
pub struct Displacement {
    modes: Vec<Affine>,
    /// Upper bound of |∂u/∂X|.
    steepest: f64,
    course: Option<Bent>,
}

/// The field near a material point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Local {
    /// F⁻¹, with F = I + ∂u/∂X.
    pub inverse: Matrix3<f64>,
    /// ∂²uₖ/∂X², 1/mm, for each component k.
    pub second: [Matrix3<f64>; 3],
}

/// Largest number of iterations; each at least halves the distance, and near the solution doubles the digits.
const MOST: usize = 60;
/// Bound of |∂u/∂X| in [`Displacement::stretch`]: motions stay below half, and a course below three quarters.
const STEEPEST: f64 = 0.9;
/// Residual, relative to a coordinate, that counts as rounding.
const ROUNDING: f64 = f64::EPSILON;
/// What is left after a step of Newton's method is its square by the field's curvature: after one below this, mm, rounding.
const LAST_MM: f64 = 1e-7;

impl Displacement {
    pub(super) fn new(modes: Vec<Affine>, steepest: f64) -> Self {
        Self { modes, steepest, course: None }
    }

    /// The motion given, or none, of a vessel whose course has yielded.
    pub(crate) fn with_course(motion: Option<Self>, course: Bent) -> Self {
        let motion = motion.unwrap_or_else(|| Self::new(Vec::new(), 0.0));
        Self { steepest: motion.steepest + course.steepest(), course: Some(course), ..motion }
    }

    /// Whether the vessel's course yields.
    pub(crate) fn has_course(&self) -> bool {
        self.course.is_some()
    }

    /// u, mm.
    pub(crate) fn displacement_mm(&self, material: &Vec3) -> Vec3 {
        let moved = self.by_modes_mm(material);
        self.course.as_ref().map_or(moved, |course| moved + course.displacement_mm(material))
    }

    /// u of the motion alone, mm.
    fn by_modes_mm(&self, material: &Vec3) -> Vec3 {
        let each = self.modes.iter().map(|mode| {
            let v = mode.matrix * material + mode.offset;
            mode.fade.map_or(v, |fade| v * fade.at_mm((material - fade.centre()).norm()))
        });
        each.sum()
    }

    /// x = X + u(X): position of a material point, mm.
    pub fn place(&self, material: &Vec3) -> Vec3 {
        material + self.displacement_mm(material)
    }

    /// x = X + u(X), mm, and F = I + ∂u/∂X.
    fn place_and_gradient(&self, material: &Vec3) -> (Vec3, Matrix3<f64>) {
        let (moved, gradient) = (self.by_modes_mm(material), self.of_modes(material));
        let Some(course) = &self.course else { return (material + moved, gradient) };
        let (by_course, own) = course.with_gradient(material);
        (material + moved + by_course, gradient + own)
    }

    /// F = I + ∂u/∂X.
    pub(crate) fn gradient(&self, material: &Vec3) -> Matrix3<f64> {
        self.place_and_gradient(material).1
    }

    /// Position of a material point, mm, and G = ∂χ/∂x there, χ being the motion of the vessel from its displacement `before`.
    pub(crate) fn since(&self, before: &Self, material: &Vec3) -> (Vec3, Matrix3<f64>) {
        let (there, gradient) = self.place_and_gradient(material);
        (there, gradient * inverse(&before.gradient(material)))
    }

    /// F of the motion alone.
    fn of_modes(&self, material: &Vec3) -> Matrix3<f64> {
        let mut gradient = Matrix3::identity();
        for mode in &self.modes {
            match mode.fade {
                None => gradient += mode.matrix,
                Some(fade) => {
                    let (w, w1, _) = fade.derivatives(material);
                    gradient += mode.matrix * w + (mode.matrix * material + mode.offset) * w1.transpose();
                }
            }
        }
        gradient
    }

    /// F⁻¹ and the second derivatives.
    pub(crate) fn local(&self, material: &Vec3) -> Local {
        let mut second = [Matrix3::zeros(); 3];
        for mode in &self.modes {
            let Some(fade) = mode.fade else { continue };
            let (_, w1, w2) = fade.derivatives(material);
            let v = mode.matrix * material + mode.offset;
            for (k, of) in second.iter_mut().enumerate() {
                let mixed = w1 * mode.matrix.row(k);
                *of += w2 * v[k] + mixed + mixed.transpose();
            }
        }
        let Some(course) = &self.course else {
            return Local { inverse: inverse(&self.gradient(material)), second };
        };
        let mut gradient = self.of_modes(material);
        course.add_local(material, &mut gradient, &mut second);
        Local { inverse: inverse(&gradient), second }
    }

    /// X with X + u(X) = x: the material point there.
    pub fn material(&self, place: &Vec3) -> Vec3 {
        self.inverse(place, place - self.displacement_mm(place))
    }

    /// As [`Self::material`], given a material point nearby; NaN where none is known.
    #[inline]
    pub(crate) fn material_near(&self, place: &Vec3, nearby: &Vec3) -> Vec3 {
        let Some(course) = &self.course else { return self.material(place) };
        if nearby.x.is_nan() {
            return self.material(place);
        }
        let of_one = if self.modes.is_empty() { course.material(place, nearby) } else { None };
        of_one.unwrap_or_else(|| self.inverse(place, *nearby))
    }

    /// X with X + u(X) = x, from an estimate. By Newton's method, one step for a rigid motion; if it does not halve the
    /// distance, X = x − u(X) does, where |∂u/∂X| is less than half.
    fn inverse(&self, place: &Vec3, estimate: Vec3) -> Vec3 {
        let off = |x: &Vec3| {
            let (there, gradient) = self.place_and_gradient(x);
            (place - there, gradient)
        };
        let mut x = estimate;
        let (mut left, mut gradient) = off(&x);
        for _ in 0..MOST {
            let size = left.norm();
            if size.is_nan() || size <= ROUNDING * place.amax() {
                break;
            }
            let step = inverse(&gradient) * left;
            if step.norm() <= LAST_MM {
                return x + step;
            }
            let nearer =
                |step: Vec3| Some((x + step, off(&(x + step)))).filter(|at| at.1.0.norm() < 0.5 * size);
            let Some(next) = nearer(step).or_else(|| nearer(left)) else { break };
            (x, (left, gradient)) = next;
        }
        x
    }

    /// Upper bound of the ratio of lengths between material points and in the moved vessel, either way: 1/(1 −
    /// |∂u/∂X|).
    pub(crate) fn stretch(&self) -> f64 {
        1.0 / (1.0 - self.steepest.min(STEEPEST))
    }
}

/// The inverse of F, which is regular where |∂u/∂X| is less than 1.
fn inverse(f: &Matrix3<f64>) -> Matrix3<f64> {
    f.try_inverse().unwrap_or_else(Matrix3::identity)
}

impl Local {
    /// Gradient and Hessian in space, given those in the reference:
    ///
    /// ```text
    /// g = F⁻ᵀ ∇φ,    F⁻ᵀ (∇∇φ − Σ gₖ ∂²uₖ/∂X²) F⁻¹
    /// ```
    pub(crate) fn in_space(&self, gradient: &Vec3, hessian: &Matrix3<f64>) -> (Vec3, Matrix3<f64>) {
        let back = self.inverse.transpose();
        let g = back * gradient;
        (g, back * (hessian - self.bent(&g)) * self.inverse)
    }

    /// Σ gₖ ∂²uₖ/∂X².
    pub(crate) fn bent(&self, g: &Vec3) -> Matrix3<f64> {
        self.second[0] * g.x + self.second[1] * g.y + self.second[2] * g.z
    }
}
