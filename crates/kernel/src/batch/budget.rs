//! The budget in one pass: at every pose each source of error alone and all of them together.
//!
//! A pose is linearised once. With the inverse found there every machine that the sources make of the nominal one
//! (at their shifts, at the edges of their bands) is brought to its pose by chord steps, and what bands do is
//! worked out from the same gradients; only a source that has both a shift and a band is linearised anew, where
//! it takes the machine. Every number is written once, where it stays.

use super::band::{Answer, BandEffect};
use super::budget_roads::{Alone, InLanes, Outcome, Road};
use super::first_order::Place;
use super::forward::displacement;
use super::moved::Orders;
use super::samples::{Group, Rows, Samples};
use super::threads::for_tables;
use crate::dispatch::{Work, dispatch};
use crate::linear::SIX;
use crate::machine::{Machine, indices_of};
use crate::scalar::Real;
use std::sync::Mutex;

/// The number of the variable of a column that has no band.
pub const UNBANDED: usize = usize::MAX;

/// What one source of error does: the columns of parameters that it moves.
#[derive(Clone, Copy, Debug)]
pub struct Cause<'a> {
    /// Parameter of each column; one may stand in several, whose deviations are then added.
    pub parameters: &'a [usize],
    /// Deviations that are known, a row for each sample or one for all.
    pub shift: Rows<'a>,
    /// By how much a column moves where its variable is 1, likewise.
    pub half: Rows<'a>,
    /// The variable of each column at the lower and the upper edge: 0 of one that does not go there.
    pub ends: [&'a [f64]; 2],
    /// Whether it goes to its edges where all sources together are at theirs.
    pub overall: bool,
    /// Number of the variable that moves each column, or [`UNBANDED`].
    pub variables: &'a [usize],
    /// Of each variable: standard deviations in its half band.
    pub sigmas: &'a [f64],
    /// Whether the variables are independent and all in [-1, 1]: if not, its band is left out.
    pub plain: bool,
}

/// A table of results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Table {
    /// A row of components for each source.
    Each,
    /// A row of lengths for each source.
    EachLength,
    /// Components of all sources together.
    All,
    /// Lengths of all sources together.
    AllLength,
}

const ERROR: usize = 0;
const WORST: usize = 3;
const REACH: usize = 4;
const UNCERTAINTY: usize = 5;
const PERCENT: usize = 6;
const LARGEST: usize = 8;
const OVERALL: usize = 9;
const OVERALL_PERCENT: usize = 12;
const MAXIMUM: usize = 14;

/// All tables: name, shape, and whether its highest magnitudes over the samples are kept.
pub const TABLES: [(&str, Table, bool); 15] = [
    ("error", Table::Each, false),
    ("error_lower", Table::Each, true),
    ("error_upper", Table::Each, true),
    ("worst", Table::Each, false),
    ("reach", Table::Each, false),
    ("uncertainty", Table::Each, false),
    ("percent_lower", Table::Each, true),
    ("percent_upper", Table::Each, true),
    ("largest", Table::EachLength, false),
    ("overall_error", Table::All, false),
    ("overall_error_lower", Table::All, true),
    ("overall_error_upper", Table::All, true),
    ("overall_percent_lower", Table::All, true),
    ("overall_percent_upper", Table::All, true),
    ("linear_maximum", Table::AllLength, false),
];

/// Whether a machine is moved at its shift and at both edges.
#[derive(Clone, Copy, Default)]
struct Moved([bool; 3]);

impl Moved {
    /// Whether the edges are not the shift.
    fn edged(self, edges: [bool; 2]) -> Self {
        Moved([self.0[0], self.0[0] || edges[0], self.0[0] || edges[1]])
    }
}

/// A budget of some sources.
pub struct Budget<'a> {
    machine: &'a Machine,
    causes: &'a [Cause<'a>],
    components: Vec<usize>,
    quantities: &'a [Vec<usize>],
    /// The smallest coordinate, m, of which there is a percent.
    smallest: f64,
    /// Of each cause, then of all together: where it moves the machine, whether its edges are others than its
    /// shift, its parameters, each once, and its band.
    parts: Vec<Part<'a>>,
    orders: Orders,
}

