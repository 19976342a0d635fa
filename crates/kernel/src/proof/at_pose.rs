//! Bounds of the error at one pose, over a box of deviations.
//!
//! Once existence is proved over the whole box, the largest error along a direction is found by fixing
//! every variable along which the error certainly grows, or certainly falls, at its end (monotonicity):
//! what remains is a smaller box, over which the enclosures are tighter, and so on. With all variables
//! fixed the bound is the error at a vertex, but for rounding.
//!
//! Nothing is proved again over a smaller box: its machines x(t) are among those of the whole, and both
//! the slopes S there and the inverse of every matrix there are known. A solution y in plain numbers is
//! off by what its residuals are through that inverse (both y and the root lie where the matrices are
//! enclosed). From its middle m the smaller box reaches x(m) + C (t - m), by the mean value theorem first
//! in t and then in x: the chords C = -J^-1 G need G at x(m) alone, and are tighter than the slopes. Where
//! the inverse over the whole is spread widely, a smaller box is proved by itself.

use super::closures::{Derivatives, Placed, Six, Square, add_multiple, derivatives, residuals};
use super::root::{Inverse, Root, Varying, prove};
use super::targets::{Bounds, Closeness, TARGETS, targets};
use super::{Deviating, Unproven, point};
use crate::kinematics::{Sample, forward, limbs};
use crate::linear::{SIX, inverse_of};
use crate::machine::Machine;
use crate::scalar::{Interval, Scalar};
use crate::spatial::{Pose, Quaternion, Vector, relative_quaternion, rotation_matrix};
use crate::status::Status;
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

/// Magnitudes are refined until they lie at most this above the farthest reach.
pub const FINE: f64 = 1.0003;
/// Times that the box is made smaller.
const ROUNDS: usize = 6;
/// Where the inverse is spread by more, every smaller box is proved by itself.
const LOOSE: f64 = 0.05;
/// What variables of uncertain sign may add to how far a part reaches, of that: along an axis what
/// rounding may, elsewhere what no verdict depends on.
const ROUNDING: f64 = 1e-13;
const SLACK: f64 = 2e-4;

/// The pose, the deviations and the machine that bounds are for.
#[derive(Clone, Debug)]
pub struct Extent<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Joint coordinates of the command.
    pub joints: &'a [f64],
    /// The commanded pose.
    pub pose: Pose<f64>,
    /// Enclosures of the exact joints and pose: points where they are known exactly.
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
    /// Where it is at the part's middle, and to the last digit or so as plain numbers.
    pub middle: Six,
    pub pose: Pose<f64>,
    /// Where all machines are, and where there is no other root of any of them.
    pub whole: Six,
    pub unique_in: Six,
    /// From the plain numbers in the middle to any of the roots, and over all of that the inverse of the
    /// closures' derivatives and the slopes.
    between: Six,
    inverse: Inverse,
    slopes: Vec<Six>,
}

/// A part's machines where some variables are held at an end.
struct Narrowed {
    /// Where the middle one is.
    middle: Six,
    /// How far the machine moves per unit of each of the others: from the middle,
    chords: Vec<Six>,
    /// and anywhere.
    slopes: Vec<Six>,
}

/// A part of the box over which nothing is proven.
pub struct Unenclosed {
    pub why: Unproven,
    /// Where the machine is at the part's middle; none if it cannot be there.
    pub pose: Option<Pose<f64>>,
    /// How far the machine goes from there with each variable, to first order.
    pub effects: Vec<f64>,
}

/// A part of the box that is proven, with the enclosures over smaller parts in it.
pub struct Part<'a> {
    extent: &'a Extent<'a>,
    /// The variables' ends.
    pub sides: Vec<Interval>,
    pub first: Enclosed,
    /// By the end at which each variable is held: -1, 1, or 0 for neither. None where nothing is proven.
    narrowed: RefCell<HashMap<Vec<i8>, Option<Rc<Narrowed>>>>,
}

/// A bound on how far a part reaches along a direction, and what limits it.
struct DirectionBound {
    bound: f64,
    /// The variable whose slope is least certain, if one is.
    loosest: Option<usize>,
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
    let (mut lower, mut upper, mut size) = (0.0, 0.0, 0.0);
    for (&factor, one) in direction.iter().zip(six) {
        if factor == 0.0 {
            continue;
        }
        let (low, high) =
            if factor > 0.0 { (one.lower, one.upper) } else { (one.upper, one.lower) };
        lower += factor * low;
        upper += factor * high;
        size += (factor * low).abs().max((factor * high).abs());
    }
    // Rounding errs by less than seven half steps of the sum of sizes; a zero is exact.
    let more = if size > 0.0 { size * (8.0 * f64::EPSILON) + f64::MIN_POSITIVE } else { 0.0 };
    Interval::new(lower - more, upper + more)
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

