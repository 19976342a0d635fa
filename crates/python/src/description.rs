//! A machine's description from a Python dict.

use crate::failure::KernelError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::collections::BTreeMap;
use truepose_kernel::element::{DriveKind, Field, GuideKind};
use truepose_kernel::machine::{Axes, FREEDOMS, JointLimit, Part, Place, Section, Side};
use truepose_kernel::{
    ChainDescription, Description, DriveDescription, GuideDescription, StrutDescription,
};

fn refused<T>(code: &'static str, message: String, place: &str) -> PyResult<T> {
    Err(KernelError::new_err((code, message, place.to_owned())))
}

fn item<'py>(table: &Bound<'py, PyDict>, key: &str, place: &str) -> PyResult<Bound<'py, PyAny>> {
    match table.get_item(key)? {
        Some(value) => Ok(value),
        None => refused("missing-field", format!("it has no {key:?}"), place),
    }
}

/// A value that may be missing or None.
fn optional<'py>(table: &Bound<'py, PyDict>, key: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
    Ok(table.get_item(key)?.filter(|value| !value.is_none()))
}

/// Freedoms by name, which must be in the order x y z a b c.
fn freedoms(names: &[String], place: &str) -> PyResult<[bool; 6]> {
    let mut flags = [false; 6];
    let mut last = None;
    for name in names {
        let Some(index) = FREEDOMS.iter().position(|freedom| freedom == name) else {
            return refused("unknown-freedom", format!("{name:?} is none of x y z a b c"), place);
        };
        if last.is_some_and(|last| index <= last) {
            let message =
                format!("{name:?} is out of order: name each once, in the order x y z a b c");
            return refused("freedom-order", message, place);
        }
        last = Some(index);
        flags[index] = true;
    }
    Ok(flags)
}

fn drive(table: &Bound<'_, PyDict>) -> PyResult<DriveDescription> {
    let name: String = item(table, "name", "drive")?.extract()?;
    let place = format!("drive.{name}");
    let word: String = item(table, "kind", &place)?.extract()?;
    let Some(&kind) = DriveKind::ALL.iter().find(|kind| kind.table().kind == word) else {
        return refused("unknown-kind", format!("there is no drive of kind {word:?}"), &place);
    };
    let working_mode = match optional(table, "working_mode")? {
        None => None,
        Some(mode) => match mode.extract::<String>()?.as_str() {
            "+" => Some(1.0),
            "-" => Some(-1.0),
            other => {
                let message = format!("the working mode is {other:?}, expected \"+\" or \"-\"");
                return refused("working-mode", message, &place);
            }
        },
    };
    let fields = element_fields(table, kind.table().fields)?;
    let travel = item(table, "travel", &place)?.extract()?;
    let yields = match optional(table, "yields")? {
        None => false,
        Some(flag) => flag.extract()?,
    };
    Ok(DriveDescription { name, kind, travel, working_mode, fields, yields })
}

/// An element's own fields, as far as they are given.
fn element_fields(
    table: &Bound<'_, PyDict>,
    fields: &[Field],
) -> PyResult<BTreeMap<String, Vec<f64>>> {
    let mut given = BTreeMap::new();
    for field in fields {
        if let Some(value) = optional(table, field.name)? {
            let numbers =
                if field.shape == 0 { vec![value.extract::<f64>()?] } else { value.extract()? };
            given.insert(field.name.to_owned(), numbers);
        }
    }
    Ok(given)
}

fn guide(table: &Bound<'_, PyDict>) -> PyResult<GuideDescription> {
    let name: String = item(table, "name", "guide")?.extract()?;
    let place = format!("guide.{name}");
    let word: String = item(table, "kind", &place)?.extract()?;
    let Some(&kind) = GuideKind::ALL.iter().find(|kind| kind.table().kind == word) else {
        return refused("unknown-kind", format!("there is no guide of kind {word:?}"), &place);
    };
    let fields = element_fields(table, kind.table().fields)?;
    for field in kind.table().fields {
        if fields.get(field.name).is_some_and(|value| value.len() != field.shape.max(1)) {
            let message = format!("it needs {} number(s)", field.shape.max(1));
            return refused("missing-field", message, &format!("{place}.{}", field.name));
        }
    }
    Ok(GuideDescription { name, kind, fields })
}

/// The limit of a joint: its axis and the largest angle, both or neither.
fn limit(table: &Bound<'_, PyDict>, end: &str, place: &str) -> PyResult<Option<JointLimit>> {
    match optional(table, &format!("{end}_angle_limit"))? {
        None => Ok(None),
        Some(angle) => Ok(Some(JointLimit {
            axis: item(table, &format!("{end}_axis"), place)?.extract()?,
            angle: angle.extract()?,
        })),
    }
}

fn strut(table: &Bound<'_, PyDict>) -> PyResult<StrutDescription> {
    let name: String = item(table, "name", "strut")?.extract()?;
    let place = format!("strut.{name}");
    let extracted = |key: &str| optional(table, key);
    Ok(StrutDescription {
        drive: extracted("drive")?.map(|value| value.extract()).transpose()?,
        base: item(table, "base", &place)?.extract()?,
        platform: item(table, "platform", &place)?.extract()?,
        length: extracted("length")?.map(|value| value.extract()).transpose()?,
        ring: match extracted("ring_radius")?.map(|value| value.extract()).transpose()? {
            None | Some(0.0) => None,
            Some(radius) => Some((radius, item(table, "ring_axis", &place)?.extract()?)),
        },
        limits: [limit(table, "base", &place)?, limit(table, "platform", &place)?],
        name,
    })
}

