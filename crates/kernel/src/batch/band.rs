//! What a band of parameters can do to the error at a pose, to first order: how far each component reaches,
//! its standard uncertainty, and the largest length of position and orientation.
//!
//! A deviation opens the closures that read its parameter, and the platform answers with the columns of
//! their inverse. Variables that one closure alone reads therefore move the platform along one and the same
//! twist: their sizes, and their squares, are added before they are multiplied with it, and the set of all
//! errors is the sum of as many segments as there are closures, not parameters.

use super::first_order::{FirstOrder, Place};
use super::samples::Rows;
use crate::kinematics::Linearisation;
use crate::largest::{Search, Set};
use crate::linear::{CLOSURES, SIX};
use crate::machine::{Machine, indices_of};
use crate::scalar::Real;
use crate::spatial::dot;

/// Up to so many segments all their ends are tried; beyond, cones of directions.
const FEW: usize = 9;
/// Ends of half of that many segments.
const ENDS: usize = 16;
/// Columns whose half widths need no memory of their own.
const COLUMNS: usize = 64;

/// The columns of a band: which parameters, and of which variable in [-1, 1] each.
#[derive(Clone, Copy, Debug)]
pub struct BandColumns<'a> {
    /// Parameters.
    pub parameters: &'a [usize],
    /// The number of the variable that each is moved by.
    pub variables: &'a [usize],
    /// By how much at +1, a row for each sample or one for all.
    pub half: Rows<'a>,
    /// Of each variable: standard deviations in its half band.
    pub sigmas: &'a [f64],
}

/// Reach (component), standard uncertainty (component) and largest length (quantity) of each sample.
pub struct Band<'a> {
    effect: BandEffect<'a>,
    half: Rows<'a>,
    columns: usize,
    /// Errors where all variables are 0, in the components that the machine can move in.
    centre: Rows<'a>,
}

impl<'a> Band<'a> {
    /// Of a machine about errors `centre`; `quantities`: components, at most three, of each length.
    pub fn new(
        machine: &'a Machine,
        columns: BandColumns<'a>,
        centre: Rows<'a>,
        quantities: &'a [Vec<usize>],
    ) -> Self {
        let numbered = columns.parameters.iter().copied().zip(columns.variables.iter().copied());
        Band {
            effect: BandEffect::new(machine, numbered.enumerate(), columns.sigmas, quantities),
            half: columns.half,
            columns: columns.parameters.len(),
            centre,
        }
    }
}

impl FirstOrder for Band<'_> {
    fn width(&self) -> usize {
        2 * self.effect.components.len() + self.effect.quantities.len()
    }
    #[inline(always)]
    fn write<S: Real>(
        &self,
        linear: &Linearisation<S>,
        place: Place,
        _part: usize,
        columns: &mut [S],
    ) {
        let count = self.effect.components.len();
        let mut here = [S::default(); COLUMNS];
        let mut elsewhere = Vec::new();
        let half = if self.columns <= COLUMNS {
            &mut here[..self.columns]
        } else {
            elsewhere.resize(self.columns, S::default());
            &mut elsewhere[..]
        };
        self.half.load(place.first, place.size, half);
        let mut centre = [S::default(); SIX];
        self.centre.load(place.first, place.size, &mut centre[..count]);
        let (reach, rest) = columns.split_at_mut(count);
        let (uncertainty, lengths) = rest.split_at_mut(count);
        let mut answer = Answer { reach, uncertainty, lengths };
        self.effect.write(linear, half, &centre, place.size, &mut answer);
    }
}

/// What some variables do, worked out from the linearised closures: which of them lie in one closure.
pub(super) struct BandEffect<'a> {
    components: Vec<usize>,
    quantities: &'a [Vec<usize>],
    /// Of each closure the variables of one column that only it reads, once.
    singles: [Vec<Single>; CLOSURES],
    /// All others.
    others: Vec<Variable<'a>>,
    /// Closures that a variable lies in, and variables that lie in none.
    segments: usize,
}

/// A variable of one column that one closure reads once.
struct Single {
    place: usize,
    slot: usize,
    weight: f64,
}

struct Variable<'a> {
    /// Its columns, by place, with the closures that read each and at which slot.
    columns: Vec<(usize, &'a [(usize, usize)])>,
    /// The one closure that reads all of them, if it is one.
    closure: Option<usize>,
    /// One over the square of its sigmas.
    weight: f64,
}

/// Where the numbers of one band go.
pub(super) struct Answer<'a, S> {
    pub(super) reach: &'a mut [S],
    pub(super) uncertainty: &'a mut [S],
    pub(super) lengths: &'a mut [S],
}

