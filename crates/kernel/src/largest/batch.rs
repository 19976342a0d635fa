//! Many sets at once: the effects of variables at many poses, for position and orientation.

use super::{Farthest, Search, Set};
use crate::batch::for_chunks;
use crate::dispatch::{Work, dispatch_seldom};
use crate::scalar::Real;
use crate::spatial::Vector;

/// Where the variables can lie.
#[derive(Clone, Debug)]
pub struct Domain {
    /// Middle of each variable's ends.
    pub middle: Vec<f64>,
    /// From there to either end.
    pub half: Vec<f64>,
    /// Variables that are together a unit vector.
    pub directions: Vec<Vec<usize>>,
}

/// Errors at some poses: `centre` (m numbers a pose) where all variables are 0, and `effects` (m, v) of
/// each variable at +1.
#[derive(Clone, Copy, Debug)]
pub struct Largest<'a> {
    /// Errors where all variables are 0.
    pub centre: &'a [f64],
    /// First-order change where a variable is +1.
    pub effects: &'a [f64],
    /// Components of an error.
    pub components: usize,
    /// Where the variables can lie.
    pub domain: &'a Domain,
    /// Components of each quantity, at most three.
    pub quantities: &'a [Vec<usize>],
}

/// Numbers of a [`Farthest`].
pub const NUMBERS: usize = 5;

/// Fills `out` with length, reached and direction of each quantity, for each of `count` poses.
pub fn largest_of(count: usize, of: &Largest<'_>, out: &mut [f64]) {
    let width = NUMBERS * of.quantities.len();
    let mut nothing = vec![(); count];
    for_chunks(count, (out, width), (&mut [], 0), &mut nothing, |first, out, _, _| {
        dispatch_seldom(Chunk { of, first, out });
    });
}

struct Chunk<'a> {
    of: &'a Largest<'a>,
    first: usize,
    out: &'a mut [f64],
}

impl Work for Chunk<'_> {
    #[inline(always)]
    fn run<S: Real>(self) {
        let Chunk { of, first, out } = self;
        let variables = of.domain.half.len();
        let size = of.components * variables;
        let mut single = vec![true; variables];
        for &member in of.domain.directions.iter().flatten() {
            single[member] = false;
        }
        let (mut set, mut search) = (Set::default(), Search::default());
        let width = NUMBERS * of.quantities.len();
        for (number, out) in out.chunks_mut(width.max(1)).enumerate() {
            let pose = first + number;
            let centre = &of.centre[pose * of.components..][..of.components];
            let effects = &of.effects[pose * size..][..size];
            for (components, out) in of.quantities.iter().zip(out.chunks_mut(NUMBERS)) {
                fill(&mut set, centre, effects, of.domain, &single, components);
                let Farthest { length, reached, direction } = search.farthest::<S>(&set);
                out[0] = length;
                out[1] = reached;
                out[2..].copy_from_slice(&direction);
            }
        }
    }
}

/// What one variable does to some components.
#[inline(always)]
fn column(effects: &[f64], variables: usize, components: &[usize], variable: usize) -> Vector<f64> {
    let mut vector = [0.0; 3];
    for (one, &component) in vector.iter_mut().zip(components) {
        *one = effects[component * variables + variable];
    }
    vector
}

/// The set of one quantity at one pose.
#[inline(always)]
fn fill(
    set: &mut Set,
    centre: &[f64],
    effects: &[f64],
    domain: &Domain,
    single: &[bool],
    components: &[usize],
) {
    let variables = single.len();
    set.centre = [0.0; 3];
    for (one, &component) in set.centre.iter_mut().zip(components) {
        *one = centre[component];
    }
    set.segments.clear();
    for variable in 0..variables {
        if !single[variable] {
            continue;
        }
        let mut segment = column(effects, variables, components, variable);
        for k in 0..3 {
            set.centre[k] += domain.middle[variable] * segment[k];
            segment[k] *= domain.half[variable];
        }
        if segment != [0.0; 3] {
            set.segments.push(segment);
        }
    }
    set.axes.clear();
    set.ellipsoids.clear();
    for members in &domain.directions {
        let start = set.axes.len();
        for &member in members {
            set.axes.push(column(effects, variables, components, member));
        }
        set.ellipsoids.push(start..set.axes.len());
    }
}
