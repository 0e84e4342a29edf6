//! Commands that are recorded, to be differentiated backwards.

use std::sync::{Mutex, PoisonError};

use endowire_core::Vec3;
use endowire_core::device::Stack;
use endowire_core::insertion;
use endowire_core::methods::{self, Parameter, Weights};
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{List, Numbers, array, points};
use crate::error::{exception, refuse};
use crate::gradient::Gradient;
use crate::report::StepReport;

/// What commands from the state of a simulation led to (`Simulation.recorded`), to be differentiated backwards: a weighted sum of it by any
/// number of parameters, at the cost of a part of a step. `len` is the number of commands.
#[pyclass(frozen, module = "endowire", name = "Recorded")]
pub(crate) struct Recorded {
    inner: Mutex<insertion::Recorded>,
    passed: Vec<methods::Passed>,
}

/// Derivatives of a weighted sum of what commands led to (`Recorded.vjp`).
#[pyclass(frozen, module = "endowire", name = "Pulled")]
pub(crate) struct Pulled {
    inner: methods::Pulled,
    by: Vec<String>,
}

impl Recorded {
    pub(crate) fn new(inner: insertion::Recorded) -> Self {
        let passed = inner.passed().to_vec();
        Self { inner: Mutex::new(inner), passed }
    }

    /// What command `k` led to, counted from the end if negative.
    fn passed(&self, k: isize) -> PyResult<&methods::Passed> {
        let count = self.passed.len();
        let index = if k < 0 { k + count as isize } else { k };
        let found = usize::try_from(index).ok().and_then(|index| self.passed.get(index));
        found
            .ok_or_else(|| refuse("k", k.to_string(), &format!("there are {count} commands, the first is 0")))
    }
}

/// Parameters that words stand for, and a word for each.
pub(crate) fn parameters(
    words: &[String],
    stack: &Stack,
) -> endowire_core::Result<(Vec<Parameter>, Vec<String>)> {
    let each = words.iter().map(|word| Parameter::named(word, stack));
    let by: Vec<Parameter> = each.collect::<endowire_core::Result<Vec<_>>>()?.into_iter().flatten().collect();
    let words = by.iter().map(|parameter| parameter.name(stack)).collect();
    Ok((by, words))
}

/// Weights of what a command led to, from a dictionary of kinds.
fn weights(given: &Bound<'_, PyDict>, passed: &methods::Passed) -> PyResult<Weights> {
    let mut all = Weights::default();
    for (kind, values) in given.iter() {
        let kind: String = kind.extract()?;
        let values: Numbers<'_> = values.extract()?;
        let list: Vec<f64> = values.as_array().iter().copied().collect();
        let nodes = passed.shape.positions_mm.len();
        let count = match &kind[..] {
            "tip" => 3,
            "shape" => 3 * nodes,
            "push_force" | "torque" => passed.report.hands().len(),
            "energy" => 1,
            "wall_force" => passed.report.contacts.len(),
            _ => {
                let remedy =
                    "must be \"tip\", \"shape\", \"push_force\", \"torque\", \"wall_force\" or \"energy\"";
                return Err(refuse("weights", format!("{kind:?}"), remedy));
            }
        };
        if list.len() != count || !list.iter().all(|value| value.is_finite()) {
            let remedy = format!("{kind:?} has {count} numbers: give a finite weight for each");
            return Err(refuse("weights", format!("of {} numbers", list.len()), &remedy));
        }
        let places = || list.chunks_exact(3).map(Vec3::from_column_slice);
        match &kind[..] {
            "tip" => all.tip_mm = places().sum(),
            "shape" => all.positions_mm = places().collect(),
            "push_force" => all.push_force_n = list,
            "torque" => all.torque_nmm = list,
            "energy" => all.energy_mj = list[0],
            _ => all.contact_forces_n = list,
        }
    }
    Ok(all)
}

#[pymethods]
impl Recorded {
    fn __len__(&self) -> usize {
        self.passed.len()
    }

