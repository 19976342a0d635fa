//! The machine's formulas as C, and the numbers that a program round them needs.

use crate::machine::Machine;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truepose_kernel::code::{self, Shifts, Term};

/// Parameter, constant, slope, and of which strut's length.
type GivenTerm = (usize, f64, f64, Option<usize>);

impl Machine {
    fn term(&self, (parameter, constant, slope, strut): GivenTerm) -> PyResult<Term> {
        let known = parameter < self.inner.parameters.len()
            && strut.is_none_or(|strut| strut < self.inner.struts.len());
        if !known {
            let message = "a term of a parameter or strut that the machine does not have";
            return Err(pyo3::exceptions::PyIndexError::new_err(message));
        }
        Ok(Term { parameter, constant, slope: strut.map(|strut| (slope, strut)) })
    }
}

#[pymethods]
impl Machine {
    /// C functions `{name: (arguments, body, values)}` of the machine's formulas; terms are (parameter,
    /// constant, slope, strut or None); `shared`: two parameters and by how much each gives way under the
    /// other's load; `limbs`: whether limbs give way.
    fn c_functions<'py>(
        &self,
        py: Python<'py>,
        always: Vec<GivenTerm>,
        per_kelvin: Vec<Vec<GivenTerm>>,
        compliance: Vec<GivenTerm>,
        shared: Vec<(usize, usize, f64)>,
        limbs: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        if shared.iter().any(|&(one, other, _)| one.max(other) >= self.inner.parameters.len()) {
            let message = "a parameter that the machine does not have";
            return Err(pyo3::exceptions::PyIndexError::new_err(message));
        }
        let terms = |given: Vec<GivenTerm>| {
            given.into_iter().map(|term| self.term(term)).collect::<PyResult<Vec<Term>>>()
        };
        let shifts = Shifts {
            always: terms(always)?,
            per_kelvin: per_kelvin.into_iter().map(terms).collect::<PyResult<_>>()?,
            compliance: terms(compliance)?,
            shared,
            limbs,
        };
        let functions = PyDict::new(py);
        for function in code::functions(&self.inner, &shifts) {
            let parts = (function.arguments, function.body, function.values);
            functions.set_item(function.name, parts)?;
        }
        Ok(functions)
    }

    /// What the program round the formulas reads beside parameters: see the stub file.
    #[getter]
    fn control<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = &self.inner;
        let control = PyDict::new(py);
        control.set_item("home", inner.home.to_coordinates())?;
        control.set_item("dof", inner.dof)?;
        control.set_item("commanded", inner.commanded)?;
        control.set_item("travel", inner.drives.iter().map(|d| d.travel).collect::<Vec<_>>())?;
        let turns = |drive: &truepose_kernel::machine::MachineDrive| {
            drive.kind.table().coordinate == truepose_kernel::element::Dimension::Angle
        };
        control.set_item("turns", inner.drives.iter().map(turns).collect::<Vec<_>>())?;
        control.set_item("scale", inner.drives.iter().map(|d| d.scale).collect::<Vec<_>>())?;
        control.set_item(
            "first_strut",
            inner.drives.iter().map(|d| d.struts[0]).collect::<Vec<_>>(),
        )?;
        control
            .set_item("strut_drive", inner.struts.iter().map(|s| s.drive).collect::<Vec<_>>())?;
        control.set_item("closures", inner.closure_count())?;
        control.set_item("carrying", inner.carrying().collect::<Vec<_>>())?;
        control.set_item(
            "strut_drives",
            inner.drives.iter().map(|d| d.struts.clone()).collect::<Vec<_>>(),
        )?;
        control.set_item("regularity_scale", inner.regularity_scale)?;
        let limits = inner.struts.iter().flat_map(|strut| strut.limits).flatten();
        control.set_item("joint_limits", limits.count())?;
        Ok(control)
    }
}
