//! Errors as exceptions with the same messages. The classes are defined in Python: `endowire/errors.py`.

use endowire_core::Error;
use endowire_recording::StepFailure;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

pyo3::import_exception!(endowire.errors, InputError);
pyo3::import_exception!(endowire.errors, ComputationError);
pyo3::import_exception!(endowire.errors, EndOfWay);

/// The exception of an error.
pub(crate) fn exception(error: Error) -> PyErr {
    let text = error.to_string();
    match error {
        Error::End(_) => {
            let ended_by = StepFailure::new(0, &error).kind;
            Python::attach(|py| {
                let raised = EndOfWay::new_err(text);
                // The class has the attribute already.
                let _ = raised.value(py).setattr("ended_by", ended_by.name());
                raised
            })
        }
        // The exception raised by the signal handler.
        Error::Stopped => Python::attach(PyErr::take).unwrap_or_else(|| PyKeyboardInterrupt::new_err(())),
        error if error.is_input() => InputError::new_err(text),
        _ => ComputationError::new_err(text),
    }
}

/// The error for a value out of range, in the format of the library.
pub(crate) fn refuse(name: &str, value: impl std::fmt::Display, remedy: &str) -> PyErr {
    exception(Error::parameter(name, value, remedy))
}
