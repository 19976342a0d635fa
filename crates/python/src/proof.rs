//! Guaranteed bounds, as methods of the machine.

use crate::arrays::Input;
use crate::machine::Machine;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truepose_kernel::batch::share_out;
use truepose_kernel::linear::SIX;
use truepose_kernel::machine::{indices_of, parts};
use truepose_kernel::proof::{
    self, Affine, Deviating, Effort, Extent, Part, PoseBound, Region, RegionBound, Search, TARGETS,
    Unproven,
};
use truepose_kernel::spatial::Pose;

fn word(unproven: Unproven) -> &'static str {
    match unproven {
        Unproven::NearSingular => "near_singular",
        Unproven::TooWide => "box_too_wide",
    }
}

#[pymethods]
impl Machine {
    /// Whether bounds can be proven over a region: no more closures than freedoms, and parasitic freedoms
    /// that can be enclosed.
    #[getter]
    fn can_be_enclosed(&self) -> bool {
        proof::can_be_enclosed(&self.inner)
    }

    /// Bounds of the error at n poses over every deviation in a box: (lower, upper (n, n_component),
    /// magnitudes (n, n_quantity), status (n,) of "proven", "near_singular", "box_too_wide", boxes looked
    /// at (n,)).
    ///
    /// `shifted` (k0,) parameters and their `shift` (n or 1, k0); `parameters`, `variables` (k,) of the
    /// columns and their `swing` (n or 1, k), the variables in [-1, 1]; `directions`: variables that are
    /// together a unit vector. At each pose the box is divided into at most `most_boxes` where it cannot be
    /// proven as a whole, and where a magnitude lies above its `targets` (n or 1,
    /// n_quantity), m and rad, NaN for none.
    #[allow(clippy::too_many_arguments)] // Python's signature
    #[pyo3(signature = (
        joints, placements, shifted, shift, parameters, variables, swing, directions=vec![],
        most_boxes=1, targets=None,
    ))]
    fn bounds_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        shifted: &Bound<'py, PyAny>,
        shift: &Bound<'py, PyAny>,
        parameters: &Bound<'py, PyAny>,
        variables: Vec<usize>,
        swing: &Bound<'py, PyAny>,
        directions: Vec<Vec<usize>>,
        most_boxes: usize,
        targets: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let shifted = self.columns(shifted)?;
        let parameters = self.columns(parameters)?;
        let machine = &self.inner;
        let posed = self.posed(joints, placements)?;
        let shift = Input::new(shift, &[shifted.len()], "shift")?;
        let swing = Input::new(swing, &[parameters.len()], "swing")?;
        if variables.len() != parameters.len() {
            return Err(PyValueError::new_err("as many variables as parameters are needed"));
        }
        let samples = posed.of_placements()?;
        let count = samples.count;
        let (shifts, swings) = (shift.rows_if_any(count)?, swing.rows_if_any(count)?);
        let number = variables.iter().map(|&variable| variable + 1).max().unwrap_or(0);
        if directions.iter().flatten().any(|&member| member >= number) {
            return Err(PyValueError::new_err("a direction of variables that are not there"));
        }
        let quantities = parts(&machine.dof);
        let targets =
            targets.map(|given| Input::new(given, &[quantities.len()], "targets")).transpose()?;
        let asked = targets.as_ref().map(|given| given.rows(count)).transpose()?;
        let mut bounds: Vec<(Result<PoseBound, Unproven>, usize)> =
            vec![(Err(Unproven::TooWide), 0); count];
        py.detach(|| {
            share_out(&mut bounds, count, 1, |poses, bounds| {
                for (i, bounds) in poses.zip(bounds) {
                    let deviating = Deviating {
                        parameters: parameters.clone(),
                        variables: variables.clone(),
                        swing: swings.row(i).to_vec(),
                        count: number,
                        directions: directions.clone(),
                    };
                    let extent = Extent::new(
                        machine,
                        samples.joints.row(i),
                        Pose::from_row(samples.poses.row(i)),
                        shifted.iter().copied().zip(shifts.row(i).iter().copied()),
                        &deviating,
                    );
                    let mut effort = Effort { most_boxes, ..Effort::WHOLE };
                    if let Some(asked) = &asked {
                        for (&part, &target) in quantities.iter().zip(asked.row(i)) {
                            effort.targets[part] = target;
                        }
                    }
                    *bounds = proof::bound_in_boxes(&extent, &effort);
                }
            });
        });
        let components = indices_of(&machine.dof);
        let none =
            PoseBound { lower: [f64::NAN; 6], upper: [f64::NAN; 6], magnitudes: [f64::NAN; 2] };
        let all: Vec<PoseBound> = bounds.iter().map(|bounds| bounds.0.unwrap_or(none)).collect();
        let rows =
            |of: &dyn Fn(&PoseBound) -> Vec<f64>| -> Vec<Vec<f64>> { all.iter().map(of).collect() };
        let lower = rows(&|bound| components.iter().map(|&k| bound.lower[k]).collect());
        let upper = rows(&|bound| components.iter().map(|&k| bound.upper[k]).collect());
        let magnitudes =
            rows(&|bound| quantities.iter().map(|&part| bound.magnitudes[part]).collect());
        let status: Vec<&str> = bounds
            .iter()
            .map(|bounds| bounds.0.as_ref().map_or_else(|&why| word(why), |_| "proven"))
            .collect();
        let boxes: Vec<usize> = bounds.iter().map(|bounds| bounds.1).collect();
        (lower, upper, magnitudes, status, boxes).into_bound_py_any(py)
    }

    /// Bounds of the error over a region of commanded poses, as a dict.
    ///
    /// In rows of targets (lower ends of the n_component components, upper ends, n_quantity magnitudes):
    /// `bound` and `reached`, and where each is (`at`, a row of commanded freedoms a target); `gap`,
    /// `boxes`, `status`, and `where` something is unproven or out of reach. What is not finished: the
    /// ends of each part (`part_sides`, (n_part, n_commanded, 2)) and its bounds (`part_bound`), and the
    /// bounds over all other parts (`finished`).
    ///
    /// `sides` (n_commanded, 2). `shifts` and `yielding`: (parameter, (low, high), per length, strut), a
    /// known deviation and a compliance under the `wrench` (6,). `columns`: (parameter, variable, swing).
    /// `earlier`: a search that goes on, (part_sides, part_bound, finished, reached, at, boxes).
    /// `progress(boxes, share)` is called now and then, with the share of the region that is finished;
    /// where it returns False the search stops. Ctrl-C stops it, too: then `interrupted` is True.
    #[allow(clippy::too_many_arguments)] // Python's signature
    fn bounds_over<'py>(
        &self,
        py: Python<'py>,
        sides: Vec<[f64; 2]>,
        shifts: Vec<(usize, [f64; 2], f64, usize)>,
        yielding: Vec<(usize, [f64; 2], f64, usize)>,
        wrench: [f64; 6],
        columns: Vec<(usize, usize, f64)>,
        close: (f64, Option<[f64; 2]>),
        most_boxes: usize,
        earlier: Option<Earlier>,
        progress: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let machine = &self.inner;
        let affine = |rows: &[(usize, [f64; 2], f64, usize)]| -> PyResult<Vec<Affine>> {
            let fits = |&(parameter, _, _, strut): &(usize, [f64; 2], f64, usize)| {
                parameter < machine.nominal.len() && strut < machine.struts.len()
            };
            if !rows.iter().all(fits) {
                return Err(PyValueError::new_err("there is no such parameter or strut"));
            }
            let row =
                |&(parameter, constant, per_length, strut): &(usize, [f64; 2], f64, usize)| {
                    Affine { parameter, constant, per_length, strut }
                };
            Ok(rows.iter().map(row).collect())
        };
        let (shift, yielding) = (affine(&shifts)?, affine(&yielding)?);
        let parameters: Vec<usize> = columns.iter().map(|column| column.0).collect();
        let variables: Vec<usize> = columns.iter().map(|column| column.1).collect();
        let swing: Vec<f64> = columns.iter().map(|column| column.2).collect();
        if sides.len() != machine.commanded_count()
            || parameters.iter().any(|&parameter| parameter >= machine.nominal.len())
        {
            return Err(PyValueError::new_err("the arguments do not fit the machine"));
        }
        let number = variables.iter().map(|&variable| variable + 1).max().unwrap_or(0);
        let deviating =
            Deviating { parameters, variables, swing, count: number, directions: vec![] };
        let region = Region {
            machine,
            sides,
            shift,
            yielding,
            wrench,
            deviating: &deviating,
            gap: close.0,
            targets: close.1,
            most_boxes,
        };
        let search = match earlier {
            Some(earlier) => self.search_of(earlier)?,
            None => Search::new(&region),
        };
        let progress = progress.clone().unbind();
        let mut stopped: Option<PyErr> = None;
        let bound = py.detach(|| {
            proof::bound_over_region(&region, search, |boxes, share| {
                Python::attach(|py| {
                    let asked = py
                        .check_signals()
                        .and_then(|()| progress.call1(py, (boxes, share))?.extract::<bool>(py));
                    asked.unwrap_or_else(|error| {
                        stopped = Some(error);
                        false
                    })
                })
            })
        });
        let interrupted = stopped.is_some();
        if let Some(error) = stopped
            && !error.is_instance_of::<PyKeyboardInterrupt>(py)
        {
            return Err(error);
        }
        let table = self.over_region(py, &bound)?;
        table.set_item("interrupted", interrupted)?;
        Ok(table)
    }
}

