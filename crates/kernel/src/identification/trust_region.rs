//! Nonlinear least squares: a scaled trust region on linear models that are compressed to triangles.
//!
//! Each step minimises the linearised sum of squares inside an ellipsoid, |D p| <= radius, whose axes D are the largest
//! column norms that the slope had so far, so that the units of the unknowns do not matter. A sound triangle whose whole
//! step fits gives it by back substitution; else it is found from the singular values of the triangle, the multiplier
//! by Newton's iteration on the reciprocal of the step's length.
//!
//! J. J. More, The Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes in Mathematics 630 (1978)
//! 105-116. J. Nocedal and S. J. Wright, Numerical Optimization, 2nd ed. (2006), chapters 4 and 10.

pub use super::dense::{Linear, square_sum};
use super::dense::{Singular, norm};
use std::fmt;

/// A step is taken that lowers the cost by at least this share of what the linear model promised.
const ACCEPTED: f64 = 1e-4;
/// Below and above these shares of the promise the trust region shrinks and widens.
const SHRUNK: f64 = 0.25;
const WIDENED: f64 = 0.75;
/// Decreases of the cost below this share are taken to be lost in its rounding, which that of the data adds to where
/// residuals are small differences: there the linear model is believed.
const NOISE: f64 = 1e-11;
/// Cosine between residual and slope above which a point is no optimum, however short the steps, if the linear model
/// wants to go `FAR`: there the slope is wrong, or the residual too rough.
const STEEP: f64 = 1e-3;
/// In the norm |D x|: a longer way than rounding leaves to a root.
const FAR: f64 = 1e-6;
/// A cost below this share of the first is that of a root, whatever the slope says: ten digits of every residual are
/// gone, which a wrong slope does not do.
const ROOT: f64 = 1e-20;
/// The step's length may miss the radius of the trust region by this share.
const HELD: f64 = 0.1;
/// Newton steps on the multiplier; two or three do, the rest is safety.
const MULTIPLIER_STEPS: usize = 20;
/// A column so much shorter than another, in the norm D, may be rounding: only singular values tell.
const SHORT: f64 = 1e-6;
/// After a step that promised at most this share of the cost the triangle is kept, and only the gradient is taken anew.
const KEPT: f64 = 1e-3;
/// A kept triangle serves while each step is shorter than the last by this factor.
const CONTRACTION: f64 = 0.05;
/// A trust region without bounds; its square is still a number.
const BOUNDLESS: f64 = 1e150;

/// A sum of squares to be minimised, with the linear models of its residual.
pub trait Problem {
    /// How many unknowns there are.
    fn size(&self) -> usize;
    /// Sum of squares at the values (n,); none where the model does not reach so far.
    fn cost(&mut self, values: &[f64]) -> Option<f64>;
    /// Linearises at the values, where the cost was evaluated just before; false where that is not finite, and whatever
    /// `linear` then holds is not looked at.
    fn linearise(&mut self, values: &[f64], linear: &mut Linear) -> bool;
    /// The gradient (n,), slope^T residual, at the values, where the cost was evaluated just before; false where it is not
    /// to be had for much less than a linear model.
    fn gradient(&mut self, _values: &[f64], _gradient: &mut [f64]) -> bool {
        false
    }
    /// Whether the linear model where the iteration ends is asked for.
    fn linearises_last(&self) -> bool {
        true
    }
    /// Whether to give up at once, as after an error outside.
    fn interrupted(&self) -> bool {
        false
    }
}

/// When to stop, all relative, so that no unit matters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Decrease of the sum of squares that the linear model promises; far below rounding of the sum itself, since a
    /// value's digits are the square root of it.
    pub cost: f64,
    /// The step, or the trust region, in the norm |D x|.
    pub step: f64,
    /// Largest cosine between the residual and a column of the slope.
    pub gradient: f64,
}

impl Default for Tolerances {
    fn default() -> Self {
        Tolerances { cost: 1e-24, step: 1e-12, gradient: 1e-13 }
    }
}

/// How to go about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// When to stop.
    pub tolerances: Tolerances,
    /// The most evaluations of the cost.
    pub most_evaluations: usize,
    /// Size of the first trust region, above zero, in units of |D start| where that is not zero; infinite: the first
    /// step is a whole one.
    pub first_radius: f64,
    /// A sum of squares that is only rounding of the residual: below it nothing is to be found. Zero or more.
    pub rounding: f64,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            tolerances: Tolerances::default(),
            most_evaluations: 10_000,
            first_radius: 1.0,
            rounding: 0.0,
        }
    }
}

