//! A machine's description read from plain values: the one place that knows its keys.

use super::description::error;
use super::values::{FromValue, Table, Value};
use super::{
    Axes, ChainDescription, Description, DriveDescription, FREEDOMS, GuideDescription, JointLimit,
    MachineError, Part, Place, Section, Side, StrutDescription,
};
use crate::element::{DriveKind, Field, GuideKind};
use crate::linear::SIX;
use std::collections::BTreeMap;

/// The code of a value that is not of the kind that its key has.
pub const WRONG_TYPE: &str = "wrong-type";

/// A value that has to be there.
fn item<'a, T: FromValue<'a>>(table: &'a Table, key: &str, place: &str) -> Result<T, MachineError> {
    match table.get(key) {
        Some(value) => match T::from_value(value) {
            Some(read) => Ok(read),
            None => {
                let message = format!("{key:?} is {}, expected {}", value.kind(), T::name());
                error(WRONG_TYPE, place, message)
            }
        },
        None => error("missing-field", place, format!("it has no {key:?}")),
    }
}

/// A value that may be missing or nothing.
fn optional<'a, T: FromValue<'a>>(
    table: &'a Table,
    key: &str,
    place: &str,
) -> Result<Option<T>, MachineError> {
    match table.get(key) {
        None | Some(Value::Nothing) => Ok(None),
        Some(_) => item(table, key, place).map(Some),
    }
}

/// Freedoms by name, which must be in the order x y z a b c.
fn freedoms(names: &[String], place: &str) -> Result<[bool; SIX], MachineError> {
    let mut flags = [false; SIX];
    let mut last = None;
    for name in names {
        let Some(index) = FREEDOMS.iter().position(|freedom| freedom == name) else {
            return error("unknown-freedom", place, format!("{name:?} is none of x y z a b c"));
        };
        if last.is_some_and(|last| index <= last) {
            let message =
                format!("{name:?} is out of order: name each once, in the order x y z a b c");
            return error("freedom-order", place, message);
        }
        last = Some(index);
        flags[index] = true;
    }
    Ok(flags)
}

fn drive(table: &Table) -> Result<DriveDescription, MachineError> {
    let name: String = item(table, "name", "drive")?;
    let place = format!("drive.{name}");
    let word: String = item(table, "kind", &place)?;
    let Some(&kind) = DriveKind::ALL.iter().find(|kind| kind.table().kind == word) else {
        return error("unknown-kind", place, format!("there is no drive of kind {word:?}"));
    };
    let working_mode = match optional::<String>(table, "working_mode", &place)?.as_deref() {
        None => None,
        Some("+") => Some(1.0),
        Some("-") => Some(-1.0),
        Some(other) => {
            let message = format!("the working mode is {other:?}, expected \"+\" or \"-\"");
            return error("working-mode", place, message);
        }
    };
    let fields = element_fields(table, kind.table().fields, &place)?;
    let travel = item(table, "travel", &place)?;
    let yields = optional(table, "yields", &place)?.unwrap_or(false);
    Ok(DriveDescription { name, kind, travel, working_mode, fields, yields })
}

/// An element's own fields, as far as they are given.
fn element_fields(
    table: &Table,
    fields: &[Field],
    place: &str,
) -> Result<BTreeMap<String, Vec<f64>>, MachineError> {
    let mut given = BTreeMap::new();
    for field in fields {
        let numbers = if field.shape == 0 {
            optional::<f64>(table, field.name, place)?.map(|number| vec![number])
        } else {
            optional::<Vec<f64>>(table, field.name, place)?
        };
        if let Some(numbers) = numbers {
            given.insert(field.name.to_owned(), numbers);
        }
    }
    Ok(given)
}

fn guide(table: &Table) -> Result<GuideDescription, MachineError> {
    let name: String = item(table, "name", "guide")?;
    let place = format!("guide.{name}");
    let word: String = item(table, "kind", &place)?;
    let Some(&kind) = GuideKind::ALL.iter().find(|kind| kind.table().kind == word) else {
        return error("unknown-kind", place, format!("there is no guide of kind {word:?}"));
    };
    let fields = element_fields(table, kind.table().fields, &place)?;
    for field in kind.table().fields {
        if fields.get(field.name).is_some_and(|value| value.len() != field.shape.max(1)) {
            let message = format!("it needs {} number(s)", field.shape.max(1));
            return error("missing-field", format!("{place}.{}", field.name), message);
        }
    }
    Ok(GuideDescription { name, kind, fields })
}

/// The limit of a joint: its axis and the largest angle, both or neither.
fn limit(table: &Table, end: &str, place: &str) -> Result<Option<JointLimit>, MachineError> {
    let angle = optional(table, &format!("{end}_angle_limit"), place)?;
    let limit = |angle| Ok(JointLimit { axis: item(table, &format!("{end}_axis"), place)?, angle });
    angle.map(limit).transpose()
}

