//! Commands as arrays: advance, mm, rotation, rad, and, where there is any, change of the steering of each instrument.

use endowire_core::insertion::{Command, Move};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::arrays::{Numbers, misshapen, numbers, shown};
use crate::error::refuse;

/// The commands of all `instruments`, for each of `count` entries, or for any number of them: an array of shape
/// (count, instruments, 2) or, with steering, (count, instruments, 3).
pub(crate) fn moves(
    moves: &Numbers<'_>,
    count: Option<usize>,
    instruments: usize,
) -> PyResult<Vec<Vec<Move>>> {
    let view = moves.as_array();
    let fits = match view.shape() {
        [given, hands, 2 | 3] => *hands == instruments && count.is_none_or(|count| count == *given),
        _ => false,
    };
    if !fits {
        let first = count.map_or("n".to_owned(), |count| count.to_string());
        let remedy = format!(
            "must have the shape ({first}, {instruments}, 2): advance_mm and rotate_rad of each instrument, or ({first}, \
             {instruments}, 3) with the change of its steering"
        );
        return Err(misshapen("moves", view.shape(), &remedy));
    }
    let columns = view.shape()[2];
    let list: Vec<f64> = view.iter().copied().collect();
    let hands = |row: &[f64]| {
        together(row.chunks_exact(columns).map(|own| Command {
            advance_mm: own[0],
            rotate_rad: own[1],
            steer: own.get(2).copied().unwrap_or(0.0),
        }))
    };
    Ok(list.chunks_exact(columns * instruments).map(hands).collect())
}

/// Simultaneous moves from the commands of the instruments in order.
pub(crate) fn together(commands: impl Iterator<Item = Command>) -> Vec<Move> {
    commands.enumerate().map(|(instrument, command)| Move { instrument, command }).collect()
}

/// One number per instrument: a list, or a single number for a single instrument; zeros if absent.
pub(crate) fn of_each(
    name: &str,
    value: Option<&Bound<'_, PyAny>>,
    instruments: usize,
) -> PyResult<Vec<f64>> {
    let Some(value) = value else { return Ok(vec![0.0; instruments]) };
    let wanted = match instruments {
        1 => "must be a number, or 1: one for each instrument".to_owned(),
        count => format!("must be {count} numbers: one for each instrument, the innermost first"),
    };
    let numbers = numbers(name, value, &wanted)?;
    let view = numbers.as_array();
    let list: Vec<f64> = view.iter().copied().collect();
    match (view.ndim(), list.as_slice()) {
        (0, _) if instruments == 1 => Ok(list),
        (1, _) if list.len() == instruments => Ok(list),
        (0, [number]) => Err(refuse(name, number, &wanted)),
        (1, _) => Err(refuse(name, format!("{} numbers", list.len()), &wanted)),
        _ => Err(PyTypeError::new_err(format!("{name} = {}: {wanted}", shown(value)))),
    }
}
