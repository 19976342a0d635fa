//! The closures of a machine at a pose, with their rows: derivatives to the platform's twist.
//!
//! The elements give closures of points; how a platform joint moves with the platform's twist
//! (translation of the tool point, then rotation) is added here, once for all elements.

use crate::element::ParameterGradient;
use crate::element::guide::{Anchor, GuideLimb, Placement};
use crate::element::strut::{self, nearest_on_ring};
use crate::linear::{CLOSURES, IN_ORDER, Matrix6, Order, SIX};
use crate::machine::{Machine, MachineGuide, Ring, Strut};
use crate::scalar::{Dual, Real, Scalar};
use crate::spatial::{Pose, RotationMatrix, Vector, add, cross, rotate, rotation_matrix, subtract};

/// One strut of one sample, ready for the iteration: everything that does not depend on the pose.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limb<S> {
    /// Base-side joint centre, base frame.
    pub base: Vector<S>,
    /// Platform-side joint centre from the tool point, platform axes.
    pub arm: Vector<S>,
    /// The strut's length.
    pub length: S,
}

/// The struts of one sample; those beyond the machine's are unused.
pub type Limbs<S> = [Limb<S>; CLOSURES];
/// Rows of all closures of one sample.
pub type Rows<S> = [[S; SIX]; CLOSURES];
/// Residuals of all closures of one sample.
pub type Residuals<S> = [S; CLOSURES];

impl<S: Scalar> Limb<S> {
    /// All zero, of the same kind as `like`.
    pub fn zero(like: S) -> Self {
        let zero = like.lift(0.0);
        Limb { base: [zero; 3], arm: [zero; 3], length: zero }
    }

    /// A strut as its own parameters give it, before its drive: `base` from the carriage or crank, and no
    /// length where the drive is the length. `tool` is the tool point, platform axes.
    #[inline(always)]
    pub fn undriven(strut: &Strut, p: &[S], tool: Vector<S>) -> Self {
        let own = &p[strut.first..];
        let base = strut.carried_base(p);
        let length = match strut.own_length {
            Some(index) => p[index],
            None => base[0].lift(0.0),
        };
        Limb { base, arm: [own[3] - tool[0], own[4] - tool[1], own[5] - tool[2]], length }
    }

    /// A strut where its drive puts it.
    #[inline(always)]
    pub fn placed(machine: &Machine, strut: &Strut, p: &[S], q: &[S], tool: Vector<S>) -> Self {
        let mut limb = Limb::undriven(strut, p, tool);
        if let Some(index) = strut.drive {
            let drive = &machine.drives[index];
            let (nominal, parameters) = (&drive.nominal, &p[drive.first..]);
            (limb.base, limb.length) =
                drive.kind.place(nominal, parameters, q[index], limb.base, limb.length);
        }
        limb
    }

    /// The platform-side joint centre from the tool point, base axes.
    #[inline(always)]
    pub fn turned_arm(
        &self,
        strut: &Strut,
        p: &[S],
        rotation: &RotationMatrix<S>,
        position: Vector<S>,
    ) -> Vector<S> {
        match &strut.ring {
            None => rotate(rotation, self.arm),
            Some(ring) => ring_arm(ring, p[ring.radius], self, rotation, position).0,
        }
    }
}

impl<S: Real> Limb<S> {
    /// The same strut in every lane.
    #[inline(always)]
    pub fn splat(limb: &Limb<f64>) -> Self {
        let mut result = Limb::default();
        for k in 0..3 {
            result.base[k] = S::splat(limb.base[k]);
            result.arm[k] = S::splat(limb.arm[k]);
        }
        result.length = S::splat(limb.length);
        result
    }
}

/// The tool point in platform axes.
#[inline(always)]
pub fn tool_point<S: Scalar>(machine: &Machine, p: &[S]) -> Vector<S> {
    [p[machine.tool], p[machine.tool + 1], p[machine.tool + 2]]
}