/// Which test ended the iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Converged: no more decrease of the cost is to be had.
    Cost,
    /// Converged: the steps do not change the values any more.
    Step,
    /// Converged: the residual is at right angles to the slope.
    Gradient,
    /// No step lowers the cost although no test of convergence holds: a wrong slope does that, or one that is nowhere
    /// finite about the point.
    Stalled,
    /// The evaluations allowed were used up.
    Exhausted,
}

impl Status {
    /// The name in Python.
    pub fn name(self) -> &'static str {
        match self {
            Status::Cost => "cost",
            Status::Step => "step",
            Status::Gradient => "gradient",
            Status::Stalled => "stalled",
            Status::Exhausted => "exhausted",
        }
    }

    /// Whether a convergence test held.
    pub fn converged(self) -> bool {
        matches!(self, Status::Cost | Status::Step | Status::Gradient)
    }
}

/// Where the iteration ended.
#[derive(Clone, Debug)]
pub struct Solution {
    /// (n,)
    pub values: Vec<f64>,
    /// Sum of squares there.
    pub cost: f64,
    /// Which test ended it.
    pub status: Status,
    /// How often the cost was evaluated.
    pub evaluations: usize,
    /// How many steps were taken.
    pub iterations: usize,
}

/// Why there is nothing to iterate on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The residual or its slope is not finite at the start.
    Start,
    /// The start or the scale has another size than the problem, or a scale is not finite and above zero.
    Scale,
    /// The first radius is not above zero.
    Radius,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Refusal::Start => "the residual or its Jacobian is not finite at the start",
            Refusal::Scale => "a finite scale above zero is wanted for every value",
            Refusal::Radius => "the first radius is not above zero",
        })
    }
}

impl std::error::Error for Refusal {}

/// Values that minimise the problem's sum of squares, from a start (n,).
///
/// `scale` (n,): typical size of a change of each value, above zero; without it, it is found from the slope's columns,
/// and the tolerance of the step is relative to the values alone, else to the scale too. Fewer equations than
/// unknowns, and directions that no equation sees, are allowed: the values do not move along them.
pub fn minimise(
    problem: &mut impl Problem,
    start: &[f64],
    scale: Option<&[f64]>,
    options: &Options,
) -> Result<Solution, Refusal> {
    let size = problem.size();
    let fits =
        |scale: &[f64]| scale.len() == size && scale.iter().all(|s| s.is_finite() && *s > 0.0);
    if start.len() != size || !scale.is_none_or(fits) {
        return Err(Refusal::Scale);
    }
    if !(options.first_radius > 0.0) {
        return Err(Refusal::Radius);
    }
    let limits = &options.tolerances;
    let mut values = start.to_vec();
    let (mut linear, mut next) = (Linear::new(size), Linear::new(size));
    let mut cost = problem.cost(&values).filter(|cost| cost.is_finite()).ok_or(Refusal::Start)?;
    if !problem.linearise(&values, &mut linear) {
        return Err(Refusal::Start);
    }
    let first_cost = cost;
    let (mut evaluations, mut iterations) = (1, 0);
    let mut axes = Axes::new(scale, &linear);
    let mut extent = axes.extent(&values);
    let unit = axes.length(&values);
    let mut radius = options.first_radius * if unit > 0.0 { unit } else { 1.0 };
    radius = radius.min(BOUNDLESS);
    let mut promise = Promise::new(&linear, &axes.of, cost);
    // What the model promised when it was last believed, and whether a trial failed since.
    let (mut last, mut rough) = (f64::INFINITY, false);
    // Whether the triangle is that of an earlier point.
    let mut kept = false;
    let mut gradient = vec![0.0; size];
    let status = 'ended: loop {
        if promise.cosine <= limits.gradient {
            break Status::Gradient;
        }
        if cost <= options.rounding {
            break Status::Cost;
        }
        loop {
            let (step, multiplier) = promise.step(&linear, &axes.of, radius);
            let length = axes.length(&step);
            if iterations == 0 {
                radius = radius.min(length);
            }
            let there: Vec<f64> = values.iter().zip(&step).map(|(value, by)| value + by).collect();
            let tried = problem.cost(&there).filter(|tried| tried.is_finite());
            evaluations += 1;
            let (promised, half_slope) = promised(&linear, &step, multiplier, length, cost);
            // Far worse, or not finite: nothing is won by knowing how much.
            let actual = match tried {
                Some(tried) if tried < 100.0 * cost => 1.0 - tried / cost,
                _ => -1.0,
            };
            let share = if promised > 0.0 { actual / promised } else { 0.0 };
            let rounding = promised <= NOISE && actual.abs() <= NOISE;
            let held = if rounding { 1.0 } else { share };
            radius = next_radius(radius, length, held, multiplier, actual, half_slope);
            let mut taken = rounding || share >= ACCEPTED;
            let cost_there = tried.unwrap_or(cost);
            let settled = cost_there <= options.rounding
                || rounding && (promised <= limits.cost || promised > 0.5 * last);
            if taken && settled && !problem.linearises_last() {
                (values, cost) = (there, cost_there);
                iterations += 1;
                break 'ended Status::Cost;
            }
            // Once steps are short a chord does: the same triangle with the gradient there.
            let chord = taken
                && promised <= KEPT
                && multiplier == 0.0
                && linear.of_normal
                && problem.gradient(&there, &mut gradient)
                && linear.way_with(&gradient, &axes.of) <= CONTRACTION * length;
            if chord {
                linear.set_gradient(&gradient);
                kept = true;
            } else if taken {
                if problem.linearise(&there, &mut next) {
                    std::mem::swap(&mut linear, &mut next);
                    kept = false;
                } else {
                    (taken, radius) = (false, 0.5 * radius.min(length));
                }
            }
            if problem.interrupted() {
                break 'ended Status::Stalled;
            }
            if taken {
                (values, cost) = (there, cost_there);
                extent = axes.extent(&values);
                iterations += 1;
            }
            let root = cost <= ROOT * first_cost;
            let optimal = root || !(promise.cosine > STEEP && promise.way > FAR * extent);
            if cost <= options.rounding {
                break 'ended Status::Cost;
            }
            if rounding && (promised <= limits.cost || promised > 0.5 * last) {
                break 'ended Status::Cost;
            }
            if radius.min(length) <= limits.step * extent {
                break 'ended if optimal || taken { Status::Step } else { Status::Stalled };
            }
            if !taken && promised <= f64::EPSILON * f64::EPSILON {
                break 'ended if root { Status::Cost } else { Status::Stalled };
            }
            if rounding && rough {
                // Believed again after the model failed: the residual here is its own rounding.
                break 'ended if optimal { Status::Cost } else { Status::Stalled };
            }
            if evaluations >= options.most_evaluations {
                break 'ended Status::Exhausted;
            }
            if rounding {
                (last, rough) = (promised, false);
            } else if taken {
                (last, rough) = (f64::INFINITY, false);
            } else {
                rough = last.is_finite();
            }
            if taken {
                break;
            }
            if kept {
                // It may be the triangle that fails.
                kept = false;
                evaluations += 1;
                if problem.cost(&values).is_some() && problem.linearise(&values, &mut next) {
                    std::mem::swap(&mut linear, &mut next);
                    break;
                }
            }
        }
        axes.widen(&linear);
        promise = Promise::new(&linear, &axes.of, cost);
    };
    Ok(Solution { values, cost, status, evaluations, iterations })
}

