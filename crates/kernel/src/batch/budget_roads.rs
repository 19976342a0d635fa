//! The two roads of a budget: lanes with the chord of the pose itself, and one sample alone, which pivots,
//! follows the residual and has a status.

use super::moved::{Orders, turn_alone, turn_lanes};
use crate::kinematics::{
    Limbs, Linearisation, OwnInverse, SINGULAR, Sample, chord, condition, descend, forward, limbs,
    place_limbs,
};
use crate::linear::SIX;
use crate::machine::Machine;
use crate::scalar::Real;
use crate::spatial::Pose;
use crate::status::Status;

/// What became of one sample: the first status that is not ok of the machines at their shifts, of what bands do
/// about them, and of the machines at edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Of each source at its shift, and of all of them.
    pub shifts: Status,
    /// Of the linearised closures.
    pub bands: Status,
    /// Of each source at the edges of its band, and of all of them.
    pub edges: Status,
}

impl Default for Outcome {
    fn default() -> Self {
        Outcome::OK
    }
}

impl Outcome {
    /// Nothing is wrong.
    pub const OK: Outcome = Outcome { shifts: Status::Ok, bands: Status::Ok, edges: Status::Ok };
}

/// How the machines of a budget are brought to their poses and linearised there.
pub(super) trait Road<S: Real> {
    /// At a nominal pose, which closes the struts.
    fn start(&mut self, machine: &Machine, p: &[S], q: &[S], pose: &Pose<S>);
    /// The pose that the machine with parameters `p` takes from there; `edge`: of a band.
    fn go(&mut self, machine: &Machine, p: &[S], q: &[S], start: &Pose<S>, edge: bool) -> Pose<S>;
    /// Judges the error found.
    fn look_at(&mut self, error: &[S; SIX], edge: bool);
    /// The closures to first order at the nominal pose, or where `error` has moved it last.
    fn linearised(
        &mut self,
        machine: &Machine,
        p: &[S],
        q: &[S],
        pose: &Pose<S>,
        error: Option<&[S; SIX]>,
    ) -> &Linearisation<S>;
    /// Judges what a band does there.
    fn look_at_band(&mut self, reach: &[S; SIX], uncertainty: &[S; SIX], moved: bool);
}

/// Many samples side by side.
pub(super) struct InLanes<'a, S> {
    orders: &'a Orders,
    at: Limbs<S>,
    nominal: Linearisation<S>,
    moved: Linearisation<S>,
    inverse: OwnInverse<S>,
    /// Positive in a lane where everything since the start is proven.
    pub(super) proof: S,
}

impl<'a, S: Real> InLanes<'a, S> {
    pub(super) fn new(orders: &'a Orders) -> Self {
        InLanes {
            orders,
            at: Default::default(),
            nominal: Linearisation::default(),
            moved: Linearisation::default(),
            inverse: OwnInverse([[S::default(); SIX]; SIX]),
            proof: S::default(),
        }
    }
}

impl<S: Real> Road<S> for InLanes<'_, S> {
    #[inline(always)]
    fn start(&mut self, machine: &Machine, p: &[S], q: &[S], pose: &Pose<S>) {
        place_limbs(machine, p, q, &mut self.at);
        self.nominal.fill(machine, p, q, &self.at, pose, &self.orders.rows);
        self.proof = self.nominal.regular;
        for i in 0..machine.struts.len() {
            // A strut's squared closure has rows of twice its length.
            let per_square = S::splat(0.5) / self.at[i].length;
            for k in 0..SIX {
                self.inverse.0[k][i] = self.nominal.inverse[k][i] * per_square;
            }
        }
    }

    #[inline(always)]
    fn go(&mut self, machine: &Machine, p: &[S], q: &[S], start: &Pose<S>, _edge: bool) -> Pose<S> {
        place_limbs(machine, p, q, &mut self.at);
        let mut descent = chord(machine, &self.at, start, &self.inverse);
        if !(-descent.proof).all_below(0.0) {
            descent = descend(machine, &self.at, start, &self.orders.forward);
        }
        self.proof = self.proof.min(descent.proof);
        descent.pose
    }

    #[inline(always)]
    fn look_at(&mut self, error: &[S; SIX], _edge: bool) {
        let mut size = S::default();
        for one in error {
            size = size + one.abs();
        }
        self.proof = self.proof.min(S::splat(f64::MAX) - size);
    }

    #[inline(always)]
    fn linearised(
        &mut self,
        machine: &Machine,
        p: &[S],
        q: &[S],
        pose: &Pose<S>,
        error: Option<&[S; SIX]>,
    ) -> &Linearisation<S> {
        let Some(error) = error else { return &self.nominal };
        self.moved.fill(machine, p, q, &self.at, pose, &self.orders.rows);
        let small = turn_lanes(&mut self.moved, error);
        self.proof = self.proof.min(self.moved.regular).min(small);
        &self.moved
    }

    #[inline(always)]
    fn look_at_band(&mut self, _reach: &[S; SIX], _uncertainty: &[S; SIX], _moved: bool) {}
}

/// One sample of any machine.
#[derive(Default)]
pub(super) struct Alone {
    pub(super) outcome: Outcome,
    nominal: Option<Linearisation<f64>>,
    moved: Linearisation<f64>,
}

impl Alone {
    fn note(&mut self, edge: bool, status: Status) {
        let kept = if edge { &mut self.outcome.edges } else { &mut self.outcome.shifts };
        if *kept == Status::Ok {
            *kept = status;
        }
    }

    fn note_band(&mut self, status: Status) {
        if self.outcome.bands == Status::Ok {
            self.outcome.bands = status;
        }
    }
}

impl Road<f64> for Alone {
    fn start(&mut self, _machine: &Machine, _p: &[f64], _q: &[f64], _pose: &Pose<f64>) {}

    fn go(
        &mut self,
        machine: &Machine,
        p: &[f64],
        q: &[f64],
        start: &Pose<f64>,
        edge: bool,
    ) -> Pose<f64> {
        let limbs = limbs(machine, p, q);
        let (pose, status) = forward(&Sample { machine, p, limbs: &limbs }, q, start);
        self.note(edge, status);
        pose
    }

    fn look_at(&mut self, error: &[f64; SIX], edge: bool) {
        if !error.iter().all(|value| value.is_finite()) {
            self.note(edge, Status::NotConverged);
        }
    }

    fn linearised(
        &mut self,
        machine: &Machine,
        p: &[f64],
        q: &[f64],
        pose: &Pose<f64>,
        error: Option<&[f64; SIX]>,
    ) -> &Linearisation<f64> {
        if let Some(error) = error {
            let limbs = limbs(machine, p, q);
            self.moved.fill_scalar(&Sample { machine, p, limbs: &limbs }, q, pose);
            turn_alone(&mut self.moved, error);
            return &self.moved;
        }
        if self.nominal.is_none() {
            let limbs = limbs(machine, p, q);
            let mut linear = Linearisation::default();
            linear.fill_scalar(&Sample { machine, p, limbs: &limbs }, q, pose);
            // Also true where it is NaN.
            if !(condition(machine, p, q, pose) >= SINGULAR) {
                self.note_band(Status::Singular);
            }
            self.nominal = Some(linear);
        }
        self.nominal.get_or_insert_default()
    }

    fn look_at_band(&mut self, reach: &[f64; SIX], uncertainty: &[f64; SIX], moved: bool) {
        if !moved && !reach.iter().chain(uncertainty).all(|value| value.is_finite()) {
            self.note_band(Status::NotConverged);
        }
    }
}
