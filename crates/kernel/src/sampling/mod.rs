//! Monte Carlo: machines drawn at random, their exact poses, and the statistics that are kept.
//!
//! Random numbers are counter-based: the value of a variable in a sample follows from the seed and the
//! variable's identity alone, whatever threads, lanes or calls the samples are shared out to.

mod monte_carlo;
mod points;
mod random;
mod tally;
mod tally_bytes;
mod variables;

pub use monte_carlo::{Columns, Study, StudyPose, Whitening, sample, sample_keeping};
pub use points::{Points, errors};
pub use tally::{Sums, Tally};
pub use variables::{Copula, Shape, Variable, Variables};

/// Samples that are drawn and evaluated together: their variables stay in the cache.
const SEGMENT: usize = 256;