    /// Proves existence and uniqueness over the variables in a box, and encloses; the machine at its
    /// middle is looked for from `start`.
    pub fn enclose(
        &self,
        variables: &[Interval],
        start: &Pose<f64>,
    ) -> Result<Enclosed, Box<Unenclosed>> {
        let machine = self.machine;
        let middles: Vec<Interval> = variables.iter().map(|one| point(one.midpoint())).collect();
        let p = self.parameters(variables);
        let p_middle = self.parameters(&middles);
        let nearly: Vec<f64> = p_middle.iter().map(|one| one.midpoint()).collect();
        let struts = limbs(machine, &nearly, self.joints);
        let sample = Sample { machine, p: &nearly, limbs: &struts };
        let (found_pose, status) = forward(&sample, self.joints, start);
        if status != Status::Ok {
            let why = Unproven::NearSingular;
            return Err(Box::new(Unenclosed { why, pose: None, effects: Vec::new() }));
        }
        let middle = displacement_numbers(machine, &self.pose, &found_pose);
        let (q, at) = (&self.command.0, &self.command.1);
        let exact = derivatives(machine, &p_middle, q, at, &middle.map(point));
        let spread = derivatives(machine, &p, q, at, &middle.map(point));
        let away = variables.iter().zip(&middles).map(|(one, middle)| *one - *middle);
        let gradient = |parameter| spread.closures.to_parameter(machine, parameter);
        let columns = self.deviating.columns(|_| true, gradient);
        let varying: Vec<Varying> = columns.into_iter().zip(away).collect();
        let unproven = |why: Unproven| {
            let effects = effects(&spread.to_displacement, &varying);
            Box::new(Unenclosed { why, pose: Some(found_pose), effects })
        };
        let residuals = &exact.closures.residuals;
        let root = prove(&middle, residuals, &varying, &spread.to_displacement, |tried| {
            derivatives(machine, &p, q, at, tried).to_displacement
        })
        .map_err(&unproven)?;
        // From the plain numbers in the middle to any of the roots.
        let mut between = root.enclosure;
        for k in 0..SIX {
            between[k] = between[k].hull(point(middle[k]));
        }
        let over = derivatives(machine, &p, q, at, &between);
        let Some(inverse) = Inverse::of(&over.to_displacement) else {
            return Err(unproven(Unproven::TooWide));
        };
        let off = inverse.times(residuals);
        let mut at_middle = middle.map(point);
        for k in 0..SIX {
            at_middle[k] = at_middle[k] - off[k];
        }
        let slopes = self.slopes(&over, &inverse, |_| true);
        let Root { enclosure, unique_in } = root;
        Ok(Enclosed {
            middle: at_middle,
            pose: found_pose,
            whole: enclosure,
            unique_in,
            between,
            inverse,
            slopes,
        })
    }

    /// How far the machine moves per unit of each variable that is asked for; of the others zero.
    fn slopes(
        &self,
        over: &Derivatives,
        inverse: &Inverse,
        asked: impl Fn(usize) -> bool,
    ) -> Vec<Six> {
        let gradient = |parameter| over.closures.to_parameter(self.machine, parameter);
        let mut slopes = self.deviating.columns(&asked, gradient);
        for (_, slope) in slopes.iter_mut().enumerate().filter(|&(variable, _)| asked(variable)) {
            *slope = inverse.times(slope).map(|value| -value);
        }
        slopes
    }

    /// The machine over every variable in [-1, 1].
    pub fn whole(&self) -> Result<Part<'_>, Box<Unenclosed>> {
        self.part(vec![Interval::symmetric(1.0); self.deviating.count], &self.pose)
    }

    /// The machine over a part of the box, looked for from `start`.
    pub fn part(
        &self,
        sides: Vec<Interval>,
        start: &Pose<f64>,
    ) -> Result<Part<'_>, Box<Unenclosed>> {
        let first = self.enclose(&sides, start)?;
        Ok(Part { extent: self, sides, first, narrowed: RefCell::default() })
    }
}