impl<'a> BandEffect<'a> {
    /// Of `columns`: place among the half widths, parameter, and number of its variable in `sigmas`.
    pub(super) fn new(
        machine: &'a Machine,
        columns: impl Iterator<Item = (usize, (usize, usize))>,
        sigmas: &[f64],
        quantities: &'a [Vec<usize>],
    ) -> Self {
        let mut variables: Vec<Variable<'a>> = sigmas
            .iter()
            .map(|sigma| Variable { columns: Vec::new(), closure: None, weight: sigma.powi(-2) })
            .collect();
        for (place, (parameter, variable)) in columns {
            variables[variable].columns.push((place, &machine.dependents[parameter]));
        }
        let mut effect = BandEffect {
            components: indices_of(&machine.dof),
            quantities,
            singles: Default::default(),
            others: Vec::new(),
            segments: 0,
        };
        let mut opened = [false; CLOSURES];
        for mut variable in variables {
            let mut closures = variable.columns.iter().flat_map(|column| column.1).map(|one| one.0);
            let first = closures.next();
            variable.closure = first.filter(|first| closures.all(|closure| closure == *first));
            match variable.closure {
                Some(closure) => opened[closure] = true,
                None => effect.segments += 1,
            }
            let weight = variable.weight;
            match variable.columns[..] {
                [(place, &[(closure, slot)])] => {
                    effect.singles[closure].push(Single { place, slot, weight });
                }
                _ => effect.others.push(variable),
            }
        }
        effect.segments += opened.iter().filter(|opened| **opened).count();
        effect
    }

    /// The numbers for half widths `half` (column) about an error `centre` (component).
    #[inline(always)]
    pub(super) fn write<S: Real>(
        &self,
        linear: &Linearisation<S>,
        half: &[S],
        centre: &[S; SIX],
        size: usize,
        answer: &mut Answer<'_, S>,
    ) {
        let count = self.components.len();
        // Of variables of one closure: how far it opens, and the sum of squares.
        let mut opened = [S::default(); CLOSURES];
        let mut squares = [S::default(); CLOSURES];
        for closure in 0..CLOSURES {
            for single in &self.singles[closure] {
                let size = half[single.place] * linear.to_parameters[closure][single.slot];
                opened[closure] = opened[closure] + size.abs();
                squares[closure] = (size * size).mul_add(S::splat(single.weight), squares[closure]);
            }
        }
        let mut reach = [S::default(); SIX];
        let mut variance = [S::default(); SIX];
        let mut segments = Segments::new(self.segments);
        for variable in &self.others {
            let weight = S::splat(variable.weight);
            if let Some(closure) = variable.closure {
                let mut sum = S::default();
                for &(column, dependents) in &variable.columns {
                    for &(_, slot) in dependents {
                        sum = half[column].mul_add(linear.to_parameters[closure][slot], sum);
                    }
                }
                opened[closure] = opened[closure] + sum.abs();
                squares[closure] = (sum * sum).mul_add(weight, squares[closure]);
                continue;
            }
            let mut segment = [S::default(); SIX];
            for &(column, dependents) in &variable.columns {
                for &(closure, slot) in dependents {
                    let size = half[column] * linear.to_parameters[closure][slot];
                    for k in 0..count {
                        let inverse = linear.inverse[self.components[k]][closure];
                        segment[k] = size.mul_add(inverse, segment[k]);
                    }
                }
            }
            for k in 0..count {
                reach[k] = reach[k] + segment[k].abs();
                variance[k] = (segment[k] * segment[k]).mul_add(weight, variance[k]);
            }
            segments.push(segment);
        }
        for closure in 0..CLOSURES {
            if opened[closure] == S::default() {
                continue;
            }
            let mut segment = [S::default(); SIX];
            for k in 0..count {
                let inverse = linear.inverse[self.components[k]][closure];
                segment[k] = inverse * opened[closure];
                reach[k] = reach[k] + segment[k].abs();
                variance[k] = (inverse * inverse).mul_add(squares[closure], variance[k]);
            }
            segments.push(segment);
        }
        answer.reach.copy_from_slice(&reach[..count]);
        for k in 0..count {
            answer.uncertainty[k] = variance[k].sqrt();
        }
        for (length, quantity) in answer.lengths.iter_mut().zip(self.quantities) {
            *length = match &segments {
                Segments::Few(few, count) => longest_end(&few[..*count], centre, quantity),
                Segments::Many(many) if many.len() <= FEW => longest_end(many, centre, quantity),
                Segments::Many(many) => longest_by_cones(many, centre, quantity, size),
            };
        }
    }
}