/// Places every strut's joint centres for parameters `p` and joint coordinates `q`.
#[inline(always)]
pub fn place_limbs<S: Scalar>(machine: &Machine, p: &[S], q: &[S], limbs: &mut Limbs<S>) {
    let tool = tool_point(machine, p);
    for (limb, strut) in limbs.iter_mut().zip(&machine.struts) {
        *limb = Limb::placed(machine, strut, p, q, tool);
    }
}

/// The placed struts of one sample.
pub fn limbs(machine: &Machine, p: &[f64], q: &[f64]) -> Limbs<f64> {
    let mut result = Limbs::default();
    place_limbs(machine, p, q, &mut result);
    result
}

/// A row from the derivative to the platform joint: the same force, and its moment about the tool
/// point; zero in the freedoms that the frame holds.
#[inline(always)]
pub fn row<S: Scalar>(machine: &Machine, to_centre: Vector<S>, arm: Vector<S>) -> [S; SIX] {
    let moment = cross(arm, to_centre);
    let mut row = [to_centre[0], to_centre[1], to_centre[2], moment[0], moment[1], moment[2]];
    hold(machine, &mut row);
    row
}

/// Takes the freedoms that the frame holds out of a row.
#[inline(always)]
fn hold<S: Scalar>(machine: &Machine, row: &mut [S; SIX]) {
    for &freedom in &machine.held {
        row[freedom] = row[0].lift(0.0);
    }
}

/// A ring joint's arm from the tool point, base axes: the ring's point nearest to the strut's base, and
/// the unit vector from the ring's centre to it.
#[inline(always)]
pub fn ring_arm<S: Scalar>(
    ring: &Ring,
    radius: S,
    limb: &Limb<S>,
    rotation: &RotationMatrix<S>,
    position: Vector<S>,
) -> (Vector<S>, Vector<S>) {
    let axis = rotate(rotation, ring.axis.map(|value| radius.lift(value)));
    let centre = rotate(rotation, limb.arm);
    nearest_on_ring(centre, axis, radius, subtract(limb.base, position))
}

/// A guide's anchors for parameters `p`.
#[inline(always)]
pub fn guide_limb<S: Scalar>(guide: &MachineGuide, p: &[S], tool: Vector<S>) -> GuideLimb<S> {
    let zero = tool[0].lift(0.0);
    let value =
        |anchor: Anchor, k: usize| guide.first[anchor as usize].map_or(zero, |at| p[at + k]);
    let point = |anchor| [0, 1, 2].map(|k| value(anchor, k));
    let tilt = |anchor| [0, 1].map(|k| value(anchor, k));
    GuideLimb {
        frame_point: point(Anchor::FramePoint),
        arm: subtract(point(Anchor::PlatformPoint), tool),
        tilts: [tilt(Anchor::FrameDirection), tilt(Anchor::PlatformDirection)],
    }
}

/// One closure of a guide for parameters `p`.
pub struct GuideClosure<'a, S> {
    guide: &'a MachineGuide,
    which: usize,
    limb: GuideLimb<S>,
    /// What the limb that it stands for has given way by, m, if that is a parameter.
    offset: Option<S>,
}

/// The guides' closures, each with its number among all closures.
pub fn guide_closures<'a, S: Scalar>(
    machine: &'a Machine,
    p: &[S],
) -> impl Iterator<Item = (usize, GuideClosure<'a, S>)> {
    let closures = machine.guide_closures.iter().enumerate();
    closures.map(move |(number, &(guide, which))| {
        let guide = &machine.guides[guide];
        let limb = guide_limb(guide, p, tool_point(machine, p));
        let offset = machine.guide_offsets[number].map(|at| p[at]);
        (machine.struts.len() + number, GuideClosure { guide, which, limb, offset })
    })
}