/// A search that goes on: ends of its parts, their bounds, those of the finished ones, what is reached,
/// where, and the boxes looked at.
type Earlier = (Vec<Vec<[f64; 2]>>, Vec<Vec<f64>>, Vec<f64>, Vec<f64>, Vec<Vec<f64>>, usize);

impl Machine {
    /// The targets of a row, with the sign that they have in it.
    fn row(&self) -> Vec<(usize, f64)> {
        let components = indices_of(&self.inner.dof);
        let lower = components.iter().map(|k| (SIX + k, -1.0));
        let upper = components.iter().map(|&k| (k, 1.0));
        let magnitudes = parts(&self.inner.dof).into_iter().map(|part| (2 * SIX + part, 1.0));
        lower.chain(upper).chain(magnitudes).collect()
    }

    fn search_of(&self, earlier: Earlier) -> PyResult<Search> {
        let (sides, bounds, finished, reached, at, boxes) = earlier;
        let row = self.row();
        let width = self.inner.commanded_count();
        let fit = sides.len() == bounds.len()
            && sides.iter().chain([&vec![[0.0; 2]; width]]).all(|sides| sides.len() == width)
            && bounds.iter().chain([&finished, &reached]).all(|values| values.len() == row.len())
            && at.len() == row.len()
            && at.iter().all(|place| place.len() == width);
        if !fit {
            return Err(PyValueError::new_err("the earlier search does not fit the machine"));
        }
        // What is no freedom does not err.
        let targets = |values: &[f64]| {
            let mut targets = [0.0; TARGETS];
            for (&(target, sign), value) in row.iter().zip(values) {
                targets[target] = sign * value;
            }
            targets
        };
        let mut poses = vec![vec![f64::NAN; width]; TARGETS];
        for (&(target, _), place) in row.iter().zip(at) {
            poses[target] = place;
        }
        Ok(Search {
            parts: sides
                .into_iter()
                .zip(&bounds)
                .map(|(sides, bound)| {
                    let proven = bound.iter().all(|value| value.is_finite());
                    Part::known(sides, proven.then(|| targets(bound)))
                })
                .collect(),
            finished: targets(&finished),
            reached: targets(&reached),
            at: poses,
            boxes,
        })
    }

