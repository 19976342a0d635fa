//! Exact errors of one machine after another at points of its variables, which all poses share.

use super::SEGMENT;
use super::monte_carlo::{Columns, Moved, StudyPose};
use crate::batch::share_out;
use crate::dispatch::{Work, dispatch};
use crate::machine::{Machine, indices_of};
use crate::scalar::{LANES, Real};
use crate::status::Status;

/// Values of the variables at some points, as the lanes take them: all poses share them.
#[derive(Clone, Debug)]
pub struct Points {
    count: usize,
    variables: usize,
    /// Of each group of `LANES` points: the variables one after the other, a number a point.
    lanes: Vec<f64>,
}

impl Points {
    /// Of rows (count, variables).
    pub fn new(rows: &[f64], variables: usize) -> Self {
        let count = rows.len().checked_div(variables).unwrap_or(0);
        let mut lanes = vec![0.0; count.div_ceil(LANES) * LANES * variables];
        for (point, row) in rows.chunks(variables.max(1)).enumerate() {
            let group = &mut lanes[point / LANES * LANES * variables..];
            for (variable, &value) in row.iter().enumerate() {
                group[variable * LANES + point % LANES] = value;
            }
        }
        Points { count, variables, lanes }
    }

    /// How many points.
    pub fn count(&self) -> usize {
        self.count
    }

    /// How many variables a point has.
    pub fn variables(&self) -> usize {
        self.variables
    }
}

/// Errors (point, component) of points at one pose, NaN without a result; how many have none.
pub fn errors(
    machine: &Machine,
    columns: &Columns,
    pose: &StudyPose,
    points: &Points,
    out: &mut [f64],
) -> usize {
    let components = indices_of(&machine.dof).len();
    // Whole segments for the threads; what is beyond them is a part of its own.
    let whole = points.count / SEGMENT;
    let (body, rest) = out.split_at_mut(whole * SEGMENT * components);
    let part = |first: usize, out: &mut [f64]| {
        let mut failed = 0;
        let work = Errors { machine, columns, pose, points, first, out, failed: &mut failed };
        if machine.plain {
            dispatch(work)
        } else {
            work.run::<f64>()
        }
        failed
    };
    let mut failed: usize = share_out(body, whole, SEGMENT * components, |segments, out| {
        part(segments.start * SEGMENT, out)
    })
    .into_iter()
    .sum();
    if !rest.is_empty() {
        failed += part(whole * SEGMENT, rest);
    }
    failed
}

struct Errors<'a> {
    machine: &'a Machine,
    columns: &'a Columns,
    pose: &'a StudyPose,
    points: &'a Points,
    first: usize,
    out: &'a mut [f64],
    failed: &'a mut usize,
}

impl Work for Errors<'_> {
    #[inline(always)]
    fn run<S: Real>(self) {
        let Errors { machine, columns, pose, points, first, out, failed } = self;
        let components = indices_of(&machine.dof);
        let size = out.len() / components.len();
        let mut moved = Moved::<S>::at(pose);
        for from in (0..size).step_by(S::WIDTH) {
            let lanes = S::WIDTH.min(size - from);
            let point = first + from;
            let group = &points.lanes[point / LANES * LANES * points.variables..];
            let (error, status) = moved.error(machine, columns, pose, lanes, |variable| {
                S::load(&group[variable * LANES + point % LANES..])
            });
            let rows = out[from * components.len()..].chunks_mut(components.len());
            for (lane, row) in rows.take(lanes).enumerate() {
                let ok = status[lane] == Status::Ok;
                *failed += usize::from(!ok);
                for (value, &component) in row.iter_mut().zip(&components) {
                    *value = if ok { error[component].lane(lane) } else { f64::NAN };
                }
            }
        }
    }
}
