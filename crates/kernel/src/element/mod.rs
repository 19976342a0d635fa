//! What a machine is made of. One element = one file, and one line in a list at the end.
//!
//! An element is written as functions of joint-centre points, lengths and joint coordinates, on any
//! scalar. It knows nothing of poses and nobody derives a Jacobian: how points move with the platform
//! and with the drives is the library's business ([`crate::kinematics`]).

mod crank;
mod direction;
mod drive;
pub mod guide;
mod line;
mod plane;
mod slider;
pub mod strut;
mod table;
mod telescopic;
mod universal;

pub use direction::Direction;
pub use drive::{ClosureGradient, Drive, InverseRoot};
pub use table::{Dimension, Drawing, ElementTable, Field, ParameterField};

use crate::scalar::{Real, Scalar};
use crate::spatial::{Vector, cross};
use drive::{DRIVE_INPUTS, driven_base_load, driven_gradient};
use guide::{
    ANCHOR_PARAMETERS, Anchor, Guide, GuideFrames, GuideLimb, Placement, gradient_of, residual_of,
    row_of,
};
use std::ops::Deref;
use strut::strut_gradient;

/// Where the gradient of one closure has its derivatives to the parameters that the closure reads: a
/// strut's `base`, `platform`, `length`, the drive's parameters, `tool`, `ring_radius`, the carriage's
/// displacements; a guide's anchors ([`Anchor::slot`]) and offset, then `tool`.
pub struct Slots;

impl Slots {
    /// `base.x`; y and z follow.
    pub const BASE: usize = 0;
    /// `platform.x`; y and z follow.
    pub const PLATFORM: usize = Self::BASE + 3;
    /// `length`.
    pub const LENGTH: usize = Self::PLATFORM + 3;
    /// The drive's first parameter; the others follow.
    pub const DRIVE: usize = Self::LENGTH + 1;
    /// `tool.x`; y and z follow.
    pub const TOOL: usize = Self::DRIVE + MAX_DRIVE_PARAMETERS;
    /// `ring_radius`.
    pub const RING_RADIUS: usize = Self::TOOL + 3;
    /// The first displacement of the strut's carriage; two more and three turns follow.
    pub const CARRIAGE: usize = Self::RING_RADIUS + 1;
    /// How many.
    pub const COUNT: usize = Self::CARRIAGE + 6;
    /// What the limb of a guide has given way by.
    pub const OFFSET: usize = ANCHOR_PARAMETERS;

    /// Whether a strut's slot is of its base side: the base, the length, the drive and its carriage.
    #[inline(always)]
    pub fn is_base_side(slot: usize) -> bool {
        slot < Self::PLATFORM
            || (Self::LENGTH..Self::TOOL).contains(&slot)
            || slot >= Self::CARRIAGE
    }
}

/// The derivatives of one closure to the parameters that it reads, by their [`Slots`]. The platform's, the
/// tool's and the ring's are the library's to fill, since they depend on the attitude.
#[derive(Clone, Copy, Debug, Default)]
pub struct ParameterGradient<S>([S; Slots::COUNT]);

impl<S: Scalar> ParameterGradient<S> {
    /// Zero everywhere, of the same kind as `like`.
    pub fn zero(like: S) -> Self {
        ParameterGradient([like.lift(0.0); Slots::COUNT])
    }

    /// To the strut's base.
    #[inline(always)]
    pub fn set_base(&mut self, to_base: &[S]) {
        self.0[Slots::BASE..Slots::PLATFORM].copy_from_slice(to_base);
    }

    /// To the drive's parameters and the strut's base, of the inputs of [`Drive::place`]; returns those to
    /// the joint coordinate and to the length.
    #[inline(always)]
    fn set_driven<const N: usize>(&mut self, inputs: &[S; N]) -> (S, S) {
        let count = N - DRIVE_INPUTS;
        self.set_base(&inputs[count + 1..count + 4]);
        self.0[Slots::DRIVE..Slots::DRIVE + count].copy_from_slice(&inputs[..count]);
        (inputs[count], inputs[count + 4])
    }

    /// To the platform-side joint, platform axes. That to the tool point is its opposite.
    #[inline(always)]
    pub fn set_platform(&mut self, to_platform: Vector<S>) {
        for k in 0..3 {
            self.0[Slots::PLATFORM + k] = to_platform[k];
            self.0[Slots::TOOL + k] = -to_platform[k];
        }
    }

