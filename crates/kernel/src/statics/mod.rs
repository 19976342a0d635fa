//! Forces in the closures, loads on parameters, compliance and stiffness: virtual work through the
//! same first-order picture as the kinematics.

mod chain;
mod compliance;
mod forces;

pub use chain::{ChainMatrix, PlacedChain};
pub use compliance::{
    ClosureMatrix, add_shared, closure_compliance, most_closures, pose_compliance, pose_stiffness,
};
pub use forces::{closure_forces, parameter_load};
