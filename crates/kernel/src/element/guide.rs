//! A passive limb: closures between the frame and the platform that no drive moves.
//!
//! A guide reads at most one point and one direction of the frame and one of each of the platform. How
//! they move with the pose and with their own deviations is added here, once for all guides, as dual
//! numbers through the guide's closures.

use super::direction::Direction;
use super::table::{Dimension, ElementTable};
use crate::scalar::{Dual, Scalar};
use crate::spatial::{RotationMatrix, Vector, add, cross, rotate};

/// The four things that a guide may read, in the order of their parameters' slots in a gradient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// A point of the frame: slots 0 to 2.
    FramePoint,
    /// A point of the platform: slots 3 to 5.
    PlatformPoint,
    /// A direction of the frame, with two tilts: slots 6 and 7.
    FrameDirection,
    /// A direction of the platform, with two tilts: slots 8 and 9.
    PlatformDirection,
}

impl Anchor {
    /// All four, in their order.
    pub const ALL: [Anchor; 4] = [
        Anchor::FramePoint,
        Anchor::PlatformPoint,
        Anchor::FrameDirection,
        Anchor::PlatformDirection,
    ];

    /// Where its first parameter stands in a gradient.
    pub fn slot(self) -> usize {
        match self {
            Anchor::FramePoint => 0,
            Anchor::PlatformPoint => 3,
            Anchor::FrameDirection => 6,
            Anchor::PlatformDirection => 8,
        }
    }
}

/// Parameters of the four anchors together.
pub const ANCHOR_PARAMETERS: usize = 10;

/// What a guide's closures read at one pose, all in base axes. Directions come as a unit vector and two
/// tangents; what the guide does not declare is zero.
#[derive(Clone, Copy, Debug)]
pub struct GuidePoints<S> {
    /// A point of the frame.
    pub frame_point: Vector<S>,
    /// A point of the platform.
    pub platform_point: Vector<S>,
    /// A direction of the frame.
    pub frame_direction: [Vector<S>; 3],
    /// A direction of the platform.
    pub platform_direction: [Vector<S>; 3],
}

/// A passive limb.
pub trait Guide {
    /// Kind, fields and parameters.
    const TABLE: ElementTable;
    /// The field that each anchor is given by.
    const FIELDS: &'static [(Anchor, &'static str)];
    /// How many closures it has.
    const CLOSURES: usize;

    /// Residual of one of its closures, m. `length` turns an angle into a length: the machine's
    /// characteristic length.
    fn closure<S: Scalar>(which: usize, at: &GuidePoints<S>, length: f64) -> S;
}

/// A guide's anchors in their own axes: what does not depend on the pose.
#[derive(Clone, Copy, Debug, Default)]
pub struct GuideLimb<S> {
    /// A point of the frame, base axes.
    pub frame_point: Vector<S>,
    /// A point of the platform from the tool point, platform axes.
    pub arm: Vector<S>,
    /// Tilts of the frame's and of the platform's direction.
    pub tilts: [[S; 2]; 2],
}

/// The nominal directions of a guide.
#[derive(Clone, Copy, Debug, Default)]
pub struct GuideFrames {
    /// Base axes.
    pub frame: Direction,
    /// Platform axes.
    pub platform: Direction,
}

impl<S: Scalar> GuideLimb<S> {
    fn map<T>(&self, to: impl Fn(S) -> T) -> GuideLimb<T> {
        let vector = |v: Vector<S>| v.map(&to);
        GuideLimb {
            frame_point: vector(self.frame_point),
            arm: vector(self.arm),
            tilts: self.tilts.map(|tilt| tilt.map(&to)),
        }
    }

    /// The anchors in base axes; `at` is the tool point.
    #[inline(always)]
    fn points(
        &self,
        frames: &GuideFrames,
        rotation: &RotationMatrix<S>,
        at: Vector<S>,
    ) -> GuidePoints<S> {
        let [frame, platform] = self.tilts;
        GuidePoints {
            frame_point: self.frame_point,
            platform_point: add(rotate(rotation, self.arm), at),
            frame_direction: frames.frame.tilted_triad(frame[0], frame[1]),
            platform_direction: frames
                .platform
                .tilted_triad(platform[0], platform[1])
                .map(|direction| rotate(rotation, direction)),
        }
    }
}

