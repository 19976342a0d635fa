//! The longest vector of a set, from how far the set reaches along some directions.
//!
//! Take directions u_i (one, two or three, none a sum of the others) and any p with p.u_i >= reach_i.
//! A vector e = |e| d of the set with d = sum w_i u_i, w_i >= 0, has |e| = e.d <= sum w_i reach_i
//! <= p.d <= |p|. The shortest such p is the point next to the origin of what the reaches leave of the
//! cone: where one vector of the set reaches farthest along all u_i, it is that vector, and the bound
//! is exact. A net is therefore refined at the direction of p (Falk and Hoffman, "Concave minimization
//! via collapsing polytopes", 1986, cut polytopes so), and where that would make thin cells, across
//! the longest edge.
//!
//! Rounding: directions found twice are taken as one up to [`SAME`], and a middle is off its edge by
//! rounding, so that a direction may lie that far outside of every cone. It then has a d' inside with
//! e.d' = |e| cos(angle), of second order, which [`ROUNDING`] covers.

use crate::spatial::{Vector, cross, dot, norm, scale, subtract};

/// The most directions that are tried.
const MOST: usize = 1000;
/// What rounding in the few operations here may do, generously.
const ROUNDING: f64 = 1.0 + 1e-12;
/// By how much p.u may fall short of a reach, of |p|: rounding.
const SHORT: f64 = 1e-14;
/// Directions closer than this are one.
const SAME: f64 = 1e-9;
/// A cell is divided at the direction of its p where that has at least this weight of each corner,
const BALANCED: f64 = 0.05;
/// and where the cell is at least this high over its longest edge, of that edge.
const THIN: f64 = 0.5;

/// How far a set's longest vector may reach.
#[derive(Clone, Copy, Debug)]
pub struct Longest {
    /// No vector is longer.
    pub bound: f64,
    /// The direction in which that is so, a unit vector.
    pub direction: Vector<f64>,
}

/// A part of the sphere, the circle or the line: the cone of its directions.
struct Cell {
    corners: Vec<usize>,
    /// No vector in the cone is longer than this,
    bound: f64,
    /// the length of p = sum of `weights` times the corners.
    weights: [f64; 3],
}

/// Directions and how far the set reaches along each.
struct Net<R: FnMut(Vector<f64>) -> f64> {
    reach: R,
    directions: Vec<Vector<f64>>,
    reached: Vec<f64>,
}

impl<R: FnMut(Vector<f64>) -> f64> Net<R> {
    fn direction(&mut self, direction: Vector<f64>) -> usize {
        let known = self.directions.iter().position(|one| norm(subtract(*one, direction)) < SAME);
        known.unwrap_or_else(|| {
            self.reached.push((self.reach)(direction));
            self.directions.push(direction);
            self.directions.len() - 1
        })
    }

    /// The direction of a sum of corners.
    fn towards(&mut self, corners: &[usize], weights: &[f64]) -> usize {
        let sum = self.sum(corners, weights);
        self.direction(scale(sum, 1.0 / norm(sum)))
    }

    fn sum(&self, corners: &[usize], weights: &[f64]) -> Vector<f64> {
        let mut sum = [0.0; 3];
        for (&corner, weight) in corners.iter().zip(weights) {
            for k in 0..3 {
                sum[k] += weight * self.directions[corner][k];
            }
        }
        sum
    }

    /// With the shortest p: it is that of some of the corners alone, with none of negative weight.
    fn cell(&self, corners: Vec<usize>) -> Cell {
        let mut best = self.fallback(&corners);
        for some in 1..1_usize << corners.len() {
            let own: Vec<usize> = (0..corners.len()).filter(|k| some >> k & 1 == 1).collect();
            let Some(weights) = self.solved(&corners, &own) else { continue };
            let p = self.sum(&corners, &weights);
            let length = norm(p);
            let serves = |&corner: &usize| {
                dot(p, self.directions[corner]) >= self.reached[corner] - SHORT * length
            };
            if length < best.0 && weights.iter().all(|&w| w >= 0.0) && corners.iter().all(serves) {
                best = (length, weights);
            }
        }
        let (length, weights) = best;
        Cell { corners, bound: length * ROUNDING, weights }
    }

    /// Some p, whatever the reaches are: along the middle of the cone.
    fn fallback(&self, corners: &[usize]) -> (f64, [f64; 3]) {
        let even = [1.0; 3];
        let middle = self.sum(corners, &even);
        let mut share = 0.0_f64;
        for &corner in corners {
            if !self.reached[corner].is_finite() {
                return (f64::INFINITY, even);
            }
            share = share.max(self.reached[corner] / dot(middle, self.directions[corner]));
        }
        // Nothing reaches into the cone: there is no vector in it but the origin.
        (share * norm(middle), even.map(|_| share))
    }