    fn over_region<'py>(
        &self,
        py: Python<'py>,
        bound: &RegionBound,
    ) -> PyResult<Bound<'py, PyDict>> {
        let row = self.row();
        let of = |values: &[f64]| -> Vec<f64> {
            row.iter().map(|&(target, sign)| sign * values[target]).collect()
        };
        let search = &bound.search;
        let nothing = [f64::INFINITY; TARGETS];
        let parts = &search.parts;
        let part_bound: Vec<Vec<f64>> =
            parts.iter().map(|part| of(&part.bound.unwrap_or(nothing))).collect();
        let at: Vec<&[f64]> = row.iter().map(|&(target, _)| search.at[target].as_slice()).collect();
        let sides: Vec<&[[f64; 2]]> = parts.iter().map(|part| part.sides.as_slice()).collect();
        let table = PyDict::new(py);
        table.set_item("bound", of(&bound.bound))?;
        table.set_item("reached", of(&search.reached))?;
        table.set_item("at", at)?;
        table.set_item("part_sides", sides)?;
        table.set_item("part_bound", part_bound)?;
        table.set_item("finished", of(&search.finished))?;
        table.set_item("boxes", search.boxes)?;
        table.set_item("gap", bound.gap)?;
        let (status, place) = match (&bound.out_of_reach, &bound.unproven) {
            (Some((status, place)), _) => (status.name(), Some(place.clone())),
            (None, Some((why, place))) => (word(*why), Some(place.clone())),
            (None, None) => ("proven", None),
        };
        table.set_item("status", status)?;
        table.set_item("where", place)?;
        Ok(table)
    }
}
