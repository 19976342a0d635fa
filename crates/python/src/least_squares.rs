//! The kernel's least squares on Python's own residual and Jacobian.

use crate::arrays::{Array, filled};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use truepose_kernel::identification::trust_region::{
    Linear, Options, Problem, Solution, Tolerances, minimise, square_sum,
};

/// Values, residual and Jacobian there, cost, status, evaluations, iterations.
type Minimum<'py> = (Array<'py>, Array<'py>, Array<'py>, f64, &'static str, usize, usize);

/// Callbacks, weighted and checked for their shapes; the first error ends the iteration.
struct Callbacks<'py> {
    residual: Bound<'py, PyAny>,
    jacobian: Bound<'py, PyAny>,
    weights: Option<Vec<f64>>,
    size: usize,
    failed: Option<PyErr>,
    tried: Vec<f64>,
    /// Where the slope was taken last: the residual (m,) and the rows of the Jacobian (m, n).
    here: (Vec<f64>, Vec<f64>),
}

/// What a callback returned at the values, as floats.
fn asked<'py>(callback: &Bound<'py, PyAny>, values: &[f64]) -> PyResult<Array<'py>> {
    static CONVERT: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let py = callback.py();
    let returned = callback.call1((PyArray1::from_slice(py, values),))?;
    if let Ok(array) = returned.cast::<PyArrayDyn<f64>>()
        && array.is_c_contiguous()
    {
        return Ok(array.clone());
    }
    let convert = CONVERT.import(py, "numpy", "asarray")?;
    Ok(convert.call1((returned, "float64", "C"))?.cast_into::<PyArrayDyn<f64>>()?)
}

impl<'py> Callbacks<'py> {
    fn residual(&self, values: &[f64]) -> PyResult<Vec<f64>> {
        let array = asked(&self.residual, values)?;
        if array.ndim() != 1 {
            let shape = array.getattr("shape")?;
            let message = format!("the residual has shape {shape}, expected (m,)");
            return Err(PyValueError::new_err(message));
        }
        let mut residuals = array.readonly().as_slice()?.to_vec();
        if let Some(weights) = &self.weights {
            if weights.len() != residuals.len() {
                let (weights, rows) = (weights.len(), residuals.len());
                let message = format!("weights of shape ({weights},) for a residual of {rows}");
                return Err(PyValueError::new_err(message));
            }
            residuals.iter_mut().zip(weights).for_each(|(value, weight)| *value *= weight);
        }
        Ok(residuals)
    }

    fn rows_of_jacobian(&self, values: &[f64]) -> PyResult<Vec<f64>> {
        let (rows, size) = (self.tried.len(), self.size);
        let array = asked(&self.jacobian, values)?;
        if array.shape() != [rows, size] {
            let shape = array.getattr("shape")?;
            let message = format!("the Jacobian has shape {shape}, expected ({rows}, {size})");
            return Err(PyValueError::new_err(message));
        }
        let mut jacobian = array.readonly().as_slice()?.to_vec();
        if let Some(weights) = &self.weights {
            for (row, weight) in jacobian.chunks_exact_mut(size.max(1)).zip(weights) {
                row.iter_mut().for_each(|value| *value *= weight);
            }
        }
        Ok(jacobian)
    }
}

impl Problem for Callbacks<'_> {
    fn size(&self) -> usize {
        self.size
    }

    fn cost(&mut self, values: &[f64]) -> Option<f64> {
        match self.residual(values) {
            Ok(tried) => self.tried = tried,
            Err(error) => {
                self.failed = Some(error);
                return None;
            }
        }
        let cost = square_sum(&self.tried);
        cost.is_finite().then_some(cost)
    }

    fn linearise(&mut self, values: &[f64], linear: &mut Linear) -> bool {
        let rows = match self.rows_of_jacobian(values) {
            Ok(rows) => rows,
            Err(error) => {
                self.failed = Some(error);
                return false;
            }
        };
        let fits = linear.set_dense_rows(&rows, &self.tried);
        if fits {
            self.here = (std::mem::take(&mut self.tried), rows);
        }
        fits
    }

    fn interrupted(&self) -> bool {
        self.failed.is_some()
    }
}

/// Values that minimise the sum of squares of weights * residual(values), from a start.
#[pyfunction]
#[pyo3(signature = (residual, jacobian, start, *, weights, scale, cost, step, gradient, most_evaluations, first_radius))]
#[allow(clippy::too_many_arguments)] // Python's signature
pub fn least_squares<'py>(
    py: Python<'py>,
    residual: Bound<'py, PyAny>,
    jacobian: Bound<'py, PyAny>,
    start: Vec<f64>,
    weights: Option<Vec<f64>>,
    scale: Option<Vec<f64>>,
    cost: f64,
    step: f64,
    gradient: f64,
    most_evaluations: usize,
    first_radius: f64,
) -> PyResult<Minimum<'py>> {
    let options = Options {
        tolerances: Tolerances { cost, step, gradient },
        most_evaluations,
        first_radius,
        ..Options::default()
    };
    let mut problem = Callbacks {
        residual,
        jacobian,
        weights,
        size: start.len(),
        failed: None,
        tried: Vec::new(),
        here: (Vec::new(), Vec::new()),
    };
    let solution = minimise(&mut problem, &start, scale.as_deref(), &options);
    if let Some(error) = problem.failed {
        return Err(error);
    }
    let Solution { values, cost, status, evaluations, iterations } =
        solution.map_err(|refusal| PyValueError::new_err(refusal.to_string()))?;
    let (residual, rows) = problem.here;
    Ok((
        filled(py, &[values.len()], &[], &values)?,
        filled(py, &[residual.len()], &[], &residual)?,
        filled(py, &[residual.len(), values.len()], &[], &rows)?,
        cost,
        status.name(),
        evaluations,
        iterations,
    ))
}
