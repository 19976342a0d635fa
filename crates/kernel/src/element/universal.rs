//! A universal joint: the platform does not twist.

use super::guide::{Anchor, Guide, GuidePoints};
use super::table::{ElementTable, Field, parameters};
use crate::scalar::Scalar;
use crate::spatial::dot;

/// `length (base_axis . platform_axis) = 0`.
pub struct Universal;

impl Guide for Universal {
    const TABLE: ElementTable = ElementTable {
        kind: "universal",
        doc: "An axis of the frame and one of the platform stay at a right angle, as the cross of a \
              universal joint keeps them: no twist. One closure, in m: the cosine of their angle \
              times the characteristic length.",
        fields: &[
            Field::direction("base_axis", "the joint's axis on the frame, base frame"),
            Field::direction("platform_axis", "the joint's axis on the platform, platform axes"),
        ],
        parameters: &parameters![tilt "base_axis" tilt "platform_axis"],
        ..ElementTable::COMMON
    };
    const FIELDS: &'static [(Anchor, &'static str)] =
        &[(Anchor::FrameDirection, "base_axis"), (Anchor::PlatformDirection, "platform_axis")];
    const CLOSURES: usize = 1;

    #[inline(always)]
    fn closure<S: Scalar>(_which: usize, at: &GuidePoints<S>, length: f64) -> S {
        let cosine = dot(at.frame_direction[0], at.platform_direction[0]);
        cosine * cosine.lift(length)
    }
}
