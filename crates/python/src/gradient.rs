//! Derivatives of what a command leads to.

use endowire_core::Vec3;
use endowire_core::methods::{self, Slope};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::arrays::{Numbers, array, points};
use crate::error::refuse;
use crate::report::StepReport;

/// Derivatives of what a command would lead to (`Simulation.gradient`), in p parameters.
///
/// Contacts keep their status: those that press go on pressing, and each sticks or slips as far as friction lets it. Where the next
/// change is, `margin_n` and `margin_mm` say.
#[pyclass(frozen, module = "endowire", name = "Gradient")]
pub(crate) struct Gradient {
    pub(crate) gradient: methods::Gradient,
    /// The words for the parameters.
    pub(crate) by: Vec<String>,
}

impl Gradient {
    /// Derivatives of these numbers, one row for each parameter.
    fn rows(&self, of: &str) -> PyResult<Vec<Vec<f64>>> {
        let flat = |places: &[Vec3]| places.iter().flat_map(|place| place.iter().copied()).collect();
        let read: fn(&Slope) -> Vec<f64> = match of {
            "push_force" => {
                |slope| slope.push_force_n.iter().map(|push_n| push_n.unwrap_or(f64::NAN)).collect()
            }
            "torque" => |slope| slope.torque_nmm.clone(),
            "energy" => |slope| vec![slope.energy_mj],
            "wall_force" => |slope| slope.contact_forces_n.clone(),
            "tip" | "shape" => {
                let rows = self.gradient.slopes.iter().map(|slope| match of {
                    "tip" => flat(&[slope.tip_mm]),
                    _ => flat(&slope.positions_mm),
                });
                return Ok(rows.collect());
            }
            other => {
                let remedy =
                    "must be \"tip\", \"shape\", \"push_force\", \"torque\", \"wall_force\" or \"energy\"";
                return Err(refuse("of", format!("{other:?}"), remedy));
            }
        };
        let rows: Vec<Vec<f64>> = self.gradient.slopes.iter().map(read).collect();
        let contacts = self.gradient.report.contacts.len();
        match rows.iter().position(|row| of == "wall_force" && row.len() != contacts) {
            None => Ok(rows),
            Some(k) => {
                let remedy = "a contact opens or closes right there: its forces have no slope";
                Err(refuse("of", format!("{of:?} by {:?}", self.by[k]), remedy))
            }
        }
    }
}

/// Numbers of an array, all of them finite.
fn finite(name: &str, array: &Numbers<'_>) -> PyResult<Vec<f64>> {
    let list: Vec<f64> = array.as_array().iter().copied().collect();
    match list.iter().position(|number| !number.is_finite()) {
        Some(k) => Err(refuse(&format!("{name}[{k}]"), list[k], "must be a finite number")),
        None => Ok(list),
    }
}

#[pymethods]
impl Gradient {
    /// The parameters.
    #[getter]
    fn by(&self) -> Vec<String> {
        self.by.clone()
    }

    /// The report of the command.
    #[getter]
    fn report(&self) -> StepReport {
        StepReport::new(self.gradient.report.clone())
    }

    /// Positions of the nodes after the command, mm, shape (n, 3).
    #[getter]
    fn positions_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.gradient.shape.positions_mm.iter().copied())
    }

    /// Unit tangents at the nodes after the command, shape (n, 3).
    #[getter]
    fn tangents<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.gradient.shape.tangents.iter().copied())
    }

    /// Distances of the nodes from the tip, mm, shape (n,), from the sheath to the tip.
    #[getter(from_tip_mm)]
    fn distances_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.gradient.shape.from_tip_mm.clone())
    }

    /// Derivatives of these numbers in the parameters, shape (k, p): "tip" (x, y, z, mm), "shape" (x, y, z of all nodes, mm),
    /// "push_force" (each hand, N; NaN where it jumps), "torque" (each hand, N·mm), "wall_force" (each contact of the report, N) or
    /// "energy" (mJ). Nodes are marks on the instruments and move with them, all but the first.
    ///
    /// Raises InputError for any other, and for "wall_force" where a contact opens or closes.
    fn of<'py>(&self, py: Python<'py>, of: &str) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.rows(of)?;
        let count = rows.first().map_or(0, Vec::len);
        let turned = (0..count).flat_map(|k| rows.iter().map(move |row| row[k])).collect();
        array(py, turned, [count, rows.len()])
    }

    /// Derivatives in the parameters of the sum of these numbers times weights of the same count: the product vᵀJ, shape (p,).
    ///
    /// Raises InputError for another count, for numbers that are not finite, and what `of` raises.
    fn vjp<'py>(&self, py: Python<'py>, of: &str, v: Numbers<'_>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let weights = finite("v", &v)?;
        let rows = self.rows(of)?;
        let count = rows.first().map_or(weights.len(), Vec::len);
        if weights.len() != count {
            return Err(refuse("v", format!("of {} numbers", weights.len()), &format!("{of:?} has {count}")));
        }
        let dot = |row: &Vec<f64>| row.iter().zip(&weights).map(|(slope, weight)| slope * weight).sum();
        Ok(PyArray1::from_vec(py, rows.iter().map(dot).collect()))
    }

    /// Changes of these numbers for small changes of the parameters, shape (p,): the product J dp, shape (k,).
    ///
    /// Raises InputError for another count, for numbers that are not finite, and what `of` raises.
    fn jvp<'py>(&self, py: Python<'py>, of: &str, dp: Numbers<'_>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let changes = finite("dp", &dp)?;
        let rows = self.rows(of)?;
        if changes.len() != rows.len() {
            let remedy = format!("there are {} parameters", rows.len());
            return Err(refuse("dp", format!("of {} numbers", changes.len()), &remedy));
        }
        let count = rows.first().map_or(0, Vec::len);
        let sum = |k: usize| rows.iter().zip(&changes).map(|(row, change)| row[k] * change).sum();
        Ok(PyArray1::from_vec(py, (0..count).map(sum).collect()))
    }

    /// Whether a derivative is that on one side only: right there a contact opens or closes, or a node of the mesh comes in; shape (p,).
    #[getter]
    fn one_sided<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_vec(py, self.gradient.slopes.iter().map(|slope| slope.one_sided).collect())
    }

    /// The least force of a contact, N: without it the contact opens. Infinite without contacts.
    #[getter]
    fn margin_n(&self) -> f64 {
        self.gradient.margin.least_force_n
    }

    /// At least so far are points from the wall that do not touch it, mm.
    #[getter]
    fn margin_mm(&self) -> f64 {
        self.gradient.margin.least_gap_mm
    }

    fn __repr__(&self) -> String {
        format!("Gradient(by={:?})", self.by)
    }
}
