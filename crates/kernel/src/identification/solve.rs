//! The unknowns that explain best what was read, by the trust region on normal equations.

use super::design::Prepared;
use super::evaluation::{Evaluation, Normal, padded};
use super::trust_region::{Linear, Options, Problem, Status as Ended, minimise};
use crate::batch::share_out;
use nalgebra::DMatrix;

/// What is known of the unknowns beforehand: |rows (values - mean)|^2 is added to the sum of squares.
#[derive(Clone, Debug)]
pub struct Prior {
    /// (row, unknown), row after row.
    pub rows: Vec<f64>,
    /// One for each unknown.
    pub mean: Vec<f64>,
}

/// What was read, weighted: one over the standard uncertainty of each, times what else weighs it.
#[derive(Clone, Copy, Debug)]
pub struct Readings<'a> {
    /// In the order of the observations, SI.
    pub measured: &'a [f64],
    /// Likewise; a reading of weight zero does not count, and need not be predicted.
    pub weights: &'a [f64],
}

/// The unknowns found, and how that ended.
#[derive(Clone, Debug)]
pub struct Found {
    /// The unknowns.
    pub values: Vec<f64>,
    /// Sum of squares, of the prior too.
    pub cost: f64,
    /// Which test ended the iteration; `None` where the start itself cannot be evaluated.
    pub ended: Option<Ended>,
    /// How often residuals were evaluated.
    pub evaluations: usize,
}

struct Fit<'a> {
    evaluation: Evaluation<'a>,
    readings: Readings<'a>,
    prior: &'a Prior,
    /// Prior rows transposed times prior rows.
    information: &'a [f64],
    predicted: Vec<f64>,
    residuals: Vec<f64>,
    normal: Normal,
}

impl<'a> Fit<'a> {
    fn size(&self) -> usize {
        self.evaluation.prepared.design.unknowns
    }

    /// Residuals of the prior.
    fn prior_residuals(&self, values: &[f64]) -> impl Iterator<Item = f64> {
        let away: Vec<f64> =
            values.iter().zip(&self.prior.mean).map(|(value, mean)| value - mean).collect();
        self.prior
            .rows
            .chunks_exact(self.size().max(1))
            .map(move |row| row.iter().zip(&away).map(|(factor, away)| factor * away).sum::<f64>())
    }

    /// Adds the gradient of the prior.
    fn add_prior(&self, values: &[f64], gradient: &mut [f64]) {
        let rows = self.prior.rows.chunks_exact(self.size().max(1));
        for (row, residual) in rows.zip(self.prior_residuals(values)) {
            for (sum, factor) in gradient.iter_mut().zip(row) {
                *sum += factor * residual;
            }
        }
    }

    /// The whole slope, for where normal equations are too ill-conditioned.
    fn dense(&mut self, values: &[f64]) -> Option<(DMatrix<f64>, Vec<f64>)> {
        let (n, m) = (self.size(), self.residuals.len());
        let mut slope = vec![0.0; m * n];
        if !self.evaluation.jacobian(&mut slope) {
            return None;
        }
        for (row, weight) in slope.chunks_exact_mut(n).zip(self.readings.weights) {
            for value in row {
                *value *= weight;
            }
        }
        slope.extend_from_slice(&self.prior.rows);
        let mut residuals = self.residuals.clone();
        residuals.extend(self.prior_residuals(values));
        let slope = DMatrix::from_row_slice(residuals.len(), n, &slope);
        Some((slope, residuals))
    }
}

