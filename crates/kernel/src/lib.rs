//! Parallel kinematic machines: closures, kinematics, sensitivities and statics.
//!
//! A machine is a platform pose `X`, joint coordinates `q`, parameters `p` and closures
//! `g(X, q, p) = 0`; everything else follows from the closures (`ARCHITECTURE.md` in the
//! repository's root has the whole way). Pure mathematics: no files, no Python, no clock.
//! SI units, radians; vectors and wrenches along the base axes, linear part first.

pub mod batch;
pub mod code;
pub mod dispatch;
pub mod element;
pub mod identification;
pub mod kinematics;
pub mod largest;
pub mod linear;
pub mod machine;
pub mod proof;
pub mod sampling;
pub mod scalar;
pub mod spatial;
pub mod statics;
mod status;

pub use machine::{
    ChainDescription, Description, DriveDescription, GuideDescription, Machine, MachineError,
    StrutDescription,
};
pub use status::Status;
