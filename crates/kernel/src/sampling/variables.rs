//! The variables that deviate: what each is distributed as, and their values in any sample.

use super::SEGMENT;
use super::random::{GROUP, Words, cosine, normal_quad, one_to_two, threefry};
use crate::dispatch::{Work, dispatch};
use crate::scalar::Real;
use std::f64::consts::FRAC_1_SQRT_2;

/// How a variable t of mean zero is distributed. A bounded one lies in [-1, 1].
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Anywhere in [-1, 1], as likely.
    Uniform,
    /// The mean of two uniform ones.
    Triangular,
    /// The cosine of an angle that is as likely anywhere.
    Arcsine,
    /// -1 or +1, as likely.
    TwoPoint,
    /// Normal with this standard deviation.
    Normal(f64),
    /// Student's t of `dof` degrees of freedom, times `scale`.
    StudentT {
        /// Degrees of freedom.
        dof: f64,
        /// Factor of the standard t.
        scale: f64,
    },
    /// One of some values.
    Discrete {
        /// The values.
        values: Vec<f64>,
        /// The probability of a value and of all before it; the last is 1.
        cumulative: Vec<f64>,
    },
}

impl Shape {
    /// Part of a variable's counter, so that two that share words are of one kind.
    fn code(&self) -> u64 {
        match self {
            Shape::Uniform => 1,
            Shape::Triangular => 2,
            Shape::Arcsine => 3,
            Shape::TwoPoint => 4,
            Shape::Normal(_) => NORMAL,
            Shape::StudentT { .. } => 6,
            Shape::Discrete { .. } => 7,
        }
    }

    /// How many neighbours share the two words of one counter.
    fn sharing(&self) -> u64 {
        match self {
            Shape::Normal(_) => NORMALS,
            Shape::Uniform | Shape::TwoPoint => 2,
            _ => 1,
        }
    }

    /// The value below which lies a share `u` of the probability; `None` where there is no closed form.
    pub fn quantile(&self, u: f64) -> Option<f64> {
        match self {
            Shape::Uniform => Some(2.0 * u - 1.0),
            Shape::Triangular if u < 0.5 => Some((2.0 * u).sqrt() - 1.0),
            Shape::Triangular => Some(1.0 - (2.0 * (1.0 - u)).sqrt()),
            Shape::Arcsine => Some(-(std::f64::consts::PI * u).cos()),
            Shape::TwoPoint => Some(if u < 0.5 { -1.0 } else { 1.0 }),
            Shape::Discrete { values, cumulative } => Some(value_at(values, cumulative, u)),
            Shape::Normal(_) | Shape::StudentT { .. } => None,
        }
    }
}

const NORMAL: u64 = 5;
/// Of the normal numbers that correlated variables are made of: they share words with no other kind.
const CORRELATED: u64 = 8;
/// Likewise of those that directions are made of.
const DIRECTION: u64 = 9;
/// Normal numbers from the two words of one counter.
const NORMALS: u64 = 4;

fn value_at(values: &[f64], cumulative: &[f64], u: f64) -> f64 {
    values[cumulative.partition_point(|&sum| sum <= u).min(values.len() - 1)]
}

/// A variable and its identity: its values do not depend on the other variables.
#[derive(Clone, Debug)]
pub struct Variable {
    /// How it is distributed.
    pub shape: Shape,
    /// What it belongs to, such as an error source.
    pub stream: u64,
    /// Its number there.
    pub number: u64,
}

/// Variables that correlate: standard normal numbers `factor e` of independent ones e, each then taken to
/// its variable's distribution (a Gaussian copula).
#[derive(Clone, Debug)]
pub struct Copula {
    /// Which variables.
    pub members: Vec<usize>,
    /// Row after row: `members.len()` squared numbers.
    pub factor: Vec<f64>,
}

/// One evaluation of the generator: the variables that it fills.
#[derive(Clone, Copy, Debug)]
struct Draw {
    stream: u64,
    counter: u64,
    /// Variables, by the word that they come from.
    slots: [Option<usize>; NORMALS as usize],
}

