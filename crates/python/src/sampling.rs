//! Monte Carlo as Python classes: variables, a study of a machine at poses, and the tallies of its samples.

use crate::arrays::{Array, Input, filled, output, required};
use crate::machine::Machine;
use crate::samples::codes;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truepose_kernel::Status;
use truepose_kernel::machine::{indices_of, parts};
use truepose_kernel::sampling::{
    self, Columns, Copula, Shape, StudyPose, Tally, Variable, Whitening,
};
use truepose_kernel::spatial::Pose;

fn variable(entry: &Bound<'_, PyDict>) -> PyResult<Variable> {
    let kind: String = required(entry, "a variable", "kind")?;
    let sigmas: f64 = required(entry, "a variable", "sigmas")?;
    let shape = match kind.as_str() {
        "uniform" => Shape::Uniform,
        "triangular" => Shape::Triangular,
        "arcsine" => Shape::Arcsine,
        "two-point" => Shape::TwoPoint,
        "normal" => Shape::Normal(1.0 / sigmas),
        "student-t" => {
            let dof: f64 = required(entry, "a variable", "dof")?;
            Shape::StudentT { dof, scale: ((dof - 2.0) / dof).sqrt() / sigmas }
        }
        "discrete" => {
            let mut sum = 0.0;
            let mut cumulative: Vec<f64> = required(entry, "a variable", "probabilities")?;
            for value in &mut cumulative {
                sum += *value;
                *value = sum;
            }
            Shape::Discrete { values: required(entry, "a variable", "values")?, cumulative }
        }
        _ => return Err(PyValueError::new_err(format!("{kind:?} is no distribution"))),
    };
    Ok(Variable {
        shape,
        stream: required(entry, "a variable", "stream")?,
        number: required(entry, "a variable", "number")?,
    })
}

/// Independent or correlated variables, each of a distribution, and components of directions.
#[pyclass(frozen, module = "truepose._kernel")]
pub struct Variables {
    inner: sampling::Variables,
}

#[pymethods]
impl Variables {
    #[new]
    #[pyo3(signature = (variables, members=vec![], factor=vec![], directions=vec![]))]
    fn new(
        variables: Vec<Bound<'_, PyDict>>,
        members: Vec<usize>,
        factor: Vec<f64>,
        directions: Vec<Vec<usize>>,
    ) -> PyResult<Self> {
        let count = variables.len();
        if factor.len() != members.len() * members.len() || members.iter().any(|&m| m >= count) {
            return Err(PyValueError::new_err("members and factor do not fit the variables"));
        }
        if directions.iter().flatten().any(|&m| m >= count || members.contains(&m)) {
            return Err(PyValueError::new_err("the directions do not fit the variables"));
        }
        let variables = variables.iter().map(variable).collect::<PyResult<Vec<_>>>()?;
        let copula = (!members.is_empty()).then_some(Copula { members, factor });
        Ok(Variables { inner: sampling::Variables::new(variables, copula, directions) })
    }

    /// (count, n_variable) the samples from number `first` on.
    fn draw<'py>(
        &self,
        py: Python<'py>,
        seed: u64,
        first: u64,
        count: usize,
    ) -> PyResult<Array<'py>> {
        let out = output(py, &[count], &[self.inner.count()])?;
        self.inner.rows(seed, first, count, out.readwrite().as_slice_mut()?);
        Ok(out)
    }
}

/// Values (count, n_variable) of the variables at points that poses share.
#[pyclass(frozen, module = "truepose._kernel")]
pub struct Points {
    inner: sampling::Points,
}

#[pymethods]
impl Points {
    #[new]
    fn new(values: &Bound<'_, PyAny>, variables: usize) -> PyResult<Self> {
        let values = Input::new(values, &[variables], "values")?;
        Ok(Points { inner: sampling::Points::new(values.data(), variables) })
    }
}

/// Centre (3) and matrix (3 x 3) of a row.
fn whitening_of(row: &[f64]) -> Whitening {
    Whitening {
        centre: [row[0], row[1], row[2]],
        matrix: [0, 1, 2].map(|k| [0, 1, 2].map(|j| row[3 + 3 * k + j])),
    }
}

/// What is kept of the samples at some poses: columns, the first of which have a covariance.
#[pyclass(module = "truepose._kernel")]
pub struct Tallies {
    inner: Vec<Tally>,
}