/// The wrench of one of the guides' closures about the tool point: its row, also in the freedoms that the
/// frame holds.
pub fn guide_wrench<S: Scalar>(
    machine: &Machine,
    number: usize,
    p: &[S],
    at: Placement<'_, S>,
) -> [S; SIX] {
    let (index, which) = machine.guide_closures[number];
    let guide = &machine.guides[index];
    let limb = guide_limb(guide, p, tool_point(machine, p));
    guide.kind.row(which, &guide.frames, &limb, at, machine.characteristic_length).1
}

impl<S: Scalar> GuideClosure<'_, S> {
    /// Residual and row; zero in the freedoms that the frame holds.
    pub fn row(&self, machine: &Machine, at: Placement<'_, S>) -> (S, [S; SIX]) {
        let GuideClosure { guide, which, limb, offset } = self;
        let length = machine.characteristic_length;
        let (residual, mut row) = guide.kind.row(*which, &guide.frames, limb, at, length);
        hold(machine, &mut row);
        (offset.map_or(residual, |offset| residual - offset), row)
    }

    /// Derivatives to the parameters.
    pub fn gradient(
        &self,
        machine: &Machine,
        at: Placement<'_, S>,
        to_parameters: &mut ParameterGradient<S>,
    ) {
        let GuideClosure { guide, which, limb, offset } = self;
        let length = machine.characteristic_length;
        guide.kind.gradient(*which, &guide.frames, limb, at, length, to_parameters);
        if let Some(offset) = offset {
            to_parameters.set_offset(offset.lift(-1.0));
        }
    }
}

/// Residual of a strut's closure and its derivatives to the platform-side joint centre.
#[inline(always)]
fn strut_closure<S: Scalar, const SQUARED: bool>(limb: &Limb<S>, centre: Vector<S>) -> Dual<S, 3> {
    let at = [
        Dual::<S, 3>::variable(centre[0], 0),
        Dual::variable(centre[1], 1),
        Dual::variable(centre[2], 2),
    ];
    let base =
        [Dual::constant(limb.base[0]), Dual::constant(limb.base[1]), Dual::constant(limb.base[2])];
    let length = Dual::constant(limb.length);
    if SQUARED {
        strut::squared_closure(base, at, length)
    } else {
        strut::closure(base, at, length)
    }
}

/// The identity row of the freedom that the frame holds as its number `number`.
#[inline(always)]
pub fn held_row<S: Real>(machine: &Machine, number: usize) -> [S; SIX] {
    let mut result = [S::default(); SIX];
    result[machine.held[number]] = S::splat(1.0);
    result
}

/// Residuals and rows of the squared closures of a plain machine: what Newton's iteration runs on. In
/// the given order of elimination: closures `0..closure_count`, beyond them identity rows of the freedoms
/// that the frame holds, which are taken out of the closures.
#[inline(always)]
pub fn squared_rows<S: Real>(
    machine: &Machine,
    limbs: &[Limb<S>],
    pose: &Pose<S>,
    order: &Order,
    rows: &mut Matrix6<S>,
    residuals: &mut [S; SIX],
) {
    let rotation = rotation_matrix(pose.rotation);
    let count = machine.struts.len();
    for slot in 0..SIX {
        let i = order[slot];
        if i >= count {
            rows[slot] = held_row(machine, i - count);
            residuals[slot] = S::default();
            continue;
        }
        let limb = &limbs[i];
        let arm = rotate(&rotation, limb.arm);
        let closure = strut_closure::<S, true>(limb, add(arm, pose.position));
        rows[slot] = row(machine, closure.parts, arm);
        residuals[slot] = closure.value;
    }
}

/// Residuals of the squared closures of a plain machine alone, in the given order.
#[inline(always)]
pub fn squared_residuals<S: Real>(
    machine: &Machine,
    limbs: &[Limb<S>],
    pose: &Pose<S>,
    order: &Order,
    residuals: &mut [S; SIX],
) {
    let rotation = rotation_matrix(pose.rotation);
    for slot in 0..SIX {
        residuals[slot] = if order[slot] < machine.struts.len() {
            let limb = &limbs[order[slot]];
            let centre = add(rotate(&rotation, limb.arm), pose.position);
            strut::squared_closure(limb.base, centre, limb.length)
        } else {
            S::default()
        };
    }
}

