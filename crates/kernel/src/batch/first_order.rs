//! First-order quantities of many samples: sensitivities, forces, loads, compliances.
//!
//! Each quantity defines how many numbers it is and how they follow from the linearised closures; lanes,
//! fall-back and threads are the same for all.

use super::samples::{Group, Rows, Samples};
use super::threads::for_chunks;
use crate::dispatch::{Work, dispatch};
use crate::kinematics::{
    Limbs, Linearisation, SINGULAR, Sample, condition, internal_forces, limbs, place_limbs,
};
use crate::linear::{CLOSURES, Order, SIX, factor_pivoting};
use crate::machine::{Machine, indices_of};
use crate::scalar::Real;
use crate::spatial::Pose;
use crate::statics::{
    ClosureMatrix, add_shared, closure_compliance, closure_forces, parameter_load, pose_compliance,
    pose_stiffness,
};
use crate::status::Status;

/// The samples of one group, for quantities that read inputs of their own.
#[derive(Clone, Copy)]
pub struct Place {
    pub(super) first: usize,
    pub(super) size: usize,
}

/// A quantity of first order.
pub trait FirstOrder: Sync {
    /// Numbers per sample.
    fn width(&self) -> usize;
    /// Whether it exists where the closures' rows are singular.
    fn survives_singular(&self) -> bool {
        false
    }
    /// Into how many equal parts the numbers are cut, so that a part's lanes stay in the cache.
    fn parts(&self) -> usize {
        1
    }
    /// Computes one part of the numbers of one group.
    fn write<S: Real>(
        &self,
        linear: &Linearisation<S>,
        place: Place,
        part: usize,
        columns: &mut [S],
    );
}

/// Computes a first-order quantity at `samples.poses`, which must close the struts for
/// `samples.joints`; `out` has `width` numbers a sample, NaN where the status is not `ok`.
pub fn first_order(
    machine: &Machine,
    samples: &Samples<'_>,
    quantity: &impl FirstOrder,
    out: &mut [f64],
    status: &mut [Status],
) {
    let width = quantity.width();
    for_chunks(samples.count, (out, width), (&mut [], 0), status, |first, out, _, status| {
        let chunk = Chunk { machine, samples, quantity, first, out, status };
        if machine.plain { dispatch(chunk) } else { chunk.run::<f64>() }
    });
}

struct Chunk<'a, Q> {
    machine: &'a Machine,
    samples: &'a Samples<'a>,
    quantity: &'a Q,
    first: usize,
    out: &'a mut [f64],
    status: &'a mut [Status],
}

impl<Q: FirstOrder> Work for Chunk<'_, Q> {
    #[inline(always)]
    fn run<S: Real>(self) {
        let Chunk { machine, samples, quantity, first, out, status } = self;
        let width = quantity.width();
        let mut group = Group::<S>::new(machine);
        let mut at: Limbs<S> = Default::default();
        let mut order = [0; SIX];
        let mut columns = vec![S::default(); width / quantity.parts()];
        let mut linear = Linearisation::default();
        let groups = out.chunks_mut((width * S::WIDTH).max(1)).zip(status.chunks_mut(S::WIDTH));
        for (number, (out, status)) in groups.enumerate() {
            let place = Place { first: first + number * S::WIDTH, size: status.len() };
            if group.load(machine, samples, place.first, place.size) {
                place_limbs(machine, &group.p, &group.q, &mut at);
            }
            let mut proven = S::splat(-1.0);
            if S::WIDTH > 1 {
                if number == 0 {
                    order = single_order(machine, &group, place.size);
                }
                linear.fill(machine, &group.p, &group.q, &at, &group.pose, &order);
                for part in 0..quantity.parts() {
                    quantity.write(&linear, place, part, &mut columns);
                    S::store_rows(&columns, &mut out[part * columns.len()..], width, place.size);
                }
                proven = linear.regular;
            }
            for lane in 0..place.size {
                status[lane] = Status::Ok;
                // Also true where it is NaN.
                if !(proven.lane(lane) > 0.0) {
                    let out = &mut out[width * lane..width * (lane + 1)];
                    let place = Place { first: place.first + lane, size: 1 };
                    status[lane] = alone(machine, &group, lane, quantity, place, out);
                }
            }
        }
    }
}

#[inline(never)]
fn single_order<S: Real>(machine: &Machine, group: &Group<S>, size: usize) -> Order {
    let (p, q, pose) = group.single(group.first_finite(size));
    row_order(machine, &p, &q, &pose)
}

