//! Machines drawn at random at one pose: samples tallied in parts, by whoever draws them.
//!
//! What `monte_carlo` of the library does for one pose. The first batch says what shape the errors have.
//! Counts add up to the same in any order; sums are kept by the part that they are of, and added in the order
//! of the samples, so that what workers send merges bit by bit to what one of them would have.

use crate::bundle::Bundle;
use crate::condition::Condition;
use crate::ellipse::whitening;
use crate::placed::{Moved, Placed};
use crate::reply::{Answer, fault};
use std::collections::BTreeMap;
use std::rc::Rc;
use truepose_kernel::Status;
use truepose_kernel::batch::{Sensitivity, moved_first_order};
use truepose_kernel::sampling::{
    Columns, Study, StudyPose, Sums, Tally, Whitening, sample, sample_keeping,
};
use truepose_kernel::spatial::Pose;

/// Samples of the first batch (JCGM 101:2008, 7.9.4 a).
const BATCH: usize = 10_000;
/// Bins of a histogram in one standard deviation.
const FINENESS: f64 = 100.0;
/// The least spread, m and rad: where first order has none, bins widen to what is met.
const LEAST_SPREAD: f64 = 1e-15;
/// The most samples of a part, and parts of a run.
const MOST_SAMPLES: u64 = 1 << 24;
const MOST_PARTS: usize = 1 << 16;

/// What is learnt from the first batch.
#[derive(Clone, Debug)]
struct Shape {
    whitening: Whitening,
    covariance: [[f64; 3]; 3],
}

/// A run.
pub struct Run {
    bundle: Rc<Bundle>,
    seed: u64,
    columns: Columns,
    joints: Vec<f64>,
    pose: Pose<f64>,
    centre: Vec<f64>,
    swing: Vec<f64>,
    study: StudyPose,
    /// Without samples.
    blank: Tally,
    shape: Option<Shape>,
    /// Counts, without sums.
    counts: Tally,
    /// Sums of each part, by the number of its first sample; how many samples it has.
    parts: BTreeMap<u64, (u64, Sums)>,
}

impl Run {
    /// At one pose, drawn with a seed.
    pub fn new(
        bundle: &Rc<Bundle>,
        placed: &Placed<'_>,
        condition: &Condition,
        seed: u64,
    ) -> Answer<Run> {
        let machine = &bundle.machine;
        if bundle.variables.is_none() {
            let message = "a variable that correlates with others is of Student's distribution";
            return fault("not-drawn", "bundle.copula", message);
        }
        let known = placed.shifts(condition, &bundle.sources);
        let (joints, status) = placed.sent(condition, &known);
        if status[0] != Status::Ok {
            return fault("no-pose", "request.pose", status[0].name());
        }
        let mut centre = machine.nominal.clone();
        for (&parameter, value) in known.columns.iter().zip(known.row(0)) {
            centre[parameter] += value;
        }
        let swing = placed.half_widths(condition);
        let parameters: Vec<usize> = bundle.columns.iter().map(|column| column.parameter).collect();
        let variables: Vec<usize> = bundle.columns.iter().map(|column| column.variable).collect();
        let pose = placed.pose(0);
        let study = StudyPose::new(machine, &joints, &pose, centre.clone(), swing.clone(), None);
        if study.status != Status::Ok {
            return fault("no-pose", "request.pose", study.status.name());
        }
        let spread = spread(placed, &joints, &known, &swing);
        let origins = bundle.components.iter().map(|&k| study.shift_error[k]);
        let zeros = bundle.quantities.iter().map(|_| 0.0);
        let origins: Vec<f64> = origins.chain(zeros).collect();
        let widths: Vec<f64> =
            spread.iter().map(|spread| spread.max(LEAST_SPREAD) / FINENESS).collect();
        let blank = Tally::new(&origins, &widths, bundle.components.len());
        Ok(Run {
            bundle: Rc::clone(bundle),
            seed,
            columns: Columns::new(&parameters, &variables),
            joints,
            pose,
            centre,
            swing,
            study,
            counts: blank.clone(),
            blank,
            shape: None,
            parts: BTreeMap::new(),
        })
    }

    /// Whether the tool moves: then errors of position have a shape.
    fn moves(&self) -> bool {
        self.bundle.quantities.contains(&0)
    }

