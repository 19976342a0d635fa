//! Where the search for the farthest point begins: 32 directions all round, and of the 60 cones between
//! them one of each two that are opposite.

use crate::scalar::Real;
use crate::spatial::{Vector, cross, dot, norm, scale};
use std::sync::LazyLock;

/// Directions of which none is another's opposite: six corners of an icosahedron, ten of a dodecahedron.
pub const HALF: usize = 16;
/// Room for the 30 cones in whole lanes.
const CONES: usize = 32;
/// Of two opposite cones the one that lies more on the side of this: no cone lies across it.
const SIDE: Vector<f64> = [0.62, 0.35, 0.71];

/// The directions and the cones between neighbours.
pub struct Net {
    /// The opposite of direction `k < HALF` is at `HALF + k`.
    pub directions: Vec<Vector<f64>>,
    /// Three directions of each cone, by number; no cone's opposite is among them.
    pub corners: Vec<[usize; 3]>,
    /// `dual[i][k][cone]`: a = sum reach_i dual_i has a . u_i = reach_i. Beyond the last cone zero.
    dual: [[[f64; CONES]; 3]; 3],
}

/// The one net: a pentakis dodecahedron, whose cones are nearly alike.
pub static NET: LazyLock<Net> = LazyLock::new(|| {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let turns = |[x, y, z]: Vector<f64>| [[x, y, z], [z, x, y], [y, z, x]];
    let icosahedron = [1.0, -1.0].map(|sign| turns([0.0, sign, golden])).concat();
    let mut dodecahedron =
        vec![[1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]];
    dodecahedron.extend([1.0, -1.0].map(|sign| turns([0.0, sign * golden, 1.0 / golden])).concat());
    let tips = icosahedron.len();
    let mut directions: Vec<Vector<f64>> =
        icosahedron.into_iter().chain(dodecahedron).map(|u| scale(u, 1.0 / norm(u))).collect();
    let opposite: Vec<Vector<f64>> = directions.iter().map(|&u| scale(u, -1.0)).collect();
    directions.extend(opposite);
    let angle = |i: usize, k: usize| dot(directions[i], directions[k]).clamp(-1.0, 1.0).acos();
    let mut cones: Vec<[usize; 3]> = Vec::new();
    for tip in (0..2 * HALF).filter(|k| k % HALF < tips) {
        // The five corners of the dodecahedron's face about the tip: 37 degrees away, 42 from each other.
        let about: Vec<usize> =
            (0..2 * HALF).filter(|&k| k % HALF >= tips && angle(tip, k) < 0.7).collect();
        for (place, &one) in about.iter().enumerate() {
            for &other in &about[place + 1..] {
                if angle(one, other) < 0.8 {
                    cones.push([tip, one, other]);
                }
            }
        }
    }
    let side =
        |corners: &[usize; 3]| corners.iter().map(|&k| dot(directions[k], SIDE)).sum::<f64>();
    cones.retain(|corners| side(corners) > 0.0);
    let mut net = Net { directions, corners: cones, dual: [[[0.0; CONES]; 3]; 3] };
    for (cone, corners) in net.corners.iter().enumerate() {
        let [u, v, w] = corners.map(|k| net.directions[k]);
        let volume = dot(u, cross(v, w));
        for (i, normal) in [cross(v, w), cross(w, u), cross(u, v)].iter().enumerate() {
            for k in 0..3 {
                net.dual[i][k][cone] = normal[k] / volume;
            }
        }
    }
    net
});

impl Net {
    /// Every cone whose bound |a| is above `enough`, number and a, into `longer`; returns the largest bound
    /// of the others.
    #[inline(always)]
    pub fn above<S: Real>(
        &self,
        reach: &[f64],
        enough: f64,
        longer: &mut Vec<(usize, Vector<f64>)>,
    ) -> f64 {
        // All of them first: what was stored number by number is not ready to be read in lanes at once.
        let mut reaches = [[0.0; CONES]; 3];
        for (cone, corners) in self.corners.iter().enumerate() {
            for i in 0..3 {
                reaches[i][cone] = reach[corners[i]];
            }
        }
        let mut most: f64 = 0.0;
        for first in (0..CONES).step_by(S::WIDTH) {
            let mut a = [S::splat(0.0); 3];
            for i in 0..3 {
                let reach = S::load(&reaches[i][first..]);
                for k in 0..3 {
                    a[k] = reach.mul_add(S::load(&self.dual[i][k][first..]), a[k]);
                }
            }
            let square = dot(a, a);
            for lane in 0..S::WIDTH.min(self.corners.len().saturating_sub(first)) {
                if square.lane(lane) <= enough * enough {
                    most = most.max(square.lane(lane));
                } else {
                    longer
                        .push((first + lane, [a[0].lane(lane), a[1].lane(lane), a[2].lane(lane)]));
                }
            }
        }
        most.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Van Oosterom & Strackee 1983, sr.
    fn solid_angle([u, v, w]: [Vector<f64>; 3]) -> f64 {
        2.0 * dot(u, cross(v, w)).abs().atan2(1.0 + dot(u, v) + dot(v, w) + dot(w, u))
    }

    #[test]
    fn the_cones_fill_the_sphere() {
        assert_eq!(NET.directions.len(), 2 * HALF);
        let cones = &NET.corners;
        assert_eq!(cones.len(), 30);
        let solid: f64 =
            cones.iter().map(|cone| solid_angle(cone.map(|k| NET.directions[k]))).sum();
        assert!((solid - 2.0 * std::f64::consts::PI).abs() < 1e-12);
        // Of every two opposite cones there is one.
        let opposite = |cone: &[usize; 3]| {
            let mut opposite = cone.map(|k| (k + HALF) % (2 * HALF));
            opposite.sort_unstable();
            opposite
        };
        let sorted = |cone: &[usize; 3]| {
            let mut cone = *cone;
            cone.sort_unstable();
            cone
        };
        assert!(cones.iter().all(|one| cones.iter().all(|other| sorted(other) != opposite(one))));
    }
}
