//! The largest length of a set, against every vertex and against brute force.

use truepose_kernel::largest::{STATED, Search, Set};
use truepose_kernel::spatial::{Vector, cross, dot, norm, scale};

/// Numbers in [-1, 1) that are the same every time (Steele, Lea & Flood 2014, splitmix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self, components: usize) -> Vector<f64> {
        [0, 1, 2].map(|k| if k < components { self.next() } else { 0.0 })
    }
}

/// The point of a set without ellipsoids where each segment is at the end of its sign along `u`; one across
/// `u`, named in `free`, at the ends given.
fn vertex(set: &Set, u: Vector<f64>, free: &[(usize, f64)]) -> f64 {
    let mut point = set.centre;
    for (number, segment) in set.segments.iter().enumerate() {
        let given = free.iter().find(|one| one.0 == number).map(|one| one.1);
        let sign = given.unwrap_or(1f64.copysign(dot(*segment, u)));
        point = [0, 1, 2].map(|k| point[k] + sign * segment[k]);
    }
    norm(point)
}

/// The longest vertex: every one lies at the end of an edge of a facet, whose normal is across two segments.
fn longest_vertex(set: &Set, components: usize) -> f64 {
    let mut longest: f64 = 0.0;
    let count = set.segments.len();
    let signs = [-1.0, 1.0];
    for i in 0..count {
        if components == 2 {
            let s = set.segments[i];
            for side in signs {
                let u = [-side * s[1], side * s[0], 0.0];
                for end in signs {
                    longest = longest.max(vertex(set, u, &[(i, end)]));
                }
            }
            continue;
        }
        for k in i + 1..count {
            for side in signs {
                let u = scale(cross(set.segments[i], set.segments[k]), side);
                for one in signs {
                    for other in signs {
                        longest = longest.max(vertex(set, u, &[(i, one), (k, other)]));
                    }
                }
            }
        }
    }
    longest
}

#[test]
fn no_vertex_of_a_thousand_sets_is_longer() {
    let mut numbers = Numbers(1);
    let mut search = Search::default();
    let mut climbed = 0;
    for case in 0..1000 {
        let components = 2 + case % 2;
        let count = 2 + (case * 7) % 59;
        let size = [0.0, 0.3, 3.0, 30.0][case % 4];
        let set = Set {
            centre: scale(numbers.vector(components), size),
            segments: (0..count).map(|_| numbers.vector(components)).collect(),
            ..Set::default()
        };
        let truth = longest_vertex(&set, components);
        for largest in [
            search.farthest::<f64>(&set),
            search.farthest::<truepose_kernel::scalar::Lanes<1>>(&set),
        ] {
            assert!(largest.length >= truth * (1.0 - 1e-12), "case {case}: {largest:?} {truth}");
            assert!(largest.length <= truth * (1.0 + 1e-3), "case {case}: {largest:?} {truth}");
            assert!(largest.reached <= truth * (1.0 + 1e-12), "case {case}: {largest:?} {truth}");
            climbed += usize::from(largest.reached >= truth * (1.0 - 1e-9));
        }
    }
    // What is reached is the longest itself: the cones have the climbs begin everywhere that matters.
    assert_eq!(climbed, 2000);
}

#[test]
fn with_ellipsoids_it_is_that_of_brute_force() {
    let mut numbers = Numbers(2);
    let mut search = Search::default();
    for case in 0..300 {
        let components = 2 + case % 2;
        let count = (case * 5) % 60;
        let mut set = Set {
            centre: scale(numbers.vector(components), [0.0, 1.0, 10.0][case % 3]),
            segments: (0..count).map(|_| numbers.vector(components)).collect(),
            ..Set::default()
        };
        let size = [0.1, 1.0, 10.0][case / 3 % 3];
        for _ in 0..1 + case % 2 {
            let start = set.axes.len();
            set.axes.extend((0..components).map(|_| scale(numbers.vector(components), size)));
            set.ellipsoids.push(start..set.axes.len());
        }
        // Many directions, and climbing on from the best of them by bisection of steps.
        let reach = |u: Vector<f64>| {
            let along: f64 = set.segments.iter().map(|s| dot(*s, u).abs()).sum();
            let round: f64 = set
                .ellipsoids
                .iter()
                .map(|one| {
                    set.axes[one.clone()].iter().map(|b| dot(*b, u).powi(2)).sum::<f64>().sqrt()
                })
                .sum();
            dot(set.centre, u) + along + round
        };
        let mut starts: Vec<(f64, Vector<f64>)> = (0..3000)
            .map(|_| {
                let u = numbers.vector(components);
                let u = scale(u, 1.0 / norm(u));
                (reach(u), u)
            })
            .collect();
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut truth: f64 = 0.0;
        for (mut value, mut u) in starts.into_iter().take(40) {
            let mut step = 0.05;
            while step > 1e-9 {
                let turn = scale(numbers.vector(components), step);
                let next = [0, 1, 2].map(|k| u[k] + turn[k]);
                let next = scale(next, 1.0 / norm(next));
                let reached = reach(next);
                if reached > value { (value, u) = (reached, next) } else { step *= 0.9 }
            }
            truth = truth.max(value);
        }
        let largest = search.farthest::<f64>(&set);
        assert!(largest.length >= truth * (1.0 - 1e-12), "case {case}: {largest:?} {truth}");
        assert!(largest.length <= truth * (1.0 + 1e-3), "case {case}: {largest:?} {truth}");
        assert!(largest.reached <= largest.length);
    }
}

#[test]
fn a_ball_is_as_far_as_its_radius_within_the_stated_gap() {
    let axes = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut set = Set { axes, ..Set::default() };
    set.ellipsoids.push(0..3);
    let largest = Search::default().farthest::<f64>(&set);
    assert!(largest.length >= 1.0 && largest.length <= 1.0 + STATED, "{largest:?}");
    assert!((largest.reached - 1.0).abs() < 1e-12);
}

#[test]
fn a_point_a_line_and_what_is_no_number() {
    let mut search = Search::default();
    let point = Set { centre: [3.0, 4.0, 0.0], ..Set::default() };
    assert_eq!(search.farthest::<f64>(&point).length, 5.0);
    assert_eq!(search.farthest::<f64>(&Set::default()).length, 0.0);
    let line = Set { centre: [-1.0, 0.0, 0.0], segments: vec![[2.0, 0.0, 0.0]], ..Set::default() };
    let largest = search.farthest::<f64>(&line);
    assert!((largest.length - 3.0).abs() < 1e-14 && largest.direction[0] < 0.0, "{largest:?}");
    for wrong in [f64::NAN, f64::INFINITY] {
        let set = Set { segments: vec![[1.0, wrong, 0.0]], ..Set::default() };
        assert!(search.farthest::<f64>(&set).length.is_nan());
    }
}
