//! Numbers of several elements side by side, one element per lane, and vectors and matrices of three of them.
//!
//! The same code computes four elements at once with AVX2, and one on processors without it: [`pulp`] selects at run
//! time. Lanes are independent, every operation rounds like that of a single number, and no product is fused with a
//! sum, so the bits depend neither on the number of lanes nor on the processor.
//!
//! Everything here, and all code that uses it, has to be inlined into the function that [`pulp`] compiles for the
//! processor.

use pulp::{Simd, bytemuck};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A number per lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lanes<S: Simd> {
    simd: S,
    all: S::f64s,
}

impl<S: Simd> Lanes<S> {
    /// The same number in every lane.
    #[inline(always)]
    pub(super) fn splat(simd: S, value: f64) -> Self {
        Self { simd, all: simd.splat_f64s(value) }
    }

    /// A number for each lane from `of`.
    #[inline(always)]
    pub(super) fn gather(simd: S, of: impl Fn(usize) -> f64) -> Self {
        let mut all = simd.splat_f64s(0.0);
        let lanes: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut all));
        for k in 0..S::F64_LANES {
            lanes[k] = of(k);
        }
        Self { simd, all }
    }

    /// The same number in every lane of this processor.
    #[inline(always)]
    pub(super) fn like(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    /// For storing.
    #[inline(always)]
    pub(super) fn stored(self) -> S::f64s {
        self.all
    }

    /// Adds to a stored sum.
    #[inline(always)]
    pub(super) fn add_to(self, sum: &mut S::f64s) {
        *sum = self.simd.add_f64s(*sum, self.all);
    }

    /// Subtracts from a stored sum.
    #[inline(always)]
    pub(super) fn take_from(self, sum: &mut S::f64s) {
        *sum = self.simd.sub_f64s(*sum, self.all);
    }

    /// Square root.
    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        Self { all: self.simd.sqrt_f64s(self.all), ..self }
    }

    /// 1/x.
    #[inline(always)]
    pub(super) fn inverse(self) -> Self {
        self.like(1.0) / self
    }

    /// The number in lanes where `sign` is positive, 0 in others.
    #[inline(always)]
    pub(super) fn where_positive(self, sign: Self) -> Self {
        let zero = self.simd.splat_f64s(0.0);
        let positive = self.simd.greater_than_f64s(sign.all, zero);
        Self { all: self.simd.select_f64s(positive, self.all, zero), ..self }
    }

    /// Sine and cosine.
    #[inline(always)]
    pub(super) fn sin_cos(self) -> (Self, Self) {
        let (mut sine, mut cosine) = (self.all, self.all);
        let sines: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut sine));
        let cosines: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut cosine));
        for k in 0..S::F64_LANES {
            (sines[k], cosines[k]) = libm::sincos(sines[k]);
        }
        (Self { all: sine, ..self }, Self { all: cosine, ..self })
    }
}

macro_rules! lanewise {
    ($($operator:ident $name:ident $of_lanes:ident)*) => {$(
        impl<S: Simd> $operator for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self { all: self.simd.$of_lanes(self.all, other.all), ..self }
            }
        }
        impl<S: Simd> $operator<f64> for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: f64) -> Self {
                self.$name(self.like(other))
            }
        }
    )*};
}

lanewise! { Add add add_f64s Sub sub sub_f64s Mul mul mul_f64s Div div div_f64s }

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { all: self.simd.neg_f64s(self.all), ..self }
    }
}

/// Operators that act on each component.
macro_rules! componentwise {
    ($type:ident, $($component:tt)*) => {
        impl<S: Simd> Add for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self { $($component: self.$component + other.$component),* }
            }
        }
        impl<S: Simd> Sub for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self { $($component: self.$component - other.$component),* }
            }
        }
        impl<S: Simd> Neg for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self { $($component: -self.$component),* }
            }
        }
        impl<S: Simd> Mul<Lanes<S>> for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, factor: Lanes<S>) -> Self {
                Self { $($component: self.$component * factor),* }
            }
        }
        impl<S: Simd> Mul<f64> for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, factor: f64) -> Self {
                Self { $($component: self.$component * factor),* }
            }
        }
    };
}

