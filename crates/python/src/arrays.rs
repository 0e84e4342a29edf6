//! Numbers to and from numpy.

use endowire_core::Vec3;
use numpy::ndarray::Dimension;
use numpy::ndarray::IntoDimension;
use numpy::{
    AllowTypeChange, Element, PyArray, PyArray1, PyArray2, PyArrayLike1, PyArrayLike2, PyArrayMethods,
};
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

/// Numbers of anything like an array.
pub(crate) type Numbers<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;
/// A table of numbers of anything like an array.
pub(crate) type Table<'py, T> = PyArrayLike2<'py, T, AllowTypeChange>;

/// The numbers of a one-dimensional array.
pub(crate) fn numbers(list: &Numbers<'_>) -> Vec<f64> {
    list.as_array().iter().copied().collect()
}

/// The rows of a table of `N` columns.
pub(crate) fn rows<T: Element + Copy, const N: usize>(
    name: &str,
    table: &Table<'_, T>,
) -> PyResult<Vec<[T; N]>> {
    let view = table.as_array();
    if view.ncols() != N {
        let shape = format!("an array of shape {:?}", view.shape());
        return Err(refuse(name, shape, &format!("must have the shape (n, {N})")));
    }
    Ok(view.rows().into_iter().map(|row| std::array::from_fn(|k| row[k])).collect())
}
