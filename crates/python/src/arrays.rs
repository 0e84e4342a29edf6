//! Conversion of numbers to and from Python and numpy.

use endowire_core::Vec3;
use numpy::ndarray::ArrayViewD;
use numpy::ndarray::Dimension;
use numpy::ndarray::IntoDimension;
use numpy::{
    AllowTypeChange, Element, PyArray, PyArray1, PyArray2, PyArrayDescrMethods, PyArrayLikeDyn,
    PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::conversion::FromPyObjectOwned;
use pyo3::exceptions::{PyOverflowError, PyTypeError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{
    PyBool, PyByteArray, PyBytes, PyComplex, PyDict, PyFloat, PyInt, PyList, PySequence, PyString, PyTuple,
};

use crate::error::{InputError, refuse};

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
pub(crate) const MOST_ITEMS: usize = 10_000_000;
/// Lengths may be below 0 by rounding, mm.
const ROUNDING_MM: f64 = 1e-6;
/// Deepest nesting of sequences; numpy has no more dimensions.
pub(crate) const DEEPEST: usize = 64;

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
            Ok(array) if char::from(array.dtype().kind()) != OBJECTS => check_real(&object)?,
            // Its items may be anything.
            Ok(array) => {
                let mut left = MOST_NUMBERS;
                count(&array.call_method0("tolist")?, &mut left, DEEPEST)?;
            }
            Err(_) => {
                let mut left = MOST_ITEMS;
                count(&object, &mut left, DEEPEST)?;
            }
        }
        object.extract().map(Self)
    }
}

/// Kinds of numpy's types: those of real numbers, and that of any objects.
const REAL: [char; 4] = ['b', 'i', 'u', 'f'];
const OBJECTS: char = 'O';

/// Refuses what numpy and Python would take for numbers without a word: text, bytes, None, and the real part of complex
/// numbers.
fn check_real(object: &Bound<'_, PyAny>) -> PyResult<()> {
    let dtype = object.getattr_opt(intern!(object.py(), "dtype"))?;
    let kind = dtype.as_ref().map(|dtype| dtype.getattr_opt(intern!(object.py(), "kind"))).transpose()?;
    let given = match kind.flatten().and_then(|kind| kind.extract::<char>().ok()) {
        Some(kind) if REAL.contains(&kind) || kind == OBJECTS => return Ok(()),
        Some(_) => {
            format!("items of type {}", dtype.map_or(Ok(String::new()), |dtype| dtype.str()?.extract())?)
        }
        None if object.is_none()
            || object.is_instance_of::<PyString>()
            || object.is_instance_of::<PyBytes>()
            || object.is_instance_of::<PyByteArray>()
            || object.is_instance_of::<PyComplex>() =>
        {
            object.repr()?.to_string()
        }
        None => return Ok(()),
    };
    Err(PyTypeError::new_err(format!("{given}: must be real numbers")))
}

/// A real number.
pub(crate) struct Real(pub(crate) f64);

impl<'a, 'py> FromPyObject<'a, 'py> for Real {
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        check_real(&object)?;
        object.extract().map(Self)
    }
}

/// Subtracts the items of a sequence, including nested ones, from the number `left`; refuses what is no real number.
fn count(object: &Bound<'_, PyAny>, left: &mut usize, depth: usize) -> PyResult<()> {
    let items = if object.is_instance_of::<PyFloat>() || object.is_instance_of::<PyInt>() || depth == 0 {
        1
    } else if let Ok(list) = object.cast::<PyList>() {
        list.iter().try_for_each(|item| count(&item, left, depth - 1))?;
        1
    } else if let Ok(tuple) = object.cast::<PyTuple>() {
        tuple.iter().try_for_each(|item| count(&item, left, depth - 1))?;
        1
    } else {
        check_real(object)?;
        match (object.cast::<PyUntypedArray>(), object.cast::<PySequence>()) {
            (Ok(array), _) => array.len(),
            (_, Ok(sequence)) => sequence.len()?,
            _ => 1,
        }
    };
    *left = left.checked_sub(items).ok_or_else(|| too_many("sequence", items, MOST_ITEMS))?;
    Ok(())
}

pub(crate) fn too_many(what: &str, items: usize, most: usize) -> PyErr {
    refuse(what, format!("{items} items and more"), &format!("at most {most} are taken at once"))
}

/// Whether something with a length holds no items of its own: text, bytes, and a dictionary.
fn no_list(object: &Bound<'_, PyAny>) -> bool {
    object.is_instance_of::<PyString>()
        || object.is_instance_of::<PyBytes>()
        || object.is_instance_of::<PyByteArray>()
        || object.is_instance_of::<PyDict>()
}

