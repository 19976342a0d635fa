//! Poses with their joints, what is known of the machine there, and where its drives are sent.

use crate::bundle::Bundle;
use crate::condition::Condition;
use crate::given::Given;
use crate::reply::{Answer, fault};
use truepose_kernel::Status;
use truepose_kernel::batch::{self, Deviations, Rows, Samples};
use truepose_kernel::kinematics;
use truepose_kernel::spatial::{Pose, add, rotation_matrix};

/// The most poses of one request.
const MOST_POSES: usize = 1 << 20;

/// Poses of a request at nominal parameters.
pub struct Placed<'a> {
    /// Of which machine.
    pub bundle: &'a Bundle,
    /// How many.
    pub count: usize,
    /// Commanded freedoms, row after row.
    pub commands: Vec<f64>,
    /// Joints of the nominal command.
    pub joints: Vec<f64>,
    /// Seven numbers each.
    pub placements: Vec<f64>,
    /// What became of each.
    pub status: Vec<Status>,
    /// Of each strut.
    pub lengths: Vec<f64>,
}

/// Deviations of parameters, each once, a row a pose.
#[derive(Clone, Debug, Default)]
pub struct Moved {
    /// Which parameters.
    pub columns: Vec<usize>,
    /// By how much.
    pub values: Vec<f64>,
}

impl Moved {
    /// As the kernel has them.
    pub fn deviations(&self) -> Deviations<'_> {
        let values = if self.columns.is_empty() {
            Rows::shared(&[])
        } else {
            Rows::each(&self.values, self.columns.len())
        };
        Deviations { columns: &self.columns, values }
    }

    /// Those of one pose.
    pub fn row(&self, pose: usize) -> &[f64] {
        &self.values[pose * self.columns.len()..][..self.columns.len()]
    }
}

