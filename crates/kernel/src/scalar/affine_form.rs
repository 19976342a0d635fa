//! A number that varies nearly linearly over a box: an affine form, rounding included.
//!
//! `middle + sum of slopes[k] e_k + r`, where the variables e_k, in [-1, 1], are the same in every form
//! that takes part, and r is anything in [-rest, rest] (Comba and Stolfi, "Affine arithmetic and its
//! applications to computer graphics", SIBGRAPI 1993, with the remainders of all operations collected in
//! one). What forms have in common cancels, which between intervals it does not. Of any operation the
//! remainder is of second order in the box.
//!
//! **Ranges.** Every operation is done on intervals as well: a form's numbers lie in its `range`, too. Where
//! an operation is not defined or not smooth over that range, the result is what the interval knows.
//!
//! **Rounding.** An operation adds [`STEPS`] times the size of all its terms to the remainder: more than the
//! at most 3 M + 10 roundings of half a step each that go into one, M being at most 6.
//!
//! Operations are calls: inlined into every closure they would take minutes to compile, and a call is short
//! beside one.

use super::{Enclosing, Interval, Scalar};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Times the sizes of an operation's terms: more than their rounding.
const STEPS: f64 = 32.0 * f64::EPSILON;

/// A number of the form `middle + slopes . e` with a remainder of at most `rest`, and in `range`.
#[derive(Clone, Copy, Debug)]
pub struct AffineForm<const M: usize> {
    /// At the middle of the box.
    pub middle: f64,
    /// Per variable.
    pub slopes: [f64; M],
    /// The largest remainder; infinite where nothing but the range is known.
    pub rest: f64,
    /// Holds every value.
    pub range: Interval,
}

impl<const M: usize> AffineForm<M> {
    /// A number of which no more is known than where it lies.
    #[inline]
    pub fn from_interval(range: Interval) -> Self {
        let rest = if range.lower == range.upper { 0.0 } else { range.radius() };
        AffineForm { middle: range.midpoint(), slopes: [0.0; M], rest, range }
    }

    /// A number in `range` that is `middle` in the middle of the box, whose rate per unit of variable k lies
    /// in `rates[k]` all over it (mean value theorem).
    #[inline]
    pub fn of_rates(middle: Interval, rates: &[Interval; M], range: Interval) -> Self {
        let mut slopes = [0.0; M];
        let (mut rest, mut size) = (middle.radius(), middle.magnitude());
        for k in 0..M {
            slopes[k] = rates[k].midpoint();
            rest += rates[k].radius();
            size += rates[k].magnitude();
        }
        Self::collected(middle.midpoint(), slopes, rest, size, range)
    }

    /// Variable k itself.
    #[inline]
    pub fn variable(k: usize) -> Self {
        let mut one = Self::from_interval(Interval::symmetric(1.0));
        (one.slopes[k], one.rest) = (1.0, 0.0);
        one
    }

    /// Its mean over the straight way from the middle of the box to a point: of the linear part a half.
    #[inline]
    pub fn mean_from_middle(self) -> Self {
        let mut slopes = self.slopes;
        for k in 0..M {
            slopes[k] *= 0.5;
        }
        // Half of a number is exact unless it underflows.
        Self::collected(self.middle, slopes, self.rest, f64::MIN_POSITIVE, self.range)
    }

    /// Exactly nothing, as much of what is differentiated is.
    #[inline(always)]
    fn is_zero(&self) -> bool {
        self.range.lower == 0.0 && self.range.upper == 0.0
    }

    /// How far it can be from the middle, but for rounding.
    #[inline]
    fn deviation(&self) -> f64 {
        let mut sum = self.rest;
        for k in 0..M {
            sum += self.slopes[k].abs();
        }
        sum
    }

    /// Of terms whose sizes add up to `size`.
    #[inline(always)]
    fn collected(middle: f64, slopes: [f64; M], rest: f64, size: f64, range: Interval) -> Self {
        // What underflows in some products is less than the smallest normal number.
        let tiny = if size > 0.0 { f64::MIN_POSITIVE } else { 0.0 };
        let rest = (rest + size * STEPS) * (1.0 + STEPS) + tiny;
        let result = AffineForm { middle, slopes, rest, range };
        let deviation = result.deviation() * (1.0 + STEPS);
        let (lower, upper) = (middle - deviation, middle + deviation);
        let more = (middle.abs() + deviation) * STEPS;
        // Neither infinite nor NaN.
        if !(upper - lower < f64::INFINITY) {
            return Self::from_interval(range);
        }
        // No common number where both are of an operation that is not defined anywhere.
        match Interval::new(lower - more, upper + more).intersection(range) {
            Some(range) => AffineForm { range, ..result },
            None => Self::from_interval(range),
        }
    }

    /// The product with one number.
    #[inline(never)]
    pub fn scaled(self, factor: f64) -> Self {
        let mut slopes = self.slopes;
        for k in 0..M {
            slopes[k] *= factor;
        }
        let size = (self.middle.abs() + self.deviation()) * factor.abs();
        let range = self.range.scaled(factor);
        Self::collected(self.middle * factor, slopes, self.rest * factor.abs(), size, range)
    }

