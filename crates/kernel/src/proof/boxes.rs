//! Bounds at a pose with the box of variables divided: where nothing is proven over the whole of it, or
//! where a bound is not as low as its target.
//!
//! **Existence.** A box over which nothing is proven is halved across the variable that moves the platform
//! most, and so on until all leaves of this tree are proven. Over a leaf L every machine t has exactly one
//! root x_L(t) in a known box U_L, and the derivatives of the closures to the displacement are regular
//! there, so that x_L is continuous.
//!
//! **One branch.** The x_L must be pieces of one function. Where a box was halved, take the middle m of the
//! face between the halves, a leaf on either side that holds m, and enclose a root at m: if it lies in both
//! U, it is the root of both leaves, since neither has another. By induction up the tree all leaves of a
//! box then make up one continuous function X of regular roots: of the two halves each has one, they have
//! the same value at m, and where two such functions agree on a connected set (the face), they agree on all
//! of it: the points of agreement are closed by continuity, and open because a regular root has no other
//! next to it. Last, X is the branch meant, the one that is continued from the shift: the root that
//! [`forward`](crate::kinematics::forward) finds at t = 0 from the commanded pose lies in the U of a leaf
//! that holds t = 0. A continuation along any path from there is X, for regular roots cannot part.
//!
//! **Lower bounds.** A leaf whose magnitudes lie above their targets is halved across the variable with
//! the least certain slope. Its halves are within it, so that their root is known to exist: a smaller
//! enclosure is taken where it is of that root, its middle in U_L; elsewhere the leaf's own bound stays, and
//! so do its bounds of what no target is given for.
//!
//! Variables that are together a unit vector are not divided: a proof is over the cube around their sphere,
//! and m has their middle, 0, which is one point of that cube. Effort is counted in boxes, so that the result
//! does not depend on the computer.

use super::Unproven;
use super::at_pose::{Enclosed, Extent, FINE, Part, PoseBound, lies_in};
use super::point;
use super::targets::{AS_LOW_AS_CAN_BE, Bounds, Closeness, TARGETS};
use crate::linear::SIX;
use crate::scalar::Interval;
use crate::spatial::Pose;

/// A side shorter than this is not halved: the machine is singular there, or next to it.
const SHORTEST: f64 = 1e-4;

/// What may be spent on a pose, and when there is no need to.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Boxes that may be looked at, at least 1.
    pub most_boxes: usize,
    /// Magnitudes (m, rad) that need not be bounded lower; not finite where any bound will do.
    pub targets: [f64; 2],
}

impl Effort {
    /// One box.
    pub const WHOLE: Effort = Effort { most_boxes: 1, targets: [f64::INFINITY; 2] };
}

/// Bounds of the error at one pose over every deviation in the box, and the boxes looked at.
pub fn bound_in_boxes(
    extent: &Extent<'_>,
    effort: &Effort,
) -> (Result<PoseBound, Unproven>, usize) {
    let mut search = Search { extent, most: effort.most_boxes.max(1), boxes: 0 };
    let bound = search.leaves().map(|leaves| search.bound(leaves, &effort.targets));
    (bound, search.boxes)
}

/// A box of the tree: halved, or a leaf.
enum Node<'a> {
    Halved { sides: Vec<Interval>, variable: usize, halves: Box<[Node<'a>; 2]> },
    Leaf(Box<Part<'a>>),
}

/// A proven part and its bounds.
struct Bounded<'a> {
    part: Part<'a>,
    bounds: Bounds,
}

struct Search<'a> {
    extent: &'a Extent<'a>,
    most: usize,
    boxes: usize,
}

