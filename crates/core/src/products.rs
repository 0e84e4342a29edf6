//! Products of vectors and matrices of three, written out.
//!
//! In functions as large as those of an element, the compiler does not inline nalgebra's loops over columns. Sums are
//! taken in the library's order, so the bits are the same.

use nalgebra::Matrix3;

use crate::Vec3;

/// a bᵀ.
#[inline(always)]
pub(crate) fn outer(a: &Vec3, b: &Vec3) -> Matrix3<f64> {
    Matrix3::new(
        a.x * b.x,
        a.x * b.y,
        a.x * b.z, //
        a.y * b.x,
        a.y * b.y,
        a.y * b.z, //
        a.z * b.x,
        a.z * b.y,
        a.z * b.z,
    )
}

/// M v.
#[inline(always)]
pub(crate) fn times(m: &Matrix3<f64>, v: &Vec3) -> Vec3 {
    let row = |x: f64, y: f64, z: f64| x * v.x + y * v.y + z * v.z;
    Vec3::new(row(m.m11, m.m12, m.m13), row(m.m21, m.m22, m.m23), row(m.m31, m.m32, m.m33))
}

/// A B.
#[inline(always)]
pub(crate) fn product(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    let column = |x: f64, y: f64, z: f64| times(a, &Vec3::new(x, y, z));
    let columns = [column(b.m11, b.m21, b.m31), column(b.m12, b.m22, b.m32), column(b.m13, b.m23, b.m33)];
    let [p, q, r] = columns;
    Matrix3::new(p.x, q.x, r.x, p.y, q.y, r.y, p.z, q.z, r.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_have_the_bits_of_the_library() {
        let number = |k: u32| (f64::from(k) * 0.7371).sin() * 10f64.powi(k as i32 % 5 - 2);
        for k in 0..200 {
            let a = Matrix3::from_fn(|i, j| number(k + 3 * i as u32 + 7 * j as u32));
            let b = Matrix3::from_fn(|i, j| number(2 * k + 5 * i as u32 + j as u32));
            let (u, v) = (a.column(0).into_owned(), b.column(1).into_owned());
            assert_eq!(outer(&u, &v), u * v.transpose());
            assert_eq!(times(&a, &v), a * v);
            assert_eq!(product(&a, &b), a * b);
        }
    }
}
