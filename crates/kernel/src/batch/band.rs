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

/// Up to so many segments all their ends are tried; beyond, cones of directions.
const FEW: usize = 9;

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
    components: Vec<usize>,
    quantities: &'a [Vec<usize>],
    variables: Vec<Variable<'a>>,
    half: Rows<'a>,
    columns: usize,
    /// Errors where all variables are 0, in the components that the machine can move in.
    centre: Rows<'a>,
}

struct Variable<'a> {
    /// Its columns, by place, with the closures that read each and at which slot.
    columns: Vec<(usize, &'a [(usize, usize)])>,
    /// The one closure that reads all of them, if it is one.
    closure: Option<usize>,
    /// One over the square of its sigmas.
    weight: f64,
}

impl<'a> Band<'a> {
    /// Of a machine about errors `centre`; `quantities`: components, at most three, of each length.
    pub fn new(
        machine: &'a Machine,
        columns: BandColumns<'a>,
        centre: Rows<'a>,
        quantities: &'a [Vec<usize>],
    ) -> Self {
        let mut variables: Vec<Variable<'a>> = columns
            .sigmas
            .iter()
            .map(|sigma| Variable { columns: Vec::new(), closure: None, weight: sigma.powi(-2) })
            .collect();
        let numbered = columns.parameters.iter().zip(columns.variables).enumerate();
        for (place, (&parameter, &variable)) in numbered {
            variables[variable].columns.push((place, &machine.dependents[parameter]));
        }
        for variable in &mut variables {
            let mut closures = variable.columns.iter().flat_map(|column| column.1).map(|one| one.0);
            let first = closures.next();
            variable.closure = first.filter(|first| closures.all(|closure| closure == *first));
        }
        Band {
            components: indices_of(&machine.dof),
            quantities,
            variables,
            half: columns.half,
            columns: columns.parameters.len(),
            centre,
        }
    }
}

impl FirstOrder for Band<'_> {
    fn width(&self) -> usize {
        2 * self.components.len() + self.quantities.len()
    }
    #[inline(always)]
    fn write<S: Real>(
        &self,
        linear: &Linearisation<S>,
        place: Place,
        _part: usize,
        columns: &mut [S],
    ) {
        let count = self.components.len();
        let mut half = vec![S::default(); self.columns];
        self.half.load(place.first, place.size, &mut half);
        let mut centre = [S::default(); SIX];
        self.centre.load(place.first, place.size, &mut centre[..count]);
        // Of variables of one closure: how far it opens, and the sum of squares.
        let mut opened = [S::default(); CLOSURES];
        let mut squares = [S::default(); CLOSURES];
        let mut segments: Vec<[S; SIX]> = Vec::with_capacity(CLOSURES + self.variables.len());
        let (reach, rest) = columns.split_at_mut(count);
        let (uncertainty, lengths) = rest.split_at_mut(count);
        for k in 0..count {
            reach[k] = S::default();
            uncertainty[k] = S::default();
        }
        for variable in &self.variables {
            let weight = S::splat(variable.weight);
            if let Some(closure) = variable.closure {
                let mut sum = S::default();
                for &(column, dependents) in &variable.columns {
                    for &(_, slot) in dependents {
                        let gradient = linear.to_parameters[closure][slot];
                        sum = half[column].mul_add(gradient, sum);
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
                uncertainty[k] = (segment[k] * segment[k]).mul_add(weight, uncertainty[k]);
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
                uncertainty[k] = (inverse * inverse).mul_add(squares[closure], uncertainty[k]);
            }
            segments.push(segment);
        }
        for k in 0..count {
            uncertainty[k] = uncertainty[k].sqrt();
        }
        for (length, quantity) in lengths.iter_mut().zip(self.quantities) {
            *length = if segments.len() <= FEW {
                longest_end(&segments, &centre, quantity)
            } else {
                longest_by_cones(&segments, &centre, quantity, place.size)
            };
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

/// All sums of some segments with either sign, added to `sums`, which holds one number to begin with.
#[inline(always)]
fn add_ends<S: Real>(segments: &[[S; SIX]], quantity: &[usize], sums: &mut Vec<[S; 3]>) {
    for segment in segments {
        let segment = of_quantity(segment, quantity);
        for number in 0..sums.len() {
            let sum = sums[number];
            let other = [sum[0] - segment[0], sum[1] - segment[1], sum[2] - segment[2]];
            sums.push(other);
            for k in 0..3 {
                sums[number][k] = sum[k] + segment[k];
            }
        }
    }
}

/// The largest length of a centre plus segments, of which every end is tried.
#[inline(always)]
fn longest_end<S: Real>(segments: &[[S; SIX]], centre: &[S; SIX], quantity: &[usize]) -> S {
    let (some, others) = segments.split_at(segments.len() / 2);
    let mut ends = vec![of_quantity(centre, quantity)];
    add_ends(some, quantity, &mut ends);
    let mut more = vec![[S::default(); 3]];
    add_ends(others, quantity, &mut more);
    let mut least = S::default();
    for end in &ends {
        for other in &more {
            let (x, y, z) = (end[0] + other[0], end[1] + other[1], end[2] + other[2]);
            let square = z.mul_add(z, y.mul_add(y, x * x));
            least = least.min(-square);
        }
    }
    (-least).sqrt()
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
