//! More closures than freedoms: the pose of least elastic energy.
//!
//! No pose closes everything once parameters deviate; the parts give way instead. With closure residuals
//! g, the compliance C of the closures (their own and that of the parameters they read, `G diag(c) G^T`)
//! and K = C^-1 the platform comes to rest where `1/2 (g - s)^T K (g - s) - F . twist` is least. A clearance
//! is a dead zone: s may take any value within it at no cost. A closure then either touches, stands at an
//! end of its clearance and carries, or floats and carries nothing (Nakamura & Murai, on errors that
//! clearances absorb and errors that strain the structure).
//!
//! The change of the rows with the pose is left out of the stiffness, so that where clearances are wide and
//! loads large against the stiffness the iteration may not converge, which the status then reports.

use super::SINGULAR;
use super::closures::Sample;
use super::condition::condition_at;
use super::elastic::{Structure, scaled_rows, spread, unit};
use super::linearisation::Linearisation;
use crate::linear::{CLOSURES, SIX};
use crate::machine::{Machine, indices_of};
use crate::spatial::Pose;
use crate::statics::ClosureMatrix;
use crate::status::Status;
use nalgebra::{DMatrix, DVector};

/// Longest iteration, and longest search for the closures that touch.
const STEPS: usize = 100;
const EXCHANGES: usize = 200;
/// A relative step s leaves about s times the relative misfit: at rounding level below this.
const SETTLED: f64 = 1e-12;
/// Longest relative step that is taken at once.
const LONG_STEP: f64 = 0.5;
/// Share of its stiffness with which a closure that floats, or touches, is drawn to the middle of its
/// clearance: where clearances leave the platform loose it stands in their middle.
const CENTRING: f64 = 1e-9;

/// What acts on an over-constrained machine beside its parameters.
#[derive(Clone, Copy, Debug, Default)]
pub struct Loads {
    /// Half of each closure's clearance, m: its residual is free within plus and minus this.
    pub clearance: [f64; CLOSURES],
    /// Wrench on the tool at the tool point, base axes, N and N m.
    pub wrench: [f64; SIX],
}

/// A machine at rest.
#[derive(Clone, Copy, Debug)]
pub struct Equilibrium {
    /// The platform's pose.
    pub pose: Pose<f64>,
    /// Force in each closure, N: tension of a strut positive.
    pub forces: [f64; CLOSURES],
    /// What of each closure's residual its clearance takes, m.
    pub absorbed: [f64; CLOSURES],
    /// What of each closure's residual its parts take by straining, m.
    pub strain: [f64; CLOSURES],
    /// What became of it.
    pub status: Status,
}

/// How a closure stands in its clearance.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Contact {
    /// It has no clearance, or stands at the end of this sign.
    Touching(f64),
    /// It carries nothing.
    Floating,
}

/// `K (I - W W^+)` with the spread W^+: the force in each closure per unit residual of each, after the
/// platform gave way. Tension of a strut positive; not finite where a closure is rigid.
pub fn internal_forces(machine: &Machine, linear: &Linearisation<f64>) -> ClosureMatrix<f64> {
    let mut result = [[0.0; CLOSURES]; CLOSURES];
    let structure = Structure::new(machine, &linear.to_parameters);
    let carrying = &structure.carrying;
    let spread = spread(machine, &linear.rows, &linear.to_parameters);
    let Some(stiffness) = structure.stiffness(carrying) else {
        return [[f64::NAN; CLOSURES]; CLOSURES];
    };
    let left = DMatrix::from_fn(carrying.len(), carrying.len(), |i, k| {
        let row = &linear.rows[carrying[i]];
        let given: f64 = (0..SIX).map(|c| row[c] * spread[c][carrying[k]]).sum();
        f64::from(u8::from(i == k)) - given
    });
    let forces = stiffness * left;
    for (i, &row) in carrying.iter().enumerate() {
        for (k, &column) in carrying.iter().enumerate() {
            result[row][column] = forces[(i, k)];
        }
    }
    result
}

/// Where the platform comes to rest for joint coordinates `q`, from a nearby pose.
pub fn least_energy(
    sample: &Sample<'_>,
    q: &[f64],
    start: &Pose<f64>,
    loads: &Loads,
) -> Equilibrium {
    let machine = sample.machine;
    let zero = [0.0; CLOSURES];
    let mut equilibrium = Equilibrium {
        pose: *start,
        forces: zero,
        absorbed: zero,
        strain: zero,
        status: Status::NotConverged,
    };
    let mut contacts: Vec<Contact> = loads.clearance[..machine.closure_count()]
        .iter()
        .map(|&gap| if gap > 0.0 { Contact::Floating } else { Contact::Touching(0.0) })
        .collect();
    let mut linear = Linearisation::default();
    for _ in 0..STEPS {
        linear.differentiate(machine, sample.p, q, &equilibrium.pose);
        let structure = Structure::new(machine, &linear.to_parameters);
        let (_, residuals) = sample.closures(&equilibrium.pose);
        let balance = Rest { machine, loads, structure: &structure, linear: &linear, residuals }
            .find(&mut contacts);
        let Some(rest) = balance else { return equilibrium };
        let size: f64 = rest.twist.iter().map(|value| value.abs()).sum();
        if !size.is_finite() {
            return equilibrium;
        }
        // A long step is taken in part, so that the platform moves as it would and keeps its assembly.
        let share = (LONG_STEP * machine.characteristic_length / size).min(1.0);
        let mut twist = [0.0; SIX];
        for (k, &freedom) in indices_of(&machine.dof).iter().enumerate() {
            twist[freedom] = share * rest.twist[k] / unit(machine, freedom);
        }
        equilibrium.pose.step(twist);
        for i in 0..machine.closure_count() {
            equilibrium.forces[i] = rest.forces[i];
            equilibrium.absorbed[i] = rest.absorbed[i];
            equilibrium.strain[i] =
                (0..CLOSURES).map(|k| structure.compliance[i][k] * rest.forces[k]).sum();
        }
        if size / machine.characteristic_length < SETTLED {
            let held = condition_at(sample, &equilibrium.pose) >= SINGULAR;
            equilibrium.status = if held { Status::Ok } else { Status::Singular };
            return equilibrium;
        }
    }
    equilibrium
}

