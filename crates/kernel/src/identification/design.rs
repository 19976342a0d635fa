//! The measurements of a calibration and its unknowns: everything but the readings.

use super::observation::{Instrument, Observable};
use crate::machine::Machine;

/// An unknown moves a parameter: by its value times a coefficient.
#[derive(Clone, Copy, Debug)]
pub struct Term {
    /// Which unknown.
    pub unknown: usize,
    /// Which parameter.
    pub parameter: usize,
}

/// One number that is read at a pose, or between two.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// At which pose; observations are in the order of poses.
    pub pose: usize,
    /// The other pose of a separation.
    pub other: Option<usize>,
    /// By which instrument.
    pub instrument: usize,
    /// Of what.
    pub observable: Observable,
    /// Of which strut or parameter, where it is of one.
    pub part: usize,
    /// The unknown that is added to it.
    pub bias: Option<usize>,
}

impl Observation {
    /// The poses at which the platform must stand for it: none of a parameter, two of a separation.
    pub fn stands_at(&self) -> impl Iterator<Item = usize> + use<> {
        let first = (self.observable != Observable::Parameter).then_some(self.pose);
        first.into_iter().chain(self.other)
    }
}

/// A table of one row a pose, or one row for all.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// The numbers, row after row.
    pub values: Vec<f64>,
    /// How many a row.
    pub width: usize,
    /// Whether one row serves all.
    pub shared: bool,
}

impl Table {
    /// The row of one pose.
    #[inline(always)]
    pub fn row(&self, pose: usize) -> &[f64] {
        let first = if self.shared { 0 } else { pose * self.width };
        &self.values[first..first + self.width]
    }
}

/// Everything that is known before anything is read.
#[derive(Clone, Debug)]
pub struct Design {
    /// The machine.
    pub machine: Machine,
    /// How many unknowns there are, the machine's first.
    pub unknowns: usize,
    /// How many poses there are.
    pub poses: usize,
    /// Joint coordinates of each.
    pub joints: Vec<f64>,
    /// Where to look for the platform first, seven numbers each.
    pub starts: Vec<f64>,
    /// Parameters that are known to be off, and by how much.
    pub shifted: Vec<usize>,
    /// In the order of `shifted`.
    pub shifts: Table,
    /// What unknowns do to parameters.
    pub terms: Vec<Term>,
    /// In the order of `terms`.
    pub coefficients: Table,
    /// The instruments.
    pub instruments: Vec<Instrument>,
    /// What is read, in the order of poses.
    pub observations: Vec<Observation>,
}

/// What a reading is made of.
#[derive(Clone, Copy, Debug)]
pub enum Observed {
    /// A view of the platform, by its number.
    View(usize),
    /// The views at two poses.
    Between(usize, usize),
    /// A strut.
    Strut,
    /// A parameter.
    Parameter,
}

/// [`Design`] with what follows from it.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// As given.
    pub design: Design,
    /// The parameters that deviate, ascending.
    pub columns: Vec<usize>,
    /// Where each of `shifted` stands among them.
    shift_columns: Vec<usize>,
    /// Where each term's parameter stands among them.
    pub term_columns: Vec<usize>,
    /// Whether all poses have the same parameters.
    pub shared: bool,
    /// Whether every parameter that deviates is one unknown's, in the same order, and is moved by no more
    /// and no less than it: what usually is so.
    pub one_to_one: bool,
    /// The observations of pose i are `of_pose[i]..of_pose[i + 1]`.
    pub of_pose: Vec<usize>,
    /// What each observation is made of; neighbours share their view.
    pub sights: Vec<Observed>,
    /// Pose and instrument of each view, and whether angles are read in it.
    pub sighted: Vec<(usize, usize, bool)>,
    /// For each parameter of the machine the terms that move it.
    pub movers: Vec<Vec<usize>>,
}

impl Prepared {
    /// What follows from a design.
    pub fn new(design: Design) -> Self {
        let parameters = design.terms.iter().map(|term| term.parameter);
        let mut columns: Vec<usize> = design.shifted.iter().copied().chain(parameters).collect();
        columns.sort_unstable();
        columns.dedup();
        let place = |parameter: &usize| columns.partition_point(|column| column < parameter);
        let shift_columns = design.shifted.iter().map(place).collect();
        let term_columns: Vec<usize> =
            design.terms.iter().map(|term| place(&term.parameter)).collect();
        let mut of_pose = vec![0; design.poses + 1];
        for observation in &design.observations {
            of_pose[observation.pose + 1] += 1;
        }
        for pose in 0..design.poses {
            of_pose[pose + 1] += of_pose[pose];
        }
        let mut sighted: Vec<(usize, usize, bool)> = Vec::new();
        let mut sights = Vec::with_capacity(design.observations.len());
        let mut view = |pose: usize, instrument: usize, angle: bool| {
            if sighted.last().is_none_or(|&(at, by, _)| (at, by) != (pose, instrument)) {
                sighted.push((pose, instrument, false));
            }
            if let Some(last) = sighted.last_mut() {
                last.2 |= angle;
            }
            sighted.len() - 1
        };
        for observation in &design.observations {
            let Observation { pose, instrument, observable, other, .. } = *observation;
            sights.push(match (observable, other) {
                (Observable::Parameter, _) => Observed::Parameter,
                (_, Some(other)) => {
                    let first = view(pose, instrument, false);
                    Observed::Between(first, view(other, instrument, false))
                }
                _ if observable.of_strut() => Observed::Strut,
                _ => Observed::View(view(pose, instrument, observable.is_angle())),
            });
        }
        let mut movers = vec![Vec::new(); design.machine.nominal.len()];
        for (number, term) in design.terms.iter().enumerate() {
            movers[term.parameter].push(number);
        }
        let shared = (design.shifted.is_empty() || design.shifts.shared)
            && (design.terms.is_empty() || design.coefficients.shared);
        let same = |(at, (term, &column)): (usize, (&Term, &usize))| {
            term.unknown == at && column == at && design.coefficients.row(0)[at] == 1.0
        };
        let one_to_one = shared
            && term_columns.len() == columns.len()
            && design.terms.iter().zip(&term_columns).enumerate().all(same);
        Prepared {
            columns,
            shift_columns,
            term_columns,
            shared,
            one_to_one,
            of_pose,
            sights,
            sighted,
            movers,
            design,
        }
    }

    /// By how much the parameters `columns` deviate for these values of the unknowns: a row for each pose,
    /// or one for all.
    pub fn deviations(&self, values: &[f64], out: &mut Vec<f64>) {
        let Design { poses, shifts, terms, coefficients, .. } = &self.design;
        let width = self.columns.len();
        let rows = if self.shared { 1 } else { *poses };
        out.clear();
        out.resize(rows * width, 0.0);
        for (pose, row) in out.chunks_exact_mut(width.max(1)).enumerate() {
            if !self.shift_columns.is_empty() {
                for (&column, shift) in self.shift_columns.iter().zip(shifts.row(pose)) {
                    row[column] += shift;
                }
            }
            if !terms.is_empty() {
                let factors = terms.iter().zip(coefficients.row(pose));
                for (&column, (term, factor)) in self.term_columns.iter().zip(factors) {
                    row[column] += factor * values[term.unknown];
                }
            }
        }
    }
}