/// How far an error can be moved, either way: a segment for each closure, and for each variable of several.
enum Segments<S> {
    Few([[S; SIX]; FEW], usize),
    Many(Vec<[S; SIX]>),
}

impl<S: Real> Segments<S> {
    #[inline(always)]
    fn new(most: usize) -> Self {
        if most <= FEW {
            Segments::Few([[S::default(); SIX]; FEW], 0)
        } else {
            Segments::Many(Vec::with_capacity(most))
        }
    }

    #[inline(always)]
    fn push(&mut self, segment: [S; SIX]) {
        match self {
            Segments::Few(few, count) => {
                few[*count] = segment;
                *count += 1;
            }
            Segments::Many(many) => many.push(segment),
        }
    }
}

/// The components of a quantity, the last ones zero where there are fewer than three.
#[inline(always)]
fn of_quantity<S: Real>(numbers: &[S; SIX], quantity: &[usize]) -> [S; 3] {
    let mut vector = [S::default(); 3];
    for (one, &component) in vector.iter_mut().zip(quantity) {
        *one = numbers[component];
    }
    vector
}

/// Sums of some segments with either sign.
struct Ends<S> {
    at: [[S; 3]; ENDS],
    count: usize,
}

impl<S: Real> Ends<S> {
    /// From one sum on, by all `segments`.
    #[inline(always)]
    fn new(first: [S; 3], segments: &[[S; SIX]], quantity: &[usize]) -> Self {
        let mut ends = Ends { at: [[S::default(); 3]; ENDS], count: 1 };
        ends.at[0] = first;
        for segment in segments {
            let segment = of_quantity(segment, quantity);
            for number in 0..ends.count {
                let sum = ends.at[number];
                for k in 0..3 {
                    ends.at[number][k] = sum[k] + segment[k];
                    ends.at[ends.count + number][k] = sum[k] - segment[k];
                }
            }
            ends.count *= 2;
        }
        ends
    }
}

/// The largest length of a centre c plus segments, of which every end is tried.
///
/// Of an end s and its opposite the longer one has the square c^2 + s^2 + 2 |c s|; so the first segment keeps
/// its sign.
#[inline(always)]
fn longest_end<S: Real>(segments: &[[S; SIX]], centre: &[S; SIX], quantity: &[usize]) -> S {
    let centre = of_quantity(centre, quantity);
    let square = dot(centre, centre);
    let Some((first, rest)) = segments.split_first() else { return square.sqrt() };
    let (some, others) = rest.split_at(rest.len() / 2);
    let some = Ends::new(of_quantity(first, quantity), some, quantity);
    let others = Ends::new([S::default(); 3], others, quantity);
    let mut products = [[S::default(); 2]; ENDS];
    for number in 0..some.count {
        let end = some.at[number];
        products[number] = [dot(end, end), dot(end, centre)];
    }
    // NaN where the centre or a segment is, and stays so.
    let another = dot(others.at[0], others.at[0]);
    let mut most = (square + products[0][0] + another) * S::splat(0.0);
    for other in &others.at[..others.count] {
        let (own, along) = (dot(*other, *other), dot(*other, centre));
        let double = [other[0] + other[0], other[1] + other[1], other[2] + other[2]];
        for number in 0..some.count {
            let (end, [end_own, end_along]) = (some.at[number], products[number]);
            let sum = double[0].mul_add(end[0], own + end_own);
            let sum = double[2].mul_add(end[2], double[1].mul_add(end[1], sum));
            let across = (along + end_along).abs();
            most = (across + across + sum).larger(most);
        }
    }
    (square + most).sqrt()
}

/// The same by cones of directions, sample by sample.
#[inline(always)]
fn longest_by_cones<S: Real>(
    segments: &[[S; SIX]],
    centre: &[S; SIX],
    quantity: &[usize],
    size: usize,
) -> S {
    let (mut set, mut search) = (Set::default(), Search::default());
    let centre = of_quantity(centre, quantity);
    let mut lengths = S::default();
    for lane in 0..size {
        set.centre = [centre[0].lane(lane), centre[1].lane(lane), centre[2].lane(lane)];
        set.segments.clear();
        for segment in segments {
            let segment = of_quantity(segment, quantity);
            let segment = [segment[0].lane(lane), segment[1].lane(lane), segment[2].lane(lane)];
            if segment != [0.0; 3] {
                set.segments.push(segment);
            }
        }
        lengths.set_lane(lane, search.farthest::<S>(&set).length);
    }
    lengths
}