fn strut(table: &Table) -> Result<StrutDescription, MachineError> {
    let name: String = item(table, "name", "strut")?;
    let place = format!("strut.{name}");
    Ok(StrutDescription {
        drive: optional(table, "drive", &place)?,
        base: item(table, "base", &place)?,
        platform: item(table, "platform", &place)?,
        length: optional(table, "length", &place)?,
        ring: match optional(table, "ring_radius", &place)? {
            None | Some(0.0) => None,
            Some(radius) => Some((radius, item(table, "ring_axis", &place)?)),
        },
        limits: [limit(table, "base", &place)?, limit(table, "platform", &place)?],
        name,
    })
}

/// What gives way in a limb: a joint or guidance with its `compliance`, or a beam with its `section`.
fn part(table: &Table, place: &str) -> Result<Part, MachineError> {
    if let Some(section) = optional::<[f64; 7]>(table, "section", place)? {
        let [stretch, y, z, torsion, about_y, about_z, expansion] = section;
        let section =
            Section { stretch, shear: [y, z], torsion, bending: [about_y, about_z], expansion };
        return Ok(Part::Beam { length: optional(table, "length", place)?, section });
    }
    let at_carriage: bool = item(table, "at_carriage", place)?;
    let axes = match optional::<[[f64; 3]; 2]>(table, "axes", place)? {
        None => Axes::Limb,
        Some([x, y]) => Axes::Frame(x, y),
    };
    Ok(Part::Joint {
        place: if at_carriage { Place::Carriage } else { Place::InTurn },
        axes,
        compliance: item(table, "compliance", place)?,
    })
}

fn limb(table: &Table) -> Result<ChainDescription, MachineError> {
    let name: String = item(table, "name", "limb")?;
    let place = format!("limb.{name}");
    let side = match optional(table, "platform_side", &place)? {
        Some(direction) => Side::Platform(direction),
        None => Side::Frame(item(table, "side", &place)?),
    };
    let parts: Vec<&Table> = item(table, "parts", &place)?;
    Ok(ChainDescription {
        strut: optional(table, "strut", &place)?,
        guides: item(table, "guides", &place)?,
        side,
        parts: parts.into_iter().map(|table| part(table, &place)).collect::<Result<_, _>>()?,
        mass: item(table, "mass", &place)?,
        whole_length: item(table, "whole_length", &place)?,
        carriage_mass: item(table, "carriage_mass", &place)?,
        name,
    })
}

