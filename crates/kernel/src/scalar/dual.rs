//! A value with `N` exact directional derivatives, over any other scalar.

use super::{Enclosing, Interval, Scalar};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `value + sum of parts[k] e_k` with `e_j e_k = 0`: forward-mode differentiation.
#[derive(Clone, Copy, Debug)]
pub struct Dual<S, const N: usize> {
    /// The value itself.
    pub value: S,
    /// The derivative along each direction.
    pub parts: [S; N],
}

impl<S: Scalar, const N: usize> Dual<S, N> {
    /// A number that does not vary.
    #[inline(always)]
    pub fn constant(value: S) -> Self {
        Dual { value, parts: [value.lift(0.0); N] }
    }

    /// The variable whose derivative along `direction` is one.
    #[inline(always)]
    pub fn variable(value: S, direction: usize) -> Self {
        let mut dual = Self::constant(value);
        dual.parts[direction] = value.lift(1.0);
        dual
    }

    /// A function of this number, from its value and derivative there.
    #[inline(always)]
    fn chain(self, value: S, derivative: S) -> Self {
        let mut parts = self.parts;
        for k in 0..N {
            parts[k] = parts[k] * derivative;
        }
        Dual { value, parts }
    }
}

impl<S: Scalar, const N: usize> Add for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let mut parts = self.parts;
        for k in 0..N {
            parts[k] = self.parts[k] + other.parts[k];
        }
        Dual { value: self.value + other.value, parts }
    }
}

impl<S: Scalar, const N: usize> Sub for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let mut parts = self.parts;
        for k in 0..N {
            parts[k] = self.parts[k] - other.parts[k];
        }
        Dual { value: self.value - other.value, parts }
    }
}

impl<S: Scalar, const N: usize> Mul for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let mut parts = self.parts;
        for k in 0..N {
            parts[k] = self.parts[k].mul_add(other.value, self.value * other.parts[k]);
        }
        Dual { value: self.value * other.value, parts }
    }
}

impl<S: Scalar, const N: usize> Div for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = other.value.lift(1.0) / other.value;
        let quotient = self.value * inverse;
        let mut parts = self.parts;
        for k in 0..N {
            parts[k] = (self.parts[k] - quotient * other.parts[k]) * inverse;
        }
        Dual { value: quotient, parts }
    }
}

impl<S: Scalar, const N: usize> Neg for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let mut parts = self.parts;
        for k in 0..N {
            parts[k] = -parts[k];
        }
        Dual { value: -self.value, parts }
    }
}

impl<S: Scalar, const N: usize> Scalar for Dual<S, N> {
    #[inline(always)]
    fn lift(self, value: f64) -> Self {
        Self::constant(self.value.lift(value))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        let mut parts = self.parts;
        for k in 0..N {
            let inner = self.value.mul_add(factor.parts[k], term.parts[k]);
            parts[k] = self.parts[k].mul_add(factor.value, inner);
        }
        Dual { value: self.value.mul_add(factor.value, term.value), parts }
    }
    #[inline(always)]
    fn square(self) -> Self {
        self.chain(self.value.square(), self.value + self.value)
    }
    #[inline(always)]
    fn square_plus(self, term: Self) -> Self {
        let twice = self.value + self.value;
        let mut parts = self.parts;
        for k in 0..N {
            parts[k] = parts[k].mul_add(twice, term.parts[k]);
        }
        Dual { value: self.value.square_plus(term.value), parts }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, root.lift(0.5) / root)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sine, cosine) = self.value.sin_cos();
        (self.chain(sine, cosine), self.chain(cosine, -sine))
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let radius = self.value.square() + x.value.square();
        let (along, across) = (x.value / radius, self.value / radius);
        let mut parts = self.parts;
        for k in 0..N {
            parts[k] = self.parts[k] * along - x.parts[k] * across;
        }
        Dual { value: self.value.atan2(x.value), parts }
    }
    #[inline(always)]
    fn select(self, then: Self, otherwise: Self) -> Self {
        let mut parts = then.parts;
        for k in 0..N {
            parts[k] = self.value.select(then.parts[k], otherwise.parts[k]);
        }
        Dual { value: self.value.select(then.value, otherwise.value), parts }
    }
}

impl<const N: usize> Enclosing for Dual<Interval, N> {
    fn from_interval(value: Interval) -> Self {
        Dual::constant(value)
    }
    fn scaled(self, factor: f64) -> Self {
        Dual { value: self.value.scaled(factor), parts: self.parts.map(|one| one.scaled(factor)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation at once, so that one derivative test covers them all.
    fn formula<S: Scalar>(x: S, y: S) -> S {
        let (sine, cosine) = (x * y).sin_cos();
        let angle = (sine + x.lift(2.0)).atan2(cosine - y);
        let chosen = (x - y).select(angle.square(), -angle);
        (chosen.mul_add(x, y) / y.square_plus(x.lift(1.0))).square().sqrt() - x
    }

    #[test]
    fn derivatives_equal_central_differences() {
        for (x, y) in [(0.3, 1.7), (1.9, 0.4), (-0.8, -1.1), (2.5, 2.4)] {
            let dual = formula(Dual::<f64, 2>::variable(x, 0), Dual::variable(y, 1));
            assert_eq!(dual.value, formula(x, y));
            let h = 1e-6;
            let dx = (formula(x + h, y) - formula(x - h, y)) / (2.0 * h);
            let dy = (formula(x, y + h) - formula(x, y - h)) / (2.0 * h);
            assert!((dual.parts[0] - dx).abs() < 1e-8 * (1.0 + dx.abs()));
            assert!((dual.parts[1] - dy).abs() < 1e-8 * (1.0 + dy.abs()));
        }
    }
}
