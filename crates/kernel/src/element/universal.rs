//! A universal joint: the platform does not twist.

use super::guide::{Anchor, Guide, GuidePoints};
use super::table::{Dimension, Drawing, ElementTable, Field, ParameterField, parameter};
use crate::scalar::Scalar;
use crate::spatial::dot;

/// `length (base_axis . platform_axis) = 0`.
pub struct Universal;

const FIELDS: &[Field] = &[
    Field {
        name: "base_axis",
        shape: 3,
        dimension: Dimension::Direction,
        default: None,
        doc: "the joint's axis on the frame, base frame",
    },
    Field {
        name: "platform_axis",
        shape: 3,
        dimension: Dimension::Direction,
        default: None,
        doc: "the joint's axis on the platform, platform axes",
    },
];

const PARAMETERS: &[ParameterField] = &[
    parameter("base_axis.u", Dimension::Angle),
    parameter("base_axis.v", Dimension::Angle),
    parameter("platform_axis.u", Dimension::Angle),
    parameter("platform_axis.v", Dimension::Angle),
];

impl Guide for Universal {
    const TABLE: ElementTable = ElementTable {
        kind: "universal",
        doc: "An axis of the frame and one of the platform stay at a right angle, as the cross of a \
              universal joint keeps them: no twist. One closure, in m: the cosine of their angle \
              times the characteristic length.",
        sets_length: false,
        drawing: Drawing::None,
        fields: FIELDS,
        parameters: PARAMETERS,
        coordinate: Dimension::Length,
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