/// What gives way in a limb: a joint or guidance with its `compliance`, or a beam with its `section`.
fn part(table: &Bound<'_, PyDict>, place: &str) -> PyResult<Part> {
    if let Some(section) = optional(table, "section")? {
        let [stretch, y, z, torsion, about_y, about_z, expansion]: [f64; 7] = section.extract()?;
        let section =
            Section { stretch, shear: [y, z], torsion, bending: [about_y, about_z], expansion };
        let length = optional(table, "length")?.map(|value| value.extract()).transpose()?;
        return Ok(Part::Beam { length, section });
    }
    let at_carriage: bool = item(table, "at_carriage", place)?.extract()?;
    let axes = match optional(table, "axes")? {
        None => Axes::Limb,
        Some(axes) => {
            let [x, y]: [[f64; 3]; 2] = axes.extract()?;
            Axes::Frame(x, y)
        }
    };
    Ok(Part::Joint {
        place: if at_carriage { Place::Carriage } else { Place::InTurn },
        axes,
        compliance: item(table, "compliance", place)?.extract()?,
    })
}

fn limb(table: &Bound<'_, PyDict>) -> PyResult<ChainDescription> {
    let name: String = item(table, "name", "limb")?.extract()?;
    let place = format!("limb.{name}");
    let side = match optional(table, "platform_side")? {
        Some(direction) => Side::Platform(direction.extract()?),
        None => Side::Frame(item(table, "side", &place)?.extract()?),
    };
    let parts = item(table, "parts", &place)?.cast_into::<PyList>()?;
    Ok(ChainDescription {
        strut: optional(table, "strut")?.map(|value| value.extract()).transpose()?,
        guides: item(table, "guides", &place)?.extract()?,
        side,
        parts: parts
            .iter()
            .map(|table| part(table.cast::<PyDict>()?, &place))
            .collect::<PyResult<_>>()?,
        mass: item(table, "mass", &place)?.extract()?,
        whole_length: item(table, "whole_length", &place)?.extract()?,
        carriage_mass: item(table, "carriage_mass", &place)?.extract()?,
        name,
    })
}

/// Reads the whole dict; its keys are documented in `truepose/_kernel.pyi`.
pub fn description(table: &Bound<'_, PyDict>) -> PyResult<Description> {
    let dof: Vec<String> = item(table, "dof", "machine")?.extract()?;
    let commanded = match optional(table, "commanded")? {
        None => dof.clone(),
        Some(names) => names.extract()?,
    };
    let mut home = [0.0; 6];
    if let Some(values) = optional(table, "home")? {
        let values: BTreeMap<String, f64> = values.extract()?;
        for (name, value) in values {
            match FREEDOMS.iter().position(|freedom| *freedom == name) {
                Some(index) => home[index] = value,
                None => {
                    let message = format!("{name:?} is none of x y z a b c");
                    return refused("unknown-freedom", message, "workspace.home");
                }
            }
        }
    }
    let tool = match optional(table, "tool")? {
        None => [0.0; 3],
        Some(point) => point.extract()?,
    };
    let length = optional(table, "characteristic_length")?;
    let guides = match optional(table, "guides")? {
        None => PyList::empty(table.py()),
        Some(list) => list.cast_into::<PyList>()?,
    };
    let limbs = match optional(table, "limbs")? {
        None => PyList::empty(table.py()),
        Some(list) => list.cast_into::<PyList>()?,
    };
    let closure_compliance = optional(table, "closure_compliance")?;
    let parameter_compliance = optional(table, "parameter_compliance")?;
    let drives = item(table, "drives", "machine")?.cast_into::<PyList>()?;
    let struts = item(table, "struts", "machine")?.cast_into::<PyList>()?;
    Ok(Description {
        dof: freedoms(&dof, "machine.dof")?,
        commanded: freedoms(&commanded, "machine.commanded")?,
        home,
        tool,
        characteristic_length: length.map(|value| value.extract()).transpose()?,
        drives: drives
            .iter()
            .map(|table| drive(table.cast::<PyDict>()?))
            .collect::<PyResult<_>>()?,
        struts: struts
            .iter()
            .map(|table| strut(table.cast::<PyDict>()?))
            .collect::<PyResult<_>>()?,
        guides: guides
            .iter()
            .map(|table| guide(table.cast::<PyDict>()?))
            .collect::<PyResult<_>>()?,
        chains: limbs.iter().map(|table| limb(table.cast::<PyDict>()?)).collect::<PyResult<_>>()?,
        closure_compliance: closure_compliance
            .map(|value| value.extract())
            .transpose()?
            .unwrap_or_default(),
        parameter_compliance: parameter_compliance
            .map(|value| value.extract())
            .transpose()?
            .unwrap_or_default(),
    })
}
