//! What bounds are asked of: both ends of every component of an error, and the sizes of its two parts.

use super::closures::Six;
use super::directions::longest;
use super::point;
use crate::linear::SIX;
use crate::machine::{Machine, chosen, parts};
use crate::scalar::Scalar;

/// Upper ends of the six components, their lower ends with the sign turned, both magnitudes.
pub const TARGETS: usize = 2 * SIX + 2;

/// Bounds of all targets from how far displacements reach along directions; `whole` encloses them.
pub fn targets(
    machine: &Machine,
    whole: &Six,
    most: impl Fn(&[f64; SIX]) -> f64,
) -> [f64; TARGETS] {
    let length = point(machine.characteristic_length);
    let free = chosen(&machine.dof);
    let squared =
        (3..SIX).map(|k| (whole[k] / length).square()).fold(point(0.0), |sum, one| sum + one).upper;
    let mut result = [0.0; TARGETS];
    for &k in &free {
        for (target, sign) in [(k, 1.0), (SIX + k, -1.0)] {
            let mut direction = [0.0; SIX];
            direction[k] = sign;
            let bound = most(&direction);
            result[target] =
                if k < 3 { bound } else { rotation_bound((point(bound) / length).upper, squared) };
        }
    }
    for part in parts(&machine.dof) {
        let own: Vec<usize> = free.iter().filter(|&&k| k / 3 == part).map(|k| k % 3).collect();
        let farthest = longest(&own, |u| {
            let mut direction = [0.0; SIX];
            direction[3 * part..3 * part + 3].copy_from_slice(&u);
            most(&direction)
        });
        result[2 * SIX + part] =
            if part == 0 { farthest } else { (point(farthest) / length).upper };
    }
    result
}

/// An upper bound of a rotation vector's component from one of the Cayley vector's, `squared` an upper
/// bound of its squared length: the factor between them lies in [1 - squared / 12, 1].
fn rotation_bound(cayley: f64, squared: f64) -> f64 {
    if cayley >= 0.0 {
        cayley
    } else {
        (point(cayley) * (point(1.0) - point(squared) / point(12.0))).upper
    }
}
