//! How joints, pose and parameters hang together.

mod closures;
mod forward;
mod inverse;
mod linearisation;

pub use closures::{Limb, Limbs, closure_rows, limbs, squared_residuals, squared_rows};
pub use forward::{Descent, descend, forward, start_order};
pub use inverse::{
    Inverse, Obstacle, commanded_pose, condition, in_travel, inverse, lane_inverse, obstacles,
};
pub use linearisation::{Linearisation, proven_regular};

/// Singular: smallest scaled singular value below this share of the largest.
pub const SINGULAR: f64 = 1e-6;
