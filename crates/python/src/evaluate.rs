//! How calls are evaluated: blocks of samples without the interpreter's lock, one status per sample,
//! one error or the status in the end.

use crate::arrays::{Array, Input, output};
use crate::failure::pose_error;
use crate::machine::Machine;
use crate::quantity::Quantity;
use crate::samples::{BLOCK, codes, in_blocks, part};
use numpy::PyArrayMethods;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use truepose_kernel::Status;
use truepose_kernel::batch::{self, Deviations, Rows, Samples};
use truepose_kernel::kinematics::{self, Obstacle};
use truepose_kernel::machine::indices_of;
use truepose_kernel::spatial::Pose;

/// Joints and poses of commands, with their status.
pub struct Placed {
    pub joints: Vec<f64>,
    pub poses: Vec<f64>,
    pub status: Vec<Status>,
}

impl Machine {
    pub fn components(&self) -> usize {
        self.inner.dof_count()
    }

    pub fn columns(&self, columns: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
        let columns: Vec<i64> =
            columns.try_iter()?.map(|item| item?.extract()).collect::<PyResult<_>>()?;
        let count = self.inner.nominal.len();
        match columns.iter().find(|&&column| column < 0 || column as usize >= count) {
            Some(column) => {
                let message = format!(
                    "parameter {column} does not exist: there are {}",
                    self.inner.nominal.len()
                );
                Err(PyIndexError::new_err(message))
            }
            None => Ok(columns.into_iter().map(|column| column as usize).collect()),
        }
    }

