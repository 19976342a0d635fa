//! `f64`: one machine, one pose.

use super::{Real, Scalar};

impl Scalar for f64 {
    #[inline(always)]
    fn lift(self, value: f64) -> f64 {
        value
    }
    // Not `f64::mul_add`: outside a function compiled for fused arithmetic that is a library call,
    // twenty times slower than the two operations.
    #[inline(always)]
    fn mul_add(self, factor: f64, term: f64) -> f64 {
        self * factor + term
    }
    #[inline(always)]
    fn square(self) -> f64 {
        self * self
    }
    #[inline(always)]
    fn square_plus(self, term: f64) -> f64 {
        self * self + term
    }
    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn sin_cos(self) -> (f64, f64) {
        f64::sin_cos(self)
    }
    #[inline(always)]
    fn atan2(self, x: f64) -> f64 {
        f64::atan2(self, x)
    }
    #[inline(always)]
    fn select(self, then: f64, otherwise: f64) -> f64 {
        if self >= 0.0 { then } else { otherwise }
    }
}

impl Real for f64 {
    const WIDTH: usize = 1;
    #[inline(always)]
    fn splat(value: f64) -> f64 {
        value
    }
    #[inline(always)]
    fn lane(&self, _lane: usize) -> f64 {
        *self
    }
    #[inline(always)]
    fn set_lane(&mut self, _lane: usize, value: f64) {
        *self = value;
    }
    #[inline(always)]
    fn load(values: &[f64]) -> f64 {
        values[0]
    }
    #[inline(always)]
    fn store(self, values: &mut [f64]) {
        values[0] = self;
    }
    #[inline(always)]
    fn abs(self) -> f64 {
        f64::abs(self)
    }
    #[inline(always)]
    fn min(self, other: f64) -> f64 {
        if self <= other || self.is_nan() { self } else { other }
    }
    #[inline(always)]
    fn larger(self, other: f64) -> f64 {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn all_below(self, limit: f64) -> bool {
        self < limit
    }
    #[inline(always)]
    fn load_rows(rows: &[f64], _count: usize, columns: &mut [f64]) {
        columns.copy_from_slice(&rows[..columns.len()]);
    }
    #[inline(always)]
    fn store_rows(columns: &[f64], rows: &mut [f64], _stride: usize, _count: usize) {
        rows[..columns.len()].copy_from_slice(columns);
    }
}
