"""What strain adds to the second-order term of the compensation law, on over-constrained machines.

The platform stands where the elastic energy of the closures g is least, `J^T K g = 0` with their
Jacobian J to the platform's twist and their stiffness K. To second order there is, beside the
remainder r of the closures (`second_order.py`), which moves the platform as any residual does, the
change of J under the strain that is there to first order:

    (J^T K J)^-1 dJ^T f,   f = K dg the internal forces

A strut's row of J is its unit vector u and its moment arm x u, so that

    |du| <= delta / |v|,   |d(arm x u)| <= turn |arm| + own + |arm| delta / |v|

and of a known step (index c) and a band `dJ_c f + dJ f_c + dJ f` counts. That drives and base
joints which give way do so in another direction is left out.
"""

from __future__ import annotations

import numpy as np

from truepose.budget.percent import POSITIONS
from truepose.machine import Machine
from truepose.sources import Block
from truepose.sources._base import Floats, Indices


class Strain:
    """An over-constrained machine at the nominal poses of one block."""

    def __init__(self, machine: Machine, block: Block) -> None:
        self._machine, self._block = machine, block
        names = list(machine.parameters)
        self._offsets = np.array([names.index(f"{d.part}.offset") for d in machine.drives])
        scales = [names.index(f"{d.part}.scale") for d in machine.drives]
        self._scales = machine.nominal[scales]
        compliance, _ = machine.kernel.compliance_at(
            block.joints, block.placements, *machine.compliances(block.lengths)
        )
        linear = [at for at, name in enumerate(machine.components) if name in POSITIONS]
        angular = [at for at, name in enumerate(machine.components) if name not in POSITIONS]
        self._by_force = np.linalg.norm(compliance[:, :, linear], axis=2)
        self._by_moment = np.linalg.norm(compliance[:, :, angular], axis=2)

    def forces(self, columns: Indices, values: Floats, joints: Floats | None) -> Floats:
        """(n, n_strut) absolute internal forces, N, of deviations and a step of the joints."""
        found = np.einsum(
            "nik,nk->ni",
            self._unit_forces(columns),
            np.broadcast_to(values, (len(self._block.joints), values.shape[1])),
        )
        if joints is not None:
            # A step of a joint is one of its drive's offset, but for the scale.
            of_joints = self._unit_forces(self._offsets)
            found = found + np.einsum("nik,nk->ni", of_joints, joints * self._scales)
        return np.asarray(np.abs(found))

    def added(
        self,
        forces: tuple[Floats, Floats],
        tilts: tuple[Floats, Floats],
        levers: tuple[Floats, Floats],
    ) -> Floats:
        """(n, n_component) of the known step and the band: each a pair, (n, n_strut).

        `forces` N, `tilts` of the unit vectors, `levers` changes of the unit moments, m.
        """
        known, band = forces

        def load(changes: tuple[Floats, Floats]) -> Floats:
            each = changes[0] * band + changes[1] * (known + band)
            return np.asarray(each.sum(axis=1, keepdims=True))

        moved = self._by_force * load(tilts) + self._by_moment * load(levers)
        return np.asarray(moved)

    def _unit_forces(self, columns: Indices) -> Floats:
        """(n, n_strut, k) internal forces that unit deviations of parameters strain."""
        found, _ = self._machine.kernel.internal_forces_at(
            self._block.joints, self._block.placements, columns
        )
        return np.asarray(found)
