//! Bounds of the error over a box of commanded poses.
//!
//! The nominal command is enclosed first (the parasitic freedoms and the joints as the unknowns), then
//! the actual platform relative to it.

use super::at_pose::{Extent, along, displacement_numbers};
use super::pose_box::Over;
use super::region::Region;
use super::targets::{Bounds, Closeness, TARGETS, targets};
use super::{Deviating, Unproven, point};
use crate::batch::displacement;
use crate::kinematics::{Inverse, Sample, commanded_pose, forward, inverse, limbs};
use crate::linear::SIX;
use crate::machine::{Machine, indices_of};
use crate::scalar::Interval;
use crate::spatial::{Pose, Vector};
use crate::status::Status;
use std::cell::Cell;

/// Freedoms up to which affine forms are shorter.
const FEW: usize = 3;
/// Magnitudes are refined until they lie at most this above the farthest reach.
const FINE: f64 = 1.005;
/// Times that a machine is taken that is worst along the way that the last one went.
const CLIMBED: usize = 2;

/// What a look at a box finds.
pub(super) struct Look {
    /// Bounds of the targets in it.
    pub bound: Result<[f64; TARGETS], Unproven>,
    /// What is reached of each, from its middle.
    pub reached: [f64; TARGETS],
    /// Whether the machine can be commanded to its middle.
    pub status: Status,
}

impl Region<'_> {
    /// Bounds over a box of poses and the errors reached in its middle.
    ///
    /// Slopes over all machines give a first bound; where it is above `allowed`, the exact extent at the
    /// middle takes their place.
    pub(super) fn look(&self, sides: &[[f64; 2]], allowed: &[f64; TARGETS]) -> Look {
        let machine = self.machine;
        let middle = middle_of(sides);
        let start = commanded_pose(machine, &middle);
        let solved = inverse(machine, &machine.nominal, &start);
        let reached = [f64::NEG_INFINITY; TARGETS];
        if solved.status != Status::Ok {
            let status = solved.status;
            return Look { bound: Err(Unproven::NearSingular), reached, status };
        }
        let bounded = || {
            if sides.len() <= FEW {
                self.bounded::<FEW>((sides, &middle), &solved, allowed)
            } else {
                self.bounded::<SIX>((sides, &middle), &solved, allowed)
            }
        };
        match bounded() {
            Ok((bound, reached)) => Look { bound: Ok(bound), reached, status: Status::Ok },
            Err(why) => Look { bound: Err(why), reached, status: Status::Ok },
        }
    }

    /// Bounds over a box that holds the commanded freedoms `middle`, and what is reached in it.
    fn bounded<const M: usize>(
        &self,
        (sides, middle): (&[[f64; 2]], &[f64]),
        solved: &Inverse,
        allowed: &[f64; TARGETS],
    ) -> Result<([f64; TARGETS], [f64; TARGETS]), Unproven> {
        let machine = self.machine;
        let spot = sides_at(middle);
        let halves: Vec<Interval> = sides
            .iter()
            .zip(middle)
            .map(|(side, &middle)| Interval::new(side[0], side[1]) - point(middle))
            .collect();
        let command = self.command(sides, &solved.pose, &solved.joints)?;
        let over = self.over(&command)?;
        let spot_command = self.command(&spot, &solved.pose, &solved.joints)?;
        let own = self.over(&spot_command)?;
        let forms = self.forms::<M>(&spot_command, &command, (sides, &halves), &solved.pose)?;
        let first = self.first_order(&forms, &over)?;
        let bounds = |most: &dyn Fn(&[f64; SIX]) -> f64| {
            let closeness = Closeness { fine: FINE, enough: *allowed };
            targets(machine, &over.whole, &closeness, most)
        };
        let closed = |bound: &[f64; TARGETS]| bound.iter().zip(allowed).all(|(a, b)| a <= b);
        let reach = |u: &[f64; SIX]| {
            let [linear, beyond] = first.reach(u);
            (point(linear) + point(beyond)).upper
        };
        let Bounds { values: mut bound, farthest } = bounds(&reach);
        let reached = self.reached(&own, &solved.joints, &solved.pose, &farthest);
        // One machine at a time where nothing is allowed yet, or where it is only what is beyond the
        // first order that is too much.
        let nothing_yet = allowed.contains(&f64::NEG_INFINITY);
        if nothing_yet || (!closed(&bound) && closed(&bounds(&|u| first.reach(u)[0]).values)) {
            let at_middle = Extent {
                machine,
                joints: &solved.joints,
                pose: solved.pose,
                command: (spot_command.joints, spot_command.at),
                shift: own.shifts.clone(),
                deviating: self.deviating,
            };
            let known = (&at_middle, &command, &forms, &over, &first);
            if let Ok(worst) = self.worst_machines(known, &halves) {
                // Where one direction is too far, the box is not closed, whatever the others are.
                let in_vain = Cell::new(false);
                let finer = bounds(&|u| {
                    let coarse = reach(u);
                    let enough = enough_along(machine, allowed, u);
                    if in_vain.get() || coarse * FINE * FINE <= enough {
                        return coarse;
                    }
                    let finer = coarse.min(worst.reach(u));
                    in_vain.set(!nothing_yet && finer > enough);
                    finer
                });
                for (bound, finer) in bound.iter_mut().zip(finer.values) {
                    *bound = bound.min(finer);
                }
            }
        }
        Ok((bound, reached))
    }

    /// The exact error at the vertices that are worst to first order along axes and `directions` of
    /// position and orientation, and from the farthest of them on.
    fn reached(
        &self,
        over: &Over,
        joints: &[f64],
        pose: &Pose<f64>,
        directions: &[Vector<f64>; 2],
    ) -> [f64; TARGETS] {
        let machine = self.machine;
        let mut best = [f64::NEG_INFINITY; TARGETS];
        let mut try_vertex = |direction: &[f64; SIX]| -> Option<[f64; SIX]> {
            let ends: Vec<f64> = over
                .slopes
                .iter()
                .map(|slope| 1f64.copysign(along(direction, slope).midpoint()))
                .collect();
            let mut p = machine.nominal.clone();
            for &(index, shift) in &over.shifts {
                p[index] += shift.midpoint();
            }
            let Deviating { parameters, variables, swing, .. } = self.deviating;
            for ((&parameter, &variable), &swing) in parameters.iter().zip(variables).zip(swing) {
                p[parameter] += swing * ends[variable];
            }
            let struts = limbs(machine, &p, joints);
            let sample = Sample { machine, p: &p, limbs: &struts };
            let (reached_pose, status) = forward(&sample, joints, pose);
            if status != Status::Ok {
                return None;
            }
            let error = displacement(pose, &reached_pose);
            let length =
                |part: usize| (0..3).map(|k| error[3 * part + k].powi(2)).sum::<f64>().sqrt();
            for k in 0..SIX {
                best[k] = best[k].max(error[k]);
                best[SIX + k] = best[SIX + k].max(-error[k]);
            }
            for part in 0..2 {
                best[2 * SIX + part] = best[2 * SIX + part].max(length(part));
            }
            Some(displacement_numbers(machine, pose, &reached_pose))
        };
        let free = indices_of(&machine.dof);
        for part in 0..2 {
            let own = 3 * part..3 * part + 3;
            let towards = |vector: &[f64]| {
                let mut direction = [0.0; SIX];
                direction[own.clone()].copy_from_slice(vector);
                direction
            };
            let size = |one: &[f64; SIX]| one[own.clone()].iter().map(|k| k * k).sum::<f64>();
            let mut farthest = [0.0; SIX];
            for &k in free.iter().filter(|&&k| k / 3 == part) {
                for sign in [1.0, -1.0] {
                    let mut direction = [0.0; SIX];
                    direction[k] = sign;
                    if let Some(vertex) = try_vertex(&direction)
                        && size(&vertex) > size(&farthest)
                    {
                        farthest = vertex;
                    }
                }
            }
            for mut direction in [towards(&farthest[own.clone()]), towards(&directions[part])] {
                for _ in 0..CLIMBED {
                    if size(&direction) == 0.0 {
                        break;
                    }
                    let Some(vertex) = try_vertex(&direction) else { break };
                    direction = towards(&vertex[own.clone()]);
                }
            }
        }
        best
    }
}

