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
//! 1970, section 13). All terms but the first are the same for the opposite direction, so that the centre
//! may be taken as one more segment, and of two opposite directions one is enough. From below, climbing: the set's farthest point along u is longer than h(u), and
//! lies in a direction along which the set reaches at least as far. From above, cones of directions: h is
//! at most linear between their edges, which bounds a cone by the reaches at its corners, exactly where
//! these reach the same vertex; cones that may hold a longer vector are divided, until none may.

mod batch;
mod cone;
mod directions;
mod net;

pub use batch::{Domain, Largest, NUMBERS, largest_of};

use crate::scalar::Real;
use crate::spatial::{Vector, dot, norm, scale};
use cone::Cone;
use directions::Directions;
use net::{HALF, NET};
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
    /// How far the set reaches, along lanes of directions or along their opposites, whichever is farther.
    #[inline(always)]
    fn reach<S: Real>(&self, u: Vector<S>) -> S {
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
                let direction = scale(u, 1f64.copysign(dot(self.centre, u)));
                *farthest = Farthest { reached: length, direction, ..*farthest };
            }
            u = scale(point, 1.0 / length);
        }
    }
}

/// Room for a search, used again for the next.
#[derive(Default)]
pub struct Search {
    directions: Directions,
    /// Cones of the net that may hold a longer vector, each with its a.
    open: Vec<(usize, Vector<f64>)>,
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
        for reach in &self.directions.reach()[..HALF] {
            if !reach.is_finite() {
                let none = f64::NAN;
                return Farthest { length: none, reached: none, direction: [none; 3] };
            }
        }
        self.climb_from(0, set, &mut farthest);
        self.open_net::<S>(farthest.reached * (1.0 + ROUNDING));
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
            self.directions.evaluate_new::<S>(set, first);
            self.climb_from(first, set, &mut farthest);
            self.divide(first, farthest.reached * (1.0 + ROUNDING));
        }
        farthest.length = self.dropped.max(farthest.reached);
        farthest
    }

    /// Evaluates the directions of the net.
    #[inline(always)]
    fn begin<S: Real>(&mut self, set: &Set) {
        self.cones.clear();
        self.dropped = 0.0;
        if self.directions.len() == 0 {
            for &direction in &NET.directions {
                self.directions.push(direction);
            }
        }
        self.directions.truncate(2 * HALF);
        self.directions.evaluate::<S>(set, HALF);
        self.directions.mirror(HALF);
    }

    /// Climbs from the direction, of those from number `first` on, along which the set reaches farthest.
    #[inline(always)]
    fn climb_from(&self, first: usize, set: &Set, farthest: &mut Farthest) {
        let reach = self.directions.reach();
        let mut best = first;
        for k in first..reach.len() {
            if reach[k] > reach[best] {
                best = k;
            }
        }
        // No point is nearer than the set reaches along its direction.
        if reach[best] > farthest.reached {
            set.climb(self.directions.at(best), farthest);
        }
    }

    /// The cones of the net that may hold a vector longer than `enough`.
    #[inline(always)]
    fn open_net<S: Real>(&mut self, enough: f64) {
        self.open.clear();
        self.dropped = NET.above::<S>(self.directions.reach(), enough, &mut self.open);
        for number in 0..self.open.len() {
            let (cone, a) = self.open[number];
            self.keep(NET.corners[cone], a, enough);
        }
        std::mem::swap(&mut self.cones, &mut self.next);
    }

    /// Keeps a cone where it may hold a vector longer than `enough`.
    #[inline(always)]
    fn keep(&mut self, corners: [usize; 3], a: Vector<f64>, enough: f64) {
        match Cone::new(corners, a, &self.directions, enough) {
            Ok(cone) => self.next.push(cone),
            Err(bound) => self.dropped = self.dropped.max(bound),
        }
    }

    /// Divides every cone where its bound is: the directions from number `first` on.
    #[inline(always)]
    fn divide(&mut self, first: usize, enough: f64) {
        for number in 0..self.cones.len() {
            let (cone, new) = (self.cones[number], first + number);
            let (d, reach) = (self.directions.at(new), self.directions.reach()[new]);
            for corner in 0..3 {
                // The part without the face opposite to the new direction is empty.
                if cone.opposite == Some(corner) {
                    continue;
                }
                let mut corners = cone.corners;
                corners[corner] = new;
                let kept = [corners[(corner + 1) % 3], corners[(corner + 2) % 3]];
                let kept = [self.directions.at(kept[0]), self.directions.at(kept[1])];
                let a = cone.moved(kept, d, reach);
                self.keep(corners, a, enough);
            }
        }
        std::mem::swap(&mut self.cones, &mut self.next);
        self.next.clear();
    }
}