/// Residual of a closure and its row: derivatives to the platform's twist about the tool point.
#[inline(always)]
pub fn row_of<S: Scalar, G: Guide>(
    which: usize,
    frames: &GuideFrames,
    limb: &GuideLimb<S>,
    (rotation, position): Placement<'_, S>,
    length: f64,
) -> (S, [S; 6]) {
    let still = limb.points(frames, rotation, position);
    let zero = position[0].lift(0.0);
    // A twist moves a point by t + w x arm and turns a direction by w x d.
    let turned = |v: Vector<S>, shift: f64| -> Vector<Dual<S, 6>> {
        let mut moved = v.map(Dual::constant);
        for k in 0..3 {
            let mut unit = [zero; 3];
            unit[k] = zero.lift(1.0);
            let along = cross(unit, v);
            for i in 0..3 {
                moved[i].parts[k] = if i == k { zero.lift(shift) } else { zero };
                moved[i].parts[3 + k] = along[i];
            }
        }
        moved
    };
    let mut point = turned(rotate(rotation, limb.arm), 1.0);
    for k in 0..3 {
        point[k].value = still.platform_point[k];
    }
    let closure = G::closure(
        which,
        &GuidePoints {
            frame_point: still.frame_point.map(Dual::constant),
            platform_point: point,
            frame_direction: still.frame_direction.map(|v| v.map(Dual::constant)),
            platform_direction: still.platform_direction.map(|v| turned(v, 0.0)),
        },
        length,
    );
    (closure.value, closure.parts)
}

/// Residual of a closure on any scalar.
#[inline(always)]
pub fn residual_of<S: Scalar, G: Guide>(
    which: usize,
    frames: &GuideFrames,
    limb: &GuideLimb<S>,
    (rotation, position): (&RotationMatrix<S>, Vector<S>),
    length: f64,
) -> S {
    G::closure(which, &limb.points(frames, rotation, position), length)
}

/// The derivatives of a closure to the parameters of its anchors, at their slots.
#[inline(always)]
pub fn gradient_of<S: Scalar, G: Guide>(
    which: usize,
    frames: &GuideFrames,
    limb: &GuideLimb<S>,
    (rotation, position): Placement<'_, S>,
    length: f64,
) -> [S; ANCHOR_PARAMETERS] {
    let one = position[0].lift(1.0);
    let mut own = limb.map(Dual::<S, ANCHOR_PARAMETERS>::constant);
    for k in 0..3 {
        own.frame_point[k].parts[Anchor::FramePoint.slot() + k] = one;
        own.arm[k].parts[Anchor::PlatformPoint.slot() + k] = one;
    }
    for k in 0..2 {
        own.tilts[0][k].parts[Anchor::FrameDirection.slot() + k] = one;
        own.tilts[1][k].parts[Anchor::PlatformDirection.slot() + k] = one;
    }
    let pose = (&rotation.map(|row| row.map(Dual::constant)), position.map(Dual::constant));
    residual_of::<_, G>(which, frames, &own, pose, length).parts
}

/// Where a platform is: its rotation and its tool point.
pub type Placement<'a, S> = (&'a RotationMatrix<S>, Vector<S>);

/// The names and dimensions of the parameters of one anchor.
pub fn anchor_parameters(anchor: Anchor) -> &'static [(&'static str, Dimension)] {
    match anchor {
        Anchor::FramePoint | Anchor::PlatformPoint => {
            &[("x", Dimension::Length), ("y", Dimension::Length), ("z", Dimension::Length)]
        }
        Anchor::FrameDirection | Anchor::PlatformDirection => {
            &[("u", Dimension::Angle), ("v", Dimension::Angle)]
        }
    }
}