impl Tallies {
    fn table<'py>(
        &self,
        py: Python<'py>,
        further: &[usize],
        row: impl Fn(&Tally) -> Vec<f64>,
    ) -> PyResult<Array<'py>> {
        let rows: Vec<f64> = self.inner.iter().flat_map(row).collect();
        filled(py, &[self.inner.len()], further, &rows)
    }

    fn columns(&self) -> usize {
        self.inner.first().map_or(0, Tally::columns)
    }
}

#[pymethods]
impl Tallies {
    #[new]
    fn new(
        origins: &Bound<'_, PyAny>,
        widths: &Bound<'_, PyAny>,
        columns: usize,
        covariant: usize,
    ) -> PyResult<Self> {
        let origins = Input::new(origins, &[columns], "origins")?;
        let widths = Input::new(widths, &[columns], "widths")?;
        if widths.count != origins.count || covariant > columns {
            return Err(PyValueError::new_err("origins, widths and columns do not fit"));
        }
        if !widths.data().iter().all(|width| *width > 0.0 && width.is_finite()) {
            return Err(PyValueError::new_err("a width is not above 0"));
        }
        let rows = origins.data().chunks(columns).zip(widths.data().chunks(columns));
        Ok(Tallies { inner: rows.map(|(o, w)| Tally::new(o, w, covariant)).collect() })
    }

    /// The same without samples.
    fn blank(&self) -> Self {
        Tallies { inner: self.inner.iter().map(Tally::blank).collect() }
    }

    /// Adds samples (count, n_column) to the first pose.
    fn add(&mut self, py: Python<'_>, values: &Bound<'_, PyAny>) -> PyResult<()> {
        let values = Input::new(values, &[self.columns()], "values")?;
        let rows = values.data();
        let width = values.width;
        let Some(tally) = self.inner.first_mut() else { return Ok(()) };
        py.detach(|| rows.chunks(width).for_each(|row| tally.add(row)));
        Ok(())
    }

    /// Appends a column to every pose: the length of its `positions` (n_pose, count, 3), NaN without a
    /// result, taken as `whitening` (n_pose, 12) says; in bins of the order of `width`.
    fn append_lengths(
        &mut self,
        py: Python<'_>,
        positions: &Bound<'_, PyAny>,
        whitening: &Bound<'_, PyAny>,
        width: f64,
    ) -> PyResult<()> {
        let positions = Input::new(positions, &[3], "positions")?;
        let whitening = Input::new(whitening, &[12], "whitening")?;
        let poses = self.inner.len();
        if whitening.count != poses
            || poses == 0
            || !positions.count.is_multiple_of(poses)
            || !(width > 0.0 && width.is_finite())
        {
            return Err(PyValueError::new_err("positions, whitening and poses do not fit"));
        }
        let (rows, each) = (positions.data(), 3 * (positions.count / poses));
        let whitening = whitening.data();
        py.detach(|| {
            for (i, tally) in self.inner.iter_mut().enumerate() {
                let whitening = whitening_of(&whitening[12 * i..12 * i + 12]);
                let lengths = rows[each * i..each * (i + 1)]
                    .chunks(3)
                    .filter(|row| !row[0].is_nan())
                    .map(|row| whitening.length([row[0], row[1], row[2]]));
                tally.append(0.0, width, lengths);
            }
        });
        Ok(())
    }

    /// Counts samples of the first pose that have no result.
    fn fail(&mut self, count: u64) {
        if let Some(tally) = self.inner.first_mut() {
            tally.failed[Status::NotConverged as usize] += count;
        }
    }

    /// Adds the samples of other tallies of the same origins and widths.
    fn merge(&mut self, other: &Tallies) -> PyResult<()> {
        if other.inner.len() != self.inner.len() || other.columns() != self.columns() {
            return Err(PyValueError::new_err("the tallies are of other columns or poses"));
        }
        for (one, more) in self.inner.iter_mut().zip(&other.inner) {
            one.merge(more.clone());
        }
        Ok(())
    }

