//! What a machine is made of. One element = one file, and one line in the list at the end.
//!
//! An element is written as functions of joint-centre points, lengths and joint coordinates, on any
//! scalar. It knows nothing of poses and nobody derives a Jacobian: how points move with the platform
//! and with the drives is the library's business ([`crate::kinematics`]).

mod crank;
pub mod guide;
mod line;
mod plane;
mod slider;
pub mod strut;
mod telescopic;
mod universal;

use crate::scalar::{Dual, Scalar};
use crate::spatial::{Vector, dot, norm, scale, subtract, tangents};

/// What a number measures; the machine file's units follow from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// m.
    Length,
    /// rad.
    Angle,
    /// A vector of which only the direction counts.
    Direction,
    /// The drive's own joint coordinate: m or rad.
    Coordinate,
    /// No unit.
    Scale,
}

impl Dimension {
    /// The word that the machine file's model uses.
    pub fn name(self) -> &'static str {
        match self {
            Dimension::Length => "length",
            Dimension::Angle => "angle",
            Dimension::Direction => "direction",
            Dimension::Coordinate => "coordinate",
            Dimension::Scale => "scale",
        }
    }

    /// The SI unit of a parameter.
    pub fn unit(self) -> &'static str {
        match self {
            Dimension::Length | Dimension::Coordinate => "m",
            Dimension::Angle => "rad",
            Dimension::Direction | Dimension::Scale => "1",
        }
    }
}

/// One key of an element's table in the machine file.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// The key.
    pub name: &'static str,
    /// 0: one number; 3: a vector.
    pub shape: usize,
    /// What it measures.
    pub dimension: Dimension,
    /// The value of every component where the key is missing; `None`: the key is required.
    pub default: Option<f64>,
    /// One line for the reader of the machine file.
    pub doc: &'static str,
}

/// A number that the closure reads and that a deviation may move.
#[derive(Clone, Copy, Debug)]
pub struct ParameterField {
    /// The last part of the parameter's name, as in `origin.x`.
    pub name: &'static str,
    /// What it measures.
    pub dimension: Dimension,
}

const fn parameter(name: &'static str, dimension: Dimension) -> ParameterField {
    ParameterField { name, dimension }
}

/// How an element is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawing {
    /// A straight guideway along the travel.
    Line,
    /// The circle on which the joint centre turns.
    Circle,
    /// Nothing beyond the strut itself.
    None,
}

impl Drawing {
    /// The word in the element table.
    pub fn name(self) -> &'static str {
        match self {
            Drawing::Line => "line",
            Drawing::Circle => "circle",
            Drawing::None => "none",
        }
    }
}

/// Everything the rest of the software needs to know of an element's kind.
#[derive(Clone, Copy, Debug)]
pub struct ElementTable {
    /// The word in the machine file.
    pub kind: &'static str,
    /// One sentence.
    pub doc: &'static str,
    /// Whether it is the length of the strut that it carries, which then has none of its own.
    pub sets_length: bool,
    /// How it is drawn.
    pub drawing: Drawing,
    /// The keys it reads.
    pub fields: &'static [Field],
    /// The parameters it contributes.
    pub parameters: &'static [ParameterField],
    /// What its joint coordinate measures ([`Dimension::Length`] or [`Dimension::Angle`]).
    pub coordinate: Dimension,
}

/// A nominal direction and the two directions in which its deviations `u`, `v` tilt it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Direction {
    /// Unit vector.
    pub axis: Vector<f64>,
    /// Unit vectors; with the axis a right-handed frame.
    pub tangents: [Vector<f64>; 2],
}

impl Direction {
    /// From any non-zero vector.
    pub fn new(direction: Vector<f64>) -> Self {
        let axis = scale(direction, 1.0 / norm(direction));
        Direction { axis, tangents: tangents(axis) }
    }

    /// The unit axis tilted by `u` and `v` (tangents of the tilt angles).
    #[inline(always)]
    pub fn tilted<S: Scalar>(&self, u: S, v: S) -> Vector<S> {
        let mut axis = [u; 3];
        for k in 0..3 {
            let first = u.mul_add(u.lift(self.tangents[0][k]), u.lift(self.axis[k]));
            axis[k] = v.mul_add(v.lift(self.tangents[1][k]), first);
        }
        scale(axis, u.lift(1.0) / norm(axis))
    }

