//! Everything of first order at one pose: rows, their inverse, and the gradients of the closures to
//! parameters and joints. By implicit differentiation, never through an iteration.

use super::SINGULAR;
use super::closures::{Limbs, held_row, row};
use crate::element::{DRIVE_END, PLACES, fixed_gradient};
use crate::linear::{Matrix6, Order, SIX, factor, growth, invert};
use crate::machine::Machine;
use crate::scalar::Real;
use crate::spatial::{Pose, add, rotate, rotate_back, rotation_matrix};

/// A larger growth of rounding errors asks for an order of elimination of the sample's own.
const GROWTH: f64 = 40.0;

/// The closures of one sample (or one group of lanes) to first order: scratch of its caller, filled
/// anew for each.
#[derive(Clone, Debug, Default)]
pub struct Linearisation<S> {
    /// Closure i to the platform's twist: the unit wrench of its force. Held freedoms are zero.
    pub rows: Matrix6<S>,
    /// The inverse of `rows`: twist per unit residual.
    pub inverse: Matrix6<S>,
    /// Closure i to its joint.
    pub to_joint: [S; SIX],
    /// Closure i to its parameters, at the places that [`Machine::readers`] names.
    pub to_parameters: [[S; PLACES]; SIX],
    /// Positive where the rows are proven regular and their order of elimination served.
    pub regular: S,
}

impl<S: Real> Linearisation<S> {
    /// Fills rows and gradients of all closures, by dual numbers through drive and strut at once.
    #[inline(always)]
    pub fn differentiate(&mut self, machine: &Machine, p: &[S], q: &[S], pose: &Pose<S>) {
        let rotation = rotation_matrix(pose.rotation);
        let tool = [p[machine.tool], p[machine.tool + 1], p[machine.tool + 2]];
        let count = machine.struts.len();
        for i in 0..count {
            let strut = &machine.struts[i];
            let own = &p[strut.first..];
            let base = [own[0], own[1], own[2]];
            let arm = rotate(&rotation, [own[3] - tool[0], own[4] - tool[1], own[5] - tool[2]]);
            let centre = add(arm, pose.position);
            let length = match strut.own_length {
                Some(index) => p[index],
                None => S::default(),
            };
            let places = &mut self.to_parameters[i];
            let gradient = match strut.drive {
                None => fixed_gradient([base, centre], length, places),
                Some(index) => {
                    let drive = &machine.drives[index];
                    let parameters = &p[drive.first..];
                    let (frame, joint) = (&drive.frame, q[index]);
                    drive.kind.gradient(frame, parameters, joint, [base, centre], length, places)
                }
            };
            let platform = rotate_back(&rotation, gradient.centre);
            for k in 0..3 {
                places[3 + k] = platform[k];
                places[DRIVE_END + k] = -platform[k];
            }
            self.to_joint[i] = gradient.joint;
            self.rows[i] = row(machine, gradient.centre, arm);
        }
        for number in 0..machine.held.len() {
            self.rows[count + number] = held_row(machine, number);
        }
    }

    /// Fills everything, at a pose that closes the struts; rows are eliminated in the given order.
    #[inline(always)]
    pub fn fill(
        &mut self,
        machine: &Machine,
        p: &[S],
        q: &[S],
        limbs: &Limbs<S>,
        pose: &Pose<S>,
        order: &Order,
    ) {
        self.differentiate(machine, p, q, pose);
        let mut factors = [[S::default(); SIX]; SIX];
        for k in 0..SIX {
            factors[k] = self.rows[order[k]];
        }
        let mut determinant = factor(&mut factors);
        for limb in &limbs[..machine.struts.len()] {
            determinant = determinant * (limb.length + limb.length);
        }
        let stable = S::splat(GROWTH) - growth(&factors);
        self.regular = proven_regular(machine, limbs, determinant).min(stable);
        invert(&factors, order, &mut self.inverse);
    }
}

/// Positive where the rows are certainly regular: a lower bound of smallest over largest singular
/// value of the scaled rows is above twice [`SINGULAR`]. Not positive proves nothing.
///
/// With n unit wrenches W (rotation columns divided by the characteristic length l), Frobenius norm
/// F and determinant D, the smallest singular value is at least |D| ((n-1) / F^2)^((n-1)/2), since the
/// others' squares have a sum of at most F^2 (arithmetic and geometric mean), and the largest is at
/// most F; F^2 is at most n + sum |arm|^2 / l^2. `determinant` is that of the squared rows, W times
/// twice the strut lengths. The factor of two covers that it may belong to the last but one iterate.
#[inline(always)]
pub fn proven_regular<S: Real>(machine: &Machine, limbs: &Limbs<S>, determinant: S) -> S {
    let count = machine.struts.len();
    let l = machine.characteristic_length;
    let mut arms = S::splat(0.0);
    let mut lengths = S::splat(2.0 * SINGULAR * machine.regularity_scale);
    let mut shortest = limbs[0].length;
    for limb in &limbs[..count] {
        for k in 0..3 {
            arms = limb.arm[k].mul_add(limb.arm[k], arms);
        }
        lengths = lengths * limb.length;
        shortest = shortest.min(limb.length);
    }
    let frobenius2 = arms.mul_add(S::splat(1.0 / (l * l)), S::splat(count as f64));
    let mut asked = lengths;
    for _ in 0..count / 2 {
        asked = asked * frobenius2;
    }
    if count % 2 == 1 {
        asked = asked * frobenius2.sqrt();
    }
    (determinant.abs() - asked).min(shortest)
}
