//! The closures of a machine at a pose, with their rows: derivatives to the platform's twist.
//!
//! The elements give closures of points; how a platform joint moves with the platform's twist
//! (translation of the tool point, then rotation) is added here, once for all elements.

use crate::element::strut;
use crate::linear::{Matrix6, SIX};
use crate::machine::Machine;
use crate::scalar::{Dual, Real, Scalar};
use crate::spatial::{Pose, RotationMatrix, Vector, add, cross, rotate, rotation_matrix};


/// One strut of one sample, ready for the iteration: everything that does not depend on the pose.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limb<S> {
    /// Base-side joint centre, base frame.
    pub base: Vector<S>,
    /// Platform-side joint centre from the tool point, platform axes.
    pub arm: Vector<S>,
    /// The strut's length.
    pub length: S,
}

/// The struts of one sample; those beyond the machine's closure count are unused.
pub type Limbs<S> = [Limb<S>; SIX];

/// Places every strut's joint centres for parameters `p` and joint coordinates `q`.
#[inline(always)]
pub fn limbs<S: Real>(machine: &Machine, p: &[S], q: &[S]) -> Limbs<S> {
    let mut result = [Limb::default(); SIX];
    let tool = [p[machine.tool], p[machine.tool + 1], p[machine.tool + 2]];
    for (limb, strut) in result.iter_mut().zip(&machine.struts) {
        let own = &p[strut.first..];
        let base = [own[0], own[1], own[2]];
        let length = match strut.own_length {
            Some(index) => p[index],
            None => S::splat(0.0),
        };
        limb.arm = [own[3] - tool[0], own[4] - tool[1], own[5] - tool[2]];
        (limb.base, limb.length) = match strut.drive {
            None => (base, length),
            Some(index) => {
                let drive = &machine.drives[index];
                drive.kind.place(&drive.frame, &p[drive.first..], q[index], base, length)
            }
        };
    }
    result
}

/// A row from the derivative to the platform joint: the same force, and its moment about the tool
/// point.
#[inline(always)]
pub fn row<S: Scalar>(to_centre: Vector<S>, arm: Vector<S>) -> [S; SIX] {
    let moment = cross(arm, to_centre);
    [to_centre[0], to_centre[1], to_centre[2], moment[0], moment[1], moment[2]]
}

/// Residuals and rows of the given generic closure for all struts, the held freedoms zeroed and
/// their identity rows added.
#[inline(always)]
fn rows_of<S: Real, const SQUARED: bool>(
    machine: &Machine,
    limbs: &Limbs<S>,
    position: Vector<S>,
    rotation: &RotationMatrix<S>,
) -> (Matrix6<S>, [S; SIX]) {
    let mut rows = [[S::default(); SIX]; SIX];
    let mut residuals = [S::default(); SIX];
    let count = machine.struts.len();
    for i in 0..count {
        let limb = &limbs[i];
        let arm = rotate(rotation, limb.arm);
        let centre = add(arm, position);
        let at = [
            Dual::<S, 3>::variable(centre[0], 0),
            Dual::variable(centre[1], 1),
            Dual::variable(centre[2], 2),
        ];
        let base = [
            Dual::constant(limb.base[0]),
            Dual::constant(limb.base[1]),
            Dual::constant(limb.base[2]),
        ];
        let length = Dual::constant(limb.length);
        let closure = if SQUARED {
            strut::squared_closure(base, at, length)
        } else {
            strut::closure(base, at, length)
        };
        rows[i] = row(closure.parts, arm);
        residuals[i] = closure.value;
    }
    hold(machine, &mut rows);
    (rows, residuals)
}

/// Takes the freedoms that the frame holds out of the closures and gives each an identity row.
#[inline(always)]
pub fn hold<S: Real>(machine: &Machine, rows: &mut Matrix6<S>) {
    let mut next = machine.struts.len();
    if next == SIX {
        return;
    }
    for k in 0..SIX {
        if !machine.dof[k] {
            for i in 0..machine.struts.len() {
                rows[i][k] = S::default();
            }
            rows[next] = [S::default(); SIX];
            rows[next][k] = S::splat(1.0);
            next += 1;
        }
    }
}

/// Residuals and rows of the squared closures: what Newton's iteration runs on.
#[inline(always)]
pub fn squared_rows<S: Real>(
    machine: &Machine,
    limbs: &Limbs<S>,
    pose: &Pose<S>,
) -> (Matrix6<S>, [S; SIX]) {
    rows_of::<S, true>(machine, limbs, pose.position, &rotation_matrix(pose.rotation))
}

/// Residuals (m) and rows (unit wrenches) of the closures themselves.
#[inline(always)]
pub fn closure_rows<S: Real>(
    machine: &Machine,
    limbs: &Limbs<S>,
    pose: &Pose<S>,
) -> (Matrix6<S>, [S; SIX]) {
    rows_of::<S, false>(machine, limbs, pose.position, &rotation_matrix(pose.rotation))
}

/// Residuals of the squared closures alone.
#[inline(always)]
pub fn squared_residuals<S: Real>(
    machine: &Machine,
    limbs: &Limbs<S>,
    pose: &Pose<S>,
) -> [S; SIX] {
    let rotation = rotation_matrix(pose.rotation);
    let mut residuals = [S::default(); SIX];
    for i in 0..machine.struts.len() {
        let limb = &limbs[i];
        let centre = add(rotate(&rotation, limb.arm), pose.position);
        residuals[i] = strut::squared_closure(limb.base, centre, limb.length);
    }
    residuals
}
