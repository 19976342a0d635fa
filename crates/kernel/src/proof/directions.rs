//! The longest vector of a set, from how far the set reaches along some directions.
//!
//! A vector e in the cone of the directions u_i (a simplex) is |e| d with d = sum w_i u_i, w_i >= 0, so
//! |e| = e.d <= sum w_i reach_i <= max reach / h, where h is the distance of the simplex from the
//! origin. A box of components would give up to sqrt 3 too much; a fine net of directions nearly nothing.

use crate::spatial::{Vector, cross, dot, norm, scale, subtract};

/// A net is refined until its bound is at most this above the farthest reach.
const FINE: f64 = 1.01;
/// Directions asked for at most.
const MOST: usize = 4000;
/// What rounding in the few operations here may do, generously.
const ROUNDING: f64 = 1.0 + 1e-12;

/// A part of the sphere, the circle or the line: the simplex of its directions, and what bounds a vector
/// in its cone.
struct Cell {
    corners: Vec<usize>,
    bound: f64,
}

/// Directions and how far the set reaches along each.
struct Net<'a, R: FnMut(Vector<f64>) -> f64> {
    reach: &'a mut R,
    directions: Vec<Vector<f64>>,
    reached: Vec<f64>,
}

impl<R: FnMut(Vector<f64>) -> f64> Net<'_, R> {
    fn direction(&mut self, direction: Vector<f64>) -> usize {
        let known = self.directions.iter().position(|one| norm(subtract(*one, direction)) < 1e-9);
        known.unwrap_or_else(|| {
            self.reached.push((self.reach)(direction));
            self.directions.push(direction);
            self.directions.len() - 1
        })
    }

    fn cell(&self, corners: Vec<usize>) -> Cell {
        let at = |k: usize| self.directions[corners[k]];
        let distance = match corners.len() {
            1 => 1.0,
            2 => norm(cross(at(0), at(1))) / norm(subtract(at(1), at(0))),
            _ => {
                let normal = cross(subtract(at(1), at(0)), subtract(at(2), at(0)));
                dot(normal, at(0)).abs() / norm(normal)
            }
        };
        let farthest = corners.iter().map(|&k| self.reached[k]).fold(0.0, f64::max);
        Cell { bound: farthest / distance * ROUNDING, corners }
    }

    fn middle(&mut self, one: usize, other: usize) -> usize {
        let sum = [0, 1, 2].map(|k| self.directions[one][k] + self.directions[other][k]);
        self.direction(scale(sum, 1.0 / norm(sum)))
    }
}

/// A bound on the length of the vectors of a set in the freedoms `free` (of three); `reach(u)` is a bound
/// on e.u over the set, infinite where there is none.
pub fn longest(free: &[usize], mut reach: impl FnMut(Vector<f64>) -> f64) -> f64 {
    let mut net = Net { reach: &mut reach, directions: Vec::new(), reached: Vec::new() };
    let mut axis = |freedom: usize, sign: f64| {
        let mut direction = [0.0; 3];
        direction[freedom] = sign;
        net.direction(direction)
    };
    let axes: Vec<[usize; 2]> = free.iter().map(|&k| [axis(k, 1.0), axis(k, -1.0)]).collect();
    // One corner of each axis: 2, 4 or 8 cells.
    let mut cells: Vec<Cell> = (0..1 << axes.len())
        .map(|signs: usize| {
            let corner = |(k, pair): (usize, &[usize; 2])| pair[signs >> k & 1];
            net.cell(axes.iter().enumerate().map(corner).collect())
        })
        .collect();
    loop {
        let farthest = net.reached.iter().copied().fold(0.0, f64::max);
        let Some(worst) =
            (0..cells.len()).max_by(|&a, &b| cells[a].bound.total_cmp(&cells[b].bound))
        else {
            return 0.0;
        };
        let bound = cells[worst].bound;
        let done = !bound.is_finite() || bound <= farthest * FINE || cells[worst].corners.len() < 2;
        if done || net.directions.len() >= MOST {
            return bound;
        }
        let corners = cells.swap_remove(worst).corners;
        let parts: Vec<Vec<usize>> = if let [a, b] = corners[..] {
            let middle = net.middle(a, b);
            vec![vec![a, middle], vec![middle, b]]
        } else {
            let [a, b, c] = [corners[0], corners[1], corners[2]];
            let (ab, bc, ca) = (net.middle(a, b), net.middle(b, c), net.middle(c, a));
            vec![vec![a, ab, ca], vec![ab, b, bc], vec![ca, bc, c], vec![ab, bc, ca]]
        };
        cells.extend(parts.into_iter().map(|corners| net.cell(corners)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_vector_of_an_ellipsoid_is_its_longest_axis() {
        let axes = [3.0, 1.0, 2.0];
        let reach = |u: Vector<f64>| norm([0, 1, 2].map(|k| axes[k] * u[k]));
        for (free, expected) in [(vec![0, 1, 2], 3.0), (vec![1, 2], 2.0), (vec![1], 1.0)] {
            let bound = longest(&free, reach);
            assert!(bound >= expected && bound <= 1.011 * expected, "{bound} {expected}");
        }
    }

    #[test]
    fn the_corner_of_a_cube_is_not_missed() {
        let bound = longest(&[0, 1, 2], |u| u[0].abs() + u[1].abs() + u[2].abs());
        assert!(bound >= 3f64.sqrt() && bound < 1.011 * 3f64.sqrt());
    }
}
