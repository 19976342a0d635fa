//! Over a box of commanded poses: how far the actual platform is from the nominal command.
//!
//! Everything is an enclosure over all poses of the box and all machines, proved to exist first.

use super::closures::{Derivatives, Six, add_multiple, derivatives};
use super::command::Command;
use super::region::{Affine, Region};
use super::root::{Inverse, Varying, prove};
use super::{Deviating, Unproven, point};
use crate::kinematics::{Limb, tool_point};
use crate::linear::SIX;
use crate::machine::Strut;
use crate::scalar::{Interval, Scalar};

/// Known deviations of the parameters, and how far the platform then goes.
pub struct Over {
    pub shifts: Vec<(usize, Interval)>,
    pub known: Six,
    pub slopes: Vec<Six>,
    /// Displacements of all machines in the box, and of the nominal one.
    pub whole: Six,
    /// Where there is no other root of any of them.
    pub unique_in: Six,
    /// All parameters between nominal and actual.
    pub between: Vec<Interval>,
    /// Of the closures to the displacement, over all that.
    pub inverse: Inverse,
}

impl Region<'_> {
    /// How far the actual platform is from the commanded one, over a box of poses.
    pub fn over(&self, command: &Command) -> Result<Over, Unproven> {
        let Command { joints: q, at, .. } = command;
        let machine = self.machine;
        let nominal: Vec<Interval> = machine.nominal.iter().map(|&value| point(value)).collect();
        let still = [point(0.0); SIX];
        let lengths = self.lengths(&nominal, q);
        let mut shifts: Vec<(usize, Interval)> =
            self.shift.iter().map(|shift| (shift.parameter, shift.at(&lengths))).collect();
        if !self.yielding.is_empty() {
            let loaded = derivatives(machine, &nominal, q, at, &still);
            shifts.extend(self.deflections(&loaded, &lengths)?);
        }
        // From the nominal parameters to the actual ones, and all between.
        let mut p = nominal.clone();
        for &(index, shift) in &shifts {
            p[index] = p[index] + shift;
        }
        let Deviating { parameters, swing, .. } = self.deviating;
        for (&parameter, &swing) in parameters.iter().zip(swing) {
            p[parameter] = p[parameter] + Interval::symmetric(swing);
        }
        for (value, nominal) in p.iter_mut().zip(&nominal) {
            *value = value.hull(*nominal);
        }
        let moves = |over: &Derivatives| {
            let mut known = [point(0.0); SIX];
            for &(index, shift) in &shifts {
                add_multiple(&mut known, &over.closures.to_parameter(machine, index), shift);
            }
            let gradient = |parameter| over.closures.to_parameter(machine, parameter);
            (known, self.deviating.columns(|_| true, gradient))
        };
        let spread = derivatives(machine, &p, q, at, &still);
        let (known, columns) = moves(&spread);
        let varying: Vec<Varying> =
            columns.into_iter().map(|column| (column, Interval::symmetric(1.0))).collect();
        let first = &spread.to_displacement;
        let root = prove(&[0.0; SIX], &known, &varying, first, |tried| {
            derivatives(machine, &p, q, at, tried).to_displacement
        })?;
        let whole = root.enclosure.map(|one| one.hull(point(0.0)));
        let over = derivatives(machine, &p, q, at, &whole);
        let inverse = Inverse::of(&over.to_displacement).ok_or(Unproven::TooWide)?;
        let (known, columns) = moves(&over);
        let minus = |six: Six| six.map(|value| -value);
        Ok(Over {
            known: minus(inverse.times(&known)),
            slopes: columns.iter().map(|column| minus(inverse.times(column))).collect(),
            shifts,
            whole,
            unique_in: root.unique_in,
            between: p,
            inverse,
        })
    }

    /// Present lengths of the struts.
    pub fn lengths<S: Scalar>(&self, p: &[S], q: &[S]) -> Vec<S> {
        let tool = tool_point(self.machine, p);
        let length = |strut: &Strut| Limb::placed(self.machine, strut, p, q, tool).length;
        self.machine.struts.iter().map(length).collect()
    }

    /// Deflections under the wrench: compliance times the load, by virtual work.
    fn deflections(
        &self,
        at: &Derivatives,
        lengths: &[Interval],
    ) -> Result<Vec<(usize, Interval)>, Unproven> {
        let machine = self.machine;
        let inverse = Inverse::of(&at.to_displacement).ok_or(Unproven::TooWide)?;
        let forces = self.forces(&inverse);
        let deflection = |yielding: &Affine| {
            let gradient = at.closures.to_parameter(machine, yielding.parameter);
            let mut load = point(0.0);
            for k in 0..machine.closure_count() {
                load = load + forces[k] * gradient[k];
            }
            (yielding.parameter, yielding.at(lengths) * load)
        };
        Ok(self.yielding.iter().map(deflection).collect())
    }

    /// The wrench on the platform as rows of the closures to the displacement have it, N.
    pub fn scaled_wrench(&self) -> Six {
        let mut wrench = self.wrench.map(point);
        for value in &mut wrench[3..] {
            *value = *value / point(self.machine.characteristic_length);
        }
        wrench
    }

    /// Forces of the closures under the wrench, N.
    pub fn forces(&self, inverse: &Inverse) -> Six {
        inverse.row_times(&self.scaled_wrench()).map(|force| -force)
    }
}
