//! What the instruments read for given unknowns, and its derivatives; normal equations in one pass.

use super::design::{Design, Observation, Observed, Prepared};
use super::observation::{InstrumentView, Placed, Reading, StrutView, of_strut};
use crate::batch::{Deviations, Loads, Rows, Samples, Sensitivity, first_order, forward_poses};
use crate::dispatch::{Work, dispatch};
use crate::linear::SIX;
use crate::machine::indices_of;
use crate::scalar::Real;
use crate::spatial::Pose;
use crate::status::Status;

/// Numbers of a row of derivatives are padded to a multiple of this: whole lanes.
const PAD: usize = 8;

/// How many numbers a row of `count` has with its padding.
pub fn padded(count: usize) -> usize {
    count.next_multiple_of(PAD)
}

/// Scratch of one solution: nothing is allocated from step to step.
pub struct Evaluation<'a> {
    /// The design that it evaluates.
    pub prepared: &'a Prepared,
    deviations: Vec<f64>,
    /// Where to start: the poses last accepted.
    starts: Vec<f64>,
    /// The poses of the last prediction.
    poses: Vec<f64>,
    /// What became of them.
    pub status: Vec<Status>,
    /// Which of them must be solved: those of which a reading counts.
    needed: Vec<bool>,
    placed: Vec<Placed>,
    views: Vec<InstrumentView>,
    sensitivities: Vec<f64>,
}

/// Normal equations of weighted residuals, without what priors add.
pub struct Normal {
    /// (unknown, unknown), rows padded; the upper triangle, by whole lanes.
    pub matrix: Vec<f64>,
    /// Slope transposed times residual, padded.
    pub gradient: Vec<f64>,
    /// How many unknowns there are.
    pub count: usize,
}

impl Normal {
    /// Of no equations.
    pub fn new(count: usize) -> Self {
        let stride = padded(count);
        Normal { matrix: vec![0.0; count * stride], gradient: vec![0.0; stride], count }
    }
}

impl<'a> Evaluation<'a> {
    /// For a design.
    pub fn new(prepared: &'a Prepared) -> Self {
        let Design { poses, starts, machine, observations, .. } = &prepared.design;
        let width = machine.dof_count() * prepared.columns.len();
        let mut evaluation = Evaluation {
            prepared,
            deviations: Vec::new(),
            starts: starts.clone(),
            poses: vec![0.0; 7 * poses],
            status: vec![Status::Ok; *poses],
            needed: vec![false; *poses],
            placed: Vec::new(),
            views: Vec::new(),
            sensitivities: vec![0.0; poses * width],
        };
        evaluation.count_only(&vec![1.0; observations.len()]);
        evaluation
    }

    /// Readings of weight zero do not count from now on: a pose of which no reading counts need not be solved.
    pub fn count_only(&mut self, weights: &[f64]) {
        self.needed.fill(false);
        for (observation, weight) in self.prepared.design.observations.iter().zip(weights) {
            if *weight != 0.0 {
                for pose in observation.stands_at() {
                    self.needed[pose] = true;
                }
            }
        }
    }

    /// Whether the platform could be placed wherever it must stand for a reading.
    fn stands(&self, observation: &Observation) -> bool {
        observation.stands_at().all(|pose| self.status[pose] == Status::Ok)
    }

    fn all_needed(&self) -> bool {
        self.status
            .iter()
            .zip(&self.needed)
            .all(|(status, needed)| *status == Status::Ok || !needed)
    }

    fn samples<'b>(&'b self, poses: &'b [f64]) -> Samples<'b> {
        let (prepared, design) = (self.prepared, &self.prepared.design);
        let deviations = &self.deviations;
        let columns = prepared.columns.len();
        let values = if prepared.shared {
            Rows::shared(deviations)
        } else {
            Rows::each(deviations, columns)
        };
        Samples {
            count: design.poses,
            joints: Rows::each(&design.joints, design.machine.drives.len()),
            poses: Rows::each(poses, 7),
            deviations: Deviations { columns: &prepared.columns, values },
        }
    }

    /// Solves all poses for these values; whether all that must be could be.
    pub fn place(&mut self, values: &[f64]) -> bool {
        let mut deviations = std::mem::take(&mut self.deviations);
        self.prepared.deviations(values, &mut deviations);
        self.deviations = deviations;
        let mut poses = std::mem::take(&mut self.poses);
        let mut status = std::mem::take(&mut self.status);
        let samples = self.samples(&self.starts);
        forward_poses(&self.prepared.design.machine, &samples, &mut poses, &mut status);
        (self.poses, self.status) = (poses, status);
        self.placed.clear();
        let instruments = &self.prepared.design.instruments;
        self.placed.extend(instruments.iter().map(|instrument| instrument.placed(values)));
        self.views.clear();
        for &(pose, instrument, with_angles) in &self.prepared.sighted {
            let at = self.pose(pose);
            self.views.push(InstrumentView::new(&self.placed[instrument], &at, with_angles));
        }
        self.all_needed()
    }

