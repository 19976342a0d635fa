//! The budget of a block of poses, in one call that writes into arrays of the caller.

use crate::arrays::{Array, Input, output};
use crate::machine::Machine;
use crate::samples::codes;
use numpy::{PyArrayMethods, PyReadwriteArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use truepose_kernel::Status;
use truepose_kernel::batch::{Budget, Cause, Outcome, TABLES, UNBANDED};

/// What one source does, as `error_budget.in_kernel` hands it over.
#[derive(FromPyObject)]
struct Given<'py> {
    parameters: Bound<'py, PyAny>,
    shift: Bound<'py, PyAny>,
    half: Bound<'py, PyAny>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    overall: bool,
    variables: Vec<i64>,
    sigmas: Vec<f64>,
    plain: bool,
}

/// The same with its arrays looked at.
struct Columns<'py> {
    parameters: Vec<usize>,
    variables: Vec<usize>,
    shift: Input<'py>,
    half: Input<'py>,
    given: Given<'py>,
}

impl<'py> Columns<'py> {
    fn new(machine: &Machine, given: Given<'py>) -> PyResult<Self> {
        let parameters = machine.columns(&given.parameters)?;
        let count = parameters.len();
        let shift = Input::new(&given.shift, &[count], "shift")?;
        let half = Input::new(&given.half, &[count], "half")?;
        let known = |variable: &i64| *variable < given.sigmas.len() as i64;
        let lengths = [given.lower.len(), given.upper.len(), given.variables.len()];
        if lengths != [count; 3] || !given.variables.iter().all(known) {
            return Err(unfit());
        }
        let number = |&variable: &i64| usize::try_from(variable).unwrap_or(UNBANDED);
        let variables = given.variables.iter().map(number).collect();
        Ok(Columns { parameters, variables, shift, half, given })
    }

    fn cause(&self, count: usize) -> PyResult<Cause<'_>> {
        Ok(Cause {
            parameters: &self.parameters,
            shift: self.shift.rows_if_any(count)?,
            half: self.half.rows_if_any(count)?,
            ends: [&self.given.lower, &self.given.upper],
            overall: self.given.overall,
            variables: &self.variables,
            sigmas: &self.given.sigmas,
            plain: self.given.plain,
        })
    }
}

/// Codes of the shifts, of the bands and of the edges, and highest magnitudes by name.
type Found<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyDict>);

fn unfit() -> PyErr {
    PyValueError::new_err("the arguments do not fit each other")
}

#[pymethods]
impl Machine {
    /// Fills the arrays of `tables`, by their names, with the budget of the `causes` at n poses: (status of the
    /// shifts (n,), of the bands (n,), of the edges (n,), highest magnitudes by name).
    ///
    /// A cause has attributes: `parameters` (k,), `shift` and `half` (n or 1, k), `lower` and `upper` (k,): its
    /// variables at its edges, `overall`: whether it goes there with all others, `variables` (k,): -1 of a column
    /// without a band, `sigmas` of the variables, and `plain`: whether these are independent and in [-1, 1].
    /// `quantities`: components, at most three, of each length; `all_plain`: whether all variables lie in [-1, 1];
    /// `smallest`: of which coordinate, m, there is still a percent.
    #[allow(clippy::too_many_arguments)] // Python's signature
    fn budget_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        causes: &Bound<'py, PyList>,
        quantities: Vec<Vec<usize>>,
        all_plain: bool,
        smallest: f64,
        tables: &Bound<'py, PyDict>,
    ) -> PyResult<Found<'py>> {
        let posed = self.posed(joints, placements)?;
        let samples = posed.of_placements()?;
        let count = samples.count;
        let components = self.components();
        let known = quantities.iter().all(|quantity| {
            quantity.len() <= 3 && quantity.iter().all(|&component| component < components)
        });
        if !known || quantities.len() > 3 {
            return Err(unfit());
        }
        let columns: Vec<Columns<'py>> = causes
            .iter()
            .map(|cause| Columns::new(self, cause.extract()?))
            .collect::<PyResult<_>>()?;
        let causes: Vec<Cause<'_>> =
            columns.iter().map(|columns| columns.cause(count)).collect::<PyResult<_>>()?;
        let budget = Budget::new(&self.inner, &causes, &quantities, all_plain, smallest, count);
        let mut arrays: Vec<PyReadwriteArrayDyn<'py, f64>> = Vec::with_capacity(TABLES.len());
        for (name, ..) in TABLES {
            let Some(array) = tables.get_item(name)? else { return Err(unfit()) };
            arrays.push(array.extract()?);
        }
        let mut rows = Vec::with_capacity(TABLES.len());
        for (array, width) in arrays.iter_mut().zip(budget.widths()) {
            let numbers = array.as_slice_mut()?;
            if numbers.len() != count * width {
                return Err(unfit());
            }
            rows.push(numbers);
        }
        let rows = rows.try_into().map_err(|_| unfit())?;
        let mut outcomes = vec![Outcome::OK; count];
        let found = py.detach(|| budget.fill(&samples, rows, &mut outcomes));
        let highest = PyDict::new(py);
        for ((name, _, kept), numbers) in TABLES.iter().zip(&found) {
            if *kept {
                let array: Array<'py> = output(py, &[], &[numbers.len()])?;
                array.readwrite().as_slice_mut()?.copy_from_slice(numbers);
                highest.set_item(name, array)?;
            }
        }
        let of = |which: fn(&Outcome) -> Status| -> PyResult<Bound<'py, PyAny>> {
            let status: Vec<Status> = outcomes.iter().map(which).collect();
            codes(py, &[count], &status)
        };
        let shifts = of(|outcome| outcome.shifts)?;
        Ok((shifts, of(|outcome| outcome.bands)?, of(|outcome| outcome.edges)?, highest))
    }
}
