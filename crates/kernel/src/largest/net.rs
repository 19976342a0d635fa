//! Where the search for the farthest point begins: 32 directions all round, and the 60 cones between them.

use crate::spatial::{Vector, cross, dot, norm, scale};
use std::sync::LazyLock;

/// Directions of which none is another's opposite: six corners of an icosahedron, ten of a dodecahedron.
pub const HALF: usize = 16;
/// Room for the cones in whole lanes.
pub const CONES: usize = 64;

/// The directions and the cones between neighbours.
pub struct Net {
    /// The opposite of direction `k < HALF` is at `HALF + k`.
    pub directions: Vec<Vector<f64>>,
    /// Cones there are; those beyond repeat the last.
    pub cones: usize,
    /// Three directions each, by number.
    pub corners: [[usize; 3]; CONES],
    /// `dual[i][k][cone]`: a = sum reach_i dual_i has a . u_i = reach_i.
    pub dual: [[[f64; CONES]; 3]; 3],
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
    let mut cones = Vec::new();
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
    let mut net = Net {
        directions,
        cones: cones.len(),
        corners: [cones[cones.len() - 1]; CONES],
        dual: [[[0.0; CONES]; 3]; 3],
    };
    net.corners[..cones.len()].copy_from_slice(&cones);
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
        let cones = &NET.corners[..NET.cones];
        assert_eq!(cones.len(), 60);
        let solid: f64 =
            cones.iter().map(|cone| solid_angle(cone.map(|k| NET.directions[k]))).sum();
        assert!((solid - 4.0 * std::f64::consts::PI).abs() < 1e-12);
    }
}
