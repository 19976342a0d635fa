//! A machine as its file gives it, in SI units, and why it may be none.

use super::chain::{Part, Side};
use crate::element::DriveKind;
use crate::element::GuideKind;
use crate::linear::SIX;
use crate::spatial::Vector;
use std::collections::BTreeMap;
use std::fmt;

/// A drive as the machine file gives it, in SI units.
#[derive(Clone, Debug)]
pub struct DriveDescription {
    /// Unique among the drives.
    pub name: String,
    /// Which element.
    pub kind: DriveKind,
    /// Lowest and highest joint coordinate.
    pub travel: [f64; 2],
    /// +1, -1 or `None`: the root nearest mid-travel at home.
    pub working_mode: Option<f64>,
    /// The element's fields; missing ones take their default.
    pub fields: BTreeMap<String, Vec<f64>>,
    /// Whether its carriage gives way, so that all struts on it move together.
    pub yields: bool,
}

/// A strut as the machine file gives it, in SI units.
#[derive(Clone, Debug)]
pub struct StrutDescription {
    /// Unique among the struts.
    pub name: String,
    /// The drive that carries it (or is its length); `None`: it stands on the frame.
    pub drive: Option<String>,
    /// Base-side joint centre.
    pub base: Vector<f64>,
    /// Platform-side joint centre, platform axes.
    pub platform: Vector<f64>,
    /// Its own length; `None` exactly where the drive is the length.
    pub length: Option<f64>,
    /// Radius (m) and axis (platform axes) of the ring on which the platform-side joint slides.
    pub ring: Option<(f64, Vector<f64>)>,
    /// How far the strut may lean at its base-side and at its platform-side joint.
    pub limits: [Option<JointLimit>; 2],
}

/// How far a strut may lean from an axis of one of its joints.
#[derive(Clone, Copy, Debug)]
pub struct JointLimit {
    /// The strut's direction (base to platform) in the middle of the joint's range: axes of the frame or
    /// carriage at the base, of the platform at the platform.
    pub axis: Vector<f64>,
    /// Largest angle between the strut and the axis, rad.
    pub angle: f64,
}

/// A guide as the machine file gives it, in SI units.
#[derive(Clone, Debug)]
pub struct GuideDescription {
    /// Unique among the guides.
    pub name: String,
    /// Which element.
    pub kind: GuideKind,
    /// The element's fields; missing ones take their default.
    pub fields: BTreeMap<String, Vec<f64>>,
}

/// A limb as the machine file gives it, in SI units.
#[derive(Clone, Debug)]
pub struct ChainDescription {
    /// Unique among the limbs.
    pub name: String,
    /// The strut that it contains.
    pub strut: Option<String>,
    /// The guides that it contains.
    pub guides: Vec<String>,
    /// See [`Chain::side`](super::Chain::side).
    pub side: Side,
    /// From the base to the platform.
    pub parts: Vec<Part>,
    /// See [`Chain::mass`](super::Chain::mass).
    pub mass: f64,
    /// See [`Chain::whole_length`](super::Chain::whole_length).
    pub whole_length: f64,
    /// See [`Chain::carriage_mass`](super::Chain::carriage_mass).
    pub carriage_mass: f64,
}

/// A whole machine, in SI units.
#[derive(Clone, Debug)]
pub struct Description {
    /// Which of x y z a b c the platform can move in.
    pub dof: [bool; SIX],
    /// Which of them the user commands.
    pub commanded: [bool; SIX],
    /// Start of the forward solution: x, y, z, a, b, c.
    pub home: [f64; SIX],
    /// The tool point in the platform's axes.
    pub tool: Vector<f64>,
    /// Scale between rotation and displacement, m; `None`: from the geometry.
    pub characteristic_length: Option<f64>,
    /// In the order of the joints.
    pub drives: Vec<DriveDescription>,
    /// In the order of the closures.
    pub struts: Vec<StrutDescription>,
    /// Passive limbs, whose closures come after the struts'.
    pub guides: Vec<GuideDescription>,
    /// Limbs that say what they are made of.
    pub chains: Vec<ChainDescription>,
    /// m/N of each closure in itself, in their order; none: 0. Where there are more closures than
    /// freedoms these, and those of the parameters, share a misfit out; infinite: the closure carries
    /// nothing.
    pub closure_compliance: Vec<f64>,
    /// m/N (rad/(N m)) of parameters, by name.
    pub parameter_compliance: BTreeMap<String, f64>,
}

/// Why a description is no machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MachineError {
    /// A stable word.
    pub code: &'static str,
    /// One sentence.
    pub message: String,
    /// The place in the description, as `strut.1.length`.
    pub place: String,
}

impl fmt::Display for MachineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message)
    }
}

impl std::error::Error for MachineError {}

/// A description that is no machine.
pub(super) fn error<T>(
    code: &'static str,
    place: impl Into<String>,
    message: String,
) -> Result<T, MachineError> {
    Err(MachineError { code, message, place: place.into() })
}
