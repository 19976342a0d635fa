//! Guaranteed bounds: enclosures that hold for every deviation in a box, rounding included.
//!
//! Interval Newton (Krawczyk's operator; Neumaier, "Interval Methods for Systems of Equations", 1990,
//! chapter 5) on the same closures as everywhere proves that for every deviation in the box, and every
//! pose of a region, there is exactly one platform pose near the commanded one, and encloses it. How
//! far it moves per unit of each deviation is then enclosed by implicit differentiation.

mod at_pose;
mod boxes;
mod branch_and_bound;
mod closures;
mod command;
mod directions;
mod first_order;
mod forms;
mod over_region;
mod pose_box;
mod rates;
mod region;
mod root;
mod targets;
mod worst_machine;

pub use at_pose::{Extent, PoseBound};
pub use boxes::{Effort, bound_in_boxes};
pub use branch_and_bound::{Part, RegionBound, Search, bound_over_region};
pub use over_region::can_be_enclosed;
pub use region::{Affine, Region};
pub use targets::TARGETS;

use crate::linear::SIX;
use crate::scalar::{Enclosing, Interval};
use closures::Six;

/// What the variables of a box of deviations move: column c moves `parameters[c]` by `swing[c]` times
/// variable `variables[c]`, which lies in [-1, 1]; the variables of one of `directions` lie on the unit
/// circle or sphere together.
#[derive(Clone, Debug, Default)]
pub struct Deviating {
    /// Which parameter.
    pub parameters: Vec<usize>,
    /// Which variable.
    pub variables: Vec<usize>,
    /// By how much, SI.
    pub swing: Vec<f64>,
    /// How many variables.
    pub count: usize,
    /// Variables that are together a unit vector.
    pub directions: Vec<Vec<usize>>,
}

impl Deviating {
    /// Derivatives to the variables that are asked for, from those to a parameter; of the others zero.
    fn columns<S: Enclosing>(
        &self,
        asked: impl Fn(usize) -> bool,
        gradient: impl Fn(usize) -> Six<S>,
    ) -> Vec<Six<S>> {
        let mut columns = vec![[S::from_interval(point(0.0)); SIX]; self.count];
        let moved = self.parameters.iter().zip(&self.variables).zip(&self.swing);
        for ((&parameter, &variable), &swing) in moved {
            if !asked(variable) {
                continue;
            }
            let column = &mut columns[variable];
            for (sum, value) in column.iter_mut().zip(gradient(parameter)) {
                *sum = *sum + value.scaled(swing);
            }
        }
        columns
    }
}

/// Why nothing was proven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unproven {
    /// The closures are close to singular.
    NearSingular,
    /// The deviations are too large for a proof, or the region was left too large.
    TooWide,
}

/// `[1, 1]` and its like.
fn point(value: f64) -> Interval {
    Interval::point(value)
}