    /// To the radius of the strut's ring.
    #[inline(always)]
    pub fn set_ring_radius(&mut self, to_radius: S) {
        self.0[Slots::RING_RADIUS] = to_radius;
    }

    /// To the six displacements of the carriage, in its axes, once those to the base that it carries are
    /// there: at `own` on the carriage, which has turned by `turn`, so that the base is at
    /// `own + displacement + turn x own`.
    #[inline(always)]
    pub fn set_carriage(&mut self, own: Vector<S>, turn: Vector<S>) {
        let to_base = [self.0[Slots::BASE], self.0[Slots::BASE + 1], self.0[Slots::BASE + 2]];
        let to_turn = cross(own, to_base);
        let turned = cross(to_base, turn);
        for k in 0..3 {
            self.0[Slots::CARRIAGE + k] = to_base[k];
            self.0[Slots::CARRIAGE + 3 + k] = to_turn[k];
            self.0[Slots::BASE + k] = to_base[k] + turned[k];
        }
    }

    /// To what a guide's limb has given way by.
    pub fn set_offset(&mut self, to_offset: S) {
        self.0[Slots::OFFSET] = to_offset;
    }

    /// To a guide's anchors and the tool point.
    fn set_anchors(&mut self, to_anchors: [S; ANCHOR_PARAMETERS]) {
        self.0[..ANCHOR_PARAMETERS].copy_from_slice(&to_anchors);
        let platform = Anchor::PlatformPoint.slot();
        for k in 0..3 {
            self.0[Slots::TOOL + k] = -to_anchors[platform + k];
        }
    }
}

impl<S: Real> ParameterGradient<S> {
    /// That of one sample of a group.
    pub fn lane(&self, lane: usize) -> ParameterGradient<f64> {
        ParameterGradient(self.0.map(|value| value.lane(lane)))
    }
}

impl<S> Deref for ParameterGradient<S> {
    type Target = [S; Slots::COUNT];

    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

/// The gradient of the closure of a strut on the frame; `points` are its base-side and its
/// platform-side joint centre.
#[inline(always)]
pub fn fixed_gradient<S: Scalar>(
    points: [Vector<S>; 2],
    length: S,
    to_parameters: &mut ParameterGradient<S>,
) -> ClosureGradient<S> {
    let (to_centre, to_length) = strut_gradient(points, length);
    to_parameters.set_base(&[-to_centre[0], -to_centre[1], -to_centre[2]]);
    to_parameters.0[Slots::LENGTH] = to_length;
    ClosureGradient { centre: to_centre, joint: length.lift(0.0) }
}

const fn most(counts: &[usize]) -> usize {
    let mut result = 0;
    let mut k = 0;
    while k < counts.len() {
        if counts[k] > result {
            result = counts[k];
        }
        k += 1;
    }
    result
}

/// Makes the closed set of drives from its list, with static dispatch on any scalar.
macro_rules! drives {
    ($($name:ident => $type:path),+ $(,)?) => {
        /// The kinds of drive.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)] // each is described by its table
        pub enum DriveKind { $($name),+ }

        /// The most parameters that a drive of the list has.
        pub const MAX_DRIVE_PARAMETERS: usize =
            most(&[$(<$type as Drive>::TABLE.parameters.len()),+]);

        impl DriveKind {
            /// Every kind, in the order of the list.
            pub const ALL: &[DriveKind] = &[$(DriveKind::$name),+];

            /// Kind, fields and parameters.
            pub fn table(self) -> &'static ElementTable {
                match self { $(DriveKind::$name => const { &<$type as Drive>::TABLE }),+ }
            }

            /// See [`Drive::place`].
            #[inline(always)]
            pub fn place<S: Scalar>(
                self,
                nominal: &Direction,
                parameters: &[S],
                joint: S,
                base: Vector<S>,
                length: S,
            ) -> (Vector<S>, S) {
                match self {
                    $(DriveKind::$name => <$type as Drive>::place(nominal, parameters, joint, base, length)),+
                }
            }

            /// See [`Drive::inverse`].
            #[inline(always)]
            pub fn inverse<S: Scalar>(
                self,
                nominal: &Direction,
                parameters: &[S],
                mode: f64,
                base: Vector<S>,
                length: S,
                platform: Vector<S>,
            ) -> InverseRoot<S> {
                match self {
                    $(DriveKind::$name => <$type as Drive>::inverse(nominal, parameters, mode, base, length, platform)),+
                }
            }

            /// See [`Drive::span`].
            pub fn span(
                self,
                nominal: &Direction,
                parameters: &[f64],
                base: Vector<f64>,
                platform: Vector<f64>,
            ) -> [f64; 2] {
                match self {
                    $(DriveKind::$name => <$type as Drive>::span(nominal, parameters, base, platform)),+
                }
            }

            /// The work of a force on the base-side joint centre per unit of each parameter.
            #[inline(always)]
            pub fn base_load<S: Scalar>(
                self,
                nominal: &Direction,
                parameters: &[S],
                joint: S,
                base: Vector<S>,
                force: Vector<S>,
                loads: &mut ParameterGradient<S>,
            ) {
                match self {
                    $(DriveKind::$name => {
                        let inputs = driven_base_load::<S, $type, { <$type as Drive>::WIDTH }>(
                            nominal, parameters, joint, base, force,
                        );
                        loads.set_driven(&inputs);
                    }),+
                }
            }

            /// The derivatives of the closure of a strut that this drive carries.
            #[inline(always)]
            pub fn gradient<S: Scalar>(
                self,
                nominal: &Direction,
                parameters: &[S],
                joint: S,
                points: [Vector<S>; 2],
                length: S,
                to_parameters: &mut ParameterGradient<S>,
            ) -> ClosureGradient<S> {
                match self {
                    $(DriveKind::$name => {
                        let (centre, inputs) =
                            driven_gradient::<S, $type, { <$type as Drive>::WIDTH }>(
                                nominal, parameters, joint, points, length,
                            );
                        let (joint, to_length) = to_parameters.set_driven(&inputs);
                        to_parameters.0[Slots::LENGTH] = to_length;
                        ClosureGradient { centre, joint }
                    }),+
                }
            }
        }
    };
}

