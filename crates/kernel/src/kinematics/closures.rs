//! The closures of a machine at a pose, with their rows: derivatives to the platform's twist.
//!
//! The elements give closures of points; how a platform joint moves with the platform's twist
//! (translation of the tool point, then rotation) is added here, once for all elements.

use crate::element::strut;
use crate::linear::{IN_ORDER, Matrix6, Order, SIX};
use crate::machine::Machine;
use crate::scalar::{Dual, Real};
use crate::spatial::{Pose, Vector, add, cross, rotate, rotation_matrix};

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
/// point; zero in the freedoms that the frame holds.
#[inline(always)]
pub fn row<S: Real>(machine: &Machine, to_centre: Vector<S>, arm: Vector<S>) -> [S; SIX] {
    let moment = cross(arm, to_centre);
    let mut row = [to_centre[0], to_centre[1], to_centre[2], moment[0], moment[1], moment[2]];
    for &freedom in &machine.held {
        row[freedom] = S::default();
    }
    row
}

/// Residuals and rows of a closure for all struts, in the given order of elimination: rows
/// `0..closure_count` are closures, those beyond are identity rows of the freedoms that the frame
/// holds, which are taken out of the closures.
#[inline(always)]
fn rows_of<S: Real, const SQUARED: bool>(
    machine: &Machine,
    limbs: &Limbs<S>,
    pose: &Pose<S>,
    order: &Order,
    rows: &mut Matrix6<S>,
    residuals: &mut [S; SIX],
) {
    let rotation = rotation_matrix(pose.rotation);
    let count = machine.struts.len();
    for slot in 0..SIX {
        let i = order[slot];
        if i >= count {
            rows[slot] = held_row(machine, i - count);
            residuals[slot] = S::default();
            continue;
        }
        let limb = &limbs[i];
        let arm = rotate(&rotation, limb.arm);
        let centre = add(arm, pose.position);
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
        rows[slot] = row(machine, closure.parts, arm);
        residuals[slot] = closure.value;
    }
}

/// The identity row of the freedom that the frame holds as its number `number`.
#[inline(always)]
pub fn held_row<S: Real>(machine: &Machine, number: usize) -> [S; SIX] {
    let mut result = [S::default(); SIX];
    result[machine.held[number]] = S::splat(1.0);
    result
}

/// Residuals and rows of the squared closures: what Newton's iteration runs on.
#[inline(always)]
pub fn squared_rows<S: Real>(
    machine: &Machine,
    limbs: &Limbs<S>,
    pose: &Pose<S>,
    order: &Order,
    rows: &mut Matrix6<S>,
    residuals: &mut [S; SIX],
) {
    rows_of::<S, true>(machine, limbs, pose, order, rows, residuals);
}

/// Residuals (m) and rows (unit wrenches) of the closures themselves, as they come.
pub fn closure_rows(
    machine: &Machine,
    limbs: &Limbs<f64>,
    pose: &Pose<f64>,
) -> (Matrix6<f64>, [f64; SIX]) {
    let (mut rows, mut residuals) = ([[0.0; SIX]; SIX], [0.0; SIX]);
    rows_of::<f64, false>(machine, limbs, pose, &IN_ORDER, &mut rows, &mut residuals);
    (rows, residuals)
}

/// Residuals of the squared closures alone, in the given order.
#[inline(always)]
pub fn squared_residuals<S: Real>(
    machine: &Machine,
    limbs: &Limbs<S>,
    pose: &Pose<S>,
    order: &Order,
    residuals: &mut [S; SIX],
) {
    let rotation = rotation_matrix(pose.rotation);
    for slot in 0..SIX {
        residuals[slot] = if order[slot] < machine.struts.len() {
            let limb = &limbs[order[slot]];
            let centre = add(rotate(&rotation, limb.arm), pose.position);
            strut::squared_closure(limb.base, centre, limb.length)
        } else {
            S::default()
        };
    }
}
