//! First-order quantities of a machine whose parameters have moved already.

use super::first_order::{FirstOrder, Place, row_order};
use super::forward::displacement;
use super::samples::{Group, Samples};
use super::threads::for_chunks;
use crate::dispatch::{Work, dispatch};
use crate::kinematics::{
    Limbs, Linearisation, Sample, descend, forward, inverse, limbs, place_limbs, start_order,
};
use crate::linear::{IN_ORDER, Order, SIX};
use crate::machine::Machine;
use crate::scalar::Real;
use crate::spatial::{Pose, Vector, add, cross, dot, scale};
use crate::status::Status;

/// Below this angle, rad, two terms of the series are exact to rounding.
const SMALL: f64 = 1e-2;

/// Computes a quantity of the error (displacement from `samples.poses` and rotation vector) at the
/// parameters deviated by `samples.deviations` and the pose that the machine then takes; `out` has `width`
/// numbers a sample, NaN where the status is not `ok`.
pub fn moved_first_order(
    machine: &Machine,
    samples: &Samples<'_>,
    quantity: &impl FirstOrder,
    out: &mut [f64],
    status: &mut [Status],
) {
    let width = quantity.width();
    let orders = Orders::at_home(machine);
    for_chunks(samples.count, (out, width), (&mut [], 0), status, |first, out, _, status| {
        let chunk = Chunk { machine, samples, quantity, orders: &orders, first, out, status };
        if machine.plain { dispatch(chunk) } else { chunk.run::<f64>() }
    });
}

/// In which order the rows are eliminated: that of one pose, so that no sample depends on its neighbours.
pub(super) struct Orders {
    pub(super) forward: Order,
    pub(super) rows: Order,
}

impl Orders {
    /// Of the nominal machine at home. Where its order does not serve, a sample has its own, as every
    /// sample of a machine that is not plain.
    pub(super) fn at_home(machine: &Machine) -> Self {
        if !machine.plain {
            return Orders { forward: IN_ORDER, rows: IN_ORDER };
        }
        let solved = inverse(machine, &machine.nominal, &machine.home);
        let (p, q, pose) = (&machine.nominal, &solved.joints, &solved.pose);
        if !matches!(solved.status, Status::Ok | Status::OutOfTravel) {
            return Orders { forward: IN_ORDER, rows: IN_ORDER };
        }
        let forward = start_order(machine, &limbs(machine, p, q), pose);
        Orders { forward, rows: row_order(machine, p, q, pose) }
    }
}

struct Chunk<'a, Q> {
    machine: &'a Machine,
    samples: &'a Samples<'a>,
    quantity: &'a Q,
    orders: &'a Orders,
    first: usize,
    out: &'a mut [f64],
    status: &'a mut [Status],
}

impl<Q: FirstOrder> Work for Chunk<'_, Q> {
    #[inline(always)]
    fn run<S: Real>(self) {
        let Chunk { machine, samples, quantity, orders, first, out, status } = self;
        let width = quantity.width();
        let mut group = Group::<S>::new(machine);
        let mut at: Limbs<S> = Default::default();
        let mut columns = vec![S::default(); width / quantity.parts()];
        let mut linear = Linearisation::default();
        let groups = out.chunks_mut((width * S::WIDTH).max(1)).zip(status.chunks_mut(S::WIDTH));
        for (number, (out, status)) in groups.enumerate() {
            let place = Place { first: first + number * S::WIDTH, size: status.len() };
            let mut proven = S::splat(-1.0);
            if S::WIDTH > 1 {
                if group.load(machine, samples, place.first, place.size) {
                    place_limbs(machine, &group.p, &group.q, &mut at);
                }
                let descent = descend(machine, &at, &group.pose, &orders.forward);
                let (p, q) = (&group.p, &group.q);
                linear.fill(machine, p, q, &at, &descent.pose, &orders.rows);
                let error = displacement(&group.pose, &descent.pose);
                let small = turn_lanes(&mut linear, &error);
                for part in 0..quantity.parts() {
                    quantity.write(&linear, place, part, &mut columns);
                    S::store_rows(&columns, &mut out[part * columns.len()..], width, place.size);
                }
                proven = descent.proof.min(linear.regular).min(small);
            }
            for lane in 0..place.size {
                status[lane] = Status::Ok;
                // Also true where it is NaN.
                if !(proven.lane(lane) > 0.0) {
                    let out = &mut out[width * lane..width * (lane + 1)];
                    status[lane] = alone(machine, samples, place.first + lane, quantity, out);
                }
            }
        }
    }
}

/// One sample on the scalar path.
#[inline(never)]
fn alone(
    machine: &Machine,
    samples: &Samples<'_>,
    number: usize,
    quantity: &impl FirstOrder,
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
    turn_alone(&mut linear, &displacement(&start, &pose));
    let width = out.len() / quantity.parts();
    let place = Place { first: number, size: 1 };
    for (part, out) in out.chunks_exact_mut(width.max(1)).enumerate() {
        quantity.write(&linear, place, part, out);
    }
    Status::Ok
}

/// Makes of rates of the pose, at the end of `error`, those of that error; positive where it is small enough for it.
#[inline(always)]
pub(super) fn turn_lanes<S: Real>(linear: &mut Linearisation<S>, error: &[S; SIX]) -> S {
    let turned = [error[3], error[4], error[5]];
    let square = dot(turned, turned);
    turn_rows(&mut linear.inverse, turned, series(square));
    S::splat(SMALL * SMALL) - square
}

/// The same of one sample, of any error.
pub(super) fn turn_alone(linear: &mut Linearisation<f64>, error: &[f64; SIX]) {
    let turned = [error[3], error[4], error[5]];
    let square = dot(turned, turned);
    let factor = if square < SMALL * SMALL {
        series(square)
    } else {
        let half = 0.5 * square.sqrt();
        (1.0 - half / half.tan()) / square
    };
    turn_rows(&mut linear.inverse, turned, factor);
}

/// `(1 - angle / 2 / tan(angle / 2)) / angle^2` of a small angle, from its square.
#[inline(always)]
fn series<S: Real>(square: S) -> S {
    square.mul_add(S::splat(1.0 / 720.0), S::splat(1.0 / 12.0))
}

/// Makes of the rates of rotation, the last three rows, those of the rotation vector `turned`.
#[inline(always)]
fn turn_rows<S: Real, const N: usize>(rows: &mut [[S; N]; SIX], turned: Vector<S>, factor: S) {
    for closure in 0..N {
        let velocity = [rows[3][closure], rows[4][closure], rows[5][closure]];
        let rate = rotation_vector_rate(turned, velocity, factor);
        for k in 0..3 {
            rows[3 + k][closure] = rate[k];
        }
    }
}

/// How a rotation vector changes with an angular velocity, both along the base axes: the inverse of the
/// left Jacobian of the rotations (Chirikjian, "Stochastic Models, Information Theory, and Lie Groups",
/// vol. 2, 2012, 10.6).
#[inline(always)]
fn rotation_vector_rate<S: Real>(vector: Vector<S>, velocity: Vector<S>, factor: S) -> Vector<S> {
    let across = cross(vector, velocity);
    let half = scale(across, S::splat(-0.5));
    add(velocity, add(half, scale(cross(vector, across), factor)))
}