    /// A smooth function in `range`: its value and derivative at the middle, and its second derivative over
    /// all numbers between middle and range: f(m) + f'(m) d + f''(.) d^2 / 2.
    #[inline(always)]
    fn chain(self, value: Interval, first: Interval, second: Interval, range: Interval) -> Self {
        let deviation = self.deviation() * (1.0 + STEPS);
        let curved = second * Interval::new(0.0, 0.5 * deviation * deviation * (1.0 + STEPS));
        let slope = first.midpoint();
        let mut slopes = self.slopes;
        for k in 0..M {
            slopes[k] *= slope;
        }
        let rest =
            slope.abs() * self.rest + first.radius() * deviation + value.radius() + curved.radius();
        let middle = value.midpoint() + curved.midpoint();
        let size = value.magnitude() + curved.magnitude() + first.magnitude() * deviation;
        Self::collected(middle, slopes, rest, size, range)
    }

    /// All numbers between the middle and the range.
    #[inline]
    fn domain(&self) -> Interval {
        self.range.hull(Interval::point(self.middle))
    }
}

impl<const M: usize> Add for AffineForm<M> {
    type Output = Self;
    #[inline(never)]
    fn add(self, other: Self) -> Self {
        if self.is_zero() {
            return other;
        }
        if other.is_zero() {
            return self;
        }
        let mut slopes = self.slopes;
        for k in 0..M {
            slopes[k] += other.slopes[k];
        }
        let size = self.middle.abs() + other.middle.abs() + (self.deviation() + other.deviation());
        let range = self.range + other.range;
        Self::collected(self.middle + other.middle, slopes, self.rest + other.rest, size, range)
    }
}

impl<const M: usize> Sub for AffineForm<M> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<const M: usize> Mul for AffineForm<M> {
    type Output = Self;
    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        let range = self.range * other.range;
        if range.lower == 0.0 && range.upper == 0.0 {
            return Self::from_interval(range);
        }
        let (a, b) = (self.deviation(), other.deviation());
        let mut slopes = [0.0; M];
        // Of a e_k times b e_k the square lies between 0 and 1: half of it is known.
        let (mut half, mut known) = (0.0, 0.0);
        for k in 0..M {
            slopes[k] = self.middle * other.slopes[k] + other.middle * self.slopes[k];
            let product = 0.5 * self.slopes[k] * other.slopes[k];
            half += product;
            known += product.abs();
        }
        let rest = self.middle.abs() * other.rest
            + other.middle.abs() * self.rest
            + (a * b - known * (1.0 - STEPS));
        let size = (self.middle.abs() + a) * (other.middle.abs() + b);
        Self::collected(self.middle * other.middle + half, slopes, rest, size, range)
    }
}

impl<const M: usize> Div for AffineForm<M> {
    type Output = Self;
    #[inline(never)]
    fn div(self, other: Self) -> Self {
        let domain = other.domain();
        let range = self.range / other.range;
        if domain.contains(0.0) || !(other.rest < f64::INFINITY) {
            return Self::from_interval(range);
        }
        let one = Interval::point(1.0);
        let value = one / Interval::point(other.middle);
        let over = one / domain;
        let second = over * over.square() * Interval::point(2.0);
        let inverse = other.chain(value, -value.square(), second, one / other.range);
        let quotient = self * inverse;
        match quotient.range.intersection(range) {
            Some(range) => AffineForm { range, ..quotient },
            None => quotient,
        }
    }
}

impl<const M: usize> Neg for AffineForm<M> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        let mut slopes = self.slopes;
        for k in 0..M {
            slopes[k] = -slopes[k];
        }
        AffineForm { middle: -self.middle, slopes, rest: self.rest, range: -self.range }
    }
}

impl<const M: usize> Scalar for AffineForm<M> {
    #[inline(never)]
    fn lift(self, value: f64) -> Self {
        Self::from_interval(Interval::point(value))
    }
    #[inline]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    #[inline(never)]
    fn square(self) -> Self {
        let product = self * self;
        match product.range.intersection(self.range.square()) {
            Some(range) => AffineForm { range, ..product },
            None => product,
        }
    }
    #[inline]
    fn square_plus(self, term: Self) -> Self {
        self.square() + term
    }
    #[inline(never)]
    fn sqrt(self) -> Self {
        let (domain, range) = (self.domain(), self.range.sqrt());
        if !(domain.lower > 0.0 && self.rest < f64::INFINITY) {
            return Self::from_interval(range);
        }
        let value = Interval::point(self.middle).sqrt();
        let first = Interval::point(0.5) / value;
        let second = Interval::point(-0.25) / (domain * domain.sqrt());
        self.chain(value, first, second, range)
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let ranges = self.range.sin_cos();
        if !(self.rest < f64::INFINITY) {
            return (Self::from_interval(ranges.0), Self::from_interval(ranges.1));
        }
        let (sine, cosine) = Interval::point(self.middle).sin_cos();
        let (over_sine, over_cosine) = self.domain().sin_cos();
        (
            self.chain(sine, cosine, -over_sine, ranges.0),
            self.chain(cosine, -sine, -over_cosine, ranges.1),
        )
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        Self::from_interval(self.range.atan2(x.range))
    }
    #[inline(never)]
    fn select(self, then: Self, otherwise: Self) -> Self {
        if self.range.lower >= 0.0 && !self.range.upper.is_nan() {
            then
        } else if self.range.upper < 0.0 && !self.range.lower.is_nan() {
            otherwise
        } else {
            Self::from_interval(then.range.hull(otherwise.range))
        }
    }
}

impl<const M: usize> Enclosing for AffineForm<M> {
    fn from_interval(value: Interval) -> Self {
        AffineForm::from_interval(value)
    }
    fn scaled(self, factor: f64) -> Self {
        AffineForm::scaled(self, factor)
    }
}