impl<'a> Search<'a> {
    /// Proven parts that make up the box, all of the branch that is continued from the shift.
    fn leaves(&mut self) -> Result<Vec<Part<'a>>, Unproven> {
        let whole = vec![Interval::symmetric(1.0); self.extent.deviating.count];
        let tree = self.proven(whole, &self.extent.pose)?;
        if let Node::Halved { .. } = tree {
            self.check_shift(&tree)?;
            self.check_branch(&tree)?;
        }
        let mut leaves = Vec::new();
        tree.into_leaves(&mut leaves);
        Ok(leaves)
    }

    /// A box, halved until all of it is proven; its machines are looked for from `start`.
    fn proven(&mut self, sides: Vec<Interval>, start: &Pose<f64>) -> Result<Node<'a>, Unproven> {
        self.boxes += 1;
        let not = match self.extent.part(sides.clone(), start) {
            Ok(part) => return Ok(Node::Leaf(Box::new(part))),
            Err(not) => not,
        };
        let Some(pose) = not.pose.filter(|_| self.boxes + 2 <= self.most) else {
            return Err(not.why);
        };
        let mut widest = None;
        let mut most = 0.0;
        for (variable, &effect) in not.effects.iter().enumerate() {
            if effect > most && self.divisible(&sides, variable) {
                (most, widest) = (effect, Some(variable));
            }
        }
        let Some(variable) = widest else { return Err(not.why) };
        let [low, high] = halved(&sides, variable);
        let halves = Box::new([self.proven(low, &pose)?, self.proven(high, &pose)?]);
        Ok(Node::Halved { sides, variable, halves })
    }

    /// Whether a side can be halved.
    fn divisible(&self, sides: &[Interval], variable: usize) -> bool {
        sides[variable].upper - sides[variable].lower > SHORTEST
            && !self.extent.deviating.directions.iter().flatten().any(|&member| member == variable)
    }

    /// The machine at one point of the box.
    fn at(&self, variables: &[f64], start: &Pose<f64>) -> Result<Enclosed, Unproven> {
        let spot: Vec<Interval> = variables.iter().map(|&value| point(value)).collect();
        self.extent.enclose(&spot, start).map_err(|not| not.why)
    }

    /// That the branch is the one found from the commanded pose at the shift.
    fn check_shift(&self, tree: &Node<'a>) -> Result<(), Unproven> {
        let middle = vec![0.0; self.extent.deviating.count];
        let spot = self.at(&middle, &self.extent.pose)?;
        of(&spot, &tree.leaf(&middle).first).then_some(()).ok_or(Unproven::TooWide)
    }

    /// That all leaves below a box are of one branch.
    fn check_branch(&self, tree: &Node<'a>) -> Result<(), Unproven> {
        let Node::Halved { sides, variable, halves } = tree else { return Ok(()) };
        let mut middle: Vec<f64> = sides.iter().map(|side| side.midpoint()).collect();
        middle[*variable] = halving(sides[*variable]);
        let [one, other] = halves.each_ref().map(|half| &half.leaf(&middle).first);
        let spot = self.at(&middle, &one.pose)?;
        if !of(&spot, one) || !of(&spot, other) {
            return Err(Unproven::TooWide);
        }
        halves.iter().try_for_each(|half| self.check_branch(half))
    }

    /// The largest bounds over the parts, which are halved where a magnitude lies above its target.
    fn bound(&mut self, mut leaves: Vec<Part<'a>>, targets: &[f64; 2]) -> PoseBound {
        // Those first that may reach farthest: the others then need not be looked at as closely.
        let size = |part: &Part<'_>| {
            part.first.whole[..3].iter().map(|one| one.magnitude()).fold(0.0, f64::max)
        };
        leaves.sort_by(|a, b| size(b).total_cmp(&size(a)));
        let closeness = |floor: &[f64; TARGETS]| {
            let mut enough = *floor;
            for part in 0..2 {
                // What is below its target will not be divided.
                enough[2 * SIX + part] = enough[2 * SIX + part].min(targets[part]);
            }
            Closeness { fine: FINE, enough }
        };
        let mut floor = AS_LOW_AS_CAN_BE;
        let mut open: Vec<Bounded<'a>> = Vec::with_capacity(leaves.len());
        for part in leaves {
            let bounds = part.bounds(&closeness(&floor));
            raise(&mut floor, &bounds.values);
            open.push(Bounded { part, bounds });
        }
        // Finished leaves: dividing them further is of no use.
        let mut closed = AS_LOW_AS_CAN_BE;
        let mut wanted: Vec<usize> =
            (0..2).filter(|&part| targets[part] >= 0.0 && targets[part].is_finite()).collect();
        while self.boxes + 2 <= self.most {
            wanted.retain(|&part| closed[2 * SIX + part] <= targets[part]);
            let above = |one: &Bounded<'_>| {
                let share =
                    |&part: &usize| (one.bounds.values[2 * SIX + part] / targets[part], part);
                wanted.iter().map(share).max_by(|a, b| a.0.total_cmp(&b.0))
            };
            let worst = (0..open.len())
                .filter_map(|number| {
                    above(&open[number]).map(|(share, part)| (share, part, number))
                })
                .max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, quantity, number)) = worst.filter(|worst| worst.0 > 1.0) else { break };
            let Bounded { part, bounds } = open.swap_remove(number);
            let mut direction = [0.0; SIX];
            direction[3 * quantity..3 * quantity + 3].copy_from_slice(&bounds.farthest[quantity]);
            let loosest = part.loosest(&direction);
            let Some(variable) = loosest.filter(|&one| self.divisible(&part.sides, one)) else {
                raise(&mut closed, &bounds.values);
                continue;
            };
            let mut floor = closed;
            open.iter().for_each(|one| raise(&mut floor, &one.bounds.values));
            for sides in halved(&part.sides, variable) {
                self.boxes += 1;
                let half = self.extent.part(sides, &part.first.pose).ok();
                let Some(half) = half.filter(|half| of(&half.first, &part.first)) else {
                    raise(&mut closed, &bounds.values);
                    continue;
                };
                // What nobody asks for stays as the outer box has it.
                let mut near = closeness(&floor);
                for target in
                    (0..TARGETS).filter(|&k| k < 2 * SIX || !wanted.contains(&(k - 2 * SIX)))
                {
                    near.enough[target] = f64::INFINITY;
                }
                let mut own = half.bounds(&near);
                for (own, outer) in own.values.iter_mut().zip(&bounds.values) {
                    *own = own.min(*outer);
                }
                raise(&mut floor, &own.values);
                open.push(Bounded { part: half, bounds: own });
            }
        }
        open.iter().for_each(|one| raise(&mut closed, &one.bounds.values));
        PoseBound::of(&closed)
    }
}

