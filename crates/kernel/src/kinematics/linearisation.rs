//! Everything of first order at one pose: rows, their inverse, and the gradients of the closures to
//! parameters and joints. By implicit differentiation, never through an iteration.

use super::closures::{Limbs, hold, row};
use super::SINGULAR;
use crate::element::{ClosureGradient, MAX_DRIVE_PARAMETERS, fixed_gradient};
use crate::linear::{Factored, Matrix6, SIX, factor, invert};
use crate::machine::Machine;
use crate::scalar::Real;
use crate::spatial::{Pose, RotationMatrix, add, rotate, rotate_back, rotation_matrix};

/// The closures of one sample (or one group of lanes) to first order.
pub struct Linearisation<S> {
    /// Closure i to the platform's twist: the unit wrench of its force. Held freedoms are zero.
    pub rows: Matrix6<S>,
    /// The inverse of `rows`: twist per unit residual.
    pub inverse: Matrix6<S>,
    /// Closure i to its joint.
    pub to_joint: [S; SIX],
    /// Closure i to its parameters, at the places that [`touched`] names.
    pub to_parameters: [[S; PLACES]; SIX],
    /// Positive where the rows are proven regular.
    pub regular: S,
}

const DRIVE_END: usize = 7 + MAX_DRIVE_PARAMETERS;
/// Places of one closure's gradient: base, platform, length, the drive's parameters, tool.
pub const PLACES: usize = DRIVE_END + 3;

/// The parameters that closure `i` reads: (place in its gradient, parameter).
pub fn touched(machine: &Machine, i: usize) -> Vec<(usize, usize)> {
    let strut = &machine.struts[i];
    let mut places: Vec<(usize, usize)> = (0..6).map(|k| (k, strut.first + k)).collect();
    places.extend(strut.own_length.map(|index| (6, index)));
    if let Some(drive) = strut.drive {
        let drive = &machine.drives[drive];
        places.extend((0..drive.kind.table().parameters.len()).map(|k| (7 + k, drive.first + k)));
    }
    places.extend((0..3).map(|k| (DRIVE_END + k, machine.tool + k)));
    places
}

/// Rows and gradients of all closures, by dual numbers through drive and strut at once.
#[inline(always)]
pub fn gradients<S: Real>(
    machine: &Machine,
    p: &[S],
    q: &[S],
    pose: &Pose<S>,
) -> (Matrix6<S>, [ClosureGradient<S>; SIX], RotationMatrix<S>) {
    let rotation = rotation_matrix(pose.rotation);
    let zero = S::splat(0.0);
    let none = fixed_gradient([zero; 3], [S::splat(1.0); 3], zero);
    let mut gradients = [none; SIX];
    let mut rows = [[zero; SIX]; SIX];
    let tool = [p[machine.tool], p[machine.tool + 1], p[machine.tool + 2]];
    for i in 0..machine.struts.len() {
        let strut = &machine.struts[i];
        let own = &p[strut.first..];
        let base = [own[0], own[1], own[2]];
        let arm = rotate(&rotation, [own[3] - tool[0], own[4] - tool[1], own[5] - tool[2]]);
        let centre = add(arm, pose.position);
        let length = match strut.own_length {
            Some(index) => p[index],
            None => zero,
        };
        gradients[i] = match strut.drive {
            None => fixed_gradient(base, centre, length),
            Some(index) => {
                let drive = &machine.drives[index];
                drive.kind.gradient(&drive.frame, &p[drive.first..], q[index], base, length, centre)
            }
        };
        rows[i] = row(gradients[i].centre, arm);
    }
    hold(machine, &mut rows);
    (rows, gradients, rotation)
}

/// Positive where the rows are certainly regular: a lower bound of smallest over largest singular
/// value of the scaled rows is above twice [`SINGULAR`]. Not positive proves nothing.
///
/// With n unit wrenches W (rotation columns divided by the characteristic length l), Frobenius norm
/// F and determinant D, the smallest singular value is at least |D| ((n-1) / F^2)^((n-1)/2), since the
/// others' squares have a sum of at most F^2 (arithmetic and geometric mean), and the largest is at
/// most F; F^2 is at most n + sum |arm|^2 / l^2. `determinant` is that of the squared rows, W times the strut lengths.
/// The factor of two covers that it may belong to the last but one iterate.
#[inline(always)]
pub fn proven_regular<S: Real>(machine: &Machine, limbs: &Limbs<S>, determinant: S) -> S {
    let count = machine.struts.len();
    let l = machine.characteristic_length;
    let mut arms = S::splat(0.0);
    let mut lengths = S::splat(1.0);
    let mut shortest = limbs[0].length;
    for limb in &limbs[..count] {
        for k in 0..3 {
            arms = limb.arm[k].mul_add(limb.arm[k], arms);
        }
        lengths = lengths * limb.length;
        shortest = shortest.min(limb.length);
    }
    let n = count as f64;
    let rotations = machine.dof[3..].iter().filter(|&&free| free).count() as i32;
    let frobenius2 = arms.mul_add(S::splat(1.0 / (l * l)), S::splat(n));
    let mut power = S::splat(1.0);
    for _ in 0..count / 2 {
        power = power * frobenius2;
    }
    if count % 2 == 1 {
        power = power * frobenius2.sqrt();
    }
    let gained = S::splat((n - 1.0).max(1.0).powf(0.5 * (n - 1.0)));
    let asked = S::splat(2.0 * SINGULAR * l.powi(rotations)) * lengths.abs() * power;
    (determinant.abs() * gained - asked).min(shortest)
}

/// The first-order picture at a pose that closes the struts, rows eliminated in the given order.
#[inline(always)]
pub fn linearise<S: Real>(
    machine: &Machine,
    p: &[S],
    q: &[S],
    limbs: &Limbs<S>,
    pose: &Pose<S>,
    order: &[usize; SIX],
) -> Linearisation<S> {
    let (rows, gradients, rotation) = gradients(machine, p, q, pose);
    let factored: Factored<S> = factor(&rows, order);
    let mut lengths = S::splat(1.0);
    for limb in &limbs[..machine.struts.len()] {
        lengths = lengths * limb.length;
    }
    let regular = proven_regular(machine, limbs, factored.pivot_product * lengths);
    let mut to_joint = [S::default(); SIX];
    let mut to_parameters = [[S::default(); PLACES]; SIX];
    for i in 0..machine.struts.len() {
        let gradient = &gradients[i];
        let platform = rotate_back(&rotation, gradient.centre);
        let own = &mut to_parameters[i];
        own[..3].copy_from_slice(&gradient.base);
        own[3..6].copy_from_slice(&platform);
        own[6] = gradient.length;
        own[7..DRIVE_END].copy_from_slice(&gradient.drive);
        for k in 0..3 {
            own[DRIVE_END + k] = -platform[k];
        }
        to_joint[i] = gradient.joint;
    }
    Linearisation { rows, inverse: invert(&factored), to_joint, to_parameters, regular }
}
