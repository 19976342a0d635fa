//! Over a box of commanded poses: how fast the displacement and its slopes change with the pose, by dual
//! numbers on intervals.

use super::at_pose::along;
use super::closures::{Placed, Six, add_multiple, derivatives, turned};
use super::command::Command;
use super::pose_box::Over;
use super::region::Region;
use super::root::Inverse;
use super::{Unproven, point};
use crate::linear::SIX;
use crate::scalar::{Dual, Interval};
use crate::spatial::{cross, rotate};

/// An interval and its rate of change.
pub type Tangent = Dual<Interval, 1>;

/// How the known part of a displacement and its slopes change per unit of a commanded freedom.
pub struct Rates {
    pub known: Six,
    pub slopes: Vec<Six>,
}

/// `value`, changing at `rate`.
fn changing(value: Interval, rate: Interval) -> Tangent {
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
    fn changes(&self, command: &Command, over: &Over) -> Result<Vec<Six>, Unproven> {
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
            for (index, rate) in self.shift_rates(command, freedom)? {
                let gradient = along.closures.to_parameter(machine, index).map(|one| one.value);
                add_multiple(&mut open, &gradient, partly(rate));
            }
            result.push(over.inverse.times(&open).map(|value| -value));
        }
        Ok(result)
    }

    /// How the known part of the displacement and the slopes change per unit of each commanded freedom,
    /// over a box of poses and all machines.
    ///
    /// S = -J^-1 G gives S' = -J^-1 (J' S + G'), where J and G change because the nominal platform and its
    /// joints move, and because the displacement and the known deviations change a little.
    pub fn rates(&self, command: &Command, over: &Over) -> Result<Vec<Rates>, Unproven> {
        let machine = self.machine;
        let changes = self.changes(command, over)?;
        let mut result = Vec::with_capacity(changes.len());
        for (freedom, change) in changes.iter().enumerate() {
            let (twist, speeds) = &command.rates[freedom];
            let shift_rates = self.shift_rates(command, freedom)?;
            let mut p: Vec<Tangent> =
                over.between.iter().map(|&value| changing(value, point(0.0))).collect();
            for &(index, rate) in &shift_rates {
                // Of a machine on the way from the nominal one to this: any share of it.
                p[index].parts[0] = p[index].parts[0] + partly(rate);
            }
            let q: Vec<Tangent> =
                command.joints.iter().zip(speeds).map(|(&q, &rate)| changing(q, rate)).collect();
            let mut away = over.whole.map(|value| changing(value, point(0.0)));
            for k in 0..SIX {
                away[k].parts[0] = change[k];
            }
            let at = derivatives(machine, &p, &q, &turning(&command.at, twist), &away);
            let follow = |slope: &Six, column: &Six| {
                let mut open = *column;
                for (i, open) in open.iter_mut().enumerate() {
                    for k in 0..SIX {
                        *open = *open + at.to_displacement[i][k].parts[0] * slope[k];
                    }
                }
                over.inverse.times(&open).map(|value| -value)
            };
            let change_of =
                |parameter| at.closures.to_parameter(machine, parameter).map(|one| one.parts[0]);
            let mut known = [point(0.0); SIX];
            for &(index, shift) in &over.shifts {
                add_multiple(&mut known, &change_of(index), shift);
            }
            for &(index, rate) in &shift_rates {
                let gradient = at.closures.to_parameter(machine, index).map(|one| one.value);
                add_multiple(&mut known, &gradient, rate);
            }
            let columns = self.deviating.columns(|_| true, change_of);
            result.push(Rates {
                known: follow(&over.known, &known),
                slopes: over.slopes.iter().zip(&columns).map(|(s, c)| follow(s, c)).collect(),
            });
        }
        Ok(result)
    }

    /// How the known deviations change per unit of a commanded freedom.
    fn shift_rates(
        &self,
        command: &Command,
        freedom: usize,
    ) -> Result<Vec<(usize, Interval)>, Unproven> {
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

/// How far displacements reach along a direction: at the middle of a box of poses by the slopes there, and
/// away from it by their rates.
///
/// sum_v |S_v + sum_k S'_vk d_k|, where d is the same for all variables v: those whose sign is certain add
/// up with their signs before the size is taken.
pub fn reach(direction: &[f64; SIX], at: &Over, rates: &[Rates], halves: &[Interval]) -> f64 {
    let mut bound = point(along(direction, &at.known).upper);
    let mut together: Vec<Interval> =
        rates.iter().map(|rate| along(direction, &rate.known)).collect();
    for (variable, slope) in at.slopes.iter().enumerate() {
        let slope = along(direction, slope);
        let mut reached = slope;
        for (rate, &half) in rates.iter().zip(halves) {
            reached = reached + along(direction, &rate.slopes[variable]) * half;
        }
        if reached.lower >= 0.0 || reached.upper <= 0.0 {
            let sign = if reached.lower >= 0.0 { 1.0 } else { -1.0 };
            bound = bound + slope * point(sign);
            for (sum, rate) in together.iter_mut().zip(rates) {
                *sum = *sum + along(direction, &rate.slopes[variable]) * point(sign);
            }
        } else {
            bound = bound + point(reached.magnitude());
        }
    }
    for (sum, &half) in together.iter().zip(halves) {
        bound = bound + *sum * half;
    }
    bound.upper
}

/// How much farther displacements reach along a direction away from the middle of a box of poses than in
/// it, where every variable whose slope is certain over all of the box is at its end.
pub fn reach_more(
    direction: &[f64; SIX],
    over: &Over,
    rates: &[Rates],
    halves: &[Interval],
) -> f64 {
    let mut bound = point(0.0);
    for (rate, &half) in rates.iter().zip(halves) {
        let mut sum = along(direction, &rate.known);
        for (slope, rate) in over.slopes.iter().zip(&rate.slopes) {
            let slope = along(direction, slope);
            let rate = along(direction, rate);
            sum = sum
                + if slope.lower >= 0.0 {
                    rate
                } else if slope.upper <= 0.0 {
                    -rate
                } else {
                    Interval::symmetric(rate.magnitude())
                };
        }
        bound = bound + sum * half;
    }
    bound.upper
}

/// A platform that moves at a twist: R' = [w]x R.
fn turning(at: &Placed, twist: &Six) -> Placed<Tangent> {
    let still = |value: Interval| changing(value, point(0.0));
    let mut result = Placed {
        position: at.position.map(still),
        rotation: at.rotation.map(|row| row.map(still)),
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
