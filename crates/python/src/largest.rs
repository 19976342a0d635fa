//! Largest lengths of sets of errors, as a function of the module.

use crate::arrays::{Array, Input, filled};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use truepose_kernel::largest::{Domain, Largest, NUMBERS, largest_of};

/// The largest lengths of n errors `centre` (n, m) + `effects` (n, m, v) t over t (v,): (n, q, 5) numbers,
/// the length from above, one that is reached, and the unit vector along which it is.
///
/// t lies between `middle` - `half` and `middle` + `half` (v,), but for the variables of `directions`,
/// which are together a unit vector. `quantities`: the components (at most three) of each length.
#[pyfunction]
pub fn largest<'py>(
    py: Python<'py>,
    centre: &Bound<'py, PyAny>,
    effects: &Bound<'py, PyAny>,
    middle: Vec<f64>,
    half: Vec<f64>,
    directions: Vec<Vec<usize>>,
    quantities: Vec<Vec<usize>>,
) -> PyResult<Array<'py>> {
    let variables = half.len();
    let components = centre.getattr("shape")?.get_item(1)?.extract::<usize>()?;
    let centre = Input::new(centre, &[components], "centre")?;
    let effects = Input::new(effects, &[variables], "effects")?;
    let count = centre.count;
    let known = |numbers: &[Vec<usize>], limit: usize| {
        numbers
            .iter()
            .all(|members| members.len() <= 3 && members.iter().all(|&member| member < limit))
    };
    if effects.count != count * components
        || middle.len() != variables
        || !known(&directions, variables)
        || !known(&quantities, components)
    {
        return Err(PyValueError::new_err("the arguments do not fit each other"));
    }
    let domain = Domain { middle, half, directions };
    let of = Largest {
        centre: centre.data(),
        effects: effects.data(),
        components,
        domain: &domain,
        quantities: &quantities,
    };
    let mut numbers = vec![0.0; count * quantities.len() * NUMBERS];
    py.detach(|| largest_of(count, &of, &mut numbers));
    filled(py, &[count], &[quantities.len(), NUMBERS], &numbers)
}
