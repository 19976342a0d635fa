//! A strut whose own length is driven.

use super::direction::Direction;
use super::drive::{Drive, InverseRoot};
use super::table::{Dimension, Drawing, ElementTable, Field, ParameterField, parameter};
use crate::scalar::Scalar;
use crate::spatial::{Vector, norm, subtract};

/// The strut stands on the frame and is `scale q + offset` long.
pub struct Telescopic;

const FIELDS: &[Field] = &[
    Field {
        name: "offset",
        shape: 0,
        dimension: Dimension::Coordinate,
        default: Some(0.0),
        doc: "strut length where the joint coordinate is 0",
    },
    Field {
        name: "scale",
        shape: 0,
        dimension: Dimension::Scale,
        default: Some(1.0),
        doc: "true travel per commanded travel (lead, scale factor)",
    },
];

const PARAMETERS: &[ParameterField] =
    &[parameter("offset", Dimension::Length), parameter("scale", Dimension::Scale)];

impl Drive for Telescopic {
    const TABLE: ElementTable = ElementTable {
        kind: "telescopic",
        doc: "The strut itself grows and shrinks; its length is the joint coordinate plus an offset.",
        sets_length: true,
        drawing: Drawing::None,
        fields: FIELDS,
        parameters: PARAMETERS,
        coordinate: Dimension::Length,
    };

    #[inline(always)]
    fn place<S: Scalar>(
        _nominal: &Direction,
        parameters: &[S],
        joint: S,
        base: Vector<S>,
        _length: S,
    ) -> (Vector<S>, S) {
        (base, parameters[1].mul_add(joint, parameters[0]))
    }

    #[inline(always)]
    fn inverse<S: Scalar>(
        _nominal: &Direction,
        parameters: &[S],
        _mode: f64,
        base: Vector<S>,
        length: S,
        platform: Vector<S>,
    ) -> InverseRoot<S> {
        let distance = norm(subtract(platform, base));
        InverseRoot { joint: (distance - parameters[0]) / parameters[1], margin: length.lift(1.0) }
    }

    fn span(
        _nominal: &Direction,
        _parameters: &[f64],
        _base: Vector<f64>,
        _platform: Vector<f64>,
    ) -> [f64; 2] {
        [0.0, f64::INFINITY]
    }
}
