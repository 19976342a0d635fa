//! The nominal command over a box of poses, and how it changes with the pose.
//!
//! Everything is an enclosure over all poses of the box, proved to exist first.

use super::at_pose::placed;
use super::closures::{Derivatives, Placed, Six, Square, derivatives, moved as displaced, turned};
use super::region::Region;
use super::root::{Inverse, Varying, prove};
use super::{Unproven, point};
use crate::linear::SIX;
use crate::machine::{Machine, indices_of};
use crate::scalar::{Interval, Scalar};
use crate::spatial::{Pose, RotationMatrix, Vector, add, cross, dot, rotate};

/// The nominal command over a box of poses.
pub struct Command {
    pub joints: Vec<Interval>,
    pub at: Placed,
    /// What the platform and the joints do per unit of each commanded freedom: twist, joint rates.
    pub rates: Vec<(Six, Vec<Interval>)>,
}

impl Region<'_> {
    /// The commanded pose on intervals, the freedoms that are not commanded as in `solved`.
    fn place(&self, sides: &[[f64; 2]], solved: &Pose<f64>) -> Placed {
        let [x, y, z, angles @ ..] = self.coordinates(sides, solved);
        let mut result = placed(solved);
        result.position = [x, y, z];
        if self.machine.commanded[3..].contains(&true) {
            result.rotation = euler_matrix(angles);
        }
        result
    }

    /// Coordinates of the commanded pose, those that are not commanded as in `solved`.
    pub fn coordinates(&self, sides: &[[f64; 2]], solved: &Pose<f64>) -> Six {
        let mut coordinates = solved.to_coordinates().map(point);
        for (&freedom, &[low, high]) in indices_of(&self.machine.commanded).iter().zip(sides) {
            coordinates[freedom] = Interval::new(low, high);
        }
        coordinates
    }

    /// Which freedoms follow from the others, as places of a displacement.
    fn parasitic(&self) -> Vec<usize> {
        (0..SIX).filter(|&k| self.machine.dof[k] && !self.machine.commanded[k]).collect()
    }

    /// The commanded freedoms, in whose places of a displacement the joints stand.
    pub fn slots(&self) -> Vec<usize> {
        let machine = self.machine;
        (0..SIX).filter(|&k| machine.dof[k] && machine.commanded[k]).collect()
    }

    /// Six unknowns as the displacement of the parasitic freedoms, and the joints.
    pub fn split<S: Scalar>(&self, z: &Six<S>) -> (Six<S>, Vec<S>) {
        let mut moved = [z[0].lift(0.0); SIX];
        for k in self.parasitic() {
            moved[k] = z[k];
        }
        (moved, self.slots().into_iter().map(|slot| z[slot]).collect())
    }

    /// Derivatives to the unknowns: the parasitic freedoms, and in the places of the commanded ones the
    /// joints.
    pub fn unknowns<S: Scalar>(&self, at: &Derivatives<S>) -> Square<S> {
        let mut matrix = at.to_displacement;
        let zero = matrix[0][0].lift(0.0);
        for (joint, slot) in self.slots().into_iter().enumerate() {
            for (i, row) in matrix.iter_mut().enumerate() {
                row[slot] = if self.drives(joint, i) { at.closures.to_joint[i] } else { zero };
            }
        }
        matrix
    }

    /// The nominal command over a box of poses. `sides` are the box's, `solved` the pose in its middle.
    pub fn command(
        &self,
        sides: &[[f64; 2]],
        solved: &Pose<f64>,
        joints: &[f64],
    ) -> Result<Command, Unproven> {
        let machine = self.machine;
        let at = self.place(sides, solved);
        let parasitic = self.parasitic();
        let slots = self.slots();
        let p: Vec<Interval> = machine.nominal.iter().map(|&value| point(value)).collect();
        let mut middle = [0.0; SIX];
        for (&slot, &joint) in slots.iter().zip(joints) {
            middle[slot] = joint;
        }
        let jacobian = |z: &Six| {
            let (moved, q) = self.split(z);
            self.unknowns(&derivatives(machine, &p, &q, &at, &moved))
        };
        let (moved, q) = self.split(&middle.map(point));
        let spot: Vec<[f64; 2]> = sides.iter().map(|[a, b]| [0.5 * (a + b); 2]).collect();
        let exact =
            derivatives(machine, &p, &q, &self.place(&spot, solved), &moved).closures.residuals;
        let spread = derivatives(machine, &p, &q, &at, &moved);
        let axes = self.axes(sides, solved);
        let mut varying: Vec<Varying> = Vec::with_capacity(slots.len());
        for (&slot, (side, middle)) in slots.iter().zip(sides.iter().zip(&spot)) {
            let mut twist = [point(0.0); SIX];
            if slot < 3 {
                twist[slot] = point(1.0);
            } else {
                twist[3..].copy_from_slice(&axes[slot - 3]);
            }
            let extent = Interval::new(side[0], side[1]) - point(middle[0]);
            varying.push((pull(machine, &spread, &twist), extent));
        }
        let first = self.unknowns(&spread);
        let root = prove(&middle, &exact, &varying, &first, jacobian)?;
        let (moved, q) = self.split(&root.enclosure);
        let over = derivatives(machine, &p, &q, &at, &moved);
        let inverse = Inverse::of(&self.unknowns(&over)).ok_or(Unproven::TooWide)?;
        let length = point(machine.characteristic_length);
        let [x, y, z, a, b, c] = moved;
        let cayley = [a, b, c].map(|value| value / length);
        let rates = slots
            .iter()
            .map(|&slot| {
                let mut twist = [point(0.0); SIX];
                if slot < 3 {
                    twist[slot] = point(1.0);
                } else {
                    let axis = rotate(&turned(cayley), axes[slot - 3]);
                    twist[3..].copy_from_slice(&axis);
                }
                let opened = pull(machine, &over, &twist);
                let (own, rates) = self.split(&inverse.times(&opened).map(|value| -value));
                for k in 0..3 {
                    twist[k] = twist[k] + own[k];
                }
                // The differential of a Cayley vector as a rotation.
                let turn = rotation_of([a, b, c].map(|v| v / length), [own[3], own[4], own[5]]);
                for k in 0..3 {
                    twist[3 + k] = twist[3 + k] + turn[k] / length;
                }
                (twist, rates)
            })
            .collect();
        let at = if parasitic.is_empty() { at } else { displaced(&at, [x, y, z], cayley) };
        Ok(Command { joints: q, at, rates })
    }

    /// Whether a drive carries the strut of a closure.
    pub fn drives(&self, joint: usize, closure: usize) -> bool {
        self.machine.struts.get(closure).is_some_and(|strut| strut.drive == Some(joint))
    }

    /// The axes about which the Euler angles turn, over a box of poses.
    fn axes(&self, sides: &[[f64; 2]], solved: &Pose<f64>) -> [Vector<Interval>; 3] {
        let angles = self.coordinates(sides, solved);
        let (sb, cb) = angles[4].sin_cos();
        let (sc, cc) = angles[5].sin_cos();
        let zero = point(0.0);
        [[cc * cb, sc * cb, -sb], [-sc, cc, zero], [zero, zero, point(1.0)]]
    }
}

