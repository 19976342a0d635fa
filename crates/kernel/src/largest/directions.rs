//! Unit vectors, and how far a set reaches along them.

use super::set::Set;
use crate::scalar::{LANES, Real};
use crate::spatial::{Vector, norm, scale};

/// Directions by their components, read and written in lanes.
#[derive(Clone, Debug, Default)]
pub struct Directions {
    count: usize,
    /// Filled up by whole lanes beyond the last.
    components: [Vec<f64>; 3],
    /// How far the set reaches.
    reach: Vec<f64>,
}

impl Directions {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// One of them.
    #[inline(always)]
    pub fn at(&self, number: usize) -> Vector<f64> {
        let [x, y, z] = &self.components;
        [x[number], y[number], z[number]]
    }

    /// How far the set reaches along them.
    #[inline(always)]
    pub fn reach(&self) -> &[f64] {
        &self.reach[..self.count]
    }

    /// One more.
    #[inline(always)]
    pub fn push(&mut self, direction: Vector<f64>) {
        if self.count + LANES >= self.reach.len() {
            let room = self.reach.len() + 8 * LANES;
            self.components.iter_mut().for_each(|values| values.resize(room, 1.0));
            self.reach.resize(room, 0.0);
        }
        for k in 0..3 {
            self.components[k][self.count] = direction[k];
        }
        self.count += 1;
    }

    /// Forgets those from a number on.
    pub fn truncate(&mut self, count: usize) {
        self.count = self.count.min(count);
    }

    /// Finds how far the set reaches along the first ones.
    #[inline(always)]
    pub fn evaluate<S: Real>(&mut self, set: &Set, count: usize) {
        for at in (0..count).step_by(S::WIDTH) {
            let [x, y, z] = &self.components;
            let u = [S::load(&x[at..]), S::load(&y[at..]), S::load(&z[at..])];
            set.reach(u).store(&mut self.reach[at..]);
        }
    }

    /// The reach along the opposites of the first `half`, which are the next.
    #[inline(always)]
    pub fn mirror(&mut self, half: usize) {
        self.reach.copy_within(..half, half);
    }

    /// Makes those from number `first` on unit vectors, and finds how far the set reaches.
    #[inline(always)]
    pub fn evaluate_new<S: Real>(&mut self, set: &Set, first: usize) {
        for at in (first..self.count).step_by(S::WIDTH) {
            let [x, y, z] = &mut self.components;
            let u = [S::load(&x[at..]), S::load(&y[at..]), S::load(&z[at..])];
            let u = scale(u, S::splat(1.0) / norm(u));
            u[0].store(&mut x[at..]);
            u[1].store(&mut y[at..]);
            u[2].store(&mut z[at..]);
            set.reach(u).store(&mut self.reach[at..]);
        }
    }
}
