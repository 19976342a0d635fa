//! Forward kinematics: the pose that closes the struts, by Newton's iteration from a nearby pose.
//!
//! Two roads: [`descend`] runs many samples side by side with one row order and reports, lane by
//! lane, whether its answer is proven good; [`forward`] takes one sample, pivots, and where the plain
//! iteration is not trustworthy follows the residual down in steps, so that a pose of another
//! assembly is never returned as `ok`.

use super::closures::{Limbs, closure_rows, squared_residuals, squared_rows};
use super::linearisation::proven_regular;
use super::SINGULAR;
use crate::linear::{SIX, condition_index, factor, factor_pivoting, pivot_order, solve};
use crate::machine::Machine;
use crate::scalar::Real;
use crate::spatial::Pose;
use crate::status::Status;

/// Below this relative step the next one is a chord step on the same factors: Newton squares the
/// error, the chord multiplies it by the last step, so 1e-5 leaves at most about 1e-15.
const CHORD: f64 = 1e-5;
/// A chord step must not be longer than this: then what remains is below 1e-9 * 1e-5.
const SETTLED: f64 = 1e-9;
/// Full steps before a group of lanes gives up to the single road.
const LANE_STEPS: usize = 12;
/// Full steps of one plain iteration on the single road.
const STEPS: usize = 40;
/// Plain iteration: a longer relative step may leave the assembly.
const LONG_STEP: f64 = 0.5;
/// Following the residual: longest relative step, and shortest share of the way.
const FOLLOWED_STEP: f64 = 0.1;
const SHORTEST_SHARE: f64 = 1e-5;

/// What became of a group of lanes.
pub struct Descent<S> {
    /// The poses.
    pub pose: Pose<S>,
    /// Positive in a lane: converged, on the branch of the start and proven regular there.
    pub proof: S,
}

/// The size of a twist relative to the machine: displacement over characteristic length, or rad.
#[inline(always)]
fn relative_size<S: Real>(machine: &Machine, twist: &[S; SIX]) -> S {
    let displacement = twist[0].abs().max(twist[1].abs()).max(twist[2].abs());
    let rotation = twist[3].abs().max(twist[4].abs()).max(twist[5].abs());
    (displacement * S::splat(1.0 / machine.characteristic_length)).max(rotation)
}

#[inline(always)]
fn negated<S: Real>(mut values: [S; SIX]) -> [S; SIX] {
    for value in &mut values {
        *value = -*value;
    }
    values
}

/// The row order for a group of samples near one pose.
pub fn start_order(machine: &Machine, limbs: &Limbs<f64>, pose: &Pose<f64>) -> [usize; SIX] {
    pivot_order(&squared_rows(machine, limbs, pose).0)
}

/// Newton's iteration on all lanes at once, rows in the given order.
#[inline(always)]
pub fn descend<S: Real>(
    machine: &Machine,
    limbs: &Limbs<S>,
    start: &Pose<S>,
    order: &[usize; SIX],
) -> Descent<S> {
    let mut pose = *start;
    let mut first = S::splat(0.0);
    let mut same_branch = S::splat(1.0);
    for step in 0..LANE_STEPS {
        let (rows, residuals) = squared_rows(machine, limbs, &pose);
        let factored = factor(&rows, order);
        let twist = solve(&factored, &negated(residuals));
        pose.step(twist);
        let determinant = factored.pivot_product;
        if step == 0 {
            first = determinant;
        }
        same_branch = same_branch.min(first * determinant);
        if relative_size(machine, &twist).largest() < CHORD {
            let twist = solve(&factored, &negated(squared_residuals(machine, limbs, &pose)));
            pose.step(twist);
            let settled = S::splat(SETTLED) - relative_size(machine, &twist);
            let regular = proven_regular(machine, limbs, determinant);
            return Descent { pose, proof: settled.min(same_branch).min(regular) };
        }
    }
    Descent { pose, proof: S::splat(-1.0) }
}

/// How one plain iteration ended.
enum Ending {
    /// At a root, the determinant's sign kept all the way.
    Settled,
    /// The determinant changed its sign.
    Crossed,
    /// A step too long, a singular matrix, or too many steps.
    Lost,
}