    /// Starts from the poses of the last [`Self::place`] from now on, where there are any.
    pub fn accept(&mut self) {
        let rows = self.starts.chunks_exact_mut(7).zip(self.poses.chunks_exact(7));
        for ((start, pose), status) in rows.zip(&self.status) {
            if *status == Status::Ok {
                start.copy_from_slice(pose);
            }
        }
    }

    fn pose(&self, number: usize) -> Pose<f64> {
        Pose::from_row(&self.poses[7 * number..7 * number + 7])
    }

    /// Parameters and joints of one pose, for readings of struts.
    fn inputs(&self, pose: usize, parameters: &mut Vec<f64>) -> &'a [f64] {
        let (prepared, design) = (self.prepared, &self.prepared.design);
        parameters.clear();
        parameters.extend_from_slice(&design.machine.nominal);
        let width = prepared.columns.len();
        let first = if prepared.shared { 0 } else { pose * width };
        for (&column, value) in prepared.columns.iter().zip(&self.deviations[first..first + width])
        {
            parameters[column] += value;
        }
        let joints = design.machine.drives.len();
        &design.joints[pose * joints..(pose + 1) * joints]
    }

    /// What is read at the poses of the last [`Self::place`].
    pub fn predict(&self, values: &[f64], out: &mut [f64]) {
        let design = &self.prepared.design;
        let mut parameters = Vec::new();
        let mut last = usize::MAX;
        let mut joints: &[f64] = &[];
        let sights = &self.prepared.sights;
        for ((observation, sight), out) in design.observations.iter().zip(sights).zip(out) {
            if !self.stands(observation) {
                *out = f64::NAN;
                continue;
            }
            let placed = &self.placed[observation.instrument];
            if matches!(sight, Observed::Strut | Observed::Parameter) && last != observation.pose {
                joints = self.inputs(observation.pose, &mut parameters);
                last = observation.pose;
            }
            let reading = match *sight {
                Observed::View(view) => self.views[view].value(observation.observable, placed),
                Observed::Between(from, to) => self.views[from].separation(&self.views[to]).0.value,
                Observed::Parameter => parameters[observation.part],
                Observed::Strut => {
                    let instrument = &design.instruments[observation.instrument];
                    let what = (observation.observable, observation.part);
                    let inputs = (parameters.as_slice(), joints);
                    let pose = self.pose(observation.pose);
                    of_strut(&design.machine, what, (instrument, placed), inputs, &pose)
                }
            };
            *out = reading + observation.bias.map_or(0.0, |index| values[index]);
        }
    }

    /// Sensitivities of the poses of the last [`Self::place`] to the parameters; whether all that must exist do.
    fn differentiate(&mut self) -> bool {
        let mut sensitivities = std::mem::take(&mut self.sensitivities);
        let mut status = vec![Status::Ok; self.status.len()];
        let machine = &self.prepared.design.machine;
        let quantity = Sensitivity::new(machine, &self.prepared.columns);
        first_order(
            machine,
            &self.samples(&self.poses),
            &quantity,
            &mut sensitivities,
            &mut status,
        );
        self.sensitivities = sensitivities;
        for (before, now) in self.status.iter_mut().zip(status) {
            if *before == Status::Ok {
                *before = now;
            }
        }
        self.all_needed()
    }

    /// Derivatives of everything read to the unknowns, (observation, unknown), at the poses of the last
    /// [`Self::place`]; rows of poses that have none are left as they are. False where one that must be solved is singular.
    pub fn jacobian(&mut self, out: &mut [f64]) -> bool {
        let all = self.differentiate();
        let count = self.prepared.design.unknowns;
        let ones = vec![1.0; self.prepared.design.observations.len()];
        self.rows(Each { ones: &ones, count, out });
        all
    }

    /// Normal equations of `weights` times `residuals`, at the poses of the last [`Self::place`]; false
    /// where one that must be solved is singular.
    pub fn normal(&mut self, weights: &[f64], residuals: &[f64], normal: &mut Normal) -> bool {
        if !self.differentiate() {
            return false;
        }
        normal.matrix.fill(0.0);
        normal.gradient.fill(0.0);
        self.rows(Summed { weights, residuals, normal });
        true
    }

    /// The gradient alone of half the sum of squares of `residuals`, which are weighted by `weights`, to the unknowns,
    /// at the poses of the last [`Self::place`]: by virtual work. Readings pull at the platform with a
    /// wrench, and what loads the parameters under it is the derivative to them, so that no
    /// sensitivity is multiplied out. False where a pose is singular, or something else than the platform is read.
    pub fn gradient(&self, weights: &[f64], residuals: &[f64], gradient: &mut [f64]) -> bool {
        let (prepared, design) = (self.prepared, &self.prepared.design);
        let apart = |sight: &Observed| matches!(sight, Observed::Strut | Observed::Parameter);
        if prepared.sights.iter().any(apart) {
            return false;
        }
        gradient.fill(0.0);
        let mut wrenches = vec![0.0; SIX * design.poses];
        for pose in 0..design.poses {
            let observed = prepared.of_pose[pose]..prepared.of_pose[pose + 1];
            let mut all = design.observations[observed.clone()].iter();
            if !all.all(|observation| self.stands(observation)) {
                continue;
            }
            for number in observed {
                let observation = &design.observations[number];
                let instrument = &design.instruments[observation.instrument];
                let placed = &self.placed[observation.instrument];
                let pull = weights[number] * residuals[number];
                let reading = match prepared.sights[number] {
                    Observed::View(view) => {
                        self.views[view].reading(observation.observable, placed)
                    }
                    Observed::Between(from, to) => {
                        let (reading, to_other) = self.views[from].separation(&self.views[to]);
                        if let Some(other) = observation.other {
                            pull_at(&mut wrenches[SIX * other..], pull, &to_other);
                        }
                        reading
                    }
                    Observed::Strut | Observed::Parameter => return false,
                };
                pull_at(&mut wrenches[SIX * pose..], pull, &reading.to_twist);
                for (unknown, derivative) in instrument.unknowns.iter().zip(reading.to_own) {
                    if let Some(unknown) = *unknown {
                        gradient[unknown] += pull * derivative;
                    }
                }
                if let Some(bias) = observation.bias {
                    gradient[bias] += pull;
                }
            }
        }
        for wrench in wrenches.chunks_exact_mut(SIX) {
            for &freedom in &design.machine.held {
                wrench[freedom] = 0.0;
            }
        }
        let columns = prepared.columns.len();
        let mut loads = vec![0.0; design.poses * columns];
        let mut status = vec![Status::Ok; design.poses];
        let quantity = Loads::new(&design.machine, &prepared.columns, Rows::each(&wrenches, SIX));
        let samples = self.samples(&self.poses);
        first_order(&design.machine, &samples, &quantity, &mut loads, &mut status);
        for pose in 0..design.poses {
            if self.status[pose] != Status::Ok {
                continue;
            }
            if status[pose] != Status::Ok {
                return false;
            }
            let loads = &loads[pose * columns..(pose + 1) * columns];
            if prepared.one_to_one {
                gradient.iter_mut().zip(loads).for_each(|(sum, load)| *sum += load);
            } else if !design.terms.is_empty() {
                let factors = design.coefficients.row(pose);
                let terms = design.terms.iter().zip(&prepared.term_columns);
                for ((term, &column), factor) in terms.zip(factors) {
                    gradient[term.unknown] += factor * loads[column];
                }
            }
        }
        gradient.iter().all(|value| value.is_finite())
    }

    /// How the unknowns move the platform at one pose: (twist component, unknown), rows padded. What no
    /// unknown moves stays as it is, zero.
    #[inline(always)]
    fn twists(&self, pose: usize, twists: &mut [f64]) {
        let (prepared, design) = (self.prepared, &self.prepared.design);
        let components = indices_of(&design.machine.dof);
        let columns = prepared.columns.len();
        let stride = padded(design.unknowns);
        let width = components.len() * columns;
        let sensitivity = &self.sensitivities[pose * width..(pose + 1) * width];
        if prepared.one_to_one {
            // The same cells at every pose.
            for (number, &component) in components.iter().enumerate() {
                let given = &sensitivity[number * columns..(number + 1) * columns];
                twists[component * stride..component * stride + columns].copy_from_slice(given);
            }
        } else if !design.terms.is_empty() {
            twists.fill(0.0);
            let factors = design.coefficients.row(pose);
            for (number, &component) in components.iter().enumerate() {
                let twist = &mut twists[component * stride..(component + 1) * stride];
                let given = &sensitivity[number * columns..(number + 1) * columns];
                for (at, term) in design.terms.iter().enumerate() {
                    let column = prepared.term_columns[at];
                    twist[term.unknown] += factors[at] * given[column];
                }
            }
        }
    }

    fn rows(&mut self, receiver: impl Receiver) {
        dispatch(RowsOf { evaluation: self, receiver });
    }
}