struct Part<'a> {
    moved: [bool; 3],
    edged: bool,
    parameters: Vec<usize>,
    effect: Option<BandEffect<'a>>,
    /// The first of its columns among those of all.
    first: usize,
}

impl<'a> Budget<'a> {
    /// Of `causes` for `count` samples. `quantities`: components, at most three, of each length. `all_plain`:
    /// whether the variables of all of them lie in [-1, 1]; if not, the length of all together is left out.
    pub fn new(
        machine: &'a Machine,
        causes: &'a [Cause<'a>],
        quantities: &'a [Vec<usize>],
        all_plain: bool,
        smallest: f64,
        count: usize,
    ) -> Self {
        let mut parts = Vec::with_capacity(causes.len() + 1);
        let (mut shifted, mut at_edges) = (false, [false; 2]);
        let (mut every, mut columns, mut sigmas) = (Vec::new(), Vec::new(), Vec::new());
        for cause in causes {
            let first = columns.len();
            let moves = any(&cause.shift, count, |_, value| value != 0.0);
            let edges = cause.ends.map(|end| {
                end.iter().any(|&end| end != 0.0)
                    && any(&cause.half, count, |column, value| value * end[column] != 0.0)
            });
            let banded = cause.variables.iter().any(|&variable| variable != UNBANDED);
            let own: Vec<_> = numbered(cause, 0, 0).collect();
            let effect = (cause.plain && banded)
                .then(|| BandEffect::new(machine, own.into_iter(), cause.sigmas, quantities));
            let parameters = distinct(cause.parameters);
            every.extend(&parameters);
            columns.extend(numbered(cause, first, sigmas.len()));
            columns.resize(first + cause.parameters.len(), (0, (0, UNBANDED)));
            sigmas.extend(cause.sigmas);
            shifted |= moves;
            if cause.overall {
                at_edges = [at_edges[0] || edges[0], at_edges[1] || edges[1]];
            }
            parts.push(Part {
                moved: Moved([moves; 3]).edged(edges).0,
                edged: edges[0] || edges[1],
                parameters,
                effect,
                first,
            });
        }
        let banded = columns.iter().filter(|column| column.1.1 != UNBANDED).copied();
        let effect = (all_plain && !sigmas.is_empty())
            .then(|| BandEffect::new(machine, banded, &sigmas, quantities));
        parts.push(Part {
            moved: Moved([shifted; 3]).edged(at_edges).0,
            edged: at_edges[0] || at_edges[1],
            parameters: distinct(&every),
            effect,
            first: 0,
        });
        Budget {
            machine,
            causes,
            components: indices_of(&machine.dof),
            quantities,
            smallest,
            parts,
            orders: Orders::at_home(machine),
        }
    }

    /// Numbers a sample of each table.
    pub fn widths(&self) -> [usize; TABLES.len()] {
        let (sources, components) = (self.causes.len(), self.components.len());
        TABLES.map(|(_, table, _)| match table {
            Table::Each => sources * components,
            Table::EachLength => sources * self.quantities.len(),
            Table::All => components,
            Table::AllLength => self.quantities.len(),
        })
    }

    /// Fills `tables` (sample, width) at samples of the nominal machine, whose poses close the struts; what became
    /// of each goes to `outcomes`. Returns the highest magnitudes of each table that keeps them, over the samples
    /// where nothing is wrong: NaN where there is none, empty for the other tables.
    pub fn fill(
        &self,
        samples: &Samples<'_>,
        tables: [&mut [f64]; TABLES.len()],
        outcomes: &mut [Outcome],
    ) -> Vec<Vec<f64>> {
        let widths = self.widths();
        let none = || -> Vec<Vec<f64>> {
            let kept = TABLES.iter().zip(widths);
            kept.map(|((.., kept), width)| vec![f64::NAN; if *kept { width } else { 0 }]).collect()
        };
        let highest = Mutex::new(none());
        let tables = tables.into_iter().zip(widths).collect();
        for_tables(samples.count, tables, outcomes, |first, tables, outcomes| {
            let mut here = none();
            let chunk = Chunk {
                budget: self,
                samples,
                widths,
                first,
                tables,
                outcomes,
                highest: &mut here,
                scratch: None,
            };
            if self.machine.plain {
                dispatch(chunk)
            } else {
                chunk.run::<f64>()
            }
            let mut highest = highest.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            for (all, here) in highest.iter_mut().flatten().zip(here.into_iter().flatten()) {
                *all = f64::max(*all, here);
            }
        });
        highest.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// All numbers of one group of samples, into `work.sheets`.
    #[inline(always)]
    fn evaluate<S: Real>(
        &self,
        samples: &Samples<'_>,
        place: Place,
        road: &mut impl Road<S>,
        work: &mut Scratch<S>,
    ) {
        let (machine, count) = (self.machine, self.components.len());
        work.group.load(machine, samples, place.first, place.size);
        let start = work.group.pose;
        road.start(machine, &work.group.p, &work.group.q, &start);
        let mut percents = [S::splat(f64::NAN); SIX];
        for k in 0..count {
            if self.components[k] < 3 {
                let size = start.position[self.components[k]].abs();
                let percent = S::splat(100.0) / size;
                percents[k] = (size - S::splat(self.smallest)).select(percent, S::splat(f64::NAN));
            }
        }
        let all = self.causes.len();
        for &parameter in &self.parts[all].parameters {
            for state in 0..3 {
                work.total[state][parameter] = S::default();
            }
        }
        for (number, part) in self.parts.iter().enumerate() {
            if number < all {
                self.add_up(number, place, work);
            }
            let deviation = if number < all { &work.own } else { &work.total };
            let group = &mut work.group;
            let mut errors = [[S::default(); SIX]; 3];
            let mut lengths = [S::default(); 3];
            let mut reach = [S::default(); SIX];
            let mut uncertainty = [S::default(); SIX];
            for state in 0..3 {
                if state > 0 && !part.edged {
                    errors[state] = errors[0];
                    continue;
                }
                let mut pose = start;
                let mut error = [S::default(); SIX];
                if part.moved[state] {
                    for &parameter in &part.parameters {
                        let nominal = S::splat(machine.nominal[parameter]);
                        group.p[parameter] = nominal + deviation[state][parameter];
                    }
                    pose = road.go(machine, &group.p, &group.q, &start, state > 0);
                    error = displacement(&start, &pose);
                    road.look_at(&error, state > 0);
                    for k in 0..count {
                        errors[state][k] = error[self.components[k]];
                    }
                }
                if state == 0 {
                    if let Some(effect) = &part.effect {
                        let moved = part.moved[0].then_some(&error);
                        let linear = road.linearised(machine, &group.p, &group.q, &pose, moved);
                        let mut answer = Answer {
                            reach: &mut reach[..count],
                            uncertainty: &mut uncertainty[..count],
                            lengths: &mut lengths[..self.quantities.len()],
                        };
                        let half = &work.half[part.first..];
                        effect.write(linear, half, &errors[0], place.size, &mut answer);
                        road.look_at_band(&reach, &uncertainty, moved.is_some());
                    } else {
                        for (length, quantity) in lengths.iter_mut().zip(self.quantities) {
                            let mut square = S::default();
                            for &component in quantity {
                                square = errors[0][component].square_plus(square);
                            }
                            *length = square.sqrt();
                        }
                    }
                }
                if part.moved[state] {
                    for &parameter in &part.parameters {
                        group.p[parameter] = S::splat(machine.nominal[parameter]);
                    }
                }
            }
            let sheets = &mut work.sheets;
            let (error, percent) =
                if number < all { (ERROR, PERCENT) } else { (OVERALL, OVERALL_PERCENT) };
            let at = if number < all { number * count } else { 0 };
            for k in 0..count {
                for state in 0..3 {
                    sheets[error + state][at + k] = errors[state][k];
                }
                sheets[percent][at + k] = errors[1][k].abs() * percents[k];
                sheets[percent + 1][at + k] = errors[2][k].abs() * percents[k];
            }
            let quantities = self.quantities.len();
            if number == all {
                sheets[MAXIMUM].copy_from_slice(&lengths[..quantities]);
                continue;
            }
            for k in 0..count {
                let down = (errors[0][k] - reach[k]).abs();
                sheets[WORST][at + k] = (errors[0][k] + reach[k]).abs().larger(down);
                sheets[REACH][at + k] = reach[k];
                sheets[UNCERTAINTY][at + k] = uncertainty[k];
            }
            let at = number * quantities;
            sheets[LARGEST][at..at + quantities].copy_from_slice(&lengths[..quantities]);
        }
    }

    /// The deviations of one cause at its shift and at both edges, parameter by parameter; adds them to those of all.
    #[inline(always)]
    fn add_up<S: Real>(&self, number: usize, place: Place, work: &mut Scratch<S>) {
        let (cause, part) = (&self.causes[number], &self.parts[number]);
        let count = cause.parameters.len();
        let half = &mut work.half[part.first..part.first + count];
        cause.half.load(place.first, place.size, half);
        let shift = &mut work.shift[..count];
        cause.shift.load(place.first, place.size, shift);
        for &parameter in &part.parameters {
            for state in 0..3 {
                work.own[state][parameter] = S::default();
            }
        }
        for column in 0..count {
            let parameter = cause.parameters[column];
            work.own[0][parameter] = work.own[0][parameter] + shift[column];
            if part.edged {
                for side in 0..2 {
                    let end = S::splat(cause.ends[side][column]);
                    let moved = half[column].mul_add(end, shift[column]);
                    work.own[1 + side][parameter] = work.own[1 + side][parameter] + moved;
                }
            }
        }
        let everywhere = part.edged && cause.overall;
        for &parameter in &part.parameters {
            for state in 0..3 {
                let from = if everywhere { state } else { 0 };
                work.total[state][parameter] =
                    work.total[state][parameter] + work.own[from][parameter];
            }
        }
    }
}

