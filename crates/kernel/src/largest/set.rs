//! A set of errors: how far it reaches along directions, and its farthest points.

use crate::scalar::Real;
use crate::spatial::{Vector, dot, norm, scale};
use std::ops::Range;

/// By how much a point must be longer to be the next of a climb.
const LONGER: f64 = 1e-12;
/// Steps of a climb: a few to a vertex, more on an ellipsoid, which the cones finish.
const STEPS: usize = 24;

/// Points of three components, the last ones zero where there are fewer.
#[derive(Clone, Debug, Default)]
pub struct Set {
    /// Its middle.
    pub centre: Vector<f64>,
    /// Half of each segment.
    pub segments: Vec<Vector<f64>>,
    /// Columns of the matrices of all ellipsoids.
    pub axes: Vec<Vector<f64>>,
    /// Which of `axes` each ellipsoid has.
    pub ellipsoids: Vec<Range<usize>>,
}

/// The farthest point of a set.
#[derive(Clone, Copy, Debug, Default)]
pub struct Farthest {
    /// The largest length, from above: at most `STATED` too large.
    pub length: f64,
    /// Length of a point of the set: seldom less than the largest, never more.
    pub reached: f64,
    /// Along which that point lies farthest: a unit vector.
    pub direction: Vector<f64>,
}

/// The inner product of one vector with lanes of directions.
#[inline(always)]
fn along<S: Real>(vector: &Vector<f64>, u: Vector<S>) -> S {
    dot([S::splat(vector[0]), S::splat(vector[1]), S::splat(vector[2])], u)
}

impl Set {
    /// How far the set reaches, along lanes of directions or along their opposites, whichever is farther.
    #[inline(always)]
    pub fn reach<S: Real>(&self, u: Vector<S>) -> S {
        // Two sums at once: each waits for its own last addition only.
        let mut sums = [along(&self.centre, u).abs(), S::splat(0.0)];
        let pairs = self.segments.chunks_exact(2);
        for segment in pairs.remainder() {
            sums[0] = sums[0] + along(segment, u).abs();
        }
        for pair in pairs {
            sums[0] = sums[0] + along(&pair[0], u).abs();
            sums[1] = sums[1] + along(&pair[1], u).abs();
        }
        for ellipsoid in &self.ellipsoids {
            let mut square = S::splat(0.0);
            for axis in &self.axes[ellipsoid.clone()] {
                square = along(axis, u).square_plus(square);
            }
            sums[1] = sums[1] + square.sqrt();
        }
        sums[0] + sums[1]
    }

    /// The farthest point along a direction, or the opposite of that along the opposite direction.
    #[inline(always)]
    fn point(&self, u: Vector<f64>) -> Vector<f64> {
        let mut point = scale(self.centre, 1f64.copysign(dot(self.centre, u)));
        for segment in &self.segments {
            let sign = 1f64.copysign(dot(*segment, u));
            for k in 0..3 {
                point[k] += sign * segment[k];
            }
        }
        for ellipsoid in &self.ellipsoids {
            let axes = &self.axes[ellipsoid.clone()];
            let mut square: f64 = 0.0;
            for axis in axes {
                square += dot(*axis, u) * dot(*axis, u);
            }
            let size = square.sqrt();
            if size > 0.0 {
                for axis in axes {
                    let share = dot(*axis, u) / size;
                    for k in 0..3 {
                        point[k] += share * axis[k];
                    }
                }
            }
        }
        point
    }

    /// From a direction on to that of the point found, as long as the points become longer.
    #[inline(always)]
    pub fn climb(&self, from: Vector<f64>, farthest: &mut Farthest) {
        let mut u = from;
        let mut reached = 0.0;
        for _ in 0..STEPS {
            let point = self.point(u);
            let length = norm(point);
            if !(length > reached * (1.0 + LONGER)) {
                break;
            }
            reached = length;
            if length > farthest.reached {
                let direction = scale(u, 1f64.copysign(dot(self.centre, u)));
                *farthest = Farthest { reached: length, direction, ..*farthest };
            }
            u = scale(point, 1.0 / length);
        }
    }
}
