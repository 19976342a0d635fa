//! Arrays in and out: any real dtype and layout in, C-contiguous float64 out.

use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use truepose_kernel::batch::Rows;

use crate::failure::argument_error;

/// An array of results.
pub type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// An array of rows: any leading shape, a fixed last dimension.
pub struct Input<'py> {
    array: PyReadonlyArrayDyn<'py, f64>,
    /// The shape before the last dimension.
    pub leading: Vec<usize>,
    /// The last dimension.
    pub width: usize,
    /// Product of `leading`.
    pub count: usize,
    /// The argument's name in messages.
    what: &'static str,
}

/// Rows that were given to a call, of which one may fail.
#[derive(Clone, Copy)]
pub enum Given<'a, 'py> {
    Commands(&'a Input<'py>),
    Joints(&'a Input<'py>),
}

impl<'py> Input<'py> {
    /// From anything that NumPy takes for a real array. `widths` lists the last dimensions that are
    /// allowed; `what` names the argument and its last dimension in messages.
    pub fn new(object: &Bound<'py, PyAny>, widths: &[usize], what: &'static str) -> PyResult<Self> {
        let array = contiguous(object, what)?;
        let shape = array.shape();
        let Some((&width, leading)) = shape.split_last() else {
            let message = format!("{what}: a single number has no rows");
            let expected = format!("an array (..., {})", widths[0]);
            return Err(argument_error(&message, "shape ()", &expected));
        };
        if !widths.contains(&width) {
            let expected: Vec<String> =
                widths.iter().map(|width| format!("(..., {width})")).collect();
            let message = format!("{what}: this is no shape of the argument");
            let expected = format!("an array {}", expected.join(" or "));
            return Err(argument_error(&message, &format!("shape {shape:?}"), &expected));
        }
        let (leading, count) = (leading.to_vec(), leading.iter().product());
        Ok(Input { array, leading, width, count, what })
    }

    /// The numbers, row after row.
    pub fn data(&self) -> &[f64] {
        self.array.as_slice().unwrap_or(&[])
    }

    /// Whether there is exactly one row without leading shape, or a leading shape of one.
    pub fn is_single(&self) -> bool {
        self.count == 1
    }

    /// A row for each of `count` samples, or one row for all.
    pub fn rows(&self, count: usize) -> PyResult<Rows<'_>> {
        if self.count == 1 {
            Ok(Rows::shared(self.data()))
        } else if self.count == count {
            Ok(Rows::each(self.data(), self.width))
        } else {
            let message = format!("{}: these are not as many rows as samples", self.what);
            Err(argument_error(
                &message,
                &format!("{} rows for {count} samples", self.count),
                &format!("{count} or 1"),
            ))
        }
    }

    /// The same of an argument that may have no columns, of which any number of rows will do.
    pub fn rows_if_any(&self, count: usize) -> PyResult<Rows<'_>> {
        if self.width == 0 { Ok(Rows::shared(&[])) } else { self.rows(count) }
    }
}

/// A C-contiguous float64 array with the object's numbers; the object itself where it is one.
fn contiguous<'py>(
    object: &Bound<'py, PyAny>,
    what: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    if let Ok(array) = object.cast_exact::<PyArrayDyn<f64>>()
        && array.is_c_contiguous()
    {
        return Ok(array.readonly());
    }
    let py = object.py();
    static ASARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let asarray = ASARRAY.import(py, "numpy", "ascontiguousarray")?;
    let refused = |found: String| {
        let message = format!("{what}: expected real numbers");
        Err(argument_error(&message, &found, "an array of real numbers"))
    };
    let Ok(array) = asarray.call1((object,)) else {
        return refused(format!("something of type {}", object.get_type().name()?));
    };
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["f", "i", "u", "b"].contains(&kind.as_str()) {
        return refused(format!("dtype {}", array.getattr("dtype")?));
    }
    // A masked array says which of its numbers do not count, which an array of them cannot.
    if let Ok(mask) = object.getattr("mask")
        && mask.call_method0("any").is_ok_and(|any| any.is_truthy().unwrap_or(true))
    {
        return refused("a masked array with numbers that do not count".to_owned());
    }
    // ascontiguousarray makes a scalar an array of one; keep it a scalar for the shape's message.
    let shape_source =
        if object.hasattr("ndim")? && object.getattr("ndim")?.extract::<usize>()? == 0 {
            array.call_method1("reshape", (pyo3::types::PyTuple::empty(py),))?
        } else {
            array
        };
    let array = shape_source.call_method1("astype", ("float64", "C"))?;
    Ok(array.cast::<PyArrayDyn<f64>>()?.readonly())
}

/// From this many numbers on a result is not zeroed first: every number of it is written anyway.
const LARGE: usize = 4096;

/// A new array of the leading shape and further dimensions, to be written whole.
pub fn output<'py>(py: Python<'py>, leading: &[usize], further: &[usize]) -> PyResult<Array<'py>> {
    let shape: Vec<usize> = leading.iter().chain(further).copied().collect();
    if shape.iter().product::<usize>() < LARGE {
        return Ok(PyArrayDyn::zeros(py, shape, false));
    }
    static EMPTY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let empty = EMPTY.import(py, "numpy", "empty")?;
    Ok(empty.call1((shape,))?.cast_into::<PyArrayDyn<f64>>()?)
}

/// A new array of these numbers.
pub fn filled<'py>(
    py: Python<'py>,
    leading: &[usize],
    further: &[usize],
    numbers: &[f64],
) -> PyResult<Array<'py>> {
    let out = output(py, leading, further)?;
    out.readwrite().as_slice_mut()?.copy_from_slice(numbers);
    Ok(out)
}

/// A value that a dict must have; `of` is what the dict describes.
pub fn required<'py, T>(entry: &Bound<'py, PyDict>, of: &str, key: &str) -> PyResult<T>
where
    T: FromPyObjectOwned<'py>,
{
    match entry.get_item(key)? {
        Some(value) => value.extract().map_err(Into::into),
        None => Err(PyValueError::new_err(format!("{of} has no {key:?}"))),
    }
}
