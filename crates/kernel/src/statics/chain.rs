//! The compliance of a limb's closures from the parts of its chain: virtual work with a matrix.
//!
//! Under the closure forces lambda the platform pulls at the limb with `-sum W_i' lambda_i`, and every part of
//! the chain carries that, moved to where it is. A part with the compliances c_m in its axes then opens
//! closure i by `-sum_k (sum_m c_m w_im w_km) lambda_k`, w_im being component m of the wrench W_i at the part:
//! the unit-load theorem (Przemieniecki, Theory of Matrix Structural Analysis, 1968, chapter 7). Whatever a
//! joint leaves free, a closure's wrench does no work on.
//!
//! A uniform beam of length l is diagonal at its middle: l/EA and l/GJ along, l^3/12EI + l/kGA across,
//! l/EI in bending (Timoshenko's beam; the flexibility of a cantilever, moved by half its length).

use crate::kinematics::{Limb, guide_limb, guide_wrench, tool_point};
use crate::linear::SIX;
use crate::machine::{Axes, CHAIN_CLOSURES, Chain, Ends, Machine, Part, Place, Section, Side};
use crate::scalar::Scalar;
use crate::spatial::{RotationMatrix, Vector, add, cross, dot, norm, rotate, scale, subtract};

/// Closures of a chain by closures of the chain.
pub type ChainMatrix<S> = [[S; CHAIN_CLOSURES]; CHAIN_CLOSURES];

/// A force and its moment.
#[derive(Clone, Copy)]
struct Wrench<S> {
    force: Vector<S>,
    moment: Vector<S>,
}

impl<S: Scalar> Wrench<S> {
    /// The same about a point that is at `arm` from where the moment was about.
    #[inline(always)]
    fn about(&self, arm: Vector<S>) -> Self {
        Wrench { force: self.force, moment: subtract(self.moment, cross(arm, self.force)) }
    }
}

/// A chain at one pose: everything from the tool point, in base axes.
pub struct PlacedChain<'a, S> {
    chain: &'a Chain,
    /// Its base end.
    start: Vector<S>,
    /// The point that its drive moves.
    carriage: Vector<S>,
    /// Unit vectors along it and, where it is not only pulled, two across it.
    axes: [Vector<S>; 3],
    length: S,
    /// Of each closure, about the tool point.
    wrenches: [Wrench<S>; CHAIN_CLOSURES],
}

/// Of a part: displacements and turns per force and moment, in its axes.
struct Springs<S> {
    at: Vector<S>,
    axes: [Vector<S>; 3],
    across: bool,
    compliance: [S; SIX],
}

impl<'a, S: Scalar> PlacedChain<'a, S> {
    /// The chain for parameters `p`, joints `q` and a platform at `position` with axes `rotation`.
    pub fn new(
        machine: &Machine,
        chain: &'a Chain,
        p: &[S],
        q: &[S],
        (rotation, position): (&RotationMatrix<S>, Vector<S>),
    ) -> Self {
        let tool = tool_point(machine, p);
        let zero = position[0].lift(0.0);
        let (start, end, carriage) = match chain.ends {
            Ends::Strut(index) => {
                let strut = &machine.struts[index];
                let limb = Limb::placed(machine, strut, p, q, tool);
                let carriage = strut.drive.map_or(limb.base, |index| {
                    let drive = &machine.drives[index];
                    let parameters = &p[drive.first..];
                    drive.kind.place(&drive.nominal, parameters, q[index], [zero; 3], zero).0
                });
                (limb.base, rotate(rotation, limb.arm), carriage)
            }
            Ends::Guide(index) => {
                let guide = guide_limb(&machine.guides[index], p, tool);
                (guide.frame_point, rotate(rotation, guide.arm), guide.frame_point)
            }
        };
        let start = subtract(start, position);
        let along = subtract(end, start);
        let length = norm(along);
        let x = scale(along, zero.lift(1.0) / length);
        let none = Wrench { force: [zero; 3], moment: [zero; 3] };
        let mut wrenches = [none; CHAIN_CLOSURES];
        for (wrench, &closure) in wrenches.iter_mut().zip(&chain.closures) {
            *wrench = if closure < machine.struts.len() {
                Wrench { force: x, moment: cross(end, x) }
            } else {
                let number = closure - machine.struts.len();
                let row = guide_wrench(machine, number, p, (rotation, position));
                Wrench { force: [row[0], row[1], row[2]], moment: [row[3], row[4], row[5]] }
            };
        }
        let mut axes = [x, [zero; 3], [zero; 3]];
        if !chain.is_pulled() {
            let side = match chain.side {
                Side::Frame(v) => v.map(|value| zero.lift(value)),
                Side::Platform(v) => rotate(rotation, v.map(|value| zero.lift(value))),
            };
            let across = subtract(side, scale(x, dot(side, x)));
            axes[1] = scale(across, zero.lift(1.0) / norm(across));
            axes[2] = cross(x, axes[1]);
        }
        let carriage = subtract(carriage, position);
        PlacedChain { chain, start, carriage, axes, length, wrenches }
    }

