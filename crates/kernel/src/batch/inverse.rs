//! Inverse kinematics of many samples.

use super::samples::{Deviations, Group, Rows};
use super::threads::for_chunks;
use crate::dispatch::{Work, dispatch};
use crate::kinematics::{commanded_pose, inverse, lane_inverse, permitted};
use crate::linear::SIX;
use crate::machine::{Machine, indices_of};
use crate::scalar::Real;
use crate::spatial::{Pose, quaternion_from_euler};
use crate::status::Status;

/// The joints and the full pose (seven numbers) of every command, for the nominal parameters plus
/// deviations. Poses are finite also where the status is that there are no joints.
pub fn inverses(
    machine: &Machine,
    commands: &Rows<'_>,
    deviations: &Deviations<'_>,
    joints: &mut [f64],
    poses: &mut [f64],
    status: &mut [Status],
) {
    let width = machine.drives.len();
    for_chunks(
        status.len(),
        (joints, width),
        (poses, 7),
        status,
        |first, joints, poses, status| {
            let chunk = Chunk { machine, commands, deviations, first, joints, poses, status };
            if machine.has_direct_inverse() && machine.plain {
                dispatch(chunk)
            } else {
                chunk.run::<f64>()
            }
        },
    );
}

struct Chunk<'a> {
    machine: &'a Machine,
    commands: &'a Rows<'a>,
    deviations: &'a Deviations<'a>,
    first: usize,
    joints: &'a mut [f64],
    poses: &'a mut [f64],
    status: &'a mut [Status],
}

impl Work for Chunk<'_> {
    #[inline(always)]
    fn run<S: Real>(self) {
        let Chunk { machine, commands, deviations, first, joints, poses, status } = self;
        let width = machine.drives.len();
        let freedoms = indices_of(&machine.commanded);
        let home = machine.home.to_coordinates();
        let turns = freedoms.iter().any(|&freedom| freedom >= 3);
        let mut group = Group::<S>::new(machine);
        let mut command = vec![S::default(); freedoms.len()];
        let mut lane_joints = vec![S::default(); width];
        let groups = joints
            .chunks_mut(width * S::WIDTH)
            .zip(poses.chunks_mut(7 * S::WIDTH))
            .zip(status.chunks_mut(S::WIDTH));
        for (number, ((joints, poses), status)) in groups.enumerate() {
            let sample = first + number * S::WIDTH;
            let size = status.len();
            if number == 0 || !deviations.values.is_shared() {
                group.load_parameters(machine, deviations, sample, size);
            }
            if S::WIDTH == 1 {
                let p: Vec<f64> = group.p.iter().map(|value| value.lane(0)).collect();
                let solved = inverse(machine, &p, &commanded_pose(machine, commands.row(sample)));
                joints.copy_from_slice(&solved.joints);
                poses.copy_from_slice(&solved.pose.to_row());
                status[0] = solved.status;
                continue;
            }
            commands.load(sample, size, &mut command);
            let mut coordinates = [S::default(); SIX];
            for k in 0..SIX {
                coordinates[k] = S::splat(home[k]);
            }
            for (&freedom, &value) in freedoms.iter().zip(&command) {
                coordinates[freedom] = value;
            }
            let [x, y, z, a, b, c] = coordinates;
            let mut pose = Pose::splat(&machine.home);
            pose.position = [x, y, z];
            if turns {
                pose.rotation = quaternion_from_euler([a, b, c]);
            }
            let margin = lane_inverse(machine, &group.p, &pose, &mut lane_joints);
            S::store_rows(&lane_joints, joints, width, size);
            for lane in 0..size {
                poses[7 * lane..7 * lane + 7].copy_from_slice(&pose.lane(lane).to_row());
                let joints = &mut joints[width * lane..width * (lane + 1)];
                status[lane] = if !(margin.lane(lane) >= 0.0) {
                    joints.fill(f64::NAN);
                    Status::Unreachable
                } else {
                    let p = if machine.limited { group.inputs(lane).0 } else { Vec::new() };
                    permitted(machine, &p, joints, &pose.lane(lane))
                };
            }
        }
    }
}