/// What a twist of the platform changes of the residuals.
pub fn pull<S: Scalar>(machine: &Machine, at: &Derivatives<S>, twist: &Six<S>) -> Six<S> {
    let mut result = [twist[0].lift(0.0); SIX];
    for i in 0..machine.closure_count() {
        for k in 0..SIX {
            result[i] = result[i] + at.closures.to_twist[i][k] * twist[k];
        }
    }
    result
}

/// How a platform turns when its Cayley vector `c` changes at `rate`.
fn rotation_of(c: Vector<Interval>, rate: Vector<Interval>) -> Vector<Interval> {
    let half = c.map(|value| value * point(0.5));
    let [a, b, d] = half.map(|value| value.square());
    let scale = point(1.0) / (point(1.0) + a + b + d);
    add(rate, cross(half, rate)).map(|value| value * scale)
}

/// `Rz(c) Ry(b) Rx(a)`.
fn euler_matrix(angles: Vector<Interval>) -> RotationMatrix<Interval> {
    let (sa, ca) = angles[0].sin_cos();
    let (sb, cb) = angles[1].sin_cos();
    let (sc, cc) = angles[2].sin_cos();
    let x = [[ca, -sa], [sa, ca]];
    // Ry Rx, then Rz on it.
    let inner: RotationMatrix<Interval> = [
        [cb, sb * x[1][0], sb * x[1][1]],
        [point(0.0), x[0][0], x[0][1]],
        [-sb, cb * x[1][0], cb * x[1][1]],
    ];
    let mut result = inner;
    let outer = [[cc, -sc, point(0.0)], [sc, cc, point(0.0)], [point(0.0), point(0.0), point(1.0)]];
    for i in 0..3 {
        for j in 0..3 {
            result[i][j] = dot(outer[i], [inner[0][j], inner[1][j], inner[2][j]]);
        }
    }
    result
}