    /// (n_pose,) samples with a result.
    #[getter]
    fn count<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.inner.iter().map(|tally| tally.count() as i64))
    }

    /// (n_pose,) samples without a result.
    #[getter]
    fn failed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let sums = self.inner.iter().map(|tally| tally.failed.iter().sum::<u64>() as i64);
        PyArray1::from_iter(py, sums)
    }

    /// (n_pose, n_column).
    #[getter]
    fn mean<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let columns = self.columns();
        self.table(py, &[columns], |tally| (0..columns).map(|c| tally.mean(c)).collect())
    }

    /// (n_pose, n, n) of the n columns that have one.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let n = self.inner.first().map_or(0, Tally::covariant);
        self.table(py, &[n, n], |tally| {
            (0..n * n).map(|k| tally.covariance(k / n, k % n)).collect()
        })
    }

    /// (n_pose, n_column, n_share) the values below which lie the shares of the samples.
    fn quantiles<'py>(&self, py: Python<'py>, shares: Vec<f64>) -> PyResult<Array<'py>> {
        let columns = self.columns();
        self.table(py, &[columns, shares.len()], |tally| {
            (0..columns).flat_map(|column| tally.quantiles(column, &shares)).collect()
        })
    }

    /// (n_pose, n_column, 2) the narrowest interval that holds a share of the samples.
    fn shortest<'py>(&self, py: Python<'py>, share: f64) -> PyResult<Array<'py>> {
        let columns = self.columns();
        self.table(py, &[columns, 2], |tally| {
            (0..columns).flat_map(|column| tally.shortest(column, share)).collect()
        })
    }

    /// (n_pose, n_column, 2) smallest and largest value.
    #[getter]
    fn extremes<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let columns = self.columns();
        self.table(py, &[columns, 2], |tally| {
            (0..columns).flat_map(|column| tally.extremes(column)).collect()
        })
    }
}

/// A machine at poses, ready for sampling.
#[pyclass(frozen, module = "truepose._kernel")]
pub struct Study {
    machine: truepose_kernel::Machine,
    columns: Columns,
    poses: Vec<StudyPose>,
}

#[pymethods]
impl Study {
    /// `joints` (n, n_joint), `placements` (n, 7) of the commands; `shifted` (k0,) parameters and their
    /// `shift` (n or 1, k0); `parameters` and `variables` (k,) of the columns and their `swing` (n or 1, k);
    /// `whitening` (n, 12): centre (3) and matrix (3 x 3) of the position error, or None.
    #[new]
    #[allow(clippy::too_many_arguments)] // Python's signature
    #[pyo3(signature = (machine, joints, placements, shifted, shift, parameters, variables, swing, whitening=None))]
    fn new(
        py: Python<'_>,
        machine: &Machine,
        joints: &Bound<'_, PyAny>,
        placements: &Bound<'_, PyAny>,
        shifted: &Bound<'_, PyAny>,
        shift: &Bound<'_, PyAny>,
        parameters: &Bound<'_, PyAny>,
        variables: Vec<usize>,
        swing: &Bound<'_, PyAny>,
        whitening: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let shifted = machine.columns(shifted)?;
        let parameters = machine.columns(parameters)?;
        let posed = machine.posed(joints, placements)?;
        let machine = &machine.inner;
        let shift = Input::new(shift, &[shifted.len()], "shift")?;
        let swing = Input::new(swing, &[parameters.len()], "swing")?;
        let whitening = whitening.map(|rows| Input::new(rows, &[12], "whitening")).transpose()?;
        if variables.len() != parameters.len() {
            return Err(PyValueError::new_err("as many variables as parameters are needed"));
        }
        let samples = posed.of_placements()?;
        let count = samples.count;
        let (shifts, swings) = (shift.rows_if_any(count)?, swing.rows_if_any(count)?);
        let given = whitening.as_ref().map(Input::data);
        let poses = py.detach(|| {
            let pose = |i: usize| {
                let mut centre = machine.nominal.clone();
                for (&parameter, value) in shifted.iter().zip(shifts.row(i)) {
                    centre[parameter] += value;
                }
                let swing = swings.row(i).to_vec();
                let nominal = Pose::from_row(samples.poses.row(i));
                let whitening = given.map(|rows| whitening_of(&rows[12 * i..12 * i + 12]));
                StudyPose::new(machine, samples.joints.row(i), &nominal, centre, swing, whitening)
            };
            (0..count).map(pose).collect()
        });
        let columns = Columns::new(&parameters, &variables);
        Ok(Study { machine: machine.clone(), columns, poses })
    }

