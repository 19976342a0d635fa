//! Where a rigid body is: the tool point and a quaternion. Euler angles appear only at the edges.

use super::vector::{Vector, add, cross, dot};
use crate::scalar::{Real, Scalar};

/// `w + x i + y j + z k`, not necessarily of unit length.
pub type Quaternion<S> = [S; 4];
/// Rows along the base axes; columns are the platform's axes.
pub type RotationMatrix<S> = [[S; 3]; 3];

/// The platform's pose in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<S> {
    /// The tool point, m.
    pub position: Vector<S>,
    /// Platform axes relative to the base axes.
    pub rotation: Quaternion<S>,
}

impl Pose<f64> {
    /// From seven numbers: position, then quaternion w, x, y, z.
    pub fn from_row(row: &[f64]) -> Self {
        Pose { position: [row[0], row[1], row[2]], rotation: [row[3], row[4], row[5], row[6]] }
    }

    /// Seven numbers: position, then unit quaternion with w >= 0.
    pub fn to_row(&self) -> [f64; 7] {
        let q = self.rotation;
        let norm = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
        let sign = if q[0] < 0.0 { -1.0 / norm } else { 1.0 / norm };
        let p = self.position;
        [p[0], p[1], p[2], q[0] * sign, q[1] * sign, q[2] * sign, q[3] * sign]
    }

    /// From six coordinates x, y, z, a, b, c: `R = Rz(c) Ry(b) Rx(a)`.
    pub fn from_coordinates(coordinates: [f64; 6]) -> Self {
        let [x, y, z, a, b, c] = coordinates;
        Pose { position: [x, y, z], rotation: quaternion_from_euler([a, b, c]) }
    }

    /// Six coordinates x, y, z, a, b, c: `R = Rz(c) Ry(b) Rx(a)`.
    pub fn to_coordinates(&self) -> [f64; 6] {
        let [a, b, c] = euler_angles(&rotation_matrix(self.rotation));
        let [x, y, z] = self.position;
        [x, y, z, a, b, c]
    }
}

impl<S: Real> Pose<S> {
    /// The same pose in every lane.
    #[inline(always)]
    pub fn splat(pose: &Pose<f64>) -> Self {
        let mut result = Pose { position: [S::default(); 3], rotation: [S::default(); 4] };
        for k in 0..3 {
            result.position[k] = S::splat(pose.position[k]);
        }
        for k in 0..4 {
            result.rotation[k] = S::splat(pose.rotation[k]);
        }
        result
    }

    /// Puts one sample's seven numbers into a lane.
    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, row: &[f64]) {
        for k in 0..3 {
            self.position[k].set_lane(lane, row[k]);
        }
        for k in 0..4 {
            self.rotation[k].set_lane(lane, row[3 + k]);
        }
    }

    /// One sample out of a lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Pose<f64> {
        let mut result = Pose { position: [0.0; 3], rotation: [0.0; 4] };
        for k in 0..3 {
            result.position[k] = self.position[k].lane(lane);
        }
        for k in 0..4 {
            result.rotation[k] = self.rotation[k].lane(lane);
        }
        result
    }
}

impl<S: Scalar> Pose<S> {
    /// Moves by minus a twist increment: what Newton's iteration does with its solution.
    #[inline(always)]
    pub fn step_back(&mut self, twist: &[S; 6]) {
        let mut forward = *twist;
        for k in 0..6 {
            forward[k] = -twist[k];
        }
        self.step(forward);
    }

    /// Moves by a twist increment (translation of the tool point, then rotation, both along the base
    /// axes). The rotation is a Cayley map: rational, so it exists on every scalar.
    #[inline(always)]
    pub fn step(&mut self, twist: [S; 6]) {
        self.position = add(self.position, [twist[0], twist[1], twist[2]]);
        let half = twist[3].lift(0.5);
        let (a, b, c) = (twist[3] * half, twist[4] * half, twist[5] * half);
        let [w, x, y, z] = self.rotation;
        self.rotation = [
            w - a.mul_add(x, b.mul_add(y, c * z)),
            x + a.mul_add(w, b.mul_add(z, -(c * y))),
            y + b.mul_add(w, c.mul_add(x, -(a * z))),
            z + c.mul_add(w, a.mul_add(y, -(b * x))),
        ];
    }
}

