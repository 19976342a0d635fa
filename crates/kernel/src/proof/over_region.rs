//! Bounds of the error over a continuous region of commanded poses, by branch and bound.
//!
//! Over a box of poses the nominal command is enclosed first (the parasitic freedoms and the joints as
//! the unknowns), then the actual platform relative to it. The box with the largest bound is halved until
//! no bound lies above an error reached somewhere by more than the gap.

use super::at_pose::{Extent, along, displacement_numbers};
use super::pose_box::Over;
use super::region::Region;
use super::targets::{AS_LOW_AS_CAN_BE, Closeness, TARGETS, targets};
use super::{Deviating, Unproven, point};
use crate::batch::{displacement, share_out};
use crate::kinematics::{Inverse, Sample, commanded_pose, forward, inverse, limbs};
use crate::linear::SIX;
use crate::machine::{Machine, indices_of};
use crate::scalar::Interval;
use crate::spatial::Pose;
use crate::status::Status;

/// Freedoms up to which affine forms are shorter.
const FEW: usize = 3;
/// Boxes that are looked at together.
const BATCH: usize = 32;
/// A box of less than this share of the region along every axis is given up.
const SMALLEST: f64 = 1e-4;
/// Magnitudes are refined until they lie at most this above the farthest reach.
const FINE: f64 = 1.005;
/// A component below this share of its magnitude is closed to the gap of this share.
const MINOR: f64 = 0.1;

/// What is proven over a region; bounds are infinite where nothing is.
#[derive(Clone, Debug)]
pub struct RegionBound {
    /// Bounds of the targets: components upwards, downwards (turned), magnitudes.
    pub bound: [f64; TARGETS],
    /// What is reached of each.
    pub reached: [f64; TARGETS],
    /// Where: commanded freedoms.
    pub at: Vec<Vec<f64>>,
    /// Boxes looked at.
    pub boxes: usize,
    /// By how much the bounds lie above the errors reached, in the measure of [`Region::gap`].
    pub gap: f64,
    /// Why a part of the region is not proven, and its middle.
    pub unproven: Option<(Unproven, Vec<f64>)>,
    /// A pose of the region that the machine cannot be commanded to.
    pub out_of_reach: Option<(Status, Vec<f64>)>,
}

struct Cell {
    sides: Vec<[f64; 2]>,
    bounds: Option<CellBounds>,
}

#[derive(Clone)]
struct CellBounds {
    bound: Result<[f64; TARGETS], Unproven>,
    reached: [f64; TARGETS],
    middle: Vec<f64>,
    status: Status,
}

