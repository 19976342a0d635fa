//! The same numbers as one by one, for many samples: lanes, instruction sets, threads.
//!
//! A batch is cut into chunks for the threads, a chunk into groups of lanes. What a group cannot
//! prove good is done again sample by sample on the scalar path, and each sample has its status.

mod band;
mod base_loads;
mod budget;
mod budget_roads;
mod first_order;
mod forward;
mod inverse;
mod moved;
mod samples;
mod threads;

pub use crate::dispatch::{InstructionSet, instruction_set, use_instruction_set};
pub use band::{Band, BandColumns};
pub use base_loads::base_loads;
pub use budget::{Budget, Cause, TABLES, Table, UNBANDED};
pub use budget_roads::Outcome;
pub use first_order::{
    Compliance, FirstOrder, Forces, InternalForces, JointJacobian, Loads, Sensitivity, Stiffness,
    WRENCHES, Yielding, first_order,
};
pub use forward::{displacement, displacements, forward_poses};
pub use inverse::inverses;
pub use moved::moved_first_order;
pub use samples::{Deviations, Rows, Samples};
pub(crate) use threads::for_chunks;
pub use threads::{MOST_THREADS, set_threads, share_out, threads};

/// Samples of one chunk.
const CHUNK: usize = 256;
