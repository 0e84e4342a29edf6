//! Conversion of numbers to and from Python and numpy.

use endowire_core::Vec3;
use numpy::ndarray::ArrayViewD;
use numpy::ndarray::Dimension;
use numpy::ndarray::IntoDimension;
use numpy::{
    AllowTypeChange, Element, PyArray, PyArray1, PyArray2, PyArrayLikeDyn, PyArrayMethods, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::conversion::FromPyObjectOwned;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyInt, PyList, PySequence, PyString, PyTuple};

use crate::error::refuse;

/// An array of this shape that takes over these numbers.
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

/// Largest number of elements of an array: 800 MB. An array with repeated elements needs no memory until it is
/// copied.
const MOST_NUMBERS: usize = 100_000_000;
/// Largest number of items of any other sequence, including nested ones. `range(10**12)` needs no memory either.
const MOST_ITEMS: usize = 10_000_000;
/// Deepest nesting of sequences; numpy has no more dimensions.
const DEEPEST: usize = 64;

/// Numbers of anything array-like, of any shape, so that errors about the shape can name the argument.
pub(crate) struct Numbers<'py>(PyArrayLikeDyn<'py, f64, AllowTypeChange>);

impl Numbers<'_> {
    pub(crate) fn as_array(&self) -> ArrayViewD<'_, f64> {
        self.0.as_array()
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Numbers<'py> {
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        match object.cast::<PyUntypedArray>() {
            Ok(array) if array.len() > MOST_NUMBERS => {
                return Err(too_many("array", array.len(), MOST_NUMBERS));
            }
            Ok(_) => {}
            Err(_) => {
                let mut left = MOST_ITEMS;
                count(&object, &mut left, DEEPEST)?;
            }
        }
        object.extract().map(Self)
    }
}

/// Subtracts the items of a sequence, including nested ones, from the number `left`.
fn count(object: &Bound<'_, PyAny>, left: &mut usize, depth: usize) -> PyResult<()> {
    let items = if object.is_instance_of::<PyFloat>() || object.is_instance_of::<PyInt>() || depth == 0 {
        1
    } else if let Ok(list) = object.cast::<PyList>() {
        list.iter().try_for_each(|item| count(&item, left, depth - 1))?;
        1
    } else if let Ok(tuple) = object.cast::<PyTuple>() {
        tuple.iter().try_for_each(|item| count(&item, left, depth - 1))?;
        1
    } else if let Ok(array) = object.cast::<PyUntypedArray>() {
        array.len()
    } else if let Ok(sequence) = object.cast::<PySequence>() {
        sequence.len()?
    } else {
        1
    };
    *left = left.checked_sub(items).ok_or_else(|| too_many("sequence", items, MOST_ITEMS))?;
    Ok(())
}

fn too_many(what: &str, items: usize, most: usize) -> PyErr {
    refuse(what, format!("{items} items and more"), &format!("at most {most} are taken at once"))
}

/// The items of a sequence other than text.
pub(crate) struct List<T>(pub(crate) Vec<T>);

impl<'a, 'py, T: FromPyObjectOwned<'py>> FromPyObject<'a, 'py> for List<T> {
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        // Arrays are not a `Sequence`, but are accepted.
        let items = match object.len() {
            Ok(items) if !object.is_instance_of::<PyString>() && !object.is_instance_of::<PyDict>() => items,
            _ => return Err(PyTypeError::new_err(format!("{} is no list", object.repr()?))),
        };
        if items > MOST_ITEMS {
            return Err(too_many("sequence", items, MOST_ITEMS));
        }
        // Extracts the items one by one, as many as its length says.
        let item = |index| object.get_item(index)?.extract::<T>().map_err(Into::into);
        (0..items).map(item).collect::<PyResult<_>>().map(Self)
    }
}

/// The numbers of a one-dimensional array; all must be finite.
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

/// The rows of a table with `N` columns.
pub(crate) fn rows<const N: usize>(name: &str, table: &Numbers<'_>) -> PyResult<Vec<[f64; N]>> {
    let view = table.as_array();
    if !matches!(view.shape(), [_, columns] if *columns == N) {
        return Err(misshapen(name, view.shape(), &format!("must have the shape (n, {N})")));
    }
    Ok(view.rows().into_iter().map(|row| std::array::from_fn(|k| row[k])).collect())
}

/// The error for an array of the wrong shape.
pub(crate) fn misshapen(name: &str, shape: &[usize], mend: &str) -> PyErr {
    refuse(name, format!("an array of shape {shape:?}"), mend)
}

/// A count or an index, 0 or more. It is taken as a signed integer, so that the error about a negative one names the
/// argument.
pub(crate) fn natural<T: TryFrom<i64>>(name: &str, number: i64) -> PyResult<T> {
    T::try_from(number).map_err(|_| refuse(name, number, "must be 0 or more"))
}
