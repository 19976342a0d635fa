//! What an instrument reads at one pose or between two, with its derivatives.
//!
//! A reading is a function of the platform's pose, of where the instrument stands and what it looks at, and,
//! where it looks at a strut, of that strut's own parameters. Derivatives to the first two are written
//! out; those of struts come from dual numbers. A parameter that was measured by itself is its own reading.

use crate::element::MAX_DRIVE_PARAMETERS;
use crate::kinematics::{Limb, ring_arm};
use crate::linear::SIX;
use crate::machine::Machine;
use crate::scalar::{Dual, Scalar};
use crate::spatial::{
    Pose, Quaternion, RotationMatrix, Vector, add, angle_rates, cross, dot, euler_angles, norm,
    rotate, rotate_back, rotation_matrix, scale, subtract,
};

/// What is observed. The numbers are those of `OBSERVABLES` in Python.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Observable {
    /// A coordinate of the target point in the instrument's frame, m.
    Coordinate(usize),
    /// An angle a, b, c of the platform in the instrument's frame, rad.
    Angle(usize),
    /// Distance of the target point from the frame's origin, m.
    Distance,
    /// Distance between a strut's joint centres, m.
    Length,
    /// A component of a strut's unit vector, from base to platform, in the instrument's frame.
    Direction(usize),
    /// By which a strut's direction is turned about the instrument's axis, rad.
    Turn,
    /// Distance between the places of the target point at two poses, m.
    Separation,
    /// A parameter of the machine, in its own unit.
    Parameter,
}

impl Observable {
    /// From its number; `None` where there is none of it.
    pub fn from_number(number: usize) -> Option<Self> {
        match number {
            0..3 => Some(Observable::Coordinate(number)),
            3..6 => Some(Observable::Angle(number - 3)),
            6 => Some(Observable::Distance),
            7 => Some(Observable::Length),
            8..11 => Some(Observable::Direction(number - 8)),
            11 => Some(Observable::Turn),
            12 => Some(Observable::Separation),
            // Lengths, angles and plain numbers are told apart in Python only.
            13..16 => Some(Observable::Parameter),
            _ => None,
        }
    }

    /// Whether it is of one strut.
    pub fn of_strut(self) -> bool {
        matches!(self, Observable::Length | Observable::Direction(_) | Observable::Turn)
    }

    /// Whether readings that differ by whole turns are the same.
    pub fn is_angle(self) -> bool {
        matches!(self, Observable::Angle(_) | Observable::Turn)
    }
}

/// Numbers of an instrument's own that may be unknown: origin and rotation of its frame, its target.
pub const OWN: usize = 9;

/// An instrument: its frame and its target.
#[derive(Clone, Debug)]
pub struct Instrument {
    /// Its frame in the base frame.
    pub frame: Pose<f64>,
    /// The target point from the tool point, platform axes, m.
    pub target: Vector<f64>,
    /// Axis and zero direction of what measures a turn: unit vectors across each other.
    pub axis: Vector<f64>,
    /// The zero direction.
    pub zero: Vector<f64>,
    /// Whether these two are in platform axes; else in the frame's.
    pub on_platform: bool,
    /// Which unknowns move its frame's origin, turn it (about base axes, a Cayley map), move its target.
    pub unknowns: [Option<usize>; OWN],
}

/// An instrument with the values of its unknowns.
#[derive(Clone, Debug)]
pub struct Placed {
    origin: Vector<f64>,
    /// Columns are the frame's axes in the base frame.
    rotation: RotationMatrix<f64>,
    /// Angular velocities, base axes, of the frame for each of its three rotation unknowns.
    turning: [Vector<f64>; 3],
    target: Vector<f64>,
}

