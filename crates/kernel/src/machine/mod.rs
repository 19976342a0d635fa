//! The immutable machine: elements, platform and the flat vector of parameters.

mod build;
mod build_chain;
mod chain;
mod description;
mod read;
mod values;

pub use chain::{Axes, CHAIN_CLOSURES, Chain, Ends, Part, Place, Section, Side};
pub use description::{
    ChainDescription, Description, DriveDescription, GuideDescription, JointLimit, MachineError,
    StrutDescription,
};
pub use read::WRONG_TYPE;
pub use values::{Table, Value};

use crate::element::guide::GuideFrames;
use crate::element::{Dimension, Direction, DriveKind, GuideKind};
use crate::linear::{CLOSURES, SIX};
use crate::scalar::Scalar;
use crate::spatial::{Pose, Vector, add, cross, norm, rotate, rotation_matrix, subtract};

/// The names of a platform's freedoms; Euler angles a, b, c with `R = Rz(c) Ry(b) Rx(a)`.
pub const FREEDOMS: [&str; SIX] = ["x", "y", "z", "a", "b", "c"];
/// The names of an error's components: displacement and rotation vector.
pub const COMPONENTS: [&str; SIX] = ["x", "y", "z", "rx", "ry", "rz"];

/// One number of the flat parameter vector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// As `strut.1.base.x`, `drive.d1.offset`, `tool.z`.
    pub name: String,
    /// Its SI unit.
    pub unit: &'static str,
}

/// A strut, by indices into the machine.
#[derive(Clone, Debug)]
pub struct Strut {
    /// Its name.
    pub name: String,
    /// The drive that carries it.
    pub drive: Option<usize>,
    /// Where `base.x` stands among the parameters; `platform.x` is three further.
    pub first: usize,
    /// Where `strut.N.length` stands; `None` where the drive is the length.
    pub own_length: Option<usize>,
    /// The parameter that every source which moves this strut's length moves.
    pub length_parameter: usize,
    /// Where the six displacements of the carriage stand that it shares with others.
    pub carriage: Option<usize>,
    /// The ring on which its platform-side joint slides.
    pub ring: Option<Ring>,
    /// How far it may lean at its base-side and at its platform-side joint.
    pub limits: [Option<JointLimit>; 2],
}

impl Strut {
    /// Its base-side joint centre in the axes of what carries it, for parameters `p`: moved and turned with a
    /// carriage that gives way.
    #[inline(always)]
    pub fn carried_base<S: Scalar>(&self, p: &[S]) -> Vector<S> {
        let own = [p[self.first], p[self.first + 1], p[self.first + 2]];
        match self.carriage {
            None => own,
            Some(first) => {
                let turned = cross([p[first + 3], p[first + 4], p[first + 5]], own);
                add(add(own, [p[first], p[first + 1], p[first + 2]]), turned)
            }
        }
    }
}

/// A ring on which a platform-side joint slides.
#[derive(Clone, Copy, Debug)]
pub struct Ring {
    /// Unit vector, platform axes.
    pub axis: Vector<f64>,
    /// Where its radius stands among the parameters.
    pub radius: usize,
}

/// A guide, by indices into the machine.
#[derive(Clone, Debug)]
pub struct MachineGuide {
    /// Its name.
    pub name: String,
    /// Which element.
    pub kind: GuideKind,
    /// Its nominal directions.
    pub frames: GuideFrames,
    /// Where the parameters of each anchor begin; `None` where it has no such anchor.
    pub first: [Option<usize>; 4],
}

/// A drive, by indices into the machine.
#[derive(Clone, Debug)]
pub struct MachineDrive {
    /// Its name, which is the joint's name.
    pub name: String,
    /// Which element.
    pub kind: DriveKind,
    /// Its nominal axis.
    pub nominal: Direction,
    /// Where its parameters begin.
    pub first: usize,
    /// Where its parameter `scale` (true motion per commanded motion) stands among all parameters.
    pub scale: Option<usize>,
    /// Lowest and highest joint coordinate.
    pub travel: [f64; 2],
    /// Branch of the inverse: +1 or -1.
    pub mode: f64,
    /// The struts that it carries.
    pub struts: Vec<usize>,
}

/// An immutable machine. All methods are pure; share it between threads freely.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Which of x y z a b c (and so of x y z rx ry rz) the platform can move in.
    pub dof: [bool; SIX],
    /// Which of them the user commands.
    pub commanded: [bool; SIX],
    /// The freedoms of a rigid body that the frame holds: those not in `dof`.
    pub held: Vec<usize>,
    /// The drives, in the order of the joints.
    pub drives: Vec<MachineDrive>,
    /// The struts, in the order of the closures.
    pub struts: Vec<Strut>,
    /// The guides.
    pub guides: Vec<MachineGuide>,
    /// The closures after the struts': guide, and which of its closures.
    pub guide_closures: Vec<(usize, usize)>,
    /// Where the offset of each of them stands: what its limb gives way by, if it belongs to one.
    pub guide_offsets: Vec<Option<usize>>,
    /// The limbs that say what they are made of.
    pub chains: Vec<Chain>,
    /// m/N of each closure in itself.
    pub closure_compliance: [f64; CLOSURES],
    /// (parameter, m/N or rad/(N m)).
    pub parameter_compliance: Vec<(usize, f64)>,
    /// Names and units.
    pub parameters: Vec<Parameter>,
    /// Nominal values, SI.
    pub nominal: Vec<f64>,
    /// Where `tool.x` stands among the parameters.
    pub tool: usize,
    /// Whether every closure is a strut's between two joints that stay, and there are as many as
    /// freedoms: what runs on lanes. All others take the scalar path.
    pub plain: bool,
    /// Whether a joint limits how far a strut may lean.
    pub limited: bool,
    /// Scale between rotation and displacement, m.
    pub characteristic_length: f64,
    /// Start of the forward solution.
    pub home: Pose<f64>,
    /// For each parameter the closures that depend on it: (closure, slot in its gradient).
    pub dependents: Vec<Vec<(usize, usize)>>,
    /// What [`crate::kinematics::proven_regular`] multiplies by: `2^n l^r / (n-1)^((n-1)/2)` for n
    /// closures, r rotations and the characteristic length l.
    pub regularity_scale: f64,
}

