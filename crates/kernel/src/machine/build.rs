//! From a description to a machine: elements, parameters and which closures depend on them.

use super::description::error;
use super::{
    COMPONENTS, Description, DriveDescription, FREEDOMS, GuideDescription, Machine, MachineDrive,
    MachineError, MachineGuide, Parameter, Ring, Strut, StrutDescription, indices_of,
};
use crate::element::guide::{Anchor, GuideFrames, anchor_parameters};
use crate::element::{Dimension, Direction, Slots, strut};
use crate::linear::{CLOSURES, SIX};
use crate::spatial::{Pose, Vector, norm, scale};
use std::collections::BTreeMap;

/// Of the six displacements of a carriage.
const DISPLACEMENTS: [Dimension; SIX] = [
    Dimension::Length,
    Dimension::Length,
    Dimension::Length,
    Dimension::Angle,
    Dimension::Angle,
    Dimension::Angle,
];

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
            guides: Vec::new(),
            guide_closures: Vec::new(),
            guide_offsets: Vec::new(),
            chains: Vec::new(),
            closure_compliance: [0.0; CLOSURES],
            parameter_compliance: Vec::new(),
            parameters: Vec::new(),
            nominal: Vec::new(),
            tool: 0,
            plain: false,
            limited: false,
            characteristic_length: 0.0,
            home: Pose::from_coordinates(description.home),
            dependents: Vec::new(),
            regularity_scale: 0.0,
        };
        for strut in &description.struts {
            machine.add_strut(strut, &description.drives)?;
        }
        for (index, drive) in description.drives.iter().enumerate() {
            machine.add_drive(index, drive)?;
        }
        for guide in &description.guides {
            let of_limb = description.chains.iter().any(|chain| chain.guides.contains(&guide.name));
            machine.add_guide(guide, of_limb)?;
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
        for chain in &description.chains {
            machine.add_chain(chain)?;
        }
        machine.check_counts()?;
        machine.find_dependents();
        machine.plain = machine.guides.is_empty()
            && !machine.is_overconstrained()
            && machine.struts.iter().all(|strut| strut.ring.is_none());
        machine.limited =
            machine.struts.iter().any(|strut| strut.limits.iter().any(Option::is_some));
        machine.take_compliances(description)?;
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
        check_unique("strut", &strut.name, self.struts.iter().map(|other| &other.name))?;
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
        let mut ring = None;
        if let Some((radius, axis)) = strut.ring {
            if !(drive.is_none() || is_length) {
                return error(
                    "ring-on-carriage",
                    place + ".ring_radius",
                    "a strut whose platform joint slides on a ring must stand on the frame".into(),
                );
            }
            let axis = unit(axis, || format!("{place}.ring_axis"))?;
            ring = Some(Ring { axis, radius: self.nominal.len() });
            let field = strut::RING_RADIUS;
            self.add_parameter(format!("{place}.{}", field.name), field.dimension, radius);
        }
        let mut limits = strut.limits;
        for (limit, end) in limits.iter_mut().zip(["base_axis", "platform_axis"]) {
            if let Some(limit) = limit {
                limit.axis = unit(limit.axis, || format!("{place}.{end}"))?;
            }
        }
        self.struts.push(Strut {
            name: strut.name.clone(),
            drive,
            first,
            own_length,
            length_parameter: own_length.unwrap_or(0),
            carriage: None,
            ring,
            limits,
        });
        Ok(())
    }

    fn add_guide(&mut self, guide: &GuideDescription, of_limb: bool) -> Result<(), MachineError> {
        let place = format!("guide.{}", guide.name);
        check_unique("guide", &guide.name, self.guides.iter().map(|other| &other.name))?;
        let mut frames = GuideFrames::default();
        let mut first = [None; 4];
        for &(anchor, name) in guide.kind.fields() {
            let field = guide.kind.table().fields.iter().find(|field| field.name == name);
            let default = field.and_then(|field| field.default).map(|value| vec![value; 3]);
            let Some(value) = guide.fields.get(name).cloned().or(default) else {
                let message = "it needs 3 number(s)".into();
                return error("missing-field", format!("{place}.{name}"), message);
            };
            let value = [value[0], value[1], value[2]];
            let mut values = value.to_vec();
            let turning = match anchor {
                Anchor::FrameDirection => Some(&mut frames.frame),
                Anchor::PlatformDirection => Some(&mut frames.platform),
                _ => None,
            };
            if let Some(nominal) = turning {
                *nominal = Direction::new(unit(value, || format!("{place}.{name}"))?);
                values = vec![0.0; 2];
            }
            first[anchor as usize] = Some(self.nominal.len());
            for (&(component, dimension), value) in anchor_parameters(anchor).iter().zip(values) {
                self.add_parameter(format!("{place}.{name}.{component}"), dimension, value);
            }
        }
        let number = self.guides.len();
        let count = guide.kind.closures();
        self.guide_closures.extend((0..count).map(|which| (number, which)));
        for which in 0..count {
            let name = match count {
                1 => format!("{place}.offset"),
                _ => format!("{place}.offset.{}", which + 1),
            };
            self.guide_offsets.push(of_limb.then_some(self.nominal.len()));
            if of_limb {
                self.add_parameter(name, Dimension::Length, 0.0);
            }
        }
        self.guides.push(MachineGuide {
            name: guide.name.clone(),
            kind: guide.kind,
            frames,
            first,
        });
        Ok(())
    }

    fn take_compliances(&mut self, description: &Description) -> Result<(), MachineError> {
        let given = &description.closure_compliance;
        if !given.is_empty() && given.len() != self.closure_count() {
            let message =
                format!("{} compliances for {} closures", given.len(), self.closure_count());
            return error("compliance-count", "closure_compliance", message);
        }
        self.closure_compliance[..given.len()].copy_from_slice(given);
        for (name, &value) in &description.parameter_compliance {
            match self.parameters.iter().position(|parameter| &parameter.name == name) {
                Some(index) => self.parameter_compliance.push((index, value)),
                None => {
                    let message = format!("there is no parameter {name:?}");
                    return error("unknown-parameter", "parameter_compliance", message);
                }
            }
        }
        Ok(())
    }

    fn add_drive(&mut self, index: usize, drive: &DriveDescription) -> Result<(), MachineError> {
        let place = format!("drive.{}", drive.name);
        check_unique("drive", &drive.name, self.drives.iter().map(|other| &other.name))?;
        let table = drive.kind.table();
        let mut nominal = Direction::default();
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
                nominal = Direction::new(unit(direction, || format!("{place}.{}", field.name))?);
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
        let struts: Vec<usize> =
            (0..self.struts.len()).filter(|&i| self.struts[i].drive == Some(index)).collect();
        if drive.yields {
            for &strut in &struts {
                self.struts[strut].carriage = Some(self.nominal.len());
            }
            for (name, dimension) in COMPONENTS.iter().zip(DISPLACEMENTS) {
                self.add_parameter(format!("{place}.carriage.{name}"), dimension, 0.0);
            }
        }
        let scale = table.parameters.iter().position(|parameter| parameter.name == "scale");
        self.drives.push(MachineDrive {
            name: drive.name.clone(),
            kind: drive.kind,
            nominal,
            first,
            scale: scale.map(|place| first + place),
            travel: drive.travel,
            mode: drive.working_mode.unwrap_or(1.0),
            struts,
        });
        Ok(())
    }

    /// Fills in which closures depend on which parameter, at [`Slots`].
    fn find_dependents(&mut self) {
        let mut dependents = vec![Vec::new(); self.nominal.len()];
        // Neighbouring parameters have neighbouring slots.
        let mut depend = |closure: usize, first: usize, slot: usize, count: usize| {
            for k in 0..count {
                dependents[first + k].push((closure, slot + k));
            }
        };
        for (i, strut) in self.struts.iter().enumerate() {
            depend(i, strut.first, Slots::BASE, Slots::LENGTH);
            if let Some(index) = strut.own_length {
                depend(i, index, Slots::LENGTH, 1);
            }
            if let Some(drive) = strut.drive {
                let drive = &self.drives[drive];
                depend(i, drive.first, Slots::DRIVE, drive.kind.table().parameters.len());
            }
            if let Some(first) = strut.carriage {
                depend(i, first, Slots::CARRIAGE, 6);
            }
            if let Some(ring) = strut.ring {
                depend(i, ring.radius, Slots::RING_RADIUS, 1);
            }
            depend(i, self.tool, Slots::TOOL, 3);
        }
        for (number, &(guide, _)) in self.guide_closures.iter().enumerate() {
            let i = self.struts.len() + number;
            for anchor in Anchor::ALL {
                if let Some(first) = self.guides[guide].first[anchor as usize] {
                    depend(i, first, anchor.slot(), anchor_parameters(anchor).len());
                }
            }
            if let Some(offset) = self.guide_offsets[number] {
                depend(i, offset, Slots::OFFSET, 1);
            }
            depend(i, self.tool, Slots::TOOL, 3);
        }
        self.dependents = dependents;
    }

    fn check_counts(&self) -> Result<(), MachineError> {
        let (closures, dof) = (self.closure_count(), self.dof_count());
        if closures < dof {
            return error(
                "closure-count",
                "strut",
                format!(
                    "{closures} closures for {dof} degrees of freedom; too few: the platform would be \
                     loose"
                ),
            );
        }
        if closures > CLOSURES {
            return error(
                "closure-count",
                "strut",
                format!("{closures} closures; at most {CLOSURES} can be had"),
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
            if self.has_direct_inverse() && !self.is_overconstrained() && drive.struts.len() > 1 {
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
}

/// The unit vector along `direction`; `place` is where it was given.
fn unit(direction: Vector<f64>, place: impl Fn() -> String) -> Result<Vector<f64>, MachineError> {
    let length = norm(direction);
    if length > 0.0 && length.is_finite() {
        return Ok(scale(direction, 1.0 / length));
    }
    error("zero-direction", place(), "it points nowhere".into())
}

/// Refuses a second element of one name.
fn check_unique<'a>(
    family: &str,
    name: &String,
    mut others: impl Iterator<Item = &'a String>,
) -> Result<(), MachineError> {
    if others.any(|other| other == name) {
        let message = format!("two {family}s are named {name:?}");
        return error("duplicate-name", format!("{family}.{name}"), message);
    }
    Ok(())
}

fn check_freedoms(description: &Description) -> Result<(), MachineError> {
    let names = |flags: &[bool; SIX]| {
        let names: Vec<&str> = indices_of(flags).into_iter().map(|k| FREEDOMS[k]).collect();
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
