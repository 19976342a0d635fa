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
pub use drive::{Drive, InverseRoot};
pub use table::{Dimension, Drawing, ElementTable, Field, ParameterField};

use crate::scalar::Scalar;
use crate::spatial::Vector;
use drive::{driven_base_load, driven_gradient};
use guide::{Anchor, Guide, GuideFrames, GuideLimb, Placement, gradient_of, residual_of, row_of};
use strut::strut_gradient;

/// Where a closure's gradient keeps the derivatives to the strut's own parameters, in their order.
pub const OWN: usize = 7;
/// Where the drive's parameters end.
pub const DRIVE_END: usize = OWN + MAX_DRIVE_PARAMETERS;
/// Where the derivative to the radius of a strut's ring stands.
pub const RING: usize = DRIVE_END + 3;
/// Slots of one closure's gradient: a strut's `base`, `platform`, `length`, the drive's parameters,
/// `tool`, `ring_radius`; a guide's anchors, then `tool`. The platform's, the tool's and the ring's are
/// the library's to fill, since they depend on the attitude.
pub const PLACES: usize = RING + 1;

/// The derivatives of one closure that need no knowledge of poses, beside those in its slots.
#[derive(Clone, Copy, Debug)]
pub struct ClosureGradient<S> {
    /// To the platform-side joint centre, base frame.
    pub centre: Vector<S>,
    /// To the joint coordinate.
    pub joint: S,
}

/// The gradient of the closure of a strut on the frame; `points` are its base-side and its
/// platform-side joint centre.
#[inline(always)]
pub fn fixed_gradient<S: Scalar>(
    points: [Vector<S>; 2],
    length: S,
    slots: &mut [S; PLACES],
) -> ClosureGradient<S> {
    let (to_centre, to_length) = strut_gradient(points, length);
    for k in 0..3 {
        slots[k] = -to_centre[k];
    }
    slots[6] = to_length;
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
                slots: &mut [S; PLACES],
            ) {
                match self {
                    $(DriveKind::$name => driven_base_load::<S, $type, { <$type as Drive>::WIDTH }>(
                        nominal, parameters, joint, base, force, slots,
                    )),+
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
                slots: &mut [S; PLACES],
            ) -> ClosureGradient<S> {
                match self {
                    $(DriveKind::$name => driven_gradient::<S, $type, { <$type as Drive>::WIDTH }>(
                        nominal, parameters, joint, points, length, slots,
                    )),+
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

            /// The derivatives of one closure to its parameters and to the tool's, at their slots.
            pub fn gradient<S: Scalar>(
                self,
                which: usize,
                frames: &GuideFrames,
                limb: &GuideLimb<S>,
                at: Placement<'_, S>,
                length: f64,
                slots: &mut [S; PLACES],
            ) {
                match self {
                    $(GuideKind::$name => gradient_of::<S, $type>(which, frames, limb, at, length, slots)),+
                }
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
