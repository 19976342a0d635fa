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
//! may be taken as one more segment, and of two opposite directions one is enough.
//!
//! From below, climbing: the set's farthest point along u is longer than h(u), and lies in a direction
//! along which the set reaches at least as far. From above, cones of directions: h is at most linear
//! between their edges, which bounds a cone by the reaches at its corners, exactly where these reach
//! the same vertex; cones that may hold a longer vector are divided, until none may.

mod batch;
mod cone;
mod directions;
mod net;
mod set;

pub use batch::{Domain, Largest, NUMBERS, largest_of};
pub use set::{Farthest, Set};

use crate::scalar::Real;
use crate::spatial::{Vector, norm, scale};
use cone::Cone;
use directions::Directions;
use net::{HALF, NET};

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
