//! The immutable machine: elements, platform and the flat vector of parameters.

use crate::element::{DRIVE_END, Dimension, DriveFrame, DriveKind, OWN, strut};
use crate::linear::SIX;
use crate::spatial::{Pose, Vector, norm, rotate, rotation_matrix, subtract};
use std::collections::BTreeMap;
use std::fmt;

/// The names of a platform's freedoms; Euler angles a, b, c with `R = Rz(c) Ry(b) Rx(a)`.
pub const FREEDOMS: [&str; SIX] = ["x", "y", "z", "a", "b", "c"];
/// The names of an error's components: displacement and rotation vector.
pub const COMPONENTS: [&str; SIX] = ["x", "y", "z", "rx", "ry", "rz"];

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
}

/// A strut as the machine file gives it, in SI units.
#[derive(Clone, Debug)]
pub struct StrutDescription {
    /// Unique among the struts.
    pub name: String,
    /// The drive that carries it (or is its length); `None`: it hangs on the frame.
    pub drive: Option<String>,
    /// Base-side joint centre.
    pub base: Vector<f64>,
    /// Platform-side joint centre, platform axes.
    pub platform: Vector<f64>,
    /// Its own length; `None` exactly where the drive is the length.
    pub length: Option<f64>,
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

fn error<T>(
    code: &'static str,
    place: impl Into<String>,
    message: String,
) -> Result<T, MachineError> {
    Err(MachineError { code, message, place: place.into() })
}

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
}

/// A drive, by indices into the machine.
#[derive(Clone, Debug)]
pub struct MachineDrive {
    /// Its name, which is the joint's name.
    pub name: String,
    /// Which element.
    pub kind: DriveKind,
    /// Its nominal axis.
    pub frame: DriveFrame,
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
    /// Names and units.
    pub parameters: Vec<Parameter>,
    /// Nominal values, SI.
    pub nominal: Vec<f64>,
    /// Where `tool.x` stands among the parameters.
    pub tool: usize,
    /// Scale between rotation and displacement, m.
    pub characteristic_length: f64,
    /// Start of the forward solution.
    pub home: Pose<f64>,
    /// For each parameter the closures that read it: (closure, place in its gradient).
    pub readers: Vec<Vec<(usize, usize)>>,
    /// What [`crate::kinematics::proven_regular`] multiplies by: `2^n l^r / (n-1)^((n-1)/2)` for n
    /// closures, r rotations and the characteristic length l.
    pub regularity_scale: f64,
}

/// The indices whose flag is set.
pub fn chosen(flags: &[bool; SIX]) -> Vec<usize> {
    (0..SIX).filter(|&k| flags[k]).collect()
}

impl Machine {
    /// Builds a machine from its description.
    ///
    /// # Errors
    /// [`MachineError`] where the elements do not make a machine: freedoms that the kernel cannot
    /// hold apart, counts of closures and joints that do not fit, a name that is missing.
    pub fn new(description: &Description) -> Result<Self, MachineError> {
        check_freedoms(description)?;
        let mut machine = Machine {
            dof: description.dof,
            commanded: description.commanded,
            held: (0..SIX).filter(|&k| !description.dof[k]).collect(),
            drives: Vec::new(),
            struts: Vec::new(),
            parameters: Vec::new(),
            nominal: Vec::new(),
            tool: 0,
            characteristic_length: 0.0,
            home: Pose::from_coordinates(description.home),
            readers: Vec::new(),
            regularity_scale: 0.0,
        };
        for strut in &description.struts {
            machine.add_strut(strut, &description.drives)?;
        }
        for (index, drive) in description.drives.iter().enumerate() {
            machine.add_drive(index, drive)?;
        }
        machine.tool = machine.nominal.len();
        for k in 0..3 {
            machine.add_parameter(
                format!("tool.{}", FREEDOMS[k]),
                Dimension::Length,
                description.tool[k],
            );
        }
        for strut in &mut machine.struts {
            if let (None, Some(drive)) = (strut.own_length, strut.drive) {
                strut.length_parameter = machine.drives[drive].first;
            }
        }
        machine.check_counts()?;
        machine.find_readers();
        machine.characteristic_length =
            description.characteristic_length.unwrap_or_else(|| machine.geometric_length());
        if !(machine.characteristic_length > 0.0 && machine.characteristic_length.is_finite()) {
            return error(
                "characteristic-length",
                "machine.characteristic_length",
                format!("the characteristic length is {} m", machine.characteristic_length),
            );
        }
        let rotations = machine.dof[3..].iter().filter(|&&free| free).count() as i32;
        let closures = machine.closure_count() as f64;
        let others = closures - 1.0;
        machine.regularity_scale = closures.exp2() * machine.characteristic_length.powi(rotations)
            / others.max(1.0).powf(0.5 * others);
        for (index, drive) in description.drives.iter().enumerate() {
            if drive.working_mode.is_none() {
                machine.drives[index].mode = machine.nearest_mode(index);
            }
        }
        Ok(machine)
    }

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
        self.struts.len()
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