    /// Weights of p with p.u = reach for some of the corners, as a sum of these alone.
    fn solved(&self, corners: &[usize], own: &[usize]) -> Option<[f64; 3]> {
        let at = |k: usize| (self.directions[corners[own[k]]], self.reached[corners[own[k]]]);
        let mut weights = [0.0; 3];
        match own.len() {
            1 => weights[own[0]] = at(0).1,
            2 => {
                let ((u, a), (v, b)) = (at(0), at(1));
                let (cosine, sine) = (dot(u, v), norm(cross(u, v)));
                weights[own[0]] = (a - b * cosine) / (sine * sine);
                weights[own[1]] = (b - a * cosine) / (sine * sine);
            }
            _ => {
                let ((u, a), (v, b), (w, c)) = (at(0), at(1), at(2));
                let normals = [cross(v, w), cross(w, u), cross(u, v)];
                let volume = dot(u, normals[0]);
                let p = [0, 1, 2]
                    .map(|k| (a * normals[0][k] + b * normals[1][k] + c * normals[2][k]) / volume);
                weights = normals.map(|normal| dot(p, normal) / volume);
            }
        }
        weights.iter().all(|weight| weight.is_finite()).then_some(weights)
    }

    /// The parts of a cell; none where rounding leaves no direction between its corners.
    fn divided(&mut self, cell: &Cell) -> Vec<Vec<usize>> {
        let Cell { corners, weights, .. } = cell;
        let total: f64 = weights.iter().sum();
        let share = weights.map(|weight| weight / total);
        let balanced = |own: &[usize]| own.iter().all(|&k| share[k] > BALANCED);
        let mut replaced = vec![0, 1];
        let mut weights = *weights;
        if corners.len() == 3 {
            let side = |i: usize, j: usize| {
                subtract(self.directions[corners[j]], self.directions[corners[i]])
            };
            let edges = [[0, 1], [1, 2], [2, 0]];
            let lengths = edges.map(|[i, j]| norm(side(i, j)));
            let longest = lengths.iter().copied().fold(0.0, f64::max);
            let thick = norm(cross(side(0, 1), side(0, 2))) > THIN * longest * longest;
            replaced = if thick && balanced(&[0, 1, 2]) {
                vec![0, 1, 2]
            } else {
                let own =
                    (0..3).find(|&k| thick && share[(k + 2) % 3] <= 0.0 && balanced(&edges[k]));
                let widest = || (0..3).find(|&k| lengths[k] == longest);
                own.or_else(widest).map_or_else(|| vec![0, 1], |k| edges[k].to_vec())
            };
            if !thick {
                weights = [1.0; 3];
            }
        }
        if !balanced(&replaced) {
            weights = [1.0; 3];
        }
        let at: Vec<usize> = replaced.iter().map(|&k| corners[k]).collect();
        let own: Vec<f64> = replaced.iter().map(|&k| weights[k]).collect();
        let inside = self.towards(&at, &own);
        if corners.contains(&inside) {
            return Vec::new();
        }
        // The new corner in the place of each that it lies between.
        let part = |&k: &usize| {
            let mut part = corners.clone();
            part[k] = inside;
            part
        };
        replaced.iter().map(part).collect()
    }
}

