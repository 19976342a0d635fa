//! Over a box of commanded poses: how fast the displacement and its slopes change with the pose, by dual
//! numbers on intervals.

use super::closures::{Placed, Six, add_multiple, derivatives, turned};
use super::command::Command;
use super::forms::{Equations, Forms};
use super::pose_box::Over;
use super::region::Region;
use super::root::Inverse;
use super::{Unproven, point};
use crate::linear::SIX;
use crate::scalar::{AffineForm, Dual, Interval, Scalar};
use crate::spatial::{cross, rotate};

/// A number and its rate of change.
type Tangent<S = Interval> = Dual<S, 1>;

/// How the known part of a displacement and its slopes change per unit of a commanded freedom.
pub struct Rates {
    pub known: Six,
    pub slopes: Vec<Six>,
}

/// How known deviations change per unit of a commanded freedom: by parameter.
pub type ShiftRates = Vec<(usize, Interval)>;

/// `value`, changing at `rate`.
fn changing<S>(value: S, rate: S) -> Tangent<S> {
    Dual { value, parts: [rate] }
}

impl Region<'_> {
    /// By how much the displacement changes at most per unit of each commanded freedom, over a box of poses
    /// and all machines: (numbers of the displacement, for each freedom).
    ///
    /// The nominal platform moves with its joints at a twist T, and its closures stay closed. The actual one,
    /// whose closures' rows differ a little, is off by what the difference leaves open. The difference is
    /// taken along the way from the nominal machine to the actual one, by dual numbers, so that it is as
    /// small as the deviations are; and it holds anywhere on that way, where a share of it has happened.
    pub fn changes(&self, command: &Command, over: &Over, shift_rates: &[ShiftRates]) -> Vec<Six> {
        let machine = self.machine;
        let Command { joints, at, rates } = command;
        let still = |value: Interval| changing(value, point(0.0));
        let p: Vec<Tangent> = over
            .between
            .iter()
            .zip(&machine.nominal)
            .map(|(&one, &nominal)| changing(one, one - point(nominal)))
            .collect();
        let q: Vec<Tangent> = joints.iter().map(|&joint| still(joint)).collect();
        let place = Placed {
            position: at.position.map(still),
            rotation: at.rotation.map(|row| row.map(still)),
        };
        let away = over.whole.map(|one| changing(one, one));
        let along = derivatives(machine, &p, &q, &place, &away);
        let length = point(machine.characteristic_length);
        let cayley = [over.whole[3], over.whole[4], over.whole[5]].map(|value| value / length);
        let mut turning = turned(cayley);
        for (k, row) in turning.iter_mut().enumerate() {
            row[k] = row[k] - point(1.0);
        }
        let mut result = Vec::with_capacity(rates.len());
        for (freedom, (twist, speeds)) in rates.iter().enumerate() {
            // What turns with the nominal platform turns the arms a little differently.
            let more = rotate(&turning, [twist[3], twist[4], twist[5]]);
            let mut open = [point(0.0); SIX];
            for (i, open) in open.iter_mut().enumerate().take(machine.closure_count()) {
                for k in 0..SIX {
                    *open = *open + partly(along.closures.to_twist[i][k].parts[0]) * twist[k];
                }
                for k in 0..3 {
                    *open = *open + along.closures.to_twist[i][3 + k].value * more[k];
                }
                for (joint, &speed) in speeds.iter().enumerate() {
                    if self.drives(joint, i) {
                        *open = *open + partly(along.closures.to_joint[i].parts[0]) * speed;
                    }
                }
            }
            for &(index, rate) in &shift_rates[freedom] {
                let gradient = along.closures.to_parameter(machine, index).map(|one| one.value);
                add_multiple(&mut open, &gradient, partly(rate));
            }
            result.push(over.inverse.times(&open).map(|value| -value));
        }
        result
    }

    /// How the known part of the displacement and the slopes change per unit of each commanded freedom,
    /// over a box of poses and all machines, and the slopes themselves.
    ///
    /// S = -J^-1 G gives S' = -J^-1 (J' S + G'), where J and G change because the nominal platform and its
    /// joints move, and because the displacement and the known deviations change a little. How they differ
    /// from pose to pose is in the affine forms; what differs between machines is in their remainders.
    pub fn rates<const M: usize>(
        &self,
        forms: &Forms<M>,
        over: &Over,
        shifts: &[ShiftRates],
        changes: &[Six],
    ) -> Result<Vec<Rates>, Unproven> {
        let machine = self.machine;
        let form = AffineForm::<M>::from_interval;
        let minus = |six: Six<AffineForm<M>>| six.map(|value| -value);
        let mut slopes: Option<(Six<AffineForm<M>>, Vec<Six<AffineForm<M>>>)> = None;
        let mut result = Vec::with_capacity(changes.len());
        for (freedom, change) in changes.iter().enumerate() {
            let (twist, speeds) = &forms.rates[freedom];
            let mut p: Vec<Tangent<AffineForm<M>>> =
                over.between.iter().map(|&value| Dual::constant(form(value))).collect();
            for &(index, rate) in &shifts[freedom] {
                // Of a machine on the way from the nominal one to this: any share of it.
                p[index].parts[0] = p[index].parts[0] + form(partly(rate));
            }
            let q: Vec<Tangent<AffineForm<M>>> =
                forms.joints.iter().zip(speeds).map(|(&q, &rate)| changing(q, rate)).collect();
            let mut away = over.whole.map(|value| Dual::constant(form(value)));
            for k in 0..SIX {
                away[k].parts[0] = form(change[k]);
            }
            let at = derivatives(machine, &p, &q, &turning(&forms.at, twist), &away);
            let values = at.to_displacement.map(|row| row.map(|one| one.value));
            let equations = Equations::of(&values).ok_or(Unproven::TooWide)?;
            let gradient = |parameter| at.closures.to_parameter(machine, parameter);
            let value_of = |parameter| gradient(parameter).map(|one| one.value);
            let change_of = |parameter| gradient(parameter).map(|one| one.parts[0]);
            let (known, own) = slopes.get_or_insert_with(|| {
                let mut known = [form(point(0.0)); SIX];
                for &(index, shift) in &over.shifts {
                    add_multiple(&mut known, &value_of(index), form(shift));
                }
                let columns = self.deviating.columns(|_| true, value_of);
                (
                    minus(equations.solve(&known)),
                    columns.iter().map(|column| minus(equations.solve(column))).collect(),
                )
            });
            let follow = |slope: &Six<AffineForm<M>>, column: &Six<AffineForm<M>>| -> Six {
                let mut open = *column;
                for (i, open) in open.iter_mut().enumerate() {
                    for k in 0..SIX {
                        *open = *open + at.to_displacement[i][k].parts[0] * slope[k];
                    }
                }
                equations.solve(&open).map(|value| -value.range)
            };
            let mut opened = [form(point(0.0)); SIX];
            for &(index, shift) in &over.shifts {
                add_multiple(&mut opened, &change_of(index), form(shift));
            }
            for &(index, rate) in &shifts[freedom] {
                add_multiple(&mut opened, &value_of(index), form(rate));
            }
            let columns = self.deviating.columns(|_| true, change_of);
            result.push(Rates {
                known: follow(known, &opened),
                slopes: own.iter().zip(&columns).map(|(s, c)| follow(s, c)).collect(),
            });
        }
        Ok(result)
    }

    /// How the known deviations change per unit of a commanded freedom.
    pub fn shift_rates(&self, command: &Command, freedom: usize) -> Result<ShiftRates, Unproven> {
        let machine = self.machine;
        if !self.varies() {
            return Ok(Vec::new());
        }
        let (twist, speeds) = &command.rates[freedom];
        let still = |value: Interval| changing(value, point(0.0));
        let p: Vec<Tangent> = machine.nominal.iter().map(|&value| still(point(value))).collect();
        let q: Vec<Tangent> =
            command.joints.iter().zip(speeds).map(|(&q, &rate)| changing(q, rate)).collect();
        let lengths = self.lengths(&p, &q);
        let mut rates: Vec<(usize, Interval)> = self
            .shift
            .iter()
            .filter(|shift| shift.per_length != 0.0)
            .map(|shift| (shift.parameter, point(shift.per_length) * lengths[shift.strut].parts[0]))
            .collect();
        if self.yielding.is_empty() {
            return Ok(rates);
        }
        let place = turning(&command.at, twist);
        let none = [still(point(0.0)); SIX];
        let at = derivatives(machine, &p, &q, &place, &none);
        let inverse = Inverse::of(&at.to_displacement.map(|row| row.map(|one| one.value)))
            .ok_or(Unproven::TooWide)?;
        let forces = self.forces(&inverse);
        // W^T f = -F stays, so f' = -W^-T (W'^T f).
        let mut pull = [point(0.0); SIX];
        for (j, pull) in pull.iter_mut().enumerate() {
            for i in 0..machine.closure_count() {
                *pull = *pull + at.to_displacement[i][j].parts[0] * forces[i];
            }
        }
        let force_rates = inverse.row_times(&pull).map(|value| -value);
        for yielding in &self.yielding {
            let gradient = at.closures.to_parameter(machine, yielding.parameter);
            let mut load = still(point(0.0));
            for k in 0..machine.closure_count() {
                load = load + changing(forces[k], force_rates[k]) * gradient[k];
            }
            rates.push((yielding.parameter, (yielding.at(&lengths) * load).parts[0]));
        }
        Ok(rates)
    }

    /// Whether the known deviations differ from pose to pose.
    pub fn varies(&self) -> bool {
        !self.yielding.is_empty() || self.shift.iter().any(|shift| shift.per_length != 0.0)
    }
}

/// A platform that moves at a twist: R' = [w]x R.
fn turning<S: Scalar>(at: &Placed<S>, twist: &Six<S>) -> Placed<Tangent<S>> {
    let mut result = Placed {
        position: at.position.map(Dual::constant),
        rotation: at.rotation.map(|row| row.map(Dual::constant)),
    };
    for j in 0..3 {
        result.position[j].parts[0] = twist[j];
        let column = [at.rotation[0][j], at.rotation[1][j], at.rotation[2][j]];
        let rate = cross([twist[3], twist[4], twist[5]], column);
        for i in 0..3 {
            result.rotation[i][j].parts[0] = rate[i];
        }
    }
    result
}

/// Any share, from none to all, of a number in the interval.
fn partly(whole: Interval) -> Interval {
    whole.hull(point(0.0))
}
