//! The machine's further methods on blocks: two-dimensional arrays, a status per sample, nothing raised for
//! a pose.

use crate::arrays::{Array, Input, output};
use crate::machine::Machine;
use crate::quantity::Quantity;
use crate::samples::{BLOCK, codes, in_blocks, part};
use numpy::PyArrayMethods;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use truepose_kernel::Status;
use truepose_kernel::batch::{self, Deviations, Samples};
use truepose_kernel::kinematics::{self, Loads, Obstacle, Sample};
use truepose_kernel::machine::indices_of;
use truepose_kernel::spatial::{Pose, rotation_matrix};

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
        let joints = Input::new(joints, &[self.inner.drives.len()], "joints")?;
        let placements = Input::new(placements, &[7], "placements")?;
        let values = Input::new(values, &[moved.len()], "values")?;
        let count = placements.count;
        let shared = moved.is_empty() || values.serves(count, "values")?;
        let out = output(py, &[count], &[self.components(), columns.len()])?;
        let status = {
            let mut writable = out.readwrite();
            let data = writable.as_slice_mut()?;
            let samples = Samples {
                count,
                joints: joints.rows(0, joints.serves(count, "joints")?),
                poses: placements.rows(0, count == 1),
                deviations: Deviations { columns: &moved, values: values.rows(0, shared) },
            };
            py.detach(|| batch::moved_sensitivities(&self.inner, &samples, &columns, data))
        };
        (out, codes(py, &[count], &status)?).into_bound_py_any(py)
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
        let joints = Input::new(joints, &[machine.drives.len()], "joints")?;
        let placements = Input::new(placements, &[7], "placements")?;
        let forces = Input::new(forces, &[3 * machine.struts.len()], "forces")?;
        let columns = self.columns(columns)?;
        let count = joints.count.max(placements.count).max(forces.count);
        let shared_joints = joints.serves(count, "joints")?;
        let shared_poses = placements.serves(count, "placements")?;
        let shared_forces = forces.serves(count, "forces")?;
        let width = columns.len();
        let out = output(py, &[count], &[width])?;
        {
            let mut writable = out.readwrite();
            let data = writable.as_slice_mut()?;
            let (q, x, f) = (joints.data(), placements.data(), forces.data());
            in_blocks(py, count, |first, size| {
                let samples = Samples {
                    count: size,
                    joints: part(q, machine.drives.len(), first, shared_joints),
                    poses: part(x, 7, first, shared_poses),
                    deviations: Deviations::NONE,
                };
                let forces = part(f, 3 * machine.struts.len(), first, shared_forces);
                let out = &mut data[first * width..(first + size) * width];
                batch::base_loads(machine, &samples, &forces, &columns, out);
            })?;
        }
        Ok(out)
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
        let further = [self.inner.closure_count(), columns.len()];
        self.at_placements(py, joints, placements, None, &further, |_, _| {
            Quantity::InternalForces(batch::InternalForces::new(&self.inner, &columns))
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
        let joints = Input::new(joints, &[machine.drives.len()], "joints")?;
        let placements = Input::new(placements, &[7], "placements")?;
        let columns = self.columns(columns)?;
        let values = Input::new(values, &[columns.len()], "values")?;
        let clearances = Input::new(clearances, &[closures], "clearances")?;
        let wrenches = Input::new(wrenches, &[6], "wrenches")?;
        let count = joints.count;
        let shared = |input: &Input<'_>, what| input.serves(count, what);
        let starts = placements.rows(0, shared(&placements, "placements")?);
        let values = values.rows(0, shared(&values, "values")?);
        let gaps = clearances.rows(0, shared(&clearances, "clearances")?);
        let wrenches = wrenches.rows(0, shared(&wrenches, "wrenches")?);
        let commands = joints.rows(0, false);
        let components = indices_of(&machine.dof);
        let errors = output(py, &[count], &[components.len()])?;
        let tables = [
            output(py, &[count], &[closures])?,
            output(py, &[count], &[closures])?,
            output(py, &[count], &[closures])?,
        ];
        let mut status = vec![Status::Ok; count];
        for (i, status) in status.iter_mut().enumerate() {
            let mut p = machine.nominal.clone();
            for (&column, value) in columns.iter().zip(values.row(i)) {
                p[column] += value;
            }
            let limbs = kinematics::limbs(machine, &p, commands.row(i));
            let start = Pose::from_row(starts.row(i));
            let mut loads = Loads::default();
            loads.clearance[..closures].copy_from_slice(gaps.row(i));
            loads.wrench.copy_from_slice(wrenches.row(i));
            let sample = Sample { machine, p: &p, limbs: &limbs };
            let equilibrium = kinematics::least_energy(&sample, commands.row(i), &start, &loads);
            *status = equilibrium.status;
            let solved = equilibrium.status == Status::Ok;
            let error = batch::displacement(&start, &equilibrium.pose);
            let row = components.iter().map(|&k| error[k]);
            let keep = |value: f64| if solved { value } else { f64::NAN };
            for (cell, value) in
                errors.readwrite().as_slice_mut()?[i * components.len()..].iter_mut().zip(row)
            {
                *cell = keep(value);
            }
            let rows = [equilibrium.forces, equilibrium.absorbed, equilibrium.strain];
            for (table, rows) in tables.iter().zip(rows) {
                let mut writable = table.readwrite();
                let cells = &mut writable.as_slice_mut()?[i * closures..(i + 1) * closures];
                for (cell, value) in cells.iter_mut().zip(rows) {
                    *cell = keep(value);
                }
            }
            if i % BLOCK == 0 {
                py.check_signals()?;
            }
        }
        let [forces, absorbed, strain] = tables;
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
        let joints = Input::new(joints, &[machine.drives.len()], "joints")?;
        let placements = Input::new(placements, &[7], "placements")?;
        let shared = joints.serves(placements.count, "joints")?;
        let width = machine.struts.len();
        let out = output(py, &[placements.count], &[width, 2, 3])?;
        {
            let mut writable = out.readwrite();
            for (i, cell) in writable.as_slice_mut()?.chunks_exact_mut(6 * width).enumerate() {
                let limbs =
                    kinematics::limbs(machine, &machine.nominal, joints.rows(0, shared).row(i));
                let pose = Pose::from_row(&placements.data()[7 * i..7 * i + 7]);
                let rotation = rotation_matrix(pose.rotation);
                let struts = machine.struts.iter().zip(&limbs);
                for (cell, (strut, limb)) in cell.chunks_exact_mut(6).zip(struts) {
                    let arm = limb.turned_arm(strut, &machine.nominal, &rotation, pose.position);
                    for k in 0..3 {
                        cell[k] = limb.base[k];
                        cell[3 + k] = arm[k] + pose.position[k];
                    }
                }
            }
        }
        Ok(out)
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
        let out = output(py, &[free.len()], &[6])?;
        out.readwrite().as_slice_mut()?.copy_from_slice(&free.concat());
        Ok(Some(out))
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
