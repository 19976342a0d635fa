"""What the guides carry over a run: they give way nowhere in the results, which has to be said."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.language import marked, say
from truepose.machine import Guide, Machine
from truepose.sources import PoseBlock
from truepose.sources._play import NO_LOAD, all_that_acts

CODE = "guide-taken-rigid"


class GuideLoads:
    """The largest load on each guide over poses: a force, N, or a universal guide's moment, N m."""

    def __init__(self, machine: Machine) -> None:
        first = len(machine.struts)
        owners = [name.partition(".")[0] for name in machine.closures[first:]]
        of_limbs = {name for limb in machine.limbs for name in limb.guides}
        self._guides = tuple(guide for guide in machine.guides if guide.name not in of_limbs)
        self._closures = [
            [first + at for at, owner in enumerate(owners) if owner == guide.name]
            for guide in self._guides
        ]
        # A universal guide's closure is a length: what turns it, times the machine's size.
        self._lever = [
            machine.characteristic_length if _is_turned(guide) else 1.0 for guide in self._guides
        ]
        self._highest = np.zeros(len(self._guides))
        self._acting = 0.0

    def add(self, block: PoseBlock, usable: Flags) -> None:
        """The poses of a block where `usable` (n,)."""
        if not (self._guides and usable.any()):
            return
        known, unknown = block.forces, _of_any_direction(block)
        for at, closures in enumerate(self._closures):
            load = np.linalg.norm(known[:, closures], axis=1)
            if unknown is not None:
                # The largest over all directions of a force: the matrix's largest singular value.
                load = load + np.linalg.norm(unknown[:, closures], 2, axis=(1, 2))
            highest = float(load[usable].max()) * self._lever[at]
            self._highest[at] = max(self._highest[at], highest)
        self._acting = max(self._acting, float(all_that_acts(block).max()))

    def join(self, later: GuideLoads) -> None:
        """Those of other poses of the same machine."""
        np.maximum(self._highest, later._highest, out=self._highest)
        self._acting = max(self._acting, later._acting)

    def warnings(self) -> list[dict[str, str]]:
        """One warning, its code and sentence, where a guide carries anything; else none."""
        loaded = [
            say(
                "{guide} carries up to {load}",
                guide=guide.name,
                load=marked(f"{load:.4g} {'N m' if _is_turned(guide) else 'N'}"),
            )
            for guide, load, lever in zip(self._guides, self._highest, self._lever, strict=True)
            if load > NO_LOAD * self._acting * lever
        ]
        if not loaded:
            return []
        sentence = say(
            "guides are taken as rigid: {loads}; the bending of the limbs that they stand for is "
            "in no result",
            loads=", ".join(loaded),
        )
        return [{"code": CODE, "sentence": sentence}]


def _is_turned(guide: Guide) -> bool:
    """Whether what the guide carries is a moment."""
    return guide.kind == "universal"


def _of_any_direction(block: PoseBlock) -> Floats | None:
    """(n, n_closure, n_direction) N of every closure under the force of unknown direction."""
    envelope = block.condition.envelope
    if envelope is None:
        return None
    poses = block.requested[block.indices]
    kernel = block.machine.kernel
    forces = [
        kernel.forces(poses, wrench[np.newaxis], status=True)[0] for wrench in envelope.wrenches
    ]
    return np.stack(forces, axis=2)


__all__ = ["CODE", "GuideLoads"]
