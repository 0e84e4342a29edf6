//! Numbers to and from Python and numpy.

use endowire_core::Vec3;
use numpy::ndarray::Dimension;
use numpy::ndarray::IntoDimension;
use numpy::{AllowTypeChange, Element, PyArray, PyArray1, PyArray2, PyArrayLikeDyn, PyArrayMethods};
use pyo3::prelude::*;

use crate::error::refuse;

/// An array of this shape with these numbers, which it takes over.
pub(crate) fn array<'py, T: Element, D: IntoDimension>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: D,
) -> PyResult<Bound<'py, PyArray<T, D::Dim>>>
where
    D::Dim: Dimension,
{
    PyArray1::from_vec(py, numbers).reshape(shape.into_dimension())
}

/// Points as an array of shape (n, 3).
pub(crate) fn points<'py>(
    py: Python<'py>,
    points: impl IntoIterator<Item = Vec3>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let numbers: Vec<f64> = points.into_iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    let rows = numbers.len() / 3;
    array(py, numbers, [rows, 3])
}

/// Numbers of anything like an array. Of any shape, so that one of another is refused by the argument's name.
pub(crate) type Numbers<'py> = PyArrayLikeDyn<'py, f64, AllowTypeChange>;

/// The numbers of a one-dimensional array, all finite.
pub(crate) fn numbers(name: &str, list: &Numbers<'_>) -> PyResult<Vec<f64>> {
    let view = list.as_array();
    if view.ndim() != 1 {
        return Err(misshapen(name, view.shape(), "must have the shape (n,)"));
    }
    let finite = |(index, number): (usize, &f64)| match number.is_finite() {
        true => Ok(*number),
        false => Err(refuse(&format!("{name}[{index}]"), number, "must be a finite number")),
    };
    view.iter().enumerate().map(finite).collect()
}

/// The rows of a table of `N` columns.
pub(crate) fn rows<const N: usize>(name: &str, table: &Numbers<'_>) -> PyResult<Vec<[f64; N]>> {
    let view = table.as_array();
    if !matches!(view.shape(), [_, columns] if *columns == N) {
        return Err(misshapen(name, view.shape(), &format!("must have the shape (n, {N})")));
    }
    Ok(view.rows().into_iter().map(|row| std::array::from_fn(|k| row[k])).collect())
}

/// An array of another shape than it must have.
pub(crate) fn misshapen(name: &str, shape: &[usize], mend: &str) -> PyErr {
    refuse(name, format!("an array of shape {shape:?}"), mend)
}

/// A number that counts something or says which, 0 or more. Taken as one of Python's, so that a negative one is refused by the argument's name.
pub(crate) fn natural<T: TryFrom<i64>>(name: &str, number: i64) -> PyResult<T> {
    T::try_from(number).map_err(|_| refuse(name, number, "must be 0 or more"))
}
