//! Forward kinematics: the pose that closes the struts, by Newton's iteration from a nearby pose.
//!
//! Two paths: [`descend`] runs many samples side by side with one row order and reports, lane by
//! lane, whether its solution is proven; [`forward`] takes one sample, pivots, and where the plain
//! iteration is not trustworthy follows the residual down in steps, so that a pose of another
//! assembly is never returned as `ok`.

use super::SINGULAR;
use super::closures::{Limbs, Sample, squared_residuals, squared_rows, start_rows};
use super::condition::condition_at;
use super::linearisation::proven_regular;
use super::overconstrained::{Loads, least_energy};
use crate::linear::{
    IN_ORDER, Matrix6, Order, Pivoted, SIX, factor, factor_pivoting, inverse_of, solve,
};
use crate::machine::Machine;
use crate::scalar::Real;
use crate::spatial::Pose;
use crate::status::Status;

/// After a full step s shorter than this (relative) come chord steps on the same factors: Newton
/// leaves an error of about s^2, each chord step multiplies it by about s.
pub(super) const CHORD: f64 = 2e-4;
/// Chord steps before the next full one.
pub(super) const CHORD_STEPS: usize = 3;
/// A chord step c on factors of a full step s leaves about c s: settled below this.
pub(super) const SETTLED: f64 = 1e-15;
/// Full steps before a group of lanes gives up to the scalar path.
pub(super) const LANE_STEPS: usize = 12;
/// Full steps of one plain iteration on the scalar path.
const STEPS: usize = 40;
/// Plain iteration: a longer relative step may leave the assembly.
pub(super) const LONG_STEP: f64 = 0.5;
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

/// The size of a twist relative to the machine: displacement over characteristic length, plus rad.
/// A sum, so that no NaN is lost.
#[inline(always)]
pub(super) fn relative_size<S: Real>(machine: &Machine, twist: &[S; SIX]) -> S {
    let displacement = twist[0].abs() + twist[1].abs() + twist[2].abs();
    let rotation = twist[3].abs() + twist[4].abs() + twist[5].abs();
    displacement.mul_add(S::splat(1.0 / machine.characteristic_length), rotation)
}

/// The row order for a group of samples near one pose.
pub fn start_order(machine: &Machine, limbs: &Limbs<f64>, pose: &Pose<f64>) -> Order {
    factor_pivoting(&start_rows(machine, limbs, pose)).order
}

/// Newton's iteration on all lanes at once, rows in the given order.
#[inline(always)]
pub fn descend<S: Real>(
    machine: &Machine,
    limbs: &Limbs<S>,
    start: &Pose<S>,
    order: &Order,
) -> Descent<S> {
    let mut pose = *start;
    let mut first = S::splat(0.0);
    let mut same_branch = S::splat(1.0);
    let mut rows = [[S::default(); SIX]; SIX];
    let mut twist = [S::default(); SIX];
    for step in 0..LANE_STEPS {
        squared_rows(machine, limbs, &pose, order, &mut rows, &mut twist);
        let determinant = factor(&mut rows);
        solve(&rows, &mut twist);
        pose.step_back(&twist);
        if step == 0 {
            first = determinant;
        }
        same_branch = same_branch.min(first * determinant);
        let size = relative_size(machine, &twist);
        if size.all_below(CHORD) {
            for _ in 0..CHORD_STEPS {
                squared_residuals(machine, limbs, &pose, order, &mut twist);
                solve(&rows, &mut twist);
                pose.step_back(&twist);
                let settled = S::splat(SETTLED) - relative_size(machine, &twist) * size;
                if (-settled).all_below(0.0) {
                    let regular = proven_regular(machine, limbs, determinant);
                    return Descent { pose, proof: same_branch.min(regular) };
                }
            }
        }
    }
    Descent { pose, proof: S::splat(-1.0) }
}

/// Chord steps of [`chord`] before it gives up.
const CHORD_LIMIT: usize = 10;
/// [`chord`] is trusted while each step is shorter than this share of the one before.
const CONTRACTION: f64 = 0.1;
/// Relative step that may be rounding alone.
const ROUNDING: f64 = 1e-13;

/// The inverse of the squared rows of a plain machine at a pose, for [`chord`].
pub fn chord_inverse(sample: &Sample<'_>, pose: &Pose<f64>) -> Matrix6<f64> {
    inverse_of(&sample.squared(pose).0)
}

/// The inverse of the squared rows at a nearby pose, for [`chord`].
pub trait NearbyInverse<S> {
    /// [`chord`] has converged where the remaining relative step is below this.
    const SETTLED: f64;
    /// What a residual of closure `closure` turns component `component` of the twist by.
    fn at(&self, component: usize, closure: usize) -> S;
}

impl<S: Real> NearbyInverse<S> for Matrix6<f64> {
    const SETTLED: f64 = 1e-15;
    #[inline(always)]
    fn at(&self, component: usize, closure: usize) -> S {
        S::splat(self[component][closure])
    }
}

/// Every lane's own inverse, for poses to the last digit.
pub struct OwnInverse<S>(pub Matrix6<S>);

impl<S: Real> NearbyInverse<S> for OwnInverse<S> {
    const SETTLED: f64 = 1e-17;
    #[inline(always)]
    fn at(&self, component: usize, closure: usize) -> S {
        self.0[component][closure]
    }
}

