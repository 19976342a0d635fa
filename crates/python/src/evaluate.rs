//! How calls are evaluated: blocks of samples without the interpreter's lock, one status per sample,
//! one error or the status in the end.

use crate::arrays::{Array, Given, Input, filled};
use crate::failure::pose_error;
use crate::machine::Machine;
use crate::quantity::Quantity;
use crate::samples::{Posed, codes, in_blocks, in_blocks_into, with_codes};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use truepose_kernel::Status;
use truepose_kernel::batch::{self, Deviations, Rows, Samples, Yielding};
use truepose_kernel::kinematics::{self, Obstacle};
use truepose_kernel::machine::{FREEDOMS, indices_of};
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

    /// Joints and placements of a block.
    pub fn posed<'py>(
        &self,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
    ) -> PyResult<Posed<'py>> {
        Ok(Posed {
            joints: Input::new(joints, &[self.inner.drives.len()], "joints")?,
            placements: Input::new(placements, &[7], "placements")?,
        })
    }

    /// Joints, poses and status of all commands, for deviated parameters.
    pub fn placed(
        &self,
        py: Python<'_>,
        commands: &Input<'_>,
        deviations: &Deviations<'_>,
    ) -> PyResult<Placed> {
        let (count, width) = (commands.count, self.inner.drives.len());
        let mut placed = Placed {
            joints: vec![0.0; count * width],
            poses: vec![0.0; count * 7],
            status: vec![Status::Ok; count],
        };
        let rows = Rows::each(commands.data(), commands.width);
        let machine = &self.inner;
        in_blocks(py, count, |first, size| {
            batch::inverses(
                machine,
                &rows.starting_at(first),
                &deviations.starting_at(first),
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

    /// Poses in all freedoms or in the commanded ones.
    pub fn poses<'py>(
        &self,
        poses: &Bound<'py, PyAny>,
        what: &'static str,
    ) -> PyResult<Input<'py>> {
        Input::new(poses, &[self.components(), self.inner.commanded_count()], what)
    }

    /// One first-order quantity at samples that close the struts; `quantity(first)` is that of the samples
    /// from `first` on.
    fn quantity<'py, 'a>(
        &self,
        py: Python<'py>,
        samples: &Samples<'_>,
        leading: &[usize],
        further: &[usize],
        quantity: impl Fn(usize) -> Quantity<'a> + Sync,
    ) -> PyResult<(Array<'py>, Vec<Status>)> {
        let mut status = vec![Status::Ok; samples.count];
        let machine = &self.inner;
        let out = in_blocks_into(py, leading, further, |first, size, out| {
            let status = &mut status[first..first + size];
            quantity(first).compute(machine, &samples.part(first, size), out, status);
        })?;
        Ok((out, status))
    }

    /// A public first-order call: inverse kinematics, then the quantity, then one error or status.
    pub fn at_commands<'py, 'a>(
        &self,
        py: Python<'py>,
        commands: &Input<'py>,
        want_status: bool,
        further: &[usize],
        quantity: impl Fn(usize) -> Quantity<'a> + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let placed = self.placed(py, commands, &Deviations::NONE)?;
        let samples = Samples {
            count: commands.count,
            joints: Rows::each(&placed.joints, self.inner.drives.len()),
            poses: Rows::each(&placed.poses, 7),
            deviations: Deviations::NONE,
        };
        let (out, mut status) =
            self.quantity(py, &samples, &commands.leading, further, quantity)?;
        for (status, &inverse) in status.iter_mut().zip(&placed.status) {
            // Out of travel is the least that can be wrong with a pose.
            if !inverse.is_solved() || *status == Status::Ok {
                *status = inverse;
            }
        }
        self.answer(py, out, &commands.leading, &status, want_status, Given::Commands(commands))
    }

    /// The result with its status, or one error for all failing poses.
    pub fn answer<'py>(
        &self,
        py: Python<'py>,
        result: Array<'py>,
        leading: &[usize],
        status: &[Status],
        want_status: bool,
        given: Given<'_, '_>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if want_status {
            return (result, codes(py, leading, status)?).into_bound_py_any(py);
        }
        match status.iter().position(|&status| status != Status::Ok) {
            None => Ok(result.into_any()),
            Some(index) => {
                let count = status.iter().filter(|&&status| status != Status::Ok).count();
                let reason = self.reason(given, index, status[index]);
                Err(pose_error(py, count, index, status[index].name(), reason))
            }
        }
    }

    /// Why the row at this index fails.
    fn reason(&self, given: Given<'_, '_>, index: usize, status: Status) -> String {
        let machine = &self.inner;
        let (input, names): (_, Vec<String>) = match given {
            Given::Commands(poses) => {
                let all = poses.width == self.components();
                let freedoms = if all { &machine.dof } else { &machine.commanded };
                (
                    poses,
                    indices_of(freedoms).into_iter().map(|at| FREEDOMS[at].to_owned()).collect(),
                )
            }
            Given::Joints(joints) => {
                let names =
                    machine.drives.iter().map(|drive| format!("the joint of {}", drive.name));
                (joints, names.collect())
            }
        };
        let command = &input.data()[index * input.width..(index + 1) * input.width];
        if let Some(at) = command.iter().position(|number| !number.is_finite()) {
            return format!("{} is {}, which is no finite number", names[at], command[at]);
        }
        let Given::Commands(_) = given else { return plain_reason(status).to_owned() };
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
        let joints = filled(py, &[count], &[self.inner.drives.len()], &placed.joints)?;
        let poses = filled(py, &[count], &[7], &placed.poses)?;
        (joints, poses, codes(py, &[count], &placed.status)?).into_bound_py_any(py)
    }

    /// A block's compliance or stiffness from (columns, compliances of these parameters and pairs, pairs).
    pub fn elastic_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        (columns, compliances, pairs): (&Bound<'py, PyAny>, &Bound<'py, PyAny>, &[(usize, usize)]),
        quantity: impl for<'a> Fn(&'a truepose_kernel::Machine, Yielding<'a>) -> Quantity<'a> + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let columns = self.columns(columns)?;
        if pairs.iter().any(|&(one, other)| one.max(other) >= columns.len()) {
            let message = "a pair of columns that are not among them";
            return Err(pyo3::exceptions::PyIndexError::new_err(message));
        }
        let width = columns.len() + pairs.len();
        let given = Input::new(compliances, &[width], "parameter_compliance")?;
        let further = [self.components(), self.components()];
        let machine = &self.inner;
        self.at_placements(py, joints, placements, Some(&given), &further, |rows| {
            quantity(machine, Yielding { columns: &columns, pairs, compliances: rows })
        })
    }

    /// A block's first-order quantity at given joints and placements, from the rows of `given`.
    pub fn at_placements<'py, 'a>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        given: Option<&'a Input<'_>>,
        further: &[usize],
        quantity: impl Fn(Rows<'a>) -> Quantity<'a> + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let posed = self.posed(joints, placements)?;
        let count = posed.count(given.map_or(1, |rows| rows.count));
        let samples = posed.samples(count)?;
        let rows = given.map_or(Ok(Rows::shared(&[])), |given| given.rows(count))?;
        let quantity = |first| quantity(rows.starting_at(first));
        let (out, status) = self.quantity(py, &samples, &[count], further, quantity)?;
        with_codes(py, out, &status)
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