impl<'a> Node<'a> {
    /// A leaf that holds these variables.
    fn leaf(&self, variables: &[f64]) -> &Part<'a> {
        match self {
            Node::Leaf(part) => part,
            Node::Halved { sides, variable, halves } => {
                let high = variables[*variable] > halving(sides[*variable]);
                halves[usize::from(high)].leaf(variables)
            }
        }
    }

    fn into_leaves(self, leaves: &mut Vec<Part<'a>>) {
        match self {
            Node::Leaf(part) => leaves.push(*part),
            Node::Halved { halves, .. } => {
                halves.into_iter().for_each(|half| half.into_leaves(leaves));
            }
        }
    }
}

/// Whether the root enclosed at the middle of a part is that of another, which holds the middle.
fn of(spot: &Enclosed, other: &Enclosed) -> bool {
    lies_in(&spot.middle, &other.unique_in)
}

/// Where a side is halved.
fn halving(side: Interval) -> f64 {
    side.midpoint()
}

fn halved(sides: &[Interval], variable: usize) -> [Vec<Interval>; 2] {
    let side = sides[variable];
    let middle = halving(side);
    [Interval::new(side.lower, middle), Interval::new(middle, side.upper)].map(|half| {
        let mut sides = sides.to_vec();
        sides[variable] = half;
        sides
    })
}

fn raise(floor: &mut [f64; TARGETS], values: &[f64; TARGETS]) {
    for (floor, &value) in floor.iter_mut().zip(values) {
        *floor = floor.max(value);
    }
}
