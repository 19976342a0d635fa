//! The machine as a Python class.

use crate::arrays::{Array, Given, Input, filled, output};
use crate::description::description;
use crate::failure::{KernelError, kernel_error};
use crate::once::Once;
use crate::quantity::Quantity;
use crate::samples::{BLOCK, in_blocks_into, with_codes, write_coordinates};
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
    once: Once,
}

fn names(flags: &[bool; 6], all: [&'static str; 6]) -> Vec<&'static str> {
    indices_of(flags).into_iter().map(|k| all[k]).collect()
}
impl Machine {
    fn build(table: &Bound<'_, PyDict>, replaced: BTreeMap<usize, f64>) -> PyResult<Self> {
        let machine = truepose_kernel::Machine::new(&description(table)?).map_err(kernel_error)?;
        let values: Vec<(usize, f64)> =
            replaced.iter().map(|(&index, &value)| (index, value)).collect();
        let inner = machine.with_values(&values);
        Ok(Machine {
            once: Once::new(&inner),
            inner,
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
        let placed = self.placed(py, &commands, &Deviations::NONE)?;
        let width = self.inner.drives.len();
        let out = filled(py, &commands.leading, &[width], &placed.joints)?;
        self.answer(py, out, &commands.leading, &placed.status, status, Given::Commands(&commands))
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
        if !status && let Some(pose) = self.once.forward(&self.inner, joints, start) {
            return Ok(PyArray1::from_slice(py, pose.numbers()).into_any());
        }
        let machine = &self.inner;
        let joints = Input::new(joints, &[machine.drives.len()], "joints")?;
        let count = joints.count;
        let (starts, shared) = match start {
            None => (machine.home.to_row().to_vec(), true),
            Some(start) => {
                let start = self.poses(start, "start")?;
                let shared = start.rows(count)?.is_shared();
                (self.rows_of_poses(&start), shared)
            }
        };
        let starts = if shared { Rows::shared(&starts) } else { Rows::each(&starts, 7) };
        let freedoms = indices_of(&machine.dof);
        let mut codes = vec![Status::Ok; count];
        let out = if count == 1 {
            // One pose: no lanes to fill and nothing to share out.
            let limbs = kinematics::limbs(machine, &machine.nominal, joints.data());
            let sample = Sample { machine, p: &machine.nominal, limbs: &limbs };
            let start = Pose::from_row(starts.row(0));
            let (pose, code) = kinematics::forward(&sample, joints.data(), &start);
            codes[0] = code;
            let out = output(py, &joints.leading, &[freedoms.len()])?;
            let solved = code == Status::Ok;
            write_coordinates(out.readwrite().as_slice_mut()?, &freedoms, &pose, solved);
            out
        } else {
            let mut poses = vec![0.0; BLOCK.min(count) * 7];
            let rows = Rows::each(joints.data(), joints.width);
            let samples =
                Samples { count, joints: rows, poses: starts, deviations: Deviations::NONE };
            in_blocks_into(py, &joints.leading, &[freedoms.len()], |first, size, out| {
                let (poses, codes) = (&mut poses[..size * 7], &mut codes[first..first + size]);
                batch::forward_poses(machine, &samples.part(first, size), poses, codes);
                let rows = out.chunks_exact_mut(freedoms.len()).zip(poses.chunks_exact(7));
                for ((row, pose), &code) in rows.zip(codes.iter()) {
                    let solved = code == Status::Ok;
                    write_coordinates(row, &freedoms, &Pose::from_row(pose), solved);
                }
            })?
        };
        self.answer(py, out, &joints.leading, &codes, status, Given::Joints(&joints))
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
        let (machine, further) = (&self.inner, [self.components(), count]);
        self.at_commands(py, &self.commands(poses)?, status, &further, |_| {
            Quantity::Sensitivity(batch::Sensitivity::new(machine, &columns))
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
        let (machine, further) = (&self.inner, [self.components(), self.inner.drives.len()]);
        self.at_commands(py, &self.commands(poses)?, status, &further, |_| {
            Quantity::JointJacobian(batch::JointJacobian::new(machine))
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
        let placed = self.placed(py, &commands, &Deviations::NONE)?;
        let (machine, width) = (&self.inner, self.inner.drives.len());
        let out = in_blocks_into(py, &commands.leading, &[], |first, _, out| {
            for (i, index) in (first..).zip(out) {
                let joints = &placed.joints[i * width..(i + 1) * width];
                let pose = Pose::from_row(&placed.poses[7 * i..7 * i + 7]);
                *index = if placed.status[i].is_solved() {
                    kinematics::condition(machine, &machine.nominal, joints, &pose)
                } else {
                    f64::NAN
                };
            }
        })?;
        self.answer(py, out, &commands.leading, &placed.status, status, Given::Commands(&commands))
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
        let wrenches = wrench.rows(commands.count)?;
        let (machine, further) = (&self.inner, [self.inner.closure_count()]);
        self.at_commands(py, &commands, status, &further, |first| {
            Quantity::Forces(batch::Forces::new(machine, wrenches.starting_at(first)))
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
        let placed = self.placed(py, &commands, &Deviations::NONE)?;
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
        let values = values.rows(commands.count)?;
        let placed = self.placed(py, &commands, &Deviations { columns: &columns, values })?;
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
        let posed = self.posed(joints, placements)?;
        let columns = self.columns(columns)?;
        let values = Input::new(values, &[columns.len()], "values")?;
        let count = posed.count(values.count);
        let mut samples = posed.samples(count)?;
        samples.deviations = Deviations { columns: &columns, values: values.rows(count)? };
        let machine = &self.inner;
        let mut status = vec![Status::Ok; count];
        let out = in_blocks_into(py, &[count], &[self.components()], |first, size, out| {
            let status = &mut status[first..first + size];
            batch::displacements(machine, &samples.part(first, size), out, status);
        })?;
        with_codes(py, out, &status)
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
        let (machine, further) = (&self.inner, [self.components(), columns.len()]);
        self.at_placements(py, joints, placements, None, &further, |_| {
            Quantity::Sensitivity(batch::Sensitivity::new(machine, &columns))
        })
    }

    /// (loads (n, k), status) on parameters under wrenches (n or 1, 6); (n, 2 k) under two at once, (n or 1, 12).
    fn loads_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        wrenches: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let columns = self.columns(columns)?;
        let wrenches = Input::new(wrenches, &[6, 6 * batch::WRENCHES], "wrenches")?;
        let (machine, further) = (&self.inner, [wrenches.width / 6 * columns.len()]);
        self.at_placements(py, joints, placements, Some(&wrenches), &further, |rows| {
            Quantity::Loads(batch::Loads::new(machine, &columns, rows))
        })
    }

    /// (compliance (n, n_component, n_component), status) from the compliances of parameters, then of pairs of
    /// them, (n or 1, k + n_pair).
    #[pyo3(signature = (joints, placements, columns, parameter_compliance, pairs=vec![]))]
    fn compliance_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
        parameter_compliance: &Bound<'py, PyAny>,
        pairs: Vec<(usize, usize)>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let given = (columns, parameter_compliance, pairs.as_slice());
        self.elastic_at(py, joints, placements, given, |machine, yielding| {
            Quantity::Compliance(batch::Compliance::new(machine, yielding))
        })
    }

    /// (stiffness (n, n_component, n_component), status) from the compliances of parameters, then of pairs of
    /// them, (n or 1, k + n_pair).
    #[pyo3(signature = (joints, placements, columns, parameter_compliance, pairs=vec![]))]
    fn stiffness_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        columns: &Bound<'py, PyAny>,
        parameter_compliance: &Bound<'py, PyAny>,
        pairs: Vec<(usize, usize)>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let given = (columns, parameter_compliance, pairs.as_slice());
        self.elastic_at(py, joints, placements, given, |machine, yielding| {
            Quantity::Stiffness(batch::Stiffness::new(machine, yielding))
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
        let posed = self.posed(joints, placements)?;
        let samples = posed.of_placements()?;
        let width = machine.struts.len();
        in_blocks_into(py, &[samples.count], &[width], |first, _, out| {
            for (i, row) in (first..).zip(out.chunks_exact_mut(width)) {
                let limbs = kinematics::limbs(machine, &machine.nominal, samples.joints.row(i));
                for (value, limb) in row.iter_mut().zip(&limbs) {
                    *value = limb.length;
                }
            }
        })
    }

    /// Poses (n, n_dof), Euler angles R = Rz(c) Ry(b) Rx(a), of placements (n, 7).
    fn pose_of<'py>(
        &self,
        py: Python<'py>,
        placements: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py>> {
        let placements = Input::new(placements, &[7], "placements")?;
        let freedoms = indices_of(&self.inner.dof);
        let rows = Rows::each(placements.data(), 7);
        in_blocks_into(py, &placements.leading, &[freedoms.len()], |first, _, out| {
            for (i, row) in (first..).zip(out.chunks_exact_mut(freedoms.len())) {
                write_coordinates(row, &freedoms, &Pose::from_row(rows.row(i)), true);
            }
        })
    }

    /// Placements (n, 7) of poses (n, n_dof) or (n, n_commanded).
    fn placement_of<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py>> {
        let poses = self.poses(poses, "poses")?;
        filled(py, &poses.leading, &[7], &self.rows_of_poses(&poses))
    }
}
