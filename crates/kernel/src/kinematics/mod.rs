//! How joints, pose and parameters depend on each other.

mod closures;
mod condition;
mod elastic;
mod forward;
mod gradients;
mod inverse;
mod linearisation;
mod once;
mod overconstrained;

pub(crate) use closures::system;
pub use closures::{
    Limb, Limbs, Sample, guide_limb, guide_wrench, limbs, place_limbs, ring_arm, tool_point,
};
pub use condition::{condition, free_motions};
pub use forward::{
    Descent, NearbyInverse, OwnInverse, chord, chord_inverse, descend, forward, start_order,
};
pub(crate) use gradients::{Gradients, gradients, residuals};
pub use inverse::{Inverse, Obstacle, commanded_pose, inverse, lane_inverse, obstacles, permitted};
pub(crate) use inverse::{closed_form, leanings};
pub use linearisation::{Linearisation, proven_regular};
pub use once::forward_once;
pub use overconstrained::{Equilibrium, Loads, internal_forces, least_energy};

/// Singular: smallest scaled singular value below this share of the largest.
pub const SINGULAR: f64 = 1e-6;