    /// Joints, poses and status of all commands, for deviated parameters.
    pub fn placed(
        &self,
        py: Python<'_>,
        commands: &Input<'_>,
        deviation: Option<(&[usize], &Input<'_>)>,
    ) -> PyResult<Placed> {
        let (count, width) = (commands.count, self.inner.drives.len());
        let mut placed = Placed {
            joints: vec![0.0; count * width],
            poses: vec![0.0; count * 7],
            status: vec![Status::Ok; count],
        };
        let values = deviation.map(|(_, values)| values.serves(count, "values")).transpose()?;
        let data = commands.data();
        let inner = deviation.map(|(columns, values)| (columns, values.data(), values.width));
        let (machine, step) = (&self.inner, commands.width);
        in_blocks(py, count, |first, size| {
            let deviations = match inner {
                Some((columns, data, width)) => {
                    Deviations { columns, values: part(data, width, first, values == Some(true)) }
                }
                None => Deviations::NONE,
            };
            batch::inverses(
                machine,
                &Rows::each(&data[first * step..], step),
                &deviations,
                &mut placed.joints[first * width..(first + size) * width],
                &mut placed.poses[first * 7..(first + size) * 7],
                &mut placed.status[first..first + size],
            );
        })?;
        Ok(placed)
    }

    pub fn commands<'py>(&self, poses: &Bound<'py, PyAny>) -> PyResult<Input<'py>> {
        Input::new(poses, &[self.inner.commanded_count()], "poses")
    }

    /// One first-order quantity at samples that close the struts.
    pub fn quantity<'py, 'a>(
        &self,
        py: Python<'py>,
        at: At<'_>,
        leading: &[usize],
        further: &[usize],
        quantity: impl Fn(usize) -> Quantity<'a>,
    ) -> PyResult<(Array<'py>, Vec<Status>)> {
        let out = output(py, leading, further)?;
        let width: usize = further.iter().product();
        let mut status = vec![Status::Ok; at.count];
        {
            let mut writable = out.readwrite();
            let data = writable.as_slice_mut()?;
            let mut first = 0;
            while first < at.count {
                let size = BLOCK.min(at.count - first);
                let samples = Samples {
                    count: size,
                    joints: part(at.joints, self.inner.drives.len(), first, at.shared_joints),
                    poses: part(at.poses, 7, first, at.shared_poses),
                    deviations: Deviations::NONE,
                };
                let quantity = quantity(first);
                let out = &mut data[first * width..(first + size) * width];
                let status = &mut status[first..first + size];
                let machine = &self.inner;
                py.detach(|| quantity.compute(machine, &samples, out, status));
                first += size;
                py.check_signals()?;
            }
        }
        Ok((out, status))
    }

    /// A public first-order call: inverse kinematics, then the quantity, then one error or status.
    pub fn at_commands<'py, 'a>(
        &self,
        py: Python<'py>,
        commands: &Input<'py>,
        want_status: bool,
        further: &[usize],
        quantity: impl Fn(usize) -> Quantity<'a>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let placed = self.placed(py, commands, None)?;
        let at = At {
            count: commands.count,
            joints: &placed.joints,
            poses: &placed.poses,
            shared_joints: false,
            shared_poses: false,
        };
        let (out, mut status) = self.quantity(py, at, &commands.leading, further, quantity)?;
        for (status, &inverse) in status.iter_mut().zip(&placed.status) {
            // Out of travel is the least that can be wrong with a pose.
            if !inverse.is_solved() || *status == Status::Ok {
                *status = inverse;
            }
        }
        self.answer(py, out, &commands.leading, &status, want_status, Some(commands))
    }

    /// The result with its status, or one error for all failing poses.
    pub fn answer<'py>(
        &self,
        py: Python<'py>,
        result: Array<'py>,
        leading: &[usize],
        status: &[Status],
        want_status: bool,
        commands: Option<&Input<'_>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if want_status {
            return (result, codes(py, leading, status)?).into_bound_py_any(py);
        }
        match status.iter().position(|&status| status != Status::Ok) {
            None => Ok(result.into_any()),
            Some(index) => {
                let count = status.iter().filter(|&&status| status != Status::Ok).count();
                let reason = match commands {
                    Some(commands) => {
                        let width = commands.width;
                        self.reason(
                            &commands.data()[index * width..(index + 1) * width],
                            status[index],
                        )
                    }
                    None => plain_reason(status[index]).to_owned(),
                };
                Err(pose_error(py, count, index, status[index].name(), reason))
            }
        }
    }

    fn reason(&self, command: &[f64], status: Status) -> String {
        let machine = &self.inner;
        let pose = kinematics::commanded_pose(machine, command);
        let parts: Vec<String> = kinematics::obstacles(machine, &machine.nominal, &pose)
            .into_iter()
            .map(|obstacle| match obstacle {
                Obstacle::Strut(i, amount) => {
                    let word = if amount > 0.0 { "short" } else { "long" };
                    let name = &machine.struts[i].name;
                    format!("strut {name} is {:.6} mm too {word}", 1e3 * amount.abs())
                }
                Obstacle::Travel(i, amount) => {
                    let drive = &machine.drives[i];
                    let word = if amount > 0.0 { "above" } else { "below" };
                    let angle = drive.kind.table().coordinate.unit() == "rad";
                    let (amount, unit) = if angle {
                        (amount.abs().to_degrees(), "deg")
                    } else {
                        (1e3 * amount.abs(), "mm")
                    };
                    format!("drive {} is {amount:.6} {unit} {word} its travel", drive.name)
                }
                Obstacle::Leaning(i, end, angle) => {
                    let end = ["base", "platform"][end];
                    let name = &machine.struts[i].name;
                    let angle = angle.to_degrees();
                    format!("strut {name} leans {angle:.6} deg beyond the limit of its {end} joint")
                }
                Obstacle::Singular(index) => {
                    format!("smallest over largest singular value is {index:.1e}, below 1e-6")
                }
            })
            .collect();
        if parts.is_empty() { plain_reason(status).to_owned() } else { parts.join("; ") }
    }

    /// Seven numbers for each pose given in all freedoms or in the commanded ones.
    pub fn rows_of_poses(&self, poses: &Input<'_>) -> Vec<f64> {
        let machine = &self.inner;
        let home = machine.home.to_coordinates();
        let freedoms = indices_of(if poses.width == self.components() {
            &machine.dof
        } else {
            &machine.commanded
        });
        let mut rows = Vec::with_capacity(7 * poses.count);
        for pose in poses.data().chunks_exact(poses.width) {
            let mut coordinates = home;
            for (&freedom, &value) in freedoms.iter().zip(pose) {
                coordinates[freedom] = value;
            }
            rows.extend(Pose::from_coordinates(coordinates).to_row());
        }
        rows
    }

    pub fn placed_arrays<'py>(
        &self,
        py: Python<'py>,
        placed: &Placed,
    ) -> PyResult<Bound<'py, PyAny>> {
        let count = placed.status.len();
        let joints = output(py, &[count], &[self.inner.drives.len()])?;
        joints.readwrite().as_slice_mut()?.copy_from_slice(&placed.joints);
        let poses = output(py, &[count], &[7])?;
        poses.readwrite().as_slice_mut()?.copy_from_slice(&placed.poses);
        (joints, poses, codes(py, &[count], &placed.status)?).into_bound_py_any(py)
    }

    /// A block's compliance or stiffness from (columns, compliances of these parameters).
    pub fn elastic_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        (columns, compliances): (&Bound<'py, PyAny>, &Bound<'py, PyAny>),
        quantity: impl for<'a> Fn(&'a truepose_kernel::Machine, &[usize], Rows<'a>) -> Quantity<'a>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let columns = self.columns(columns)?;
        let given = Input::new(compliances, &[columns.len()], "parameter_compliance")?;
        let further = [self.components(), self.components()];
        let name = Some((&given, "parameter_compliance"));
        self.at_placements(py, joints, placements, name, &further, |first, shared| {
            quantity(&self.inner, &columns, given.rows(first, shared))
        })
    }

    /// A block's first-order quantity at given joints and placements.
    pub fn at_placements<'py, 'a>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        given: Option<(&Input<'_>, &str)>,
        further: &[usize],
        quantity: impl Fn(usize, bool) -> Quantity<'a>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let joints = Input::new(joints, &[self.inner.drives.len()], "joints")?;
        let placements = Input::new(placements, &[7], "placements")?;
        let count = joints.count.max(placements.count).max(given.map_or(1, |(rows, _)| rows.count));
        let at = At {
            count,
            joints: joints.data(),
            poses: placements.data(),
            shared_joints: joints.serves(count, "joints")?,
            shared_poses: placements.serves(count, "placements")?,
        };
        let shared = given.map(|(rows, what)| rows.serves(count, what)).transpose()?;
        let (out, status) = self
            .quantity(py, at, &[count], further, |first| quantity(first, shared == Some(true)))?;
        (out, codes(py, &[count], &status)?).into_bound_py_any(py)
    }
}

fn plain_reason(status: Status) -> &'static str {
    match status {
        Status::Ok => "nothing is wrong",
        Status::OutOfTravel => "a joint is outside its travel",
        Status::Unreachable => "a strut does not reach",
        Status::Singular => "the platform is not held: the closures are dependent",
        Status::NotConverged => "no pose closes the struts near the start",
        Status::JointLimit => "a strut leans beyond the limit of one of its joints",
        Status::BranchLost => "the struts close only beyond a singular pose",
    }
}

/// Samples that close the struts.
#[derive(Clone, Copy)]
pub struct At<'a> {
    pub count: usize,
    pub joints: &'a [f64],
    pub poses: &'a [f64],
    pub shared_joints: bool,
    pub shared_poses: bool,
}
