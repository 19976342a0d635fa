//! How well the closures hold the platform: singular values of their rows.

use super::SINGULAR;
use super::closures::{Rows, Sample};
use super::linearisation::Linearisation;
use crate::linear::{SIX, condition_index, null_space};
use crate::machine::Machine;
use crate::spatial::Pose;

/// Smallest over largest singular value of the scaled rows.
pub fn condition_at(sample: &Sample<'_>, pose: &Pose<f64>) -> f64 {
    let rows = by_length(sample.machine, sample.closures(pose).0);
    condition_index(&rows, sample.machine.closure_count(), &sample.machine.dof)
}

/// Rows with rotations in units of the characteristic length.
fn by_length(machine: &Machine, mut rows: Rows<f64>) -> Rows<f64> {
    for value in rows.iter_mut().flat_map(|row| &mut row[3..]) {
        *value /= machine.characteristic_length;
    }
    rows
}

/// The closures' rows with rotations in units of the characteristic length.
fn scaled_rows(machine: &Machine, p: &[f64], q: &[f64], pose: &Pose<f64>) -> Rows<f64> {
    let mut linear = Linearisation::default();
    linear.differentiate(machine, p, q, pose);
    by_length(machine, linear.rows)
}

/// Smallest over largest singular value of the scaled closure Jacobian: 1 isotropic, 0 singular.
pub fn condition(machine: &Machine, p: &[f64], q: &[f64], pose: &Pose<f64>) -> f64 {
    let rows = scaled_rows(machine, p, q, pose);
    condition_index(&rows, machine.closure_count(), &machine.dof)
}

/// The twists of the platform about its tool point that no closure holds: none at a good pose. Of unit
/// length where rotations are measured by the characteristic length.
pub fn free_motions(machine: &Machine, p: &[f64], q: &[f64], pose: &Pose<f64>) -> Vec<[f64; SIX]> {
    let rows = scaled_rows(machine, p, q, pose);
    let mut free = null_space(&rows, machine.closure_count(), &machine.dof, SINGULAR);
    for twist in &mut free {
        for value in &mut twist[3..] {
            *value /= machine.characteristic_length;
        }
    }
    free
}
