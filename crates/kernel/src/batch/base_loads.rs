//! Loads on parameters from forces that act on the base-side joint centres themselves: the weight of
//! carriages, and of the struts where it rests on their base.

use super::samples::{Group, Rows, Samples};
use super::threads::for_chunks;
use crate::dispatch::{Work, dispatch_seldom};
use crate::element::{ParameterGradient, Slots};
use crate::machine::Machine;
use crate::scalar::Real;

/// The work of `forces` (N, base axes, x y z of each strut in turn) per unit of each of the given
/// parameters, `sum of force . dA/dp` over the base-side joint centres A: as many numbers a sample as
/// `columns`. Poses do not matter: the base side knows joints only.
pub fn base_loads(
    machine: &Machine,
    samples: &Samples<'_>,
    forces: &Rows<'_>,
    columns: &[usize],
    out: &mut [f64],
) {
    let mut done = vec![(); samples.count];
    let width = columns.len();
    for_chunks(samples.count, (out, width), (&mut [], 0), &mut done, |first, out, _, done| {
        let size = done.len();
        dispatch_seldom(Chunk { machine, samples, forces, columns, first, size, out });
    });
}

struct Chunk<'a> {
    machine: &'a Machine,
    samples: &'a Samples<'a>,
    forces: &'a Rows<'a>,
    columns: &'a [usize],
    first: usize,
    size: usize,
    out: &'a mut [f64],
}

impl Work for Chunk<'_> {
    #[inline(always)]
    fn run<S: Real>(self) {
        let Chunk { machine, samples, forces, columns, first, size, out } = self;
        let width = columns.len();
        let count = machine.struts.len();
        let mut group = Group::<S>::new(machine);
        let mut force = vec![S::default(); 3 * count];
        let mut works = vec![ParameterGradient::<S>::default(); count];
        let mut cells = vec![S::default(); width];
        for (number, out) in out.chunks_mut((width * S::WIDTH).max(1)).enumerate() {
            let sample = first + number * S::WIDTH;
            let lanes = S::WIDTH.min(size - number * S::WIDTH);
            group.load(machine, samples, sample, lanes);
            forces.load(sample, lanes, &mut force);
            for (i, strut) in machine.struts.iter().enumerate() {
                let base = strut.carried_base(&group.p);
                let acting = [force[3 * i], force[3 * i + 1], force[3 * i + 2]];
                let work = &mut works[i];
                match strut.drive {
                    None => work.set_base(&acting),
                    Some(index) => {
                        let drive = &machine.drives[index];
                        let (nominal, joint) = (&drive.nominal, group.q[index]);
                        let parameters = &group.p[drive.first..];
                        drive.kind.base_load(nominal, parameters, joint, base, acting, work);
                    }
                }
                if let Some(carriage) = strut.carriage {
                    let (own, turn) = (&group.p[strut.first..], &group.p[carriage + 3..]);
                    work.set_carriage([own[0], own[1], own[2]], [turn[0], turn[1], turn[2]]);
                }
            }
            for (cell, &column) in cells.iter_mut().zip(columns) {
                let mut sum = S::default();
                for &(closure, slot) in &machine.dependents[column] {
                    if closure < count && Slots::is_base_side(slot) {
                        sum = sum + works[closure][slot];
                    }
                }
                *cell = sum;
            }
            S::store_rows(&cells, out, width, lanes);
        }
    }
}
