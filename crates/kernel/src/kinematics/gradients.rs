//! All closures of any machine with their first derivatives, on any scalar: what proofs and printed code
//! run on. [`super::Linearisation`] is the same on lanes, for speed.

use super::closures::{Limb, guide_limb, ring_arm};
use crate::element::{DRIVE_END, PLACES, RING, fixed_gradient};
use crate::linear::SIX;
use crate::machine::Machine;
use crate::scalar::Scalar;
use crate::spatial::{
    RotationMatrix, Vector, add, cross, dot, norm, rotate, rotate_back, subtract,
};

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
    to_parameters: [[S; PLACES]; N],
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
        to_parameters: [[zero; PLACES]; N],
    };
    let tool = [p[machine.tool], p[machine.tool + 1], p[machine.tool + 2]];
    for (i, strut) in machine.struts.iter().enumerate() {
        let own = &p[strut.first..];
        let base = [own[0], own[1], own[2]];
        let platform = subtract([own[3], own[4], own[5]], tool);
        let mut arm = rotate(rotation, platform);
        let mut radial = arm;
        if let Some(ring) = &strut.ring {
            let limb = Limb { base, arm: platform, length: zero };
            (arm, radial) = ring_arm(ring, p[ring.radius], &limb, rotation, position);
        }
        let centre = add(arm, position);
        let length = strut.own_length.map_or(zero, |index| p[index]);
        let slots = &mut result.to_parameters[i];
        let (gradient, joint_centre, length) = match strut.drive {
            None => (fixed_gradient([base, centre], length, slots), base, length),
            Some(index) => {
                let drive = &machine.drives[index];
                let parameters = &p[drive.first..];
                let (nominal, joint) = (&drive.nominal, q[index]);
                let points = [base, centre];
                let gradient =
                    drive.kind.gradient(nominal, parameters, joint, points, length, slots);
                let (at, length) = drive.kind.place(nominal, parameters, joint, base, length);
                (gradient, at, length)
            }
        };
        let to_platform = rotate_back(rotation, gradient.centre);
        for k in 0..3 {
            slots[3 + k] = to_platform[k];
            slots[DRIVE_END + k] = -to_platform[k];
        }
        if strut.ring.is_some() {
            slots[RING] = dot(gradient.centre, radial);
        }
        result.to_joint[i] = gradient.joint;
        result.residuals[i] = norm(subtract(centre, joint_centre)) - length;
        let moment = cross(arm, gradient.centre);
        result.to_twist[i][..3].copy_from_slice(&gradient.centre);
        result.to_twist[i][3..].copy_from_slice(&moment);
    }
    for (number, &(guide, which)) in machine.guide_closures.iter().enumerate() {
        let i = machine.struts.len() + number;
        let guide = &machine.guides[guide];
        let limb = guide_limb(guide, p, tool);
        let placed = (rotation, position);
        let length = machine.characteristic_length;
        let slots = &mut result.to_parameters[i];
        guide.kind.gradient(which, &guide.frames, &limb, placed, length, slots);
        (result.residuals[i], result.to_twist[i]) =
            guide.kind.row(which, &guide.frames, &limb, placed, length);
    }
    for row in &mut result.to_twist[..machine.closure_count()] {
        for &freedom in &machine.held {
            row[freedom] = zero;
        }
    }
    result
}
