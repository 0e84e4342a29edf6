//! What the hand does, as arrays: for each instrument the length pushed in, mm, and the turn, rad.

use endowire_core::insertion::Command;
use numpy::{AllowTypeChange, PyArrayLikeDyn};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::error::refuse;

/// Moves of anything like an array, of shape (…, n_instruments, 2).
pub(crate) type Moves<'py> = PyArrayLikeDyn<'py, f64, AllowTypeChange>;

/// Instruments of a simulation.
pub(crate) const INSTRUMENTS: usize = 1;

/// The commands of an array of shape (`count`, n_instruments, 2), or of any count.
pub(crate) fn commands(moves: &Moves<'_>, count: Option<usize>) -> PyResult<Vec<Command>> {
    let view = moves.as_array();
    let fits = match view.shape() {
        [given, instruments, 2] => *instruments == INSTRUMENTS && count.is_none_or(|count| count == *given),
        _ => false,
    };
    if !fits {
        let first = count.map_or("n".to_owned(), |count| count.to_string());
        return Err(refuse(
            "moves",
            format!("an array of shape {:?}", view.shape()),
            &format!(
                "must have the shape ({first}, {INSTRUMENTS}, 2): advance_mm and rotate_rad of each instrument"
            ),
        ));
    }
    let numbers: Vec<f64> = view.iter().copied().collect();
    Ok(numbers.chunks_exact(2).map(|pair| Command { advance_mm: pair[0], rotate_rad: pair[1] }).collect())
}

/// One number, or one for each instrument: that of the only instrument.
pub(crate) fn of_only(name: &str, value: Option<&Bound<'_, PyAny>>) -> PyResult<f64> {
    let Some(value) = value else { return Ok(0.0) };
    if let Ok(number) = value.extract::<f64>() {
        return Ok(number);
    }
    let wanted = format!("must be a number, or {INSTRUMENTS}: one for each instrument");
    match value.extract::<Vec<f64>>() {
        Ok(list) if list.len() == INSTRUMENTS => Ok(list[0]),
        Ok(list) => Err(refuse(name, format!("{} numbers", list.len()), &wanted)),
        Err(_) => Err(PyTypeError::new_err(format!("{name} = {}: {wanted}", value.repr()?))),
    }
}
