//! The kernel's first-order quantities as one type.

use truepose_kernel::Status;
use truepose_kernel::batch::{self, FirstOrder, Samples};

/// Any of the kernel's first-order quantities.
pub enum Quantity<'a> {
    Sensitivity(batch::Sensitivity<'a>),
    JointJacobian(batch::JointJacobian),
    Forces(batch::Forces<'a>),
    Loads(batch::Loads<'a>),
    Compliance(batch::Compliance<'a>),
    Stiffness(batch::Stiffness<'a>),
    InternalForces(batch::InternalForces<'a>),
}

impl Quantity<'_> {
    /// Its numbers and the status at samples that close the struts.
    pub fn compute(
        &self,
        machine: &truepose_kernel::Machine,
        samples: &Samples<'_>,
        out: &mut [f64],
        status: &mut [Status],
    ) {
        fn run(
            quantity: &impl FirstOrder,
            machine: &truepose_kernel::Machine,
            samples: &Samples<'_>,
            out: &mut [f64],
            status: &mut [Status],
        ) {
            batch::first_order(machine, samples, quantity, out, status);
        }
        match self {
            Quantity::Sensitivity(quantity) => run(quantity, machine, samples, out, status),
            Quantity::JointJacobian(quantity) => run(quantity, machine, samples, out, status),
            Quantity::Forces(quantity) => run(quantity, machine, samples, out, status),
            Quantity::Loads(quantity) => run(quantity, machine, samples, out, status),
            Quantity::Compliance(quantity) => run(quantity, machine, samples, out, status),
            Quantity::Stiffness(quantity) => run(quantity, machine, samples, out, status),
            Quantity::InternalForces(quantity) => run(quantity, machine, samples, out, status),
        }
    }
}
