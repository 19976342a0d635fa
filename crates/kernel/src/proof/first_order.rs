//! Over a box of commanded poses: how far the actual platform is from the nominal command, to first order in
//! the deviations, and a bound of all that is of higher order.
//!
//! From the nominal machine to an actual one go along the way nominal + tau d, 0 <= tau <= 1. The platform
//! follows at S(tau) d, S = -J^-1 G, so that it is off by the mean of S(tau) d over the way. S(0) is the
//! nominal machine's and hangs on the pose alone: it is known in affine forms, which add up before anything is
//! taken for independent. What S(tau) differs by is J(tau) (S(tau) - S(0)) = -(G(tau) - G(0)) - (J(tau) - J(0))
//! S(0); both differences are tau times a derivative along the way, which is enclosed for all machines. The
//! mean of tau is a half.

use super::at_pose::along;
use super::closures::{Derivatives, Placed, Six, add_multiple, derivatives};
use super::forms::{Equations, Forms};
use super::pose_box::Over;
use super::region::{Affine, Region};
use super::{Unproven, point};
use crate::linear::SIX;
use crate::scalar::{AffineForm, Dual, Interval};

/// How far the platform goes over a box of poses.
pub struct FirstOrder<const M: usize> {
    /// Known deviations of the parameters.
    pub shifts: Vec<(usize, AffineForm<M>)>,
    /// With the known deviations, of the nominal machine,
    known: Six<AffineForm<M>>,
    /// and per unit of each variable.
    slopes: Vec<Six<AffineForm<M>>>,
    /// By how much all of that may differ, of any machine.
    known_more: Six,
    more: Vec<Six>,
}

/// A product of plain numbers and forms, summed.
pub fn formed_along<const M: usize>(
    direction: &[f64; SIX],
    six: &Six<AffineForm<M>>,
) -> AffineForm<M> {
    let mut sum = AffineForm::from_interval(point(0.0));
    for (&factor, one) in direction.iter().zip(six) {
        if factor != 0.0 {
            sum = sum + one.scaled(factor);
        }
    }
    sum
}

