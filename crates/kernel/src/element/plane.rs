//! A point of the platform stays in a plane of the frame.

use super::guide::{Anchor, Guide, GuidePoints};
use super::table::{Dimension, Drawing, ElementTable, Field, ParameterField, parameter};
use crate::scalar::Scalar;
use crate::spatial::{dot, subtract};

/// `normal . (B - A) = 0`.
pub struct Plane;

const FIELDS: &[Field] = &[
    Field {
        name: "origin",
        shape: 3,
        dimension: Dimension::Length,
        default: Some(0.0),
        doc: "a point of the plane, base frame",
    },
    Field {
        name: "normal",
        shape: 3,
        dimension: Dimension::Direction,
        default: None,
        doc: "normal of the plane, base frame",
    },
    Field {
        name: "platform",
        shape: 3,
        dimension: Dimension::Length,
        default: None,
        doc: "the platform's point that stays in the plane, platform axes",
    },
];

const PARAMETERS: &[ParameterField] = &[
    parameter("origin.x", Dimension::Length),
    parameter("origin.y", Dimension::Length),
    parameter("origin.z", Dimension::Length),
    parameter("platform.x", Dimension::Length),
    parameter("platform.y", Dimension::Length),
    parameter("platform.z", Dimension::Length),
    parameter("normal.u", Dimension::Angle),
    parameter("normal.v", Dimension::Angle),
];

impl Guide for Plane {
    const TABLE: ElementTable = ElementTable {
        kind: "plane",
        doc: "A point of the platform stays in a plane of the frame, as a limb that starts with a \
              revolute joint keeps it (3-PRS). One closure.",
        sets_length: false,
        drawing: Drawing::None,
        fields: FIELDS,
        parameters: PARAMETERS,
        coordinate: Dimension::Length,
    };
    const FIELDS: &'static [(Anchor, &'static str)] = &[
        (Anchor::FramePoint, "origin"),
        (Anchor::PlatformPoint, "platform"),
        (Anchor::FrameDirection, "normal"),
    ];
    const CLOSURES: usize = 1;

    #[inline(always)]
    fn closure<S: Scalar>(_which: usize, at: &GuidePoints<S>, _length: f64) -> S {
        dot(at.frame_direction[0], subtract(at.platform_point, at.frame_point))
    }
}
