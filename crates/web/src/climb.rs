//! The exact error of the worst machine that is found: a witness, no bound.
//!
//! It starts where the first order is longest and goes on to whatever corner beside it is worse, exactly.

use crate::bundle::Bundle;
use crate::placed::{Moved, Placed};
use std::collections::BTreeMap;
use truepose_kernel::Status;
use truepose_kernel::batch::{self, Deviations, Rows, Samples};

/// Directions in which the first order is looked at.
const DIRECTIONS: usize = 96;
/// Steps of a direction to where the first order is longest.
const SETTLED: usize = 64;
/// Corners of the first order from which is climbed.
const STARTS: usize = 6;
/// Rounds of a climb: far beyond what it takes.
const ROUNDS: usize = 40;
/// Gain, in what is reached, that is rounding.
const GAIN: f64 = 1e-12;

/// Errors at one pose where the unknowns have some values.
pub struct Corners<'a> {
    /// The pose.
    pub placed: &'a Placed<'a>,
    /// Where its drives are.
    pub joints: &'a [f64],
    /// What is known.
    pub known: &'a Moved,
    /// Half widths of the columns.
    pub swing: &'a [f64],
}

/// A corner and the error there.
#[derive(Clone)]
pub struct Worst {
    /// Length of the quantity.
    pub size: f64,
    /// Of every component.
    pub errors: Vec<f64>,
    /// Where.
    pub variables: Vec<f64>,
}