impl Region<'_> {
    /// Bounds over a box of poses and the errors reached in its middle.
    ///
    /// Slopes over all machines give a first bound; where it is above `allowed`, the exact extent at the
    /// middle takes their place.
    fn look(&self, sides: &[[f64; 2]], allowed: &[f64; TARGETS]) -> CellBounds {
        let machine = self.machine;
        let middle: Vec<f64> = sides.iter().map(|[low, high]| 0.5 * (low + high)).collect();
        let start = commanded_pose(machine, &middle);
        let solved = inverse(machine, &machine.nominal, &start);
        let reached = [f64::NEG_INFINITY; TARGETS];
        if solved.status != Status::Ok {
            let status = solved.status;
            return CellBounds { bound: Err(Unproven::NearSingular), reached, middle, status };
        }
        let bounded = || {
            if sides.len() <= FEW {
                self.bounded::<FEW>((sides, &middle), &solved, allowed)
            } else {
                self.bounded::<SIX>((sides, &middle), &solved, allowed)
            }
        };
        match bounded() {
            Ok((bound, reached)) => {
                CellBounds { bound: Ok(bound), reached, middle, status: Status::Ok }
            }
            Err(why) => CellBounds { bound: Err(why), reached, middle, status: Status::Ok },
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
        let spot: Vec<[f64; 2]> = middle.iter().map(|&value| [value, value]).collect();
        let halves: Vec<Interval> = sides
            .iter()
            .zip(middle)
            .map(|(side, &middle)| Interval::new(side[0], side[1]) - point(middle))
            .collect();
        let command = self.command(sides, &solved.pose, &solved.joints)?;
        let over = self.over(&command)?;
        let spot_command = self.command(&spot, &solved.pose, &solved.joints)?;
        let own = self.over(&spot_command)?;
        let reached = self.reached(&own, &solved.joints, &solved.pose);
        let forms = self.forms::<M>(&spot_command, &command, (sides, &halves), &solved.pose)?;
        let first = self.first_order(&forms, &over)?;
        let bounds = |most: &dyn Fn(&[f64; SIX]) -> f64| {
            let closeness = Closeness { fine: FINE, enough: *allowed };
            targets(machine, &over.whole, &closeness, most).values
        };
        let closed = |bound: &[f64; TARGETS]| bound.iter().zip(allowed).all(|(a, b)| a <= b);
        let reach = |u: &[f64; SIX]| {
            let [linear, beyond] = first.reach(u);
            (point(linear) + point(beyond)).upper
        };
        let mut bound = bounds(&reach);
        // One machine at a time where nothing is allowed yet, or where it is only what is beyond the
        // first order that is too much.
        let nothing_yet = allowed.contains(&f64::NEG_INFINITY);
        if nothing_yet || (!closed(&bound) && closed(&bounds(&|u| first.reach(u)[0]))) {
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
                let finer = bounds(&|u| {
                    let coarse = reach(u);
                    let enough = coarse * FINE * FINE <= enough_along(machine, allowed, u);
                    if enough { coarse } else { coarse.min(worst.reach(u)) }
                });
                for (bound, finer) in bound.iter_mut().zip(finer) {
                    *bound = bound.min(finer);
                }
            }
        }
        Ok((bound, reached))
    }

    /// The exact error at the vertices that are worst to first order.
    fn reached(&self, over: &Over, joints: &[f64], pose: &Pose<f64>) -> [f64; TARGETS] {
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
            let mut farthest: Option<[f64; SIX]> = None;
            let size = |one: &[f64; SIX]| (0..3).map(|k| one[3 * part + k].powi(2)).sum::<f64>();
            for &k in free.iter().filter(|&&k| k / 3 == part) {
                for sign in [1.0, -1.0] {
                    let mut direction = [0.0; SIX];
                    direction[k] = sign;
                    if let Some(vertex) = try_vertex(&direction)
                        && farthest.is_none_or(|best| size(&vertex) > size(&best))
                    {
                        farthest = Some(vertex);
                    }
                }
            }
            for _ in 0..2 {
                let Some(vertex) = farthest else { break };
                let mut direction = [0.0; SIX];
                direction[3 * part..3 * part + 3].copy_from_slice(&vertex[3 * part..3 * part + 3]);
                farthest = try_vertex(&direction);
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

/// Bounds over a region. `progress(boxes, gap)` is called between batches; false stops the search.
pub fn bound_over_region(
    region: &Region<'_>,
    mut progress: impl FnMut(usize, f64) -> bool,
) -> RegionBound {
    let width = region.sides.len();
    let mut result = RegionBound {
        bound: [f64::INFINITY; TARGETS],
        reached: [f64::NEG_INFINITY; TARGETS],
        at: vec![vec![f64::NAN; width]; TARGETS],
        boxes: 0,
        gap: f64::INFINITY,
        unproven: None,
        out_of_reach: None,
    };
    let mut closed = [f64::NEG_INFINITY; TARGETS];
    // Nothing is reached yet, so the first box is bounded as closely as possible.
    let mut allowed = AS_LOW_AS_CAN_BE;
    let mut open = vec![Cell { sides: region.sides.clone(), bounds: None }];
    loop {
        // The boxes not looked at yet, side by side.
        let mut fresh: Vec<&mut Cell> =
            open.iter_mut().filter(|cell| cell.bounds.is_none()).collect();
        let count = fresh.len();
        share_out(&mut fresh, count, 1, |_, cells| {
            for cell in cells {
                cell.bounds = Some(region.look(&cell.sides, &allowed));
            }
        });
        result.boxes += count;
        for cell in &open {
            let Some(bounds) = &cell.bounds else { continue };
            if bounds.status != Status::Ok {
                result.out_of_reach = Some((bounds.status, bounds.middle.clone()));
                return result;
            }
            for target in 0..TARGETS {
                if bounds.reached[target] > result.reached[target] {
                    result.reached[target] = bounds.reached[target];
                    result.at[target] = bounds.middle.clone();
                }
            }
        }
        if !result.reached.contains(&f64::NEG_INFINITY) {
            allowed = allowed_bounds(&result.reached, region.gap);
        }
        let excess = |bound: &[f64; TARGETS]| {
            (0..TARGETS)
                .map(|target| bound[target] - allowed[target])
                .fold(f64::NEG_INFINITY, f64::max)
        };
        // Boxes that cannot rise above the allowed bounds are finished.
        let mut kept: Vec<(f64, Cell)> = Vec::new();
        for cell in open {
            match cell.bounds.as_ref().map(|bounds| bounds.bound) {
                Some(Ok(bound)) if excess(&bound) <= 0.0 => {
                    for target in 0..TARGETS {
                        closed[target] = closed[target].max(bound[target]);
                    }
                }
                Some(Ok(bound)) => kept.push((relative_excess(&bound, &allowed), cell)),
                _ => kept.push((f64::INFINITY, cell)),
            }
        }
        kept.sort_by(|a, b| b.0.total_cmp(&a.0));
        let widest = kept.first().map_or(0.0, |(excess, _)| *excess);
        let indivisible = kept.iter().all(|(_, cell)| share_of(region, &cell.sides) == 0.0);
        let stop = indivisible
            || result.boxes >= region.most_boxes
            || !progress(result.boxes, region.gap + widest);
        let given_up = kept.iter().find(|(_, cell)| {
            cell.bounds.as_ref().is_none_or(|bounds| bounds.bound.is_err())
                && (stop || share_of(region, &cell.sides) < SMALLEST)
        });
        if let Some((_, cell)) = given_up {
            let why = match cell.bounds.as_ref().map(|bounds| bounds.bound) {
                Some(Err(why)) => why,
                _ => Unproven::TooWide,
            };
            let middle = cell.sides.iter().map(|[low, high]| 0.5 * (low + high)).collect();
            result.unproven = Some((why, middle));
            return result;
        }
        if stop {
            for (_, cell) in &kept {
                if let Some(Ok(bound)) = cell.bounds.as_ref().map(|bounds| bounds.bound) {
                    for target in 0..TARGETS {
                        closed[target] = closed[target].max(bound[target]);
                    }
                }
            }
            result.bound = closed;
            result.gap = gap_of(&closed, &result.reached);
            return result;
        }
        open = Vec::with_capacity(kept.len() + BATCH);
        for (number, (_, cell)) in kept.into_iter().enumerate() {
            if number < BATCH {
                open.extend(halves(region, &cell.sides));
            } else {
                open.push(cell);
            }
        }
    }
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

/// The highest bound of each target that closes it.
fn allowed_bounds(reached: &[f64; TARGETS], gap: f64) -> [f64; TARGETS] {
    let mut allowed = [0.0; TARGETS];
    for target in 0..TARGETS {
        let part = if target < 2 * SIX { target % SIX / 3 } else { target - 2 * SIX };
        let magnitude = reached[2 * SIX + part];
        let scale = reached[target].abs().max(MINOR * magnitude);
        allowed[target] = reached[target] + gap * scale;
    }
    allowed
}

/// What the highest of the targets' gaps is.
fn gap_of(bound: &[f64; TARGETS], reached: &[f64; TARGETS]) -> f64 {
    let unit = allowed_bounds(reached, 1.0);
    (0..TARGETS)
        .filter(|&target| unit[target] > reached[target])
        .map(|target| (bound[target] - reached[target]) / (unit[target] - reached[target]))
        .fold(0.0, f64::max)
}

/// By how much the worst target lies above its allowed bound, relative to that.
fn relative_excess(bound: &[f64; TARGETS], allowed: &[f64; TARGETS]) -> f64 {
    (0..TARGETS)
        .map(|target| {
            let scale = allowed[target].abs().max(f64::MIN_POSITIVE);
            (bound[target] - allowed[target]) / scale
        })
        .fold(0.0, f64::max)
}

/// The widest side of a box, relative to the region's.
fn share_of(region: &Region<'_>, sides: &[[f64; 2]]) -> f64 {
    sides
        .iter()
        .zip(&region.sides)
        .map(|(own, all)| if all[1] > all[0] { (own[1] - own[0]) / (all[1] - all[0]) } else { 0.0 })
        .fold(0.0, f64::max)
}

/// A box halved along its widest side, relative to the region's.
fn halves(region: &Region<'_>, sides: &[[f64; 2]]) -> [Cell; 2] {
    let share = |k: usize| {
        let [low, high] = region.sides[k];
        if high > low { (sides[k][1] - sides[k][0]) / (high - low) } else { -1.0 }
    };
    let widest = (0..sides.len()).max_by(|&a, &b| share(a).total_cmp(&share(b))).unwrap_or(0);
    let middle = 0.5 * (sides[widest][0] + sides[widest][1]);
    let (mut low, mut high) = (sides.to_vec(), sides.to_vec());
    low[widest][1] = middle;
    high[widest][0] = middle;
    [low, high].map(|sides| Cell { sides, bounds: None })
}
