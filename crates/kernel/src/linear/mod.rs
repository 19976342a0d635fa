//! Small fixed-size linear algebra: six unknowns, the twist of a rigid body.

mod factor;
mod singular;

pub use factor::{Factored, factor, factor_pivoting, invert, pivot_order, solve};
pub use singular::condition_index;

/// Six freedoms of a rigid body.
pub const SIX: usize = 6;
/// Six rows of six.
pub type Matrix6<S> = [[S; SIX]; SIX];
