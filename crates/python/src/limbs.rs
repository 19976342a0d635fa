//! How limbs give way that say what they are made of.

use crate::arrays::{Array, Input};
use crate::machine::Machine;
use crate::samples::in_blocks_into;
use pyo3::prelude::*;
use truepose_kernel::machine::{CHAIN_CLOSURES, Chain};
use truepose_kernel::spatial::{Pose, Vector, add, rotation_matrix};
use truepose_kernel::statics::PlacedChain;

/// A limb at one pose.
struct At<'a> {
    sample: usize,
    number: usize,
    chain: &'a Chain,
    placed: PlacedChain<'a, f64>,
    tool: Vector<f64>,
}

impl Machine {
    /// Fills a row a pose with what is asked of every limb there, one after another.
    fn of_limbs<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        further: &[usize],
        write: impl Fn(&At<'_>, &mut dyn Iterator<Item = &mut f64>) + Sync,
    ) -> PyResult<Array<'py>> {
        let machine = &self.inner;
        let posed = self.posed(joints, placements)?;
        let samples = posed.of_placements()?;
        let width = further.iter().product::<usize>().max(1);
        in_blocks_into(py, &[samples.count], further, |first, _, out| {
            for (sample, row) in (first..).zip(out.chunks_exact_mut(width)) {
                let pose = Pose::from_row(samples.poses.row(sample));
                let rotation = rotation_matrix(pose.rotation);
                let mut cells = row.iter_mut();
                for (number, chain) in machine.chains.iter().enumerate() {
                    let (joints, at) = (samples.joints.row(sample), (&rotation, pose.position));
                    let placed = PlacedChain::new(machine, chain, &machine.nominal, joints, at);
                    let tool = pose.position;
                    write(&At { sample, number, chain, placed, tool }, &mut cells);
                }
            }
        })
    }

    fn limb_closures(&self) -> usize {
        self.inner.chains.iter().map(|chain| chain.closures.len()).sum()
    }
}

/// The first of what was found for each closure of a limb.
fn give(chain: &Chain, found: [f64; CHAIN_CLOSURES], cells: &mut dyn Iterator<Item = &mut f64>) {
    for (value, cell) in found.into_iter().zip(cells).take(chain.closures.len()) {
        *cell = value;
    }
}

#[pymethods]
impl Machine {
    /// The parameters that the limbs give way by, limb by limb.
    #[getter]
    fn limb_parameters(&self) -> Vec<usize> {
        self.inner.chains.iter().flat_map(|chain| chain.parameters.clone()).collect()
    }

    /// The two parameters of each column of `limb_compliances_at`.
    #[getter]
    fn limb_pairs(&self) -> Vec<(usize, usize)> {
        let pairs = |chain: &Chain| {
            let pair = |(i, k): (usize, usize)| (chain.parameters[i], chain.parameters[k]);
            chain.places().map(pair).collect::<Vec<_>>()
        };
        self.inner.chains.iter().flat_map(pairs).collect()
    }

    /// (n, n_pair) m/N: the upper triangle of each limb's matrix, row by row.
    fn limb_compliances_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py>> {
        let chains = &self.inner.chains;
        let width = chains.iter().map(|chain| chain.places().count()).sum();
        self.of_limbs(py, joints, placements, &[width], |at, cells| {
            let matrix = at.placed.compliance();
            for ((i, k), cell) in at.chain.places().zip(cells) {
                *cell = matrix[i][k];
            }
        })
    }

    /// (n, n_limb, 2, 3) m: the base end and the platform end of each limb, base axes.
    fn limb_ends_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py>> {
        let width = [self.inner.chains.len(), 2, 3];
        self.of_limbs(py, joints, placements, &width, |at, cells| {
            let ends = at.placed.ends().into_iter().flat_map(|end| add(end, at.tool));
            for (value, cell) in ends.zip(cells) {
                *cell = value;
            }
        })
    }

    /// (n, n_closure of limbs, 6) force and moment about the tool point of a unit of each, base axes.
    fn limb_wrenches_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py>> {
        let width = [self.limb_closures(), 6];
        self.of_limbs(py, joints, placements, &width, |at, cells| {
            let closures = 0..at.chain.closures.len();
            let wrenches = closures.flat_map(|closure| at.placed.wrench(closure)).flatten();
            for (value, cell) in wrenches.zip(cells) {
                *cell = value;
            }
        })
    }

    /// (n, n_closure of limbs) m by which they open under the limbs' own weight, of a kilogram `weight` (3,).
    fn limb_sag_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        weight: [f64; 3],
    ) -> PyResult<Array<'py>> {
        self.of_limbs(py, joints, placements, &[self.limb_closures()], |at, cells| {
            give(at.chain, at.placed.sag(weight), cells);
        })
    }

    /// (n, n_closure of limbs) m by which they open where limbs are warmer on one side: `gradients`
    /// (n or 1, 3 n_limb), K/m, limb axes.
    fn limb_bend_at<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'py, PyAny>,
        placements: &Bound<'py, PyAny>,
        gradients: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py>> {
        let gradients = Input::new(gradients, &[3 * self.inner.chains.len()], "gradients")?;
        let rows = gradients.rows(self.posed(joints, placements)?.of_placements()?.count)?;
        self.of_limbs(py, joints, placements, &[self.limb_closures()], |at, cells| {
            let given = &rows.row(at.sample)[3 * at.number..];
            give(at.chain, at.placed.bend([given[0], given[1], given[2]]), cells);
        })
    }
}