/// Newton's iteration towards squared residuals equal to `target`.
fn settle(
    machine: &Machine,
    limbs: &Limbs<f64>,
    pose: &mut Pose<f64>,
    target: &[f64; SIX],
    longest: f64,
    sign: &mut f64,
) -> Ending {
    let missing = |residuals: [f64; SIX]| std::array::from_fn(|i| target[i] - residuals[i]);
    for _ in 0..STEPS {
        let (rows, residuals) = squared_rows(machine, limbs, pose);
        let factored = factor_pivoting(&rows);
        let side = (factored.pivot_product * factored.order_sign).signum();
        if *sign == 0.0 {
            *sign = side;
        }
        if side != *sign {
            return Ending::Crossed;
        }
        let twist = solve(&factored, &missing(residuals));
        let size = relative_size(machine, &twist);
        // Also true where it is NaN.
        if !(size <= longest) {
            return Ending::Lost;
        }
        pose.step(twist);
        if size < CHORD {
            let residuals = squared_residuals(machine, limbs, pose);
            let twist = solve(&factored, &missing(residuals));
            if relative_size(machine, &twist) < SETTLED {
                pose.step(twist);
                return Ending::Settled;
            }
        }
    }
    Ending::Lost
}

/// The pose of one sample, and what became of it.
///
/// First the plain iteration. Where it crosses a singularity, steps too far or does not settle, the
/// residual at the start is taken down to zero in shares, each a short iteration: the pose then moves
/// continuously, as the machine itself would.
pub fn forward(machine: &Machine, limbs: &Limbs<f64>, start: &Pose<f64>) -> (Pose<f64>, Status) {
    let shortest = limbs[..machine.struts.len()].iter().map(|limb| limb.length).fold(f64::INFINITY, f64::min);
    // Also true where it is NaN.
    if !(shortest > 0.0) {
        return (*start, Status::Unreachable);
    }
    let mut sign = 0.0;
    let mut pose = *start;
    if let Ending::Settled = settle(machine, limbs, &mut pose, &[0.0; SIX], LONG_STEP, &mut sign) {
        return judged(machine, limbs, pose);
    }
    if condition_at(machine, limbs, &pose) < SINGULAR {
        return (pose, Status::Singular);
    }
    follow(machine, limbs, start)
}

/// Takes the residual at the start down to zero in shares.
fn follow(machine: &Machine, limbs: &Limbs<f64>, start: &Pose<f64>) -> (Pose<f64>, Status) {
    let whole = squared_residuals(machine, limbs, start);
    let mut sign = 0.0;
    let mut pose = *start;
    let mut left = 1.0;
    let mut share = 0.25;
    let mut crossed = false;
    while left > 0.0 {
        let next = if share >= left { 0.0 } else { left - share };
        let target = whole.map(|residual| residual * next);
        let mut trial = pose;
        match settle(machine, limbs, &mut trial, &target, FOLLOWED_STEP, &mut sign) {
            Ending::Settled => {
                pose = trial;
                left = next;
                share *= 2.0;
                continue;
            }
            Ending::Crossed => crossed = true,
            Ending::Lost => {}
        }
        share *= 0.5;
        if share < SHORTEST_SHARE {
            let singular = condition_at(machine, limbs, &pose) < SINGULAR;
            let status = if singular {
                Status::Singular
            } else if crossed {
                Status::BranchLost
            } else {
                Status::NotConverged
            };
            return (pose, status);
        }
    }
    judged(machine, limbs, pose)
}

/// A settled pose is `ok` only where the platform is held.
fn judged(machine: &Machine, limbs: &Limbs<f64>, pose: Pose<f64>) -> (Pose<f64>, Status) {
    let (rows, _) = squared_rows(machine, limbs, &pose);
    let determinant = factor_pivoting(&rows).pivot_product;
    let regular = proven_regular(machine, limbs, determinant) > 0.0
        || condition_at(machine, limbs, &pose) >= SINGULAR;
    (pose, if regular { Status::Ok } else { Status::Singular })
}

/// Smallest over largest singular value of the scaled rows.
fn condition_at(machine: &Machine, limbs: &Limbs<f64>, pose: &Pose<f64>) -> f64 {
    let (mut rows, _) = closure_rows(machine, limbs, pose);
    for row in &mut rows {
        for value in &mut row[3..] {
            *value /= machine.characteristic_length;
        }
    }
    condition_index(&rows, machine.struts.len(), &machine.dof)
}
