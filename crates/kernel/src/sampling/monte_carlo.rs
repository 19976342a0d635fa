//! Samples of machines at poses: drawn, driven to their exact pose, tallied, without leaving the cache.

use super::tally::{Sums, Tally};
use super::{SEGMENT, Variables};
use crate::batch::{displacement, share_out};
use crate::dispatch::{Work, dispatch};
use crate::kinematics::{
    Descent, Limbs, Sample, chord, chord_inverse, forward, limbs, place_limbs,
};
use crate::linear::{Matrix6, SIX};
use crate::machine::{Machine, indices_of};
use crate::scalar::{LANES, Real};
use crate::spatial::Pose;
use crate::status::Status;

/// The most columns of a tally: six components, two magnitudes, the distance in the coverage ellipsoid.
const COLUMNS: usize = 9;

/// A matrix that takes a position error, less its centre, to a vector whose length orders the errors from
/// the most likely to the least.
#[derive(Clone, Copy, Debug)]
pub struct Whitening {
    /// Where the length is 0, m.
    pub centre: [f64; 3],
    /// 1/m.
    pub matrix: [[f64; 3]; 3],
}

/// One column: a parameter moves by a swing times a variable.
#[derive(Clone, Copy, Debug)]
struct Move {
    parameter: usize,
    variable: usize,
    /// Whether no column before it moves the parameter.
    first: bool,
}

/// What the variables move.
#[derive(Clone, Debug)]
pub struct Columns {
    moves: Vec<Move>,
}

impl Columns {
    /// Column c moves `parameters[c]` by its swing times variable `variables[c]`.
    pub fn new(parameters: &[usize], variables: &[usize]) -> Self {
        let column = |(k, (&parameter, &variable)): (usize, (&usize, &usize))| Move {
            parameter,
            variable,
            first: !parameters[..k].contains(&parameter),
        };
        Columns { moves: parameters.iter().zip(variables).enumerate().map(column).collect() }
    }

    /// One more than the highest number of a variable.
    pub fn variables(&self) -> usize {
        self.moves.iter().map(|column| column.variable + 1).max().unwrap_or(0)
    }
}

/// One pose of a run, ready for sampling.
#[derive(Clone, Debug)]
pub struct StudyPose {
    nominal: Pose<f64>,
    joints: Vec<f64>,
    /// All parameters at their shift.
    centre: Vec<f64>,
    swing: Vec<f64>,
    start: Pose<f64>,
    inverse: Matrix6<f64>,
    /// Error of the machine at its shift, six components.
    pub shift_error: [f64; 6],
    /// What became of the machine at its shift.
    pub status: Status,
    whitening: Option<Whitening>,
}

impl StudyPose {
    /// A pose whose command is `joints`, with parameters `centre` and the columns' `swing`.
    pub fn new(
        machine: &Machine,
        joints: &[f64],
        nominal: &Pose<f64>,
        centre: Vec<f64>,
        swing: Vec<f64>,
        whitening: Option<Whitening>,
    ) -> Self {
        let placed = limbs(machine, &centre, joints);
        let sample = Sample { machine, p: &centre, limbs: &placed };
        let (start, status) = forward(&sample, joints, nominal);
        let inverse =
            if machine.plain { chord_inverse(&sample, &start) } else { [[0.0; SIX]; SIX] };
        let shift_error = displacement(nominal, &start);
        let (nominal, joints) = (*nominal, joints.to_vec());
        StudyPose { nominal, joints, centre, swing, start, inverse, shift_error, status, whitening }
    }

    /// Whether the distance in the coverage ellipsoid is a column.
    pub fn is_whitened(&self) -> bool {
        self.whitening.is_some()
    }
}

/// What is sampled.
#[derive(Clone, Copy)]
pub struct Study<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The variables.
    pub variables: &'a Variables,
    /// What they move.
    pub columns: &'a Columns,
    /// Where.
    pub poses: &'a [StudyPose],
    /// Seed of the random numbers; or in place of them the variables' values, row after row.
    pub given: Option<&'a [f64]>,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Evaluates the `count` samples from number `first` on at every pose into its tally.
