//! Over a box of commanded poses: the nominal command, how far the actual platform is from it, and how both
//! change with the pose.
//!
//! Everything is an enclosure over all poses of the box and all machines, proved to exist first.

use super::affine::Affine;
use super::at_pose::{along, placed};
use super::closures::{Derivatives, Placed, Six, Square, derivatives, turned};
use super::over_region::Region;
use super::root::{Inverse, Varying, prove};
use super::{Deviating, Unproven, point};
use crate::linear::SIX;
use crate::machine::{Machine, Strut};
use crate::scalar::{Dual, Interval, Scalar};
use crate::spatial::{Pose, RotationMatrix, Vector, add, cross, dot, rotate};

/// An interval and its rate of change.
pub type Tangent = Dual<Interval, 1>;

/// Known deviations of the parameters, and how far the platform then goes.
pub struct Over {
    pub shifts: Vec<(usize, Interval)>,
    pub known: Six,
    pub slopes: Vec<Six>,
    /// Displacements of all machines in the box, and of the nominal one.
    pub whole: Six,
    /// All parameters between nominal and actual.
    pub between: Vec<Interval>,
    /// Of the closures to the displacement, over all that.
    pub inverse: Inverse,
}

/// The nominal command over a box of poses.
pub struct Command {
    pub joints: Vec<Interval>,
    pub at: Placed,
    /// What the platform and the joints do per unit of each commanded freedom: twist, joint rates.
    pub rates: Vec<(Six, Vec<Interval>)>,
}

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
    /// The commanded pose on intervals, the freedoms that are not commanded as in `solved`.
    fn place(&self, sides: &[[f64; 2]], solved: &Pose<f64>) -> Placed {
        let coordinates = solved.to_coordinates();
        let mut given = coordinates.map(point);
        let mut commanded = sides.iter();
        let mut turned = false;
        for k in 0..SIX {
            if self.machine.commanded[k]
                && let Some(&[low, high]) = commanded.next()
            {
                given[k] = Interval::new(low, high);
                turned |= k >= 3;
            }
        }
        let mut result = placed(solved);
        result.position = [given[0], given[1], given[2]];
        if turned {
            result.rotation = euler_matrix([given[3], given[4], given[5]]);
        }
        result
    }

    /// Which freedoms follow from the others, as places of a displacement.
    fn parasitic(&self) -> Vec<usize> {
        (0..SIX).filter(|&k| self.machine.dof[k] && !self.machine.commanded[k]).collect()
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
        let slots: Vec<usize> =
            (0..SIX).filter(|&k| machine.dof[k] && machine.commanded[k]).collect();
        let p: Vec<Interval> = machine.nominal.iter().map(|&value| point(value)).collect();
        let split = |z: &Six| {
            let mut moved = [point(0.0); SIX];
            for &k in &parasitic {
                moved[k] = z[k];
            }
            let q: Vec<Interval> = slots.iter().map(|&slot| z[slot]).collect();
            (moved, q)
        };
        let mut middle = [0.0; SIX];
        for (&slot, &joint) in slots.iter().zip(joints) {
            middle[slot] = joint;
        }
        // Unknown are the parasitic freedoms, and in the places of the commanded ones the joints.
        let unknowns = |at: &Derivatives| -> Square {
            let mut matrix = at.to_displacement;
            for (joint, &slot) in slots.iter().enumerate() {
                for (i, row) in matrix.iter_mut().enumerate() {
                    row[slot] =
                        if self.drives(joint, i) { at.closures.to_joint[i] } else { point(0.0) };
                }
            }
            matrix
        };
        let jacobian = |z: &Six| {
            let (moved, q) = split(z);
            unknowns(&derivatives(machine, &p, &q, &at, &moved))
        };
        let (moved, q) = split(&middle.map(point));
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
        let first = unknowns(&spread);
        let root = prove(&middle, &exact, &varying, &first, jacobian)?;
        let (moved, q) = split(&root.enclosure);
        let over = derivatives(machine, &p, &q, &at, &moved);
        let inverse = Inverse::of(&unknowns(&over)).ok_or(Unproven::TooWide)?;
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
                let (own, rates) = split(&inverse.times(&opened).map(|value| -value));
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
        let at =
            if parasitic.is_empty() { at } else { super::closures::moved(&at, [x, y, z], cayley) };
        Ok(Command { joints: q, at, rates })
    }

    /// Whether a drive carries the strut of a closure.
    fn drives(&self, joint: usize, closure: usize) -> bool {
        self.machine.struts.get(closure).is_some_and(|strut| strut.drive == Some(joint))
    }

    /// The axes about which the Euler angles turn, over a box of poses.
    fn axes(&self, sides: &[[f64; 2]], solved: &Pose<f64>) -> [Vector<Interval>; 3] {
        let mut angles = solved.to_coordinates().map(point);
        let mut commanded = sides.iter();
        for k in 0..SIX {
            if self.machine.commanded[k]
                && let Some(&[low, high]) = commanded.next()
            {
                angles[k] = Interval::new(low, high);
            }
        }
        let (sb, cb) = angles[4].sin_cos();
        let (sc, cc) = angles[5].sin_cos();
        let zero = point(0.0);
        [[cc * cb, sc * cb, -sb], [-sc, cc, zero], [zero, zero, point(1.0)]]
    }

    /// How far the actual platform is from the commanded one, over a box of poses.
    pub fn over(&self, command: &Command) -> Result<Over, Unproven> {
        let Command { joints: q, at, .. } = command;
        let machine = self.machine;
        let nominal: Vec<Interval> = machine.nominal.iter().map(|&value| point(value)).collect();
        let still = [point(0.0); SIX];
        let lengths = self.lengths(&nominal, q);
        let mut shifts: Vec<(usize, Interval)> =
            self.shift.iter().map(|shift| (shift.parameter, shift.at(&lengths))).collect();
        if !self.yielding.is_empty() {
            let loaded = derivatives(machine, &nominal, q, at, &still);
            shifts.extend(self.deflections(&loaded, &lengths)?);
        }
        // From the nominal parameters to the actual ones, and all between.
        let mut p = nominal.clone();
        for &(index, shift) in &shifts {
            p[index] = p[index] + shift;
        }
        let Deviating { parameters, variables, swing, count, .. } = self.deviating;
        for (&parameter, &swing) in parameters.iter().zip(swing) {
            p[parameter] = p[parameter] + Interval::symmetric(swing);
        }
        for (value, nominal) in p.iter_mut().zip(&nominal) {
            *value = value.hull(*nominal);
        }
        let moves = |over: &Derivatives| {
            let mut known = [point(0.0); SIX];
            for &(index, shift) in &shifts {
                let gradient = over.closures.to_parameter(machine, index);
                for k in 0..SIX {
                    known[k] = known[k] + gradient[k] * shift;
                }
            }
            let mut columns = vec![[point(0.0); SIX]; *count];
            for ((&parameter, &variable), &swing) in parameters.iter().zip(variables).zip(swing) {
                let gradient = over.closures.to_parameter(machine, parameter);
                for k in 0..SIX {
                    columns[variable][k] = columns[variable][k] + gradient[k] * point(swing);
                }
            }
            (known, columns)
        };
        let spread = derivatives(machine, &p, q, at, &still);
        let (known, columns) = moves(&spread);
        let varying: Vec<Varying> =
            columns.into_iter().map(|column| (column, Interval::symmetric(1.0))).collect();
        let first = &spread.to_displacement;
        let root = prove(&[0.0; SIX], &known, &varying, first, |tried| {
            derivatives(machine, &p, q, at, tried).to_displacement
        })?;
        let whole = root.enclosure.map(|one| one.hull(point(0.0)));
        let over = derivatives(machine, &p, q, at, &whole);
        let inverse = Inverse::of(&over.to_displacement).ok_or(Unproven::TooWide)?;
        let (known, columns) = moves(&over);
        let minus = |six: Six| six.map(|value| -value);
        Ok(Over {
            known: minus(inverse.times(&known)),
            slopes: columns.iter().map(|column| minus(inverse.times(column))).collect(),
            shifts,
            whole,
            between: p,
            inverse,
        })
    }

    /// Present lengths of the struts.
    fn lengths<S: Scalar>(&self, p: &[S], q: &[S]) -> Vec<S> {
        let length = |strut: &Strut| {
            let own = strut.own_length.map_or(p[0].lift(0.0), |index| p[index]);
            let Some(index) = strut.drive else { return own };
            let drive = &self.machine.drives[index];
            let base = [0, 1, 2].map(|k| p[strut.first + k]);
            drive.kind.place(&drive.nominal, &p[drive.first..], q[index], base, own).1
        };
        self.machine.struts.iter().map(length).collect()
    }

    /// Deflections under the wrench: compliance times the load, by virtual work.
    fn deflections(
        &self,
        at: &Derivatives,
        lengths: &[Interval],
    ) -> Result<Vec<(usize, Interval)>, Unproven> {
        let machine = self.machine;
        let inverse = Inverse::of(&at.to_displacement).ok_or(Unproven::TooWide)?;
        let forces = self.forces(&inverse);
        let deflection = |yielding: &Affine| {
            let gradient = at.closures.to_parameter(machine, yielding.parameter);
            let mut load = point(0.0);
            for k in 0..machine.closure_count() {
                load = load + forces[k] * gradient[k];
            }
            (yielding.parameter, yielding.at(lengths) * load)
        };
        Ok(self.yielding.iter().map(deflection).collect())
    }

    /// Forces of the closures under the wrench, N.
    fn forces(&self, inverse: &Inverse) -> Six {
        let mut wrench = self.wrench.map(point);
        for value in &mut wrench[3..] {
            *value = *value / point(self.machine.characteristic_length);
        }
        inverse.row_times(&wrench).map(|force| -force)
    }

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
                let gradient = along.closures.to_parameter(machine, index);
                for k in 0..SIX {
                    open[k] = open[k] + gradient[k].value * partly(rate);
                }
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
        let Deviating { parameters, variables, swing, count, .. } = self.deviating;
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
            let mut known = [point(0.0); SIX];
            for &(index, shift) in &over.shifts {
                let gradient = at.closures.to_parameter(machine, index);
                for k in 0..SIX {
                    known[k] = known[k] + gradient[k].parts[0] * shift;
                }
            }
            for &(index, rate) in &shift_rates {
                let gradient = at.closures.to_parameter(machine, index);
                for k in 0..SIX {
                    known[k] = known[k] + gradient[k].value * rate;
                }
            }
            let mut columns = vec![[point(0.0); SIX]; *count];
            for ((&parameter, &variable), &swing) in parameters.iter().zip(variables).zip(swing) {
                let gradient = at.closures.to_parameter(machine, parameter);
                for k in 0..SIX {
                    let rate = gradient[k].parts[0] * point(swing);
                    columns[variable][k] = columns[variable][k] + rate;
                }
            }
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

    /// Whether what is known differs from pose to pose.
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

/// What a twist of the platform changes of the residuals.
fn pull(machine: &Machine, at: &Derivatives, twist: &Six) -> Six {
    let mut result = [point(0.0); SIX];
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
