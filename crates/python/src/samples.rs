//! What every call on many samples does: blocks without the interpreter's lock, rows in, status and
//! coordinates out.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use truepose_kernel::Status;
use truepose_kernel::batch::Rows;
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

/// Rows of `data` from sample `first` on, or its one row for all.
pub fn part(data: &[f64], width: usize, first: usize, shared: bool) -> Rows<'_> {
    if shared { Rows::shared(&data[..width]) } else { Rows::each(&data[first * width..], width) }
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
