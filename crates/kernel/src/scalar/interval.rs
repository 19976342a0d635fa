//! Outward rounded intervals: the result contains the exact value for every point of the operands.
//!
//! **Rounding.** IEEE 754 arithmetic and square root err by at most half a step of the result, so a
//! bound that is computed to nearest and then moved outward by at least one step encloses. Each
//! operation has two ways:
//!
//! - the short one moves a bound `b` by `|b| STEP`, one to two steps of any normal number, without a
//!   branch. It is left whenever a result is not finite or may have underflowed, where that is too
//!   little;
//! - the rare one moves by exactly one step (`next_down`, `next_up`), reads what has no number first
//!   ([`Interval::known`]) and keeps a zero that is exact.
//!
//! **What is a member.** Only real numbers are. An infinite bound says that there is none on that
//! side; so 0 times an unbounded interval is 0, and an upper bound is never minus infinity. A bound
//! that is NaN is read as no bound, and only a negation, a choice or a term passes it on. Of all that
//! [`Interval::new`] makes, `lower <= upper`: there is no empty interval.
//!
//! **Where an operation is not defined** for every point of its operands, nothing is known of a
//! quotient (the divisor holds zero) and of the root of a negative interval: the result is
//! [`Interval::ENTIRE`]. The root of an interval that is partly negative is that of its other part,
//! because the rounding of an exact zero must not spoil a length; so a finite root alone does not
//! prove that there is one at every point.
//!
//! In WebAssembly operations are calls: inlined into every closure they would be a third of a page's kernel.

use super::Scalar;
use std::f64::consts::{FRAC_2_PI, PI};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// All numbers from `lower` to `upper`, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower bound; minus infinity where nothing is known.
    pub lower: f64,
    /// Upper bound; plus infinity where nothing is known.
    pub upper: f64,
}

/// Times a normal number: one to two of its steps.
const STEP: f64 = f64::EPSILON;
/// Times the sum of a product and a sum that holds it: more than half a step of both, and a half more
/// of the sum for the rounding of the subtraction.
const TWO_STEPS: f64 = 1.5 * f64::EPSILON;
/// Products above this have neither underflowed nor does [`TWO_STEPS`] of them.
const SAFE: f64 = 1e-280;

