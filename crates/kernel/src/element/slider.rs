//! A carriage on a straight guideway.

use super::direction::Direction;
use super::drive::{Drive, InverseRoot, TRAVEL_SCALE, axis_parameter_fields, axis_parameters};
use super::table::{Dimension, Drawing, ElementTable, Field};
use crate::scalar::Scalar;
use crate::spatial::{Vector, add, dot, norm, scale as scaled, subtract};

/// The carriage stands at `origin + (scale q + offset) axis`.
pub struct Slider;

impl Drive for Slider {
    const TABLE: ElementTable = ElementTable {
        kind: "slider",
        doc: "A carriage on a straight guideway; struts of fixed length hang on it. \
              Working mode +: the carriage on the +axis side of the platform joint.",
        drawing: Drawing::Line,
        fields: &[
            Field::point(
                "origin",
                "the carriage's reference point where the joint coordinate is 0",
            )
            .or(0.0),
            Field::direction("axis", "direction of the guideway"),
            Field::number(
                "offset",
                Dimension::Coordinate,
                "added to the joint coordinate (home switch, encoder zero)",
            )
            .or(0.0),
            TRAVEL_SCALE,
        ],
        parameters: &axis_parameter_fields(Dimension::Length),
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
        let carriage = add([x, y, z], scaled(nominal.tilted(u, v), scale.mul_add(joint, offset)));
        (add(carriage, base), length)
    }

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
        let axis = nominal.tilted(u, v);
        let from_origin = subtract(platform, add([x, y, z], base));
        let foot = dot(from_origin, axis);
        let perpendicular = subtract(from_origin, scaled(axis, foot));
        // Half the chord that the guideway cuts out of the sphere about the platform joint.
        let margin = length.square() - dot(perpendicular, perpendicular);
        let half_chord = margin.select(margin, margin.lift(0.0)).sqrt();
        let travelled = half_chord.mul_add(half_chord.lift(mode), foot);
        InverseRoot { joint: (travelled - offset) / scale, margin }
    }

    fn span(
        nominal: &Direction,
        parameters: &[f64],
        base: Vector<f64>,
        platform: Vector<f64>,
    ) -> [f64; 2] {
        let [x, y, z, u, v, _, _] = axis_parameters(parameters);
        let axis = nominal.tilted(u, v);
        let from_origin = subtract(platform, add([x, y, z], base));
        let foot = dot(from_origin, axis);
        [norm(subtract(from_origin, scaled(axis, foot))), f64::INFINITY]
    }
}
