//! Small fixed-size linear algebra: six unknowns, the twist of a rigid body.

mod factor;
mod singular;

pub use factor::{
    Pivoted, factor, factor_pivoting, growth, inverse_of, invert, solve, solve_transposed,
};
pub use singular::{condition_index, null_space};

/// Six freedoms of a rigid body.
pub const SIX: usize = 6;
/// The most closures that a machine may have.
pub const CLOSURES: usize = 12;
/// Six rows of six.
pub type Matrix6<S> = [[S; SIX]; SIX];
/// Which of the system's rows stands at each place of the elimination.
pub type Order = [usize; SIX];
/// The rows as they come.
pub const IN_ORDER: Order = [0, 1, 2, 3, 4, 5];
