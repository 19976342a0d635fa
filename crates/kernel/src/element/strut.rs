//! A strut: two joint centres at a fixed distance.

use super::{Dimension, Drawing, ElementTable, Field, ParameterField, parameter};
use crate::scalar::Scalar;
use crate::spatial::{Vector, norm, subtract};

/// Keys and parameters of a strut. Its length is a parameter only where no telescopic drive is it.
pub const TABLE: ElementTable = ElementTable {
    kind: "strut",
    doc: "Two joint centres, one on the base side and one on the platform, at a distance.",
    sets_length: false,
    drawing: Drawing::Line,
    fields: &[
        Field {
            name: "base",
            shape: 3,
            dimension: Dimension::Length,
            default: None,
            doc: "base-side joint centre: on the frame, or on the drive's carriage or crank",
        },
        Field {
            name: "platform",
            shape: 3,
            dimension: Dimension::Length,
            default: None,
            doc: "platform-side joint centre in the platform's axes",
        },
    ],
    parameters: PARAMETERS,
    coordinate: Dimension::Length,
};

const PARAMETERS: &[ParameterField] = &[
    parameter("base.x", Dimension::Length),
    parameter("base.y", Dimension::Length),
    parameter("base.z", Dimension::Length),
    parameter("platform.x", Dimension::Length),
    parameter("platform.y", Dimension::Length),
    parameter("platform.z", Dimension::Length),
    parameter("length", Dimension::Length),
];

/// The residual |B - A| - L in m. Its derivative to the platform's twist is the unit wrench of the
/// strut's force.
#[inline(always)]
pub fn closure<S: Scalar>(base: Vector<S>, platform: Vector<S>, length: S) -> S {
    norm(subtract(platform, base)) - length
}

/// A residual with the same root, quicker to iterate on: |B - A|^2 - L^2, in m^2. Its rows are those
/// of [`closure`] times 2 |B - A|, so Newton's step differs only in the second order.
#[inline(always)]
pub fn squared_closure<S: Scalar>(base: Vector<S>, platform: Vector<S>, length: S) -> S {
    let d = subtract(platform, base);
    d[0].square_plus(d[1].square_plus(d[2].square_plus(-length.square())))
}