/// A bound on the length of the vectors of a set in the freedoms `free` (of three), refined until it is
/// at most `fine` times the farthest reach, or at most `enough`; `reach(u)` is a bound on e.u over the
/// set, infinite where there is none.
pub fn longest(
    free: &[usize],
    fine: f64,
    enough: f64,
    reach: impl FnMut(Vector<f64>) -> f64,
) -> Longest {
    let mut net = Net { reach, directions: Vec::new(), reached: Vec::new() };
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
            return Longest { bound: 0.0, direction: [0.0; 3] };
        };
        let cell = &cells[worst];
        let bound = cell.bound;
        let done = !bound.is_finite()
            || bound <= enough
            || bound <= farthest * fine
            || cell.corners.len() < 2;
        let parts =
            if done || net.directions.len() >= MOST { Vec::new() } else { net.divided(cell) };
        if parts.is_empty() {
            let p = net.sum(&cell.corners, &cell.weights);
            let length = norm(p);
            let direction = if length > 0.0 { scale(p, 1.0 / length) } else { [0.0; 3] };
            return Longest { bound, direction };
        }
        cells.swap_remove(worst);
        // What no vector of the cone exceeds, none of a part does, however uneven the reaches are.
        cells.extend(parts.into_iter().map(|corners| {
            let part = net.cell(corners);
            Cell { bound: part.bound.min(bound), ..part }
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [-1, 1] that look random, always the same.
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    /// How far a middle plus segments reach.
    fn support(middle: Vector<f64>, segments: &[Vector<f64>], u: Vector<f64>) -> f64 {
        dot(middle, u) + segments.iter().map(|&segment| dot(segment, u).abs()).sum::<f64>()
    }

    /// The longest of all sums of segments, by every choice of signs.
    fn of_all_signs(middle: Vector<f64>, segments: &[Vector<f64>]) -> f64 {
        (0..1_u32 << segments.len())
            .map(|signs| {
                let mut sum = middle;
                for (number, segment) in segments.iter().enumerate() {
                    let sign = if signs >> number & 1 == 1 { 1.0 } else { -1.0 };
                    sum = [0, 1, 2].map(|k| sum[k] + sign * segment[k]);
                }
                norm(sum)
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn the_longest_vector_of_an_ellipsoid_is_its_longest_axis() {
        let axes = [3.0, 1.0, 2.0];
        let reach = |u: Vector<f64>| norm([0, 1, 2].map(|k| axes[k] * u[k]));
        for (free, expected) in [(vec![0, 1, 2], 3.0), (vec![1, 2], 2.0), (vec![1], 1.0)] {
            let Longest { bound, direction } = longest(&free, 1.0003, f64::NEG_INFINITY, reach);
            assert!(bound >= expected && bound <= 1.0003 * expected, "{bound} {expected}");
            assert!((reach(direction) - expected).abs() < 1e-3 * expected, "{direction:?}");
        }
    }

    #[test]
    fn the_corner_of_a_cube_is_found_at_once() {
        let mut asked = 0;
        let cube = |u: Vector<f64>| {
            asked += 1;
            u[0].abs() + u[1].abs() + u[2].abs()
        };
        let longest_length = longest(&[0, 1, 2], 1.0003, f64::NEG_INFINITY, cube);
        assert!(
            longest_length.bound >= 3f64.sqrt()
                && longest_length.bound < 3f64.sqrt() * (1.0 + 1e-11)
        );
        assert!(asked <= 14, "{asked}");
    }

    #[test]
    fn no_sum_of_segments_is_longer_and_the_bound_is_near() {
        let mut asked_most = 0;
        for seed in 1..200 {
            let mut next = numbers(seed);
            let count = 1 + (seed % 9) as usize;
            let flat = [1.0, 1.0, if seed % 5 == 0 { 0.0 } else { 1.0 }];
            let mut vector = || [0, 1, 2].map(|k| flat[k] * next());
            let segments: Vec<Vector<f64>> = (0..count).map(|_| vector()).collect();
            let away = (seed % 3) as f64;
            let middle = vector().map(|value| value * away);
            let free = if flat[2] == 0.0 { vec![0, 1] } else { vec![0, 1, 2] };
            let mut asked = 0;
            let longest_length = longest(&free, 1.0003, f64::NEG_INFINITY, |u| {
                asked += 1;
                support(middle, &segments, u)
            });
            let exact = of_all_signs(middle, &segments);
            assert!(
                longest_length.bound >= exact * (1.0 - 1e-14),
                "{seed}: {} {exact}",
                longest_length.bound
            );
            assert!(
                longest_length.bound <= 1.0003 * exact,
                "{seed}: {} {exact}",
                longest_length.bound
            );
            asked_most = asked_most.max(asked);
        }
        assert!(asked_most < 120, "{asked_most}");
    }

    #[test]
    fn a_set_without_width_has_the_length_of_its_point_or_segment() {
        let point = [0.3, -0.4, 1.2];
        let none = longest(&[0, 1, 2], 1.0003, f64::NEG_INFINITY, |u| dot(point, u));
        assert!(none.bound >= 1.3 && none.bound < 1.3 * (1.0 + 1e-11), "{}", none.bound);
        let segment = [1e-9, 2e-3, 5.0];
        let one = longest(&[0, 1, 2], 1.0003, f64::NEG_INFINITY, |u| dot(segment, u).abs());
        assert!(one.bound >= norm(segment) && one.bound < 1.0003 * norm(segment));
        let origin = longest(&[0, 1, 2], 1.0003, f64::NEG_INFINITY, |_| 0.0);
        assert_eq!((origin.bound, origin.direction), (0.0, [0.0; 3]));
        assert_eq!(longest(&[], 1.0003, f64::NEG_INFINITY, |_| 1.0).bound, 0.0);
    }

    #[test]
    fn a_ball_runs_into_the_limit_and_keeps_a_bound() {
        let mut asked = 0;
        let longest_length = longest(&[0, 1, 2], 1.000_001, f64::NEG_INFINITY, |_| {
            asked += 1;
            1.0
        });
        assert!(asked <= MOST + 1);
        assert!(
            longest_length.bound >= 1.0 && longest_length.bound < 1.01,
            "{}",
            longest_length.bound
        );
    }

    #[test]
    fn what_has_no_bound_has_none_and_enough_is_enough() {
        let one_way = |u: Vector<f64>| if u[0] > 0.5 { f64::INFINITY } else { 1.0 };
        assert_eq!(longest(&[0, 1, 2], 1.01, 5.0, one_way).bound, f64::INFINITY);
        let mut asked = 0;
        let longest_length = longest(&[0, 1, 2], 1.0003, 2.0, |u| {
            asked += 1;
            norm([u[0], u[1], 0.9 * u[2]])
        });
        assert!(asked == 6 && longest_length.bound <= 2.0 && longest_length.bound >= 1.0);
    }
}
