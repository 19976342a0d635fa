//! How long a vector can be whose direction lies in the cone of three directions.
//!
//! The support function h is convex and homogeneous: along d = sum w_i u_i with w_i >= 0 it is at most
//! sum w_i h(u_i) = a . d, where a . u_i = h(u_i). A vector e of the set along d has |e| = e . d <= a . d,
//! which over unit vectors d of the cone is at most |a| where a lies in it, else at most what the same
//! makes of one of its faces. Evaluated along that d, h says how much of the bound is true, and divides
//! the cone there.

use super::directions::Directions;
use crate::spatial::{Vector, cross, dot, norm, scale, subtract};

/// Weight of a corner in the apex, of all three, below which the cone is divided on the face opposite: parts
/// thinner than that would lose digits.
const ON_FACE: f64 = 1e-3;

/// A cone that may hold a longer vector than is known.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// Numbers of its directions.
    pub corners: [usize; 3],
    /// a . u_i = h(u_i).
    pub a: Vector<f64>,
    /// Bound on the length of a vector in the cone.
    pub bound: f64,
    /// A unit vector along which the bound is, or nearly.
    pub apex: Vector<f64>,
    /// Whether the apex is inside, or on the face opposite to this corner.
    pub opposite: Option<usize>,
}

impl Cone {
    /// The cone of three unit vectors u with reaches h, or a bound that is at most `enough`.
    #[inline(always)]
    pub fn new(
        corners: [usize; 3],
        a: Vector<f64>,
        directions: &Directions,
        enough: f64,
    ) -> Result<Self, f64> {
        let square = dot(a, a);
        if square <= enough * enough {
            return Err(square.sqrt());
        }
        let [i, k, l] = corners;
        let (u, v, w) = (directions.at(i), directions.at(k), directions.at(l));
        let reach = directions.reach();
        let (vw, wu, uv) = (cross(v, w), cross(w, u), cross(u, v));
        // a = sum weight_i u_i, times the same volume.
        let sign = 1f64.copysign(dot(u, vw));
        let weights = [sign * dot(a, vw), sign * dot(a, wu), sign * dot(a, uv)];
        let least = weights[0].min(weights[1]).min(weights[2]);
        let length = square.sqrt();
        if least > ON_FACE * (weights[0] + weights[1] + weights[2]).abs() {
            let apex = scale(a, 1.0 / length);
            return Ok(Cone { corners, a, bound: length, apex, opposite: None });
        }
        let mut best = Cone { corners, a, bound: 0.0, apex: u, opposite: None };
        for corner in 0..3 {
            let (i, k) = (corners[(corner + 1) % 3], corners[(corner + 2) % 3]);
            let (bound, apex) = on_face((directions.at(i), reach[i]), (directions.at(k), reach[k]));
            if bound > best.bound {
                best = Cone { bound, apex, opposite: Some(corner), ..best };
            }
        }
        best.bound = if least >= 0.0 { length } else { best.bound.min(length) };
        if best.bound <= enough { Err(best.bound) } else { Ok(best) }
    }

    /// The same vector with the reach along one more direction `d`, for the part of the cone that has the
    /// corners `kept` still.
    #[inline(always)]
    pub fn moved(&self, kept: [Vector<f64>; 2], d: Vector<f64>, reach: f64) -> Vector<f64> {
        // Along the normal of the two the reaches there stay.
        let normal = cross(kept[0], kept[1]);
        let step = (reach - dot(self.a, d)) / dot(normal, d);
        let a = self.a;
        [a[0] + step * normal[0], a[1] + step * normal[1], a[2] + step * normal[2]]
    }
}

/// The same of the plane cone of two unit vectors with their reaches: a bound, and along which it is.
#[inline(always)]
fn on_face((u, at_u): (Vector<f64>, f64), (v, at_v): (Vector<f64>, f64)) -> (f64, Vector<f64>) {
    let along = dot(u, v);
    let across = subtract(v, scale(u, along));
    let sine = norm(across);
    let aside = (at_v - at_u * along) / sine;
    if aside >= 0.0 && at_u >= at_v * along {
        let length = (at_u * at_u + aside * aside).sqrt();
        let (one, other) = (at_u / length, aside / (sine * length));
        let sum = |k: usize| one * u[k] + other * across[k];
        (length, [sum(0), sum(1), sum(2)])
    } else if at_u > at_v {
        (at_u, u)
    } else {
        (at_v, v)
    }
}