/// The scale D of the trust region: 1 / given scale, or the largest column norms so far.
struct Axes {
    of: Vec<f64>,
    given: bool,
}

impl Axes {
    fn new(scale: Option<&[f64]>, linear: &Linear) -> Self {
        let own = |norm: &f64| if *norm > 0.0 { *norm } else { 1.0 };
        Axes {
            of: scale.map_or_else(
                || linear.columns.iter().map(own).collect(),
                |scale| scale.iter().map(|s| 1.0 / s).collect(),
            ),
            given: scale.is_some(),
        }
    }

    fn widen(&mut self, linear: &Linear) {
        if !self.given {
            self.of
                .iter_mut()
                .zip(linear.columns.iter())
                .for_each(|(axis, c)| *axis = axis.max(*c));
        }
    }

    /// |D x|.
    fn length(&self, x: &[f64]) -> f64 {
        norm(&self.of.iter().zip(x).map(|(axis, value)| axis * value).collect::<Vec<f64>>())
    }

    /// What a step at these values is small against. The scale that was found says nothing of the values' size, one
    /// that was given does.
    fn extent(&self, values: &[f64]) -> f64 {
        let length = self.length(values);
        if self.given { length.max(1.0) } else { length }
    }
}

/// The linear model about one point.
struct Promise {
    /// Largest cosine between the residual and a column.
    cosine: f64,
    /// Length |D p| of the step that makes the model least.
    way: f64,
    whole: Vec<f64>,
    /// Once it is needed.
    singular: Option<Singular>,
}

