//! Bounds of the error at one pose, over a box of deviations.
//!
//! Once existence is proved over the whole box, the largest error along a direction is found by fixing
//! every variable along which the error certainly grows, or certainly falls, at its end (monotonicity):
//! what remains is a smaller box, over which the enclosures are tighter, and so on. With all variables
//! fixed the bound is the error at a vertex, but for rounding.

use super::closures::{Placed, Six, derivatives};
use super::root::{Inverse, Varying, prove};
use super::targets::targets;
use super::{Deviating, Unproven, point};
use crate::kinematics::{Sample, forward, limbs};
use crate::linear::SIX;
use crate::machine::Machine;
use crate::scalar::{Interval, Scalar};
use crate::spatial::{Pose, Quaternion, Vector, relative_quaternion, rotation_matrix};
use crate::status::Status;

/// Times that the box is made smaller.
const ROUNDS: usize = 6;

/// Where the bounds are asked for.
#[derive(Clone, Debug)]
pub struct Extent<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Joint coordinates of the command.
    pub joints: &'a [f64],
    /// The commanded pose.
    pub pose: Pose<f64>,
    /// Joints and pose as they are exactly: a number each, or what is known of it.
    pub command: (Vec<Interval>, Placed),
    /// Known deviations of the parameters (index, value).
    pub shift: Vec<(usize, Interval)>,
    /// What the variables move.
    pub deviating: &'a Deviating,
}

/// Proven bounds at one pose; infinite where nothing is proven.
#[derive(Clone, Copy, Debug)]
pub struct PoseBound {
    /// Lowest error of each of six components, m and rad.
    pub lower: [f64; SIX],
    /// Highest.
    pub upper: [f64; SIX],
    /// Largest length of the displacement, m, and largest angle, rad.
    pub magnitudes: [f64; 2],
}

/// The machine over a part of the box: where it is, and how far it moves per unit of each variable.
pub struct Enclosed {
    middle: Six,
    whole: Six,
    unique_in: Six,
    slopes: Vec<Six>,
}

/// The Cayley vector (rad) that turns `from` into `to`.
fn cayley_between(from: Quaternion<f64>, to: Quaternion<f64>) -> Vector<f64> {
    let [w, v @ ..] = relative_quaternion(from, to);
    v.map(|value| 2.0 * value / w)
}

/// A displacement as its six numbers, the Cayley vector times the characteristic length.
pub fn displacement_numbers(machine: &Machine, from: &Pose<f64>, to: &Pose<f64>) -> [f64; SIX] {
    let turned = cayley_between(from.rotation, to.rotation);
    let mut result = [0.0; SIX];
    for k in 0..3 {
        result[k] = to.position[k] - from.position[k];
        result[3 + k] = turned[k] * machine.characteristic_length;
    }
    for &freedom in &machine.held {
        result[freedom] = 0.0;
    }
    result
}

/// A pose on intervals.
pub fn placed(pose: &Pose<f64>) -> Placed {
    Placed {
        position: pose.position.map(point),
        rotation: rotation_matrix(pose.rotation.map(point)),
    }
}

/// A product of plain numbers and intervals, summed.
pub fn along(direction: &[f64; SIX], six: &Six) -> Interval {
    let mut sum = point(0.0);
    for k in 0..SIX {
        if direction[k] != 0.0 {
            sum = sum + point(direction[k]) * six[k];
        }
    }
    sum
}

impl<'a> Extent<'a> {
    /// At a command whose joints and pose are plain numbers.
    pub fn new(
        machine: &'a Machine,
        joints: &'a [f64],
        pose: Pose<f64>,
        shift: impl Iterator<Item = (usize, f64)>,
        deviating: &'a Deviating,
    ) -> Self {
        let command = (joints.iter().map(|&joint| point(joint)).collect(), placed(&pose));
        let shift = shift.map(|(index, value)| (index, point(value))).collect();
        Extent { machine, joints, pose, command, shift, deviating }
    }

    /// Parameters with the variables in a box.
    fn parameters(&self, variables: &[Interval]) -> Vec<Interval> {
        let mut p: Vec<Interval> = self.machine.nominal.iter().map(|&value| point(value)).collect();
        for &(index, value) in &self.shift {
            p[index] = p[index] + value;
        }
        let Deviating { parameters, variables: numbers, swing, .. } = self.deviating;
        for ((&parameter, &variable), &swing) in parameters.iter().zip(numbers).zip(swing) {
            p[parameter] = p[parameter] + point(swing) * variables[variable];
        }
        p
    }

