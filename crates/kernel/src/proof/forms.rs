//! Over a box of commanded poses: the nominal command, and linear equations whose terms are known to first
//! order in the pose, as affine forms.
//!
//! Variable k of every form is the k-th commanded freedom, from -1 at the low side of the box to 1 at the
//! high side. What two closures have in common (the rods of a delta's pair) then cancels in the products
//! with an approximate inverse, before anything is taken for independent.

use super::closures::{Derivatives, Placed, Six, Square, derivatives};
use super::command::{Command, pull};
use super::region::Region;
use super::root::Inverse;
use super::{Unproven, point};
use crate::linear::{Matrix6, SIX, inverse_of};
use crate::scalar::{AffineForm, Interval, Scalar};
use crate::spatial::{Pose, RotationMatrix, cross};

/// Times that the command's rates are found again from a command that is known closer.
const AGAIN: usize = 2;

/// The nominal command, in affine forms.
pub struct Forms<const M: usize> {
    pub joints: Vec<AffineForm<M>>,
    pub at: Placed<AffineForm<M>>,
    /// What the platform and the joints do per unit of each commanded freedom: twist, joint rates.
    pub rates: Vec<(Six<AffineForm<M>>, Vec<AffineForm<M>>)>,
    /// The closures there, and their equations for a displacement.
    pub there: Derivatives<AffineForm<M>>,
    pub equations: Equations<M>,
}

/// Matrices A, one at every pose of the box, of the equations A x = b.
///
/// With Y near their inverses and E = I - Y A, x = Y b + E x = Y b + E Y b + E^2 (I - E)^-1 Y b: the first two
/// terms in affine forms, of the last what an interval knows.
pub struct Equations<const M: usize> {
    approximate: Matrix6<f64>,
    rest: Square<AffineForm<M>>,
    /// |E|^2 (I - |E|)^-1, from above.
    beyond: Matrix6<f64>,
}

/// Products of plain numbers and forms, summed.
fn combined<const M: usize>(row: &[f64; SIX], column: &Six<AffineForm<M>>) -> AffineForm<M> {
    let mut sum = AffineForm::from_interval(point(0.0));
    for k in 0..SIX {
        if row[k] != 0.0 {
            sum = sum + column[k].scaled(row[k]);
        }
    }
    sum
}

impl<const M: usize> Equations<M> {
    /// Of the matrices; none where they are not certainly regular.
    pub fn of(matrix: &Square<AffineForm<M>>) -> Option<Self> {
        let approximate = inverse_of(&matrix.map(|row| row.map(|one| one.middle)));
        if !approximate.iter().flatten().all(|entry| entry.is_finite()) {
            return None;
        }
        let mut rest = *matrix;
        let mut size = [[0.0; SIX]; SIX];
        for j in 0..SIX {
            let mut column = matrix[0];
            for k in 0..SIX {
                column[k] = matrix[k][j];
            }
            for i in 0..SIX {
                let unit = if i == j { 1.0 } else { 0.0 };
                let unit = AffineForm::from_interval(point(unit));
                rest[i][j] = unit - combined(&approximate[i], &column);
                size[i][j] = rest[i][j].range.magnitude();
            }
        }
        let inverse = Inverse::within(approximate, &size)?;
        let beyond = inverse.excess_beyond(&size);
        Some(Equations { approximate, rest, beyond })
    }

    /// x of A x = b.
    pub fn solve(&self, b: &Six<AffineForm<M>>) -> Six<AffineForm<M>> {
        let mut nearly = *b;
        for i in 0..SIX {
            nearly[i] = combined(&self.approximate[i], b);
        }
        let mut result = nearly;
        for i in 0..SIX {
            let mut more = 0.0;
            for k in 0..SIX {
                result[i] = result[i] + self.rest[i][k] * nearly[k];
                more += self.beyond[i][k] * nearly[k].range.magnitude();
            }
            // Seven sums of non-negative products err by less than their share of this.
            let more = Interval::symmetric(more * (1.0 + 1e-14) + f64::MIN_POSITIVE);
            result[i] = result[i] + AffineForm::from_interval(more);
        }
        result
    }
}

