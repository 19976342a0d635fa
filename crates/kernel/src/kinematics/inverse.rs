//! Inverse kinematics: the joints of a commanded pose.
//!
//! Where every freedom of the platform is commanded each drive answers in closed form. Where some are
//! parasitic (a delta commanded in x, y, z whose platform can tilt) joints and parasitic freedoms are
//! solved for together by Newton's iteration, started from the closed forms at the home attitude.

use super::SINGULAR;
use super::closures::{Limb, Sample, limbs, place_limbs, ring_arm};
use super::condition::condition;
use super::forward::forward;
use super::linearisation::Linearisation;
use crate::element::{Dimension, InverseRoot};
use crate::linear::{CLOSURES, Matrix6, Pivoted, SIX, condition_index, factor_pivoting, solve};
use crate::machine::{Machine, MachineDrive, indices_of};
use crate::scalar::{Real, Scalar};
use crate::spatial::{
    Pose, RotationMatrix, Vector, add, angle_rates, cross, dot, euler_axes, norm, rotate,
    rotation_matrix, subtract,
};
use crate::status::Status;

/// Longest iteration for parasitic freedoms.
const STEPS: usize = 30;
/// Relative step after which the quadratic convergence has reached rounding level.
const SETTLED: f64 = 1e-9;
/// Share of the travel by which rounding may overstep it.
const TRAVEL_SLACK: f64 = 1e-12;

/// Joints and full pose of one command.
pub struct Inverse {
    /// Joint coordinates; NaN where a strut does not reach.
    pub joints: Vec<f64>,
    /// The platform's pose, parasitic freedoms solved.
    pub pose: Pose<f64>,
    /// What became of it.
    pub status: Status,
}

/// Closed-form joints of all lanes for a machine whose every freedom is commanded. Returns the
/// smallest margin: not negative where all struts reach.
#[inline(always)]
pub fn lane_inverse<S: Real>(machine: &Machine, p: &[S], pose: &Pose<S>, joints: &mut [S]) -> S {
    let rotation = rotation_matrix(pose.rotation);
    let mut margin = S::splat(f64::INFINITY);
    for (joint, drive) in joints.iter_mut().zip(&machine.drives) {
        let reach = closed_form(machine, drive, p, pose.position, &rotation);
        *joint = reach.joint;
        margin = margin.min(reach.margin);
        if drive.kind.table().coordinate == Dimension::Angle {
            let scale = drive.scale.map_or(S::splat(1.0), |scale| p[scale]);
            for lane in 0..S::WIDTH {
                joint.set_lane(lane, drive.wrapped(reach.joint.lane(lane), scale.lane(lane)));
            }
        }
    }
    margin
}

/// A drive's closed form for the first strut that it carries.
#[inline(always)]
pub fn closed_form<S: Scalar>(
    machine: &Machine,
    drive: &MachineDrive,
    p: &[S],
    position: Vector<S>,
    rotation: &RotationMatrix<S>,
) -> InverseRoot<S> {
    let strut = &machine.struts[drive.struts[0]];
    let own = &p[strut.first..];
    let tool = &p[machine.tool..];
    let base = strut.carried_base(p);
    let platform = [own[3] - tool[0], own[4] - tool[1], own[5] - tool[2]];
    let arm = match &strut.ring {
        None => rotate(rotation, platform),
        Some(ring) => {
            let limb = Limb { base, arm: platform, length: base[0].lift(0.0) };
            ring_arm(ring, p[ring.radius], &limb, rotation, position).0
        }
    };
    // Last, since it may be a constant of its own: printed code names its steps in this order.
    let length = match strut.own_length {
        Some(index) => p[index],
        None => base[0].lift(0.0),
    };
    let parameters = &p[drive.first..];
    let platform = add(arm, position);
    let mut reach =
        drive.kind.inverse(&drive.nominal, parameters, drive.mode, base, length, platform);
    if strut.own_length.is_some() {
        // The closed forms know the length's square only; no strut of negative length reaches.
        reach.margin = length.select(reach.margin, length);
    }
    reach
}

/// Whether every joint lies in its travel; rounding at the ends does not count.
pub fn in_travel(machine: &Machine, joints: &[f64]) -> bool {
    joints.iter().zip(&machine.drives).all(|(&joint, drive)| {
        let [low, high] = drive.travel;
        let slack = TRAVEL_SLACK * (high - low).abs().max(low.abs()).max(high.abs());
        joint >= low - slack && joint <= high + slack
    })
}

