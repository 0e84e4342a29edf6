//! What the hand does, as arrays: for each instrument the length pushed in, mm, and the turn, rad.

use endowire_core::insertion::Command;
use numpy::{AllowTypeChange, PyArrayLikeDyn};
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

/// One number, or one for each instrument.
#[derive(FromPyObject)]
pub(crate) enum Each {
    One(f64),
    List(Vec<f64>),
}

impl Each {
    /// The number of the only instrument.
    pub(crate) fn only(&self, name: &str) -> PyResult<f64> {
        match self {
            Self::One(value) => Ok(*value),
            Self::List(list) => match list[..] {
                [value] => Ok(value),
                _ => Err(refuse(
                    name,
                    format!("{} numbers", list.len()),
                    &format!("must be one number, or {INSTRUMENTS}: one for each instrument"),
                )),
            },
        }
    }
}
