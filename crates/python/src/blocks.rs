//! The machine's further methods on blocks: two-dimensional arrays, a status per sample, nothing raised for
//! a pose.

use crate::arrays::{Array, Input, filled, output};
use crate::machine::Machine;
use crate::quantity::Quantity;
use crate::samples::{BLOCK, codes, in_blocks_into, with_codes};
use numpy::PyArrayMethods;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use truepose_kernel::Status;
use truepose_kernel::batch::{self, Band, BandColumns, Deviations, Samples, Sensitivity};
use truepose_kernel::kinematics::{self, Loads, Obstacle, Sample};
use truepose_kernel::machine::indices_of;
use truepose_kernel::spatial::{Pose, add, rotation_matrix};

#[pymethods]
impl Machine {
    /// (sensitivity (n, n_component, k), status): as `sensitivity_at`, but of the machine with the
    /// parameters `moved` (k0,) deviated by `values` (n or 1, k0), at the pose that it then takes.
    fn sensitivity_moved<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
        moved: &Bound<'py, PyAny>,
        values: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (columns, moved) = (self.columns(columns)?, self.columns(moved)?);
        let posed = self.posed(joints, placements)?;
        let values = Input::new(values, &[moved.len()], "values")?;
        let count = posed.placements.count;
        let values = values.rows_if_any(count)?;
        let samples =
            Samples { deviations: Deviations { columns: &moved, values }, ..posed.samples(count)? };
        let out = output(py, &[count], &[self.components(), columns.len()])?;
        let mut status = vec![Status::Ok; count];
        {
            let mut writable = out.readwrite();
            let data = writable.as_slice_mut()?;
            let quantity = Sensitivity::new(&self.inner, &columns);
            py.detach(|| {
                batch::moved_first_order(&self.inner, &samples, &quantity, data, &mut status);
            });
        }
        with_codes(py, out, &status)
    }

    /// What a band does about errors `centre` (n, n_component), of the machine with the parameters `moved`
    /// (k0,) deviated by `values` (n or 1, k0): (numbers (n, 2 n_component + n_quantity), status).
    ///
    /// The numbers are the reach and the standard uncertainty of each component, then the largest length of
    /// each of `quantities` (components, at most three). `parameters` (k,), each of the variable in [-1, 1]
    /// of `variables` (k,), by `half` (n or 1, k) where that is 1; `sigmas`: standard deviations in the half
    /// band of each variable.
    #[allow(clippy::too_many_arguments)] // Python's signature
    fn band_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        centre: &Bound<'py, PyAny>,
        moved: &Bound<'py, PyAny>,
        values: &Bound<'py, PyAny>,
        parameters: &Bound<'py, PyAny>,
        variables: Vec<usize>,
        half: &Bound<'py, PyAny>,
        sigmas: Vec<f64>,
        quantities: Vec<Vec<usize>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (parameters, moved) = (self.columns(parameters)?, self.columns(moved)?);
        let posed = self.posed(joints, placements)?;
        let count = posed.placements.count;
        let components = self.components();
        let values = Input::new(values, &[moved.len()], "values")?;
        let half = Input::new(half, &[parameters.len()], "half")?;
        let centre = Input::new(centre, &[components], "centre")?;
        let known = quantities.iter().all(|quantity| {
            quantity.len() <= 3 && quantity.iter().all(|&component| component < components)
        });
        if variables.len() != parameters.len()
            || variables.iter().any(|&variable| variable >= sigmas.len())
            || !known
        {
            return Err(PyValueError::new_err("the arguments do not fit each other"));
        }
        let columns = BandColumns {
            parameters: &parameters,
            variables: &variables,
            half: half.rows_if_any(count)?,
            sigmas: &sigmas,
        };
        let band = Band::new(&self.inner, columns, centre.rows(count)?, &quantities);
        let values = values.rows_if_any(count)?;
        let samples =
            Samples { deviations: Deviations { columns: &moved, values }, ..posed.samples(count)? };
        let out = output(py, &[count], &[2 * components + quantities.len()])?;
        let mut status = vec![Status::Ok; count];
        {
            let mut writable = out.readwrite();
            let data = writable.as_slice_mut()?;
            py.detach(|| {
                if moved.is_empty() {
                    batch::first_order(&self.inner, &samples, &band, data, &mut status);
                } else {
                    batch::moved_first_order(&self.inner, &samples, &band, data, &mut status);
                }
            });
        }
        with_codes(py, out, &status)
    }

    /// Loads (n, k) on parameters from forces (n or 1, 3 n_strut), N, base axes, that act on the base-side
    /// joint centres themselves.
    fn base_loads_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        forces: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py>> {
        let machine = &self.inner;
        let posed = self.posed(joints, placements)?;
        let forces = Input::new(forces, &[3 * machine.struts.len()], "forces")?;
        let columns = self.columns(columns)?;
        let count = posed.count(forces.count);
        let samples = posed.samples(count)?;
        let forces = forces.rows(count)?;
        in_blocks_into(py, &[count], &[columns.len()], |first, size, out| {
            let (samples, forces) = (samples.part(first, size), forces.starting_at(first));
            batch::base_loads(machine, &samples, &forces, &columns, out);
        })
    }

    /// (forces (n, n_closure, k), status): what unit deviations of parameters strain in a machine with more
    /// closures than freedoms, N/m or N/rad.
    fn internal_forces_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let columns = self.columns(columns)?;
        let (machine, further) = (&self.inner, [self.inner.closure_count(), columns.len()]);
        self.at_placements(py, joints, placements, None, &further, |_| {
            Quantity::InternalForces(batch::InternalForces::new(machine, &columns))
        })
    }

    /// Where the machine comes to rest, (errors (n, n_component), forces (n, n_closure), absorbed
    /// (n, n_closure), strain (n, n_closure), status): deviated parameters, half clearances of the closures
    /// (n_closure,) and a wrench (n or 1, 6) on the tool. Only for more closures than freedoms.
    #[allow(clippy::too_many_arguments)] // Python's signature
    fn settle_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
        values: &Bound<'py, PyAny>,
        clearances: &Bound<'py, PyAny>,
        wrenches: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let machine = &self.inner;
        let closures = machine.closure_count();
        let posed = self.posed(joints, placements)?;
        let columns = self.columns(columns)?;
        let values = Input::new(values, &[columns.len()], "values")?;
        let clearances = Input::new(clearances, &[closures], "clearances")?;
        let wrenches = Input::new(wrenches, &[6], "wrenches")?;
        let count = posed.joints.count;
        let Samples { joints: commands, poses: starts, .. } = posed.samples(count)?;
        let values = values.rows(count)?;
        let clearances = clearances.rows(count)?;
        let wrenches = wrenches.rows(count)?;
        let components = indices_of(&machine.dof);
        let mut status = vec![Status::Ok; count];
        let mut errors = vec![f64::NAN; count * components.len()];
        let mut tables = [(); 3].map(|()| vec![f64::NAN; count * closures]);
        for (i, status) in status.iter_mut().enumerate() {
            let mut p = machine.nominal.clone();
            for (&column, value) in columns.iter().zip(values.row(i)) {
                p[column] += value;
            }
            let limbs = kinematics::limbs(machine, &p, commands.row(i));
            let start = Pose::from_row(starts.row(i));
            let mut loads = Loads::default();
            loads.clearance[..closures].copy_from_slice(clearances.row(i));
            loads.wrench.copy_from_slice(wrenches.row(i));
            let sample = Sample { machine, p: &p, limbs: &limbs };
            let equilibrium = kinematics::least_energy(&sample, commands.row(i), &start, &loads);
            *status = equilibrium.status;
            if equilibrium.status == Status::Ok {
                let error = batch::displacement(&start, &equilibrium.pose);
                for (cell, &k) in errors[i * components.len()..].iter_mut().zip(&components) {
                    *cell = error[k];
                }
                let rows = [equilibrium.forces, equilibrium.absorbed, equilibrium.strain];
                for (table, row) in tables.iter_mut().zip(rows) {
                    table[i * closures..(i + 1) * closures].copy_from_slice(&row[..closures]);
                }
            }
            if i % BLOCK == 0 {
                py.check_signals()?;
            }
        }
        let errors = filled(py, &[count], &[components.len()], &errors)?;
        let table = |numbers: &[f64]| filled(py, &[count], &[closures], numbers);
        let [forces, absorbed, strain] = &tables;
        let (forces, absorbed, strain) = (table(forces)?, table(absorbed)?, table(strain)?);
        (errors, forces, absorbed, strain, codes(py, &[count], &status)?).into_bound_py_any(py)
    }

    /// Base-side and platform-side joint centres, base frame, (n, n_strut, 2, 3).
    fn joint_centres<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py>> {
        let machine = &self.inner;
        let posed = self.posed(joints, placements)?;
        let samples = posed.of_placements()?;
        let width = machine.struts.len();
        in_blocks_into(py, &[samples.count], &[width, 2, 3], |first, _, out| {
            for (i, cell) in (first..).zip(out.chunks_exact_mut(6 * width)) {
                let limbs = kinematics::limbs(machine, &machine.nominal, samples.joints.row(i));
                let pose = Pose::from_row(samples.poses.row(i));
                let rotation = rotation_matrix(pose.rotation);
                let struts = machine.struts.iter().zip(&limbs);
                for (cell, (strut, limb)) in cell.chunks_exact_mut(6).zip(struts) {
                    let arm = limb.turned_arm(strut, &machine.nominal, &rotation, pose.position);
                    cell[..3].copy_from_slice(&limb.base);
                    cell[3..].copy_from_slice(&add(arm, pose.position));
                }
            }
        })
    }

    /// The twists (k, 6) of the platform about its tool point that nothing holds at one commanded pose,
    /// m and rad; None where the pose has no joints.
    fn free_motions<'py>(
        &self,
        py: Python<'py>,
        pose: &Bound<'py, PyAny>,
    ) -> PyResult<Option<Array<'py>>> {
        let command = self.commands(pose)?;
        let machine = &self.inner;
        let placed = kinematics::commanded_pose(machine, command.data());
        // A machine that is not held has no pose of its own: joints of the closed forms at the command.
        let mut joints = vec![0.0; machine.drives.len()];
        let margin = kinematics::lane_inverse(machine, &machine.nominal, &placed, &mut joints);
        // Also true where it is NaN.
        if !(margin >= 0.0) {
            return Ok(None);
        }
        let free = kinematics::free_motions(machine, &machine.nominal, &joints, &placed);
        filled(py, &[free.len()], &[6], &free.concat()).map(Some)
    }

    /// What keeps one commanded pose from being used: a list of dicts (what, name, amount, unit).
    fn explain<'py>(
        &self,
        py: Python<'py>,
        pose: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyList>> {
        let command = self.commands(pose)?;
        let machine = &self.inner;
        let list = PyList::empty(py);
        if !command.is_single() {
            return Err(pyo3::exceptions::PyValueError::new_err("explain takes one pose"));
        }
        let pose = kinematics::commanded_pose(machine, command.data());
        for obstacle in kinematics::obstacles(machine, &machine.nominal, &pose) {
            let (what, name, amount, unit) = match obstacle {
                Obstacle::Strut(i, amount) => {
                    ("strut", machine.struts[i].name.as_str(), amount, "m")
                }
                Obstacle::Travel(i, amount) => {
                    let drive = &machine.drives[i];
                    ("travel", drive.name.as_str(), amount, drive.kind.table().coordinate.unit())
                }
                Obstacle::Singular(index) => ("singular", "", index, "1"),
                Obstacle::Leaning(i, end, amount) => {
                    let what = ["base_joint", "platform_joint"][end];
                    (what, machine.struts[i].name.as_str(), amount, "rad")
                }
            };
            let entry = PyDict::new(py);
            entry.set_item("what", what)?;
            entry.set_item("name", name)?;
            entry.set_item("amount", amount)?;
            entry.set_item("unit", unit)?;
            list.append(entry)?;
        }
        Ok(list)
    }
}
