//! Elastic closures: their compliance, and the twist that leaves the least elastic energy.

use crate::element::ParameterGradient;
use crate::linear::{CLOSURES, SIX};
use crate::machine::{Machine, indices_of};
use crate::statics::{ClosureMatrix, closure_compliance};
use nalgebra::DMatrix;

/// Closures that carry at all, and the compliance between all closures.
pub struct Structure {
    pub carrying: Vec<usize>,
    pub compliance: ClosureMatrix<f64>,
}

impl Structure {
    pub fn new(machine: &Machine, to_parameters: &[ParameterGradient<f64>; CLOSURES]) -> Self {
        let dependents: Vec<&[(usize, usize)]> = machine
            .parameter_compliance
            .iter()
            .map(|&(parameter, _)| machine.dependents[parameter].as_slice())
            .collect();
        let values: Vec<f64> = machine.parameter_compliance.iter().map(|&(_, c)| c).collect();
        let mut compliance = closure_compliance(to_parameters, &dependents, &values);
        let own = &machine.closure_compliance;
        let carrying: Vec<usize> = machine.carrying().collect();
        for &i in &carrying {
            compliance[i][i] += own[i];
        }
        Structure { carrying, compliance }
    }

    /// The stiffness between some of the closures; `None` where one of them is rigid.
    pub fn stiffness(&self, closures: &[usize]) -> Option<DMatrix<f64>> {
        let size = closures.len();
        let matrix = DMatrix::from_fn(size, size, |i, k| self.compliance[closures[i]][closures[k]]);
        matrix.cholesky().map(|factors| factors.inverse())
    }
}

/// Rows of some closures in the platform's freedoms, rotations in units of the characteristic length.
pub fn scaled_rows(machine: &Machine, rows: &[[f64; SIX]], closures: &[usize]) -> DMatrix<f64> {
    let freedoms = indices_of(&machine.dof);
    DMatrix::from_fn(closures.len(), freedoms.len(), |i, k| {
        rows[closures[i]][freedoms[k]] / unit(machine, freedoms[k])
    })
}

/// What one unit of a scaled freedom is: 1 m, or the angle that moves the characteristic length by 1 m.
pub fn unit(machine: &Machine, freedom: usize) -> f64 {
    if freedom < 3 { 1.0 } else { machine.characteristic_length }
}

/// `(W^T K W)^-1 W^T K`: the twist per unit residual that leaves the least elastic energy. Not finite
/// where the closures are rigid or do not hold the platform.
pub fn spread(
    machine: &Machine,
    rows: &[[f64; SIX]; CLOSURES],
    to_parameters: &[ParameterGradient<f64>; CLOSURES],
) -> [[f64; CLOSURES]; SIX] {
    let mut result = [[0.0; CLOSURES]; SIX];
    let structure = Structure::new(machine, to_parameters);
    let rows = scaled_rows(machine, rows, &structure.carrying);
    let solved = structure.stiffness(&structure.carrying).and_then(|stiffness| {
        let weighted = rows.transpose() * stiffness;
        (&weighted * &rows).cholesky().map(|normal| normal.solve(&weighted))
    });
    for (k, &freedom) in indices_of(&machine.dof).iter().enumerate() {
        for (i, &closure) in structure.carrying.iter().enumerate() {
            result[freedom][closure] =
                solved.as_ref().map_or(f64::NAN, |solved| solved[(k, i)] / unit(machine, freedom));
        }
    }
    result
}
