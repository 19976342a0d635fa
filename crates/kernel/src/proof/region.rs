//! A region of commanded poses, what deviates in it, and how far its bounds are taken.

use super::Deviating;
use super::affine::Affine;
use crate::linear::SIX;
use crate::machine::Machine;

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
    /// Boxes that may be looked at.
    pub most_boxes: usize,
}