/// Place among all columns, parameter and variable of the columns of one cause that have a band.
fn numbered<'b>(
    cause: &Cause<'b>,
    first: usize,
    variables: usize,
) -> impl Iterator<Item = (usize, (usize, usize))> + use<'b> {
    let columns = cause.parameters.iter().zip(cause.variables).enumerate();
    columns.filter(|(_, (_, variable))| **variable != UNBANDED).map(
        move |(place, (&parameter, &variable))| (first + place, (parameter, variables + variable)),
    )
}

fn distinct(parameters: &[usize]) -> Vec<usize> {
    let mut once = parameters.to_vec();
    once.sort_unstable();
    once.dedup();
    once
}

/// Whether a number of some rows, in its column, is as asked.
fn any(rows: &Rows<'_>, count: usize, asked: impl Fn(usize, f64) -> bool) -> bool {
    let count = if rows.is_shared() { 1 } else { count };
    (0..count).any(|sample| {
        rows.row(sample).iter().enumerate().any(|(column, &value)| asked(column, value))
    })
}

/// What a group of lanes needs of memory, reused from group to group.
struct Scratch<S> {
    group: Group<S>,
    shift: Vec<S>,
    half: Vec<S>,
    own: [Vec<S>; 3],
    total: [Vec<S>; 3],
    sheets: [Vec<S>; TABLES.len()],
}

