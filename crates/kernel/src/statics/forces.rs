//! Closure forces under a wrench on the tool.

use crate::element::ParameterGradient;
use crate::linear::{CLOSURES, SIX};
use crate::scalar::Real;
use crate::statics::most_closures;

/// The multipliers of `W^T lambda + F = 0` for a wrench `F` on the tool at the tool point, base axes
/// (N, N m), with the twist per unit residual, `W^-1`. A strut's tension is minus its multiplier.
#[inline(always)]
pub fn closure_forces<S: Real>(inverse: &[[S; CLOSURES]; SIX], wrench: &[S; SIX]) -> [S; CLOSURES] {
    let mut multipliers = [S::default(); CLOSURES];
    for i in 0..most_closures::<S>() {
        let mut sum = S::default();
        for k in 0..SIX {
            sum = inverse[k][i].mul_add(wrench[k], sum);
        }
        multipliers[i] = -sum;
    }
    multipliers
}

/// The load on a parameter by virtual work, `lambda . dg/dp`, over the closures that read it at the
/// given (closure, slot): positive drives the parameter up. For a strut's length it is the tension.
#[inline(always)]
pub fn parameter_load<S: Real>(
    multipliers: &[S; CLOSURES],
    to_parameters: &[ParameterGradient<S>; CLOSURES],
    dependents: &[(usize, usize)],
) -> S {
    let mut load = S::default();
    for &(closure, slot) in dependents {
        load = multipliers[closure].mul_add(to_parameters[closure][slot], load);
    }
    load
}