impl Instrument {
    /// Where it is for these values of all unknowns.
    pub fn placed(&self, values: &[f64]) -> Placed {
        let own = self.unknowns.map(|unknown| unknown.map_or(0.0, |index| values[index]));
        let turn = [own[3], own[4], own[5]];
        // The rotation of the quaternion (1, d), d = turn / 2, changes by 2 (d' + d x d') / (1 + |d|^2).
        let share = 1.0 / (1.0 + 0.25 * dot(turn, turn));
        let turning = [0, 1, 2].map(|k| {
            let mut unit = [0.0; 3];
            unit[k] = 1.0;
            scale(add(unit, scale(cross(turn, unit), 0.5)), share)
        });
        let mut frame = self.frame;
        frame.step([own[0], own[1], own[2], turn[0], turn[1], turn[2]]);
        Placed {
            origin: frame.position,
            rotation: rotation_matrix(frame.rotation),
            turning,
            target: add(self.target, [own[6], own[7], own[8]]),
        }
    }
}

/// Parameters that the joint centres of one strut depend on: its base and platform point, the tool point,
/// those of its drive, its ring's radius.
pub const STRUT_PARAMETERS: usize = 3 + 3 + 3 + MAX_DRIVE_PARAMETERS + 1;
const STRUT_WIDTH: usize = SIX + STRUT_PARAMETERS;

/// A reading and its derivatives at one pose.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    /// What is read.
    pub value: f64,
    /// To the platform's twist.
    pub to_twist: [f64; SIX],
    /// To the instrument's own numbers.
    pub to_own: [f64; OWN],
}

impl Reading {
    /// One that depends on nothing yet.
    pub fn new(value: f64) -> Self {
        Reading { value, to_twist: [0.0; SIX], to_own: [0.0; OWN] }
    }
}

/// What an instrument sees of the platform at one pose: all that its readings there have in common.
#[derive(Clone, Copy, Debug, Default)]
pub struct InstrumentView {
    body: RotationMatrix<f64>,
    arm: Vector<f64>,
    away: Vector<f64>,
    angles: [f64; 3],
    /// Angular velocity, base axes -> rate of each angle.
    rates: [Vector<f64>; 3],
}

impl InstrumentView {
    /// From an instrument to the platform at a pose; angles only where they are needed.
    pub fn new(placed: &Placed, pose: &Pose<f64>, with_angles: bool) -> Self {
        let body = rotation_matrix(pose.rotation);
        let arm = rotate(&body, placed.target);
        let away = subtract(add(pose.position, arm), placed.origin);
        let mut view = InstrumentView { body, arm, away, ..InstrumentView::default() };
        if with_angles {
            view.angles = euler_angles(&product(&transposed(&placed.rotation), &body));
            // Rates for velocities along the frame's axes, one a column; then along the base's.
            let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
                .map(|velocity| angle_rates(view.angles, velocity));
            view.rates = [0, 1, 2].map(|k| rotate(&placed.rotation, [x[k], y[k], z[k]]));
        }
        view
    }

    /// What is read.
    #[inline(always)]
    pub fn value(&self, observable: Observable, placed: &Placed) -> f64 {
        match observable {
            Observable::Coordinate(k) => dot(column(&placed.rotation, k), self.away),
            Observable::Distance => norm(self.away),
            Observable::Angle(k) => self.angles[k],
            _ => unreachable!("other readings are of no view, or of two"),
        }
    }

    /// How far the target point is from where it is in another view by the same instrument: the distance, with
    /// its derivatives by way of this view's pose and, whole, to the instrument's own numbers; and those by
    /// way of the other pose.
    pub fn separation(&self, other: &InstrumentView) -> (Reading, [f64; SIX]) {
        let apart = subtract(other.away, self.away);
        let mut reading = Reading::new(norm(apart));
        let direction = scale(apart, 1.0 / reading.value);
        let mut to_other = [0.0; SIX];
        let (here, there) = (cross(self.arm, direction), cross(other.arm, direction));
        let target =
            subtract(rotate_back(&other.body, direction), rotate_back(&self.body, direction));
        for k in 0..3 {
            reading.to_twist[k] = -direction[k];
            reading.to_twist[3 + k] = -here[k];
            to_other[k] = direction[k];
            to_other[3 + k] = there[k];
            reading.to_own[6 + k] = target[k];
        }
        (reading, to_other)
    }