pub fn sample(study: &Study<'_>, first: u64, count: usize, tallies: &mut [Tally]) {
    let segments = count.div_ceil(SEGMENT);
    let width = study.poses.len();
    let columns = tallies.first().map_or(0, Tally::columns);
    let covariant = tallies.first().map_or(0, Tally::covariant);
    let mut sums = vec![Sums::new(columns, covariant); segments * width];
    let blank: Vec<Tally> = tallies.iter().map(Tally::blank).collect();
    let parts = share_out(&mut sums, segments, width, |segments, sums| {
        // Counts of whole numbers: in whatever order they are added, their sums are the same.
        let mut own = blank.clone();
        for (segment, sums) in segments.zip(sums.chunks_mut(width)) {
            let size = SEGMENT.min(count - segment * SEGMENT);
            let at = segment * SEGMENT;
            let work = Segment { study, first, at, size, sums, tallies: &mut own };
            if study.machine.plain { dispatch(work) } else { work.run::<f64>() }
        }
        own
    });
    for part in parts {
        for (tally, more) in tallies.iter_mut().zip(part) {
            tally.merge(more);
        }
    }
    // Floating-point sums in the order of the samples, whichever thread made them.
    for sums in sums.chunks(width) {
        for (tally, sums) in tallies.iter_mut().zip(sums) {
            tally.add_sums(sums);
        }
    }
}

struct Segment<'a> {
    study: &'a Study<'a>,
    first: u64,
    at: usize,
    size: usize,
    sums: &'a mut [Sums],
    tallies: &'a mut [Tally],
}

impl Work for Segment<'_> {
    #[inline(always)]
    fn run<S: Real>(self) {
        let Segment { study, first, at, size, sums, tallies } = self;
        let Study { machine, variables, columns, .. } = *study;
        let count = variables.count();
        let mut values = vec![0.0; count * SEGMENT];
        match study.given {
            None => variables.draw::<S>(study.seed, first + at as u64, &mut values),
            Some(given) => {
                for sample in 0..size {
                    for variable in 0..count {
                        values[variable * SEGMENT + sample] =
                            given[(at + sample) * count + variable];
                    }
                }
            }
        }
        let components = indices_of(&machine.dof);
        let mut p: Vec<S> = vec![S::default(); machine.nominal.len()];
        let mut q: Vec<S> = vec![S::default(); machine.drives.len()];
        let mut placed: Limbs<S> = Default::default();
        for ((pose, sums), tally) in study.poses.iter().zip(sums).zip(tallies) {
            for (value, &centre) in p.iter_mut().zip(&pose.centre) {
                *value = S::splat(centre);
            }
            for (value, &joint) in q.iter_mut().zip(&pose.joints) {
                *value = S::splat(joint);
            }
            let start = Pose::<S>::splat(&pose.start);
            let nominal = Pose::<S>::splat(&pose.nominal);
            let mut moments = Moments::<S>::new(tally, components.len());
            for from in (0..size).step_by(S::WIDTH) {
                for (column, &swing) in columns.moves.iter().zip(&pose.swing) {
                    let value = S::load(&values[column.variable * SEGMENT + from..]);
                    let parameter = &mut p[column.parameter];
                    let from = if column.first {
                        S::splat(pose.centre[column.parameter])
                    } else {
                        *parameter
                    };
                    *parameter = S::splat(swing).mul_add(value, from);
                }
                place_limbs(machine, &p, &q, &mut placed);
                let mut descent = if machine.plain {
                    chord(machine, &placed, &start, &pose.inverse)
                } else {
                    Descent { pose: start, proof: S::splat(-1.0) }
                };
                let lanes = S::WIDTH.min(size - from);
                let mut status = [Status::Ok; LANES];
                for lane in 0..lanes {
                    // Also true where it is NaN.
                    if !(descent.proof.lane(lane) > 0.0) {
                        let (one, outcome) = alone(machine, &p, pose, lane);
                        status[lane] = outcome;
                        descent.pose.set_lane(lane, &one.to_row());
                    }
                }
                let error = displacement(&nominal, &descent.pose);
                moments.add(&error, &components, pose.whitening.as_ref(), &status[..lanes], tally);
            }
            moments.finish(sums, tally);
        }
    }
}

/// One sample on the scalar path.
#[inline(never)]
fn alone<S: Real>(
    machine: &Machine,
    p: &[S],
    pose: &StudyPose,
    lane: usize,
) -> (Pose<f64>, Status) {
    let p: Vec<f64> = p.iter().map(|value| value.lane(lane)).collect();
    let placed = limbs(machine, &p, &pose.joints);
    let sample = Sample { machine, p: &p, limbs: &placed };
    let (reached, status) = forward(&sample, &pose.joints, &pose.start);
    if status == Status::Ok { (reached, status) } else { (pose.start, status) }
}

