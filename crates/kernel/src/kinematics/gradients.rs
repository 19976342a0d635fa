//! All closures of any machine with their first derivatives, on any scalar: what proofs and printed code
//! run on. [`super::Linearisation`] is the same on lanes, for speed.

use super::closures::{Limb, guide_closures, ring_arm, row, tool_point};
use crate::element::{ClosureGradient, ParameterGradient, fixed_gradient};
use crate::linear::SIX;
use crate::machine::{Machine, Strut};
use crate::scalar::Scalar;
use crate::spatial::{RotationMatrix, Vector, add, dot, norm, rotate, rotate_back, subtract};

/// The first derivatives of one strut's closure, by dual numbers through drive and strut at once: fills
/// those to the parameters, and returns the platform-side joint's arm from the tool point (base axes) and
/// the others. Without `RINGS` no ring is looked for.
#[inline(always)]
pub fn strut_gradient<S: Scalar, const RINGS: bool>(
    machine: &Machine,
    strut: &Strut,
    (p, q, tool): (&[S], &[S], Vector<S>),
    (rotation, position): (&RotationMatrix<S>, Vector<S>),
    to_parameters: &mut ParameterGradient<S>,
) -> (Vector<S>, ClosureGradient<S>) {
    let limb = Limb::undriven(strut, p, tool);
    let mut arm = rotate(rotation, limb.arm);
    let mut radial = arm;
    let ring = if RINGS { strut.ring.as_ref() } else { None };
    if let Some(ring) = ring {
        (arm, radial) = ring_arm(ring, p[ring.radius], &limb, rotation, position);
    }
    let (points, length) = ([limb.base, add(arm, position)], limb.length);
    let gradient = match strut.drive {
        None => fixed_gradient(points, length, to_parameters),
        Some(index) => {
            let drive = &machine.drives[index];
            let (nominal, parameters) = (&drive.nominal, &p[drive.first..]);
            drive.kind.gradient(nominal, parameters, q[index], points, length, to_parameters)
        }
    };
    if let Some(carriage) = strut.carriage {
        let own = &p[strut.first..];
        let turn = &p[carriage + 3..];
        to_parameters.set_carriage([own[0], own[1], own[2]], [turn[0], turn[1], turn[2]]);
    }
    to_parameters.set_platform(rotate_back(rotation, gradient.centre));
    if ring.is_some() {
        to_parameters.set_ring_radius(dot(gradient.centre, radial));
    }
    (arm, gradient)
}

/// Residuals and derivatives of at most `N` closures; zero beyond the machine's.
#[derive(Clone, Debug)]
pub struct Gradients<S, const N: usize> {
    /// Residuals, m.
    pub residuals: [S; N],
    /// To the platform's twist: unit wrenches, N per N and N m per N.
    pub to_twist: [[S; SIX]; N],
    /// To the joint coordinate of each closure's drive.
    pub to_joint: [S; N],
    /// To the parameters, at the slots that [`Machine::dependents`] names.
    to_parameters: [ParameterGradient<S>; N],
}

impl<S: Scalar, const N: usize> Gradients<S, N> {
    /// Derivatives of all closures to one parameter.
    pub fn to_parameter(&self, machine: &Machine, parameter: usize) -> [S; N] {
        let mut column = [self.residuals[0].lift(0.0); N];
        for &(closure, slot) in &machine.dependents[parameter] {
            column[closure] = self.to_parameters[closure][slot];
        }
        column
    }
}

/// How far a strut's closure is open: the distance between its joints less its length.
#[inline(always)]
fn opening<S: Scalar>(limb: &Limb<S>, arm: Vector<S>, position: Vector<S>) -> S {
    norm(subtract(add(arm, position), limb.base)) - limb.length
}

/// Everything for parameters `p`, joints `q` and a platform at `position` with axes `rotation`.
pub fn gradients<S: Scalar, const N: usize>(
    machine: &Machine,
    p: &[S],
    q: &[S],
    position: Vector<S>,
    rotation: &RotationMatrix<S>,
) -> Gradients<S, N> {
    let zero = position[0].lift(0.0);
    let mut result = Gradients {
        residuals: [zero; N],
        to_twist: [[zero; SIX]; N],
        to_joint: [zero; N],
        to_parameters: [ParameterGradient::zero(zero); N],
    };
    let (at, tool) = ((rotation, position), tool_point(machine, p));
    for (i, strut) in machine.struts.iter().enumerate() {
        let to_parameters = &mut result.to_parameters[i];
        let (arm, gradient) =
            strut_gradient::<S, true>(machine, strut, (p, q, tool), at, to_parameters);
        let limb = Limb::placed(machine, strut, p, q, tool);
        result.residuals[i] = opening(&limb, arm, position);
        result.to_joint[i] = gradient.joint;
        result.to_twist[i] = row(machine, gradient.centre, arm);
    }
    for (i, closure) in guide_closures(machine, p) {
        closure.gradient(machine, at, &mut result.to_parameters[i]);
        (result.residuals[i], result.to_twist[i]) = closure.row(machine, at);
    }
    result
}

/// Residuals alone, of at most `N` closures; zero beyond the machine's.
pub fn residuals<S: Scalar, const N: usize>(
    machine: &Machine,
    p: &[S],
    q: &[S],
    position: Vector<S>,
    rotation: &RotationMatrix<S>,
) -> [S; N] {
    let mut result = [position[0].lift(0.0); N];
    let tool = tool_point(machine, p);
    for (i, strut) in machine.struts.iter().enumerate() {
        let limb = Limb::placed(machine, strut, p, q, tool);
        result[i] = opening(&limb, limb.turned_arm(strut, p, rotation, position), position);
    }
    for (i, closure) in guide_closures(machine, p) {
        result[i] = closure.row(machine, (rotation, position)).0;
    }
    result
}
