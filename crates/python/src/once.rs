//! One forward call of one pose: vectors in, a vector out, nothing else allocated or checked twice.

use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use truepose_kernel::Machine;
use truepose_kernel::kinematics::{forward_once, limbs, start_order};
use truepose_kernel::linear::{IN_ORDER, Order, SIX};
use truepose_kernel::spatial::Pose;

/// What a machine keeps for single calls.
pub struct Once {
    /// The order of rows at home with the joints at mid-travel.
    order: Order,
    /// Home in six coordinates.
    home: [f64; SIX],
}

impl Once {
    pub fn new(machine: &Machine) -> Self {
        let middle = |travel: [f64; 2]| 0.5 * (travel[0] + travel[1]);
        let order = if machine.plain {
            let joints: Vec<f64> =
                machine.drives.iter().map(|drive| middle(drive.travel)).collect();
            start_order(machine, &limbs(machine, &machine.nominal, &joints), &machine.home)
        } else {
            IN_ORDER
        };
        Once { order, home: machine.home.to_coordinates() }
    }
}

/// The platform's freedoms of one pose.
pub struct Freedoms {
    values: [f64; SIX],
    count: usize,
}

impl Freedoms {
    pub fn numbers(&self) -> &[f64] {
        &self.values[..self.count]
    }
}

/// The numbers of a vector that is exactly an array of floats, at most six, and how many these are.
fn vector(object: &Bound<'_, PyAny>) -> Option<([f64; SIX], usize)> {
    let array = object.cast_exact::<PyArray1<f64>>().ok()?;
    let count = array.len();
    if count > SIX {
        return None;
    }
    let mut values = [0.0; SIX];
    for (k, value) in values[..count].iter_mut().enumerate() {
        *value = array.get_owned(k)?;
    }
    Some((values, count))
}

impl Once {
    /// The pose for a vector of joints; none for whatever is not the plain case of a vector, a plain machine and a
    /// proven pose, which the general road then answers or refuses.
    pub fn forward(
        &self,
        machine: &Machine,
        joints: &Bound<'_, PyAny>,
        start: Option<&Bound<'_, PyAny>>,
    ) -> Option<Freedoms> {
        if !machine.plain {
            return None;
        }
        let (joints, count) = vector(joints)?;
        if count != machine.drives.len() {
            return None;
        }
        let start = match start {
            None => machine.home,
            Some(start) => {
                let (given, count) = vector(start)?;
                let flags = if count == machine.dof_count() {
                    &machine.dof
                } else if count == machine.commanded_count() {
                    &machine.commanded
                } else {
                    return None;
                };
                let mut coordinates = self.home;
                let mut from = given.iter();
                for (coordinate, _) in coordinates.iter_mut().zip(flags).filter(|(_, flag)| **flag)
                {
                    *coordinate = *from.next()?;
                }
                Pose::from_coordinates(coordinates)
            }
        };
        let pose = forward_once(machine, &joints[..count], &start, &self.order)?;
        let coordinates = pose.to_coordinates();
        let mut result = Freedoms { values: [0.0; SIX], count: 0 };
        for (value, _) in coordinates.iter().zip(&machine.dof).filter(|(_, flag)| **flag) {
            result.values[result.count] = *value;
            result.count += 1;
        }
        Some(result)
    }
}