/// Newton's iteration on all lanes of a plain machine with the inverse of a nearby pose all the way: no elimination, and
/// more steps, each shorter than the one before by the relative change of the rows.
///
/// While steps shrink tenfold each, the rows of every pose on the way differ from those of the start by
/// less than a singular one would, so the pose found is on the branch of the start.
#[inline(always)]
pub fn chord<S: Real, I: NearbyInverse<S>>(
    machine: &Machine,
    limbs: &Limbs<S>,
    start: &Pose<S>,
    inverse: &I,
) -> Descent<S> {
    let mut pose = *start;
    let mut proof = S::splat(1.0);
    let mut last = S::splat(LONG_STEP / CONTRACTION);
    let mut residuals = [S::default(); SIX];
    let mut twist = [S::default(); SIX];
    let count = machine.struts.len();
    for _ in 0..CHORD_LIMIT {
        squared_residuals(machine, limbs, &pose, &IN_ORDER, &mut residuals);
        for k in 0..SIX {
            twist[k] = inverse.at(k, 0) * residuals[0];
            for i in 1..count {
                twist[k] = inverse.at(k, i).mul_add(residuals[i], twist[k]);
            }
        }
        pose.step_back(&twist);
        let size = relative_size(machine, &twist);
        proof = proof.min(last.mul_add(S::splat(CONTRACTION), S::splat(ROUNDING)) - size);
        // What is left is size * (size / last), and a little more.
        let left = size.mul_add(size, -(last * S::splat(I::SETTLED)));
        if left.all_below(0.0) {
            return Descent { pose, proof };
        }
        last = size + S::splat(f64::MIN_POSITIVE);
    }
    Descent { pose, proof: S::splat(-1.0) }
}

/// How one plain iteration ended.
enum Ending {
    /// At a root, the determinant's sign kept all the way; the last determinant.
    Converged(f64),
    /// The determinant changed its sign.
    Crossed,
    /// A step too long, a singular matrix, or too many steps.
    Lost,
}

/// Newton's iteration towards squared residuals equal to `target`.
fn settle(
    sample: &Sample<'_>,
    pose: &mut Pose<f64>,
    target: &[f64; SIX],
    longest: f64,
    sign: &mut f64,
) -> Ending {
    for _ in 0..STEPS {
        let (rows, residuals) = sample.squared(pose);
        let Pivoted { factors, order, determinant } = factor_pivoting(&rows);
        if *sign == 0.0 {
            *sign = determinant.signum();
        }
        if determinant.signum() != *sign {
            return Ending::Crossed;
        }
        let step = |residuals: [f64; SIX]| {
            let mut twist = order.map(|row| residuals[row] - target[row]);
            solve(&factors, &mut twist);
            twist
        };
        let twist = step(residuals);
        let size = relative_size(sample.machine, &twist);
        // Also true where it is NaN.
        if !(size <= longest) {
            return Ending::Lost;
        }
        pose.step_back(&twist);
        if size < CHORD {
            for _ in 0..CHORD_STEPS {
                let twist = step(sample.squared_residuals(pose));
                pose.step_back(&twist);
                if relative_size(sample.machine, &twist) * size < SETTLED {
                    return Ending::Converged(determinant);
                }
            }
        }
    }
    Ending::Lost
}

/// The pose of one sample, and what became of it, by the way that the machine's closures ask for.
///
/// As many closures as freedoms: first the plain iteration. Where it crosses a singularity, steps too far
/// or does not settle, the residual at the start is taken down to zero in shares, each a short iteration:
/// the pose then moves continuously, as the machine itself would. More closures than freedoms: the pose
/// of least elastic energy ([`super::overconstrained`]).
pub fn forward(sample: &Sample<'_>, q: &[f64], start: &Pose<f64>) -> (Pose<f64>, Status) {
    let Sample { machine, limbs, .. } = *sample;
    let shortest =
        limbs[..machine.struts.len()].iter().map(|limb| limb.length).fold(f64::INFINITY, f64::min);
    // Also true where it is NaN.
    if !(shortest > 0.0) {
        return (*start, Status::Unreachable);
    }
    if machine.is_overconstrained() {
        let equilibrium = least_energy(sample, q, start, &Loads::default());
        return (equilibrium.pose, equilibrium.status);
    }
    let mut sign = 0.0;
    let mut pose = *start;
    let plain = settle(sample, &mut pose, &[0.0; SIX], LONG_STEP, &mut sign);
    if let Ending::Converged(determinant) = plain {
        return judged(sample, pose, determinant);
    }
    if condition_at(sample, &pose) < SINGULAR {
        return (pose, Status::Singular);
    }
    follow(sample, start)
}

/// Takes the residual at the start down to zero in shares.
fn follow(sample: &Sample<'_>, start: &Pose<f64>) -> (Pose<f64>, Status) {
    let (_, whole) = sample.squared(start);
    let mut sign = 0.0;
    let mut pose = *start;
    let mut left = 1.0;
    let mut share = 0.25;
    let mut crossed = false;
    let mut last = 0.0;
    while left > 0.0 {
        let next = if share >= left { 0.0 } else { left - share };
        let target = whole.map(|residual| residual * next);
        let mut trial = pose;
        match settle(sample, &mut trial, &target, FOLLOWED_STEP, &mut sign) {
            Ending::Converged(determinant) => {
                pose = trial;
                last = determinant;
                left = next;
                share *= 2.0;
                continue;
            }
            Ending::Crossed => crossed = true,
            Ending::Lost => {}
        }
        share *= 0.5;
        if share < SHORTEST_SHARE {
            let singular = condition_at(sample, &pose) < SINGULAR;
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
    judged(sample, pose, last)
}

/// A settled pose is `ok` only where the platform is held.
fn judged(sample: &Sample<'_>, pose: Pose<f64>, determinant: f64) -> (Pose<f64>, Status) {
    let proven =
        sample.machine.plain && proven_regular(sample.machine, sample.limbs, determinant) > 0.0;
    let regular = proven || condition_at(sample, &pose) >= SINGULAR;
    (pose, if regular { Status::Ok } else { Status::Singular })
}
