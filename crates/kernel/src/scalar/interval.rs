//! Outward rounded intervals: the result contains the exact value for every point of the operands.
//!
//! Each bound is computed to nearest and moved one step outward (`next_down`, `next_up`), which
//! encloses the exact result because IEEE 754 arithmetic and square root err by at most half a step.

use super::Scalar;
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// All numbers from `lower` to `upper`, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower bound; minus infinity where nothing is known.
    pub lower: f64,
    /// Upper bound; plus infinity where nothing is known.
    pub upper: f64,
}

impl Interval {
    /// Every number.
    pub const ENTIRE: Interval = Interval { lower: f64::NEG_INFINITY, upper: f64::INFINITY };

    /// The interval from `lower` to `upper`.
    pub fn new(lower: f64, upper: f64) -> Self {
        Interval { lower, upper }
    }

    /// One number.
    pub fn point(value: f64) -> Self {
        Interval { lower: value, upper: value }
    }

    /// Whether `value` lies inside.
    pub fn contains(self, value: f64) -> bool {
        self.lower <= value && value <= self.upper
    }

    /// The smallest interval that contains both.
    pub fn hull(self, other: Self) -> Self {
        Interval { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    fn outward(lower: f64, upper: f64) -> Self {
        if lower.is_nan() || upper.is_nan() {
            return Self::ENTIRE;
        }
        Interval { lower: lower.next_down(), upper: upper.next_up() }
    }

    /// Widened for a library function that errs by up to a few steps.
    fn widened(self) -> Self {
        let mut result = self;
        for _ in 0..4 {
            result = Self::outward(result.lower, result.upper);
        }
        result
    }

    fn of_products(products: [f64; 4]) -> Self {
        let mut lower = f64::INFINITY;
        let mut upper = f64::NEG_INFINITY;
        for product in products {
            // 0 times infinity: the infinite bound is not a member, so that product is 0.
            let product = if product.is_nan() { 0.0 } else { product };
            lower = lower.min(product);
            upper = upper.max(product);
        }
        Self::outward(lower, upper)
    }

    /// Whether `offset + 2 pi k` lies inside for some whole number k; true when in doubt.
    fn holds_multiple(self, offset: f64) -> bool {
        let turn = 2.0 * PI;
        let slack = 1e-9;
        ((self.upper - offset) / turn + slack).floor()
            >= ((self.lower - offset) / turn - slack).ceil()
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::outward(self.lower + other.lower, self.upper + other.upper)
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::outward(self.lower - other.upper, self.upper - other.lower)
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self::of_products([
            self.lower * other.lower,
            self.lower * other.upper,
            self.upper * other.lower,
            self.upper * other.upper,
        ])
    }
}

impl Div for Interval {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if other.contains(0.0) {
            return Self::ENTIRE;
        }
        Self::of_products([
            self.lower / other.lower,
            self.lower / other.upper,
            self.upper / other.lower,
            self.upper / other.upper,
        ])
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Interval { lower: -self.upper, upper: -self.lower }
    }
}

impl Scalar for Interval {
    fn lift(self, value: f64) -> Self {
        Self::point(value)
    }
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    fn square(self) -> Self {
        let (a, b) = (self.lower * self.lower, self.upper * self.upper);
        let lower = if self.contains(0.0) { 0.0 } else { a.min(b).next_down() };
        Interval { lower: lower.max(0.0), upper: a.max(b).next_up() }
    }
    fn square_plus(self, term: Self) -> Self {
        self.square() + term
    }
    fn sqrt(self) -> Self {
        if self.upper < 0.0 {
            return Self::ENTIRE;
        }
        let root = Self::outward(self.lower.max(0.0).sqrt(), self.upper.sqrt());
        Interval { lower: root.lower.max(0.0), upper: root.upper }
    }
    fn sin_cos(self) -> (Self, Self) {
        let unit = Interval { lower: -1.0, upper: 1.0 };
        if !(self.upper - self.lower < 2.0 * PI && self.lower.abs().max(self.upper.abs()) < 1e6) {
            return (unit, unit);
        }
        let range = |highest: f64, lowest: f64, a: f64, b: f64| {
            let ends = Interval { lower: a.min(b), upper: a.max(b) }.widened();
            Interval {
                lower: if self.holds_multiple(lowest) { -1.0 } else { ends.lower.max(-1.0) },
                upper: if self.holds_multiple(highest) { 1.0 } else { ends.upper.min(1.0) },
            }
        };
        (
            range(FRAC_PI_2, -FRAC_PI_2, self.lower.sin(), self.upper.sin()),
            range(0.0, PI, self.lower.cos(), self.upper.cos()),
        )
    }
    fn atan2(self, x: Self) -> Self {
        let crosses_cut = self.contains(0.0) && x.lower <= 0.0;
        if crosses_cut || self == Self::ENTIRE || x == Self::ENTIRE {
            return Interval { lower: -PI, upper: PI }.widened();
        }
        // Away from the cut the angle is monotone along every edge: the corners bound it.
        let mut hull = Self::point(self.lower.atan2(x.lower));
        for (y, x) in [(self.lower, x.upper), (self.upper, x.lower), (self.upper, x.upper)] {
            hull = hull.hull(Self::point(y.atan2(x)));
        }
        hull.widened()
    }
    fn select(self, then: Self, otherwise: Self) -> Self {
        if self.lower >= 0.0 {
            then
        } else if self.upper < 0.0 {
            otherwise
        } else {
            then.hull(otherwise)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small generator, so that the samples are the same everywhere.
    struct Sequence(u64);
    impl Sequence {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
        fn interval(&mut self) -> Interval {
            let (a, b) = (20.0 * self.next() - 10.0, 20.0 * self.next() - 10.0);
            Interval { lower: a.min(b), upper: a.max(b) }
        }
        fn inside(&mut self, x: Interval) -> f64 {
            (x.lower + self.next() * (x.upper - x.lower)).clamp(x.lower, x.upper)
        }
    }

    #[test]
    fn results_contain_samples() {
        let mut random = Sequence(1);
        for _ in 0..20_000 {
            let (x, y) = (random.interval(), random.interval());
            let (a, b) = (random.inside(x), random.inside(y));
            assert!((x + y).contains(a + b));
            assert!((x - y).contains(a - b));
            assert!((x * y).contains(a * b));
            assert!((x / y).contains(a / b));
            assert!(x.square().contains(a * a) && x.square_plus(y).contains(a * a + b));
            assert!(x.square().sqrt().contains(a.abs()));
            assert!(x.sin_cos().0.contains(a.sin()) && x.sin_cos().1.contains(a.cos()));
            assert!(y.atan2(x).contains(b.atan2(a)), "{y:?} {x:?} {b} {a}");
            assert!(x.select(x, y).contains(if a >= 0.0 { a } else { b }));
        }
    }

    #[test]
    fn widths_stay_useful() {
        let x = Interval::new(1.0, 1.5);
        assert!((x * x).upper < 2.2500001 && x.sqrt().lower > 0.9999999);
        let (sine, _) = Interval::new(0.1, 0.2).sin_cos();
        assert!(sine.lower > 0.0998 && sine.upper < 0.1987);
    }
}
