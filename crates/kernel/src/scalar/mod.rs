//! The numbers that a closure may be evaluated on: a closed set.
//!
//! | scalar | what a closure on it gives |
//! |---|---|
//! | `f64` | the residual of one machine at one pose |
//! | [`Lanes`] | the residuals of eight samples at once |
//! | [`Dual`] | the residual and its exact derivatives |
//! | [`Interval`] | an enclosure of all residuals over a box |
//! | [`AffineForm`] | the same, of first order in what the box's variables have in common |
//! | [`Trace`] | the operations themselves, printable as C |
//!
//! A formula never branches on a scalar's value: what must not be a branch is a named method
//! ([`Scalar::select`], [`Scalar::sin_cos`], ...), so that each member can answer in its own way.

mod affine_form;
mod dual;
mod float;
mod interval;
mod lanes;
mod trace;

pub use affine_form::AffineForm;
pub use dual::Dual;
pub use interval::{Enclosing, Interval};
pub use lanes::{LANES, Lanes};
pub use trace::{Tape, Trace};

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number that closures, drives and rigid-body algebra are written in.
///
/// Kernels mark everything `#[inline(always)]` and use plain loops: a lambda inside a kernel is not
/// inlined into a function compiled for a wider instruction set, which costs a factor of 30.
pub trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The constant `value`, of the same kind (tape, width) as `self`.
    fn lift(self, value: f64) -> Self;
    /// `self * factor + term`; fused only where the hardware fuses.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `self * self`, never negative.
    fn square(self) -> Self;
    /// `self * self + term`: half the derivatives' work of a product.
    fn square_plus(self, term: Self) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
    /// The angle of the point (`x`, `self`) in (-pi, pi].
    fn atan2(self, x: Self) -> Self;
    /// `then` where `self >= 0`, else `otherwise`.
    fn select(self, then: Self, otherwise: Self) -> Self;
}

/// A scalar that carries plain values: `f64` itself, or lanes of them. Solvers run on these.
pub trait Real: Scalar + Default + PartialEq {
    /// How many samples one value holds.
    const WIDTH: usize;
    /// The same value in every lane.
    fn splat(value: f64) -> Self;
    /// The value of one lane, `lane < WIDTH`.
    fn lane(&self, lane: usize) -> f64;
    /// Sets the value of one lane, `lane < WIDTH`.
    fn set_lane(&mut self, lane: usize, value: f64);
    /// The first `WIDTH` of these, one a lane.
    fn load(values: &[f64]) -> Self;
    /// The value of each lane into the first `WIDTH` of these.
    fn store(self, values: &mut [f64]);
    /// Absolute value.
    fn abs(self) -> Self;
    /// The smaller of two, lane by lane; NaN where either is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger of two, lane by lane; `other` where either is NaN.
    fn larger(self, other: Self) -> Self;
    /// Whether every lane is below the limit; a NaN is not.
    fn all_below(self, limit: f64) -> bool;
    /// Reads `rows[k * columns.len() + j]` into lane `k` of `columns[j]` for the first `count` lanes;
    /// the others repeat the last of these. `rows` may go on beyond them.
    fn load_rows(rows: &[f64], count: usize, columns: &mut [Self]);
    /// Writes `columns[j]` of lane `k` to `rows[k * stride + j]` for the first `count` lanes. Rows that
    /// touch (`stride == columns.len()`) must end with the slice.
    fn store_rows(columns: &[Self], rows: &mut [f64], stride: usize, count: usize);
}