impl Part<'_> {
    /// Where a variable is that is held at an end, or not held.
    fn side(&self, variable: usize, end: i8) -> Interval {
        let side = self.sides[variable];
        match end {
            0 => side,
            1 => point(side.upper),
            _ => point(side.lower),
        }
    }

    /// Where the machine of certain variables of the part is; none where no solution is found.
    pub fn root(&self, variables: &[Interval]) -> Option<Six> {
        let Extent { machine, joints, pose, command: (q, at), .. } = self.extent;
        let p = self.extent.parameters(variables);
        let nearly: Vec<f64> = p.iter().map(|one| one.midpoint()).collect();
        let struts = limbs(machine, &nearly, joints);
        let sample = Sample { machine, p: &nearly, limbs: &struts };
        let (found, status) = forward(&sample, joints, &self.first.pose);
        if status != Status::Ok {
            return None;
        }
        let mut result = displacement_numbers(machine, pose, &found).map(point);
        for (one, between) in result.iter_mut().zip(&self.first.between) {
            // Rounding may have put it outside, where the matrices are not enclosed.
            *one = point(one.lower.clamp(between.lower, between.upper));
        }
        let off = self.first.inverse.times(&residuals(machine, &p, q, at, &result));
        for k in 0..SIX {
            result[k] = result[k] - off[k];
        }
        Some(result)
    }

    /// The machines where some variables are held at an end; none where they are not enclosed.
    fn narrowed(&self, ends: &[i8]) -> Option<Rc<Narrowed>> {
        if let Some(known) = self.narrowed.borrow().get(ends) {
            return known.clone();
        }
        // Where all is loose, so is what follows from it; but a vertex is a vertex.
        let loose = self.first.inverse.excess() > LOOSE && ends.contains(&0);
        let narrowed = if loose { None } else { self.narrow(ends) };
        let narrowed = narrowed.or_else(|| self.proven(ends)).map(Rc::new);
        self.narrowed.borrow_mut().insert(ends.to_vec(), narrowed.clone());
        narrowed
    }

    /// The same by a proof of its own.
    fn proven(&self, ends: &[i8]) -> Option<Narrowed> {
        let sides: Vec<Interval> =
            ends.iter().enumerate().map(|(variable, &end)| self.side(variable, end)).collect();
        let proven = self.extent.enclose(&sides, &self.first.pose).ok()?;
        // The root over the smaller part is the one proved over the whole.
        let same = lies_in(&proven.middle, &self.first.unique_in);
        let Enclosed { middle, slopes, .. } = proven;
        same.then(|| Narrowed { middle, chords: slopes.clone(), slopes })
    }

    fn narrow(&self, ends: &[i8]) -> Option<Narrowed> {
        let sides: Vec<Interval> =
            ends.iter().enumerate().map(|(variable, &end)| self.side(variable, end)).collect();
        let middles: Vec<Interval> = sides.iter().map(|side| point(side.midpoint())).collect();
        let middle = self.root(&middles)?;
        let varies = |variable: usize| sides[variable].lower < sides[variable].upper;
        if !(0..sides.len()).any(varies) {
            return Some(Narrowed { middle, chords: Vec::new(), slopes: Vec::new() });
        }
        let Extent { machine, command: (q, at), deviating, .. } = self.extent;
        let p = self.extent.parameters(&sides);
        // From the middle on: first to the deviations, where only they vary, then with the displacement.
        let spread = derivatives(machine, &p, q, at, &middle);
        let gradient = |parameter| spread.closures.to_parameter(machine, parameter);
        let mut chords = deviating.columns(varies, gradient);
        let mut outer = middle;
        for variable in (0..sides.len()).filter(|&variable| varies(variable)) {
            let away = sides[variable] - middles[variable];
            add_multiple(&mut outer, &self.first.slopes[variable], away);
        }
        for (outer, whole) in outer.iter_mut().zip(&self.first.whole) {
            *outer = outer.intersection(*whole)?;
        }
        let over = derivatives(machine, &p, q, at, &outer);
        let inverse = Inverse::of(&over.to_displacement)?;
        let slopes = self.extent.slopes(&over, &inverse, varies);
        for (_, chord) in chords.iter_mut().enumerate().filter(|&(variable, _)| varies(variable)) {
            *chord = inverse.times(chord).map(|value| -value);
        }
        Some(Narrowed { middle, chords, slopes })
    }

    /// The most that `direction . displacement` can be.
    pub fn most(&self, direction: &[f64; SIX]) -> f64 {
        let along_axis = direction.iter().filter(|&&entry| entry != 0.0).count() < 2;
        self.reach(direction, if along_axis { ROUNDING } else { SLACK }).bound
    }

    /// The variable to divide for a lower bound along a direction; none where that is of no use.
    pub fn loosest(&self, direction: &[f64; SIX]) -> Option<usize> {
        self.reach(direction, ROUNDING).loosest
    }

    /// A bound that may be loose by a share `slack`, if that is less work.
    fn reach(&self, direction: &[f64; SIX], slack: f64) -> DirectionBound {
        let Deviating { directions, count, .. } = self.extent.deviating;
        let mut in_direction = vec![false; *count];
        for &member in directions.iter().flatten() {
            in_direction[member] = true;
        }
        // Of a unit vector t, slopes . t is at most the length of the slopes (Cauchy and Schwarz).
        let farthest = |slopes: &[Six]| {
            let length = |members: &Vec<usize>| {
                let squares = members.iter().map(|&one| along(direction, &slopes[one]).square());
                squares.fold(point(0.0), |sum, square| sum + square).sqrt()
            };
            directions.iter().map(length).fold(point(0.0), |sum, one| sum + one)
        };
        let mut ends = vec![0_i8; *count];
        let mut own: Option<Rc<Narrowed>> = None;
        let mut best = f64::INFINITY;
        let mut loosest = None;
        for _ in 0..ROUNDS {
            let (middle, chords, slopes) = match own.as_deref() {
                None => (&self.first.middle, None, &self.first.slopes),
                Some(narrowed) => (&narrowed.middle, Some(&narrowed.chords), &narrowed.slopes),
            };
            let mut bound = along(direction, middle);
            let mut fixed = false;
            let mut uncertain: Vec<(usize, i8)> = Vec::new();
            let mut more = point(0.0);
            let mut least_certain = 0.0;
            loosest = None;
            for (variable, slope) in slopes.iter().enumerate() {
                if in_direction[variable] || ends[variable] != 0 {
                    continue;
                }
                let slope = along(direction, slope);
                let chord = chords.map_or(slope, |chords| along(direction, &chords[variable]));
                let side = self.sides[variable];
                bound = bound + chord * (side - point(side.midpoint()));
                if side.lower == side.upper {
                    continue;
                }
                if slope.lower >= 0.0 || slope.upper <= 0.0 {
                    ends[variable] = if slope.lower >= 0.0 { 1 } else { -1 };
                    fixed = true;
                    continue;
                }
                // From its better end, what the other way may add.
                let (end, against) =
                    if slope.upper > -slope.lower { (1, -slope.lower) } else { (-1, slope.upper) };
                uncertain.push((variable, end));
                more = more + point(against) * (point(side.upper) - point(side.lower));
                let size = (slope.upper - slope.lower) * side.radius();
                if size > least_certain {
                    (least_certain, loosest) = (size, Some(variable));
                }
            }
            bound = bound + farthest(chords.unwrap_or(slopes));
            best = best.min(bound.upper);
            // All signs are certain, or what those that are not add is little enough.
            let settled = more.upper <= slack * best.abs();
            if settled || !fixed {
                // No smaller box is certain of more. From the better ends on: where a sign becomes certain
                // this goes over into the bound of the smaller box, without a jump.
                uncertain.iter().for_each(|&(variable, end)| ends[variable] = end);
                let Some(last) = self.narrowed(&ends) else { break };
                let reached = along(direction, &last.middle) + more + farthest(&last.chords);
                best = best.min(reached.upper);
                if settled && directions.is_empty() {
                    loosest = None;
                }
                break;
            }
            // A smaller part that cannot be enclosed leaves the bound as it is.
            let Some(next) = self.narrowed(&ends) else { break };
            own = Some(next);
        }
        DirectionBound { bound: best, loosest }
    }

    /// Bounds over the part.
    pub fn bounds(&self, closeness: &Closeness) -> Bounds {
        targets(self.extent.machine, &self.first.whole, closeness, |u| self.most(u))
    }
}