/// The order in which the rows are eliminated at a pose.
pub(super) fn row_order(machine: &Machine, p: &[f64], q: &[f64], pose: &Pose<f64>) -> Order {
    let mut linear = Linearisation::default();
    linear.differentiate(machine, p, q, pose);
    let mut square = [[0.0; SIX]; SIX];
    square.copy_from_slice(&linear.rows[..SIX]);
    factor_pivoting(&square).order
}

/// One sample on the scalar path.
#[inline(never)]
fn alone<S: Real, Q: FirstOrder>(
    machine: &Machine,
    group: &Group<S>,
    lane: usize,
    quantity: &Q,
    place: Place,
    out: &mut [f64],
) -> Status {
    let (p, q, pose) = group.single(lane);
    let mut linear = Linearisation::default();
    let at = limbs(machine, &p, &q);
    linear.fill_scalar(&Sample { machine, p: &p, limbs: &at }, &q, &pose);
    let regular = condition(machine, &p, &q, &pose) >= SINGULAR;
    if regular || quantity.survives_singular() {
        let width = out.len() / quantity.parts();
        for (part, out) in out.chunks_exact_mut(width.max(1)).enumerate() {
            quantity.write(&linear, place, part, out);
        }
    } else {
        out.fill(f64::NAN);
    }
    if !regular && !quantity.survives_singular() {
        Status::Singular
    } else if out.iter().all(|value| value.is_finite()) {
        Status::Ok
    } else {
        Status::NotConverged
    }
}

/// For each of the given parameters the (closure, slot) pairs that read it.
fn dependents<'a>(machine: &'a Machine, columns: &[usize]) -> Vec<&'a [(usize, usize)]> {
    columns.iter().map(|&column| machine.dependents[column].as_slice()).collect()
}

/// `-W^-1 dg/dp` for some parameters: (component, parameter) per sample.
pub struct Sensitivity<'a> {
    components: Vec<usize>,
    runs: Vec<Run>,
    /// The columns that several closures read, or none, with their dependents.
    common: Vec<(usize, &'a [(usize, usize)])>,
    count: usize,
}

/// Neighbouring columns that one closure alone reads at neighbouring slots.
struct Run {
    closure: usize,
    slot: usize,
    column: usize,
    length: usize,
}

impl<'a> Sensitivity<'a> {
    /// For the parameters of the given indices.
    pub fn new(machine: &'a Machine, columns: &[usize]) -> Self {
        let mut runs: Vec<Run> = Vec::new();
        let mut common = Vec::new();
        for (column, dependents) in dependents(machine, columns).into_iter().enumerate() {
            let &[(closure, slot)] = dependents else {
                common.push((column, dependents));
                continue;
            };
            match runs.last_mut() {
                Some(run)
                    if run.closure == closure
                        && run.slot + run.length == slot
                        && run.column + run.length == column =>
                {
                    run.length += 1;
                }
                _ => runs.push(Run { closure, slot, column, length: 1 }),
            }
        }
        Sensitivity { components: indices_of(&machine.dof), runs, common, count: columns.len() }
    }
}

impl FirstOrder for Sensitivity<'_> {
    fn width(&self) -> usize {
        self.components.len() * self.count
    }
    fn parts(&self) -> usize {
        self.components.len()
    }
    #[inline(always)]
    fn write<S: Real>(
        &self,
        linear: &Linearisation<S>,
        _place: Place,
        part: usize,
        columns: &mut [S],
    ) {
        let inverse = &linear.inverse[self.components[part]];
        for run in &self.runs {
            let twist = -inverse[run.closure];
            let gradient = &linear.to_parameters[run.closure][run.slot..run.slot + run.length];
            let cells = &mut columns[run.column..run.column + run.length];
            for (cell, &derivative) in cells.iter_mut().zip(gradient) {
                *cell = twist * derivative;
            }
        }
        for (column, dependents) in &self.common {
            let mut sum = S::default();
            for &(closure, slot) in *dependents {
                sum = (-inverse[closure]).mul_add(linear.to_parameters[closure][slot], sum);
            }
            columns[*column] = sum;
        }
    }
}

/// `-W^-1 dg/dq`: (component, joint) per sample.
pub struct JointJacobian {
    components: Vec<usize>,
    struts: Vec<Vec<usize>>,
}

impl JointJacobian {
    /// For all joints.
    pub fn new(machine: &Machine) -> Self {
        let struts = machine.drives.iter().map(|drive| drive.struts.clone()).collect();
        JointJacobian { components: indices_of(&machine.dof), struts }
    }
}

