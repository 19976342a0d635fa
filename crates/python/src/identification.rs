//! Calibration as a Python class: a design of measurements, what it predicts, and the fit to readings.

use crate::arrays::{Input, filled, output, required};
use crate::machine::Machine;
use crate::samples::with_codes;
use numpy::PyArrayMethods;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truepose_kernel::identification::trust_region::{Options, Tolerances};
use truepose_kernel::identification::{
    self, Design, Evaluation, Instrument, OWN, Observable, Observation, Prepared, Prior, Table,
    Term,
};
use truepose_kernel::spatial::Pose;

/// A table with a row for each pose, or one for all.
fn table(entry: &Bound<'_, PyDict>, key: &str, width: usize, poses: usize) -> PyResult<Table> {
    let values: Vec<f64> = required(entry, "a design", key)?;
    if values.len() == width * poses {
        Ok(Table { values, width, shared: false })
    } else if values.len() == width {
        Ok(Table { values, width, shared: true })
    } else {
        let message =
            format!("{key}: {} numbers, expected {width} or {}", values.len(), width * poses);
        Err(PyValueError::new_err(message))
    }
}

fn instrument(entry: &Bound<'_, PyDict>, unknowns: usize) -> PyResult<Instrument> {
    let own: Vec<Option<usize>> = required(entry, "a design", "unknowns")?;
    let own: [Option<usize>; OWN] = own.try_into().map_err(|_| {
        PyValueError::new_err(format!("an instrument has {OWN} numbers of its own"))
    })?;
    if own.iter().flatten().any(|&index| index >= unknowns) {
        return Err(PyValueError::new_err("an instrument has an unknown that is not there"));
    }
    let frame: [f64; 7] = required(entry, "a design", "frame")?;
    Ok(Instrument {
        frame: Pose::from_row(&frame),
        target: required(entry, "a design", "target")?,
        axis: required(entry, "a design", "axis")?,
        zero: required(entry, "a design", "zero")?,
        on_platform: required(entry, "a design", "on_platform")?,
        unknowns: own,
    })
}

fn design(machine: &Machine, entry: &Bound<'_, PyDict>) -> PyResult<Design> {
    let machine = &machine.inner;
    let unknowns: usize = required(entry, "a design", "unknowns")?;
    let joints: Vec<f64> = required(entry, "a design", "joints")?;
    let starts: Vec<f64> = required(entry, "a design", "starts")?;
    let poses = starts.len() / 7;
    if starts.len() != 7 * poses || joints.len() != poses * machine.drives.len() {
        return Err(PyValueError::new_err("joints and starts have different numbers of rows"));
    }
    let shifted: Vec<usize> = required(entry, "a design", "shifted")?;
    let terms: Vec<(usize, usize)> = required(entry, "a design", "terms")?;
    let parameters = machine.nominal.len();
    let bad_term =
        |&(unknown, parameter): &(usize, usize)| unknown >= unknowns || parameter >= parameters;
    if shifted.iter().any(|&index| index >= parameters) || terms.iter().any(bad_term) {
        return Err(PyValueError::new_err("a term of what is not there"));
    }
    let shifts = table(entry, "shifts", shifted.len(), poses)?;
    let coefficients = table(entry, "coefficients", terms.len(), poses)?;
    let instruments: Vec<Bound<'_, PyDict>> = required(entry, "a design", "instruments")?;
    let instruments = instruments
        .iter()
        .map(|entry| instrument(entry, unknowns))
        .collect::<PyResult<Vec<Instrument>>>()?;
    type Row = (usize, Option<usize>, usize, usize, usize, Option<usize>);
    let rows: Vec<Row> = required(entry, "a design", "observations")?;
    let mut observations = Vec::with_capacity(rows.len());
    let mut last = 0;
    for (pose, other, by, observable, part, bias) in rows {
        let Some(observable) = Observable::from_number(observable) else {
            return Err(PyValueError::new_err(format!("{observable} is no observable")));
        };
        let parts = match observable {
            Observable::Parameter => parameters,
            _ if observable.of_strut() => machine.struts.len(),
            _ => usize::MAX,
        };
        let no_pose = pose >= poses || other.is_some_and(|pose| pose >= poses);
        let not_between = (observable == Observable::Separation) != other.is_some();
        let no_bias = bias.is_some_and(|index| index >= unknowns);
        let nothing = no_pose || by >= instruments.len() || part >= parts || no_bias;
        if pose < last || nothing || not_between {
            return Err(PyValueError::new_err(
                "an observation of what is not there, or out of order",
            ));
        }
        last = pose;
        observations.push(Observation { pose, other, instrument: by, observable, part, bias });
    }
    Ok(Design {
        machine: machine.clone(),
        unknowns,
        poses,
        joints,
        starts,
        shifted,
        shifts,
        terms: terms.iter().map(|&(unknown, parameter)| Term { unknown, parameter }).collect(),
        coefficients,
        instruments,
        observations,
    })
}

