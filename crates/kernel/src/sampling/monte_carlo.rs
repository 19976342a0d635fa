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
/// Segments that go to a pose one after the other: its histograms are fetched once for all of them.
const TOGETHER: usize = 8;

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

impl Whitening {
    /// The length of a position error so taken.
    pub fn length(&self, position: [f64; 3]) -> f64 {
        let mut square = 0.0;
        for row in &self.matrix {
            let mut along = 0.0;
            for k in 0..3 {
                along += (position[k] - self.centre[k]) * row[k];
            }
            square += along * along;
        }
        square.sqrt()
    }
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
    evaluate(study, first, count, tallies, false);
}

/// The same, and the position errors (pose, sample, 3) besides, NaN of a sample without a result.
pub fn sample_keeping(
    study: &Study<'_>,
    first: u64,
    count: usize,
    tallies: &mut [Tally],
) -> Vec<f64> {
    let width = study.poses.len();
    let mut kept = vec![0.0; 3 * width * count];
    for (number, sums) in evaluate(study, first, count, tallies, true).iter().enumerate() {
        let (segment, pose) = (number / width, number % width);
        let at = 3 * (pose * count + segment * SEGMENT);
        kept[at..at + sums.positions.len()].copy_from_slice(&sums.positions);
    }
    kept
}

fn evaluate(
    study: &Study<'_>,
    first: u64,
    count: usize,
    tallies: &mut [Tally],
    keeping: bool,
) -> Vec<Sums> {
    let segments = count.div_ceil(SEGMENT);
    let width = study.poses.len();
    let columns = tallies.first().map_or(0, Tally::columns);
    let covariant = tallies.first().map_or(0, Tally::covariant);
    let mut sums = vec![Sums::new(columns, covariant); segments * width];
    let blank: Vec<Tally> = tallies.iter().map(Tally::blank).collect();
    let parts = share_out(&mut sums, segments, width, |segments, sums| {
        // Counts of whole numbers: in whatever order they are added, their sums are the same.
        let mut own = blank.clone();
        let starts = segments.step_by(TOGETHER);
        for (segment, sums) in starts.zip(sums.chunks_mut(TOGETHER * width)) {
            let at = segment * SEGMENT;
            let size = (sums.len() / width * SEGMENT).min(count - at);
            let work = Segments { study, first, at, size, sums, tallies: &mut own, keeping };
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
    sums
}

struct Segments<'a> {
    study: &'a Study<'a>,
    first: u64,
    at: usize,
    size: usize,
    sums: &'a mut [Sums],
    tallies: &'a mut [Tally],
    keeping: bool,
}

impl Work for Segments<'_> {
    #[inline(always)]
    fn run<S: Real>(self) {
        let Segments { study, first, at, size, sums, tallies, keeping } = self;
        let Study { machine, variables, columns, .. } = *study;
        let count = variables.count();
        let length = count * SEGMENT;
        let segments = size.div_ceil(SEGMENT);
        let mut values = vec![0.0; length * segments];
        match study.given {
            None => {
                for segment in 0..segments {
                    let into = &mut values[segment * length..][..length];
                    variables.draw::<S>(study.seed, first + (at + segment * SEGMENT) as u64, into);
                }
            }
            Some(given) => {
                for sample in 0..size {
                    let (segment, place) = (sample / SEGMENT, sample % SEGMENT);
                    for variable in 0..count {
                        values[segment * length + variable * SEGMENT + place] =
                            given[(at + sample) * count + variable];
                    }
                }
            }
        }
        let components = indices_of(&machine.dof);
        let width = study.poses.len();
        for (number, (pose, tally)) in study.poses.iter().zip(tallies).enumerate() {
            let mut moved = Moved::<S>::at(pose);
            for segment in 0..segments {
                let values = &values[segment * length..][..length];
                let size = SEGMENT.min(size - segment * SEGMENT);
                let sums = &mut sums[segment * width + number];
                let mut moments = Moments::<S>::new(tally, components.len());
                for from in (0..size).step_by(S::WIDTH) {
                    let lanes = S::WIDTH.min(size - from);
                    let (error, status) = moved.error(machine, columns, pose, lanes, |variable| {
                        S::load(&values[variable * SEGMENT + from..])
                    });
                    let status = &status[..lanes];
                    if keeping {
                        for (lane, &status) in status.iter().enumerate() {
                            let ok = status == Status::Ok;
                            let along = |k: usize| if ok { error[k].lane(lane) } else { f64::NAN };
                            sums.positions.extend([along(0), along(1), along(2)]);
                        }
                    }
                    moments.add(&error, &components, pose.whitening.as_ref(), status, tally);
                }
                moments.finish(sums, tally);
            }
        }
    }
}

/// The machine as the samples in the lanes have it, its buffers kept from one to the next.
pub(super) struct Moved<S> {
    p: Vec<S>,
    q: Vec<S>,
    placed: Limbs<S>,
    start: Pose<S>,
    nominal: Pose<S>,
}

impl<S: Real> Moved<S> {
    /// At a pose.
    #[inline(always)]
    pub(super) fn at(pose: &StudyPose) -> Self {
        let lanes = |values: &[f64]| values.iter().map(|&value| S::splat(value)).collect();
        Moved {
            p: lanes(&pose.centre),
            q: lanes(&pose.joints),
            placed: Default::default(),
            start: Pose::splat(&pose.start),
            nominal: Pose::splat(&pose.nominal),
        }
    }

    /// Errors at that `pose` where `value(variable)` are the variables; what became of the
    /// first `lanes` lanes.
    #[inline(always)]
    pub(super) fn error(
        &mut self,
        machine: &Machine,
        columns: &Columns,
        pose: &StudyPose,
        lanes: usize,
        value: impl Fn(usize) -> S,
    ) -> ([S; 6], [Status; LANES]) {
        for (column, &swing) in columns.moves.iter().zip(&pose.swing) {
            let parameter = &mut self.p[column.parameter];
            let from =
                if column.first { S::splat(pose.centre[column.parameter]) } else { *parameter };
            *parameter = S::splat(swing).mul_add(value(column.variable), from);
        }
        place_limbs(machine, &self.p, &self.q, &mut self.placed);
        let mut descent = if machine.plain {
            chord(machine, &self.placed, &self.start, &pose.inverse)
        } else {
            Descent { pose: self.start, proof: S::splat(-1.0) }
        };
        let mut status = [Status::Ok; LANES];
        for lane in 0..lanes {
            // Also true where it is NaN.
            if !(descent.proof.lane(lane) > 0.0) {
                let (one, outcome) = alone(machine, &self.p, pose, lane);
                status[lane] = outcome;
                descent.pose.set_lane(lane, &one.to_row());
            }
        }
        (displacement(&self.nominal, &descent.pose), status)
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