impl Region<'_> {
    /// To first order, with what is beyond.
    pub fn first_order<const M: usize>(
        &self,
        forms: &Forms<M>,
        over: &Over,
    ) -> Result<FirstOrder<M>, Unproven> {
        let machine = self.machine;
        let form = AffineForm::<M>::from_interval;
        let Forms { joints, at, there, equations, .. } = forms;
        let minus = |six: Six<AffineForm<M>>| six.map(|value| -value);
        let gradient = |parameter| there.closures.to_parameter(machine, parameter);
        let shifts = self.formed_shifts(forms)?;
        let mut opened = [form(point(0.0)); SIX];
        for &(index, shift) in &shifts {
            add_multiple(&mut opened, &gradient(index), shift);
        }
        let known = minus(equations.solve(&opened));
        let columns = self.deviating.columns(|_| true, gradient);
        let slopes: Vec<Six<AffineForm<M>>> =
            columns.iter().map(|column| minus(equations.solve(column))).collect();
        // Along the way, for any machine.
        let p: Vec<Dual<AffineForm<M>, 1>> = over
            .between
            .iter()
            .zip(&machine.nominal)
            .map(|(&one, &nominal)| Dual { value: form(one), parts: [form(one - point(nominal))] })
            .collect();
        let q: Vec<Dual<AffineForm<M>, 1>> = joints.iter().map(|&q| Dual::constant(q)).collect();
        let place = Placed {
            position: at.position.map(Dual::constant),
            rotation: at.rotation.map(|row| row.map(Dual::constant)),
        };
        // The displacement at tau is tau times a mean of S d.
        let mut away = over.whole.map(|whole| Dual::constant(form(whole)));
        for k in 0..SIX {
            let more = over.slopes.iter().map(|slope| Interval::symmetric(slope[k].magnitude()));
            away[k].parts[0] = form(more.fold(over.known[k], |sum, one| sum + one));
        }
        let along = derivatives(machine, &p, &q, &place, &away);
        let values = along.to_displacement.map(|row| row.map(|one| one.value));
        let of_any = Equations::of(&values).ok_or(Unproven::TooWide)?;
        let differs = |slope: &Six<AffineForm<M>>, column: &Six<AffineForm<M>>| {
            let mut open = *column;
            for (i, open) in open.iter_mut().enumerate() {
                for k in 0..SIX {
                    *open = *open + along.to_displacement[i][k].parts[0] * slope[k];
                }
            }
            of_any.solve(&open).map(|value| value.range.scaled(-0.5))
        };
        let change_of =
            |parameter| along.closures.to_parameter(machine, parameter).map(|one| one.parts[0]);
        let mut changed = [form(point(0.0)); SIX];
        for &(index, shift) in &shifts {
            add_multiple(&mut changed, &change_of(index), shift);
        }
        let columns = self.deviating.columns(|_| true, change_of);
        Ok(FirstOrder {
            known_more: differs(&known, &changed),
            more: slopes
                .iter()
                .zip(&columns)
                .map(|(slope, column)| differs(slope, column))
                .collect(),
            known,
            slopes,
            shifts,
        })
    }

    /// Known deviations of the parameters, by pose.
    fn formed_shifts<const M: usize>(
        &self,
        forms: &Forms<M>,
    ) -> Result<Vec<(usize, AffineForm<M>)>, Unproven> {
        let machine = self.machine;
        let p: Vec<AffineForm<M>> =
            machine.nominal.iter().map(|&value| AffineForm::from_interval(point(value))).collect();
        let lengths = self.lengths(&p, &forms.joints);
        let mut shifts: Vec<(usize, AffineForm<M>)> =
            self.shift.iter().map(|shift| (shift.parameter, shift.at(&lengths))).collect();
        if self.yielding.is_empty() {
            return Ok(shifts);
        }
        // W^T f = -F.
        let Derivatives { to_displacement, closures } = &forms.there;
        let mut transposed = *to_displacement;
        for i in 0..SIX {
            for j in 0..SIX {
                transposed[i][j] = to_displacement[j][i];
            }
        }
        let equations = Equations::of(&transposed).ok_or(Unproven::TooWide)?;
        let forces = equations.solve(&self.scaled_wrench().map(AffineForm::from_interval));
        let deflection = |yielding: &Affine| {
            let gradient = closures.to_parameter(machine, yielding.parameter);
            let mut load = AffineForm::from_interval(point(0.0));
            for k in 0..machine.closure_count() {
                load = load + forces[k] * gradient[k];
            }
            (yielding.parameter, -(yielding.at(&lengths) * load))
        };
        shifts.extend(self.yielding.iter().map(deflection));
        Ok(shifts)
    }
}

impl<const M: usize> FirstOrder<M> {
    /// How far displacements reach along a direction: to first order, and what is beyond.
    pub fn reach(&self, direction: &[f64; SIX]) -> [f64; 2] {
        let mut sum = formed_along(direction, &self.known);
        let mut uncertain = point(0.0);
        let mut beyond = point(along(direction, &self.known_more).magnitude());
        for (slope, more) in self.slopes.iter().zip(&self.more) {
            let slope = formed_along(direction, slope);
            if slope.range.lower >= 0.0 {
                sum = sum + slope;
            } else if slope.range.upper <= 0.0 {
                sum = sum - slope;
            } else {
                uncertain = uncertain + point(slope.range.magnitude());
            }
            beyond = beyond + point(along(direction, more).magnitude());
        }
        [(sum.range + uncertain).upper, beyond.upper]
    }

    /// The end of each variable at which machines of the box go farthest along a direction; 0 where that is not
    /// certain.
    pub fn certain_ends(&self, direction: &[f64; SIX]) -> Vec<i8> {
        let end = |(slope, more): (&Six<AffineForm<M>>, &Six)| {
            // What is beyond is a mean over the way, whose end may be twice as far.
            let more = along(direction, more);
            let any = formed_along(direction, slope).range + more.scaled(2.0).hull(point(0.0));
            i8::from(any.lower >= 0.0) - i8::from(any.upper <= 0.0)
        };
        self.slopes.iter().zip(&self.more).map(end).collect()
    }
}