/// Whether a place certainly lies in a box.
pub fn lies_in(place: &Six, outer: &Six) -> bool {
    place.iter().zip(outer).all(|(one, outer)| one.lower >= outer.lower && one.upper <= outer.upper)
}

/// How far the machine goes with each variable, to first order.
fn effects(to_displacement: &Square, varying: &[Varying]) -> Vec<f64> {
    let inverse = inverse_of(&to_displacement.map(|row| row.map(Interval::midpoint)));
    let size = |(column, extent): &Varying| {
        let step = |row: &[f64; SIX]| -> f64 {
            row.iter().zip(column).map(|(entry, value)| entry * value.midpoint()).sum()
        };
        let total: f64 = inverse.iter().map(|row| step(row).abs()).sum();
        if total.is_finite() { total * extent.magnitude() } else { extent.magnitude() }
    };
    varying.iter().map(size).collect()
}

impl PoseBound {
    /// Of the bounds of all targets.
    pub fn of(values: &[f64; TARGETS]) -> Self {
        let mut result = PoseBound { lower: [0.0; SIX], upper: [0.0; SIX], magnitudes: [0.0; 2] };
        for k in 0..SIX {
            result.upper[k] = values[k];
            result.lower[k] = -values[SIX + k];
        }
        result.magnitudes.copy_from_slice(&values[2 * SIX..]);
        result
    }
}