/// The measurements of a calibration and its unknowns.
#[pyclass(frozen, module = "truepose._kernel")]
pub struct Identification {
    inner: Prepared,
}

#[pymethods]
impl Identification {
    #[new]
    fn new(machine: &Machine, description: &Bound<'_, PyDict>) -> PyResult<Self> {
        Ok(Identification { inner: Prepared::new(design(machine, description)?) })
    }

    /// (readings (n_observation,), status (n_pose,)) for values (n,) of the unknowns.
    fn predict<'py>(
        &self,
        py: Python<'py>,
        values: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let values = Input::new(values, &[self.inner.design.unknowns], "values")?;
        let out = output(py, &[self.inner.design.observations.len()], &[])?;
        let mut evaluation = Evaluation::new(&self.inner);
        evaluation.place(values.data());
        evaluation.predict(values.data(), out.readwrite().as_slice_mut()?);
        with_codes(py, out, &evaluation.status)
    }

    /// (derivatives (n_observation, n), status (n_pose,)) of the readings to the unknowns.
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        values: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let count = self.inner.design.unknowns;
        let values = Input::new(values, &[count], "values")?;
        let out = output(py, &[self.inner.design.observations.len()], &[count])?;
        let mut evaluation = Evaluation::new(&self.inner);
        let mut array = out.readwrite();
        let data = array.as_slice_mut()?;
        data.fill(f64::NAN);
        evaluation.place(values.data());
        evaluation.jacobian(data);
        drop(array);
        with_codes(py, out, &evaluation.status)
    }

    /// (values (n_set, n), cost (n_set,), endings, evaluations) of fits to `measured`
    /// (n_set, n_observation), each from `start` (n,).
    #[allow(clippy::too_many_arguments)] // Python's signature
    fn solve<'py>(
        &self,
        py: Python<'py>,
        measured: &Bound<'py, PyAny>,
        weights: &Bound<'py, PyAny>,
        prior_rows: &Bound<'py, PyAny>,
        prior_mean: &Bound<'py, PyAny>,
        start: &Bound<'py, PyAny>,
        tolerances: (f64, f64, f64),
        most_evaluations: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let design = &self.inner.design;
        let (count, unknowns) = (design.observations.len(), design.unknowns);
        let measured = Input::new(measured, &[count], "measured")?;
        let weights = Input::new(weights, &[count], "weights")?;
        let rows = Input::new(prior_rows, &[unknowns], "prior_rows")?;
        let mean = Input::new(prior_mean, &[unknowns], "prior_mean")?;
        let start = Input::new(start, &[unknowns], "start")?;
        let prior = Prior { rows: rows.data().to_vec(), mean: mean.data().to_vec() };
        let (cost, step, gradient) = tolerances;
        let options = Options {
            tolerances: Tolerances { cost, step, gradient },
            most_evaluations,
            first_radius: f64::INFINITY,
            ..Options::default()
        };
        let (read, weighted, from) = (measured.data(), weights.data(), start.data());
        let fits = py.detach(|| {
            identification::fit_many(&self.inner, read, weighted, &prior, from, &options)
        });
        let numbers: Vec<f64> = fits.iter().flat_map(|fit| &fit.values).copied().collect();
        let values = filled(py, &[fits.len()], &[unknowns], &numbers)?;
        let costs: Vec<f64> = fits.iter().map(|fit| fit.cost).collect();
        let costs = filled(py, &[fits.len()], &[], &costs)?;
        let endings: Vec<&str> =
            fits.iter().map(|fit| fit.ended.map_or("unreachable", |ended| ended.name())).collect();
        let evaluations: Vec<usize> = fits.iter().map(|fit| fit.evaluations).collect();
        (values, costs, endings, evaluations).into_bound_py_any(py)
    }
}