/// The items of a sequence other than text.
pub(crate) struct List<T>(pub(crate) Vec<T>);

impl<'a, 'py, T: FromPyObjectOwned<'py>> FromPyObject<'a, 'py> for List<T> {
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        // Arrays are not a `Sequence`, but are accepted.
        let items = match object.len() {
            Ok(items) if !no_list(&object) => items,
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

/// The numbers of an argument; anything else is a `TypeError` that names it.
pub(crate) fn numbers<'py>(name: &str, object: &Bound<'py, PyAny>, wanted: &str) -> PyResult<Numbers<'py>> {
    object.extract::<Numbers<'_>>().map_err(|error| {
        if error.is_instance_of::<InputError>(object.py()) {
            return error;
        }
        PyTypeError::new_err(format!("{name} = {}: {wanted}", shown(object)))
    })
}

/// Something as it is shown in a message, on one line, as arrays are not by themselves.
pub(crate) fn shown(object: &Bound<'_, PyAny>) -> String {
    let shown = object.repr().map_or_else(|_| "…".to_owned(), |shown| shown.to_string());
    shown.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Arc lengths from the tip: the numbers of a one-dimensional array.
pub(crate) fn lengths_mm(name: &str, list: &Numbers<'_>) -> PyResult<Vec<f64>> {
    let view = list.as_array();
    if view.ndim() != 1 {
        return Err(misshapen(name, view.shape(), "must have the shape (n,)"));
    }
    let length = |(index, length_mm): (usize, &f64)| match length_mm.is_finite() && *length_mm >= -ROUNDING_MM
    {
        true => Ok(length_mm.max(0.0)),
        false => Err(refuse(&format!("{name}[{index}]"), length_mm, "must be a finite number of 0 or more")),
    };
    view.iter().enumerate().map(length).collect()
}

/// A place or a direction: three finite numbers.
pub(crate) fn place(name: &str, object: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    let wanted = "must have the shape (3,): x, y and z";
    let numbers = numbers(name, object, wanted)?;
    let view = numbers.as_array();
    match view.iter().copied().collect::<Vec<f64>>()[..] {
        [x, y, z] if view.ndim() == 1 => {
            finite(name, [x, y, z])?;
            Ok([x, y, z])
        }
        _ => Err(misshapen(name, view.shape(), wanted)),
    }
}

/// Refuses rows with numbers that are not finite.
pub(crate) fn finite<const N: usize>(name: &str, row: [f64; N]) -> PyResult<()> {
    match row.iter().all(|number| number.is_finite()) {
        true => Ok(()),
        false => Err(refuse(name, format!("{row:?}"), "every number must be finite")),
    }
}

/// The rows of a table with `N` columns.
pub(crate) fn rows<const N: usize>(name: &str, table: &Numbers<'_>) -> PyResult<Vec<[f64; N]>> {
    let view = table.as_array();
    if !matches!(view.shape(), [_, columns] if *columns == N) {
        return Err(misshapen(name, view.shape(), &format!("must have the shape (n, {N})")));
    }
    Ok(view.rows().into_iter().map(|row| std::array::from_fn(|k| row[k])).collect())
}

/// The same, and `default` if absent.
pub(crate) fn natural_or<T: TryFrom<i64>>(
    name: &str,
    object: Option<&Bound<'_, PyAny>>,
    default: T,
) -> PyResult<T> {
    object.map_or(Ok(default), |object| natural(name, object))
}

/// The error for an array of the wrong shape.
pub(crate) fn misshapen(name: &str, shape: &[usize], remedy: &str) -> PyErr {
    refuse(name, format!("an array of shape {shape:?}"), remedy)
}

/// A count or an index, 0 or more. It is taken as any object, so that the error about one that is none names the
/// argument.
pub(crate) fn natural<T: TryFrom<i64>>(name: &str, object: &Bound<'_, PyAny>) -> PyResult<T> {
    let number = match object.extract::<i64>() {
        // Python takes True for 1.
        Ok(number) if !object.is_instance_of::<PyBool>() => number,
        Err(error) if error.is_instance_of::<PyOverflowError>(object.py()) => {
            let remedy = if object.lt(0)? { "must be 0 or more" } else { "is too large a number" };
            return Err(refuse(name, object.str()?, remedy));
        }
        _ => {
            let wanted = "must be a whole number of 0 or more";
            return Err(PyTypeError::new_err(format!("{name} = {}: {wanted}", object.repr()?)));
        }
    };
    T::try_from(number).map_err(|_| refuse(name, number, "must be 0 or more"))
}