/// The joints of one command. `pose` holds the commanded freedoms and, where there are parasitic
/// ones, their start.
pub fn inverse(machine: &Machine, p: &[f64], pose: &Pose<f64>) -> Inverse {
    let mut joints = vec![0.0; machine.drives.len()];
    let margin = lane_inverse(machine, p, pose, &mut joints);
    let mut solved = Inverse { joints, pose: *pose, status: Status::Ok };
    if machine.is_overconstrained() {
        solve_strained(machine, p, margin, pose, &mut solved);
    } else if machine.has_direct_inverse() {
        // Also true where it is NaN.
        if !(margin >= 0.0) {
            solved.status = Status::Unreachable;
        }
    } else {
        solve_parasitic(machine, p, margin, &mut solved);
    }
    if !solved.status.is_solved() {
        solved.pose = *pose;
        solved.joints.fill(f64::NAN);
    } else {
        solved.status = permitted(machine, p, &solved.joints, &solved.pose);
    }
    solved
}

/// Whether joints that are right may be commanded: within travel, and no strut leaning too far.
pub fn permitted(machine: &Machine, p: &[f64], joints: &[f64], pose: &Pose<f64>) -> Status {
    if !in_travel(machine, joints) {
        Status::OutOfTravel
    } else if machine.limited
        && leaning_at(machine, p, joints, pose).any(|(_, _, beyond)| beyond > 0.0)
    {
        Status::JointLimit
    } else {
        Status::Ok
    }
}

/// For every limited joint: the strut, the end (0 base, 1 platform) and by how much the strut leans
/// beyond the limit, rad.
pub fn leanings<S: Scalar>(
    machine: &Machine,
    p: &[S],
    joints: &[S],
    rotation: &RotationMatrix<S>,
    position: Vector<S>,
) -> Vec<(usize, usize, S)> {
    let zero = position[0].lift(0.0);
    let mut at = [Limb::zero(zero); CLOSURES];
    place_limbs(machine, p, joints, &mut at);
    let mut leanings = Vec::new();
    for (i, strut) in machine.struts.iter().enumerate() {
        let limb = &at[i];
        let arm = limb.turned_arm(strut, p, rotation, position);
        let along = subtract(add(arm, position), limb.base);
        for (end, limit) in strut.limits.iter().enumerate() {
            let Some(limit) = limit else { continue };
            let given = limit.axis.map(|value| zero.lift(value));
            let axis = match (end, strut.drive) {
                (1, _) => rotate(rotation, given),
                (_, None) => given,
                (_, Some(drive)) => carried(machine, p, joints, drive, given),
            };
            let angle = norm(cross(axis, along)).atan2(dot(axis, along));
            leanings.push((i, end, angle - zero.lift(limit.angle)));
        }
    }
    leanings
}

/// The same of a pose, by how much beyond.
fn leaning_at(
    machine: &Machine,
    p: &[f64],
    joints: &[f64],
    pose: &Pose<f64>,
) -> impl Iterator<Item = (usize, usize, f64)> {
    leanings(machine, p, joints, &rotation_matrix(pose.rotation), pose.position).into_iter()
}

/// A direction of a drive's carriage or crank, in base axes.
fn carried<S: Scalar>(
    machine: &Machine,
    p: &[S],
    joints: &[S],
    drive: usize,
    axis: Vector<S>,
) -> Vector<S> {
    let joint = joints[drive];
    let drive = &machine.drives[drive];
    let parameters = &p[drive.first..];
    let place = |point| drive.kind.place(&drive.nominal, parameters, joint, point, joint.lift(1.0));
    subtract(place(axis).0, place([joint.lift(0.0); 3]).0)
}

