//! A line of the platform passes through a point of the frame.

use super::guide::{Anchor, Guide, GuidePoints};
use super::table::{Dimension, Drawing, ElementTable, Field, ParameterField, parameter};
use crate::scalar::Scalar;
use crate::spatial::{dot, subtract};

/// `tangent . (A - B) = 0` for both tangents of the platform's line.
pub struct Line;

const FIELDS: &[Field] = &[
    Field {
        name: "origin",
        shape: 3,
        dimension: Dimension::Length,
        default: Some(0.0),
        doc: "the frame's point through which the line passes, base frame",
    },
    Field {
        name: "platform",
        shape: 3,
        dimension: Dimension::Length,
        default: Some(0.0),
        doc: "a point of the line, platform axes",
    },
    Field {
        name: "axis",
        shape: 3,
        dimension: Dimension::Direction,
        default: None,
        doc: "direction of the line, platform axes",
    },
];

const PARAMETERS: &[ParameterField] = &[
    parameter("origin.x", Dimension::Length),
    parameter("origin.y", Dimension::Length),
    parameter("origin.z", Dimension::Length),
    parameter("platform.x", Dimension::Length),
    parameter("platform.y", Dimension::Length),
    parameter("platform.z", Dimension::Length),
    parameter("axis.u", Dimension::Angle),
    parameter("axis.v", Dimension::Angle),
];

impl Guide for Line {
    const TABLE: ElementTable = ElementTable {
        kind: "line",
        doc: "A line of the platform passes through a point of the frame: a tube fixed to the \
              platform that slides in a joint of the frame (Tricept). Two closures.",
        sets_length: false,
        drawing: Drawing::Line,
        fields: FIELDS,
        parameters: PARAMETERS,
        coordinate: Dimension::Length,
    };
    const FIELDS: &'static [(Anchor, &'static str)] = &[
        (Anchor::FramePoint, "origin"),
        (Anchor::PlatformPoint, "platform"),
        (Anchor::PlatformDirection, "axis"),
    ];
    const CLOSURES: usize = 2;

    #[inline(always)]
    fn closure<S: Scalar>(which: usize, at: &GuidePoints<S>, _length: f64) -> S {
        dot(at.platform_direction[1 + which], subtract(at.frame_point, at.platform_point))
    }
}
