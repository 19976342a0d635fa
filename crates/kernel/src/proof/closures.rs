//! The closures of a machine on intervals, near a pose: residuals and derivatives.
//!
//! The unknown is a displacement from the pose: the tool point's, and a Cayley vector c (twice the
//! tangent of half the angle, along the axis; base axes), both in metres by the characteristic length:
//! R = Rc(c) R0. Its differential is (1 + |c|^2/4)^-1 (I + [c/2]x) dc (Angeles, "Fundamentals of Robotic
//! Mechanical Systems", on linear invariants; it follows from Rc = (I - H)^-1 (I + H), H = [c/2]x).

use crate::element::{DRIVE_END, PLACES, RING, fixed_gradient};
use crate::kinematics::{Limb, guide_limb, ring_arm};
use crate::linear::SIX;
use crate::machine::Machine;
use crate::scalar::{Interval, Scalar};
use crate::spatial::{
    RotationMatrix, Vector, add, cross, dot, norm, rotate, rotate_back, subtract,
};

/// Six numbers of a displacement, m.
pub type Six<S = Interval> = [S; SIX];
/// Rows of derivatives.
pub type Square<S = Interval> = [Six<S>; SIX];

/// Where a platform is, on intervals or what is built of them.
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
    /// Residuals, m.
    pub residuals: Six<S>,
    /// To the displacement; identity rows for what the frame holds.
    pub to_displacement: Square<S>,
    /// To the platform's twist itself: unit wrenches, N per N and N m per N.
    pub to_twist: Square<S>,
    /// To the joint coordinate of each closure's drive.
    pub to_joint: Six<S>,
    /// To the parameters, at the places that [`Machine::readers`] names.
    to_parameters: [[S; PLACES]; SIX],
}

impl<S: Scalar> Derivatives<S> {
    /// Derivatives of all closures to one parameter.
    pub fn to_parameter(&self, machine: &Machine, parameter: usize) -> Six<S> {
        let mut column = [self.residuals[0].lift(0.0); SIX];
        for &(closure, place) in &machine.readers[parameter] {
            column[closure] = self.to_parameters[closure][place];
        }
        column
    }
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
    let length = machine.characteristic_length;
    let [x, y, z, a, b, c] = *displacement;
    let (zero, one, scale) = (x.lift(0.0), x.lift(1.0), x.lift(length));
    let turned = [a, b, c].map(|value| value / scale);
    let (_, turn) = cayley(turned);
    let Placed { position, rotation } = moved(at, [x, y, z], turned);
    let mut result = Derivatives {
        residuals: [zero; SIX],
        to_displacement: [[zero; SIX]; SIX],
        to_twist: [[zero; SIX]; SIX],
        to_joint: [zero; SIX],
        to_parameters: [[zero; PLACES]; SIX],
    };
    let tool = [p[machine.tool], p[machine.tool + 1], p[machine.tool + 2]];
    for (i, strut) in machine.struts.iter().enumerate() {
        let own = &p[strut.first..];
        let base = [own[0], own[1], own[2]];
        let platform = subtract([own[3], own[4], own[5]], tool);
        let mut arm = rotate(&rotation, platform);
        let mut radial = arm;
        let limb = Limb { base, arm: platform, length: zero };
        if let Some(ring) = &strut.ring {
            (arm, radial) = ring_arm(ring, p[ring.radius], &limb, &rotation, position);
        }
        let centre = add(arm, position);
        let length = strut.own_length.map_or(zero, |index| p[index]);
        let places = &mut result.to_parameters[i];
        let (gradient, joint_centre, length) = match strut.drive {
            None => (fixed_gradient([base, centre], length, places), base, length),
            Some(index) => {
                let drive = &machine.drives[index];
                let parameters = &p[drive.first..];
                let (nominal, joint) = (&drive.nominal, q[index]);
                let points = [base, centre];
                let gradient =
                    drive.kind.gradient(nominal, parameters, joint, points, length, places);
                let (at, length) = drive.kind.place(nominal, parameters, joint, base, length);
                (gradient, at, length)
            }
        };
        let to_platform = rotate_back(&rotation, gradient.centre);
        for k in 0..3 {
            places[3 + k] = to_platform[k];
            places[DRIVE_END + k] = -to_platform[k];
        }
        if strut.ring.is_some() {
            places[RING] = dot(gradient.centre, radial);
        }
        result.to_joint[i] = gradient.joint;
        result.residuals[i] = norm(subtract(centre, joint_centre)) - length;
        let moment = cross(arm, gradient.centre);
        result.to_twist[i][..3].copy_from_slice(&gradient.centre);
        result.to_twist[i][3..].copy_from_slice(&moment);
    }
    for (number, &(guide, which)) in machine.guide_closures.iter().enumerate() {
        let i = machine.struts.len() + number;
        let guide = &machine.guides[guide];
        let limb = guide_limb(guide, p, tool);
        let placed = (&rotation, position);
        let places = &mut result.to_parameters[i];
        guide.kind.gradient(which, &guide.frames, &limb, placed, length, places);
        (result.residuals[i], result.to_twist[i]) =
            guide.kind.row(which, &guide.frames, &limb, placed, length);
    }
    for i in 0..machine.closure_count() {
        let row = &mut result.to_displacement[i];
        row.copy_from_slice(&result.to_twist[i]);
        for j in 0..3 {
            let column = [turn[0][j], turn[1][j], turn[2][j]];
            let moment = [result.to_twist[i][3], result.to_twist[i][4], result.to_twist[i][5]];
            row[3 + j] = dot(moment, column) / scale;
        }
        for &freedom in &machine.held {
            row[freedom] = zero;
            result.to_twist[i][freedom] = zero;
        }
    }
    let count = machine.closure_count();
    for (number, &freedom) in machine.held.iter().enumerate() {
        result.to_displacement[count + number][freedom] = one;
        result.to_twist[count + number][freedom] = one;
    }
    result
}