impl Corners<'_> {
    fn bundle(&self) -> &Bundle {
        self.placed.bundle
    }

    /// Errors, row after row, where the unknowns are `t`, row after row; and what became of each.
    fn errors(&self, t: &[f64]) -> (Vec<f64>, Vec<Status>) {
        let Bundle { machine, columns, unknowns, .. } = self.bundle();
        let count = t.len() / unknowns.len().max(1);
        let mut slots = BTreeMap::new();
        for &parameter in self.known.columns.iter().chain(columns.iter().map(|c| &c.parameter)) {
            let next = slots.len();
            slots.entry(parameter).or_insert(next);
        }
        let mut parameters = vec![0; slots.len()];
        let mut centre = vec![0.0; slots.len()];
        for (&parameter, &at) in &slots {
            parameters[at] = parameter;
        }
        for (parameter, value) in self.known.columns.iter().zip(self.known.row(0)) {
            centre[slots[parameter]] += value;
        }
        let mut values = centre.repeat(count);
        for (row, t) in values.chunks_mut(slots.len().max(1)).zip(t.chunks(unknowns.len().max(1))) {
            for (column, swing) in columns.iter().zip(self.swing) {
                row[slots[&column.parameter]] += swing * t[column.variable];
            }
        }
        let mut errors = vec![0.0; count * self.bundle().components.len()];
        let mut status = vec![Status::Ok; count];
        let samples = Samples {
            count,
            joints: Rows::shared(self.joints),
            poses: Rows::shared(&self.placed.placements),
            deviations: Deviations {
                columns: &parameters,
                values: Rows::each(&values, parameters.len()),
            },
        };
        batch::displacements(machine, &samples, &mut errors, &mut status);
        (errors, status)
    }

    /// The best of some corners for the length of some components.
    fn best(&self, t: &[f64], of: &[usize]) -> Result<Option<Worst>, Status> {
        let (m, v) = (self.bundle().components.len(), self.bundle().unknowns.len());
        let (errors, status) = self.errors(t);
        let mut best: Option<Worst> = None;
        for ((errors, t), status) in errors.chunks(m).zip(t.chunks(v)).zip(status) {
            if status != Status::Ok {
                return Err(status);
            }
            let size = length(errors, of);
            if best.as_ref().is_none_or(|best| size > best.size) {
                best = Some(Worst { size, errors: errors.to_vec(), variables: t.to_vec() });
            }
        }
        Ok(best)
    }

    /// The worst found for the length of some components, from the first order: `centre`, and `effects` of
    /// each unknown. A status that is not ok: inside the bands a machine was met that cannot be assembled.
    pub fn worst(&self, centre: &[f64], effects: &[f64], of: &[usize]) -> Result<Worst, Status> {
        let none = vec![0.0; self.bundle().unknowns.len()];
        let mut worst =
            Worst { size: length(centre, of), errors: centre.to_vec(), variables: none };
        if self.bundle().unknowns.is_empty() {
            return Ok(worst);
        }
        for start in self.starts(centre, effects, of) {
            let mut here = match self.best(&start, of)? {
                Some(here) => here,
                None => continue,
            };
            for _ in 0..ROUNDS {
                match self.step(&here, of)? {
                    Some(better) if better.size > here.size * (1.0 + GAIN) => here = better,
                    _ => break,
                }
            }
            if here.size > worst.size {
                worst = here;
            }
        }
        Ok(worst)
    }

    /// The better of all other ends that gain by themselves together, and of the best alone.
    fn step(&self, here: &Worst, of: &[usize]) -> Result<Option<Worst>, Status> {
        let (m, v) = (self.bundle().components.len(), self.bundle().unknowns.len());
        let turned =
            |member: &usize| self.bundle().directions.iter().flatten().any(|at| at == member);
        let single: Vec<usize> = (0..v).filter(|at| !turned(at)).collect();
        let mut beside = Vec::with_capacity(single.len() * v);
        for &at in &single {
            let mut t = here.variables.clone();
            t[at] = self.other_end(at, t[at]);
            beside.extend(t);
        }
        let (errors, status) = self.errors(&beside);
        if let Some(&bad) = status.iter().find(|&&status| status != Status::Ok) {
            return Err(bad);
        }
        let mut together = here.variables.clone();
        let mut alone: Option<(f64, usize)> = None;
        for (number, (errors, &at)) in errors.chunks(m).zip(&single).enumerate() {
            let size = length(errors, of);
            if size > here.size * (1.0 + GAIN) {
                together[at] = self.other_end(at, together[at]);
                if alone.is_none_or(|(best, _)| size > best) {
                    alone = Some((size, number));
                }
            }
        }
        let Some((_, number)) = alone else { return Ok(None) };
        together.extend(&beside[number * v..(number + 1) * v]);
        self.best(&together, of)
    }

    fn other_end(&self, at: usize, value: f64) -> f64 {
        let [low, high] = self.bundle().unknowns[at].ends;
        if value == low { high } else { low }
    }

    /// The unknowns at which a linear function of them is largest.
    fn most_along(&self, slopes: &[f64]) -> Vec<f64> {
        let ends = |(slope, unknown): (&f64, &crate::bundle::Unknown)| {
            unknown.ends[usize::from(*slope >= 0.0)]
        };
        let mut t: Vec<f64> = slopes.iter().zip(&self.bundle().unknowns).map(ends).collect();
        for members in &self.bundle().directions {
            let size = members.iter().map(|&at| slopes[at] * slopes[at]).sum::<f64>().sqrt();
            for (place, &at) in members.iter().enumerate() {
                t[at] =
                    if size > 0.0 { slopes[at] / size } else { f64::from(u8::from(place == 0)) };
            }
        }
        t
    }

    /// Corners where the first order is longest, longest first.
    fn starts(&self, centre: &[f64], effects: &[f64], of: &[usize]) -> Vec<Vec<f64>> {
        let m = self.bundle().components.len();
        let mut found: Vec<(f64, Vec<f64>)> = Vec::new();
        for mut along in directions(of.len()) {
            let mut longest = (-1.0, Vec::new());
            for _ in 0..SETTLED {
                let slope = |effect: &[f64]| -> f64 {
                    of.iter().zip(&along).map(|(&at, along)| along * effect[at]).sum()
                };
                let slopes: Vec<f64> = effects.chunks(m).map(slope).collect();
                let t = self.most_along(&slopes);
                let at = |&component: &usize| -> f64 {
                    let moved = effects.chunks(m).zip(&t).map(|(effect, t)| effect[component] * t);
                    centre[component] + moved.sum::<f64>()
                };
                let point: Vec<f64> = of.iter().map(at).collect();
                let size = point.iter().map(|value| value * value).sum::<f64>().sqrt();
                if !(size > longest.0 * (1.0 + GAIN)) {
                    break;
                }
                longest = (size, t);
                along = point.into_iter().map(|value| value / size).collect();
            }
            if !longest.1.is_empty() && !found.iter().any(|(_, t)| *t == longest.1) {
                found.push(longest);
            }
        }
        found.sort_by(|one, other| other.0.total_cmp(&one.0));
        found.into_iter().take(STARTS).map(|(_, t)| t).collect()
    }
}

fn length(errors: &[f64], of: &[usize]) -> f64 {
    of.iter().map(|&at| errors[at] * errors[at]).sum::<f64>().sqrt()
}

/// Unit vectors of so many components, the axes among them: a spiral of the golden angle.
fn directions(count: usize) -> Vec<Vec<f64>> {
    let mut all = Vec::new();
    for axis in 0..count {
        for sign in [1.0, -1.0] {
            let mut direction = vec![0.0; count];
            direction[axis] = sign;
            all.push(direction);
        }
    }
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    for k in 0..DIRECTIONS {
        match count {
            2 => {
                let angle = std::f64::consts::TAU * (k as f64 + 0.5) / DIRECTIONS as f64;
                all.push(vec![angle.cos(), angle.sin()]);
            }
            3 => {
                let height = 1.0 - (2.0 * k as f64 + 1.0) / DIRECTIONS as f64;
                let (radius, turn) = ((1.0 - height * height).sqrt(), golden * k as f64);
                all.push(vec![radius * turn.cos(), radius * turn.sin(), height]);
            }
            _ => {}
        }
    }
    all
}
