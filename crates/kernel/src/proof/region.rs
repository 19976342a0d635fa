//! A region of commanded poses, what deviates in it, and how far its bounds are taken.

use super::{Deviating, point};
use crate::linear::SIX;
use crate::machine::Machine;
use crate::scalar::{Enclosing, Interval};

/// A region and what deviates in it.
#[derive(Clone, Debug)]
pub struct Region<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Lowest and highest value of each commanded freedom, m and rad.
    pub sides: Vec<[f64; 2]>,
    /// Known deviations of the parameters.
    pub shift: Vec<Affine>,
    /// Compliances, m/N or rad/(N m), of parameters that yield under the wrench.
    pub yielding: Vec<Affine>,
    /// Force (N) and moment (N m) on the tool, base axes.
    pub wrench: [f64; SIX],
    /// What the variables move.
    pub deviating: &'a Deviating,
    /// How far the bounds may lie above the errors reached, relative.
    pub gap: f64,
    /// Sizes of position (m) and orientation (rad) that nothing may be above: where they are given, the
    /// question is whether it is so, and no bound need be lower.
    pub targets: Option<[f64; 2]>,
    /// Boxes that may be looked at.
    pub most_boxes: usize,
}

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

impl Affine {
    /// At these lengths of the struts.
    pub fn at<S: Enclosing>(&self, lengths: &[S]) -> S {
        let [low, high] = self.constant;
        let constant = S::from_interval(Interval::new(low, high));
        if self.per_length == 0.0 {
            return constant;
        }
        constant + S::from_interval(point(self.per_length)) * lengths[self.strut]
    }
}