impl Region<'_> {
    /// The command over a box of poses to first order, from all that is known of it in the middle (`spot`)
    /// and over the box; `sides` are the box's, `halves` about
    /// the middle, and `solved` the pose there.
    pub fn forms<const M: usize>(
        &self,
        spot: &Command,
        over: &Command,
        (sides, halves): (&[[f64; 2]], &[Interval]),
        solved: &Pose<f64>,
    ) -> Result<Forms<M>, Unproven> {
        let machine = self.machine;
        let p: Vec<AffineForm<M>> =
            machine.nominal.iter().map(|&value| AffineForm::from_interval(point(value))).collect();
        let still = [AffineForm::from_interval(point(0.0)); SIX];
        let mut rates = over.rates.clone();
        let mut round = 0;
        loop {
            let (joints, at) = self.placed_forms::<M>(spot, over, &rates, halves);
            let there = derivatives(machine, &p, &joints, &at, &still);
            let equations = Equations::of(&self.unknowns(&there)).ok_or(Unproven::TooWide)?;
            let own = self.commanded_twists(sides, solved, &at);
            let formed: Vec<_> =
                own.iter().map(|twist| self.follow(&equations, &there, twist)).collect();
            round += 1;
            if round > AGAIN {
                let equations = Equations::of(&there.to_displacement).ok_or(Unproven::TooWide)?;
                return Ok(Forms { joints, at, rates: formed, there, equations });
            }
            for ((twist, speeds), (form, forms)) in rates.iter_mut().zip(&formed) {
                for (one, form) in twist.iter_mut().zip(form) {
                    *one = one.intersection(form.range).unwrap_or(*one);
                }
                for (one, form) in speeds.iter_mut().zip(forms) {
                    *one = one.intersection(form.range).unwrap_or(*one);
                }
            }
        }
    }

    /// Joints and pose, by their rates over the box.
    fn placed_forms<const M: usize>(
        &self,
        spot: &Command,
        over: &Command,
        rates: &[(Six, Vec<Interval>)],
        halves: &[Interval],
    ) -> (Vec<AffineForm<M>>, Placed<AffineForm<M>>) {
        let formed = |middle: Interval, range: Interval, rate: &dyn Fn(usize) -> Interval| {
            let mut along = [point(0.0); M];
            for (k, half) in halves.iter().enumerate() {
                along[k] = rate(k).scaled(half.magnitude());
            }
            AffineForm::of_rates(middle, &along, range)
        };
        let joints = (0..spot.joints.len())
            .map(|j| formed(spot.joints[j], over.joints[j], &|k| rates[k].1[j]))
            .collect();
        let zero = AffineForm::from_interval(point(0.0));
        let mut at = Placed { position: [zero; 3], rotation: [[zero; 3]; 3] };
        for j in 0..3 {
            let (middle, range) = (spot.at.position[j], over.at.position[j]);
            at.position[j] = formed(middle, range, &|k| rates[k].0[j]);
            let column = |rotation: &RotationMatrix<Interval>| [0, 1, 2].map(|i| rotation[i][j]);
            let (middle, range) = (column(&spot.at.rotation), column(&over.at.rotation));
            for i in 0..3 {
                // R' = [w]x R.
                at.rotation[i][j] = formed(middle[i], range[i], &|k| {
                    let [.., a, b, c] = rates[k].0;
                    cross([a, b, c], range)[i]
                });
            }
        }
        (joints, at)
    }

    /// What the platform does per unit of each commanded freedom of itself, without what follows.
    ///
    /// With R = Rz(c) Ry(b) Rx(a) the axis of a is R ex, that of b is Rz(c) ey = (-(R ex)_y, (R ex)_x, 0) / cos b.
    fn commanded_twists<const M: usize>(
        &self,
        sides: &[[f64; 2]],
        solved: &Pose<f64>,
        at: &Placed<AffineForm<M>>,
    ) -> Vec<Six<AffineForm<M>>> {
        let zero = AffineForm::from_interval(point(0.0));
        let one = AffineForm::from_interval(point(1.0));
        let slots = self.slots();
        let angle = self.coordinates(sides, solved)[4];
        let mut rates = [point(0.0); M];
        if let Some(k) = slots.iter().position(|&slot| slot == 4) {
            rates[k] = point(angle.radius());
        }
        let (_, cosine) = AffineForm::of_rates(point(angle.midpoint()), &rates, angle).sin_cos();
        let [x, y] = [at.rotation[0][0], at.rotation[1][0]];
        let axes =
            [[x, y, at.rotation[2][0]], [-(y / cosine), x / cosine, zero], [zero, zero, one]];
        let twist = |&slot: &usize| {
            let mut twist = [zero; SIX];
            if slot < 3 {
                twist[slot] = one;
            } else {
                twist[3..].copy_from_slice(&axes[slot - 3]);
            }
            twist
        };
        slots.iter().map(twist).collect()
    }

    /// The whole twist and the joint rates where the commanded freedoms move at `own`.
    fn follow<const M: usize>(
        &self,
        equations: &Equations<M>,
        at: &Derivatives<AffineForm<M>>,
        own: &Six<AffineForm<M>>,
    ) -> (Six<AffineForm<M>>, Vec<AffineForm<M>>) {
        let found = equations.solve(&pull(self.machine, at, own)).map(|value| -value);
        let (parasitic, speeds) = self.split(&found);
        let mut twist = *own;
        for k in 0..3 {
            twist[k] = twist[k] + parasitic[k];
            // A Cayley vector at zero changes as the platform turns.
            let length = point(self.machine.characteristic_length);
            let turn = parasitic[3 + k] / AffineForm::from_interval(length);
            twist[3 + k] = twist[3 + k] + turn;
        }
        (twist, speeds)
    }
}
