//! The machine as a Python class.

use crate::arrays::{Array, Input, output};
use crate::description::description;
use crate::failure::{KernelError, kernel_error};
use crate::quantity::Quantity;
use crate::samples::{BLOCK, codes, in_blocks, part, write_coordinates};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::collections::BTreeMap;
use truepose_kernel::Status;
use truepose_kernel::batch::{self, Deviations, Rows, Samples};
use truepose_kernel::kinematics::{self, Sample};
use truepose_kernel::machine::{COMPONENTS, FREEDOMS, indices_of};
use truepose_kernel::spatial::Pose;

/// A parallel kinematic machine: immutable, picklable. SI units and radians throughout.
#[pyclass(frozen, module = "truepose._kernel", name = "Machine")]
pub struct Machine {
    pub inner: truepose_kernel::Machine,
    description: Py<PyDict>,
    replaced: BTreeMap<usize, f64>,
}

fn names(flags: &[bool; 6], all: [&'static str; 6]) -> Vec<&'static str> {
    indices_of(flags).into_iter().map(|k| all[k]).collect()
}
impl Machine {
    fn build(table: &Bound<'_, PyDict>, replaced: BTreeMap<usize, f64>) -> PyResult<Self> {
        let machine = truepose_kernel::Machine::new(&description(table)?).map_err(kernel_error)?;
        let values: Vec<(usize, f64)> =
            replaced.iter().map(|(&index, &value)| (index, value)).collect();
        Ok(Machine {
            inner: machine.with_values(&values),
            description: table.copy()?.unbind(),
            replaced,
        })
    }
}

/// Rebuilds a machine from a pickle.
#[pyfunction]
pub fn _rebuild(table: &Bound<'_, PyDict>, replaced: BTreeMap<usize, f64>) -> PyResult<Machine> {
    Machine::build(table, replaced)
}

#[pymethods]
impl Machine {
    #[new]
    fn new(description: &Bound<'_, PyDict>) -> PyResult<Self> {
        Self::build(description, BTreeMap::new())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rebuild = py.import("truepose._kernel")?.getattr("_rebuild")?;
        let arguments = (self.description.bind(py), self.replaced.clone());
        (rebuild, arguments).into_bound_py_any(py)
    }

    #[getter]
    fn dof<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, names(&self.inner.dof, FREEDOMS))
    }
    #[getter]
    fn commanded<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, names(&self.inner.commanded, FREEDOMS))
    }
    #[getter(components)]
    fn component_names<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, names(&self.inner.dof, COMPONENTS))
    }
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.inner.drives.iter().map(|drive| &drive.name))
    }
    #[getter]
    fn closures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let inner = &self.inner;
        let guides = inner.guide_closures.iter().map(|&(guide, which)| {
            let guide = &inner.guides[guide];
            if guide.kind.closures() == 1 {
                guide.name.clone()
            } else {
                format!("{}.{}", guide.name, which + 1)
            }
        });
        let struts = inner.struts.iter().map(|strut| strut.name.clone());
        PyTuple::new(py, struts.chain(guides).collect::<Vec<_>>())
    }
    /// Whether there are more closures than freedoms.
    #[getter]
    fn overconstrained(&self) -> bool {
        self.inner.is_overconstrained()
    }
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.inner.parameters.iter().map(|parameter| &parameter.name))
    }
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.inner.parameters.iter().map(|parameter| parameter.unit))
    }
    #[getter]
    fn nominal<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.nominal)
    }
    #[getter]
    fn characteristic_length(&self) -> f64 {
        self.inner.characteristic_length
    }
    #[getter]
    fn home<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let coordinates = self.inner.home.to_coordinates();
        PyArray1::from_iter(py, indices_of(&self.inner.dof).into_iter().map(|k| coordinates[k]))
    }
    #[getter]
    fn length_parameters<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.inner.struts.iter().map(|strut| strut.length_parameter as i64))
    }
    #[getter]
    fn working_modes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let word = |mode: f64| if mode < 0.0 { "-" } else { "+" };
        PyTuple::new(py, self.inner.drives.iter().map(|drive| word(drive.mode)))
    }

    fn replace(&self, py: Python<'_>, values: BTreeMap<String, f64>) -> PyResult<Self> {
        let mut replaced = self.replaced.clone();
        for (name, value) in values {
            let index = self.inner.parameters.iter().position(|parameter| parameter.name == name);
            let refused = |code, message| Err(KernelError::new_err((code, message, name.clone())));
            match index {
                None => {
                    return refused("unknown-parameter", format!("there is no parameter {name:?}"));
                }
                Some(_) if !value.is_finite() => {
                    return refused("not-finite", format!("the value of {name} is {value}"));
                }
                Some(index) => {
                    replaced.insert(index, value);
                }
            }
        }
        Self::build(self.description.bind(py), replaced)
    }

    /// (..., n_commanded) -> (..., n_joint).
    #[pyo3(signature = (poses, *, status=false))]
    fn inverse<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
        status: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let commands = self.commands(poses)?;
        let placed = self.placed(py, &commands, None)?;
        let out = output(py, &commands.leading, &[self.inner.drives.len()])?;
        out.readwrite().as_slice_mut()?.copy_from_slice(&placed.joints);
        self.answer(py, out, &commands.leading, &placed.status, status, Some(&commands))
    }

    /// (..., n_joint) -> (..., n_dof); start: (..., n_dof) or (..., n_commanded), default home.
    #[pyo3(signature = (joints, start=None, *, status=false))]
    fn forward<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        start: Option<&Bound<'py, PyAny>>,
        status: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let machine = &self.inner;
        let joints = Input::new(joints, &[machine.drives.len()], "joints")?;
        let count = joints.count;
        let (starts, shared) = match start {
            None => (machine.home.to_row().to_vec(), true),
            Some(start) => {
                let start =
                    Input::new(start, &[self.components(), machine.commanded_count()], "start")?;
                let shared = start.serves(count, "start")?;
                (self.rows_of_poses(&start), shared)
            }
        };
        let freedoms = indices_of(&machine.dof);
        let out = output(py, &joints.leading, &[freedoms.len()])?;
        let mut codes = vec![Status::Ok; count];
        {
            let mut writable = out.readwrite();
            let data = writable.as_slice_mut()?;
            if count == 1 {
                // One pose: no lanes to fill and nothing to share out.
                let limbs = kinematics::limbs(machine, &machine.nominal, joints.data());
                let sample = Sample { machine, p: &machine.nominal, limbs: &limbs };
                let start = Pose::from_row(&starts);
                let (pose, code) = kinematics::forward(&sample, joints.data(), &start);
                codes[0] = code;
                write_coordinates(data, &freedoms, &pose, code == Status::Ok);
            } else {
                let mut poses = vec![0.0; BLOCK.min(count) * 7];
                let (input, width) = (joints.data(), joints.width);
                in_blocks(py, count, |first, size| {
                    let samples = Samples {
                        count: size,
                        joints: Rows::each(&input[first * width..], width),
                        poses: part(&starts, 7, first, shared),
                        deviations: Deviations::NONE,
                    };
                    let codes = &mut codes[first..first + size];
                    batch::forward_poses(machine, &samples, &mut poses[..size * 7], codes);
                    for (i, code) in codes.iter().enumerate() {
                        let pose = Pose::from_row(&poses[7 * i..7 * i + 7]);
                        let at = (first + i) * freedoms.len();
                        let row = &mut data[at..at + freedoms.len()];
                        write_coordinates(row, &freedoms, &pose, *code == Status::Ok);
                    }
                })?;
            }
        }
        self.answer(py, out, &joints.leading, &codes, status, None)
    }

    /// (..., n_commanded) -> (..., n_component, n_parameter).
    #[pyo3(signature = (poses, *, status=false))]
    fn sensitivity<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
        status: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let count = self.inner.nominal.len();
        let columns: Vec<usize> = (0..count).collect();
        let further = [self.components(), count];
        self.at_commands(py, &self.commands(poses)?, status, &further, |_| {
            Quantity::Sensitivity(batch::Sensitivity::new(&self.inner, &columns))
        })
    }

    /// (..., n_commanded) -> (..., n_component, n_joint).
    #[pyo3(signature = (poses, *, status=false))]
    fn jac_pose_joint<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
        status: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let further = [self.components(), self.inner.drives.len()];
        self.at_commands(py, &self.commands(poses)?, status, &further, |_| {
            Quantity::JointJacobian(batch::JointJacobian::new(&self.inner))
        })
    }

    /// (..., n_commanded) -> (...): smallest over largest singular value of the scaled W.
    #[pyo3(signature = (poses, *, status=false))]
    fn conditioning<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
        status: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let commands = self.commands(poses)?;
        let placed = self.placed(py, &commands, None)?;
        let out = output(py, &commands.leading, &[])?;
        {
            let mut writable = out.readwrite();
            let data = writable.as_slice_mut()?;
            let (machine, width) = (&self.inner, self.inner.drives.len());
            in_blocks(py, commands.count, |first, size| {
                for i in first..first + size {
                    let joints = &placed.joints[i * width..(i + 1) * width];
                    let pose = Pose::from_row(&placed.poses[7 * i..7 * i + 7]);
                    data[i] = if placed.status[i].is_solved() {
                        kinematics::condition(machine, &machine.nominal, joints, &pose)
                    } else {
                        f64::NAN
                    };
                }
            })?;
        }
        self.answer(py, out, &commands.leading, &placed.status, status, Some(&commands))
    }

    /// Strut tensions (N), (..., n_closure), under a wrench (..., 6) on the tool.
    #[pyo3(signature = (poses, wrench, *, status=false))]
    fn forces<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
        wrench: &Bound<'py, PyAny>,
        status: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let commands = self.commands(poses)?;
        let wrench = Input::new(wrench, &[6], "wrench")?;
        let shared = wrench.serves(commands.count, "wrench")?;
        let further = [self.inner.closure_count()];
        self.at_commands(py, &commands, status, &further, |first| {
            Quantity::Forces(batch::Forces::new(&self.inner, wrench.rows(first, shared)))
        })
    }

    // ---- blocks: two-dimensional arrays, a status per sample, nothing raised for a pose ----

    /// (joints, placements, status) of commanded poses.
    fn place<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let commands = self.commands(poses)?;
        let placed = self.placed(py, &commands, None)?;
        self.placed_arrays(py, &placed)
    }

    /// (joints, placements, status) of commanded poses for deviated parameters.
    fn corrected<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
        values: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let commands = self.commands(poses)?;
        let columns = self.columns(columns)?;
        let values = Input::new(values, &[columns.len()], "values")?;
        let placed = self.placed(py, &commands, Some((&columns, &values)))?;
        self.placed_arrays(py, &placed)
    }

    /// (errors, status): forward with deviated parameters from `placements`, minus `placements`.
    fn displacement<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
        values: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let machine = &self.inner;
        let joints = Input::new(joints, &[machine.drives.len()], "joints")?;
        let placements = Input::new(placements, &[7], "placements")?;
        let columns = self.columns(columns)?;
        let values = Input::new(values, &[columns.len()], "values")?;
        let count = joints.count.max(placements.count).max(values.count);
        let shared_joints = joints.serves(count, "joints")?;
        let shared_poses = placements.serves(count, "placements")?;
        let shared_values = values.serves(count, "values")?;
        let width = self.components();
        let out = output(py, &[count], &[width])?;
        let mut status = vec![Status::Ok; count];
        {
            let mut writable = out.readwrite();
            let data = writable.as_slice_mut()?;
            let (q, x, v) = (joints.data(), placements.data(), values.data());
            in_blocks(py, count, |first, size| {
                let values = part(v, columns.len(), first, shared_values);
                let samples = Samples {
                    count: size,
                    joints: part(q, machine.drives.len(), first, shared_joints),
                    poses: part(x, 7, first, shared_poses),
                    deviations: Deviations { columns: &columns, values },
                };
                let out = &mut data[first * width..(first + size) * width];
                batch::displacements(machine, &samples, out, &mut status[first..first + size]);
            })?;
        }
        (out, codes(py, &[count], &status)?).into_bound_py_any(py)
    }

    /// (sensitivity (n, n_component, k), status).
    fn sensitivity_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let columns = self.columns(columns)?;
        let further = [self.components(), columns.len()];
        self.at_placements(py, joints, placements, None, &further, |_, _| {
            Quantity::Sensitivity(batch::Sensitivity::new(&self.inner, &columns))
        })
    }

    /// (loads (n, k), status) on parameters under wrenches (n or 1, 6).
    fn loads_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        wrenches: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let columns = self.columns(columns)?;
        let wrenches = Input::new(wrenches, &[6], "wrenches")?;
        let further = [columns.len()];
        self.at_placements(
            py,
            joints,
            placements,
            Some((&wrenches, "wrenches")),
            &further,
            |first, shared| {
                let rows = wrenches.rows(first, shared);
                Quantity::Loads(batch::Loads::new(&self.inner, &columns, rows))
            },
        )
    }

    /// (compliance (n, n_component, n_component), status) from parameter compliances (n or 1, k).
    fn compliance_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
        parameter_compliance: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let given = (columns, parameter_compliance);
        self.elastic_at(py, joints, placements, given, |machine, columns, rows| {
            Quantity::Compliance(batch::Compliance::new(machine, columns, rows))
        })
    }

    /// (stiffness (n, n_component, n_component), status) from parameter compliances (n or 1, k).
    fn stiffness_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
        parameter_compliance: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let given = (columns, parameter_compliance);
        self.elastic_at(py, joints, placements, given, |machine, columns, rows| {
            Quantity::Stiffness(batch::Stiffness::new(machine, columns, rows))
        })
    }

    /// The length of each strut, m, (n, n_strut).
    fn lengths_at<'py>(
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
        let out = output(py, &[placements.count], &[width])?;
        {
            let mut writable = out.readwrite();
            for (i, row) in writable.as_slice_mut()?.chunks_exact_mut(width).enumerate() {
                let limbs =
                    kinematics::limbs(machine, &machine.nominal, joints.rows(0, shared).row(i));
                for (value, limb) in row.iter_mut().zip(&limbs) {
                    *value = limb.length;
                }
            }
        }
        Ok(out)
    }

    /// Poses (n, n_dof), Euler angles R = Rz(c) Ry(b) Rx(a), of placements (n, 7).
    fn pose_of<'py>(
        &self,
        py: Python<'py>,
        placements: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py>> {
        let placements = Input::new(placements, &[7], "placements")?;
        let freedoms = indices_of(&self.inner.dof);
        let out = output(py, &placements.leading, &[freedoms.len()])?;
        {
            let mut writable = out.readwrite();
            let rows = writable.as_slice_mut()?.chunks_exact_mut(freedoms.len());
            for (row, placement) in rows.zip(placements.data().chunks_exact(7)) {
                write_coordinates(row, &freedoms, &Pose::from_row(placement), true);
            }
        }
        Ok(out)
    }

    /// Placements (n, 7) of poses (n, n_dof) or (n, n_commanded).
    fn placement_of<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py>> {
        let widths = [self.components(), self.inner.commanded_count()];
        let poses = Input::new(poses, &widths, "poses")?;
        let out = output(py, &poses.leading, &[7])?;
        out.readwrite().as_slice_mut()?.copy_from_slice(&self.rows_of_poses(&poses));
        Ok(out)
    }
}