/// The matrix of a quaternion of any length but zero.
#[inline(always)]
pub fn rotation_matrix<S: Scalar>(q: Quaternion<S>) -> RotationMatrix<S> {
    let [w, x, y, z] = q;
    let one = w.lift(1.0);
    let double = w.lift(2.0) / w.mul_add(w, x.mul_add(x, y.mul_add(y, z * z)));
    let (dx, dy, dz) = (double * x, double * y, double * z);
    let (xx, yy, zz) = (dx * x, dy * y, dz * z);
    let (xy, xz, yz) = (dx * y, dx * z, dy * z);
    let (wx, wy, wz) = (dx * w, dy * w, dz * w);
    [
        [one - (yy + zz), xy - wz, xz + wy],
        [xy + wz, one - (xx + zz), yz - wx],
        [xz - wy, yz + wx, one - (xx + yy)],
    ]
}

/// `R v`.
#[inline(always)]
pub fn rotate<S: Scalar>(r: &RotationMatrix<S>, v: Vector<S>) -> Vector<S> {
    let mut result = v;
    for k in 0..3 {
        result[k] = r[k][0].mul_add(v[0], r[k][1].mul_add(v[1], r[k][2] * v[2]));
    }
    result
}

/// `R^T v`.
#[inline(always)]
pub fn rotate_back<S: Scalar>(r: &RotationMatrix<S>, v: Vector<S>) -> Vector<S> {
    let mut result = v;
    for k in 0..3 {
        result[k] = r[0][k].mul_add(v[0], r[1][k].mul_add(v[1], r[2][k] * v[2]));
    }
    result
}

/// The quaternion of `Rz(c) Ry(b) Rx(a)`, angles `[a, b, c]` in rad.
#[inline(always)]
pub fn quaternion_from_euler<S: Scalar>(angles: [S; 3]) -> Quaternion<S> {
    let half = angles[0].lift(0.5);
    let (sa, ca) = (angles[0] * half).sin_cos();
    let (sb, cb) = (angles[1] * half).sin_cos();
    let (sc, cc) = (angles[2] * half).sin_cos();
    [
        cc * cb * ca + sc * sb * sa,
        cc * cb * sa - sc * sb * ca,
        cc * sb * ca + sc * cb * sa,
        sc * cb * ca - cc * sb * sa,
    ]
}

/// The angles `[a, b, c]` of `R = Rz(c) Ry(b) Rx(a)`, b in [-pi/2, pi/2]. Where b is a right angle
/// only a sum of a and c is defined; then a = 0.
pub fn euler_angles<S: Scalar>(r: &RotationMatrix<S>) -> [S; 3] {
    let zero = r[0][0].lift(0.0);
    let horizontal = r[0][0].square_plus(r[1][0].square()).sqrt();
    let defined = horizontal - zero.lift(1e-12);
    // 0 - x, not -x: a level platform has b = 0, not -0.
    let b = (zero - r[2][0]).atan2(horizontal);
    let a = defined.select(r[2][1].atan2(r[2][2]), zero);
    let c = defined.select(r[1][0].atan2(r[0][0]), (-r[0][1]).atan2(r[1][1]));
    [a, b, c]
}

/// The instantaneous rotation axes of the angles a, b, c of `R = Rz(c) Ry(b) Rx(a)`, base frame:
/// angular velocity = sum of axis times rate.
pub fn euler_axes<S: Scalar>(angles: [S; 3]) -> [Vector<S>; 3] {
    let (zero, one) = (angles[0].lift(0.0), angles[0].lift(1.0));
    let (sb, cb) = angles[1].sin_cos();
    let (sc, cc) = angles[2].sin_cos();
    [[cc * cb, sc * cb, -sb], [-sc, cc, zero], [zero, zero, one]]
}

/// Rates of the angles a, b, c for an angular velocity in the base frame.
pub fn angle_rates<S: Scalar>(angles: [S; 3], velocity: Vector<S>) -> [S; 3] {
    let axes = euler_axes(angles);
    let volume = dot(axes[0], cross(axes[1], axes[2]));
    [0, 1, 2].map(|k| dot(velocity, cross(axes[(k + 1) % 3], axes[(k + 2) % 3])) / volume)
}