/// Joints for which the pose of least elastic energy is the commanded one in its commanded freedoms, by
/// Newton's iteration on the forward solution.
fn solve_strained(
    machine: &Machine,
    p: &[f64],
    seed_margin: f64,
    pose: &Pose<f64>,
    solved: &mut Inverse,
) {
    let unreachable = if seed_margin < 0.0 { Status::Unreachable } else { Status::NotConverged };
    let wanted = pose.to_coordinates();
    let commanded = indices_of(&machine.commanded);
    let l = machine.characteristic_length;
    let unit = |freedom: usize| if freedom < 3 { 1.0 } else { l };
    for _ in 0..STEPS {
        let at = limbs(machine, p, &solved.joints);
        let sample = Sample { machine, p, limbs: &at };
        let (reached_pose, status) = forward(&sample, &solved.joints, &solved.pose);
        if status != Status::Ok {
            solved.status = if status == Status::NotConverged { unreachable } else { status };
            return;
        }
        solved.pose = reached_pose;
        let reached = reached_pose.to_coordinates();
        let angles = [reached[3], reached[4], reached[5]];
        let mut linear = Linearisation::default();
        linear.fill_scalar(&sample, &solved.joints, &reached_pose);
        // Twist per joint, and twist per coordinate, in the commanded freedoms.
        let count = commanded.len();
        let mut system = [[0.0; SIX]; SIX];
        let mut step = [0.0; SIX];
        for row in 0..SIX {
            if row >= count {
                system[row][row] = 1.0;
                continue;
            }
            let freedom = commanded[row];
            step[row] = (wanted[freedom] - reached[freedom]) * unit(freedom);
            for joint in 0..count {
                let mut twist = [0.0; SIX];
                for &strut in &machine.drives[joint].struts {
                    for (k, value) in twist.iter_mut().enumerate() {
                        *value -= linear.inverse[k][strut] * linear.to_joint[strut];
                    }
                }
                let rate = if freedom < 3 {
                    twist[freedom]
                } else {
                    angle_rates(angles, [twist[3], twist[4], twist[5]])[freedom - 3]
                };
                system[row][joint] = rate * unit(freedom) / joint_length(machine, joint);
            }
        }
        let Pivoted { factors, order, .. } = factor_pivoting(&system);
        let mut change = order.map(|row| step[row]);
        solve(&factors, &mut change);
        let size = change.iter().map(|value| value.abs()).sum::<f64>() / l;
        // Also true where it is NaN.
        if !(size < 10.0) {
            solved.status = unreachable;
            return;
        }
        for (joint, value) in solved.joints.iter_mut().enumerate() {
            *value += change[joint] / joint_length(machine, joint);
        }
        if size < SETTLED {
            return;
        }
    }
    solved.status = unreachable;
}

/// Newton's iteration on parasitic freedoms and joints together.
fn solve_parasitic(machine: &Machine, p: &[f64], seed_margin: f64, solved: &mut Inverse) {
    let parasitic: Vec<usize> =
        (0..SIX).filter(|&k| machine.dof[k] && !machine.commanded[k]).collect();
    // Where all the platform's rotations are parasitic they are stepped as rotation vectors, free of
    // the singularity of Euler angles; where an angle is commanded the others are stepped as angles.
    let by_angle = machine.commanded[3..].contains(&true);
    let l = machine.characteristic_length;
    let count = machine.closure_count();
    let branch = |rates: &[f64]| rates.iter().map(|rate| rate.signum()).collect::<Vec<_>>();
    let mut wanted: Option<Vec<f64>> = None;
    let mut linear = Linearisation::default();
    for _ in 0..STEPS {
        let at = limbs(machine, p, &solved.joints);
        let (_, residuals) = Sample { machine, p, limbs: &at }.closures(&solved.pose);
        linear.differentiate(machine, p, &solved.joints, &solved.pose);
        let rows = &linear.rows;
        let [_, _, _, a, b, c] = solved.pose.to_coordinates();
        let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let axes = if by_angle { euler_axes([a, b, c]) } else { unit };
        let mut system: Matrix6<f64> = [[0.0; SIX]; SIX];
        for i in 0..SIX {
            // Identity rows for the freedoms that the frame holds are not needed: the unknowns are
            // as many as the closures.
            if i >= count {
                system[i][i] = 1.0;
                continue;
            }
            for (column, &freedom) in parasitic.iter().enumerate() {
                system[i][column] = if freedom < 3 {
                    rows[i][freedom]
                } else {
                    dot([rows[i][3], rows[i][4], rows[i][5]], axes[freedom - 3]) / l
                };
            }
            if let Some(drive) = machine.struts.get(i).and_then(|strut| strut.drive) {
                system[i][parasitic.len() + drive] =
                    linear.to_joint[i] / joint_length(machine, drive);
            }
        }
        let rates: Vec<f64> =
            machine.drives.iter().map(|drive| linear.to_joint[drive.struts[0]]).collect();
        let wanted = wanted.get_or_insert_with(|| branch(&rates));
        let Pivoted { factors, order, .. } = factor_pivoting(&system);
        let mut step = order.map(|row| if row < count { -residuals[row] } else { 0.0 });
        solve(&factors, &mut step);
        let size = step.iter().map(|value| value.abs()).sum::<f64>() / l;
        // Also true where it is NaN.
        if !(size < 10.0) {
            solved.status =
                if seed_margin < 0.0 { Status::Unreachable } else { Status::NotConverged };
            return;
        }
        apply(machine, &parasitic, by_angle, &step, solved);
        if size < SETTLED {
            if condition_index(&system, count, &std::array::from_fn(|k| k < count)) < SINGULAR {
                // A strut stretched to its last is both; that it does not reach is the cause.
                solved.status =
                    if seed_margin < 0.0 { Status::Unreachable } else { Status::Singular };
            } else if &branch(&rates) != wanted {
                solved.status = Status::BranchLost;
            }
            return;
        }
    }
    solved.status = if seed_margin < 0.0 { Status::Unreachable } else { Status::NotConverged };
}