    fn study(&self) -> Answer<Study<'_>> {
        let Some(variables) = &self.bundle.variables else {
            return fault("not-drawn", "bundle.copula", "the variables cannot be drawn");
        };
        Ok(Study {
            machine: &self.bundle.machine,
            variables,
            columns: &self.columns,
            poses: std::slice::from_ref(&self.study),
            given: None,
            seed: self.seed,
        })
    }

    /// Draws `count` samples from number `first` on.
    pub fn draw(&mut self, first: u64, count: u64) -> Answer<()> {
        if count > MOST_SAMPLES {
            return fault("too-many-samples", "request.count", format!("at most {MOST_SAMPLES}"));
        }
        self.room_for(first, count)?;
        if count == 0 {
            return Ok(());
        }
        let mut own = None;
        if self.shape.is_none() {
            // The same first batch for all who draw parts of one run; its samples count where they are asked for.
            let pilot = if first == 0 { BATCH.min(count as usize) } else { BATCH };
            let tally = self.learn(pilot)?;
            if first == 0 {
                own = Some((tally, pilot));
            }
        }
        let (mut tally, done) = match own {
            Some(own) => own,
            None => (self.blank.blank(), 0),
        };
        if (done as u64) < count {
            let study = self.study()?;
            let tallies = std::slice::from_mut(&mut tally);
            sample(&study, first + done as u64, count as usize - done, tallies);
        }
        self.add(first, count, tally);
        Ok(())
    }

    fn room_for(&self, first: u64, count: u64) -> Answer<()> {
        let Some(end) = first.checked_add(count) else {
            return fault("too-many-samples", "request.first", "there is no such sample");
        };
        let before = self.parts.range(..end).next_back();
        if before.is_some_and(|(start, (size, _))| start + size > first && count > 0) {
            return fault(
                "drawn-already",
                "request.first",
                "some of these samples are there already",
            );
        }
        if self.parts.len() >= MOST_PARTS {
            return fault("too-many-parts", "request.first", format!("at most {MOST_PARTS}"));
        }
        Ok(())
    }

    fn add(&mut self, first: u64, count: u64, mut tally: Tally) {
        let sums = tally.take_sums();
        self.counts.merge(tally);
        self.parts.insert(first, (count, sums));
    }

    /// The first samples, and the shape of the errors from them.
    fn learn(&mut self, pilot: usize) -> Answer<Tally> {
        let mut tally = self.blank.blank();
        if !self.moves() {
            let study = self.study()?;
            sample(&study, 0, pilot, std::slice::from_mut(&mut tally));
            return Ok(tally);
        }
        let study = self.study()?;
        let kept = sample_keeping(&study, 0, pilot, std::slice::from_mut(&mut tally));
        let slots = self.bundle.places_of(0);
        let (mut centre, mut covariance) = ([0.0; 3], [[0.0; 3]; 3]);
        for &one in &slots {
            let row = self.bundle.components[one];
            centre[row] = tally.mean(one);
            for &other in &slots {
                let value = tally.covariance(one, other);
                covariance[row][self.bundle.components[other]] =
                    if value.is_finite() { value } else { 0.0 };
            }
        }
        let whitening = whitening(centre, covariance);
        let lengths = kept
            .chunks(3)
            .filter(|row| !row[0].is_nan())
            .map(|row| whitening.length([row[0], row[1], row[2]]));
        tally.append(0.0, 1.0 / FINENESS, lengths);
        self.study = StudyPose::new(
            &self.bundle.machine,
            &self.joints,
            &self.pose,
            self.centre.clone(),
            self.swing.clone(),
            Some(whitening),
        );
        self.blank = tally.blank();
        self.counts = tally.blank();
        self.shape = Some(Shape { whitening, covariance });
        Ok(tally)
    }

    /// All samples so far, sums in the order of the samples.
    pub fn whole(&self) -> Tally {
        let mut whole = self.counts.clone();
        for (_, sums) in self.parts.values() {
            whole.add_sums(sums);
        }
        whole
    }

    /// Samples so far.
    pub fn count(&self) -> u64 {
        self.parts.values().map(|(count, _)| count).sum()
    }

    /// Of which machine.
    pub fn bundle(&self) -> &Bundle {
        &self.bundle
    }

    /// Centre and covariance of the first batch's position errors.
    pub fn shape(&self) -> Option<([f64; 3], [[f64; 3]; 3])> {
        self.shape.as_ref().map(|shape| (shape.whitening.centre, shape.covariance))
    }

    /// The same number for runs of the same samples, and hardly for any two others (as FNV-1a, by words).
    fn identity(&self) -> u64 {
        let numbers = [&self.joints, &self.centre, &self.swing];
        let bits = numbers.into_iter().flatten().map(|number| number.to_bits());
        let pose = self.pose.to_row().map(f64::to_bits);
        bits.chain(pose).chain([self.seed]).fold(0xcbf2_9ce4_8422_2325, |hash: u64, bits| {
            (hash ^ bits).wrapping_mul(0x0000_0100_0000_01b3).rotate_left(31)
        })
    }

    /// All that was drawn, as bytes: of which samples, how many parts, each with its samples and sums; then the counts.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = self.identity().to_le_bytes().to_vec();
        bytes.extend((self.parts.len() as u64).to_le_bytes());
        for (first, (count, sums)) in &self.parts {
            bytes.extend(first.to_le_bytes());
            bytes.extend(count.to_le_bytes());
            sums.write(&mut bytes);
        }
        bytes.extend(self.counts.to_bytes());
        bytes
    }

    /// Merges what another run of the same samples has drawn.
    pub fn merge(&mut self, mut bytes: &[u8]) -> Answer<()> {
        const PLACE: &str = "request.tally";
        if self.shape.is_none() && self.moves() {
            // What the first batch says is wanted for comparing.
            self.learn(BATCH)?;
        }
        let (columns, covariant) = (self.blank.columns(), self.blank.covariant());
        let (Some(identity), Some(parts)) = (take(&mut bytes), take(&mut bytes)) else {
            return fault("bad-tally", PLACE, "these are no samples");
        };
        if identity != self.identity() {
            return fault("bad-tally", PLACE, "these are samples of another run");
        }
        let mut read = Vec::new();
        for _ in 0..parts {
            let part = (|| {
                Some((
                    take(&mut bytes)?,
                    take(&mut bytes)?,
                    Sums::read(&mut bytes, columns, covariant)?,
                ))
            })();
            let Some((first, count, sums)) = part else {
                return fault("bad-tally", PLACE, "these are no samples");
            };
            if count > MOST_SAMPLES {
                return fault("bad-tally", PLACE, "a part has too many samples");
            }
            read.push((first, count, sums));
        }
        let Some(counts) = Tally::from_bytes(bytes) else {
            return fault("bad-tally", PLACE, "these are no samples");
        };
        if !self.blank.fits(&counts) {
            return fault("bad-tally", PLACE, "these are samples of another run");
        }
        let mut end = 0;
        for (first, count, _) in &read {
            if *first < end {
                return fault("bad-tally", PLACE, "two parts have samples in common");
            }
            self.room_for(*first, *count)?;
            end = first + count;
        }
        self.counts.merge(counts);
        for (first, count, sums) in read {
            self.parts.insert(first, (count, sums));
        }
        Ok(())
    }
}