    /// What is read, with its derivatives.
    #[inline(always)]
    pub fn reading(&self, observable: Observable, placed: &Placed) -> Reading {
        let mut reading = Reading::new(self.value(observable, placed));
        let direction = match observable {
            Observable::Coordinate(k) => column(&placed.rotation, k),
            Observable::Distance => scale(self.away, 1.0 / reading.value),
            Observable::Angle(k) => {
                let gradient = self.rates[k];
                reading.to_twist[3..].copy_from_slice(&gradient);
                for j in 0..3 {
                    reading.to_own[3 + j] = -dot(placed.turning[j], gradient);
                }
                return reading;
            }
            _ => unreachable!("other readings are of no view, or of two"),
        };
        let moment = cross(self.arm, direction);
        let target = rotate_back(&self.body, direction);
        for k in 0..3 {
            reading.to_twist[k] = direction[k];
            reading.to_twist[3 + k] = moment[k];
            reading.to_own[k] = -direction[k];
            reading.to_own[6 + k] = target[k];
        }
        if let Observable::Coordinate(_) = observable {
            let moment = cross(direction, self.away);
            for j in 0..3 {
                reading.to_own[3 + j] = dot(placed.turning[j], moment);
            }
        }
        reading
    }
}

/// Which parameters one strut's joint centres depend on, and how many these are.
fn read_by(machine: &Machine, strut: usize) -> ([usize; STRUT_PARAMETERS], usize) {
    let part = &machine.struts[strut];
    let mut read = [0; STRUT_PARAMETERS];
    let mut count = 0;
    let mut take = |first: usize, number: usize| {
        for k in 0..number {
            read[count] = first + k;
            count += 1;
        }
    };
    take(part.first, 6);
    take(machine.tool, 3);
    if let Some(index) = part.drive {
        let drive = &machine.drives[index];
        take(drive.first, drive.kind.table().parameters.len());
    }
    if let Some(ring) = &part.ring {
        take(ring.radius, 1);
    }
    (read, count)
}

/// From a strut's base-side to its platform-side joint centre, base axes; `values` are those of [`read_by`].
fn along<S: Scalar>(
    machine: &Machine,
    strut: usize,
    values: &[S],
    q: &[f64],
    (rotation, position): (&RotationMatrix<S>, Vector<S>),
) -> Vector<S> {
    let part = &machine.struts[strut];
    let zero = values[0].lift(0.0);
    let (base, arm) = ([values[0], values[1], values[2]], [values[3], values[4], values[5]]);
    let arm = subtract(arm, [values[6], values[7], values[8]]);
    let centre = match part.drive {
        None => base,
        Some(index) => {
            let drive = &machine.drives[index];
            let joint = zero.lift(q[index]);
            drive.kind.place(&drive.nominal, &values[9..], joint, base, zero).0
        }
    };
    let to_platform = match &part.ring {
        None => rotate(rotation, arm),
        Some(ring) => {
            let limb = Limb { base: centre, arm, length: zero };
            ring_arm(ring, values[values.len() - 1], &limb, rotation, position).0
        }
    };
    subtract(add(position, to_platform), centre)
}

/// What is observed of a strut that points along `along`, the platform turned by `rotation`.
fn observed<S: Scalar>(
    observable: Observable,
    (instrument, placed): (&Instrument, &Placed),
    along: Vector<S>,
    rotation: &RotationMatrix<S>,
) -> S {
    let frame = placed.rotation.map(|row| row.map(|value| along[0].lift(value)));
    match observable {
        Observable::Length => norm(along),
        Observable::Direction(k) => rotate_back(&frame, along)[k] / norm(along),
        _ => {
            let seen = if instrument.on_platform {
                rotate_back(rotation, along)
            } else {
                rotate_back(&frame, along)
            };
            let lifted = |vector: Vector<f64>| vector.map(|value| along[0].lift(value));
            let across = lifted(cross(instrument.axis, instrument.zero));
            dot(seen, across).atan2(dot(seen, lifted(instrument.zero)))
        }
    }
}