    /// The tilted unit axis and two vectors across it.
    #[inline(always)]
    pub fn tilted_triad<S: Scalar>(&self, u: S, v: S) -> [Vector<S>; 3] {
        if self.axis == [0.0; 3] {
            return [[u.lift(0.0); 3]; 3];
        }
        let axis = self.tilted(u, v);
        let across = self.tangents.map(|tangent| {
            let tangent = tangent.map(|value| u.lift(value));
            subtract(tangent, scale(axis, dot(tangent, axis)))
        });
        [axis, across[0], across[1]]
    }
}

/// The closed-form inverse of a drive at one platform-side joint centre.
#[derive(Clone, Copy, Debug)]
pub struct Reach<S> {
    /// The joint coordinate; where `margin < 0` that of the nearest reachable point.
    pub joint: S,
    /// Not negative exactly where the strut reaches.
    pub margin: S,
}

/// An actuated joint.
pub trait Drive {
    /// Kind, fields and parameters.
    const TABLE: ElementTable;
    /// Directions of a dual number that differentiates [`Drive::place`]: its parameters, the joint
    /// coordinate, the strut's base point and length.
    const WIDTH: usize = Self::TABLE.parameters.len() + 5;

    /// The base-side joint centre (base frame) and the length of a strut that this drive carries.
    ///
    /// `base` is the joint centre as the machine file gives it; `length` the strut's own length
    /// (unused where the drive is the length).
    fn place<S: Scalar>(
        nominal: &Direction,
        parameters: &[S],
        joint: S,
        base: Vector<S>,
        length: S,
    ) -> (Vector<S>, S);

    /// The joint coordinate for a platform-side joint centre; `mode` (+1 or -1) picks the branch.
    fn inverse<S: Scalar>(
        nominal: &Direction,
        parameters: &[S],
        mode: f64,
        base: Vector<S>,
        length: S,
        platform: Vector<S>,
    ) -> Reach<S>;

    /// The shortest and the longest strut that reaches `platform` from some joint coordinate.
    fn span(
        nominal: &Direction,
        parameters: &[f64],
        base: Vector<f64>,
        platform: Vector<f64>,
    ) -> [f64; 2];
}

/// Where a closure's gradient keeps the derivatives to the strut's own parameters, in their order.
pub const OWN: usize = 7;
/// Where the drive's parameters end.
pub const DRIVE_END: usize = OWN + MAX_DRIVE_PARAMETERS;
/// Where the derivative to the radius of a strut's ring stands.
pub const RING: usize = DRIVE_END + 3;
/// Places of one closure's gradient: a strut's `base`, `platform`, `length`, the drive's parameters,
/// `tool`, `ring_radius`; a guide's anchors, then `tool`. The platform's, the tool's and the ring's are
/// the library's to fill, since they depend on the attitude.
pub const PLACES: usize = RING + 1;

/// The derivatives of one closure that need no knowledge of poses, beside those in its places.
#[derive(Clone, Copy, Debug)]
pub struct ClosureGradient<S> {
    /// To the platform-side joint centre, base frame.
    pub centre: Vector<S>,
    /// To the joint coordinate.
    pub joint: S,
}

/// The gradient of the closure of a strut that hangs on the frame; `points` are its base-side and its
/// platform-side joint centre.
#[inline(always)]
pub fn fixed_gradient<S: Scalar>(
    points: [Vector<S>; 2],
    length: S,
    places: &mut [S; PLACES],
) -> ClosureGradient<S> {
    let (to_centre, to_length) = strut_gradient(points, length);
    for k in 0..3 {
        places[k] = -to_centre[k];
    }
    places[6] = to_length;
    ClosureGradient { centre: to_centre, joint: length.lift(0.0) }
}

/// The derivatives of the strut closure to the platform-side centre and to the length. That to the
/// base-side centre is the former's opposite: moving both points alike changes no distance.
#[inline(always)]
fn strut_gradient<S: Scalar>([base, platform]: [Vector<S>; 2], length: S) -> (Vector<S>, S) {
    let closure = strut::closure(
        [Dual::constant(base[0]), Dual::constant(base[1]), Dual::constant(base[2])],
        [
            Dual::<S, 4>::variable(platform[0], 0),
            Dual::variable(platform[1], 1),
            Dual::variable(platform[2], 2),
        ],
        Dual::variable(length, 3),
    );
    ([closure.parts[0], closure.parts[1], closure.parts[2]], closure.parts[3])
}

