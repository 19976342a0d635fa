//! Forward kinematics of many samples.

use super::samples::{Group, Samples};
use super::threads::for_chunks;
use crate::dispatch::{Work, dispatch};
use crate::kinematics::{Limbs, Sample, descend, forward, place_limbs, start_order};
use crate::machine::{Machine, indices_of};
use crate::scalar::Real;
use crate::spatial::{Pose, relative_rotation};
use crate::status::Status;

/// What to keep of each pose.
#[derive(Clone, Copy)]
enum Kept<'a> {
    /// Seven numbers: position and unit quaternion.
    Pose,
    /// Displacement and rotation vector from the start, these components of six.
    Displacement(&'a [usize]),
}

/// The poses of all samples, started at `samples.poses`: seven numbers each into `poses`.
pub fn forward_poses(
    machine: &Machine,
    samples: &Samples<'_>,
    poses: &mut [f64],
    status: &mut [Status],
) {
    run(machine, samples, Kept::Pose, 7, poses, status);
}

/// Actual minus started: how far each sample's platform is from `samples.poses`, in the components
/// that it can move in (m, rad, base frame).
pub fn displacements(
    machine: &Machine,
    samples: &Samples<'_>,
    errors: &mut [f64],
    status: &mut [Status],
) {
    let components = indices_of(&machine.dof);
    run(machine, samples, Kept::Displacement(&components), components.len(), errors, status);
}

fn run(
    machine: &Machine,
    samples: &Samples<'_>,
    kept: Kept<'_>,
    width: usize,
    out: &mut [f64],
    status: &mut [Status],
) {
    for_chunks(samples.count, (out, width), (&mut [], 0), status, |first, out, _, status| {
        let chunk = Chunk { machine, samples, kept, width, first, out, status };
        if machine.plain { dispatch(chunk) } else { chunk.run::<f64>() }
    });
}

struct Chunk<'a> {
    machine: &'a Machine,
    samples: &'a Samples<'a>,
    kept: Kept<'a>,
    width: usize,
    first: usize,
    out: &'a mut [f64],
    status: &'a mut [Status],
}

impl Work for Chunk<'_> {
    #[inline(always)]
    fn run<S: Real>(self) {
        let Chunk { machine, samples, kept, width, first, out, status } = self;
        let mut group = Group::<S>::new(machine);
        let mut at: Limbs<S> = Default::default();
        let mut order = [0; 6];
        let groups = out.chunks_mut(width * S::WIDTH).zip(status.chunks_mut(S::WIDTH));
        for (number, (out, status)) in groups.enumerate() {
            let size = status.len();
            if group.load(machine, samples, first + number * S::WIDTH, size) {
                place_limbs(machine, &group.p, &group.q, &mut at);
            }
            if S::WIDTH == 1 {
                alone(machine, &group, &at, 0, kept, out, &mut status[0]);
                continue;
            }
            if number == 0 {
                let lane = group.first_finite(size);
                order = start_order(machine, &single_limbs(&at, lane), &group.pose.lane(lane));
            }
            let descent = descend(machine, &at, &group.pose, &order);
            match kept {
                Kept::Pose => {
                    for lane in 0..size {
                        out[7 * lane..7 * lane + 7]
                            .copy_from_slice(&descent.pose.lane(lane).to_row());
                    }
                }
                Kept::Displacement(components) => {
                    let error = displacement(&group.pose, &descent.pose);
                    let mut columns = [S::default(); 6];
                    for (column, &component) in columns.iter_mut().zip(components) {
                        *column = error[component];
                    }
                    S::store_rows(&columns[..width], out, width, size);
                }
            }
            for lane in 0..size {
                status[lane] = Status::Ok;
                // Also true where it is NaN.
                if !(descent.proof.lane(lane) > 0.0) {
                    let out = &mut out[width * lane..width * (lane + 1)];
                    alone(machine, &group, &at, lane, kept, out, &mut status[lane]);
                }
            }
        }
    }
}

/// How far one pose is from another: displacement of the tool point and rotation vector, base frame.
#[inline(always)]
pub fn displacement<S: Real>(from: &Pose<S>, to: &Pose<S>) -> [S; 6] {
    let mut error = [S::default(); 6];
    for k in 0..3 {
        error[k] = to.position[k] - from.position[k];
    }
    error[3..].copy_from_slice(&relative_rotation(from.rotation, to.rotation));
    error
}

#[inline(always)]
fn single_limbs<S: Real>(limbs: &Limbs<S>, lane: usize) -> Limbs<f64> {
    let mut single: Limbs<f64> = Default::default();
    for (one, many) in single.iter_mut().zip(limbs) {
        one.base = many.base.map(|value| value.lane(lane));
        one.arm = many.arm.map(|value| value.lane(lane));
        one.length = many.length.lane(lane);
    }
    single
}

/// One sample on the scalar path; NaN where there is no pose.
#[inline(never)]
fn alone<S: Real>(
    machine: &Machine,
    group: &Group<S>,
    at: &Limbs<S>,
    lane: usize,
    kept: Kept<'_>,
    out: &mut [f64],
    status: &mut Status,
) {
    // The placed struts are all that a plain machine's closures read.
    let (p, q) = if machine.plain { (Vec::new(), [0.0; 6]) } else { group.inputs(lane) };
    let at = single_limbs(at, lane);
    let start = group.pose.lane(lane);
    let (pose, outcome) = forward(&Sample { machine, p: &p, limbs: &at }, &q, &start);
    *status = outcome;
    if outcome != Status::Ok {
        out.fill(f64::NAN);
        return;
    }
    match kept {
        Kept::Pose => out.copy_from_slice(&pose.to_row()),
        Kept::Displacement(components) => {
            let error = displacement(&start, &pose);
            for (value, &component) in out.iter_mut().zip(components) {
                *value = error[component];
            }
        }
    }
}
