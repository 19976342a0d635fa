//! An arm that turns about a fixed axis.

use super::direction::Direction;
use super::drive::{Drive, InverseRoot, axis_parameter_fields, axis_parameters};
use super::table::{Dimension, Drawing, ElementTable, Field};
use crate::scalar::Scalar;
use crate::spatial::{Vector, add, cross, dot, scale as scaled, subtract};

/// The joint centre stands at `origin + Rot(axis, scale q + offset) base`.
pub struct Crank;

impl Drive for Crank {
    const TABLE: ElementTable = ElementTable {
        kind: "crank",
        doc: "An arm that turns about a fixed axis; struts of fixed length hang on its end. \
              Strut bases are vectors from the origin at angle 0. \
              Working mode +: the elbow ahead of the platform joint in the sense of rotation.",
        drawing: Drawing::Circle,
        fields: &[
            Field::point(
                "origin",
                "a point on the axis of rotation; strut bases are measured from it",
            )
            .or(0.0),
            Field::direction("axis", "axis of rotation; positive angles by the right-hand rule"),
            Field::number(
                "offset",
                Dimension::Angle,
                "added to the joint coordinate (encoder zero)",
            )
            .or(0.0),
            Field::number(
                "scale",
                Dimension::Scale,
                "true rotation per commanded rotation (gear ratio)",
            )
            .or(1.0),
        ],
        parameters: &axis_parameter_fields(Dimension::Angle),
        coordinate: Dimension::Angle,
        ..ElementTable::COMMON
    };

    #[inline(always)]
    fn place<S: Scalar>(
        nominal: &Direction,
        parameters: &[S],
        joint: S,
        base: Vector<S>,
        length: S,
    ) -> (Vector<S>, S) {
        let [x, y, z, u, v, offset, scale] = axis_parameters(parameters);
        let arm = Arm::new(nominal.tilted(u, v), base);
        let (sine, cosine) = scale.mul_add(joint, offset).sin_cos();
        let turned = add(scaled(arm.radial, cosine), scaled(arm.ahead, sine));
        (add([x, y, z], add(arm.axial, turned)), length)
    }

    /// With w from the origin to the platform joint, |w - A|^2 = L^2 is
    /// P cos + Q sin = C: two angles about the direction of (P, Q).
    #[inline(always)]
    fn inverse<S: Scalar>(
        nominal: &Direction,
        parameters: &[S],
        mode: f64,
        base: Vector<S>,
        length: S,
        platform: Vector<S>,
    ) -> InverseRoot<S> {
        let [x, y, z, u, v, offset, scale] = axis_parameters(parameters);
        let arm = Arm::new(nominal.tilted(u, v), base);
        let w = subtract(platform, [x, y, z]);
        let (p, q) = (dot(w, arm.radial), dot(w, arm.ahead));
        let c =
            (dot(w, w) + dot(base, base) - length.square()) * length.lift(0.5) - dot(w, arm.axial);
        let margin = p.square() + q.square() - c.square();
        let side = margin.select(margin, margin.lift(0.0)).sqrt() * margin.lift(mode);
        let angle = (q * c + p * side).atan2(p * c - q * side);
        InverseRoot { joint: (angle - offset) / scale, margin }
    }

    fn span(
        nominal: &Direction,
        parameters: &[f64],
        base: Vector<f64>,
        platform: Vector<f64>,
    ) -> [f64; 2] {
        let [x, y, z, u, v, _, _] = axis_parameters(parameters);
        let arm = Arm::new(nominal.tilted(u, v), base);
        let w = subtract(platform, [x, y, z]);
        let middle = dot(w, w) + dot(base, base) - 2.0 * dot(w, arm.axial);
        let swing = 2.0 * dot(w, arm.radial).hypot(dot(w, arm.ahead));
        [(middle - swing).max(0.0).sqrt(), (middle + swing).sqrt()]
    }
}

/// A vector split along a unit axis, across it, and the latter turned by a right angle.
struct Arm<S> {
    axial: Vector<S>,
    radial: Vector<S>,
    ahead: Vector<S>,
}

impl<S: Scalar> Arm<S> {
    #[inline(always)]
    fn new(axis: Vector<S>, base: Vector<S>) -> Self {
        let axial = scaled(axis, dot(axis, base));
        Arm { axial, radial: subtract(base, axial), ahead: cross(axis, base) }
    }
}
