//! Errors of the kernel as Python exceptions.

use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truepose_kernel::MachineError;

create_exception!(
    truepose._kernel,
    KernelError,
    PyValueError,
    "A description is no machine. args: (code, message, place)."
);

/// A machine error as an exception with its three parts.
pub fn kernel_error(error: MachineError) -> PyErr {
    KernelError::new_err((error.code, error.message, error.place))
}

/// A `truepose.errors.PoseError`: how many poses failed, the first one, its status and why.
pub fn pose_error(
    py: Python<'_>,
    count: usize,
    index: usize,
    status: &'static str,
    reason: String,
) -> PyErr {
    let raised = py
        .import("truepose.errors")
        .and_then(|module| module.getattr("PoseError"))
        .and_then(|class| class.call1((count, index, status, reason)));
    match raised {
        Ok(error) => PyErr::from_value(error),
        Err(error) => error,
    }
}

/// A `truepose.errors.ArgumentError`, which is a TypeError and a ValueError too.
pub fn argument_error(message: &str, found: &str, expected: &str) -> PyErr {
    Python::attach(|py| raised(py, "ArgumentError", "bad-argument", message, found, expected))
}

/// A `truepose.errors.RequestError` of code bad-setting.
pub fn request_error(py: Python<'_>, message: &str, found: &str, expected: &str) -> PyErr {
    raised(py, "RequestError", "bad-setting", message, found, expected)
}

fn raised(
    py: Python<'_>,
    class: &str,
    code: &str,
    message: &str,
    found: &str,
    expected: &str,
) -> PyErr {
    let raised = py.import("truepose.errors").and_then(|module| {
        let parts = PyDict::new(py);
        parts.set_item("found", found)?;
        parts.set_item("expected", expected)?;
        let problem = module.getattr("Problem")?.call((code, message), Some(&parts))?;
        module.getattr(class)?.call1((problem,))
    });
    match raised {
        Ok(error) => PyErr::from_value(error),
        Err(error) => error,
    }
}
