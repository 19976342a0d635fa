//! From the description of a limb to its chain: which closures it stands for, and their parameters.

use super::chain::{CHAIN_CLOSURES, Chain, Ends, Side};
use super::description::error;
use super::{ChainDescription, Machine, MachineError};
use crate::spatial::{Vector, norm, scale};

impl Machine {
    /// Adds a limb whose strut and guides are there.
    pub(super) fn add_chain(&mut self, given: &ChainDescription) -> Result<(), MachineError> {
        let place = format!("limb.{}", given.name);
        if self.chains.iter().any(|other| other.name == given.name) {
            let message = format!("two limbs are named {:?}", given.name);
            return error("duplicate-name", place, message);
        }
        let (mut closures, mut parameters) = (Vec::new(), Vec::new());
        let mut ends = None;
        if let Some(name) = &given.strut {
            let Some(index) = self.struts.iter().position(|strut| &strut.name == name) else {
                return error("unknown-part", place, format!("there is no strut {name:?}"));
            };
            ends = Some(Ends::Strut(index));
            closures.push(index);
            parameters.push(self.struts[index].length_parameter);
        }
        for name in &given.guides {
            let Some(index) = self.guides.iter().position(|guide| &guide.name == name) else {
                return error("unknown-part", place, format!("there is no guide {name:?}"));
            };
            ends = ends.or(Some(Ends::Guide(index)));
            for (number, &(guide, _)) in self.guide_closures.iter().enumerate() {
                if guide == index {
                    closures.push(self.struts.len() + number);
                    parameters.extend(self.guide_offsets[number]);
                }
            }
        }
        let Some(ends) = ends else {
            return error("no-closure", place, "it contains neither strut nor guide".into());
        };
        if closures.len() > CHAIN_CLOSURES {
            let message =
                format!("{} closures; at most {CHAIN_CLOSURES} can be had", closures.len());
            return error("closure-count", place, message);
        }
        let taken = |closure: &usize| {
            self.chains.iter().any(|other: &Chain| other.closures.contains(closure))
        };
        if closures.iter().any(taken) || parameters.len() != closures.len() {
            let message = "a strut or guide of it belongs to another limb too".into();
            return error("two-limbs", place, message);
        }
        self.chains.push(Chain {
            name: given.name.clone(),
            ends,
            closures,
            parameters,
            side: unit_side(given.side),
            parts: given.parts.clone(),
            mass: given.mass,
            whole_length: given.whole_length,
            carriage_mass: given.carriage_mass,
        });
        Ok(())
    }
}

fn unit_side(side: Side) -> Side {
    let unit = |v: Vector<f64>| scale(v, 1.0 / norm(v));
    match side {
        Side::Frame(v) => Side::Frame(unit(v)),
        Side::Platform(v) => Side::Platform(unit(v)),
    }
}