impl<S: Real> Scratch<S> {
    fn new(budget: &Budget<'_>) -> Self {
        let machine = budget.machine;
        let columns = budget.causes.iter().map(|cause| cause.parameters.len());
        let dense = || [(); 3].map(|()| vec![S::default(); machine.nominal.len()]);
        Scratch {
            group: Group::new(machine),
            shift: vec![S::default(); columns.clone().max().unwrap_or(0)],
            half: vec![S::default(); columns.sum()],
            own: dense(),
            total: dense(),
            sheets: budget.widths().map(|width| vec![S::default(); width]),
        }
    }
}

struct Chunk<'a, 'b> {
    budget: &'a Budget<'a>,
    samples: &'a Samples<'a>,
    widths: [usize; TABLES.len()],
    first: usize,
    tables: &'a mut [&'b mut [f64]],
    outcomes: &'a mut [Outcome],
    highest: &'a mut [Vec<f64>],
    scratch: Option<Scratch<f64>>,
}

impl Chunk<'_, '_> {
    /// One sample on the scalar path.
    #[inline(never)]
    fn alone(&mut self, lane: usize) {
        let mut road = Alone::default();
        let place = Place { first: self.first + lane, size: 1 };
        let work = self.scratch.get_or_insert_with(|| Scratch::new(self.budget));
        self.budget.evaluate(self.samples, place, &mut road, work);
        self.outcomes[lane] = road.outcome;
        for ((table, sheet), width) in self.tables.iter_mut().zip(&work.sheets).zip(self.widths) {
            table[lane * width..(lane + 1) * width].copy_from_slice(sheet);
        }
        if road.outcome == Outcome::OK {
            for (highest, sheet) in self.highest.iter_mut().zip(&work.sheets) {
                for (highest, value) in highest.iter_mut().zip(sheet) {
                    *highest = highest.max(value.abs());
                }
            }
        }
    }
}