    /// Its base end and its platform end, from the tool point, base axes.
    pub fn ends(&self) -> [Vector<S>; 2] {
        [self.start, self.at(self.length)]
    }

    /// The wrench of one of its closures about the tool point, base axes: force, then moment.
    pub fn wrench(&self, closure: usize) -> [Vector<S>; 2] {
        let Wrench { force, moment } = self.wrenches[closure];
        [force, moment]
    }

    /// The matrix between its closures, m/N; zero beyond them.
    pub fn compliance(&self) -> ChainMatrix<S> {
        let zero = self.length.lift(0.0);
        let mut matrix = [[zero; CHAIN_CLOSURES]; CHAIN_CLOSURES];
        let mut station = zero;
        for part in &self.chain.parts {
            let springs = self.springs(part, &mut station);
            let wrenches = self.wrenches.map(|wrench| wrench.about(springs.at));
            for (i, k) in self.chain.places() {
                let work = springs.work(&wrenches[i], &wrenches[k]);
                matrix[i][k] = matrix[i][k] + work;
                if i != k {
                    matrix[k][i] = matrix[i][k];
                }
            }
        }
        matrix
    }

    /// A part as springs in one point; `station` moves on from where it begins to where it ends.
    fn springs(&self, part: &Part, station: &mut S) -> Springs<S> {
        let lift = |value: f64| self.length.lift(value);
        match *part {
            Part::Joint { place, axes, compliance } => {
                let (axes, across) = match axes {
                    Axes::Limb => {
                        let [_, y, z, _, about_y, about_z] = compliance;
                        (self.axes, (y != z || about_y != about_z) && !self.chain.is_pulled())
                    }
                    Axes::Frame(x, y) => ([x, y, cross(x, y)].map(|axis| axis.map(lift)), true),
                };
                let at = match place {
                    Place::InTurn => self.at(*station),
                    Place::Carriage => self.carriage,
                };
                Springs { at, axes, across, compliance: compliance.map(lift) }
            }
            Part::Beam { length, section } => {
                let length = self.of_beam(length);
                let half = length * lift(0.5);
                let at = self.at(*station + half);
                *station = *station + length;
                let across = section.has_sides() && !self.chain.is_pulled();
                let compliance = section.at_middle(length);
                Springs { at, axes: self.axes, across, compliance }
            }
        }
    }

    /// A point of the limb so far from its base end, from the tool point.
    #[inline(always)]
    fn at(&self, station: S) -> Vector<S> {
        add(self.start, scale(self.axes[0], station))
    }

    fn of_beam(&self, length: Option<f64>) -> S {
        match length {
            Some(length) => self.length.lift(length),
            None => self.length - self.length.lift(self.chain.stated_length()),
        }
    }
}

impl<S: Scalar> Springs<S> {
    /// What a unit of one wrench does on the deflection under a unit of the other.
    fn work(&self, one: &Wrench<S>, other: &Wrench<S>) -> S {
        let [x, y, z, a, b, c] = self.compliance;
        let force = self.form([x, y, z], one.force, other.force);
        force + self.form([a, b, c], one.moment, other.moment)
    }

    /// `sum c_m (v . axis m) (w . axis m)`. Where y and z are alike only x has to be known.
    #[inline(always)]
    fn form(&self, c: Vector<S>, v: Vector<S>, w: Vector<S>) -> S {
        let along = dot(v, self.axes[0]) * dot(w, self.axes[0]);
        if self.across {
            let second = dot(v, self.axes[1]) * dot(w, self.axes[1]);
            let third = dot(v, self.axes[2]) * dot(w, self.axes[2]);
            return c[0].mul_add(along, c[1].mul_add(second, c[2] * third));
        }
        c[0].mul_add(along, c[2] * (dot(v, w) - along))
    }
}

impl Section {
    /// Whether it is not alike all round.
    pub fn has_sides(&self) -> bool {
        self.shear[0] != self.shear[1] || self.bending[0] != self.bending[1]
    }

    /// The compliances of a beam at its middle.
    #[inline(always)]
    fn at_middle<S: Scalar>(&self, length: S) -> [S; SIX] {
        let per = |value: f64| length.lift(value) * length;
        let third = length * length * length;
        let across = |shear: f64, bending: f64| per(shear) + length.lift(bending / 12.0) * third;
        let ([y, z], [about_y, about_z]) = (self.shear, self.bending);
        [
            per(self.stretch),
            across(y, about_z),
            across(z, about_y),
            per(self.torsion),
            per(about_y),
            per(about_z),
        ]
    }
}

impl Chain {
    /// The length of all beams that say theirs, m.
    pub fn stated_length(&self) -> f64 {
        let stated = |part: &Part| match part {
            Part::Beam { length: Some(length), .. } => *length,
            _ => 0.0,
        };
        self.parts.iter().map(stated).sum()
    }

