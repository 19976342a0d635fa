//! The largest length that a vector of a set can have: how far off one machine inside the bands can be.
//!
//! The set is a point, plus segments (the effect of one variable in [-1, 1]), plus ellipsoids (that of a unit vector
//! does). Its support function, the most that e . u is over it,
//!
//! ```text
//! h(u) = c . u + sum |s . u| + sum |B' u|
//! ```
//!
//! is convex, and the largest length is the largest h over unit directions u (Rockafellar, Convex Analysis,
//! 1970, section 13). From below, climbing: the set's farthest point along u is longer than h(u), and
//! lies in a direction along which the set reaches at least as far. From above, cones of directions: h is
//! at most linear between their edges, which bounds a cone by the reaches at its corners, exactly where
//! these reach the same vertex; cones that may hold a longer vector are divided, until none may.

mod batch;
mod cone;
mod net;

pub use batch::{Domain, Largest, NUMBERS, largest_of};

use crate::scalar::Real;
use crate::spatial::{Vector, dot, norm, scale};
use cone::Cone;
use net::{CONES, HALF, NET};
use std::ops::Range;

/// What of a length is rounding.
const ROUNDING: f64 = 1e-12;
/// Directions after which a gap of `NARROW` is enough, as where an ellipsoid is smooth.
const SOME: usize = 300;
/// See `SOME`.
const NARROW: f64 = 1e-6;
/// Directions after which a gap of `STATED` is enough, as where all directions are nearly alike.
const MANY: usize = 1500;
/// See `MANY`: what a length may be too large by.
pub const STATED: f64 = 5e-4;
/// The most directions, whatever the gap is then.
const MOST: usize = 60_000;
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
    /// How far the set without its centre reaches, along lanes of directions and along their opposites.
    #[inline(always)]
    fn reach<S: Real>(&self, u: Vector<S>) -> S {
        // Two sums at once: each waits for its own last addition only.
        let mut sums = [S::splat(0.0); 2];
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

    /// The farthest point along a direction.
    #[inline(always)]
    fn point(&self, u: Vector<f64>) -> Vector<f64> {
        let mut point = self.centre;
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
    fn climb(&self, from: Vector<f64>, farthest: &mut Farthest) {
        let mut u = from;
        let mut reached = 0.0;
        for _ in 0..STEPS {
            let point = self.point(u);
            let length = norm(point);
            if !(length > reached * (1.0 + ROUNDING)) {
                break;
            }
            reached = length;
            if length > farthest.reached {
                *farthest = Farthest { reached: length, direction: u, ..*farthest };
            }
            u = scale(point, 1.0 / length);
        }
    }
}

/// Room for a search, used again for the next.
#[derive(Default)]
pub struct Search {
    directions: Vec<Vector<f64>>,
    reach: Vec<f64>,
    cones: Vec<Cone>,
    next: Vec<Cone>,
    /// The largest bound of the cones that were dropped.
    dropped: f64,
}

impl Search {
    /// The farthest point of a set; no number where the set has a part that is none.
    #[inline(always)]
    pub fn farthest<S: Real>(&mut self, set: &Set) -> Farthest {
        let mut farthest = Farthest::default();
        if set.segments.is_empty() && set.ellipsoids.is_empty() {
            let length = norm(set.centre);
            let direction =
                if length > 0.0 { scale(set.centre, 1.0 / length) } else { [1.0, 0.0, 0.0] };
            return Farthest { length, reached: length, direction };
        }
        self.begin::<S>(set);
        for reach in &self.reach {
            if !reach.is_finite() {
                return Farthest { length: f64::NAN, reached: f64::NAN, direction: [f64::NAN; 3] };
            }
        }
        self.climb_from(0, set, &mut farthest);
        self.cones_of_net::<S>(farthest.reached * (1.0 + ROUNDING));
        while !self.cones.is_empty() {
            let mut largest: f64 = 0.0;
            for cone in &self.cones {
                largest = largest.max(cone.bound);
            }
            let (tried, gap) = (self.directions.len(), largest / farthest.reached - 1.0);
            if tried >= SOME && gap <= NARROW || tried >= MANY && gap <= STATED || tried >= MOST {
                self.dropped = self.dropped.max(largest);
                break;
            }
            let first = tried;
            for cone in &self.cones {
                self.directions.push(cone.apex);
            }
            self.evaluate::<S>(set, first);
            self.climb_from(first, set, &mut farthest);
            self.divide(first, farthest.reached * (1.0 + ROUNDING));
        }
        farthest.length = self.dropped.max(farthest.reached);
        farthest
    }

    /// Evaluates the net.
    #[inline(always)]
    fn begin<S: Real>(&mut self, set: &Set) {
        self.directions.clear();
        self.directions.extend_from_slice(&NET.directions);
        self.reach.clear();
        self.reach.resize(2 * HALF, 0.0);
        self.cones.clear();
        self.dropped = 0.0;
        for first in (0..HALF).step_by(S::WIDTH) {
            let mut u = [S::default(); 3];
            for lane in 0..S::WIDTH {
                for k in 0..3 {
                    u[k].set_lane(lane, self.directions[first + lane][k]);
                }
            }
            let both = set.reach(u);
            for lane in 0..S::WIDTH {
                let middle = dot(set.centre, self.directions[first + lane]);
                self.reach[first + lane] = both.lane(lane) + middle;
                self.reach[HALF + first + lane] = both.lane(lane) - middle;
            }
        }
    }

    /// Climbs from the direction, of those from number `first` on, along which the set reaches farthest.
    #[inline(always)]
    fn climb_from(&self, first: usize, set: &Set, farthest: &mut Farthest) {
        let mut best = first;
        for k in first..self.reach.len() {
            if self.reach[k] > self.reach[best] {
                best = k;
            }
        }
        // No point is nearer than the set reaches along its direction.
        if self.reach[best] > farthest.reached {
            set.climb(self.directions[best], farthest);
        }
    }

    /// Keeps the cones of the net that may hold a vector longer than `enough`.
    #[inline(always)]
    fn cones_of_net<S: Real>(&mut self, enough: f64) {
        for first in (0..CONES).step_by(S::WIDTH) {
            let mut a = [S::splat(0.0); 3];
            for i in 0..3 {
                let mut reach = S::default();
                for lane in 0..S::WIDTH {
                    reach.set_lane(lane, self.reach[NET.corners[first + lane][i]]);
                }
                for k in 0..3 {
                    a[k] = reach.mul_add(S::load(&NET.dual[i][k][first..]), a[k]);
                }
            }
            for lane in 0..S::WIDTH.min(NET.cones - first) {
                let a = [a[0].lane(lane), a[1].lane(lane), a[2].lane(lane)];
                self.keep(NET.corners[first + lane], a, enough);
            }
        }
        std::mem::swap(&mut self.cones, &mut self.next);
    }

    /// Keeps a cone where it may hold a vector longer than `enough`.
    #[inline(always)]
    fn keep(&mut self, corners: [usize; 3], a: Vector<f64>, enough: f64) {
        match Cone::new(corners, a, &self.directions, &self.reach, enough) {
            Ok(cone) => self.next.push(cone),
            Err(bound) => self.dropped = self.dropped.max(bound),
        }
    }

    /// Divides every cone where its bound is: the directions from number `first` on.
    #[inline(always)]
    fn divide(&mut self, first: usize, enough: f64) {
        for number in 0..self.cones.len() {
            let (cone, new) = (self.cones[number], first + number);
            let (d, reach) = (self.directions[new], self.reach[new]);
            for corner in 0..3 {
                // The part without the face opposite to the new direction is empty.
                if cone.opposite == Some(corner) {
                    continue;
                }
                let mut corners = cone.corners;
                corners[corner] = new;
                let kept = [corners[(corner + 1) % 3], corners[(corner + 2) % 3]];
                let kept = [self.directions[kept[0]], self.directions[kept[1]]];
                let a = cone.moved(kept, d, reach);
                self.keep(corners, a, enough);
            }
        }
        std::mem::swap(&mut self.cones, &mut self.next);
        self.next.clear();
    }

    /// Makes the directions from number `first` on unit vectors, and finds how far the set reaches.
    #[inline(always)]
    fn evaluate<S: Real>(&mut self, set: &Set, first: usize) {
        let count = self.directions.len();
        self.reach.resize(count, 0.0);
        let [x, y, z] = set.centre;
        let centre = [S::splat(x), S::splat(y), S::splat(z)];
        let mut at = first;
        while at < count {
            let size = S::WIDTH.min(count - at);
            let mut u = [S::splat(1.0); 3];
            for lane in 0..size {
                for k in 0..3 {
                    u[k].set_lane(lane, self.directions[at + lane][k]);
                }
            }
            let u = scale(u, S::splat(1.0) / norm(u));
            let reach = dot(centre, u) + set.reach(u);
            for lane in 0..size {
                for k in 0..3 {
                    self.directions[at + lane][k] = u[k].lane(lane);
                }
                self.reach[at + lane] = reach.lane(lane);
            }
            at += size;
        }
    }
}