/// The linearised problem at one pose.
struct Rest<'a> {
    machine: &'a Machine,
    loads: &'a Loads,
    structure: &'a Structure,
    linear: &'a Linearisation<f64>,
    residuals: [f64; CLOSURES],
}

/// Its solution: scaled twist, forces and what clearances take.
struct Balance {
    twist: DVector<f64>,
    forces: [f64; CLOSURES],
    absorbed: [f64; CLOSURES],
}

impl Rest<'_> {
    /// Exchanges contacts, the most contradicting first, until each is what its force and gap say.
    fn find(&self, contacts: &mut [Contact]) -> Option<Balance> {
        for round in 0..EXCHANGES {
            let balance = self.solve(contacts)?;
            let mut worst: Option<(f64, usize, Contact)> = None;
            for &i in &self.structure.carrying {
                let gap = self.loads.clearance[i];
                if gap == 0.0 {
                    continue;
                }
                let (excess, becomes) = match contacts[i] {
                    Contact::Touching(side) => {
                        let pressing = side * balance.forces[i] * self.structure.compliance[i][i];
                        (-pressing, Contact::Floating)
                    }
                    Contact::Floating => {
                        let open = self.opening(i, &balance.twist);
                        (open.abs() - gap, Contact::Touching(open.signum()))
                    }
                };
                // Most contradicting first; the first of all once that has gone on for long, so that no
                // circle is run through for ever.
                let ahead = worst.is_none_or(|(most, ..)| excess > most && round < EXCHANGES / 2);
                if excess > 1e-12 * gap && ahead {
                    worst = Some((excess, i, becomes));
                }
            }
            match worst {
                None => return Some(balance),
                Some((_, i, becomes)) => contacts[i] = becomes,
            }
        }
        None
    }

    /// A closure's residual after the twist, to first order.
    fn opening(&self, closure: usize, twist: &DVector<f64>) -> f64 {
        let row = scaled_rows(self.machine, &self.linear.rows, &[closure]);
        self.residuals[closure] + (row * twist)[0]
    }

    /// Balance of forces with the contacts as they are assumed.
    fn solve(&self, contacts: &[Contact]) -> Option<Balance> {
        let carrying = &self.structure.carrying;
        let touching: Vec<usize> = carrying
            .iter()
            .copied()
            .filter(|&i| matches!(contacts[i], Contact::Touching(_)))
            .collect();
        let taken = |i: usize| match contacts[i] {
            Contact::Touching(side) => side * self.loads.clearance[i],
            Contact::Floating => 0.0,
        };
        let rows = scaled_rows(self.machine, &self.linear.rows, &touching);
        let stiffness = self.structure.stiffness(&touching)?;
        let open = DVector::from_iterator(
            touching.len(),
            touching.iter().map(|&i| self.residuals[i] - taken(i)),
        );
        let freedoms = indices_of(&self.machine.dof);
        let mut balance = DVector::from_iterator(
            freedoms.len(),
            freedoms.iter().map(|&k| self.loads.wrench[k] / unit(self.machine, k)),
        );
        let weighted = rows.transpose() * &stiffness;
        let mut normal = &weighted * &rows;
        balance -= &weighted * &open;
        if touching.len() < carrying.len() || carrying.iter().any(|&i| taken(i) != 0.0) {
            let every = scaled_rows(self.machine, &self.linear.rows, carrying);
            for (row, &i) in every.row_iter().zip(carrying) {
                let centring = CENTRING / self.structure.compliance[i][i];
                normal += row.transpose() * row * centring;
                balance -= row.transpose() * (centring * self.residuals[i]);
            }
        }
        let twist = normal.cholesky()?.solve(&balance);
        let pulls = &stiffness * (&rows * &twist + open);
        let mut solution = Balance { twist, forces: [0.0; CLOSURES], absorbed: [0.0; CLOSURES] };
        for (&i, &force) in touching.iter().zip(&pulls) {
            solution.forces[i] = force;
        }
        for &i in carrying {
            solution.absorbed[i] = match contacts[i] {
                Contact::Touching(_) => taken(i),
                Contact::Floating => self.opening(i, &solution.twist),
            };
        }
        Some(solution)
    }
}
