//! The closures of a machine on intervals, near a pose: residuals and derivatives.
//!
//! The unknown is a displacement from the pose: the tool point's, and a Cayley vector c (twice the
//! tangent of half the angle, along the axis; base axes), both in metres by the characteristic length:
//! R = Rc(c) R0. Its differential is (1 + |c|^2/4)^-1 (I + [c/2]x) dc (Angeles, "Fundamentals of Robotic
//! Mechanical Systems", on linear invariants; it follows from Rc = (I - H)^-1 (I + H), H = [c/2]x).

use crate::kinematics::{self, Gradients, gradients};
use crate::linear::SIX;
use crate::machine::Machine;
use crate::scalar::{Interval, Scalar};
use crate::spatial::{RotationMatrix, Vector, add, dot};

/// Six numbers of a displacement, m.
pub type Six<S = Interval> = [S; SIX];
/// Rows of derivatives.
pub type Square<S = Interval> = [Six<S>; SIX];

/// Adds a multiple of a column.
pub fn add_multiple<S: Scalar>(sum: &mut Six<S>, column: &Six<S>, factor: S) {
    for k in 0..SIX {
        sum[k] = sum[k] + column[k] * factor;
    }
}

/// The placement of a platform, on intervals or dual numbers of intervals.
#[derive(Clone, Copy, Debug)]
pub struct Placed<S = Interval> {
    /// The tool point, m.
    pub position: Vector<S>,
    /// Platform axes.
    pub rotation: RotationMatrix<S>,
}

/// The matrix of a Cayley vector, and what turns its differential into a rotation.
fn cayley<S: Scalar>(c: Vector<S>) -> (RotationMatrix<S>, [[S; 3]; 3]) {
    let one = c[0].lift(1.0);
    let [a, b, d] = c.map(|value| value * value.lift(0.5));
    let squares = [a.square(), b.square(), d.square()];
    let inverse = one / (one + squares[0] + squares[1] + squares[2]);
    let double = inverse + inverse;
    // R = I + 2 (H + H^2) / (1 + |h|^2), every product once.
    let (ab, ad, bd) = (a * b, a * d, b * d);
    let rotation = [
        [one - double * (squares[1] + squares[2]), double * (ab - d), double * (ad + b)],
        [double * (ab + d), one - double * (squares[0] + squares[2]), double * (bd - a)],
        [double * (ad - b), double * (bd + a), one - double * (squares[0] + squares[1])],
    ];
    let turn = [
        [inverse, -(inverse * d), inverse * b],
        [inverse * d, inverse, -(inverse * a)],
        [-(inverse * b), inverse * a, inverse],
    ];
    (rotation, turn)
}

/// The matrix of a Cayley vector.
pub fn turned<S: Scalar>(c: Vector<S>) -> RotationMatrix<S> {
    cayley(c).0
}

/// Derivatives of the closures over a box of displacements, parameters and joints.
#[derive(Clone, Debug)]
pub struct Derivatives<S = Interval> {
    /// To the displacement; identity rows for what the frame holds.
    pub to_displacement: Square<S>,
    /// Everything else; `to_twist` has the same identity rows.
    pub closures: Gradients<S, SIX>,
}

/// A platform moved on: the tool point by `shift` (m), the attitude by a Cayley vector (rad).
pub fn moved<S: Scalar>(at: &Placed<S>, shift: Vector<S>, turned: Vector<S>) -> Placed<S> {
    let (turned, _) = cayley(turned);
    let mut rotation = at.rotation;
    for i in 0..3 {
        for j in 0..3 {
            let column = [at.rotation[0][j], at.rotation[1][j], at.rotation[2][j]];
            rotation[i][j] = dot(turned[i], column);
        }
    }
    Placed { position: add(at.position, shift), rotation }
}

/// Everything at `displacement` from the pose `at`; parameters `p` and joints `q`.
pub fn derivatives<S: Scalar>(
    machine: &Machine,
    p: &[S],
    q: &[S],
    at: &Placed<S>,
    displacement: &Six<S>,
) -> Derivatives<S> {
    let [x, y, z, a, b, c] = *displacement;
    let (zero, one) = (x.lift(0.0), x.lift(1.0));
    let scale = x.lift(machine.characteristic_length);
    let turned = [a, b, c].map(|value| value / scale);
    let (_, turn) = cayley(turned);
    let Placed { position, rotation } = moved(at, [x, y, z], turned);
    let mut closures = gradients::<S, SIX>(machine, p, q, position, &rotation);
    let mut to_displacement = [[zero; SIX]; SIX];
    let count = machine.closure_count();
    for i in 0..count {
        let to_twist = &closures.to_twist[i];
        let moment = [to_twist[3], to_twist[4], to_twist[5]];
        to_displacement[i].copy_from_slice(to_twist);
        for j in 0..3 {
            let column = [turn[0][j], turn[1][j], turn[2][j]];
            to_displacement[i][3 + j] = dot(moment, column) / scale;
        }
    }
    for (number, &freedom) in machine.held.iter().enumerate() {
        for i in 0..count {
            to_displacement[i][freedom] = zero;
        }
        to_displacement[count + number][freedom] = one;
        closures.to_twist[count + number][freedom] = one;
    }
    Derivatives { to_displacement, closures }
}

/// Residuals alone, at `displacement` from the pose `at`.
pub fn residuals<S: Scalar>(
    machine: &Machine,
    p: &[S],
    q: &[S],
    at: &Placed<S>,
    displacement: &Six<S>,
) -> Six<S> {
    let [x, y, z, a, b, c] = *displacement;
    let scale = x.lift(machine.characteristic_length);
    let Placed { position, rotation } = moved(at, [x, y, z], [a, b, c].map(|value| value / scale));
    kinematics::residuals::<S, SIX>(machine, p, q, position, &rotation)
}
