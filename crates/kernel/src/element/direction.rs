//! A direction that deviations tilt.

use crate::scalar::Scalar;
use crate::spatial::{Vector, dot, norm, scale, subtract, tangents};

/// A nominal direction and the two directions in which its deviations `u`, `v` tilt it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Direction {
    /// Unit vector.
    pub axis: Vector<f64>,
    /// Unit vectors; with the axis a right-handed frame.
    pub tangents: [Vector<f64>; 2],
}

impl Direction {
    /// From any non-zero vector.
    pub fn new(direction: Vector<f64>) -> Self {
        let axis = scale(direction, 1.0 / norm(direction));
        Direction { axis, tangents: tangents(axis) }
    }

    /// The unit axis tilted by `u` and `v` (tangents of the tilt angles).
    #[inline(always)]
    pub fn tilted<S: Scalar>(&self, u: S, v: S) -> Vector<S> {
        let mut axis = [u; 3];
        for k in 0..3 {
            let first = u.mul_add(u.lift(self.tangents[0][k]), u.lift(self.axis[k]));
            axis[k] = v.mul_add(v.lift(self.tangents[1][k]), first);
        }
        scale(axis, u.lift(1.0) / norm(axis))
    }

    /// The tilted unit axis and two vectors across it.
    #[inline(always)]
    pub fn tilted_triad<S: Scalar>(&self, u: S, v: S) -> [Vector<S>; 3] {
        if self.axis == [0.0; 3] {
            return [[u.lift(0.0); 3]; 3];
        }
        let axis = self.tilted(u, v);
        let across = self.tangents.map(|tangent| {
            let tangent = tangent.map(|value| u.lift(value));
            subtract(tangent, scale(axis, dot(tangent, axis)))
        });
        [axis, across[0], across[1]]
    }
}
