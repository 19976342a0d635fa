//! A machine's description from a Python dict: plain values, which the kernel reads.

use crate::failure::kernel_error;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyString};
use truepose_kernel::Description;
use truepose_kernel::machine::{Table, Value, WRONG_TYPE};

fn table(dict: &Bound<'_, PyDict>) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, value) in dict {
        table.insert(key.extract()?, plain(&value)?);
    }
    Ok(table)
}

fn plain(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if value.is_none() {
        return Ok(Value::Nothing);
    }
    if let Ok(number) = value.cast::<PyFloat>() {
        return Ok(Value::Number(number.value()));
    }
    // A text is a sequence too, a flag a number, and an array of one number is taken for that.
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Value::Text(text.extract()?));
    }
    if let Ok(flag) = value.extract::<bool>() {
        return Ok(Value::Flag(flag));
    }
    if let Ok(dict) = value.cast::<PyDict>() {
        return Ok(Value::Table(table(dict)?));
    }
    if let Ok(values) = value.try_iter() {
        return Ok(Value::List(values.map(|value| plain(&value?)).collect::<PyResult<_>>()?));
    }
    match value.extract() {
        Ok(number) => Ok(Value::Number(number)),
        Err(_) => Ok(Value::Other(value.get_type().name()?.to_string())),
    }
}

/// Reads the whole dict; its keys are documented in `truepose/_kernel.pyi`.
pub fn description(dict: &Bound<'_, PyDict>) -> PyResult<Description> {
    Description::read(&table(dict)?).map_err(|error| {
        if error.code == WRONG_TYPE {
            PyTypeError::new_err(error.to_string())
        } else {
            kernel_error(error)
        }
    })
}