    fn add_parameter(&mut self, name: String, dimension: Dimension, value: f64) {
        self.parameters.push(Parameter { name, unit: dimension.unit() });
        self.nominal.push(value);
    }

    fn add_strut(
        &mut self,
        strut: &StrutDescription,
        drives: &[DriveDescription],
    ) -> Result<(), MachineError> {
        let place = format!("strut.{}", strut.name);
        if self.struts.iter().any(|other| other.name == strut.name) {
            return error(
                "duplicate-name",
                place,
                format!("two struts are named {:?}", strut.name),
            );
        }
        let drive = match &strut.drive {
            None => None,
            Some(name) => match drives.iter().position(|drive| &drive.name == name) {
                Some(index) => Some(index),
                None => {
                    return error(
                        "unknown-drive",
                        place + ".drive",
                        format!("there is no drive {name:?}"),
                    );
                }
            },
        };
        let is_length = drive.is_some_and(|index| drives[index].kind.table().sets_length);
        if is_length != strut.length.is_none() {
            let message = if is_length {
                "its drive is its length; it has none of its own"
            } else {
                "it needs a length"
            };
            return error("strut-length", place + ".length", message.into());
        }
        let first = self.nominal.len();
        let own = [strut.base, strut.platform].concat();
        let values = own.into_iter().chain(strut.length);
        for (field, value) in strut::TABLE.parameters.iter().zip(values) {
            self.add_parameter(format!("{place}.{}", field.name), field.dimension, value);
        }
        let own_length = strut.length.map(|_| first + 6);
        self.struts.push(Strut {
            name: strut.name.clone(),
            drive,
            first,
            own_length,
            length_parameter: own_length.unwrap_or(0),
        });
        Ok(())
    }

    fn add_drive(&mut self, index: usize, drive: &DriveDescription) -> Result<(), MachineError> {
        let place = format!("drive.{}", drive.name);
        if self.drives.iter().any(|other| other.name == drive.name) {
            return error(
                "duplicate-name",
                place,
                format!("two drives are named {:?}", drive.name),
            );
        }
        let table = drive.kind.table();
        let mut frame = DriveFrame::default();
        let mut values = BTreeMap::new();
        for field in table.fields {
            let width = field.shape.max(1);
            let value = match (drive.fields.get(field.name), field.default) {
                (Some(value), _) if value.len() == width => value.clone(),
                (None, Some(default)) => vec![default; width],
                _ => {
                    let place = format!("{place}.{}", field.name);
                    return error("missing-field", place, format!("it needs {width} number(s)"));
                }
            };
            if field.dimension == Dimension::Direction {
                let direction = [value[0], value[1], value[2]];
                let length = norm(direction);
                if !(length > 0.0 && length.is_finite()) {
                    return error(
                        "zero-direction",
                        format!("{place}.{}", field.name),
                        "it points nowhere".into(),
                    );
                }
                frame = DriveFrame::new(direction);
            }
            values.insert(field.name, value);
        }
        let first = self.nominal.len();
        for parameter in table.parameters {
            let (field, component) = match parameter.name.split_once('.') {
                Some((field, component)) => {
                    (field, FREEDOMS.iter().position(|name| name == &component))
                }
                None => (parameter.name, Some(0)),
            };
            // A tilt (u, v) of a direction is measured from the nominal axis.
            let value = component.map_or(0.0, |k| values[field][k]);
            self.add_parameter(format!("{place}.{}", parameter.name), parameter.dimension, value);
        }
        let struts =
            (0..self.struts.len()).filter(|&i| self.struts[i].drive == Some(index)).collect();
        let scale = table.parameters.iter().position(|parameter| parameter.name == "scale");
        self.drives.push(MachineDrive {
            name: drive.name.clone(),
            kind: drive.kind,
            frame,
            first,
            scale: scale.map(|place| first + place),
            travel: drive.travel,
            mode: drive.working_mode.unwrap_or(1.0),
            struts,
        });
        Ok(())
    }

