//! An actuated joint: where the strut that it carries begins, and the closed form of its inverse.

use super::direction::Direction;
use super::strut::strut_gradient;
use super::table::{Dimension, ElementTable, Field, ParameterField, parameters};
use crate::scalar::{Dual, Scalar};
use crate::spatial::{Vector, dot};

/// The closed-form inverse of a drive at one platform-side joint centre.
#[derive(Clone, Copy, Debug)]
pub struct InverseRoot<S> {
    /// The joint coordinate; where `margin < 0` that of the nearest reachable point.
    pub joint: S,
    /// Not negative exactly where the strut reaches.
    pub margin: S,
}

/// Inputs of [`Drive::place`] beside the drive's parameters: joint coordinate, base point, length.
pub const DRIVE_INPUTS: usize = 5;

/// The derivatives of one closure that need no knowledge of poses, beside those to the parameters.
#[derive(Clone, Copy, Debug)]
pub struct ClosureGradient<S> {
    /// To the platform-side joint centre, base frame.
    pub centre: Vector<S>,
    /// To the joint coordinate.
    pub joint: S,
}

/// An actuated joint.
pub trait Drive {
    /// Kind, fields and parameters.
    const TABLE: ElementTable;
    /// Directions of a dual number that differentiates [`Drive::place`]: its parameters, the joint
    /// coordinate, the strut's base point and length.
    const WIDTH: usize = Self::TABLE.parameters.len() + DRIVE_INPUTS;

    /// The base-side joint centre (base frame) and the length of a strut that this drive carries.
    ///
    /// `base` is the joint centre as the machine file gives it; `length` the strut's own length
    /// (unused where the drive is the length).
    fn place<S: Scalar>(
        nominal: &Direction,
        parameters: &[S],
        joint: S,
        base: Vector<S>,
        length: S,
    ) -> (Vector<S>, S);

    /// The joint coordinate for a platform-side joint centre; `mode` (+1 or -1) picks the branch.
    fn inverse<S: Scalar>(
        nominal: &Direction,
        parameters: &[S],
        mode: f64,
        base: Vector<S>,
        length: S,
        platform: Vector<S>,
    ) -> InverseRoot<S>;

    /// The shortest and the longest strut that reaches `platform` from some joint coordinate.
    fn span(
        nominal: &Direction,
        parameters: &[f64],
        base: Vector<f64>,
        platform: Vector<f64>,
    ) -> [f64; 2];
}

/// A strut's base-side joint centre and length through the drive `D`, as dual numbers in the drive's
/// parameters, the joint coordinate, the strut's base point and its length; `N` is [`Drive::WIDTH`].
#[inline(always)]
fn driven_place<S: Scalar, D: Drive, const N: usize>(
    nominal: &Direction,
    parameters: &[S],
    joint: S,
    base: Vector<S>,
    length: S,
) -> (Vector<Dual<S, N>>, Dual<S, N>) {
    let count = D::TABLE.parameters.len();
    let mut inputs = [Dual::<S, N>::constant(joint); N];
    for k in 0..count {
        inputs[k] = Dual::variable(parameters[k], k);
    }
    D::place(
        nominal,
        &inputs[..count],
        Dual::variable(joint, count),
        [
            Dual::variable(base[0], count + 1),
            Dual::variable(base[1], count + 2),
            Dual::variable(base[2], count + 3),
        ],
        Dual::variable(length, count + 4),
    )
}

/// The gradient of the strut closure through the drive `D`; `N` is its [`Drive::WIDTH`]. `points` are
/// the strut's base as the machine file gives it and its platform-side joint centre. Returns the derivatives
/// to the latter, and to the inputs of [`Drive::place`].
#[inline(always)]
pub fn driven_gradient<S: Scalar, D: Drive, const N: usize>(
    nominal: &Direction,
    parameters: &[S],
    joint: S,
    [base, platform]: [Vector<S>; 2],
    length: S,
) -> (Vector<S>, [S; N]) {
    let (centre, own) = driven_place::<S, D, N>(nominal, parameters, joint, base, length);
    let at = [centre[0].value, centre[1].value, centre[2].value];
    let (to_centre, to_length) = strut_gradient([at, platform], own.value);
    let mut chained = [joint; N];
    for j in 0..N {
        let along = [centre[0].parts[j], centre[1].parts[j], centre[2].parts[j]];
        chained[j] = to_length.mul_add(own.parts[j], -dot(to_centre, along));
    }
    (to_centre, chained)
}

/// The work of a force on the base-side joint centre per unit of each input of [`Drive::place`], through the
/// drive `D`.
#[inline(always)]
pub fn driven_base_load<S: Scalar, D: Drive, const N: usize>(
    nominal: &Direction,
    parameters: &[S],
    joint: S,
    base: Vector<S>,
    force: Vector<S>,
) -> [S; N] {
    let (centre, _) = driven_place::<S, D, N>(nominal, parameters, joint, base, joint.lift(1.0));
    let mut work = [joint; N];
    for j in 0..N {
        work[j] = dot(force, [centre[0].parts[j], centre[1].parts[j], centre[2].parts[j]]);
    }
    work
}

/// The key of a drive whose coordinate is a travel.
pub const TRAVEL_SCALE: Field = Field::number(
    "scale",
    Dimension::Scale,
    "true travel per commanded travel (lead, scale factor)",
)
.or(1.0);

/// The parameters of every drive with an axis; the offset is of the joint coordinate's dimension.
pub const fn axis_parameter_fields(offset: Dimension) -> [ParameterField; 7] {
    parameters![point "origin" tilt "axis" (offset) "offset" (Dimension::Scale) "scale"]
}

/// The values of [`axis_parameter_fields`].
#[inline(always)]
pub fn axis_parameters<S: Scalar>(parameters: &[S]) -> [S; 7] {
    let mut values = [parameters[0]; 7];
    values.copy_from_slice(&parameters[..7]);
    values
}
