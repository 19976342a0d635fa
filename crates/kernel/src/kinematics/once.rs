//! Forward kinematics of one pose of a plain machine without pivoting: what a single call mostly is.
//!
//! The iteration and its tests are those of [`super::forward`], in one group of lanes with an order of
//! rows that was found before. Wherever one of them does not hold there is no answer, and the road that pivots
//! and follows the residual has to be taken.

use super::closures::{Limb, squared_residuals, squared_rows, tool_point};
use super::forward::{CHORD, CHORD_STEPS, LANE_STEPS, LONG_STEP, SETTLED, relative_size};
use super::linearisation::proven_regular;
use crate::dispatch::{Work, dispatch};
use crate::linear::{Order, SIX, factor, growth, solve};
use crate::machine::Machine;
use crate::scalar::Real;
use crate::spatial::Pose;

/// A larger growth of rounding errors, and the order of rows does not serve.
const GROWTH: f64 = 1e3;

/// The pose of a plain machine for joints `q`, from `start`, rows eliminated in the given order; none where it is not
/// proven to be the one that [`super::forward`] finds with status `ok`, and for machines that are not plain.
pub fn forward_once(
    machine: &Machine,
    q: &[f64],
    start: &Pose<f64>,
    order: &Order,
) -> Option<Pose<f64>> {
    if !machine.plain {
        return None;
    }
    let mut found = None;
    dispatch(Once { machine, q, start, order, found: &mut found });
    found
}

struct Once<'a> {
    machine: &'a Machine,
    q: &'a [f64],
    start: &'a Pose<f64>,
    order: &'a Order,
    found: &'a mut Option<Pose<f64>>,
}

impl Work for Once<'_> {
    #[inline(always)]
    fn run<S: Real>(self) {
        let Once { machine, q, start, order, found } = self;
        let tool = tool_point(machine, &machine.nominal);
        let mut at = [Limb::<S>::default(); SIX];
        for (lanes, strut) in at.iter_mut().zip(&machine.struts) {
            *lanes = Limb::splat(&Limb::placed(machine, strut, &machine.nominal, q, tool));
        }
        let mut pose = Pose::<S>::splat(start);
        let mut rows = [[S::default(); SIX]; SIX];
        let mut twist = [S::default(); SIX];
        let mut first = S::default();
        for step in 0..LANE_STEPS {
            squared_rows(machine, &at, &pose, order, &mut rows, &mut twist);
            let determinant = factor(&mut rows);
            if step == 0 {
                first = determinant;
            }
            // Not true either where something is not finite.
            let same_branch = (-(first * determinant)).all_below(0.0);
            if !same_branch || !growth(&rows).all_below(GROWTH) {
                return;
            }
            solve(&rows, &mut twist);
            let size = relative_size(machine, &twist);
            if !size.all_below(LONG_STEP) {
                return;
            }
            pose.step_back(&twist);
            if !size.all_below(CHORD) {
                continue;
            }
            for _ in 0..CHORD_STEPS {
                squared_residuals(machine, &at, &pose, order, &mut twist);
                solve(&rows, &mut twist);
                pose.step_back(&twist);
                if (relative_size(machine, &twist) * size).all_below(SETTLED) {
                    if (-proven_regular(machine, &at, determinant)).all_below(0.0) {
                        *found = Some(pose.lane(0));
                    }
                    return;
                }
            }
        }
    }
}