/// A strut's base-side joint centre and length through the drive `D`, as dual numbers in the drive's
/// parameters, the joint coordinate, the strut's base point and its length; `N` is [`Drive::WIDTH`].
#[inline(always)]
fn driven_place<S: Scalar, D: Drive, const N: usize>(
    nominal: &Direction,
    parameters: &[S],
    joint: S,
    base: Vector<S>,
    length: S,
) -> (Vector<Dual<S, N>>, Dual<S, N>) {
    let count = D::TABLE.parameters.len();
    let mut inputs = [Dual::<S, N>::constant(joint); MAX_DRIVE_PARAMETERS];
    for k in 0..count {
        inputs[k] = Dual::variable(parameters[k], k);
    }
    D::place(
        nominal,
        &inputs[..count],
        Dual::variable(joint, count),
        [
            Dual::variable(base[0], count + 1),
            Dual::variable(base[1], count + 2),
            Dual::variable(base[2], count + 3),
        ],
        Dual::variable(length, count + 4),
    )
}

/// The gradient of the strut closure through the drive `D`; `N` is its [`Drive::WIDTH`]. `points` are
/// the strut's base as the machine file gives it and its platform-side joint centre.
#[inline(always)]
fn driven_gradient<S: Scalar, D: Drive, const N: usize>(
    nominal: &Direction,
    parameters: &[S],
    joint: S,
    [base, platform]: [Vector<S>; 2],
    length: S,
    places: &mut [S; PLACES],
) -> ClosureGradient<S> {
    let count = D::TABLE.parameters.len();
    let (centre, own) = driven_place::<S, D, N>(nominal, parameters, joint, base, length);
    let at = [centre[0].value, centre[1].value, centre[2].value];
    let (to_centre, to_length) = strut_gradient([at, platform], own.value);
    let mut chained = [joint; N];
    for j in 0..N {
        let along = [centre[0].parts[j], centre[1].parts[j], centre[2].parts[j]];
        chained[j] = to_length.mul_add(own.parts[j], -dot(to_centre, along));
    }
    places[..3].copy_from_slice(&chained[count + 1..count + 4]);
    places[6] = chained[count + 4];
    places[OWN..OWN + count].copy_from_slice(&chained[..count]);
    ClosureGradient { centre: to_centre, joint: chained[count] }
}

/// The work of a force on the base-side joint centre per unit of each parameter, through the drive `D`,
/// at the places of a gradient.
#[inline(always)]
fn driven_base_load<S: Scalar, D: Drive, const N: usize>(
    nominal: &Direction,
    parameters: &[S],
    joint: S,
    base: Vector<S>,
    force: Vector<S>,
    places: &mut [S; PLACES],
) {
    let count = D::TABLE.parameters.len();
    let (centre, _) = driven_place::<S, D, N>(nominal, parameters, joint, base, joint.lift(1.0));
    let mut work = [joint; N];
    for j in 0..N {
        work[j] = dot(force, [centre[0].parts[j], centre[1].parts[j], centre[2].parts[j]]);
    }
    places[..3].copy_from_slice(&work[count + 1..count + 4]);
    places[OWN..OWN + count].copy_from_slice(&work[..count]);
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
            ) -> Reach<S> {
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
                places: &mut [S; PLACES],
            ) {
                match self {
                    $(DriveKind::$name => driven_base_load::<S, $type, { <$type as Drive>::WIDTH }>(
                        nominal, parameters, joint, base, force, places,
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
                places: &mut [S; PLACES],
            ) -> ClosureGradient<S> {
                match self {
                    $(DriveKind::$name => driven_gradient::<S, $type, { <$type as Drive>::WIDTH }>(
                        nominal, parameters, joint, points, length, places,
                    )),+
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

/// The parameters of every drive with an axis; the offset is of the joint coordinate's dimension.
const fn axis_parameter_fields(offset: Dimension) -> [ParameterField; 7] {
    [
        parameter("origin.x", Dimension::Length),
        parameter("origin.y", Dimension::Length),
        parameter("origin.z", Dimension::Length),
        parameter("axis.u", Dimension::Angle),
        parameter("axis.v", Dimension::Angle),
        parameter("offset", offset),
        parameter("scale", Dimension::Scale),
    ]
}

/// The values of [`axis_parameter_fields`].
#[inline(always)]
fn axis_parameters<S: Scalar>(parameters: &[S]) -> [S; 7] {
    let mut values = [parameters[0]; 7];
    values.copy_from_slice(&parameters[..7]);
    values
}
