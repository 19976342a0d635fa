//! A line of the platform passes through a point of the frame.

use super::guide::{Anchor, Guide, GuidePoints};
use super::table::{Drawing, ElementTable, Field, parameters};
use crate::scalar::Scalar;
use crate::spatial::{dot, subtract};

/// `tangent . (A - B) = 0` for both tangents of the platform's line.
pub struct Line;

impl Guide for Line {
    const TABLE: ElementTable = ElementTable {
        kind: "line",
        doc: "A line of the platform passes through a point of the frame: a tube fixed to the \
              platform that slides in a joint of the frame (Tricept). Two closures.",
        drawing: Drawing::Line,
        fields: &[
            Field::point("origin", "the frame's point through which the line passes, base frame")
                .or(0.0),
            Field::point("platform", "a point of the line, platform axes").or(0.0),
            Field::direction("axis", "direction of the line, platform axes"),
        ],
        parameters: &parameters![point "origin" point "platform" tilt "axis"],
        ..ElementTable::COMMON
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