impl<'a> Placed<'a> {
    /// The poses of a request.
    pub fn read(request: &Given<'_>, bundle: &'a Bundle) -> Answer<Placed<'a>> {
        let given = request.item("poses")?;
        let (commands, count) = given.rows(bundle.machine.commanded_count())?;
        if count > MOST_POSES {
            return fault("too-many-poses", given.place, format!("at most {MOST_POSES}"));
        }
        Ok(Placed::at(bundle, commands, count))
    }

    /// The one pose of a request.
    pub fn read_one(request: &Given<'_>, bundle: &'a Bundle) -> Answer<Placed<'a>> {
        let given = request.item("pose")?;
        let command = given.numbers()?;
        if command.len() != bundle.machine.commanded_count() {
            let expected = bundle.machine.commanded_count();
            return given.refuse(format!("expected {expected} numbers"));
        }
        Ok(Placed::at(bundle, command, 1))
    }

    fn at(bundle: &'a Bundle, commands: Vec<f64>, count: usize) -> Placed<'a> {
        let machine = &bundle.machine;
        let (joints, struts) = (machine.drives.len(), machine.struts.len());
        let mut placed = Placed {
            bundle,
            count,
            commands,
            joints: vec![0.0; count * joints],
            placements: vec![0.0; count * 7],
            status: vec![Status::Ok; count],
            lengths: Vec::with_capacity(count * struts),
        };
        batch::inverses(
            machine,
            &Rows::each(&placed.commands, machine.commanded_count()),
            &Deviations::NONE,
            &mut placed.joints,
            &mut placed.placements,
            &mut placed.status,
        );
        for pose in 0..count {
            let limbs = kinematics::limbs(machine, &machine.nominal, placed.joints_at(pose));
            placed.lengths.extend(limbs.iter().take(struts).map(|limb| limb.length));
        }
        placed
    }

    /// Joints of one pose.
    pub fn joints_at(&self, pose: usize) -> &[f64] {
        let width = self.bundle.machine.drives.len();
        &self.joints[pose * width..(pose + 1) * width]
    }

    /// One pose.
    pub fn pose(&self, pose: usize) -> Pose<f64> {
        Pose::from_row(&self.placements[7 * pose..7 * pose + 7])
    }

    /// Lengths of the struts at one pose.
    pub fn lengths_at(&self, pose: usize) -> &[f64] {
        let width = self.bundle.machine.struts.len();
        &self.lengths[pose * width..(pose + 1) * width]
    }

    /// The samples of the nominal command.
    pub fn samples(&self) -> Samples<'_> {
        self.samples_at(&self.joints, Deviations::NONE)
    }

    /// The samples with the drives sent to `joints`, of a machine that deviates.
    pub fn samples_at<'b>(&'b self, joints: &'b [f64], deviations: Deviations<'b>) -> Samples<'b> {
        Samples {
            count: self.count,
            joints: Rows::each(joints, self.bundle.machine.drives.len()),
            poses: Rows::each(&self.placements, 7),
            deviations,
        }
    }

    /// The joints that the drives are sent to for a machine with these known deviations, and what became
    /// of each pose: also of the nominal command, and where there is no such pose.
    pub fn sent(&self, condition: &Condition, known: &Moved) -> (Vec<f64>, Vec<Status>) {
        if !condition.corrected {
            return (self.joints.clone(), self.status.clone());
        }
        let machine = &self.bundle.machine;
        let mut joints = vec![0.0; self.joints.len()];
        let mut placements = vec![0.0; self.placements.len()];
        let mut status = vec![Status::Ok; self.count];
        batch::inverses(
            machine,
            &Rows::each(&self.commands, machine.commanded_count()),
            &known.deviations(),
            &mut joints,
            &mut placements,
            &mut status,
        );
        (joints, first_bad(&self.status, &status))
    }

    /// Errors of the machine that deviates, row after row, NaN where the status is not ok.
    pub fn errors(
        &self,
        joints: &[f64],
        known: &Moved,
        sent: &[Status],
    ) -> (Vec<f64>, Vec<Status>) {
        let machine = &self.bundle.machine;
        let width = machine.dof_count();
        let mut errors = vec![0.0; self.count * width];
        let mut status = vec![Status::Ok; self.count];
        let samples = self.samples_at(joints, known.deviations());
        batch::displacements(machine, &samples, &mut errors, &mut status);
        let mut status = first_bad(sent, &status);
        blank_bad(&mut errors, width, &mut status);
        (errors, status)
    }

    /// Base-side and platform-side centres of the struts' joints, base axes, where the drives are at `joints`,
    /// the parameters are `p` and the platform is at `pose`.
    pub fn centres(&self, joints: &[f64], p: &[f64], pose: &Pose<f64>) -> Vec<[[f64; 3]; 2]> {
        let machine = &self.bundle.machine;
        let limbs = kinematics::limbs(machine, p, joints);
        let rotation = rotation_matrix(pose.rotation);
        let centres = machine.struts.iter().zip(&limbs).map(|(strut, limb)| {
            let arm = limb.turned_arm(strut, p, &rotation, pose.position);
            [limb.base, add(arm, pose.position)]
        });
        centres.collect()
    }

    /// The same of the nominal machine at one pose.
    pub fn centres_at(&self, pose: usize) -> Vec<[[f64; 3]; 2]> {
        self.centres(self.joints_at(pose), &self.bundle.machine.nominal, &self.pose(pose))
    }
}

/// The first status that is not ok.
pub fn first_bad(one: &[Status], then: &[Status]) -> Vec<Status> {
    let first = |(&one, &then): (&Status, &Status)| if one == Status::Ok { then } else { one };
    one.iter().zip(then).map(first).collect()
}

/// NaN in rows whose status is not ok; not ok where a row has a number that is not finite.
pub fn blank_bad(values: &mut [f64], width: usize, status: &mut [Status]) {
    for (row, status) in values.chunks_mut(width.max(1)).zip(status) {
        if *status == Status::Ok && row.iter().any(|value| !value.is_finite()) {
            *status = Status::NotConverged;
        }
        if *status != Status::Ok {
            row.fill(f64::NAN);
        }
    }
}
