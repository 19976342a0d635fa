//! Vectors, rotations and poses of rigid bodies, on any scalar.

mod pose;
mod vector;

pub use pose::{
    Pose, Quaternion, RotationMatrix, angle_rates, euler_angles, euler_axes, quaternion_from_euler,
    relative_quaternion, relative_rotation, rotate, rotate_back, rotation_matrix,
};
pub use vector::{Vector, add, cross, dot, norm, scale, subtract, tangents};
