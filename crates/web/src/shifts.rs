//! What is known of a machine and what is not, as deviations of its parameters.

use crate::bundle::{Bundle, Column, Source};
use crate::condition::Condition;
use crate::dead_zones::DeadZone;
use crate::deflection::Under;
use crate::placed::{Moved, Placed};
use std::collections::{BTreeMap, BTreeSet};

impl Placed<'_> {
    /// What is known of the machine at the poses, of some of the live sources together.
    pub fn shifts(&self, condition: &Condition, sources: &[Source]) -> Moved {
        let mut terms = Vec::new();
        let mut under = Under::default();
        let mut playing = BTreeSet::new();
        for source in sources {
            terms.extend(source.at_reference.iter().map(|&term| (term, 1.0)));
            for (part, of_part) in &source.per_kelvin {
                let rise = condition.rise.get(part).copied().unwrap_or(0.0);
                if rise != 0.0 {
                    terms.extend(of_part.iter().map(|&term| (term, rise)));
                }
            }
            under.wrench |= source.under_wrench;
            under.weight |= source.under_weight;
            playing.insert(source.name.as_str());
        }
        let plays = |column: &Column| {
            column.play.as_ref().is_some_and(|play| playing.contains(play.source.as_str()))
        };
        let bundle = self.bundle;
        let played: Vec<usize> =
            (0..bundle.columns.len()).filter(|&at| plays(&bundle.columns[at])).collect();
        let mut slots = BTreeMap::new();
        let place = |parameter: usize, slots: &mut BTreeMap<usize, usize>| {
            let next = slots.len();
            *slots.entry(parameter).or_insert(next)
        };
        let at: Vec<usize> =
            terms.iter().map(|(term, _)| place(term.parameter, &mut slots)).collect();
        let deflection = self.deflection(condition, under);
        let deflected: Vec<usize> =
            deflection.columns.iter().map(|&column| place(column, &mut slots)).collect();
        let pressed: Vec<usize> =
            played.iter().map(|&of| place(bundle.columns[of].parameter, &mut slots)).collect();
        let sides = if played.is_empty() { Vec::new() } else { self.sides(condition) };
        let width = slots.len();
        let mut values = vec![0.0; width * self.count];
        for pose in 0..self.count {
            let (row, lengths) = (&mut values[pose * width..][..width], self.lengths_at(pose));
            for ((term, factor), &at) in terms.iter().zip(&at) {
                row[at] += factor * term.law.at(lengths);
            }
            for (&at, value) in deflected.iter().zip(deflection.row(pose)) {
                row[at] += value;
            }
            for (&of, &at) in played.iter().zip(&pressed) {
                let side = sides[pose * bundle.columns.len() + of];
                row[at] += side * self.reach(condition, &bundle.columns[of], pose);
            }
        }
        let mut columns = vec![0; width];
        for (parameter, at) in slots {
            columns[at] = parameter;
        }
        Moved { columns, values }
    }

    /// Half widths of the columns, a row a pose: 0 of a play that is taken up.
    pub fn half_widths(&self, condition: &Condition) -> Vec<f64> {
        let columns = &self.bundle.columns;
        let mut half = self.sides(condition);
        for (pose, row) in half.chunks_mut(columns.len().max(1)).enumerate() {
            for (cell, column) in row.iter_mut().zip(columns) {
                *cell = if *cell == 0.0 { self.reach(condition, column, pose) } else { 0.0 };
            }
        }
        half
    }

    /// How far a column's unknown takes its parameter where it is 1, m or rad.
    fn reach(&self, condition: &Condition, column: &Column, pose: usize) -> f64 {
        condition.half_width[column.variable] * column.half.at(self.lengths_at(pose))
    }

    /// To which side of its play each column is pressed, -1 or 1, a row a pose; 0 where it has none, or where
    /// it is open.
    pub fn sides(&self, condition: &Condition) -> Vec<f64> {
        let Bundle { machine, columns, weight, .. } = self.bundle;
        let mut sides = vec![0.0; self.count * columns.len()];
        let zoned =
            |(at, column): (usize, &Column)| column.play.as_ref().map(|play| (at, play.clone()));
        let zones: Vec<(usize, DeadZone)> = columns.iter().enumerate().filter_map(zoned).collect();
        if zones.is_empty() {
            return sides;
        }
        let parameters: Vec<usize> = zones.iter().map(|&(at, _)| columns[at].parameter).collect();
        let loads = self.all_loads(condition, &parameters);
        let on_bases: f64 =
            weight.iter().flat_map(|weight| weight.base_forces()).map(f64::abs).sum();
        for pose in 0..self.count {
            let centres = self.centres_at(pose);
            let own = weight.as_ref().map_or([0.0; 6], |weight| {
                weight.wrench(machine, self.joints_at(pose), &self.pose(pose), &centres)
            });
            let size = |k: usize| if k < 3 { 1.0 } else { machine.characteristic_length };
            let acting = |k: usize| (condition.wrench[k].abs() + own[k].abs()) / size(k);
            let all = (0..6).map(acting).sum::<f64>() + on_bases;
            for ((at, zone), &load) in zones.iter().zip(&loads[pose * zones.len()..]) {
                let over = match (weight, zone.end) {
                    (Some(weight), Some((strut, end))) => {
                        weight.over_tension(strut, centres[strut])[end]
                    }
                    _ => 0.0,
                };
                let load = load + over;
                if load.abs() > zone.threshold.max(zone.share * all) {
                    sides[pose * columns.len() + at] = load.signum();
                }
            }
        }
        sides
    }
}
