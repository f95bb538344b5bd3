//! Core errors to the exception classes of `graspforce.errors`.

use std::ffi::CString;

use graspforce::Error;
use numpy::PyArray1;
use pyo3::intern;
use pyo3::prelude::*;

use crate::convert::read_only::read_only;
use crate::runtime::interrupt;

/// The Python exception for a core error.
pub fn to_python(py: Python<'_>, error: &Error) -> PyErr {
    let class = match error {
        Error::InvalidGrasp { .. } => "InvalidGraspError",
        Error::InvalidInput { .. } => "InvalidInputError",
        Error::InfeasibleWrench { .. } | Error::BeyondLimits { .. } => "InfeasibleWrenchError",
        Error::TooLarge { .. } | Error::OutOfMemory { .. } => "TooLargeError",
        _ => "NotConvergedError",
    };
    let raised = raise(py, class, &error.to_string());
    if let Error::InfeasibleWrench { direction, .. } | Error::BeyondLimits { direction } = error
        && let Err(failed) = raised
            .value(py)
            .setattr(intern!(py, "direction"), read_only(PyArray1::from_vec(py, direction.clone())))
    {
        return failed;
    }
    raised
}

/// The Python exception for a core error in one row of a batch, with the row as its attribute.
pub fn in_row(py: Python<'_>, row: usize, error: &Error) -> PyErr {
    let raised = to_python(py, error);
    raised.value(py).setattr(intern!(py, "row"), row).err().unwrap_or(raised)
}

/// An argument that cannot describe a grasp.
pub fn invalid_grasp(py: Python<'_>, message: impl AsRef<str>) -> PyErr {
    raise(py, "InvalidGraspError", message.as_ref())
}

/// An argument of a query that cannot be used.
pub fn invalid_input(py: Python<'_>, message: impl AsRef<str>) -> PyErr {
    raise(py, "InvalidInputError", message.as_ref())
}

/// Warns of contacts that may be wrong, where the caller's line is; an error where warnings are errors.
pub fn warn(py: Python<'_>, message: &str) -> PyResult<()> {
    let category = py.import("graspforce.errors")?.getattr("GraspWarning")?;
    let message = CString::new(message)?;
    PyErr::warn(py, &category, &message, 1)
}

/// An object that another thread is using.
pub fn busy(py: Python<'_>) -> PyErr {
    raise(py, "BusyError", "in use by another thread; give each thread a copy of its own")
}

/// Has an error of ours about one `argument` say which row of `all` it was; other errors stay as they are.
pub fn say_which_row(py: Python<'_>, error: PyErr, argument: &str, all: &str, row: usize) -> PyErr {
    let ours = || -> PyResult<bool> {
        let errors = py.import("graspforce.errors")?;
        let busy = error.is_instance(py, &errors.getattr("BusyError")?);
        Ok(!busy && error.is_instance(py, &errors.getattr("GraspForceError")?))
    };
    if !ours().unwrap_or(false) {
        return error;
    }
    let text = error.value(py).to_string();
    let rest = text.strip_prefix(argument).and_then(|rest| rest.strip_prefix(": ")).unwrap_or(&text);
    let message = format!("{all}, row {row}: {rest}");
    match error.value(py).setattr(intern!(py, "args"), (message,)) {
        Ok(()) => error,
        Err(failed) => failed,
    }
}

fn raise(py: Python<'_>, class: &str, message: &str) -> PyErr {
    if let Some(raised) = interrupt::raised() {
        return raised;
    }
    let raised = || py.import("graspforce.errors")?.getattr(class)?.call1((message,));
    match raised() {
        Ok(value) => PyErr::from_value(value),
        Err(failed) => failed,
    }
}