/// The smaller of two numbers.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger of two numbers.
#[inline(always)]
fn most(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// How far a function of the library may err: four steps, generously.
#[inline(always)]
fn library_error(value: f64) -> f64 {
    4.0 * (value.abs() * f64::EPSILON + f64::from_bits(1))
}

/// The largest whole number that is not above a moderate `value`: `floor` is a library call on
/// processors of the first 64-bit generation.
#[inline(always)]
fn whole_below(value: f64) -> i64 {
    let towards_zero = value as i64;
    towards_zero - (towards_zero as f64 > value) as i64
}

impl Interval {
    /// Every number.
    pub const ENTIRE: Interval = Interval { lower: f64::NEG_INFINITY, upper: f64::INFINITY };

    const ZERO: Interval = Interval { lower: 0.0, upper: 0.0 };

    /// The interval from `lower` to `upper`, which must not be the smaller; NaN is no bound.
    #[inline(always)]
    pub fn new(lower: f64, upper: f64) -> Self {
        debug_assert!(!(lower > upper), "an interval from {lower} to {upper}");
        let given = Interval { lower, upper };
        if lower.abs() < f64::INFINITY && upper.abs() < f64::INFINITY {
            given
        } else {
            given.known()
        }
    }

    /// One number; from infinity, whatever is too large for a number.
    #[inline(always)]
    pub fn point(value: f64) -> Self {
        Self::new(value, value)
    }

    /// All numbers of at most this absolute value.
    #[inline]
    pub fn symmetric(radius: f64) -> Self {
        let radius = radius.abs();
        Self::new(-radius, radius)
    }

    /// Whether `value` lies inside.
    #[inline(always)]
    pub fn contains(self, value: f64) -> bool {
        self.lower <= value && value <= self.upper
    }

    /// Whether all of it lies in the interior of `outer`: a bound that it shares with `outer`, be it
    /// an infinite one, does not.
    #[inline(always)]
    pub fn is_inside(self, outer: Self) -> bool {
        outer.lower < self.lower && self.upper < outer.upper
    }

    /// Whether both bounds are numbers.
    #[inline(always)]
    pub fn is_finite(self) -> bool {
        self.lower.is_finite() && self.upper.is_finite()
    }

    /// A finite number inside, of a finite interval the one in the middle.
    #[inline]
    pub fn midpoint(self) -> f64 {
        let middle = 0.5 * (self.lower + self.upper);
        if middle.is_finite() {
            return middle;
        }
        let Interval { lower, upper } = self.known();
        match (lower.is_finite(), upper.is_finite()) {
            (true, true) => 0.5 * lower + 0.5 * upper,
            (true, false) => f64::MAX,
            (false, true) => f64::MIN,
            (false, false) => 0.0,
        }
    }

    /// At least the distance from [`Interval::midpoint`] to either end.
    #[inline]
    pub fn radius(self) -> f64 {
        let middle = self.midpoint();
        let distance = most(middle - self.lower, self.upper - middle);
        // A difference that is not normal is exact.
        let radius = distance + distance * STEP;
        if self.lower <= self.upper { radius } else { f64::INFINITY }
    }

    /// The product with one number: half the work of the product with an interval.
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    pub fn scaled(self, factor: f64) -> Self {
        let (a, b) = (self.lower * factor, self.upper * factor);
        let (lower, upper) = if factor < 0.0 { (b, a) } else { (a, b) };
        match Self::product(lower, upper) {
            Some(product) => product,
            None => self * Self::point(factor),
        }
    }

    /// The largest absolute value of its numbers.
    #[inline]
    pub fn magnitude(self) -> f64 {
        if self.lower <= self.upper { most(-self.lower, self.upper) } else { f64::INFINITY }
    }

    /// What lies in both; nothing where they have no number in common.
    #[inline]
    pub fn intersection(self, other: Self) -> Option<Self> {
        // `max` and `min` pass over a NaN.
        let (lower, upper) = (self.lower.max(other.lower), self.upper.min(other.upper));
        if lower > upper { None } else { Some(Self::new(lower, upper)) }
    }

    /// The smallest interval that contains both.
    #[inline(always)]
    pub fn hull(self, other: Self) -> Self {
        let ordered = self.lower <= self.upper && other.lower <= other.upper;
        let (a, b) = if ordered { (self, other) } else { (self.known(), other.known()) };
        Interval { lower: least(a.lower, b.lower), upper: most(a.upper, b.upper) }
    }

    /// The same, with NaN read as no bound and an infinity on the wrong side as the largest number.
    #[inline]
    fn known(self) -> Self {
        let Interval { lower, upper } = self;
        Interval {
            lower: if lower.is_nan() { f64::NEG_INFINITY } else { lower.min(f64::MAX) },
            upper: if upper.is_nan() { f64::INFINITY } else { upper.max(f64::MIN) },
        }
    }

    /// One step outward. Sound for every rounded bound; NaN becomes no bound.
    fn stepped(lower: f64, upper: f64) -> Self {
        Interval { lower: lower.next_down(), upper: upper.next_up() }.known()
    }

    /// The short way's bounds, if both are finite numbers that no more than two steps of the largest
    /// number could move away.
    #[inline(always)]
    fn if_finite(lower: f64, upper: f64) -> Option<Self> {
        // Infinite or NaN where one of them is.
        if upper - lower < f64::INFINITY { Some(Interval { lower, upper }) } else { None }
    }

    /// Bounds of a sum, rounded to nearest: outward if the result is finite.
    #[inline(always)]
    fn sum(lower: f64, upper: f64) -> Option<Self> {
        // A sum that is not normal is exact, and zero stays zero.
        Self::if_finite(lower - lower.abs() * STEP, upper + upper.abs() * STEP)
    }

    /// Bounds of products or quotients, rounded to nearest: outward if that is the short way's case.
    #[inline(always)]
    fn product(lower: f64, upper: f64) -> Option<Self> {
        let (below, above) = (lower.abs(), upper.abs());
        if below >= f64::MIN_POSITIVE && above >= f64::MIN_POSITIVE {
            Self::if_finite(lower - below * STEP, upper + above * STEP)
        } else {
            None
        }
    }

    /// The smallest and largest product of the bounds, rounded to nearest; NaN where one is NaN.
    #[inline(always)]
    fn products(self, other: Self) -> (f64, f64) {
        let (a, b) = (self.lower * other.lower, self.lower * other.upper);
        let (c, d) = (self.upper * other.lower, self.upper * other.upper);
        if (a.is_nan() | b.is_nan()) | (c.is_nan() | d.is_nan()) {
            return (f64::NAN, f64::NAN);
        }
        (least(least(a, b), least(c, d)), most(most(a, b), most(c, d)))
    }

    /// Whether its only number is zero: products with it are exact.
    #[inline(always)]
    fn is_zero(self) -> bool {
        self == Self::ZERO
    }

    /// Which sign all numbers have: 1 not negative, -1 not positive, 0 both occur.
    fn sign(self) -> i8 {
        (self.lower >= 0.0) as i8 - (self.upper <= 0.0) as i8
    }

    /// One step outward from bounds of products or quotients, but never over an exact zero; `sign` is
    /// that of all of them.
    fn stepped_product(lower: f64, upper: f64, sign: i8) -> Self {
        let result = Self::stepped(lower, upper);
        Interval {
            lower: if sign > 0 { result.lower.max(0.0) } else { result.lower },
            upper: if sign < 0 { result.upper.min(0.0) } else { result.upper },
        }
    }

    #[inline(never)]
    fn add_rarely(self, other: Self) -> Self {
        let (a, b) = (self.known(), other.known());
        let (lower, upper) = (a.lower + b.lower, a.upper + b.upper);
        let result = Self::stepped(lower, upper);
        Interval {
            lower: if lower == 0.0 { lower } else { result.lower },
            upper: if upper == 0.0 { upper } else { result.upper },
        }
    }

    #[inline(never)]
    fn mul_rarely(self, other: Self) -> Self {
        let (a, b) = (self.known(), other.known());
        let (mut lower, mut upper) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in [a.lower, a.upper] {
            for y in [b.lower, b.upper] {
                let product = x * y;
                // 0 times infinity: the infinite bound is not a member, so that product is 0.
                let product = if product.is_nan() { 0.0 } else { product };
                lower = least(lower, product);
                upper = most(upper, product);
            }
        }
        Self::stepped_product(lower, upper, a.sign() * b.sign())
    }

    #[inline(never)]
    fn div_rarely(self, other: Self) -> Self {
        let (mut a, mut b) = (self.known(), other.known());
        if b.upper < 0.0 {
            (a, b) = (-a, -b);
        }
        // Not by a NaN, which was no bound, nor by zero.
        if !(b.lower > 0.0) {
            return Self::ENTIRE;
        }
        if a.is_zero() {
            return Self::ZERO;
        }
        // Infinity over infinity: what the bounds of the dividend make with the finite bound of the
        // divisor is infinite, and with the other one they tend to zero.
        let quotient = |x: f64, y: f64| if y.is_infinite() { 0.0 } else { x / y };
        let lower = quotient(a.lower, if a.lower >= 0.0 { b.upper } else { b.lower });
        let upper = quotient(a.upper, if a.upper >= 0.0 { b.lower } else { b.upper });
        Self::stepped_product(lower, upper, a.sign())
    }

    #[inline(never)]
    fn square_rarely(self) -> Self {
        let (lower, upper) = self.known().absolute();
        Self::stepped_product(lower * lower, upper * upper, 1)
    }

    /// The smallest and the largest absolute value.
    #[inline(always)]
    fn absolute(self) -> (f64, f64) {
        (most(most(self.lower, -self.upper), 0.0), most(-self.lower, self.upper))
    }

    /// Bounds of a product plus bounds of a term, outward by one rounding for both operations, if that
    /// is the short way's case.
    #[inline(always)]
    fn product_sum(product: (f64, f64), term: Self) -> Option<Self> {
        let (lower, upper) = (product.0 + term.lower, product.1 + term.upper);
        Self::if_finite(
            lower - (product.0.abs() + lower.abs()) * TWO_STEPS,
            upper + (product.1.abs() + upper.abs()) * TWO_STEPS,
        )
    }
}

impl Add for Interval {
    type Output = Self;
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn add(self, other: Self) -> Self {
        match Self::sum(self.lower + other.lower, self.upper + other.upper) {
            Some(sum) => sum,
            None => self.add_rarely(other),
        }
    }
}

impl Sub for Interval {
    type Output = Self;
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Self;
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn mul(self, other: Self) -> Self {
        let (lower, upper) = self.products(other);
        match Self::product(lower, upper) {
            Some(product) => product,
            None if self.is_zero() || other.is_zero() => Self::ZERO,
            None => self.mul_rarely(other),
        }
    }
}

impl Div for Interval {
    type Output = Self;
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn div(self, other: Self) -> Self {
        if other.contains(0.0) {
            return Self::ENTIRE;
        }
        // By the sign of the divisor, then the bound of it that each bound asks for.
        let (a, b) = if other.upper < 0.0 { (-self, -other) } else { (self, other) };
        let lower = a.lower / if a.lower >= 0.0 { b.upper } else { b.lower };
        let upper = a.upper / if a.upper >= 0.0 { b.lower } else { b.upper };
        match Self::product(lower, upper) {
            // Not above zero only where the upper bound is NaN, which may not have been divided by.
            Some(quotient) if b.lower > 0.0 => quotient,
            _ => self.div_rarely(other),
        }
    }
}

impl Neg for Interval {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Interval { lower: -self.upper, upper: -self.lower }
    }
}