impl FirstOrder for JointJacobian {
    fn width(&self) -> usize {
        self.components.len() * self.struts.len()
    }
    #[inline(always)]
    fn write<S: Real>(
        &self,
        linear: &Linearisation<S>,
        _place: Place,
        _part: usize,
        columns: &mut [S],
    ) {
        let mut cells = columns.iter_mut();
        for &component in &self.components {
            for (struts, cell) in self.struts.iter().zip(&mut cells) {
                let mut sum = S::default();
                for &strut in struts {
                    let twist = -linear.inverse[component][strut];
                    sum = twist.mul_add(linear.to_joint[strut], sum);
                }
                *cell = sum;
            }
        }
    }
}

/// Strut tensions under a wrench on the tool, N.
pub struct Forces<'a> {
    closures: usize,
    wrenches: Rows<'a>,
}

impl<'a> Forces<'a> {
    /// Wrenches (N, N m) on the tool at the tool point, base axes.
    pub fn new(machine: &Machine, wrenches: Rows<'a>) -> Self {
        Forces { closures: machine.closure_count(), wrenches }
    }
}

#[inline(always)]
fn multipliers<S: Real>(
    linear: &Linearisation<S>,
    wrenches: &Rows<'_>,
    place: Place,
) -> [S; CLOSURES] {
    let mut wrench = [S::default(); SIX];
    wrenches.load(place.first, place.size, &mut wrench);
    closure_forces(&linear.inverse, &wrench)
}

impl FirstOrder for Forces<'_> {
    fn width(&self) -> usize {
        self.closures
    }
    #[inline(always)]
    fn write<S: Real>(
        &self,
        linear: &Linearisation<S>,
        place: Place,
        _part: usize,
        columns: &mut [S],
    ) {
        let forces = multipliers(linear, &self.wrenches, place);
        for (column, &force) in columns.iter_mut().zip(&forces) {
            *column = -force;
        }
    }
}

/// Wrenches at once, at most, for [`Loads`].
pub const WRENCHES: usize = 2;

/// Loads on some parameters under wrenches on the tool, wrench after wrench.
pub struct Loads<'a> {
    dependents: Vec<&'a [(usize, usize)]>,
    wrenches: Rows<'a>,
}

impl<'a> Loads<'a> {
    /// For the parameters of the given indices, under the wrenches that stand side by side in a row.
    pub fn new(machine: &'a Machine, columns: &[usize], wrenches: Rows<'a>) -> Self {
        Loads { dependents: dependents(machine, columns), wrenches }
    }
}

impl FirstOrder for Loads<'_> {
    fn width(&self) -> usize {
        self.wrenches.width() / SIX * self.dependents.len()
    }
    #[inline(always)]
    fn write<S: Real>(
        &self,
        linear: &Linearisation<S>,
        place: Place,
        _part: usize,
        columns: &mut [S],
    ) {
        let mut wrenches = [S::default(); SIX * WRENCHES];
        let wrenches = &mut wrenches[..self.wrenches.width()];
        self.wrenches.load(place.first, place.size, wrenches);
        let mut cells = columns.iter_mut();
        for wrench in wrenches.chunks_exact(SIX) {
            let mut own = [S::default(); SIX];
            own.copy_from_slice(wrench);
            let forces = closure_forces(&linear.inverse, &own);
            for (dependents, cell) in self.dependents.iter().zip(&mut cells) {
                *cell = parameter_load(&forces, &linear.to_parameters, dependents);
            }
        }
    }
}

/// How parameters give way under load: a symmetric matrix, most of it zero.
#[derive(Clone, Copy)]
pub struct Yielding<'a> {
    /// Which parameters.
    pub columns: &'a [usize],
    /// Places among these, two by two, of parameters that give way under each other's load.
    pub pairs: &'a [(usize, usize)],
    /// A sample a row: the compliance of each parameter (m/N, rad/(N m)), then that of each pair.
    pub compliances: Rows<'a>,
}

/// Twist per unit wrench, (component, component) per sample.
pub struct Compliance<'a> {
    components: Vec<usize>,
    dependents: Vec<&'a [(usize, usize)]>,
    pairs: Vec<(usize, usize)>,
    compliances: Rows<'a>,
}

impl<'a> Compliance<'a> {
    /// From what gives way.
    pub fn new(machine: &'a Machine, yielding: Yielding<'a>) -> Self {
        Compliance {
            components: indices_of(&machine.dof),
            dependents: dependents(machine, yielding.columns),
            pairs: yielding.pairs.to_vec(),
            compliances: yielding.compliances,
        }
    }