impl Promise {
    fn new(linear: &Linear, axes: &[f64], cost: f64) -> Self {
        let length = if cost > 0.0 { cost.sqrt() } else { 1.0 };
        let columns = linear.gradient.iter().zip(linear.columns.iter());
        let cosines = columns.map(|(g, c)| (g / if *c > 0.0 { *c } else { 1.0 } / length).abs());
        let cosine = cosines.fold(0.0, f64::max);
        let scaled = linear.columns.iter().zip(axes).map(|(c, axis)| c / axis);
        let most = scaled.clone().fold(0.0, f64::max);
        let mut promise = Promise { cosine, way: 0.0, whole: Vec::new(), singular: None };
        if linear.trusted && scaled.into_iter().all(|column| column >= SHORT * most) {
            promise.whole = linear.whole();
            let away = promise.whole.iter().zip(axes).map(|(p, axis)| p * axis);
            promise.way = norm(&away.collect::<Vec<f64>>());
        } else {
            let singular = Singular::new(linear, axes);
            let whole: Vec<f64> = coordinates(&singular, 0.0).collect();
            promise.way = norm(&whole);
            promise.whole = singular.step(whole.into_iter(), axes);
            promise.singular = Some(singular);
        }
        promise
    }

    /// The step (n,) inside the trust region, and its multiplier, 0 where the region is wide.
    fn step(&mut self, linear: &Linear, axes: &[f64], radius: f64) -> (Vec<f64>, f64) {
        if !(self.way > (1.0 + HELD) * radius) {
            return (self.whole.clone(), 0.0);
        }
        let singular = self.singular.get_or_insert_with(|| Singular::new(linear, axes));
        let damping = multiplier(singular, radius);
        (singular.step(coordinates(singular, damping), axes), damping)
    }
}

/// Along each right vector, how far to go with a multiplier.
fn coordinates(singular: &Singular, multiplier: f64) -> impl Iterator<Item = f64> {
    singular.values.iter().zip(&singular.turned).map(move |(&s, &c)| {
        if !(s > 0.0) {
            0.0
        } else if multiplier > 0.0 {
            -s * c / (s * s + multiplier)
        } else {
            -c / s
        }
    })
}

/// Newton's iteration on 1 / |p(m)| - 1 / radius (More 1978, equations 5.4-5.8).
fn multiplier(singular: &Singular, radius: f64) -> f64 {
    let pairs = singular.values.iter().zip(&singular.turned);
    let (s, c): (Vec<f64>, Vec<f64>) =
        pairs.filter(|(s, _)| **s > 0.0).map(|(s, c)| (*s, *c)).unzip();
    let length_at = |of: &dyn Fn(usize) -> f64| norm(&(0..s.len()).map(of).collect::<Vec<f64>>());
    let mut upper = length_at(&|k| s[k] * c[k]) / radius;
    let whole = length_at(&|k| c[k] / s[k]);
    // |d|p|/dm| at m = 0 gives a lower bound of the multiplier; a length of infinity gives none.
    let slope = (0..s.len()).map(|k| (c[k] / (s[k] * s[k])).powi(2)).sum::<f64>() / whole;
    let below = if slope.is_finite() && slope > 0.0 { (whole - radius) / slope } else { 0.0 };
    let mut lower = below.max(0.0);
    let mut damping = lower.max(1e-3 * upper).min(upper);
    for _ in 0..MULTIPLIER_STEPS {
        let length = length_at(&|k| s[k] * c[k] / (s[k] * s[k] + damping));
        if (length - radius).abs() <= HELD * radius {
            break;
        }
        if length < radius {
            upper = damping;
        } else {
            lower = lower.max(damping);
        }
        let parts = (0..s.len()).map(|k| (s[k] * c[k]).powi(2) / (s[k] * s[k] + damping).powi(3));
        damping += (length - radius) / radius * length / (parts.sum::<f64>() / length);
        if !(lower < damping && damping < upper) {
            damping = (1e-3 * upper).max((lower * upper).sqrt());
        }
    }
    damping
}

/// Share of the cost that the model promises to take away, and half its slope at 0.
fn promised(linear: &Linear, step: &[f64], multiplier: f64, length: f64, cost: f64) -> (f64, f64) {
    let size = cost.sqrt();
    let along = (linear.along(step) / size).powi(2);
    let held = multiplier * (length / size).powi(2);
    (along + 2.0 * held, -(along + held))
}

/// The next radius: by how well the linear model held (More 1978, section 7).
fn next_radius(
    radius: f64,
    length: f64,
    share: f64,
    multiplier: f64,
    actual: f64,
    half_slope: f64,
) -> f64 {
    if share <= SHRUNK {
        // Of the parabola through the cost here, its slope, and the cost at the trial.
        let known = actual < 0.0 && half_slope.is_finite();
        let cut = if known { 0.5 * half_slope / (half_slope + 0.5 * actual) } else { 0.5 };
        return cut.clamp(0.1, 0.5) * radius.min(10.0 * length);
    }
    if multiplier == 0.0 || share >= WIDENED { 2.0 * length } else { radius }
}

#[cfg(test)]
mod tests;
