//! What every call on many samples does: blocks without the interpreter's lock, rows in, status and
//! coordinates out.

use crate::arrays::{Array, Input, output};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use truepose_kernel::Status;
use truepose_kernel::batch::{Deviations, Samples};
use truepose_kernel::spatial::Pose;

/// Samples between two looks at Ctrl-C.
pub const BLOCK: usize = 65_536;

/// Calls `work(first, size)` for blocks of samples without the GIL, looking at Ctrl-C in between.
pub fn in_blocks(
    py: Python<'_>,
    count: usize,
    mut work: impl FnMut(usize, usize) + Send,
) -> PyResult<()> {
    let mut first = 0;
    while first < count {
        let size = BLOCK.min(count - first);
        py.detach(|| work(first, size));
        first += size;
        if first < count {
            py.check_signals()?;
        }
    }
    Ok(())
}

/// The status of samples as an array of numbers.
pub fn codes<'py>(
    py: Python<'py>,
    leading: &[usize],
    status: &[Status],
) -> PyResult<Bound<'py, PyAny>> {
    let numbers: Vec<u8> = status.iter().map(|&status| status as u8).collect();
    PyArray1::from_vec(py, numbers)
        .into_any()
        .call_method1("reshape", (PyTuple::new(py, leading)?,))
}

/// A new array with `further` numbers of each sample, written by `work(first, size, numbers)` in blocks.
pub fn in_blocks_into<'py>(
    py: Python<'py>,
    leading: &[usize],
    further: &[usize],
    mut work: impl FnMut(usize, usize, &mut [f64]) + Send,
) -> PyResult<Array<'py>> {
    let out = output(py, leading, further)?;
    let width: usize = further.iter().product();
    {
        let mut writable = out.readwrite();
        let numbers = writable.as_slice_mut()?;
        in_blocks(py, leading.iter().product(), |first, size| {
            work(first, size, &mut numbers[first * width..(first + size) * width]);
        })?;
    }
    Ok(out)
}

/// A result of a block with the status of each sample.
pub fn with_codes<'py>(
    py: Python<'py>,
    out: Array<'py>,
    status: &[Status],
) -> PyResult<Bound<'py, PyAny>> {
    (out, codes(py, &[status.len()], status)?).into_bound_py_any(py)
}

/// Joints and placements of a block of samples: rows for each, or one row for all.
pub struct Posed<'py> {
    pub joints: Input<'py>,
    pub placements: Input<'py>,
}

impl Posed<'_> {
    /// How many samples there are with this many rows of something else.
    pub fn count(&self, others: usize) -> usize {
        self.joints.count.max(self.placements.count).max(others)
    }

    /// As `count` samples without deviations.
    pub fn samples(&self, count: usize) -> PyResult<Samples<'_>> {
        let (joints, poses) = (self.joints.rows(count)?, self.placements.rows(count)?);
        Ok(Samples { count, joints, poses, deviations: Deviations::NONE })
    }

    /// A sample for each placement.
    pub fn of_placements(&self) -> PyResult<Samples<'_>> {
        self.samples(self.placements.count)
    }
}

/// Writes the freedoms of a pose, NaN where it is none.
pub fn write_coordinates(row: &mut [f64], freedoms: &[usize], pose: &Pose<f64>, solved: bool) {
    if !solved {
        row.fill(f64::NAN);
        return;
    }
    let coordinates = pose.to_coordinates();
    for (value, &freedom) in row.iter_mut().zip(freedoms) {
        *value = coordinates[freedom];
    }
}
