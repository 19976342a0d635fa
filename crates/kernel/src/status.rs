//! What became of one pose.

/// The outcome of a computation at one pose. A failure in a batch is data, not an exception.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// The result holds.
    Ok = 0,
    /// The joints are right but outside their travel.
    OutOfTravel = 1,
    /// A strut cannot reach its platform joint.
    Unreachable = 2,
    /// The scaled closure Jacobian is singular: a freedom of the platform is not held.
    Singular = 3,
    /// No root was found.
    NotConverged = 4,
    /// A root was found only beyond a singular pose: another assembly of the machine.
    BranchLost = 5,
    /// The joints are right but a strut leans beyond the limit of one of its joints.
    JointLimit = 6,
}

impl Status {
    /// Every status, at the place of its number.
    pub const ALL: [Status; 7] = [
        Status::Ok,
        Status::OutOfTravel,
        Status::Unreachable,
        Status::Singular,
        Status::NotConverged,
        Status::BranchLost,
        Status::JointLimit,
    ];

    /// The word in results and messages.
    pub fn name(self) -> &'static str {
        match self {
            Status::Ok => "ok",
            Status::OutOfTravel => "out_of_travel",
            Status::Unreachable => "unreachable",
            Status::Singular => "singular",
            Status::NotConverged => "not_converged",
            Status::BranchLost => "branch_lost",
            Status::JointLimit => "joint_limit",
        }
    }

    /// Whether there is a result to go on with.
    pub fn is_solved(self) -> bool {
        matches!(self, Status::Ok | Status::OutOfTravel | Status::JointLimit)
    }
}