impl Work for Chunk<'_, '_> {
    #[inline(always)]
    fn run<S: Real>(mut self) {
        let count = self.outcomes.len();
        if S::WIDTH == 1 {
            (0..count).for_each(|sample| self.alone(sample));
            return;
        }
        let (budget, samples) = (self.budget, self.samples);
        let mut work = Scratch::<S>::new(budget);
        let mut road = InLanes::new(&budget.orders);
        let mut highest: [Vec<S>; TABLES.len()] = std::array::from_fn(|table| {
            vec![S::splat(f64::NEG_INFINITY); self.highest[table].len()]
        });
        for from in (0..count).step_by(S::WIDTH) {
            let place = Place { first: self.first + from, size: S::WIDTH.min(count - from) };
            budget.evaluate(samples, place, &mut road, &mut work);
            for ((table, sheet), width) in self.tables.iter_mut().zip(&work.sheets).zip(self.widths)
            {
                if width > 0 {
                    let rows = &mut table[from * width..(from + place.size) * width];
                    S::store_rows(sheet, rows, width, place.size);
                }
            }
            self.outcomes[from..from + place.size].fill(Outcome::OK);
            let proven = (-road.proof).all_below(0.0);
            for (highest, sheet) in highest.iter_mut().zip(&work.sheets) {
                for (highest, &value) in highest.iter_mut().zip(sheet) {
                    if proven {
                        *highest = value.abs().larger(*highest);
                        continue;
                    }
                    for lane in 0..S::WIDTH {
                        let size = value.abs().lane(lane);
                        if road.proof.lane(lane) > 0.0 && size > highest.lane(lane) {
                            highest.set_lane(lane, size);
                        }
                    }
                }
            }
            if !proven {
                for lane in 0..place.size {
                    // Also true where it is NaN.
                    if !(road.proof.lane(lane) > 0.0) {
                        self.alone(from + lane);
                    }
                }
            }
        }
        for (kept, lanes) in self.highest.iter_mut().zip(&highest) {
            for (kept, lanes) in kept.iter_mut().zip(lanes) {
                for lane in 0..S::WIDTH {
                    if lanes.lane(lane) >= 0.0 {
                        *kept = kept.max(lanes.lane(lane));
                    }
                }
            }
        }
    }
}
