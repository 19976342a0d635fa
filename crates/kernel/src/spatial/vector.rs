//! Three-component vectors.

use crate::scalar::Scalar;

/// Three components along the base axes x, y, z.
pub type Vector<S> = [S; 3];

/// `a + b`.
#[inline(always)]
pub fn add<S: Scalar>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a - b`.
#[inline(always)]
pub fn subtract<S: Scalar>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `factor * a`.
#[inline(always)]
pub fn scale<S: Scalar>(a: Vector<S>, factor: S) -> Vector<S> {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

/// The inner product.
#[inline(always)]
pub fn dot<S: Scalar>(a: Vector<S>, b: Vector<S>) -> S {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// The vector product.
#[inline(always)]
pub fn cross<S: Scalar>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [
        a[1].mul_add(b[2], -(a[2] * b[1])),
        a[2].mul_add(b[0], -(a[0] * b[2])),
        a[0].mul_add(b[1], -(a[1] * b[0])),
    ]
}

/// The Euclidean length. The components are squared by [`Scalar::square`], so an interval's stays
/// non-negative.
#[inline(always)]
pub fn norm<S: Scalar>(a: Vector<S>) -> S {
    a[0].square_plus(a[1].square_plus(a[2].square())).sqrt()
}

/// Two unit vectors that make a right-handed frame `(first, second, axis)` with a unit `axis`: the
/// two freedoms of a direction.
///
/// The first is the base axis least aligned with `axis` (the earlier one where two are), made
/// perpendicular to it.
pub fn tangents(axis: Vector<f64>) -> [Vector<f64>; 2] {
    let mut least = 0;
    for k in 1..3 {
        if axis[k].abs() < axis[least].abs() {
            least = k;
        }
    }
    let mut first = scale(axis, -axis[least]);
    first[least] += 1.0;
    let first = scale(first, 1.0 / norm(first));
    [first, cross(axis, first)]
}