/// Rows and residuals of all closures as they come, struts squared or not; guides as they are. Zero beyond
/// the machine's closures.
pub fn system<S: Scalar, const SQUARED: bool>(
    machine: &Machine,
    p: &[S],
    limbs: &Limbs<S>,
    rotation: &RotationMatrix<S>,
    position: Vector<S>,
) -> (Rows<S>, Residuals<S>) {
    let zero = position[0].lift(0.0);
    let (mut rows, mut residuals) = ([[zero; SIX]; CLOSURES], [zero; CLOSURES]);
    for (i, strut) in machine.struts.iter().enumerate() {
        let limb = &limbs[i];
        let arm = limb.turned_arm(strut, p, rotation, position);
        let closure = strut_closure::<S, SQUARED>(limb, add(arm, position));
        rows[i] = row(machine, closure.parts, arm);
        residuals[i] = closure.value;
    }
    for (i, closure) in guide_closures(machine, p) {
        (residuals[i], rows[i]) = closure.row(machine, (rotation, position));
    }
    (rows, residuals)
}

/// One sample of any machine on the scalar path: parameters, and the struts placed.
#[derive(Clone, Copy)]
pub struct Sample<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// All parameters; may be empty for a plain machine, which the placed struts tell all of.
    pub p: &'a [f64],
    /// The struts, placed for these parameters and the joints.
    pub limbs: &'a Limbs<f64>,
}

impl Sample<'_> {
    /// Residuals and rows of all closures as they come; see [`system`].
    fn system<const SQUARED: bool>(&self, pose: &Pose<f64>) -> (Rows<f64>, Residuals<f64>) {
        let rotation = rotation_matrix(pose.rotation);
        system::<_, SQUARED>(self.machine, self.p, self.limbs, &rotation, pose.position)
    }

    /// Residuals and rows on which Newton's iteration runs, as a square system: struts squared, identity
    /// rows for the freedoms that the frame holds. Only for as many closures as freedoms.
    pub fn squared(&self, pose: &Pose<f64>) -> (Matrix6<f64>, [f64; SIX]) {
        let (mut square, mut values) = ([[0.0; SIX]; SIX], [0.0; SIX]);
        if self.machine.plain {
            squared_rows(self.machine, self.limbs, pose, &IN_ORDER, &mut square, &mut values);
            return (square, values);
        }
        let (rows, residuals) = self.system::<true>(pose);
        square.copy_from_slice(&rows[..SIX]);
        values.copy_from_slice(&residuals[..SIX]);
        let count = self.machine.closure_count();
        for number in 0..self.machine.held.len() {
            square[count + number] = held_row(self.machine, number);
        }
        (square, values)
    }

    /// The residuals of [`Sample::squared`] alone.
    pub fn squared_residuals(&self, pose: &Pose<f64>) -> [f64; SIX] {
        if !self.machine.plain {
            return self.squared(pose).1;
        }
        let mut values = [0.0; SIX];
        squared_residuals(self.machine, self.limbs, pose, &IN_ORDER, &mut values);
        values
    }

    /// Residuals (m) and rows (unit wrenches) of the closures themselves.
    pub fn closures(&self, pose: &Pose<f64>) -> (Rows<f64>, Residuals<f64>) {
        self.system::<false>(pose)
    }
}

/// A start order for a plain machine's lanes.
pub fn start_rows(machine: &Machine, limbs: &Limbs<f64>, pose: &Pose<f64>) -> Matrix6<f64> {
    let (mut rows, mut residuals) = ([[0.0; SIX]; SIX], [0.0; SIX]);
    squared_rows(machine, limbs, pose, &IN_ORDER, &mut rows, &mut residuals);
    rows
}
