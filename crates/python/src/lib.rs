//! `truepose._kernel`: the kernel as a Python module. Conversion, shapes and errors only.

mod arrays;
mod blocks;
mod budget;
mod code;
mod description;
mod elements;
mod evaluate;
mod failure;
mod gcode;
mod identification;
mod largest;
mod least_squares;
mod limbs;
mod machine;
mod once;
mod proof;
mod quantity;
mod samples;
mod sampling;
mod toml_lines;

use pyo3::prelude::*;
use pyo3::types::{PyInt, PyTuple};
use truepose_kernel::Status;
use truepose_kernel::batch::{self, InstructionSet};

/// Sets (where a number is given) and returns the number of threads that share a batch.
#[pyfunction]
#[pyo3(signature = (n=None))]
fn threads(n: Option<&Bound<'_, PyAny>>) -> PyResult<usize> {
    let expected = format!("a whole number from 1 to {}", batch::MOST_THREADS);
    let refused = |found: &str| {
        failure::argument_error("so many threads cannot share a batch", found, &expected)
    };
    if let Some(given) = n {
        match given.extract::<usize>() {
            Ok(count) if (1..=batch::MOST_THREADS).contains(&count) => batch::set_threads(count),
            Ok(count) if count > 0 => {
                return Err(refused(&given.to_string()));
            }
            _ if given.is_instance_of::<PyInt>() => {
                return Err(refused(&given.to_string()));
            }
            _ => {
                return Err(refused(&format!("something of type {}", given.get_type().name()?)));
            }
        }
    }
    Ok(batch::threads())
}

/// The instruction set that batches run on: "scalar", "portable", "avx2" or "avx512".
#[pyfunction]
fn instruction_set() -> &'static str {
    batch::instruction_set().name()
}

/// Runs batches on the named instruction set, or on the best there is ("best").
#[pyfunction]
fn use_instruction_set(name: &str) -> PyResult<()> {
    let set = match name {
        "best" => None,
        _ => match InstructionSet::ALL.into_iter().find(|set| set.name() == name) {
            Some(set) => Some(set),
            None => {
                let message = format!("{name:?} is none of scalar, portable, avx2, avx512, best");
                return Err(pyo3::exceptions::PyValueError::new_err(message));
            }
        },
    };
    if batch::use_instruction_set(set) {
        Ok(())
    } else {
        let message = format!("this processor does not have {name}");
        Err(pyo3::exceptions::PyRuntimeError::new_err(message))
    }
}

/// Uses the number of threads that TRUEPOSE_THREADS asks for, if it is set.
fn threads_from_environment(py: Python<'_>) -> PyResult<()> {
    let Some(text) = std::env::var_os("TRUEPOSE_THREADS") else { return Ok(()) };
    let text = text.to_string_lossy();
    match text.trim().parse::<usize>() {
        Ok(count) if (1..=batch::MOST_THREADS).contains(&count) => {
            batch::set_threads(count);
            Ok(())
        }
        _ => Err(failure::request_error(
            py,
            "TRUEPOSE_THREADS is no number of threads",
            &text,
            &format!("a whole number from 1 to {}", batch::MOST_THREADS),
        )),
    }
}

#[pymodule]
fn _kernel(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    threads_from_environment(py)?;
    module.add("STATUS", PyTuple::new(py, Status::ALL.map(Status::name))?)?;
    module.add("KernelError", py.get_type::<failure::KernelError>())?;
    module.add_class::<machine::Machine>()?;
    gcode::register(module)?;
    module.add_class::<identification::Identification>()?;
    module.add_class::<sampling::Variables>()?;
    module.add_class::<sampling::Tallies>()?;
    module.add_class::<sampling::Points>()?;
    module.add_class::<sampling::Study>()?;
    module.add_function(wrap_pyfunction!(threads, module)?)?;
    module.add_function(wrap_pyfunction!(instruction_set, module)?)?;
    module.add_function(wrap_pyfunction!(use_instruction_set, module)?)?;
    module.add_function(wrap_pyfunction!(elements::elements, module)?)?;
    module.add_function(wrap_pyfunction!(largest::largest, module)?)?;
    module.add_function(wrap_pyfunction!(least_squares::least_squares, module)?)?;
    module.add_function(wrap_pyfunction!(toml_lines::toml_lines, module)?)?;
    module.add_function(wrap_pyfunction!(machine::_rebuild, module)?)?;
    Ok(())
}