impl Scalar for Interval {
    #[inline(always)]
    fn lift(self, value: f64) -> Self {
        Self::point(value)
    }
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        let (lower, upper) = self.products(factor);
        if lower.abs() >= SAFE
            && upper.abs() >= SAFE
            && let Some(result) = Self::product_sum((lower, upper), term)
        {
            return result;
        }
        if (self.is_zero() || factor.is_zero()) && term.is_finite() {
            return term;
        }
        self * factor + term
    }
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn square(self) -> Self {
        let (lower, upper) = self.absolute();
        let (lower, upper) = (lower * lower, upper * upper);
        let result = Interval {
            lower: most(lower - (lower * STEP + f64::from_bits(1)), 0.0),
            upper: upper + upper * STEP,
        };
        // The last condition means that neither bound is NaN.
        if upper >= f64::MIN_POSITIVE && result.upper < f64::INFINITY && self.lower <= self.upper {
            result
        } else if self.is_zero() {
            Self::ZERO
        } else {
            self.square_rarely()
        }
    }
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn square_plus(self, term: Self) -> Self {
        let (lower, upper) = self.absolute();
        let (low, high) = (lower * lower, upper * upper);
        if high >= SAFE
            && (low >= SAFE || lower == 0.0)
            && self.lower <= self.upper
            && let Some(result) = Self::product_sum((low, high), term)
        {
            return result;
        }
        if self.is_zero() && term.is_finite() {
            return term;
        }
        self.square() + term
    }
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn sqrt(self) -> Self {
        // Roots are normal or zero.
        let (lower, upper) = (most(self.lower, 0.0).sqrt(), self.upper.sqrt());
        // Infinite or NaN where something is.
        let result = Interval { lower: lower - lower * STEP, upper: upper + upper * STEP };
        if self.lower <= self.upper && result.upper < f64::INFINITY {
            return result;
        }
        let x = self.known();
        if x.upper < 0.0 {
            return Self::ENTIRE;
        }
        Self::stepped_product(most(x.lower, 0.0).sqrt(), x.upper.sqrt(), 1)
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let unit = Interval { lower: -1.0, upper: 1.0 };
        if !(self.upper - self.lower < 2.0 * PI && most(-self.lower, self.upper) < 1e6) {
            return (unit, unit);
        }
        if self.is_zero() {
            return (Self::ZERO, Self::point(1.0));
        }
        let (a, b) = if self.lower == self.upper {
            let a = self.lower.sin_cos();
            (a, a)
        } else {
            (self.lower.sin_cos(), self.upper.sin_cos())
        };
        // The multiples of a quarter turn that lie inside, with those in doubt: there a sine or a
        // cosine is largest or smallest, and between them both are monotone.
        let slack = 1e-9;
        let first = whole_below(self.lower * FRAC_2_PI - slack) + 1;
        let last = whole_below(self.upper * FRAC_2_PI + slack);
        // Bit k: whether one that is k modulo 4 is among them.
        let consecutive = ((1 << (last - first + 1).clamp(0, 4)) - 1) << (first & 3);
        let inside = consecutive | consecutive >> 4;
        // A sine is zero only at zero, exactly; a cosine of a double never is.
        let error = |value| if value == 0.0 { 0.0 } else { library_error(value) };
        let range = |highest: i64, lowest: i64, a: f64, b: f64| {
            let (low, high) = (least(a, b), most(a, b));
            let (low, high) = (low - error(low), high + error(high));
            Interval {
                lower: if inside & lowest != 0 { -1.0 } else { most(low, -1.0) },
                upper: if inside & highest != 0 { 1.0 } else { least(high, 1.0) },
            }
        };
        (range(0b0010, 0b1000, a.0, b.0), range(0b0001, 0b0100, a.1, b.1))
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        let half_turn = PI.next_up();
        let finite = self.is_finite() && x.is_finite();
        let (y, x) = if finite { (self, x) } else { (self.known(), x.known()) };
        if y.contains(0.0) && x.lower <= 0.0 {
            // The origin or the cut.
            return Interval { lower: -half_turn, upper: half_turn };
        }
        // Elsewhere the angle is monotone along every edge: two of the corners bound it.
        let (lowest, highest) = if y.lower >= 0.0 {
            (
                (if x.upper >= 0.0 { y.lower } else { y.upper }, x.upper),
                (if x.lower >= 0.0 { y.upper } else { y.lower }, x.lower),
            )
        } else if y.upper <= 0.0 {
            (
                (if x.lower >= 0.0 { y.lower } else { y.upper }, x.lower),
                (if x.upper >= 0.0 { y.upper } else { y.lower }, x.upper),
            )
        } else {
            ((y.lower, x.lower), (y.upper, x.lower))
        };
        // On the positive x axis the angle is exactly zero.
        let angle = |(y, x): (f64, f64)| {
            let angle = y.atan2(x);
            (angle, if y == 0.0 { 0.0 } else { library_error(angle) })
        };
        let ((low, below), (high, above)) = (angle(lowest), angle(highest));
        Interval { lower: most(low - below, -half_turn), upper: least(high + above, half_turn) }
    }
    #[inline(always)]
    fn select(self, then: Self, otherwise: Self) -> Self {
        // A NaN is no bound, so it decides nothing.
        if self.lower >= 0.0 && !self.upper.is_nan() {
            then
        } else if self.upper < 0.0 && !self.lower.is_nan() {
            otherwise
        } else {
            then.hull(otherwise)
        }
    }
}

