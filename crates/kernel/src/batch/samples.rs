//! The inputs of a batch: rows that are one per sample or shared by all.

use crate::linear::SIX;
use crate::machine::Machine;
use crate::scalar::Real;
use crate::spatial::Pose;

/// A row of `width` numbers for each sample, or one row for all.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a> {
    data: &'a [f64],
    width: usize,
    shared: bool,
}

impl<'a> Rows<'a> {
    /// One row per sample.
    pub fn each(data: &'a [f64], width: usize) -> Self {
        Rows { data, width, shared: false }
    }

    /// One row for all samples.
    pub fn shared(data: &'a [f64]) -> Self {
        Rows { data, width: data.len(), shared: true }
    }

    /// The rows of the samples from `first` on.
    pub fn starting_at(&self, first: usize) -> Self {
        if self.shared { *self } else { Rows::each(&self.data[first * self.width..], self.width) }
    }

    /// Numbers in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Whether one row serves all samples.
    pub fn is_shared(&self) -> bool {
        self.shared
    }

    /// The row of one sample.
    #[inline(always)]
    pub fn row(&self, sample: usize) -> &'a [f64] {
        let first = if self.shared { 0 } else { sample * self.width };
        &self.data[first..first + self.width]
    }

    /// The rows of the `size` samples from `first` on, side by side; lanes beyond them repeat the
    /// last sample.
    #[inline(always)]
    pub fn load<S: Real>(&self, first: usize, size: usize, columns: &mut [S]) {
        if self.shared {
            for (column, &value) in columns.iter_mut().zip(self.row(0)) {
                *column = S::splat(value);
            }
            return;
        }
        S::load_rows(&self.data[first * self.width..], size, columns);
    }
}

/// Numbers added to some of the parameters.
#[derive(Clone, Copy, Debug)]
pub struct Deviations<'a> {
    /// Which parameters.
    pub columns: &'a [usize],
    /// How much, in the order of `columns`.
    pub values: Rows<'a>,
}

impl Deviations<'_> {
    /// No deviation.
    pub const NONE: Deviations<'static> =
        Deviations { columns: &[], values: Rows { data: &[], width: 0, shared: true } };
}

/// Where and with which parameters each sample is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// How many.
    pub count: usize,
    /// Joint coordinates.
    pub joints: Rows<'a>,
    /// Poses in seven numbers: the start of a forward solution, or the pose itself.
    pub poses: Rows<'a>,
    /// Deviations of the parameters.
    pub deviations: Deviations<'a>,
}

impl<'a> Deviations<'a> {
    /// Those of the samples from `first` on.
    pub fn starting_at(&self, first: usize) -> Self {
        Deviations { columns: self.columns, values: self.values.starting_at(first) }
    }
}

impl<'a> Samples<'a> {
    /// The `count` samples from `first` on.
    pub fn part(&self, first: usize, count: usize) -> Self {
        Samples {
            count,
            joints: self.joints.starting_at(first),
            poses: self.poses.starting_at(first),
            deviations: self.deviations.starting_at(first),
        }
    }
}

/// The lanes of one group, reused from group to group: only what differs is loaded again.
pub struct Group<S> {
    /// All parameters.
    pub p: Vec<S>,
    /// Joint coordinates.
    pub q: Vec<S>,
    /// Pose.
    pub pose: Pose<S>,
    moved: Vec<S>,
    loaded: bool,
}

impl<S: Real> Group<S> {
    /// A group at the nominal parameters.
    #[inline(always)]
    pub fn new(machine: &Machine) -> Self {
        Group {
            p: machine.nominal.iter().map(|&value| S::splat(value)).collect(),
            q: vec![S::default(); machine.drives.len()],
            pose: Pose { position: [S::default(); 3], rotation: [S::default(); 4] },
            moved: Vec::new(),
            loaded: false,
        }
    }

    /// Loads parameters alone.
    #[inline(always)]
    pub fn load_parameters(
        &mut self,
        machine: &Machine,
        deviations: &Deviations<'_>,
        first: usize,
        size: usize,
    ) {
        if self.moved.len() != deviations.columns.len() {
            self.moved = vec![S::default(); deviations.columns.len()];
        }
        deviations.values.load(first, size, &mut self.moved);
        for (&column, &moved) in deviations.columns.iter().zip(&self.moved) {
            self.p[column] = S::splat(machine.nominal[column]) + moved;
        }
    }

    /// Loads the `size` samples from `first` on. Returns whether parameters or joints may differ from
    /// the group before.
    #[inline(always)]
    pub fn load(
        &mut self,
        machine: &Machine,
        samples: &Samples<'_>,
        first: usize,
        size: usize,
    ) -> bool {
        let shared = samples.joints.is_shared() && samples.deviations.values.is_shared();
        let fresh = !(shared && self.loaded);
        if fresh {
            self.load_parameters(machine, &samples.deviations, first, size);
            samples.joints.load(first, size, &mut self.q);
        }
        if !(samples.poses.is_shared() && self.loaded) {
            let mut row = [S::default(); 7];
            samples.poses.load(first, size, &mut row);
            self.pose.position.copy_from_slice(&row[..3]);
            self.pose.rotation.copy_from_slice(&row[3..]);
        }
        self.loaded = true;
        fresh
    }

    /// The first of the `size` samples whose joints and pose are finite, to find a row order with.
    pub fn first_finite(&self, size: usize) -> usize {
        let finite = |lane: &usize| {
            self.q.iter().chain(&self.pose.position).all(|value| value.lane(*lane).is_finite())
        };
        (0..size).find(finite).unwrap_or(0)
    }

    /// One sample of the group alone: parameters, joints, pose.
    pub fn single(&self, lane: usize) -> (Vec<f64>, [f64; SIX], Pose<f64>) {
        let (parameters, joints) = self.inputs(lane);
        (parameters, joints, self.pose.lane(lane))
    }

    /// Parameters and joints of one sample.
    pub fn inputs(&self, lane: usize) -> (Vec<f64>, [f64; SIX]) {
        let mut joints = [0.0; SIX];
        for (joint, q) in joints.iter_mut().zip(&self.q) {
            *joint = q.lane(lane);
        }
        (self.p.iter().map(|value| value.lane(lane)).collect(), joints)
    }
}