/// `to` times the conjugate of `from`: what turns `from` into `to`, of the product of their lengths.
#[inline(always)]
pub fn relative_quaternion<S: Scalar>(from: Quaternion<S>, to: Quaternion<S>) -> Quaternion<S> {
    let [fw, fx, fy, fz] = from;
    let [tw, tx, ty, tz] = to;
    [
        tw * fw + tx * fx + ty * fy + tz * fz,
        tx * fw - tw * fx + (tz * fy - ty * fz),
        ty * fw - tw * fy + (tx * fz - tz * fx),
        tz * fw - tw * fz + (ty * fx - tx * fy),
    ]
}

/// The rotation vector (axis times angle, rad, base frame) that turns `from` into `to`.
///
/// With the relative quaternion (w, v) it is `2 atan(|v| / w) v / |v|`. Below 0.06 rad the series of
/// the arc tangent is exact to rounding and needs no branch per lane.
#[inline(always)]
pub fn relative_rotation<S: Real>(from: Quaternion<S>, to: Quaternion<S>) -> Vector<S> {
    let [w, v @ ..] = relative_quaternion(from, to);
    let length2 = v[0].square() + v[1].square() + v[2].square();
    let x2 = length2 / w.square();
    if x2.all_below(1e-3) {
        let mut series = x2.lift(-1.0 / 11.0);
        for term in [1.0 / 9.0, -1.0 / 7.0, 0.2, -1.0 / 3.0, 1.0] {
            series = series.mul_add(x2, x2.lift(term));
        }
        let factor = (series + series) / w;
        return [v[0] * factor, v[1] * factor, v[2] * factor];
    }
    let mut result = v;
    for lane in 0..S::WIDTH {
        let (w, length) = (w.lane(lane), length2.lane(lane).sqrt());
        // The shorter way round; a quaternion and its negative are the same rotation.
        let sign = if w < 0.0 { -1.0 } else { 1.0 };
        let factor = if length == 0.0 { 0.0 } else { 2.0 * sign * length.atan2(w.abs()) / length };
        for k in 0..3 {
            result[k].set_lane(lane, v[k].lane(lane) * factor);
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn euler_angles_come_back() {
        for a in [-3.0, -0.4, 0.0, 1.2] {
            for b in [-1.5, -0.3, 0.0, 1.5] {
                for c in [-2.9, 0.0, 0.7, 3.1] {
                    let r = rotation_matrix(quaternion_from_euler([a, b, c]));
                    let back = euler_angles(&r);
                    for (x, y) in back.iter().zip([a, b, c]) {
                        assert!((x - y).abs() < 1e-12, "{back:?} {a} {b} {c}");
                    }
                    assert!((r[2][0] + f64::sin(b)).abs() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn relative_rotation_is_the_same_by_series_and_by_arc_tangent() {
        for angle in [1e-9_f64, 1e-4, 0.05, 0.063, 0.064, 0.5, 3.0] {
            let axis = [0.6, -0.48, 0.64];
            let (s, c) = (0.5_f64 * angle).sin_cos();
            let to = [c, s * axis[0], s * axis[1], s * axis[2]];
            let vector = relative_rotation([1.0, 0.0, 0.0, 0.0], to);
            for k in 0..3 {
                assert!((vector[k] - angle * axis[k]).abs() < 1e-15 + 4e-16 * angle, "{angle}");
            }
        }
    }

    #[test]
    fn a_small_step_is_a_small_rotation() {
        let start = Pose::from_coordinates([0.1, 0.2, 0.3, 0.4, -0.5, 0.6]);
        let mut moved = start;
        let twist = [1e-3, 2e-3, -1e-3, 3e-6, -2e-6, 1e-6];
        moved.step(twist);
        let rotation = relative_rotation(start.rotation, moved.rotation);
        for k in 0..3 {
            assert!((rotation[k] - twist[3 + k]).abs() < 1e-15);
            assert!((moved.position[k] - start.position[k] - twist[k]).abs() < 1e-15);
        }
    }
}
