//! The table of elements, from which the machine file's validation, its schema and the docs are made.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use truepose_kernel::element::{DriveKind, ElementTable, GuideKind, strut};

fn entry<'py>(py: Python<'py>, table: &ElementTable) -> PyResult<Bound<'py, PyDict>> {
    let entry = PyDict::new(py);
    entry.set_item("kind", table.kind)?;
    entry.set_item("doc", table.doc)?;
    entry.set_item("sets_length", table.sets_length)?;
    entry.set_item("drawing", table.drawing.name())?;
    entry.set_item("coordinate", table.coordinate.name())?;
    let fields = PyList::empty(py);
    for field in table.fields {
        let row = PyDict::new(py);
        row.set_item("name", field.name)?;
        row.set_item("shape", field.shape)?;
        row.set_item("dimension", field.dimension.name())?;
        match (field.default, field.shape) {
            (None, _) => row.set_item("default", py.None())?,
            (Some(value), 0) => row.set_item("default", value)?,
            (Some(value), width) => row.set_item("default", vec![value; width])?,
        }
        row.set_item("doc", field.doc)?;
        fields.append(row)?;
    }
    entry.set_item("fields", fields)?;
    let parameters = PyList::empty(py);
    for parameter in table.parameters {
        let row = PyDict::new(py);
        row.set_item("name", parameter.name)?;
        row.set_item("dimension", parameter.dimension.name())?;
        parameters.append(row)?;
    }
    entry.set_item("parameters", parameters)?;
    Ok(entry)
}

/// Every element by family: `{"drive": [...], "strut": [...], "guide": [...]}`, each with kind, doc, sets_length,
/// drawing, coordinate, fields (name, shape, dimension, default, doc) and parameters (name, dimension); a guide also has
/// `closures`, how many.
#[pyfunction]
pub fn elements(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let families = PyDict::new(py);
    let drives = PyList::empty(py);
    for kind in DriveKind::ALL {
        drives.append(entry(py, kind.table())?)?;
    }
    families.set_item("drive", drives)?;
    families.set_item("strut", PyList::new(py, [entry(py, &strut::TABLE)?])?)?;
    let guides = PyList::empty(py);
    for kind in GuideKind::ALL {
        let entry = entry(py, kind.table())?;
        entry.set_item("closures", kind.closures())?;
        guides.append(entry)?;
    }
    families.set_item("guide", guides)?;
    Ok(families)
}