impl Problem for Fit<'_> {
    fn size(&self) -> usize {
        self.size()
    }

    fn cost(&mut self, values: &[f64]) -> Option<f64> {
        if !self.evaluation.place(values) {
            return None;
        }
        self.evaluation.predict(values, &mut self.predicted);
        let observations = &self.evaluation.prepared.design.observations;
        let mut cost = 0.0;
        for (i, observation) in observations.iter().enumerate() {
            if self.readings.weights[i] == 0.0 {
                self.residuals[i] = 0.0; // whatever it is, or where it cannot be predicted
                continue;
            }
            let mut away = self.predicted[i] - self.readings.measured[i];
            if observation.observable.is_angle() {
                let turn = std::f64::consts::TAU;
                away -= turn * (away / turn).round();
            }
            let residual = away * self.readings.weights[i];
            self.residuals[i] = residual;
            cost += residual * residual;
        }
        cost += self.prior_residuals(values).map(|residual| residual * residual).sum::<f64>();
        cost.is_finite().then_some(cost)
    }

    fn gradient(&mut self, values: &[f64], gradient: &mut [f64]) -> bool {
        if !self.evaluation.gradient(self.readings.weights, &self.residuals, gradient) {
            return false;
        }
        self.add_prior(values, gradient);
        self.evaluation.accept();
        true
    }

    fn linearises_last(&self) -> bool {
        false
    }

    fn linearise(&mut self, values: &[f64], linear: &mut Linear) -> bool {
        let n = self.size();
        let Fit { evaluation, readings, residuals, normal, .. } = self;
        if !evaluation.normal(readings.weights, residuals, normal) {
            return false;
        }
        evaluation.accept();
        let stride = padded(n);
        let mut gradient = self.normal.gradient[..n].to_vec();
        self.add_prior(values, &mut gradient);
        if self.prior.rows.iter().any(|factor| *factor != 0.0) {
            let sums = self.normal.matrix.chunks_exact_mut(stride.max(1));
            for (sums, information) in sums.zip(self.information.chunks_exact(n.max(1))) {
                sums.iter_mut().zip(information).for_each(|(sum, known)| *sum += known);
            }
        }
        let rows = self.residuals.len() + self.prior.rows.len() / n.max(1);
        if linear.set_normal_rows(&self.normal.matrix, stride, &gradient, rows) {
            return true;
        }
        let Some((slope, residuals)) = self.dense(values) else { return false };
        linear.set_dense(slope, &residuals)
    }
}

/// Fits the unknowns to each of many sets of readings of one design, from `start`, the sets shared out to the
/// threads; `measured` has one row of readings a set.
pub fn fit_many(
    prepared: &Prepared,
    measured: &[f64],
    weights: &[f64],
    prior: &Prior,
    start: &[f64],
    options: &Options,
) -> Vec<Found> {
    let width = weights.len();
    let count = measured.len().checked_div(width).unwrap_or(0);
    let information = information(prior, prepared.design.unknowns);
    let mut nothing: Vec<()> = Vec::new();
    let parts = share_out(&mut nothing, count, 0, |sets, _| {
        sets.map(|set| {
            let measured = &measured[set * width..(set + 1) * width];
            let readings = Readings { measured, weights };
            one(prepared, readings, prior, &information, start, options)
        })
        .collect::<Vec<Found>>()
    });
    parts.concat()
}

fn information(prior: &Prior, count: usize) -> Vec<f64> {
    let mut sums = vec![0.0; count * count];
    for row in prior.rows.chunks_exact(count.max(1)) {
        for (i, left) in row.iter().enumerate() {
            if *left != 0.0 {
                for (sum, right) in sums[i * count..(i + 1) * count].iter_mut().zip(row) {
                    *sum += left * right;
                }
            }
        }
    }
    sums
}

fn one<'a>(
    prepared: &'a Prepared,
    readings: Readings<'a>,
    prior: &'a Prior,
    information: &'a [f64],
    start: &[f64],
    options: &Options,
) -> Found {
    let (unknowns, count) = (prepared.design.unknowns, prepared.design.observations.len());
    let normal = Normal::new(unknowns);
    let mut evaluation = Evaluation::new(prepared);
    evaluation.count_only(readings.weights);
    let mut problem = Fit {
        evaluation,
        readings,
        prior,
        information,
        predicted: vec![0.0; count],
        residuals: vec![0.0; count],
        normal,
    };
    match minimise(&mut problem, start, None, options) {
        Ok(solution) => Found {
            values: solution.values,
            cost: solution.cost,
            ended: Some(solution.status),
            evaluations: solution.evaluations,
        },
        Err(_) => Found { values: start.to_vec(), cost: f64::NAN, ended: None, evaluations: 1 },
    }
}