/// Makes the closed set of guides from its list, with static dispatch.
macro_rules! guides {
    ($($name:ident => $type:path),+ $(,)?) => {
        /// The kinds of guide.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)] // each is described by its table
        pub enum GuideKind { $($name),+ }

        impl GuideKind {
            /// Every kind, in the order of the list.
            pub const ALL: &[GuideKind] = &[$(GuideKind::$name),+];

            /// Kind, fields and parameters.
            pub fn table(self) -> &'static ElementTable {
                match self { $(GuideKind::$name => const { &<$type as Guide>::TABLE }),+ }
            }

            /// The field that each anchor is given by.
            pub fn fields(self) -> &'static [(Anchor, &'static str)] {
                match self { $(GuideKind::$name => <$type as Guide>::FIELDS),+ }
            }

            /// How many closures it has.
            pub fn closures(self) -> usize {
                match self { $(GuideKind::$name => <$type as Guide>::CLOSURES),+ }
            }

            /// Residual (m) of one closure and its row: derivatives to the platform's twist.
            pub fn row<S: Scalar>(
                self,
                which: usize,
                frames: &GuideFrames,
                limb: &GuideLimb<S>,
                at: Placement<'_, S>,
                length: f64,
            ) -> (S, [S; 6]) {
                match self { $(GuideKind::$name => row_of::<S, $type>(which, frames, limb, at, length)),+ }
            }

            /// Residual (m) of one closure, on any scalar.
            pub fn residual<S: Scalar>(
                self,
                which: usize,
                frames: &GuideFrames,
                limb: &GuideLimb<S>,
                at: Placement<'_, S>,
                length: f64,
            ) -> S {
                match self { $(GuideKind::$name => residual_of::<S, $type>(which, frames, limb, at, length)),+ }
            }

            /// The derivatives of one closure to its parameters and to the tool's.
            pub fn gradient<S: Scalar>(
                self,
                which: usize,
                frames: &GuideFrames,
                limb: &GuideLimb<S>,
                at: Placement<'_, S>,
                length: f64,
                to_parameters: &mut ParameterGradient<S>,
            ) {
                to_parameters.set_anchors(match self {
                    $(GuideKind::$name => gradient_of::<S, $type>(which, frames, limb, at, length)),+
                });
            }
        }
    };
}

// The list: a new drive is its file, its `mod` line above and one line here.
drives! {
    Slider => slider::Slider,
    Crank => crank::Crank,
    Telescopic => telescopic::Telescopic,
}

// The list: a new guide is its file, its `mod` line above and one line here.
guides! {
    Plane => plane::Plane,
    Line => line::Line,
    Universal => universal::Universal,
}
