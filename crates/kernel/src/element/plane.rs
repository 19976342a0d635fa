//! A point of the platform stays in a plane of the frame.

use super::guide::{Anchor, Guide, GuidePoints};
use super::table::{ElementTable, Field, parameters};
use crate::scalar::Scalar;
use crate::spatial::{dot, subtract};

/// `normal . (B - A) = 0`.
pub struct Plane;

impl Guide for Plane {
    const TABLE: ElementTable = ElementTable {
        kind: "plane",
        doc: "A point of the platform stays in a plane of the frame, as a limb that starts with a \
              revolute joint keeps it (3-PRS). One closure.",
        fields: &[
            Field::point("origin", "a point of the plane, base frame").or(0.0),
            Field::direction("normal", "normal of the plane, base frame"),
            Field::point("platform", "the platform's point that stays in the plane, platform axes"),
        ],
        parameters: &parameters![point "origin" point "platform" tilt "normal"],
        ..ElementTable::COMMON
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