/// A number at the beginning of bytes, which then go on behind it.
fn take(bytes: &mut &[u8]) -> Option<u64> {
    let (first, rest) = bytes.split_first_chunk::<8>()?;
    *bytes = rest;
    Some(u64::from_le_bytes(*first))
}

/// Standard deviation to first order of each component and of each quantity, m and rad.
fn spread(placed: &Placed<'_>, joints: &[f64], known: &Moved, swing: &[f64]) -> Vec<f64> {
    let bundle = placed.bundle;
    let (m, effects) = (bundle.components.len(), effects(placed, joints, known, swing).0);
    let mut squares = vec![0.0; m];
    for (effect, unknown) in effects.chunks(m).zip(&bundle.unknowns) {
        for (square, value) in squares.iter_mut().zip(effect) {
            let deviation = value / unknown.sigmas;
            *square += deviation * deviation;
        }
    }
    for square in &mut squares {
        if !square.is_finite() {
            *square = 0.0;
        }
    }
    let sizes = bundle.quantities.iter().map(|&quantity| {
        bundle.places_of(quantity).into_iter().map(|at| squares[at]).sum::<f64>().sqrt()
    });
    squares.iter().map(|square| square.sqrt()).chain(sizes).collect()
}

/// What each unknown does to first order where it is 1, about the known deviations: a row of components for
/// each; and what became of the pose.
pub fn effects(
    placed: &Placed<'_>,
    joints: &[f64],
    known: &Moved,
    swing: &[f64],
) -> (Vec<f64>, Status) {
    let Bundle { machine, columns, unknowns, components, .. } = placed.bundle;
    let (m, k) = (components.len(), columns.len());
    let parameters: Vec<usize> = columns.iter().map(|column| column.parameter).collect();
    let mut slopes = vec![0.0; m * k];
    let mut status = [Status::Ok];
    if k > 0 {
        let samples = placed.samples_at(joints, known.deviations());
        let quantity = Sensitivity::new(machine, &parameters);
        moved_first_order(machine, &samples, &quantity, &mut slopes, &mut status);
    }
    let mut effects = vec![0.0; m * unknowns.len()];
    for (at, (column, swing)) in columns.iter().zip(swing).enumerate() {
        for component in 0..m {
            effects[column.variable * m + component] += slopes[component * k + at] * swing;
        }
    }
    (effects, status[0])
}
