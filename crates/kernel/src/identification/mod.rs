//! Calibration: which unknowns explain what instruments read of a machine.
//!
//! Unknowns move parameters linearly, `p = nominal + shift + effects u`; what is read follows by exact
//! forward kinematics (`evaluation.rs`), its derivatives by implicit differentiation, and a trust region
//! (`trust_region.rs`) finds the values that explain the readings best. Readings come pose by pose and
//! are summed into normal equations at once, so that no large matrix is made.

mod dense;
mod design;
mod evaluation;
mod observation;
mod solve;
pub mod trust_region;

pub use design::{Design, Observation, Prepared, Table, Term};
pub use evaluation::Evaluation;
pub use observation::{Instrument, OWN, Observable};
pub use solve::{Found, Prior, Readings, fit_many};