/// What takes the rows of derivatives, pose by pose.
trait Receiver {
    /// By what a row is multiplied.
    fn weight(&self, observation: usize) -> f64;
    /// The weighted rows of `observed` observations from `first` on, padded; after them rows of zeros, so
    /// that there are a multiple of [`TOGETHER`].
    fn take<S: Real>(&mut self, first: usize, observed: usize, rows: &[f64], stride: usize);
}

struct Each<'a> {
    ones: &'a [f64],
    count: usize,
    out: &'a mut [f64],
}

impl Receiver for Each<'_> {
    fn weight(&self, observation: usize) -> f64 {
        self.ones[observation]
    }
    #[inline(always)]
    fn take<S: Real>(&mut self, first: usize, observed: usize, rows: &[f64], stride: usize) {
        for (number, row) in rows.chunks_exact(stride).take(observed).enumerate() {
            let start = (first + number) * self.count;
            self.out[start..start + self.count].copy_from_slice(&row[..self.count]);
        }
    }
}

struct Summed<'a> {
    weights: &'a [f64],
    residuals: &'a [f64],
    normal: &'a mut Normal,
}

/// Rows that are taken into the normal equations together.
const TOGETHER: usize = 6;

impl Receiver for Summed<'_> {
    fn weight(&self, observation: usize) -> f64 {
        self.weights[observation]
    }
    #[inline(always)]
    fn take<S: Real>(&mut self, first: usize, observed: usize, rows: &[f64], stride: usize) {
        let Normal { matrix, gradient, count } = &mut *self.normal;
        let residuals = &self.residuals[first..first + observed];
        for (row, residual) in rows.chunks_exact(stride).zip(residuals) {
            let residual = S::splat(*residual);
            let sums = gradient.chunks_exact_mut(S::WIDTH);
            for (sums, cells) in sums.zip(row.chunks_exact(S::WIDTH)) {
                residual.mul_add(S::load(cells), S::load(sums)).store(sums);
            }
        }
        for part in rows.chunks_exact(TOGETHER * stride) {
            let row = |k: usize| &part[k * stride..(k + 1) * stride];
            let six_rows = [row(0), row(1), row(2), row(3), row(4), row(5)];
            let mut column = 0;
            while column + 2 * S::WIDTH <= stride {
                add_products::<S, 2>(&six_rows, column, matrix, *count);
                column += 2 * S::WIDTH;
            }
            if column < stride {
                add_products::<S, 1>(&six_rows, column, matrix, *count);
            }
        }
    }
}