/// The indices whose flag is set.
pub fn indices_of(flags: &[bool; SIX]) -> Vec<usize> {
    (0..SIX).filter(|&k| flags[k]).collect()
}

/// The parts of an error that exist: 0 the displacement, 1 the rotation.
pub fn parts(dof: &[bool; SIX]) -> Vec<usize> {
    (0..2).filter(|part| dof[3 * part..3 * part + 3].contains(&true)).collect()
}

impl Machine {
    /// The same machine with other parameter values, by index.
    pub fn with_values(&self, values: &[(usize, f64)]) -> Self {
        let mut machine = self.clone();
        for &(index, value) in values {
            machine.nominal[index] = value;
        }
        machine
    }

    /// Number of closures.
    pub fn closure_count(&self) -> usize {
        self.struts.len() + self.guide_closures.len()
    }

    /// Whether there are more closures than freedoms.
    pub fn is_overconstrained(&self) -> bool {
        self.closure_count() > self.dof_count()
    }

    /// The closures that can carry a force: those that are not infinitely compliant.
    pub fn carrying(&self) -> impl Iterator<Item = usize> {
        (0..self.closure_count()).filter(|&i| self.closure_compliance[i].is_finite())
    }

    /// Number of the platform's freedoms.
    pub fn dof_count(&self) -> usize {
        self.dof.iter().filter(|&&flag| flag).count()
    }

    /// Number of commanded freedoms.
    pub fn commanded_count(&self) -> usize {
        self.commanded.iter().filter(|&&flag| flag).count()
    }

    /// Whether each drive alone answers for one closure, so that the inverse is a closed form.
    pub fn has_direct_inverse(&self) -> bool {
        self.dof == self.commanded
    }

    /// The root-mean-square distance of the platform joint centres from the tool point; where they
    /// coincide with it (a point platform), the mean strut length at home.
    fn geometric_length(&self) -> f64 {
        let count = self.struts.len() as f64;
        let mut square = 0.0;
        let mut reach = 0.0;
        let rotation = rotation_matrix(self.home.rotation);
        for strut in &self.struts {
            let arm = self.platform_arm(&self.nominal, strut);
            square += arm.iter().map(|value| value * value).sum::<f64>() / count;
            let centre = rotate(&rotation, arm);
            let platform = [0, 1, 2].map(|k| centre[k] + self.home.position[k]);
            let base = strut.carried_base(&self.nominal);
            let length = strut.own_length.map(|index| self.nominal[index]);
            reach += length.unwrap_or_else(|| norm(subtract(platform, base))) / count;
        }
        let radius = square.sqrt();
        if radius > 1e-6 * reach { radius } else { reach }
    }

    /// The platform-side joint centre relative to the tool point, platform axes.
    pub fn platform_arm(&self, parameters: &[f64], strut: &Strut) -> Vector<f64> {
        [0, 1, 2].map(|k| parameters[strut.first + 3 + k] - parameters[self.tool + k])
    }

    /// The branch whose root at home lies nearer to mid-travel.
    fn nearest_mode(&self, index: usize) -> f64 {
        let drive = &self.drives[index];
        let strut = &self.struts[drive.struts[0]];
        let rotation = rotation_matrix(self.home.rotation);
        let centre = rotate(&rotation, self.platform_arm(&self.nominal, strut));
        let platform = [0, 1, 2].map(|k| centre[k] + self.home.position[k]);
        let base = strut.carried_base(&self.nominal);
        let length = strut.own_length.map_or(0.0, |own| self.nominal[own]);
        let middle = 0.5 * (drive.travel[0] + drive.travel[1]);
        let away = |mode: f64| {
            let parameters = &self.nominal[drive.first..];
            let joint =
                drive.kind.inverse(&drive.nominal, parameters, mode, base, length, platform).joint;
            let joint = drive.wrapped(joint, drive.scale.map_or(1.0, |scale| self.nominal[scale]));
            (joint - middle).abs()
        };
        if away(-1.0) < away(1.0) { -1.0 } else { 1.0 }
    }
}

impl MachineDrive {
    /// A crank's angle, moved by whole turns to the one nearest mid-travel; other coordinates as they
    /// are.
    #[inline(always)]
    pub fn wrapped(&self, joint: f64, scale: f64) -> f64 {
        if self.kind.table().coordinate != Dimension::Angle {
            return joint;
        }
        let turn = std::f64::consts::TAU / scale;
        let middle = 0.5 * (self.travel[0] + self.travel[1]);
        joint + turn * ((middle - joint) / turn).round()
    }
}