/// What an instrument sees of one strut at one pose, with its derivatives: all that its readings there
/// have in common.
pub struct StrutView {
    along: Vector<Dual<f64, STRUT_WIDTH>>,
    rotation: RotationMatrix<Dual<f64, STRUT_WIDTH>>,
    read: [usize; STRUT_PARAMETERS],
    count: usize,
}

impl StrutView {
    /// For parameters `p` and joints `q`.
    pub fn new(machine: &Machine, strut: usize, (p, q): (&[f64], &[f64]), at: &Pose<f64>) -> Self {
        type D = Dual<f64, STRUT_WIDTH>;
        let (read, count) = read_by(machine, strut);
        let mut values = [D::constant(0.0); STRUT_PARAMETERS];
        for k in 0..count {
            values[k] = D::variable(p[read[k]], SIX + k);
        }
        let mut body = Pose {
            position: at.position.map(D::constant),
            rotation: at.rotation.map(D::constant) as Quaternion<D>,
        };
        let mut twist = [D::constant(0.0); SIX];
        for (k, part) in twist.iter_mut().enumerate() {
            // Of no effect on the value, and the Cayley map's first order is exact.
            *part = D::variable(0.0, k);
        }
        body.step(twist);
        let rotation = rotation_matrix(body.rotation);
        let place = (&rotation, body.position);
        StrutView {
            along: along(machine, strut, &values[..count], q, place),
            rotation,
            read,
            count,
        }
    }

    /// A reading with its derivatives, and those to the parameters named.
    pub fn reading(
        &self,
        observable: Observable,
        (instrument, placed): (&Instrument, &Placed),
    ) -> (Reading, impl Iterator<Item = (usize, f64)>) {
        let value = observed(observable, (instrument, placed), self.along, &self.rotation);
        let mut reading = Reading::new(value.value);
        reading.to_twist.copy_from_slice(&value.parts[..SIX]);
        // A turn of the frame is a turn of the strut the other way.
        let along = self.along.map(|value| value.value);
        let unit = scale(along, 1.0 / norm(along));
        for j in 0..3 {
            let turned = cross(placed.turning[j], unit);
            reading.to_own[3 + j] = match observable {
                Observable::Direction(k) => -dot(column(&placed.rotation, k), turned),
                Observable::Turn if !instrument.on_platform => {
                    let seen = rotate_back(&placed.rotation, unit);
                    let moved = rotate_back(&placed.rotation, turned);
                    let across = cross(instrument.axis, instrument.zero);
                    let (x, y) = (dot(seen, instrument.zero), dot(seen, across));
                    let (dx, dy) = (-dot(moved, instrument.zero), -dot(moved, across));
                    (dy * x - dx * y) / (x * x + y * y)
                }
                _ => 0.0,
            };
        }
        let read = self.read;
        (reading, (0..self.count).map(move |k| (read[k], value.parts[SIX + k])))
    }
}

/// What an instrument reads of one strut, for parameters `p` and joints `q`.
pub fn of_strut(
    machine: &Machine,
    (observable, strut): (Observable, usize),
    seen_by: (&Instrument, &Placed),
    (p, q): (&[f64], &[f64]),
    at: &Pose<f64>,
) -> f64 {
    let (read, count) = read_by(machine, strut);
    let values = read.map(|parameter| p[parameter]);
    let rotation = rotation_matrix(at.rotation);
    let along = along(machine, strut, &values[..count], q, (&rotation, at.position));
    observed(observable, seen_by, along, &rotation)
}

fn column(matrix: &RotationMatrix<f64>, k: usize) -> Vector<f64> {
    [matrix[0][k], matrix[1][k], matrix[2][k]]
}

fn transposed<S: Scalar>(matrix: &RotationMatrix<S>) -> RotationMatrix<S> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| matrix[j][i]))
}

fn product(a: &RotationMatrix<f64>, b: &RotationMatrix<f64>) -> RotationMatrix<f64> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| dot(a[i], column(b, j))))
}