/// Adds the products of rows with their own cells from `column` on, `N` lanes wide, to the upper triangle.
#[inline(always)]
fn add_products<S: Real, const N: usize>(
    rows: &[&[f64]; TOGETHER],
    column: usize,
    matrix: &mut [f64],
    count: usize,
) {
    let stride = rows[0].len();
    let height = count.min(column + N * S::WIDTH);
    let mut right = [[S::default(); TOGETHER]; N];
    for n in 0..N {
        let first = column + n * S::WIDTH;
        for k in 0..TOGETHER {
            right[n][k] = S::load(&rows[k][first..first + S::WIDTH]);
        }
    }
    let (a, b, c) = (&rows[0][..height], &rows[1][..height], &rows[2][..height]);
    let (d, e, f) = (&rows[3][..height], &rows[4][..height], &rows[5][..height]);
    for (i, sums) in matrix.chunks_exact_mut(stride).take(height).enumerate() {
        let (a, b, c) = (S::splat(a[i]), S::splat(b[i]), S::splat(c[i]));
        let (d, e, f) = (S::splat(d[i]), S::splat(e[i]), S::splat(f[i]));
        let cells = &mut sums[column..column + N * S::WIDTH];
        for n in 0..N {
            let cells = &mut cells[n * S::WIDTH..(n + 1) * S::WIDTH];
            let mut sum = S::load(cells);
            sum = a.mul_add(right[n][0], sum);
            sum = b.mul_add(right[n][1], sum);
            sum = c.mul_add(right[n][2], sum);
            sum = d.mul_add(right[n][3], sum);
            sum = e.mul_add(right[n][4], sum);
            f.mul_add(right[n][5], sum).store(cells);
        }
    }
}

