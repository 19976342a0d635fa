//! Compliance and stiffness of the platform from the compliance of parameters.
//!
//! A parameter of compliance c under load Q moves by c Q; the closures move by
//! `C_g = G diag(c) G^T` per unit force, and the platform by `W^-1 C_g W^-T`.

use crate::kinematics::Linearisation;
use crate::linear::{Matrix6, SIX, inverse_of};
use crate::scalar::Real;

/// `G diag(c) G^T`: how far closures open per unit force in closures. `readers[j]` lists the
/// (closure, place) pairs that read the parameter of compliance `compliances[j]`.
#[inline(always)]
pub fn closure_compliance<S: Real>(
    linear: &Linearisation<S>,
    readers: &[&[(usize, usize)]],
    compliances: &[S],
) -> Matrix6<S> {
    let mut matrix = [[S::default(); SIX]; SIX];
    for (readers, &compliance) in readers.iter().zip(compliances) {
        for &(i, place) in *readers {
            let scaled = linear.to_parameters[i][place] * compliance;
            for &(k, other) in *readers {
                matrix[i][k] = scaled.mul_add(linear.to_parameters[k][other], matrix[i][k]);
            }
        }
    }
    matrix
}

/// `W^-1 C_g W^-T`: twist of the platform per unit wrench on the tool.
#[inline(always)]
pub fn pose_compliance<S: Real>(linear: &Linearisation<S>, closures: &Matrix6<S>) -> Matrix6<S> {
    congruence(&linear.inverse, closures)
}

/// `W^T C_g^-1 W`: wrench on the tool per unit twist; also at a singular pose. `None` where some
/// closure is rigid. Only the first `count` closures count.
pub fn pose_stiffness(
    rows: &Matrix6<f64>,
    closures: &Matrix6<f64>,
    count: usize,
) -> Option<Matrix6<f64>> {
    let mut padded = *closures;
    for i in count..SIX {
        padded[i] = [0.0; SIX];
        padded[i][i] = 1.0;
    }
    let inverse = inverse_of(&padded);
    if inverse.iter().flatten().any(|value| !value.is_finite()) {
        return None;
    }
    let mut transposed = [[0.0; SIX]; SIX];
    for i in 0..count {
        for k in 0..SIX {
            transposed[k][i] = rows[i][k];
        }
    }
    Some(congruence(&transposed, &inverse))
}

/// `A M A^T`.
#[inline(always)]
fn congruence<S: Real>(a: &Matrix6<S>, m: &Matrix6<S>) -> Matrix6<S> {
    let mut half = [[S::default(); SIX]; SIX];
    let mut whole = half;
    for i in 0..SIX {
        for j in 0..SIX {
            for k in 0..SIX {
                half[i][j] = a[i][k].mul_add(m[k][j], half[i][j]);
            }
        }
    }
    for i in 0..SIX {
        for j in 0..SIX {
            for k in 0..SIX {
                whole[i][j] = half[i][k].mul_add(a[j][k], whole[i][j]);
            }
        }
    }
    whole
}
