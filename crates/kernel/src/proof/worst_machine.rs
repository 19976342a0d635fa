//! Over a box of commanded poses: how far machines go along a direction, from how far they go in its middle.
//!
//! Where the slope of a variable along the direction has a certain sign, for all machines and poses of the box, no
//! machine goes farther than with that variable at its end. With the others at 0, one machine is left. Its
//! displacement z is solved for at the middle; away from it z' = -J^-1 (what the nominal command's motion leaves
//! open of its closures), since the nominal platform moves with its joints so that its own stay closed. By how
//! much their rows differ from the nominal ones is taken along the way from the nominal machine to this one.
//! z(x) - z(m) is the sum of the means of the rates over the way, times the ways (mean value theorem, the
//! linear part of a rate exactly). Of each variable at 0 it differs by at most the rate of its slope, of any
//! machine, times the way. And at the middle no machine goes farther than is known of all of them there.

use super::at_pose::{Extent, Part, along, lies_in};
use super::closures::{Placed, Six, add_multiple, derivatives, turned};
use super::command::Command;
use super::first_order::{FirstOrder, formed_along};
use super::forms::{Equations, Forms};
use super::pose_box::Over;
use super::rates::{Rates, ShiftRates};
use super::region::Region;
use super::{Unproven, point};
use crate::linear::SIX;
use crate::scalar::{AffineForm, Dual, Interval};
use crate::spatial::rotate;
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

/// How much farther a machine goes; none where that is not enclosed.
type Found<const M: usize> = Option<Rc<Six<AffineForm<M>>>>;

/// What is known over a box of poses, and of the machines that were asked for.
pub struct WorstMachines<'a, const M: usize> {
    region: &'a Region<'a>,
    forms: &'a Forms<M>,
    over: &'a Over,
    first: &'a FirstOrder<M>,
    /// The machines at the middle of the box.
    spot: Part<'a>,
    /// How fast displacements change per unit of each commanded freedom, of any machine.
    changes: Vec<Six>,
    /// How fast the known deviations do.
    shift_rates: Vec<ShiftRates>,
    /// How fast slopes do, of any machine.
    rates: Vec<Rates>,
    /// How far each commanded freedom goes from the middle.
    halves: &'a [Interval],
    /// By the ends at which their variables are.
    found: RefCell<HashMap<Vec<i8>, Found<M>>>,
}

/// What is known over a box of poses, and the machines in its middle.
type Known<'a, const M: usize> =
    (&'a Extent<'a>, &'a Command, &'a Forms<M>, &'a Over, &'a FirstOrder<M>);

impl Region<'_> {
    /// The machines over a box, whose commanded freedoms go so far from its middle.
    pub fn worst_machines<'a, const M: usize>(
        &'a self,
        (at_middle, command, forms, over, first): Known<'a, M>,
        halves: &'a [Interval],
    ) -> Result<WorstMachines<'a, M>, Unproven> {
        let spot = at_middle.whole().map_err(|not| not.why)?;
        let shift_rates = (0..command.rates.len())
            .map(|freedom| self.shift_rates(command, freedom))
            .collect::<Result<Vec<_>, _>>()?;
        let changes = self.changes(command, over, &shift_rates);
        let rates = self.rates(forms, over, &shift_rates, &changes)?;
        let found = RefCell::default();
        Ok(WorstMachines {
            region: self,
            forms,
            over,
            first,
            spot,
            changes,
            shift_rates,
            rates,
            halves,
            found,
        })
    }
}

