//! Laws: how a number follows from a pose.

use crate::given::Given;
use crate::reply::Answer;
use truepose_kernel::Machine;

/// A constant and a slope along the length of a strut.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    /// Its value at no length.
    pub constant: f64,
    /// Its change by a metre.
    pub slope: f64,
    /// Which strut's length.
    pub strut: usize,
}

impl Law {
    /// Its value where the struts are so long.
    pub fn at(&self, lengths: &[f64]) -> f64 {
        if self.slope == 0.0 {
            self.constant
        } else {
            self.constant + self.slope * lengths[self.strut]
        }
    }

    /// From `[constant, slope, strut or null]`.
    pub fn read(given: &Given<'_>, machine: &Machine) -> Answer<Law> {
        Self::of(given, &given.list()?, machine)
    }

    fn of(given: &Given<'_>, parts: &[Given<'_>], machine: &Machine) -> Answer<Law> {
        let [constant, slope, strut] = parts else {
            return given.refuse("a law is a constant, a slope, and a strut or null");
        };
        let law = Law {
            constant: constant.number()?,
            slope: slope.number()?,
            strut: if strut.value.is_null() {
                0
            } else {
                strut.below(machine.struts.len(), "strut")?
            },
        };
        if law.slope != 0.0 && strut.value.is_null() {
            return given.refuse("a law with a slope names its strut");
        }
        Ok(law)
    }
}

/// A parameter that follows a law.
#[derive(Clone, Copy, Debug)]
pub struct Term {
    /// Which parameter.
    pub parameter: usize,
    /// Its law.
    pub law: Law,
}

impl Term {
    /// From `[parameter, constant, slope, strut or null]`.
    pub fn read(given: &Given<'_>, machine: &Machine) -> Answer<Term> {
        let parts = given.list()?;
        let [parameter, law @ ..] = parts.as_slice() else {
            return given.refuse("a term is a parameter and its law");
        };
        let parameter = parameter.below(machine.nominal.len(), "parameter")?;
        Ok(Term { parameter, law: Law::of(given, law, machine)? })
    }

    /// A list of them.
    pub fn list(given: &[Given<'_>], machine: &Machine) -> Answer<Vec<Term>> {
        given.iter().map(|term| Term::read(term, machine)).collect()
    }
}
