//! A strut: two joint centres at a fixed distance.

use super::table::{
    Dimension, Drawing, ElementTable, Field, ParameterField, parameter, parameters,
};
use crate::scalar::{Dual, Scalar};
use crate::spatial::{Vector, add, dot, norm, scale, subtract};

/// Keys and parameters of a strut. Its length is a parameter only where no telescopic drive is it.
pub const TABLE: ElementTable = ElementTable {
    kind: "strut",
    doc: "Two joint centres, one on the base side and one on the platform, at a distance.",
    drawing: Drawing::Line,
    fields: &[
        Field::point(
            "base",
            "base-side joint centre: on the frame, or on the drive's carriage or crank",
        ),
        Field::point("platform", "platform-side joint centre in the platform's axes"),
        Field::number(
            "ring_radius",
            Dimension::Length,
            "radius of a ring about `platform` on which the platform-side joint slides \
             (pentapods); 0: the joint stands at `platform`",
        )
        .or(0.0),
        Field::direction("ring_axis", "axis of the ring, platform axes").or(0.0),
    ],
    parameters: &parameters![point "base" point "platform" (Dimension::Length) "length"],
    ..ElementTable::COMMON
};

/// The parameter of a strut whose platform-side joint slides on a ring, beside [`TABLE`]'s.
pub const RING_RADIUS: ParameterField = parameter("ring_radius", Dimension::Length);

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

/// The point of a ring (centre, unit axis, radius) that is nearest to `from`, and the unit vector from
/// the centre to it. Where a joint slides on a ring freely it stands there, and the strut's length is
/// the distance to it; by the envelope theorem the closure's derivatives are those of a joint that stays.
#[inline(always)]
pub fn nearest_on_ring<S: Scalar>(
    centre: Vector<S>,
    axis: Vector<S>,
    radius: S,
    from: Vector<S>,
) -> (Vector<S>, Vector<S>) {
    let away = subtract(from, centre);
    let across = subtract(away, scale(axis, dot(away, axis)));
    let radial = scale(across, radius.lift(1.0) / norm(across));
    (add(centre, scale(radial, radius)), radial)
}

/// The derivatives of the strut closure to the platform-side centre and to the length. That to the
/// base-side centre is the former's opposite: moving both points alike changes no distance.
#[inline(always)]
pub fn strut_gradient<S: Scalar>([base, platform]: [Vector<S>; 2], length: S) -> (Vector<S>, S) {
    let gradient = closure(
        [Dual::constant(base[0]), Dual::constant(base[1]), Dual::constant(base[2])],
        [
            Dual::<S, 4>::variable(platform[0], 0),
            Dual::variable(platform[1], 1),
            Dual::variable(platform[2], 2),
        ],
        Dual::variable(length, 3),
    );
    ([gradient.parts[0], gradient.parts[1], gradient.parts[2]], gradient.parts[3])
}