/// Whether the parasitic freedoms can be enclosed over a region: turns about the base's axes are those
/// of the outermost angle, or of all three where none is commanded.
pub fn can_be_enclosed(machine: &Machine) -> bool {
    let parasitic: Vec<usize> =
        (3..SIX).filter(|&k| machine.dof[k] && !machine.commanded[k]).collect();
    let commanded = (3..SIX).any(|k| machine.commanded[k]);
    !machine.is_overconstrained() && (parasitic.is_empty() || parasitic == [5] || !commanded)
}

/// How far displacements may reach along a direction where no bound in which that reach takes part may be above
/// the allowed one.
fn enough_along(machine: &Machine, allowed: &[f64; TARGETS], direction: &[f64; SIX]) -> f64 {
    let mut enough = f64::INFINITY;
    for (k, part) in direction.iter().enumerate().filter(|&(_, &part)| part != 0.0) {
        let unit = if k < 3 { 1.0 } else { machine.characteristic_length };
        enough = enough.min(unit * allowed[2 * SIX + k / 3]);
        if part.abs() == 1.0 {
            enough = enough.min(unit * allowed[k + if *part > 0.0 { 0 } else { SIX }]);
        }
    }
    enough
}

/// The middle of a box.
pub(super) fn middle_of(sides: &[[f64; 2]]) -> Vec<f64> {
    sides.iter().map(|[low, high]| 0.5 * (low + high)).collect()
}

/// The box of one pose alone.
pub(super) fn sides_at(pose: &[f64]) -> Vec<[f64; 2]> {
    pose.iter().map(|&value| [value, value]).collect()
}
