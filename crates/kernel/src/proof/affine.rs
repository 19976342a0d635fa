//! What a source knows of one parameter all over a region: a constant, and a multiple of a strut's length.

use super::point;
use crate::scalar::{Dual, Interval, Scalar};

/// A number for one parameter, known at every pose: `constant + per_length` times the present length of
/// a strut.
#[derive(Clone, Copy, Debug)]
pub struct Affine {
    /// Which parameter.
    pub parameter: usize,
    /// Lowest and highest.
    pub constant: [f64; 2],
    /// Per metre of the strut.
    pub per_length: f64,
    /// Which strut.
    pub strut: usize,
}

/// An interval that does not change.
pub trait FromInterval: Scalar {
    /// The same at every pose.
    fn from_interval(value: Interval) -> Self;
}

impl FromInterval for Interval {
    fn from_interval(value: Interval) -> Self {
        value
    }
}

impl<const N: usize> FromInterval for Dual<Interval, N> {
    fn from_interval(value: Interval) -> Self {
        Dual::constant(value)
    }
}

impl Affine {
    /// At these lengths of the struts.
    pub fn at<S: FromInterval>(&self, lengths: &[S]) -> S {
        let [low, high] = self.constant;
        let constant = S::from_interval(Interval::new(low, high));
        if self.per_length == 0.0 {
            return constant;
        }
        constant + S::from_interval(point(self.per_length)) * lengths[self.strut]
    }
}
