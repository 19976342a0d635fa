//! Sensitivities of a machine whose parameters have moved already.

use super::forward::displacement;
use super::samples::Samples;
use super::threads::share_out;
use crate::kinematics::{Linearisation, Sample, forward, limbs};
use crate::linear::SIX;
use crate::machine::{Machine, indices_of};
use crate::spatial::{Pose, Vector, add, cross, dot, scale};
use crate::status::Status;

/// Derivatives of the error (displacement from `samples.poses` and rotation vector) to the parameters
/// `columns`, at the parameters deviated by `samples.deviations` and the pose that the machine then takes:
/// (component, column) for each sample, NaN where the status is not `ok`.
pub fn moved_sensitivities(
    machine: &Machine,
    samples: &Samples<'_>,
    columns: &[usize],
    out: &mut [f64],
) -> Vec<Status> {
    let components = indices_of(&machine.dof);
    let width = components.len() * columns.len();
    let parts = share_out(out, samples.count, width, |numbers, out| {
        let mut status = Vec::with_capacity(numbers.len());
        for (number, row) in numbers.zip(0..) {
            let out = &mut out[row * width..(row + 1) * width];
            status.push(one(machine, samples, number, (&components, columns), out));
        }
        status
    });
    parts.concat()
}

fn one(
    machine: &Machine,
    samples: &Samples<'_>,
    number: usize,
    (components, columns): (&[usize], &[usize]),
    out: &mut [f64],
) -> Status {
    let mut p = machine.nominal.clone();
    for (&column, value) in
        samples.deviations.columns.iter().zip(samples.deviations.values.row(number))
    {
        p[column] += value;
    }
    let q = samples.joints.row(number);
    let start = Pose::from_row(samples.poses.row(number));
    let struts = limbs(machine, &p, q);
    let sample = Sample { machine, p: &p, limbs: &struts };
    let (pose, status) = forward(&sample, q, &start);
    if status != Status::Ok {
        out.fill(f64::NAN);
        return status;
    }
    let mut linear = Linearisation::default();
    linear.fill_scalar(&sample, q, &pose);
    let error = displacement(&start, &pose);
    let turned = [error[3], error[4], error[5]];
    for (at, &column) in columns.iter().enumerate() {
        let mut twist = [0.0; SIX];
        for &(closure, slot) in &machine.dependents[column] {
            for (value, row) in twist.iter_mut().zip(&linear.inverse) {
                *value -= row[closure] * linear.to_parameters[closure][slot];
            }
        }
        let rate = rotation_vector_rate(turned, [twist[3], twist[4], twist[5]]);
        twist[3..].copy_from_slice(&rate);
        for (row, &component) in components.iter().enumerate() {
            out[row * columns.len() + at] = twist[component];
        }
    }
    Status::Ok
}

/// How a rotation vector changes with an angular velocity, both along the base axes: the inverse of the
/// left Jacobian of the rotations (Chirikjian, "Stochastic Models, Information Theory, and Lie Groups",
/// vol. 2, 2012, 10.6).
fn rotation_vector_rate(vector: Vector<f64>, velocity: Vector<f64>) -> Vector<f64> {
    let square = dot(vector, vector);
    let angle = square.sqrt();
    // Below 0.01 rad two terms of the series are exact to rounding.
    let factor = if angle < 1e-2 {
        1.0 / 12.0 + square / 720.0
    } else {
        let half = 0.5 * angle;
        (1.0 - half / half.tan()) / square
    };
    let across = cross(vector, velocity);
    add(velocity, add(scale(across, -0.5), scale(cross(vector, across), factor)))
}