/// A scalar that encloses all values over a box.
pub trait Enclosing: Scalar {
    /// Anything in the interval, at any pose.
    fn from_interval(value: Interval) -> Self;
    /// The product with one number.
    fn scaled(self, factor: f64) -> Self;
}

impl Enclosing for Interval {
    fn from_interval(value: Interval) -> Self {
        value
    }
    fn scaled(self, factor: f64) -> Self {
        Interval::scaled(self, factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The short ways hold what the rare ones do: `tests/interval.rs` proves both.
    #[test]
    fn both_roads_agree() {
        let bounds = [-1e300, -3.7, -1e-200, 0.0, 1e-160, 0.1, 2.0 / 3.0, 7.0, 1e155];
        let mut all = Vec::new();
        for (k, &lower) in bounds.iter().enumerate() {
            all.extend(bounds[k..].iter().map(|&upper| Interval::new(lower, upper)));
        }
        let holds = |wide: Interval, tight: Interval| wide.hull(tight) == wide;
        for &a in &all {
            assert!(a.is_zero() || holds(a.square(), a.square_rarely()), "{a:?}");
            for &b in &all {
                assert!(holds(a + b, a.add_rarely(b)), "{a:?} {b:?}");
                assert!(holds(a / b, a.div_rarely(b)), "{a:?} {b:?}");
                let product = a.mul_rarely(b);
                assert!(a.is_zero() || b.is_zero() || holds(a * b, product), "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn whole_numbers_below() {
        for value in [-3.0, -2.5, -0.1, -0.0, 0.0, 0.1, 1.0, 1.9, 640_000.5] {
            assert_eq!(whole_below(value) as f64, f64::floor(value));
        }
    }

    #[test]
    fn what_is_exact_stays() {
        let (zero, x) = (Interval::ZERO, Interval::new(-0.1, 1.3));
        assert_eq!(zero + zero, zero);
        assert_eq!(x * zero, zero);
        assert_eq!(Interval::ENTIRE * zero, zero);
        assert_eq!(x.mul_add(zero, x), x);
        assert_eq!(zero.square_plus(x), x);
        assert_eq!(zero.sqrt(), zero);
        assert_eq!(zero / Interval::new(1.0, 3.0), zero);
        assert_eq!(zero.sin_cos(), (zero, Interval::point(1.0)));
        assert_eq!(x.square().lower, 0.0);
    }
}