    /// How far closures open per unit force in closures.
    #[inline(always)]
    fn of_closures<S: Real>(&self, linear: &Linearisation<S>, place: Place) -> ClosureMatrix<S> {
        let count = self.dependents.len();
        let mut compliances = vec![S::default(); count + self.pairs.len()];
        self.compliances.load(place.first, place.size, &mut compliances);
        let (own, shared) = compliances.split_at(count);
        let gradients = &linear.to_parameters;
        let mut matrix = closure_compliance(gradients, &self.dependents, own);
        for (&(one, other), &compliance) in self.pairs.iter().zip(shared) {
            let (one, other) = (self.dependents[one], self.dependents[other]);
            add_shared(gradients, [one, other], compliance, &mut matrix);
        }
        matrix
    }
}

impl FirstOrder for Compliance<'_> {
    fn width(&self) -> usize {
        self.components.len() * self.components.len()
    }
    #[inline(always)]
    fn write<S: Real>(
        &self,
        linear: &Linearisation<S>,
        place: Place,
        _part: usize,
        columns: &mut [S],
    ) {
        let closures = self.of_closures(linear, place);
        let matrix = pose_compliance(&linear.inverse, &closures);
        let mut cells = columns.iter_mut();
        for &i in &self.components {
            for (&k, cell) in self.components.iter().zip(&mut cells) {
                *cell = matrix[i][k];
            }
        }
    }
}

/// Wrench per unit twist, (component, component) per sample; also at singular poses.
pub struct Stiffness<'a> {
    from: Compliance<'a>,
    closures: usize,
}

impl<'a> Stiffness<'a> {
    /// From what gives way.
    pub fn new(machine: &'a Machine, yielding: Yielding<'a>) -> Self {
        let closures = machine.closure_count();
        Stiffness { from: Compliance::new(machine, yielding), closures }
    }
}

impl FirstOrder for Stiffness<'_> {
    fn width(&self) -> usize {
        self.from.width()
    }
    fn survives_singular(&self) -> bool {
        true
    }
    #[inline(always)]
    fn write<S: Real>(
        &self,
        linear: &Linearisation<S>,
        place: Place,
        _part: usize,
        columns: &mut [S],
    ) {
        let closures = self.from.of_closures(linear, place);
        // Pivoting is per sample: the closures' compliance may be as ill-scaled as the file.
        for lane in 0..S::WIDTH {
            let single = closures.map(|row| row.map(|value| value.lane(lane)));
            let rows = linear.rows.map(|row| row.map(|value| value.lane(lane)));
            let matrix = pose_stiffness(&rows, &single, self.closures);
            let mut cells = columns.iter_mut();
            for &i in &self.from.components {
                for (&k, cell) in self.from.components.iter().zip(&mut cells) {
                    cell.set_lane(lane, matrix.map_or(f64::NAN, |matrix| matrix[i][k]));
                }
            }
        }
    }
}

/// Forces in the closures per unit of some parameters, (closure, parameter) per sample: what a deviation
/// strains in a machine with more closures than freedoms, N/m or N/rad.
pub struct InternalForces<'a> {
    machine: &'a Machine,
    dependents: Vec<&'a [(usize, usize)]>,
}

impl<'a> InternalForces<'a> {
    /// For the parameters of the given indices.
    pub fn new(machine: &'a Machine, columns: &[usize]) -> Self {
        InternalForces { machine, dependents: dependents(machine, columns) }
    }
}

impl FirstOrder for InternalForces<'_> {
    fn width(&self) -> usize {
        self.machine.closure_count() * self.dependents.len()
    }
    #[inline(always)]
    fn write<S: Real>(
        &self,
        linear: &Linearisation<S>,
        _place: Place,
        _part: usize,
        columns: &mut [S],
    ) {
        // Such machines run sample by sample; a lane is one of them.
        for lane in 0..S::WIDTH {
            let forces = internal_forces(self.machine, &linear.lane(lane));
            let mut cells = columns.iter_mut();
            for row in &forces[..self.machine.closure_count()] {
                for (dependents, cell) in self.dependents.iter().zip(&mut cells) {
                    let force = |&(closure, slot): &(usize, usize)| {
                        row[closure] * linear.to_parameters[closure][slot].lane(lane)
                    };
                    cell.set_lane(lane, dependents.iter().map(force).sum());
                }
            }
        }
    }
}