/// All variables of a run.
#[derive(Clone, Debug)]
pub struct Variables {
    variables: Vec<Variable>,
    draws: Vec<Draw>,
    copula: Option<Copula>,
    directions: Vec<Vec<usize>>,
    /// Whether a variable is made of a standard normal number.
    of_normals: Vec<bool>,
}

impl Variables {
    /// The variables, some of which may correlate; those of one of `directions` are together a unit vector,
    /// as likely in any direction.
    pub fn new(
        variables: Vec<Variable>,
        copula: Option<Copula>,
        directions: Vec<Vec<usize>>,
    ) -> Self {
        let mut code_of_normals = vec![None; variables.len()];
        for &member in copula.iter().flat_map(|copula| &copula.members) {
            code_of_normals[member] = Some(CORRELATED);
        }
        for &member in directions.iter().flatten() {
            code_of_normals[member] = Some(DIRECTION);
        }
        let mut draws: Vec<Draw> = Vec::new();
        for (index, variable) in variables.iter().enumerate() {
            let (code, sharing) = match code_of_normals[index] {
                Some(code) => (code, NORMALS),
                None => (variable.shape.code(), variable.shape.sharing()),
            };
            let slot = (variable.number % sharing) as usize;
            let (stream, counter) = (variable.stream, (code << 48) | (variable.number / sharing));
            let same =
                |draw: &&mut Draw| sharing > 1 && draw.stream == stream && draw.counter == counter;
            match draws.iter_mut().rev().find(same) {
                Some(draw) => draw.slots[slot] = Some(index),
                None => {
                    let mut slots = [None; NORMALS as usize];
                    slots[slot] = Some(index);
                    draws.push(Draw { stream, counter, slots });
                }
            }
        }
        let of_normals = code_of_normals.iter().map(Option::is_some).collect();
        Variables { variables, draws, copula, directions, of_normals }
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.variables.len()
    }

    /// The values of the `SEGMENT` samples from `first` on: variable after variable, `SEGMENT` numbers each.
    #[inline(always)]
    pub fn draw<S: Real>(&self, seed: u64, first: u64, into: &mut [f64]) {
        let mut made = [[0.0; GROUP]; NORMALS as usize];
        for draw in &self.draws {
            let Some(index) = draw.slots.iter().flatten().copied().next() else { continue };
            let normal = self.of_normals[index];
            let shape = &self.variables[index].shape;
            let scales = draw.slots.map(|slot| match slot {
                Some(index) if !normal => match self.variables[index].shape {
                    Shape::Normal(sigma) => sigma,
                    _ => 1.0,
                },
                _ => 1.0,
            });
            for at in (0..SEGMENT).step_by(GROUP) {
                let counter = first.wrapping_add(at as u64);
                let words = threefry([seed, draw.stream], counter, draw.counter);
                if normal {
                    normal_quad(&words, &mut made);
                } else {
                    fill::<S>(shape, &words, &mut made);
                }
                for ((slot, values), scale) in draw.slots.iter().zip(&made).zip(scales) {
                    if let Some(index) = slot {
                        let row = &mut into[index * SEGMENT + at..][..GROUP];
                        for k in 0..GROUP {
                            row[k] = values[k] * scale;
                        }
                    }
                }
            }
        }
        if let Some(copula) = &self.copula {
            self.correlate(copula, into);
        }
        for members in &self.directions {
            direct(members, into);
        }
    }

    /// The `count` samples from `first` on, row after row.
    pub fn rows(&self, seed: u64, first: u64, count: usize, into: &mut [f64]) {
        let width = self.count();
        let mut values = vec![0.0; width * SEGMENT];
        for start in (0..count).step_by(SEGMENT) {
            let own = &mut values;
            dispatch(Drawn { variables: self, seed, first: first + start as u64, into: own });
            for sample in 0..SEGMENT.min(count - start) {
                let row = &mut into[(start + sample) * width..][..width];
                for (variable, value) in row.iter_mut().enumerate() {
                    *value = values[variable * SEGMENT + sample];
                }
            }
        }
    }

