//! What gives way: loads on parameters, and how far they yield to them.

use crate::bundle::Bundle;
use crate::condition::Condition;
use crate::placed::{Moved, Placed};
use std::collections::BTreeMap;
use truepose_kernel::Status;
use truepose_kernel::batch::{self, Rows};
use truepose_kernel::spatial::rotation_matrix;
use truepose_kernel::statics::PlacedChain;

/// What is given way under.
#[derive(Clone, Copy, Default)]
pub struct Under {
    /// The wrench on the tool.
    pub wrench: bool,
    /// The machine's own weight and inertia.
    pub weight: bool,
}

impl Placed<'_> {
    /// Loads on parameters under a wrench on the tool, a row a pose; and what became of each.
    pub fn loads(&self, wrench: Rows<'_>, columns: &[usize]) -> (Vec<f64>, Vec<Status>) {
        let machine = &self.bundle.machine;
        let mut loads = vec![0.0; self.count * columns.len()];
        let mut status = vec![Status::Ok; self.count];
        if !columns.is_empty() {
            let quantity = batch::Loads::new(machine, columns, wrench);
            batch::first_order(machine, &self.samples(), &quantity, &mut loads, &mut status);
        }
        (loads, status)
    }

    /// The same under all that acts.
    pub fn all_loads(&self, condition: &Condition, columns: &[usize]) -> Vec<f64> {
        self.loads_under(condition, Under { wrench: true, weight: true }, columns)
    }

    fn loads_under(&self, condition: &Condition, under: Under, columns: &[usize]) -> Vec<f64> {
        let machine = &self.bundle.machine;
        let tool = if under.wrench { condition.wrench } else { [0.0; 6] };
        let Some(weight) = self.bundle.weight.as_ref().filter(|_| under.weight) else {
            return self.loads(Rows::shared(&tool), columns).0;
        };
        let own = (0..self.count).flat_map(|pose| {
            let centres = self.centres_at(pose);
            weight.wrench(machine, self.joints_at(pose), &self.pose(pose), &centres)
        });
        let wrenches: Vec<f64> =
            own.zip(tool.iter().cycle()).map(|(own, tool)| own + tool).collect();
        let mut loads = self.loads(Rows::each(&wrenches, 6), columns).0;
        let forces = weight.base_forces();
        if forces.iter().any(|&force| force != 0.0) {
            let mut at_bases = vec![0.0; loads.len()];
            let (samples, forces) = (self.samples(), Rows::shared(&forces));
            batch::base_loads(machine, &samples, &forces, columns, &mut at_bases);
            loads.iter_mut().zip(at_bases).for_each(|(load, own)| *load += own);
        }
        loads
    }

    /// How far parameters give way: each under its own load and others', and under their own weight.
    pub fn deflection(&self, condition: &Condition, under: Under) -> Moved {
        let Bundle { machine, compliance, weight, .. } = self.bundle;
        let pulled = under.wrench && condition.wrench.iter().any(|&force| force != 0.0);
        let weighs = weight.as_ref().filter(|_| under.weight);
        if !pulled && weighs.is_none() {
            return Moved::default();
        }
        let scale = condition.compliance;
        let mut slots = BTreeMap::new();
        let mut place = |parameter: usize| {
            let next = slots.len();
            *slots.entry(parameter).or_insert(next)
        };
        let own: Vec<usize> = compliance.own.iter().map(|term| place(term.parameter)).collect();
        let shared: Vec<(usize, usize)> =
            compliance.shared.iter().map(|&(one, other, _)| (place(one), place(other))).collect();
        let chains = if compliance.limbs { machine.chains.as_slice() } else { &[] };
        let limbs: Vec<Vec<usize>> = chains
            .iter()
            .map(|chain| chain.parameters.iter().map(|&parameter| place(parameter)).collect())
            .collect();
        let stretched: Vec<usize> = match weighs {
            Some(_) => machine.struts.iter().map(|strut| place(strut.length_parameter)).collect(),
            None => Vec::new(),
        };
        let mut columns = vec![0; slots.len()];
        for (&parameter, &at) in &slots {
            columns[at] = parameter;
        }
        let loads = self.loads_under(condition, under, &columns);
        let width = columns.len();
        let mut values = vec![0.0; loads.len()];
        for pose in 0..self.count {
            let (loads, lengths) = (&loads[pose * width..][..width], self.lengths_at(pose));
            let row = &mut values[pose * width..][..width];
            for (term, &at) in compliance.own.iter().zip(&own) {
                row[at] += scale * term.law.at(lengths) * loads[at];
            }
            let mut give = |one: usize, other: usize, value: f64| {
                row[one] += scale * value * loads[other];
                if one != other {
                    row[other] += scale * value * loads[one];
                }
            };
            for (&(one, other), &(_, _, value)) in shared.iter().zip(&compliance.shared) {
                give(one, other, value);
            }
            let placement = self.pose(pose);
            let rotation = rotation_matrix(placement.rotation);
            let placed: Vec<PlacedChain<'_, f64>> = chains
                .iter()
                .map(|chain| {
                    let (joints, at) = (self.joints_at(pose), (&rotation, placement.position));
                    PlacedChain::new(machine, chain, &machine.nominal, joints, at)
                })
                .collect();
            for ((chain, limb), slots) in chains.iter().zip(&placed).zip(&limbs) {
                let matrix = limb.compliance();
                for (i, k) in chain.places() {
                    give(slots[i], slots[k], matrix[i][k]);
                }
            }
            let Some(weight) = weighs else { continue };
            let centres = self.centres_at(pose);
            for (strut, (&at, centres)) in stretched.iter().zip(centres).enumerate() {
                row[at] += scale * weight.uneven_stretch(strut, centres);
            }
            for (limb, slots) in placed.iter().zip(&limbs).filter(|_| weight.sags) {
                for (&at, sag) in slots.iter().zip(limb.sag(weight.per_kilogram())) {
                    row[at] += scale * sag;
                }
            }
        }
        Moved { columns, values }
    }
}