    /// Whether it is only pulled and pushed, as a strut alone is: what lies across it does not matter.
    pub fn is_pulled(&self) -> bool {
        matches!(self.ends, Ends::Strut(_)) && self.closures.len() == 1
    }
}

/// Gauss's points in [0, 1] and their weights: exact for polynomials of degree 5.
const GAUSS: [(f64, f64); 3] = [
    (0.112_701_665_379_258_31, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];

impl PlacedChain<'_, f64> {
    /// How far each closure opens by the limb's own weight beyond what the closure forces do, m; `weight` is
    /// that of a kilogram, N, base axes.
    ///
    /// A strut hands half its weight to the platform and half to its base (the lever rule), which the closure
    /// forces and the drive see; between its ends it bends beyond that. Only what lies beyond a section bends
    /// it: with the share of the platform taken off, the force there is m (1/2 - s/l) g, and its moment
    /// -m s (l - s) / 2l x g. A tube that goes with the platform is bent by what lies on its other side.
    pub fn sag(&self, weight: Vector<f64>) -> [f64; CHAIN_CLOSURES] {
        let mut opening = [0.0; CHAIN_CLOSURES];
        let mut station = 0.0;
        for part in &self.chain.parts {
            let first = station;
            let springs = self.springs(part, &mut station);
            let beam = match *part {
                // The joints of a tube are between it and the frame: its weight is beyond them.
                Part::Joint { .. } if matches!(self.chain.ends, Ends::Guide(_)) => continue,
                Part::Joint { place, .. } => {
                    let mut acting = self.own_weight(first, weight);
                    if place == Place::Carriage {
                        acting = acting.about(subtract(self.carriage, self.start));
                        let carriage = scale(weight, self.chain.carriage_mass);
                        acting.force = add(acting.force, carriage);
                    }
                    self.open(&springs, &acting, 1.0, &mut opening);
                    continue;
                }
                Part::Beam { section, .. } => section,
            };
            let length = station - first;
            for (share, part_of_length) in GAUSS {
                let at = first + share * length;
                let per_metre = Springs {
                    at: self.at(at),
                    compliance: beam.per_metre(),
                    axes: springs.axes,
                    across: springs.across,
                };
                self.open(
                    &per_metre,
                    &self.own_weight(at, weight),
                    part_of_length * length,
                    &mut opening,
                );
            }
        }
        opening
    }

    /// How far each closure opens because the limb is warmer on one side, m: `gradient` (K/m) is in its axes.
    /// A free beam then turns by expansion x gradient x its direction a metre (Boley & Weiner, Theory of
    /// Thermal Stresses, 1960), about the middle of the beam at the whole.
    pub fn bend(&self, gradient: Vector<f64>) -> [f64; CHAIN_CLOSURES] {
        let [x, y, z] = self.axes;
        let across = add(scale(y, gradient[1]), scale(z, gradient[2]));
        let mut opening = [0.0; CHAIN_CLOSURES];
        let mut station = 0.0;
        for part in &self.chain.parts {
            let first = station;
            let springs = self.springs(part, &mut station);
            let Part::Beam { section, .. } = part else { continue };
            let turn = scale(cross(across, x), section.expansion * (station - first));
            for (opened, wrench) in opening.iter_mut().zip(&self.wrenches) {
                *opened += dot(wrench.about(springs.at).moment, turn);
            }
        }
        opening
    }

    /// What the limb's own weight makes a section carry beside the closure forces, about that section.
    fn own_weight(&self, station: f64, weight: Vector<f64>) -> Wrench<f64> {
        let (mass, length) = (self.chain.mass, self.length);
        let (force, lever) = match self.chain.ends {
            Ends::Strut(_) => {
                let left = length - station;
                (mass * (0.5 - station / length), -0.5 * mass * station * left / length)
            }
            Ends::Guide(_) => {
                let whole = self.chain.whole_length;
                let beyond = station + (whole - length);
                let per_metre = if whole > 0.0 { mass / whole } else { 0.0 };
                (-per_metre * beyond, 0.5 * per_metre * beyond * beyond)
            }
        };
        let moment = scale(cross(self.axes[0], weight), lever);
        Wrench { force: scale(weight, force), moment }
    }

    /// Adds what springs under a wrench, as long as they are, open the closures.
    fn open(
        &self,
        springs: &Springs<f64>,
        acting: &Wrench<f64>,
        share: f64,
        opening: &mut [f64; CHAIN_CLOSURES],
    ) {
        for (opened, wrench) in opening.iter_mut().zip(&self.wrenches) {
            *opened += share * springs.work(&wrench.about(springs.at), acting);
        }
    }
}

impl Section {
    fn per_metre(&self) -> [f64; SIX] {
        let ([y, z], [about_y, about_z]) = (self.shear, self.bending);
        [self.stretch, y, z, self.torsion, about_y, about_z]
    }
}