impl<const M: usize> WorstMachines<'_, M> {
    /// No machine goes farther along a direction; infinite where the worst cannot be enclosed.
    pub fn reach(&self, direction: &[f64; SIX]) -> f64 {
        let ends = self.first.certain_ends(direction);
        let known = self.found.borrow().get(&ends).cloned();
        let farther = known.unwrap_or_else(|| {
            let farther = self.farther(&ends).map(Rc::new);
            self.found.borrow_mut().insert(ends.clone(), farther.clone());
            farther
        });
        let Some(farther) = farther else { return f64::INFINITY };
        let mut sum = point(self.spot.most(direction)) + formed_along(direction, &farther).range;
        for (rate, &half) in self.rates.iter().zip(self.halves) {
            for (slope, &end) in rate.slopes.iter().zip(&ends) {
                if end == 0 {
                    sum = sum + point(along(direction, slope).magnitude()) * half;
                }
            }
        }
        sum.upper
    }

    /// Over the box: by how much farther than in its middle machines go whose variables are held at ends.
    fn farther(&self, ends: &[i8]) -> Option<Six<AffineForm<M>>> {
        let Region { machine, deviating, .. } = *self.region;
        let form = AffineForm::<M>::from_interval;
        let variables: Vec<Interval> = ends.iter().map(|&end| point(f64::from(end))).collect();
        let middle = self.spot.root(&variables)?;
        if !lies_in(&middle, &self.over.unique_in) {
            return None;
        }
        // From the nominal machine to this one.
        let mut way = vec![form(point(0.0)); machine.nominal.len()];
        for &(index, shift) in &self.first.shifts {
            way[index] = way[index] + shift;
        }
        let columns = deviating.parameters.iter().zip(&deviating.variables).zip(&deviating.swing);
        for ((&parameter, &variable), &swing) in columns {
            way[parameter] = way[parameter] + form(variables[variable].scaled(swing));
        }
        let on_the_way = |from: Interval, way: AffineForm<M>| Dual {
            value: form(from.hull(from + way.range)),
            parts: [way],
        };
        let p: Vec<Dual<AffineForm<M>, 1>> = machine
            .nominal
            .iter()
            .zip(&way)
            .map(|(&nominal, &way)| on_the_way(point(nominal), way))
            .collect();
        let Forms { joints, at, rates, .. } = self.forms;
        let q: Vec<Dual<AffineForm<M>, 1>> = joints.iter().map(|&q| Dual::constant(q)).collect();
        let place = Placed {
            position: at.position.map(Dual::constant),
            rotation: at.rotation.map(|row| row.map(Dual::constant)),
        };
        let actual: Vec<AffineForm<M>> = machine
            .nominal
            .iter()
            .zip(&way)
            .map(|(&nominal, &way)| form(point(nominal)) + way)
            .collect();
        let length = form(point(machine.characteristic_length));
        let mut nearly = middle.map(form);
        for (j, one) in nearly.iter_mut().enumerate() {
            let mut own = [point(0.0); M];
            let speeds = self.rates.iter().zip(&self.changes).zip(self.halves);
            for (own, ((rate, change), half)) in own.iter_mut().zip(speeds) {
                let sum = rate.slopes.iter().zip(&variables);
                let sum = sum.fold(rate.known[j], |sum, (slope, &end)| sum + slope[j] * end);
                *own = sum.intersection(change[j]).unwrap_or(sum).scaled(half.magnitude());
            }
            *one = AffineForm::of_rates(middle[j], &own, self.over.whole[j]);
        }
        let away = nearly.map(|one| on_the_way(point(0.0), one));
        let there = derivatives(machine, &p, &q, &place, &away);
        let equations =
            Equations::of(&derivatives(machine, &actual, joints, at, &nearly).to_displacement)?;
        let mut turning = turned([3, 4, 5].map(|k| nearly[k] / length));
        for (k, row) in turning.iter_mut().enumerate() {
            row[k] = row[k] - form(point(1.0));
        }
        let mut result = [form(point(0.0)); SIX];
        for (k, (twist, speeds)) in rates.iter().enumerate() {
            // What turns with the nominal platform turns the arms a little differently.
            let more = rotate(&turning, [twist[3], twist[4], twist[5]]);
            let mut open = [form(point(0.0)); SIX];
            for (i, open) in open.iter_mut().enumerate().take(machine.closure_count()) {
                let to_twist = &there.closures.to_twist[i];
                for j in 0..SIX {
                    *open = *open + to_twist[j].parts[0] * twist[j];
                }
                for j in 0..3 {
                    *open = *open + to_twist[3 + j].value * more[j];
                }
                for (joint, &speed) in speeds.iter().enumerate() {
                    if self.region.drives(joint, i) {
                        *open = *open + there.closures.to_joint[i].parts[0] * speed;
                    }
                }
            }
            for &(index, rate) in &self.shift_rates[k] {
                let gradient = there.closures.to_parameter(machine, index).map(|one| one.value);
                add_multiple(&mut open, &gradient, form(rate));
            }
            let step = AffineForm::variable(k).scaled(self.halves[k].magnitude());
            for (sum, rate) in result.iter_mut().zip(equations.solve(&open)) {
                *sum = *sum - rate.mean_from_middle() * step;
            }
        }
        Some(result)
    }
}