    /// Independent standard normal numbers of the members to what they are distributed as.
    fn correlate(&self, copula: &Copula, into: &mut [f64]) {
        let count = copula.members.len();
        let mut independent = vec![0.0; count];
        for sample in 0..SEGMENT {
            for (value, &member) in independent.iter_mut().zip(&copula.members) {
                *value = into[member * SEGMENT + sample];
            }
            for (row, &member) in copula.members.iter().enumerate() {
                let factor = &copula.factor[row * count..][..count];
                let normal: f64 = factor.iter().zip(&independent).map(|(l, e)| l * e).sum();
                let shape = &self.variables[member].shape;
                into[member * SEGMENT + sample] = match shape {
                    Shape::Normal(sigma) => normal * sigma,
                    _ => {
                        let share = 0.5 * libm::erfc(-normal * FRAC_1_SQRT_2);
                        shape.quantile(share).unwrap_or(f64::NAN)
                    }
                };
            }
        }
    }
}

/// Independent standard normal numbers of the members to a unit vector: their density is round (Muller, "A
/// note on a method for generating points uniformly on n-dimensional spheres", Comm. ACM 2 (1959)).
fn direct(members: &[usize], into: &mut [f64]) {
    for sample in 0..SEGMENT {
        let squares: f64 =
            members.iter().map(|&member| into[member * SEGMENT + sample].powi(2)).sum();
        let length = squares.sqrt();
        for (place, &member) in members.iter().enumerate() {
            let value = &mut into[member * SEGMENT + sample];
            // All of them zero happens once in 2^96 draws: then the first axis.
            *value = if length > 0.0 { *value / length } else { f64::from(place == 0) };
        }
    }
}

struct Drawn<'a> {
    variables: &'a Variables,
    seed: u64,
    first: u64,
    into: &'a mut [f64],
}

impl Work for Drawn<'_> {
    #[inline(always)]
    fn run<S: Real>(self) {
        self.variables.draw::<S>(self.seed, self.first, self.into);
    }
}

/// Values of one distribution for a group of samples; of one that shares words, its neighbours' as well.
#[inline(always)]
fn fill<S: Real>(shape: &Shape, words: &[Words; 2], into: &mut [[f64; GROUP]; NORMALS as usize]) {
    if matches!(shape, Shape::Normal(_)) {
        return normal_quad(words, into);
    }
    let [even, odd, ..] = into;
    match shape {
        Shape::Normal(_) => {}
        Shape::Uniform => {
            let (u, v) = (one_to_two(&words[0]), one_to_two(&words[1]));
            for k in 0..GROUP {
                // Half a step off the grid of 2^-52, so that both ends are as near.
                even[k] = 2.0 * (u[k] - 1.5) + f64::EPSILON;
                odd[k] = 2.0 * (v[k] - 1.5) + f64::EPSILON;
            }
        }
        Shape::TwoPoint => {
            for k in 0..GROUP {
                even[k] = if words[0][k] >> 63 == 0 { -1.0 } else { 1.0 };
                odd[k] = if words[1][k] >> 63 == 0 { -1.0 } else { 1.0 };
            }
        }
        Shape::Triangular => {
            let (u, v) = (one_to_two(&words[0]), one_to_two(&words[1]));
            for k in 0..GROUP {
                even[k] = (u[k] + v[k]) - 3.0;
            }
        }
        Shape::Arcsine => cosine::<S>(&words[0], even),
        // Bailey, "Polar generation of random variates with the t-distribution", Math. Comp. 62 (1994).
        Shape::StudentT { dof, scale } => {
            let u = one_to_two(&words[0]);
            cosine::<S>(&words[1], even);
            for k in 0..GROUP {
                let share = 2.0 - u[k];
                // u^(-2/dof) - 1, without cancellation near u = 1.
                let stretch = (-2.0 / dof * share.ln()).exp_m1();
                even[k] *= scale * (dof * stretch).sqrt();
            }
        }
        Shape::Discrete { values, cumulative } => {
            let u = one_to_two(&words[0]);
            for k in 0..GROUP {
                even[k] = value_at(values, cumulative, u[k] - 1.0);
            }
        }
    }
}