    /// Fills in who reads which parameter, at the places of [`crate::element::PLACES`].
    fn find_readers(&mut self) {
        let mut readers = vec![Vec::new(); self.nominal.len()];
        for (i, strut) in self.struts.iter().enumerate() {
            for place in 0..6 {
                readers[strut.first + place].push((i, place));
            }
            if let Some(index) = strut.own_length {
                readers[index].push((i, 6));
            }
            if let Some(drive) = strut.drive {
                let drive = &self.drives[drive];
                for place in 0..drive.kind.table().parameters.len() {
                    readers[drive.first + place].push((i, OWN + place));
                }
            }
            for k in 0..3 {
                readers[self.tool + k].push((i, DRIVE_END + k));
            }
        }
        self.readers = readers;
    }

    fn check_counts(&self) -> Result<(), MachineError> {
        let (closures, dof) = (self.closure_count(), self.dof_count());
        if closures != dof {
            let problem = if closures < dof {
                "too few: the platform would be loose"
            } else {
                "too many: the platform would be over-constrained"
            };
            return error(
                "closure-count",
                "strut",
                format!("{closures} struts for {dof} degrees of freedom; {problem}"),
            );
        }
        let (joints, commanded) = (self.drives.len(), self.commanded_count());
        if joints != commanded {
            return error(
                "joint-count",
                "drive",
                format!("{joints} drives for {commanded} commanded freedoms; they must be as many"),
            );
        }
        for drive in &self.drives {
            let place = format!("drive.{}", drive.name);
            if drive.struts.is_empty() {
                return error("idle-drive", place, "it carries no strut".into());
            }
            if self.has_direct_inverse() && drive.struts.len() > 1 {
                return error(
                    "shared-drive",
                    place,
                    "it carries several struts although every freedom of the platform is commanded; \
                     name the freedoms that the struts fix among themselves in dof, and leave them \
                     out of commanded"
                        .into(),
                );
            }
        }
        Ok(())
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
            let base: Vector<f64> = [0, 1, 2].map(|k| self.nominal[strut.first + k]);
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
        let base = [0, 1, 2].map(|k| self.nominal[strut.first + k]);
        let length = strut.own_length.map_or(0.0, |own| self.nominal[own]);
        let middle = 0.5 * (drive.travel[0] + drive.travel[1]);
        let away = |mode: f64| {
            let parameters = &self.nominal[drive.first..];
            let joint =
                drive.kind.inverse(&drive.frame, parameters, mode, base, length, platform).joint;
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

fn check_freedoms(description: &Description) -> Result<(), MachineError> {
    let names = |flags: &[bool; SIX]| {
        let names: Vec<&str> = chosen(flags).into_iter().map(|k| FREEDOMS[k]).collect();
        names.join(" ")
    };
    if !description.dof.contains(&true) {
        return error("no-freedom", "machine.dof", "the platform has no freedom".into());
    }
    if (0..SIX).any(|k| description.commanded[k] && !description.dof[k]) {
        return error(
            "commanded-not-free",
            "machine.commanded",
            format!(
                "commanded are {}, but the platform moves in {}",
                names(&description.commanded),
                names(&description.dof)
            ),
        );
    }
    if !description.commanded.contains(&true) {
        return error("commanded-not-free", "machine.commanded", "nothing is commanded".into());
    }
    let rotations = description.dof[3..].iter().filter(|&&flag| flag).count();
    if rotations == 2 {
        return error(
            "two-rotations",
            "machine.dof",
            "two of the angles a, b, c without the third do not name a rotation; free all three \
             (and let a closure hold what is held), or one"
                .into(),
        );
    }
    let held_turned = (3..SIX).any(|k| !description.dof[k] && description.home[k] != 0.0);
    if rotations == 1 && !description.dof[5] && held_turned {
        return error(
            "turned-axis",
            "workspace.home",
            "a platform that turns about one axis only must hold its other angles at 0 \
             (c alone is measured about the base z axis and is free of this)"
                .into(),
        );
    }
    Ok(())
}