/// A vector per lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vector<S: Simd> {
    pub(super) x: Lanes<S>,
    pub(super) y: Lanes<S>,
    pub(super) z: Lanes<S>,
}

componentwise! { Vector, x y z }

impl<S: Simd> Vector<S> {
    /// From its components.
    #[inline(always)]
    pub(super) fn new(x: Lanes<S>, y: Lanes<S>, z: Lanes<S>) -> Self {
        Self { x, y, z }
    }

    /// The same vector in every lane.
    #[inline(always)]
    pub(super) fn splat(simd: S, [x, y, z]: [f64; 3]) -> Self {
        Self { x: Lanes::splat(simd, x), y: Lanes::splat(simd, y), z: Lanes::splat(simd, z) }
    }

    /// Its components in order.
    #[inline(always)]
    pub(super) fn components(self) -> [Lanes<S>; 3] {
        [self.x, self.y, self.z]
    }

    /// a·b.
    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> Lanes<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// a × b.
    #[inline(always)]
    pub(super) fn cross(self, b: Self) -> Self {
        Self {
            x: self.y * b.z - self.z * b.y,
            y: self.z * b.x - self.x * b.z,
            z: self.x * b.y - self.y * b.x,
        }
    }

    /// |a|.
    #[inline(always)]
    pub(super) fn norm(self) -> Lanes<S> {
        self.dot(self).sqrt()
    }

    /// a bᵀ.
    #[inline(always)]
    pub(super) fn outer(self, b: Self) -> Matrix<S> {
        Matrix { x: b * self.x, y: b * self.y, z: b * self.z }
    }
}

/// A 3 × 3 matrix per lane, by rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Matrix<S: Simd> {
    pub(super) x: Vector<S>,
    pub(super) y: Vector<S>,
    pub(super) z: Vector<S>,
}

componentwise! { Matrix, x y z }

impl<S: Simd> Matrix<S> {
    /// All zero.
    #[inline(always)]
    pub(super) fn zeros(simd: S) -> Self {
        let row = Vector::splat(simd, [0.0; 3]);
        Self { x: row, y: row, z: row }
    }

    /// The matrix with these columns.
    #[inline(always)]
    pub(super) fn of_columns(a: Vector<S>, b: Vector<S>, c: Vector<S>) -> Self {
        Self { x: Vector::new(a.x, b.x, c.x), y: Vector::new(a.y, b.y, c.y), z: Vector::new(a.z, b.z, c.z) }
    }

    /// Mᵀ.
    #[inline(always)]
    pub(super) fn transpose(self) -> Self {
        Self::of_columns(self.x, self.y, self.z)
    }

    /// M + Mᵀ.
    #[inline(always)]
    pub(super) fn with_transpose(self) -> Self {
        self + self.transpose()
    }

    /// M + d I.
    #[inline(always)]
    pub(super) fn with_diagonal(mut self, d: Lanes<S>) -> Self {
        self.x.x += d;
        self.y.y += d;
        self.z.z += d;
        self
    }

    /// M v.
    #[inline(always)]
    pub(super) fn times(self, v: Vector<S>) -> Vector<S> {
        Vector::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Mᵀ v.
    #[inline(always)]
    pub(super) fn transposed_times(self, v: Vector<S>) -> Vector<S> {
        self.transpose().times(v)
    }

    /// A B.
    #[inline(always)]
    pub(super) fn product(self, b: Self) -> Self {
        let b = b.transpose();
        Self::of_columns(self.times(b.x), self.times(b.y), self.times(b.z))
    }

    /// Entries by row and column.
    #[inline(always)]
    pub(super) fn entries(self) -> [[Lanes<S>; 3]; 3] {
        [self.x.components(), self.y.components(), self.z.components()]
    }
}

macro_rules! assigning {
    ($($type:ident)*) => {$(
        impl<S: Simd> AddAssign for $type<S> {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }
        impl<S: Simd> SubAssign for $type<S> {
            #[inline(always)]
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }
    )*};
}

assigning! { Lanes Vector Matrix }