    /// The report of command `k`, counted from the end if negative.
    ///
    /// Raises InputError for a command that there is not.
    #[pyo3(signature = (k=-1), text_signature = "($self, k=-1)")]
    fn report(&self, k: isize) -> PyResult<StepReport> {
        Ok(StepReport::new(self.passed(k)?.report.clone()))
    }

    /// Positions of the nodes after command `k`, mm, shape (n, 3).
    ///
    /// Raises InputError for a command that there is not.
    #[pyo3(signature = (k=-1), text_signature = "($self, k=-1)")]
    fn positions_mm<'py>(&self, py: Python<'py>, k: isize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.passed(k)?.shape.positions_mm.iter().copied())
    }

    /// Derivatives of what each command led to in parameters, words as in `Simulation.gradient`: as `Simulation.gradients`, a Gradient for each.
    ///
    /// Raises InputError for parameters that do not exist.
    #[pyo3(signature = (*, by))]
    fn gradients(&self, py: Python<'_>, by: List<String>) -> PyResult<Vec<Gradient>> {
        let found: endowire_core::Result<Vec<Gradient>> = py.detach(|| {
            let inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            let (by, words) = parameters(&by.0, inner.stack())?;
            let all = inner.gradients(&by)?.into_iter();
            Ok(all.map(|gradient| Gradient { gradient, by: words.clone() }).collect())
        });
        found.map_err(exception)
    }

    /// Derivatives of a sum of what the commands led to. `weights` are those of its numbers: a dictionary for each command from the first on,
    /// of kinds as in `Gradient.of` and a weight for each number of that kind, {"tip": [1.0, 0.0, 0.0], "push_force": [0.5]}. `by` are
    /// words for parameters, as in `Simulation.gradient`. Returns a Pulled.
    ///
    /// Raises InputError for parameters that do not exist, and for weights of other kinds or numbers.
    #[pyo3(signature = (weights, *, by=None))]
    fn vjp(
        &self,
        py: Python<'_>,
        weights: Vec<Bound<'_, PyDict>>,
        by: Option<List<String>>,
    ) -> PyResult<Pulled> {
        let passed = &self.passed;
        if weights.len() > passed.len() {
            let remedy = format!("there are {} commands: give a dictionary for each", passed.len());
            return Err(refuse("weights", format!("of {} commands", weights.len()), &remedy));
        }
        let weights = weights.iter().zip(passed).map(|(given, passed)| self::weights(given, passed));
        let weights: Vec<Weights> = weights.collect::<PyResult<_>>()?;
        let words = by.map_or_else(Vec::new, |by| by.0);
        let found: endowire_core::Result<Pulled> = py.detach(|| {
            let inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            let (by, words) = parameters(&words, inner.stack())?;
            Ok(Pulled { inner: inner.vjp(&weights, &by)?, by: words })
        });
        found.map_err(exception)
    }
}

#[pymethods]
impl Pulled {
    /// The parameters.
    #[getter]
    fn by(&self) -> Vec<String> {
        self.by.clone()
    }

    /// Derivatives by them, shape (p,).
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.by)
    }

    /// Derivatives by the advance, mm, and the rotation, rad, of each instrument's hand in each command, shape (n, n_instruments, 2): as
    /// moves of `Simulation.run`.
    #[getter]
    fn moves<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let hands = &self.inner.hands;
        let flat = hands.iter().flatten().flat_map(|hand| [hand.advance_mm, hand.rotate_rad]).collect();
        array(py, flat, [hands.len(), hands.first().map_or(0, Vec::len), 2])
    }

    /// Whether a derivative by a parameter is that on one side only: the mesh or a contact changes right there; shape (p,).
    #[getter]
    fn one_sided<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_slice(py, &self.inner.one_sided)
    }

    fn __repr__(&self) -> String {
        format!("Pulled(by={:?})", self.by)
    }
}