/// What one unit of the scaled unknown of a joint is: 1 m of travel, or the angle that the
/// characteristic length is to a crank.
fn joint_length(machine: &Machine, drive: usize) -> f64 {
    match machine.drives[drive].kind.table().coordinate {
        Dimension::Angle => machine.characteristic_length,
        _ => 1.0,
    }
}

/// Moves parasitic freedoms and joints by the scaled step.
fn apply(
    machine: &Machine,
    parasitic: &[usize],
    by_angle: bool,
    step: &[f64; SIX],
    solved: &mut Inverse,
) {
    let l = machine.characteristic_length;
    let mut twist = [0.0; SIX];
    let mut angles = solved.pose.to_coordinates();
    for (column, &freedom) in parasitic.iter().enumerate() {
        if freedom < 3 {
            twist[freedom] = step[column];
        } else if by_angle {
            angles[freedom] += step[column] / l;
        } else {
            twist[freedom] = step[column] / l;
        }
    }
    if by_angle {
        solved.pose.rotation = Pose::from_coordinates(angles).rotation;
    }
    solved.pose.step(twist);
    for (drive, joint) in solved.joints.iter_mut().enumerate() {
        *joint += step[parasitic.len() + drive] / joint_length(machine, drive);
    }
}

/// One thing that keeps a pose from being used, for messages.
#[derive(Clone, Debug, PartialEq)]
pub enum Obstacle {
    /// Strut number, and by how much it is too short (positive) or too long (negative), m.
    Strut(usize, f64),
    /// Drive number, and by how much its joint is above (positive) or below (negative) its travel.
    Travel(usize, f64),
    /// Smallest over largest singular value.
    Singular(f64),
    /// Strut number, end (0 base, 1 platform), and by how much the strut leans beyond the limit, rad.
    Leaning(usize, usize, f64),
}

/// What keeps a commanded pose from being used, with amounts.
pub fn obstacles(machine: &Machine, p: &[f64], pose: &Pose<f64>) -> Vec<Obstacle> {
    let mut obstacles = Vec::new();
    let rotation = rotation_matrix(pose.rotation);
    for (index, strut) in machine.struts.iter().enumerate() {
        let Some(length) = strut.own_length.map(|own| p[own]) else { continue };
        let arm = rotate(&rotation, machine.platform_arm(p, strut));
        let platform = add(arm, pose.position);
        let base = strut.carried_base(p);
        let [least, most] = match strut.drive {
            None => [norm(subtract(platform, base)); 2],
            Some(drive) => {
                let drive = &machine.drives[drive];
                drive.kind.span(&drive.nominal, &p[drive.first..], base, platform)
            }
        };
        let fixed_in_closed_pose = strut.drive.is_none() && !machine.has_direct_inverse();
        if length < least && !fixed_in_closed_pose {
            obstacles.push(Obstacle::Strut(index, least - length));
        } else if length > most && !fixed_in_closed_pose {
            obstacles.push(Obstacle::Strut(index, most - length));
        }
    }
    let solved = inverse(machine, p, pose);
    if solved.status.is_solved() {
        for (index, (&joint, drive)) in solved.joints.iter().zip(&machine.drives).enumerate() {
            let [low, high] = drive.travel;
            if joint > high {
                obstacles.push(Obstacle::Travel(index, joint - high));
            } else if joint < low {
                obstacles.push(Obstacle::Travel(index, joint - low));
            }
        }
        if machine.limited {
            let beyond = leaning_at(machine, p, &solved.joints, &solved.pose)
                .filter(|&(_, _, beyond)| beyond > 0.0);
            obstacles
                .extend(beyond.map(|(strut, end, angle)| Obstacle::Leaning(strut, end, angle)));
        }
        let index = condition(machine, p, &solved.joints, &solved.pose);
        if index < SINGULAR {
            obstacles.push(Obstacle::Singular(index));
        }
    }
    obstacles
}

/// The commanded pose that a row of values in the order of the commanded freedoms names; what is not
/// commanded stays at home.
pub fn commanded_pose(machine: &Machine, values: &[f64]) -> Pose<f64> {
    if machine.commanded == [true; SIX] {
        return Pose::from_coordinates(std::array::from_fn(|k| values[k]));
    }
    let mut coordinates = machine.home.to_coordinates();
    for (&freedom, &value) in indices_of(&machine.commanded).iter().zip(values) {
        coordinates[freedom] = value;
    }
    Pose::from_coordinates(coordinates)
}
