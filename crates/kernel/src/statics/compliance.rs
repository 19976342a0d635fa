//! Compliance and stiffness of the platform from the compliance of parameters.
//!
//! A parameter of compliance c under load Q moves by c Q; the closures move by
//! `C_g = G diag(c) G^T` per unit force, and the platform by `W^-1 C_g W^-T`.

use crate::element::ParameterGradient;
use crate::linear::{CLOSURES, Matrix6, SIX};
use crate::scalar::Real;
use nalgebra::DMatrix;

/// Closures by closures.
pub type ClosureMatrix<S> = [[S; CLOSURES]; CLOSURES];

/// How many closures a machine may have on a path: lanes run machines of at most six.
#[inline(always)]
pub const fn most_closures<S: Real>() -> usize {
    if S::WIDTH > 1 { SIX } else { CLOSURES }
}

/// `G diag(c) G^T`: how far closures open per unit force in closures. `dependents[j]` lists the
/// (closure, slot) pairs that read the parameter of compliance `compliances[j]`.
#[inline(always)]
pub fn closure_compliance<S: Real>(
    to_parameters: &[ParameterGradient<S>; CLOSURES],
    dependents: &[&[(usize, usize)]],
    compliances: &[S],
) -> ClosureMatrix<S> {
    let mut matrix = [[S::default(); CLOSURES]; CLOSURES];
    for (dependents, &compliance) in dependents.iter().zip(compliances) {
        for &(i, slot) in *dependents {
            let scaled = to_parameters[i][slot] * compliance;
            for &(k, other) in *dependents {
                matrix[i][k] = scaled.mul_add(to_parameters[k][other], matrix[i][k]);
            }
        }
    }
    matrix
}

/// Adds what two parameters of these (closure, slot) pairs give way under each other's load.
#[inline(always)]
pub fn add_shared<S: Real>(
    to_parameters: &[ParameterGradient<S>; CLOSURES],
    [one, other]: [&[(usize, usize)]; 2],
    compliance: S,
    matrix: &mut ClosureMatrix<S>,
) {
    for &(i, slot) in one {
        let scaled = to_parameters[i][slot] * compliance;
        for &(k, slot) in other {
            let shared = scaled * to_parameters[k][slot];
            matrix[i][k] = matrix[i][k] + shared;
            matrix[k][i] = matrix[k][i] + shared;
        }
    }
}

/// `W^-1 C_g W^-T`: twist of the platform per unit wrench on the tool, with the
/// twist per unit residual, `W^-1`.
#[inline(always)]
pub fn pose_compliance<S: Real>(
    inverse: &[[S; CLOSURES]; SIX],
    closures: &ClosureMatrix<S>,
) -> Matrix6<S> {
    let mut half = [[S::default(); CLOSURES]; SIX];
    let mut whole = [[S::default(); SIX]; SIX];
    for i in 0..SIX {
        for j in 0..most_closures::<S>() {
            for k in 0..most_closures::<S>() {
                half[i][j] = inverse[i][k].mul_add(closures[k][j], half[i][j]);
            }
        }
    }
    for i in 0..SIX {
        for j in 0..SIX {
            for k in 0..most_closures::<S>() {
                whole[i][j] = half[i][k].mul_add(inverse[j][k], whole[i][j]);
            }
        }
    }
    whole
}

/// `W^T C_g^-1 W`: wrench on the tool per unit twist; also at a singular pose. `None` where some
/// closure is rigid. Only the first `count` closures count.
pub fn pose_stiffness(
    rows: &[[f64; SIX]],
    closures: &ClosureMatrix<f64>,
    count: usize,
) -> Option<Matrix6<f64>> {
    let compliance = DMatrix::from_fn(count, count, |i, k| closures[i][k]);
    let inverse = compliance.try_inverse()?;
    if inverse.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let rows = DMatrix::from_fn(count, SIX, |i, k| rows[i][k]);
    let stiffness = rows.transpose() * inverse * rows;
    Some(std::array::from_fn(|i| std::array::from_fn(|k| stiffness[(i, k)])))
}
