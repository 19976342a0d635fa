//! The quantities that are bounded: both ends of every component of an error, and the sizes of its two parts.

use super::closures::Six;
use super::directions::{Longest, longest};
use super::point;
use crate::linear::SIX;
use crate::machine::{Machine, indices_of, parts};
use crate::scalar::Scalar;
use crate::spatial::Vector;

/// Upper ends of the six components, their lower ends with the sign turned, both magnitudes.
pub const TARGETS: usize = 2 * SIX + 2;

/// Nothing is enough.
pub const AS_LOW_AS_CAN_BE: [f64; TARGETS] = [f64::NEG_INFINITY; TARGETS];

/// How close the bounds must be.
#[derive(Clone, Copy, Debug)]
pub struct Closeness {
    /// Magnitudes: at most this times the farthest reach.
    pub fine: f64,
    /// Bounds that need not be lower, each.
    pub enough: [f64; TARGETS],
}

/// Bounds of all targets, and the directions (unit vectors of three) in which the magnitudes' are reached.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Of each target, m and rad.
    pub values: [f64; TARGETS],
    /// Of position and orientation.
    pub farthest: [Vector<f64>; 2],
}

/// Bounds of all targets from how far displacements reach along directions; `whole` encloses them.
pub fn targets(
    machine: &Machine,
    whole: &Six,
    closeness: &Closeness,
    most: impl Fn(&[f64; SIX]) -> f64,
) -> Bounds {
    let length = point(machine.characteristic_length);
    let free = indices_of(&machine.dof);
    let squared =
        (3..SIX).map(|k| (whole[k] / length).square()).fold(point(0.0), |sum, one| sum + one).upper;
    let mut values = [0.0; TARGETS];
    let component = |k: usize, reached: f64| {
        if k < 3 { reached } else { rotation_bound((point(reached) / length).upper, squared) }
    };
    let mut along_axis = [f64::NAN; 2 * SIX];
    for &k in &free {
        let ends = [whole[k].upper, -whole[k].lower];
        for (turned, (sign, end)) in [1.0, -1.0].into_iter().zip(ends).enumerate() {
            let target = turned * SIX + k;
            values[target] = component(k, end);
            if values[target] > closeness.enough[target] {
                let mut direction = [0.0; SIX];
                direction[k] = sign;
                along_axis[target] = most(&direction);
                values[target] = component(k, along_axis[target]);
            }
        }
    }
    let mut farthest = [[0.0; 3]; 2];
    for part in parts(&machine.dof) {
        let own: Vec<usize> = free.iter().filter(|&&k| k / 3 == part).map(|k| k % 3).collect();
        let size =
            |reached: f64| if part == 0 { reached } else { angle((point(reached) / length).upper) };
        let ends = own.iter().map(|k| point(whole[3 * part + k].magnitude()).square());
        let crude = ends.fold(point(0.0), |sum, one| sum + one).sqrt().upper;
        let target = 2 * SIX + part;
        values[target] = size(crude);
        if values[target] <= closeness.enough[target] {
            continue;
        }
        let enough =
            closeness.enough[target] * if part == 0 { 1.0 } else { machine.characteristic_length };
        let Longest { bound, direction } = longest(&own, closeness.fine, enough, |u| {
            // Along an axis it is the component's.
            let mut others = (0..3).filter(|&k| u[k] != 0.0);
            if let (Some(k), None) = (others.next(), others.next()) {
                let known = along_axis[3 * part + k + if u[k] > 0.0 { 0 } else { SIX }];
                if !known.is_nan() {
                    return known;
                }
            }
            let mut direction = [0.0; SIX];
            direction[3 * part..3 * part + 3].copy_from_slice(&u);
            most(&direction)
        });
        values[target] = values[target].min(size(bound));
        farthest[part] = direction;
    }
    Bounds { values, farthest }
}

/// An upper bound of a rotation vector's component from one of the Cayley vector's, `squared` an upper
/// bound of its squared length: the factor between them falls with the length, which is at least the
/// component, and lies in [1 - squared / 12, 1].
fn rotation_bound(cayley: f64, squared: f64) -> f64 {
    if cayley >= 0.0 {
        angle(cayley)
    } else {
        (point(cayley) * (point(1.0) - point(squared) / point(12.0))).upper
    }
}

/// An upper bound of the angle whose Cayley vector is at most so long: 2 atan(m / 2) is at most
/// m - m^3 / 12 + m^5 / 80 for every m >= 0 (with x = m^2 / 4 the derivative of the difference is
/// x^3 / (1 + x)), which grows with m.
fn angle(cayley: f64) -> f64 {
    if !cayley.is_finite() {
        return cayley;
    }
    let m = point(cayley);
    let square = m.square();
    (m * (point(1.0) - square / point(12.0) + square.square() / point(80.0))).upper
}