    /// Proves existence and uniqueness over the variables in a box, and encloses.
    fn enclose(&self, variables: &[Interval]) -> Result<Enclosed, Unproven> {
        let machine = self.machine;
        let middles: Vec<Interval> = variables.iter().map(|one| point(one.midpoint())).collect();
        let p = self.parameters(variables);
        let p_middle = self.parameters(&middles);
        let nearly: Vec<f64> = p_middle.iter().map(|one| one.midpoint()).collect();
        let struts = limbs(machine, &nearly, self.joints);
        let sample = Sample { machine, p: &nearly, limbs: &struts };
        let (found, status) = forward(&sample, self.joints, &self.pose);
        if status != Status::Ok {
            return Err(Unproven::NearSingular);
        }
        let middle = displacement_numbers(machine, &self.pose, &found);
        let (q, at) = (&self.command.0, &self.command.1);
        let exact = derivatives(machine, &p_middle, q, at, &middle.map(point));
        let spread = derivatives(machine, &p, q, at, &middle.map(point));
        let columns = self.columns(&spread);
        let away = variables.iter().zip(&middles).map(|(one, middle)| *one - *middle);
        let varying: Vec<Varying> = columns.into_iter().zip(away).collect();
        let root = prove(&middle, &exact.closures.residuals, &varying, |tried| {
            derivatives(machine, &p, q, at, tried).to_displacement
        })?;
        let over = derivatives(machine, &p, q, at, &root.enclosure);
        let inverse = Inverse::of(&over.to_displacement).ok_or(Unproven::TooWide)?;
        let off = inverse.times(&exact.closures.residuals);
        let mut at_middle = middle.map(point);
        for k in 0..SIX {
            at_middle[k] = at_middle[k] - off[k];
        }
        let slopes = self
            .columns(&over)
            .iter()
            .map(|column| inverse.times(column).map(|value| -value))
            .collect();
        Ok(Enclosed { middle: at_middle, whole: root.enclosure, unique_in: root.unique_in, slopes })
    }

    /// Derivatives of the closures to the variables.
    fn columns(&self, at: &super::closures::Derivatives) -> Vec<Six> {
        let mut columns = vec![[point(0.0); SIX]; self.deviating.count];
        let Deviating { parameters, variables, swing, .. } = self.deviating;
        for ((&parameter, &variable), &swing) in parameters.iter().zip(variables).zip(swing) {
            let gradient = at.closures.to_parameter(self.machine, parameter);
            for k in 0..SIX {
                columns[variable][k] = columns[variable][k] + gradient[k] * point(swing);
            }
        }
        columns
    }

    /// The machine over every variable in [-1, 1].
    pub fn whole(&self) -> Result<Enclosed, Unproven> {
        self.enclose(&vec![Interval::symmetric(1.0); self.deviating.count])
    }

    /// The most that `direction . displacement` can be; `first` encloses the whole box.
    pub fn most(&self, direction: &[f64; SIX], first: &Enclosed) -> f64 {
        let whole = Interval::symmetric(1.0);
        let mut variables = vec![whole; self.deviating.count];
        let mut in_direction = vec![false; self.deviating.count];
        for &member in self.deviating.directions.iter().flatten() {
            in_direction[member] = true;
        }
        let mut own: Option<Enclosed> = None;
        let mut best = f64::INFINITY;
        for _ in 0..ROUNDS {
            let enclosed = own.as_ref().unwrap_or(first);
            let mut bound = along(direction, &enclosed.middle);
            let mut fixed = false;
            let mut free = !self.deviating.directions.is_empty();
            let before = variables.clone();
            for (variable, slope) in enclosed.slopes.iter().enumerate() {
                if in_direction[variable] {
                    continue;
                }
                let slope = along(direction, slope);
                let middle = point(before[variable].midpoint());
                bound = bound + slope * (before[variable] - middle);
                if before[variable] != whole {
                    continue;
                }
                if slope.lower >= 0.0 || slope.upper <= 0.0 {
                    let end = if slope.lower >= 0.0 { 1.0 } else { -1.0 };
                    variables[variable] = point(end);
                    fixed = true;
                } else {
                    free = true;
                }
            }
            // Of a unit vector t, slopes . t is at most the length of the slopes (Cauchy and Schwarz).
            for members in &self.deviating.directions {
                let squares = members
                    .iter()
                    .map(|&member| along(direction, &enclosed.slopes[member]).square())
                    .fold(point(0.0), |sum, square| sum + square);
                bound = bound + squares.sqrt();
            }
            best = best.min(bound.upper);
            if !fixed {
                break;
            }
            // A sub-box that cannot be enclosed leaves the bound as it is.
            let Ok(next) = self.enclose(&variables) else { break };
            // The root over the sub-box is the one proved over the whole.
            if !next
                .middle
                .iter()
                .zip(&first.unique_in)
                .all(|(one, whole)| one.lower >= whole.lower && one.upper <= whole.upper)
            {
                break;
            }
            if !free {
                best = best.min(along(direction, &next.middle).upper);
                break;
            }
            own = Some(next);
        }
        best
    }
}

/// Bounds of the error at one pose over every deviation in the box.
pub fn bound_at_pose(extent: &Extent<'_>) -> Result<PoseBound, Unproven> {
    let first = extent.whole()?;
    let bounds = targets(extent.machine, &first.whole, |u| extent.most(u, &first));
    let mut result = PoseBound { lower: [0.0; SIX], upper: [0.0; SIX], magnitudes: [0.0; 2] };
    for k in 0..SIX {
        result.upper[k] = bounds[k];
        result.lower[k] = -bounds[SIX + k];
    }
    result.magnitudes.copy_from_slice(&bounds[2 * SIX..]);
    Ok(result)
}