impl Description {
    /// Reads a whole table; its keys are documented in `truepose/_kernel.pyi`.
    ///
    /// Errors: `missing-field`, `unknown-freedom`, `freedom-order`, `unknown-kind`, `working-mode`, and
    /// [`WRONG_TYPE`] for a value of another kind than its key has.
    pub fn read(table: &Table) -> Result<Description, MachineError> {
        const MACHINE: &str = "machine";
        let dof: Vec<String> = item(table, "dof", MACHINE)?;
        let commanded =
            optional::<Vec<String>>(table, "commanded", MACHINE)?.unwrap_or_else(|| dof.clone());
        let mut home = [0.0; SIX];
        let given: Option<BTreeMap<String, f64>> = optional(table, "home", MACHINE)?;
        for (name, value) in given.into_iter().flatten() {
            match FREEDOMS.iter().position(|freedom| *freedom == name) {
                Some(index) => home[index] = value,
                None => {
                    let message = format!("{name:?} is none of x y z a b c");
                    return error("unknown-freedom", "workspace.home", message);
                }
            }
        }
        let tool = optional(table, "tool", MACHINE)?.unwrap_or([0.0; 3]);
        let characteristic_length = optional(table, "characteristic_length", MACHINE)?;
        let guides: Vec<&Table> = optional(table, "guides", MACHINE)?.unwrap_or_default();
        let limbs: Vec<&Table> = optional(table, "limbs", MACHINE)?.unwrap_or_default();
        let drives: Vec<&Table> = item(table, "drives", MACHINE)?;
        let struts: Vec<&Table> = item(table, "struts", MACHINE)?;
        Ok(Description {
            dof: freedoms(&dof, "machine.dof")?,
            commanded: freedoms(&commanded, "machine.commanded")?,
            home,
            tool,
            characteristic_length,
            drives: drives.into_iter().map(drive).collect::<Result<_, _>>()?,
            struts: struts.into_iter().map(strut).collect::<Result<_, _>>()?,
            guides: guides.into_iter().map(guide).collect::<Result<_, _>>()?,
            chains: limbs.into_iter().map(limb).collect::<Result<_, _>>()?,
            closure_compliance: optional(table, "closure_compliance", MACHINE)?.unwrap_or_default(),
            parameter_compliance: optional(table, "parameter_compliance", MACHINE)?
                .unwrap_or_default(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(value: f64) -> Value {
        Value::Number(value)
    }

    fn numbers<const N: usize>(values: [f64; N]) -> Value {
        Value::List(values.map(Value::Number).to_vec())
    }

    fn text(word: &str) -> Value {
        Value::Text(word.to_owned())
    }

    fn words<const N: usize>(all: [&str; N]) -> Value {
        Value::List(all.map(text).to_vec())
    }

    fn table<const N: usize>(entries: [(&str, Value); N]) -> Value {
        Value::Table(Table::from_iter(entries.map(|(key, value)| (key.to_owned(), value))))
    }

    /// A telescopic strut, and a beam as its limb.
    fn machine() -> Table {
        let drive = table([
            ("name", text("d1")),
            ("kind", text("telescopic")),
            ("travel", numbers([0.1, 0.4])),
            ("yields", Value::Flag(false)),
        ]);
        let strut = table([
            ("name", text("1")),
            ("drive", text("d1")),
            ("base", numbers([0.0; 3])),
            ("platform", numbers([0.1, 0.0, 0.0])),
            ("length", Value::Nothing),
            ("base_angle_limit", number(0.5)),
            ("base_axis", numbers([0.0, 0.0, 1.0])),
        ]);
        let beam = table([("section", numbers([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]))]);
        let limb = table([
            ("name", text("1")),
            ("strut", text("1")),
            ("guides", Value::List(vec![])),
            ("side", numbers([0.0, 1.0, 0.0])),
            ("parts", Value::List(vec![beam])),
            ("mass", number(1.0)),
            ("whole_length", number(0.0)),
            ("carriage_mass", number(0.0)),
        ]);
        let Value::Table(machine) = table([
            ("dof", words(["z"])),
            ("home", table([("z", number(0.3))])),
            ("drives", Value::List(vec![drive])),
            ("struts", Value::List(vec![strut])),
            ("limbs", Value::List(vec![limb])),
            ("closure_compliance", numbers([f64::INFINITY])),
            ("unheard_of", Value::Other("a thing".to_owned())),
        ]) else {
            unreachable!("a table was made")
        };
        machine
    }

    /// Code and place of what is wrong where one value of a table is another one.
    fn wrong(path: &[&str], value: Option<Value>) -> (&'static str, String) {
        let mut machine = machine();
        let mut at = &mut machine;
        for key in &path[..path.len() - 1] {
            at = match at.get_mut(*key) {
                Some(Value::Table(table)) => table,
                Some(Value::List(list)) => match &mut list[0] {
                    Value::Table(table) => table,
                    other => panic!("{key} holds {other:?}"),
                },
                other => panic!("{key} is {other:?}"),
            };
        }
        let key = path[path.len() - 1].to_owned();
        match value {
            Some(value) => at.insert(key, value),
            None => at.remove(&key),
        };
        let error = Description::read(&machine).expect_err("something is wrong");
        (error.code, error.place)
    }

    #[test]
    fn a_whole_table_is_read() {
        let read = Description::read(&machine()).expect("nothing is wrong");
        assert_eq!(
            (read.dof, read.commanded),
            (read.commanded, [false, false, true, false, false, false])
        );
        assert_eq!(read.home, [0.0, 0.0, 0.3, 0.0, 0.0, 0.0]);
        assert_eq!(read.drives[0].travel, [0.1, 0.4]);
        assert_eq!(read.struts[0].length, None);
        assert!(read.struts[0].limits[0].is_some_and(|limit| limit.angle == 0.5));
        assert!(read.struts[0].limits[1].is_none() && read.struts[0].ring.is_none());
        assert_eq!(read.chains[0].side, Side::Frame([0.0, 1.0, 0.0]));
        assert!(matches!(&read.chains[0].parts[0], Part::Beam { length: None, .. }));
        assert_eq!(read.closure_compliance, [f64::INFINITY]);
        assert_eq!(read.parameter_compliance, BTreeMap::new());
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let at = |code: &'static str, place: &str| (code, place.to_owned());
        let cases: [(&[&str], Option<Value>, _); 12] = [
            (&["dof"], None, at("missing-field", "machine")),
            (&["dof"], Some(words(["w"])), at("unknown-freedom", "machine.dof")),
            (&["commanded"], Some(words(["z", "x"])), at("freedom-order", "machine.commanded")),
            (&["home", "w"], Some(number(1.0)), at("unknown-freedom", "workspace.home")),
            (&["drives", "name"], None, at("missing-field", "drive")),
            (&["drives", "kind"], Some(text("w")), at("unknown-kind", "drive.d1")),
            (&["drives", "working_mode"], Some(text("*")), at("working-mode", "drive.d1")),
            (&["struts", "base_axis"], None, at("missing-field", "strut.1")),
            (&["struts", "base"], Some(numbers([0.0; 2])), at(WRONG_TYPE, "strut.1")),
            (&["limbs", "side"], None, at("missing-field", "limb.1")),
            (&["limbs", "parts", "section"], Some(Value::Nothing), at("missing-field", "limb.1")),
            (&["struts"], Some(Value::Flag(true)), at(WRONG_TYPE, "machine")),
        ];
        for (path, value, expected) in cases {
            assert_eq!(wrong(path, value), expected, "{path:?}");
        }
    }
}