struct RowsOf<'a, 'b, R> {
    evaluation: &'a Evaluation<'b>,
    receiver: R,
}

impl<R: Receiver> Work for RowsOf<'_, '_, R> {
    #[inline(always)]
    fn run<S: Real>(mut self) {
        let evaluation = self.evaluation;
        let (prepared, design) = (evaluation.prepared, &evaluation.prepared.design);
        let stride = padded(design.unknowns);
        let mut twists = vec![0.0; SIX * stride];
        let mut other_twists = vec![0.0; SIX * stride];
        let mut rows = Vec::new();
        let mut parameters = Vec::new();
        for pose in 0..design.poses {
            let observed = prepared.of_pose[pose]..prepared.of_pose[pose + 1];
            let mut all = design.observations[observed.clone()].iter();
            if observed.is_empty() || !all.all(|observation| evaluation.stands(observation)) {
                continue;
            }
            evaluation.twists(pose, &mut twists);
            rows.clear();
            rows.resize(observed.len().next_multiple_of(TOGETHER) * stride, 0.0);
            let at = evaluation.pose(pose);
            let mut joints: Option<&[f64]> = None;
            let mut strut: Option<(usize, StrutView)> = None;
            for (number, row) in observed.clone().zip(rows.chunks_exact_mut(stride)) {
                let observation = &design.observations[number];
                let instrument = &design.instruments[observation.instrument];
                let placed = &evaluation.placed[observation.instrument];
                let weight = self.receiver.weight(number);
                let mut moved = |parameter: usize, derivative: f64| {
                    for &mover in &prepared.movers[parameter] {
                        let factor = design.coefficients.row(pose)[mover];
                        row[design.terms[mover].unknown] += weight * derivative * factor;
                    }
                };
                let reading = match prepared.sights[number] {
                    Observed::View(view) => {
                        evaluation.views[view].reading(observation.observable, placed)
                    }
                    Observed::Between(from, to) => {
                        let (from, to) = (&evaluation.views[from], &evaluation.views[to]);
                        let (reading, to_other) = from.separation(to);
                        if let Some(other) = observation.other {
                            evaluation.twists(other, &mut other_twists);
                            add_twists::<S>(&to_other, weight, &other_twists, row);
                        }
                        reading
                    }
                    Observed::Parameter => {
                        moved(observation.part, 1.0);
                        Reading::new(0.0)
                    }
                    Observed::Strut => {
                        let q =
                            *joints.get_or_insert_with(|| evaluation.inputs(pose, &mut parameters));
                        if strut.as_ref().is_none_or(|(index, _)| *index != observation.part) {
                            let inputs = (parameters.as_slice(), q);
                            let seen =
                                StrutView::new(&design.machine, observation.part, inputs, &at);
                            strut = Some((observation.part, seen));
                        }
                        let Some((_, seen)) = &strut else { continue };
                        let (reading, to_parameters) =
                            seen.reading(observation.observable, (instrument, placed));
                        for (parameter, derivative) in to_parameters {
                            moved(parameter, derivative);
                        }
                        reading
                    }
                };
                add_twists::<S>(&reading.to_twist, weight, &twists, row);
                for (unknown, derivative) in instrument.unknowns.iter().zip(reading.to_own) {
                    if let Some(unknown) = *unknown {
                        row[unknown] += weight * derivative;
                    }
                }
                if let Some(bias) = observation.bias {
                    row[bias] += weight;
                }
            }
            self.receiver.take::<S>(observed.start, observed.len(), &rows, stride);
        }
    }
}

/// Adds a reading's pull to a wrench, the first six numbers.
fn pull_at(wrench: &mut [f64], pull: f64, to_twist: &[f64; SIX]) {
    for (sum, share) in wrench.iter_mut().zip(to_twist) {
        *sum += pull * share;
    }
}

/// Adds the weighted derivatives by way of the platform's twist to a row.
#[inline(always)]
fn add_twists<S: Real>(to_twist: &[f64; SIX], weight: f64, twists: &[f64], row: &mut [f64]) {
    let stride = row.len();
    for component in 0..SIX {
        let factor = weight * to_twist[component];
        if factor == 0.0 {
            continue;
        }
        let factor = S::splat(factor);
        let twist = &twists[component * stride..(component + 1) * stride];
        let mut column = 0;
        while column < stride {
            let cells = &mut row[column..column + S::WIDTH];
            let sum = factor.mul_add(S::load(&twist[column..column + S::WIDTH]), S::load(cells));
            sum.store(cells);
            column += S::WIDTH;
        }
    }
}