    /// (n,) what became of the machine with its parameters at their shifts.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let status: Vec<_> = self.poses.iter().map(|pose| pose.status).collect();
        codes(py, &[status.len()], &status)
    }

    /// (n, n_component) error at the shifts.
    #[getter]
    fn shift_error<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let components = indices_of(&self.machine.dof);
        let rows: Vec<f64> = self
            .poses
            .iter()
            .flat_map(|pose| components.iter().map(|&k| pose.shift_error[k]))
            .collect();
        filled(py, &[self.poses.len()], &[components.len()], &rows)
    }

    /// Evaluates samples at every pose into `tallies`, one a pose.
    fn sample(
        &self,
        py: Python<'_>,
        variables: &Variables,
        seed: u64,
        first: u64,
        count: usize,
        tallies: &mut Tallies,
    ) -> PyResult<()> {
        self.check(tallies, variables.inner.count())?;
        let study = self.study(&variables.inner, seed, None);
        py.detach(|| sampling::sample(&study, first, count, &mut tallies.inner));
        Ok(())
    }

    /// As `sample`; returns the position errors (n, count, 3), NaN of a sample without a result.
    fn sample_keeping<'py>(
        &self,
        py: Python<'py>,
        variables: &Variables,
        seed: u64,
        first: u64,
        count: usize,
        tallies: &mut Tallies,
    ) -> PyResult<Array<'py>> {
        self.check(tallies, variables.inner.count())?;
        let study = self.study(&variables.inner, seed, None);
        let kept = py.detach(|| sampling::sample_keeping(&study, first, count, &mut tallies.inner));
        filled(py, &[self.poses.len(), count], &[3], &kept)
    }

    /// As `sample_given`; returns the position errors (n, count, 3), NaN of a sample without a result.
    fn sample_given_keeping<'py>(
        &self,
        py: Python<'py>,
        variables: &Variables,
        values: &Bound<'_, PyAny>,
        tallies: &mut Tallies,
    ) -> PyResult<Array<'py>> {
        self.check(tallies, variables.inner.count())?;
        let values = Input::new(values, &[variables.inner.count()], "values")?;
        let (count, rows) = (values.count, values.data());
        let study = self.study(&variables.inner, 0, Some(rows));
        let kept = py.detach(|| sampling::sample_keeping(&study, 0, count, &mut tallies.inner));
        filled(py, &[self.poses.len(), count], &[3], &kept)
    }

    /// Exact errors (n_point, n_component) at the pose numbered `pose`, NaN without a result; how many
    /// points have none.
    fn errors<'py>(
        &self,
        py: Python<'py>,
        pose: usize,
        points: &Points,
    ) -> PyResult<(Array<'py>, usize)> {
        let Some(at) = self.poses.get(pose) else {
            return Err(PyValueError::new_err("there is no such pose"));
        };
        let points = &points.inner;
        if self.columns.variables() > points.variables() {
            return Err(PyValueError::new_err("a variable is needed for every column"));
        }
        let out = output(py, &[points.count()], &[indices_of(&self.machine.dof).len()])?;
        let failed = {
            let mut writable = out.readwrite();
            let numbers = writable.as_slice_mut()?;
            py.detach(|| sampling::errors(&self.machine, &self.columns, at, points, numbers))
        };
        Ok((out, failed))
    }

    /// Evaluates samples of given variables (count, n_variable) at every pose into `tallies`.
    fn sample_given(
        &self,
        py: Python<'_>,
        variables: &Variables,
        values: &Bound<'_, PyAny>,
        tallies: &mut Tallies,
    ) -> PyResult<()> {
        self.check(tallies, variables.inner.count())?;
        let values = Input::new(values, &[variables.inner.count()], "values")?;
        let (count, rows) = (values.count, values.data());
        let study = self.study(&variables.inner, 0, Some(rows));
        py.detach(|| sampling::sample(&study, 0, count, &mut tallies.inner));
        Ok(())
    }
}

impl Study {
    fn study<'a>(
        &'a self,
        variables: &'a sampling::Variables,
        seed: u64,
        given: Option<&'a [f64]>,
    ) -> sampling::Study<'a> {
        let (machine, columns) = (&self.machine, &self.columns);
        sampling::Study { machine, variables, columns, poses: &self.poses, given, seed }
    }

    fn check(&self, tallies: &Tallies, variables: usize) -> PyResult<()> {
        let components = indices_of(&self.machine.dof);
        let whitened = self.poses.iter().all(|pose| pose.is_whitened());
        let columns = components.len() + parts(&self.machine.dof).len() + usize::from(whitened);
        if tallies.inner.len() != self.poses.len()
            || tallies.columns() != columns
            || self.columns.variables() > variables
        {
            return Err(PyValueError::new_err(format!(
                "expected {} tallies of {columns} columns, and a variable for every column",
                self.poses.len()
            )));
        }
        Ok(())
    }
}
