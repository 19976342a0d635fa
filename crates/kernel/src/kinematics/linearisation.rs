//! Everything of first order at one pose: rows, their inverse, and the gradients of the closures to
//! parameters and joints. By implicit differentiation, never through an iteration.

use super::SINGULAR;
use super::closures::{Limb, Limbs, Sample, guide_closures, held_row, row, tool_point};
use super::elastic::spread;
use super::gradients::strut_gradient;
use crate::element::ParameterGradient;
use crate::linear::{CLOSURES, Order, SIX, factor, factor_pivoting, growth, invert};
use crate::machine::Machine;
use crate::scalar::Real;
use crate::spatial::{Pose, rotation_matrix};

/// A larger growth of rounding errors asks for an order of elimination of the sample's own.
const GROWTH: f64 = 40.0;

/// The closures of one sample (or one group of lanes) to first order: scratch of its caller, filled
/// anew for each.
#[derive(Clone, Debug, Default)]
pub struct Linearisation<S> {
    /// Closure i to the platform's twist: the unit wrench of its force. Held freedoms are zero.
    /// After the closures' come, where there is room, identity rows of the held freedoms.
    pub rows: [[S; SIX]; CLOSURES],
    /// The inverse of `rows`: twist per unit residual. Where there are more closures than freedoms, the
    /// twist that leaves the least elastic energy.
    pub inverse: [[S; CLOSURES]; SIX],
    /// Closure i to its joint.
    pub to_joint: [S; CLOSURES],
    /// Closure i to its parameters, at the slots that [`Machine::dependents`] names.
    pub to_parameters: [ParameterGradient<S>; CLOSURES],
    /// Positive where the rows are proven regular and their order of elimination served.
    pub regular: S,
}

impl<S: Real> Linearisation<S> {
    /// Fills rows and gradients of the struts' closures.
    #[inline(always)]
    fn differentiate_struts<const RINGS: bool>(
        &mut self,
        machine: &Machine,
        p: &[S],
        q: &[S],
        pose: &Pose<S>,
    ) {
        let rotation = rotation_matrix(pose.rotation);
        let (at, tool) = ((&rotation, pose.position), tool_point(machine, p));
        let count = machine.struts.len();
        for i in 0..count {
            let (strut, to_parameters) = (&machine.struts[i], &mut self.to_parameters[i]);
            let (arm, gradient) =
                strut_gradient::<S, RINGS>(machine, strut, (p, q, tool), at, to_parameters);
            self.to_joint[i] = gradient.joint;
            self.rows[i] = row(machine, gradient.centre, arm);
        }
    }

    fn hold(&mut self, machine: &Machine) {
        let count = machine.closure_count();
        for number in 0..machine.held.len().min(CLOSURES - count) {
            self.rows[count + number] = held_row(machine, number);
        }
    }

    /// Fills everything for a plain machine, at a pose that closes the struts; rows are eliminated in the
    /// given order.
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
        self.differentiate_struts::<false>(machine, p, q, pose);
        self.hold(machine);
        let mut determinant = self.eliminate(order);
        for limb in &limbs[..machine.struts.len()] {
            determinant = determinant * (limb.length + limb.length);
        }
        self.regular = proven_regular(machine, limbs, determinant).min(self.regular);
    }

    /// Inverts the first six rows; `regular` is positive where the order served. Returns the determinant.
    #[inline(always)]
    fn eliminate(&mut self, order: &Order) -> S {
        let mut factors = [[S::default(); SIX]; SIX];
        for k in 0..SIX {
            factors[k] = self.rows[order[k]];
        }
        let determinant = factor(&mut factors);
        self.regular = S::splat(GROWTH) - growth(&factors);
        invert(&factors, order, &mut self.inverse);
        determinant
    }
}

impl<S: Real> Linearisation<S> {
    /// One sample of a group.
    pub fn lane(&self, lane: usize) -> Linearisation<f64> {
        Linearisation {
            rows: self.rows.map(|row| row.map(|value| value.lane(lane))),
            inverse: self.inverse.map(|row| row.map(|value| value.lane(lane))),
            to_joint: self.to_joint.map(|value| value.lane(lane)),
            to_parameters: self.to_parameters.map(|gradient| gradient.lane(lane)),
            regular: self.regular.lane(lane),
        }
    }
}

impl Linearisation<f64> {
    /// Fills rows and gradients of all closures of one sample.
    pub fn differentiate(&mut self, machine: &Machine, p: &[f64], q: &[f64], pose: &Pose<f64>) {
        self.differentiate_struts::<true>(machine, p, q, pose);
        let rotation = rotation_matrix(pose.rotation);
        let at = (&rotation, pose.position);
        for (i, closure) in guide_closures(machine, p) {
            closure.gradient(machine, at, &mut self.to_parameters[i]);
            self.rows[i] = closure.row(machine, at).1;
            self.to_joint[i] = 0.0;
        }
        self.hold(machine);
    }

    /// Fills everything of one sample of any machine; whether the rows are regular is not looked at.
    pub fn fill_scalar(&mut self, sample: &Sample<'_>, q: &[f64], pose: &Pose<f64>) {
        let machine = sample.machine;
        self.differentiate(machine, sample.p, q, pose);
        if machine.is_overconstrained() {
            self.inverse = spread(machine, &self.rows, &self.to_parameters);
        } else {
            let mut square = [[0.0; SIX]; SIX];
            square.copy_from_slice(&self.rows[..SIX]);
            self.eliminate(&factor_pivoting(&square).order);
        }
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
pub fn proven_regular<S: Real>(machine: &Machine, limbs: &[Limb<S>], determinant: S) -> S {
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
