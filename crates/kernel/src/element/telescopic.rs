//! A strut whose own length is driven.

use super::direction::Direction;
use super::drive::{Drive, InverseRoot, TRAVEL_SCALE};
use super::table::{Dimension, ElementTable, Field, parameters};
use crate::scalar::Scalar;
use crate::spatial::{Vector, norm, subtract};

/// The strut stands on the frame and is `scale q + offset` long.
pub struct Telescopic;

impl Drive for Telescopic {
    const TABLE: ElementTable = ElementTable {
        kind: "telescopic",
        doc: "The strut itself grows and shrinks; its length is the joint coordinate plus an offset.",
        sets_length: true,
        fields: &[
            Field::number(
                "offset",
                Dimension::Coordinate,
                "strut length where the joint coordinate is 0",
            )
            .or(0.0),
            TRAVEL_SCALE,
        ],
        parameters: &parameters![(Dimension::Length) "offset" (Dimension::Scale) "scale"],
        ..ElementTable::COMMON
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