/// Sums of the lanes, and which columns there are.
struct Moments<S> {
    origins: [f64; COLUMNS],
    covariant: usize,
    columns: usize,
    count: u64,
    first: [S; COLUMNS],
    second: [S; 21],
    /// Extremes of the values themselves.
    lowest: [S; COLUMNS],
    highest: [S; COLUMNS],
}

impl<S: Real> Moments<S> {
    #[inline(always)]
    fn new(tally: &Tally, covariant: usize) -> Self {
        let mut origins = [0.0; COLUMNS];
        for (column, origin) in origins.iter_mut().enumerate().take(tally.columns()) {
            *origin = tally.origin(column);
        }
        Moments {
            origins,
            covariant,
            columns: tally.columns(),
            count: 0,
            first: [S::default(); COLUMNS],
            second: [S::default(); 21],
            lowest: [S::splat(f64::INFINITY); COLUMNS],
            highest: [S::splat(f64::NEG_INFINITY); COLUMNS],
        }
    }

    #[inline(always)]
    fn add(
        &mut self,
        error: &[S; 6],
        components: &[usize],
        whitening: Option<&Whitening>,
        status: &[Status],
        tally: &mut Tally,
    ) {
        let mut values = [S::default(); COLUMNS];
        let mut column = 0;
        for &component in components {
            values[column] = error[component];
            column += 1;
        }
        // Components that the platform cannot move in are zero and add nothing to a magnitude.
        for part in 0..2 {
            if components.iter().any(|component| component / 3 == part) {
                let [a, b, c] = [error[3 * part], error[3 * part + 1], error[3 * part + 2]];
                values[column] = a.square_plus(b.square_plus(c.square())).sqrt();
                column += 1;
            }
        }
        if let Some(Whitening { centre, matrix }) = whitening {
            let mut square = S::default();
            for row in matrix {
                let mut along = S::default();
                for k in 0..3 {
                    along = (error[k] - S::splat(centre[k])).mul_add(S::splat(row[k]), along);
                }
                square = along.square_plus(square);
            }
            values[column] = square.sqrt();
        }
        let mut away = values;
        for column in 0..COLUMNS {
            away[column] = values[column] - S::splat(self.origins[column]);
        }
        let mut wanted = [false; LANES];
        for (wanted, &status) in wanted.iter_mut().zip(status) {
            *wanted = status == Status::Ok;
        }
        let good = wanted.iter().filter(|&&wanted| wanted).count();
        self.count += good as u64;
        if good < S::WIDTH {
            for &status in status.iter().filter(|&&status| status != Status::Ok) {
                tally.failed[status as usize] += 1;
            }
            let Some(sound) = wanted.iter().position(|&wanted| wanted) else { return };
            // Lanes beyond the samples and those without a result add nothing, and are no extremes.
            for lane in (0..S::WIDTH).filter(|&lane| !wanted[lane]) {
                for column in 0..COLUMNS {
                    away[column].set_lane(lane, 0.0);
                    let other = values[column].lane(sound);
                    values[column].set_lane(lane, other);
                }
            }
        }
        for column in 0..COLUMNS {
            self.first[column] = self.first[column] + away[column];
        }
        let mut place = 0;
        for i in 0..SIX {
            for j in i..SIX {
                self.second[place] = away[i].mul_add(away[j], self.second[place]);
                place += 1;
            }
        }
        for column in 0..self.columns {
            let value = values[column];
            self.lowest[column] = (self.lowest[column] - value).select(value, self.lowest[column]);
            self.highest[column] =
                (value - self.highest[column]).select(value, self.highest[column]);
            tally.count_values(column, value, &wanted);
        }
    }

    fn finish(self, sums: &mut Sums, tally: &mut Tally) {
        for column in 0..self.columns {
            for lane in 0..S::WIDTH {
                let (lowest, highest) = (self.lowest[column], self.highest[column]);
                tally.reach(column, [lowest.lane(lane), highest.lane(lane)]);
            }
        }
        let total = |value: S| -> f64 { (0..S::WIDTH).map(|lane| value.lane(lane)).sum() };
        sums.count = self.count;
        for (sum, &value) in sums.first.iter_mut().zip(&self.first) {
            *sum = total(value);
        }
        let mut place = 0;
        for i in 0..self.covariant {
            for j in i..self.covariant {
                // Six columns a row in the lanes, as many as have a covariance in the sums.
                sums.second[place] = total(self.second[i * SIX - i * (i + 1) / 2 + j]);
                place += 1;
            }
        }
    }
}
