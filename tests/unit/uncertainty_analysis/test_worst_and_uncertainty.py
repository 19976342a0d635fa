"""Groups: the worst case against every corner of the box, the uncertainty against sampling."""

from __future__ import annotations

from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np

from truepose.error_budget import propagation, worst
from truepose.sources import OWN_GROUP, UNIFORM, Deviation, normal

RANDOM = np.random.default_rng(20051)
SENSITIVITY = RANDOM.normal(size=(5, 3, 8))
POSES = np.arange(5.0)[:, np.newaxis]  # the number of each, for the kernel to know it by
BLOCK: Any = SimpleNamespace(joints=POSES, placements=POSES)


class Kernel:
    """Knows its sensitivities, and nothing else."""

    def sensitivity_at(
        self, joints: np.ndarray, placements: np.ndarray, columns: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        found = SENSITIVITY[joints[:, 0].astype(int)]
        return found[:, :, columns], np.zeros(len(joints), np.uint8)


MACHINE: Any = SimpleNamespace(kernel=Kernel())


def grouped() -> Deviation:
    """Seven columns, two of them of one parameter, in two groups and three by themselves."""
    return Deviation.of(
        [0, 1, 2, 3, 4, 4, 6],
        half=RANDOM.uniform(0.1, 1.0, size=(5, 7)) * [1, 1, 1, 1, 1, 1, 0],
        groups=[3, OWN_GROUP, 3, 0, OWN_GROUP, 0, OWN_GROUP],
        sign=RANDOM.choice([-1.0, 1.0], size=(5, 7)),
        distribution=(UNIFORM, normal(2.0), UNIFORM, normal(3.0), UNIFORM, normal(3.0), UNIFORM),
    )


def test_some_poses_of_a_block_have_the_effects_that_they_have_in_the_whole() -> None:
    deviation = grouped()
    whole, sigmas, _ = worst.variable_effects(MACHINE, BLOCK, deviation)
    some, of_some, _ = worst.variable_effects(MACHINE, BLOCK, deviation, slice(1, 4))
    assert np.array_equal(some, whole[1:4])
    assert np.array_equal(of_some, sigmas)


def test_worst_is_the_most_over_all_corners_of_the_variables() -> None:
    deviation = grouped()
    effects, _, _ = worst.variable_effects(MACHINE, BLOCK, deviation)
    assert effects.shape == (5, 3, 4)  # groups 0 and 3, columns 1 and 4; column 6 has no band
    down, up = deviation.domain.reach(effects)
    assert np.array_equal(down, up)
    highest = np.zeros((5, 3))
    signed = np.where(
        deviation.groups == OWN_GROUP, deviation.half, deviation.sign * deviation.half
    )
    for corner in product((-1.0, 1.0), repeat=4):
        by_group = dict(zip((3, 0), corner[:2], strict=True))
        own = iter(corner[2:])
        t = [
            by_group[g] if g != OWN_GROUP else (next(own) if k != 6 else 0.0)
            for k, g in enumerate(deviation.groups.tolist())
        ]
        moved = np.einsum("nck,nk->nc", SENSITIVITY[:, :, deviation.parameters], signed * t)
        highest = np.maximum(highest, np.abs(moved))
    assert np.allclose(up, highest, rtol=1e-13)
    error = RANDOM.normal(size=(5, 3))
    assert np.allclose(worst.worst(error, (down, up)), np.abs(error) + highest, rtol=1e-13)


def test_a_group_that_cancels_does_no_harm() -> None:
    deviation = Deviation.of([2, 2], half=0.3, groups=0, sign=[1.0, -1.0])
    effects, sigmas, _ = worst.variable_effects(MACHINE, BLOCK, deviation)
    assert np.abs(deviation.domain.support(effects)).max() < 1e-16
    assert np.abs(propagation.standard_uncertainty(effects, sigmas)).max() < 1e-16


def test_uncertainty_is_the_spread_of_drawn_deviations() -> None:
    deviation = grouped()
    effects, sigmas, _ = worst.variable_effects(MACHINE, BLOCK, deviation)
    found = propagation.standard_uncertainty(effects, sigmas)
    count = 200_000
    draws = {
        3: RANDOM.uniform(-1, 1, count),
        0: RANDOM.normal(scale=1 / 3, size=count),
        101: RANDOM.normal(scale=1 / 2, size=count),
        104: RANDOM.uniform(-1, 1, count),
        106: np.zeros(count),
    }
    names = [g if g != OWN_GROUP else 100 + k for k, g in enumerate(deviation.groups.tolist())]
    t = np.stack([draws[name] for name in names])
    moved = np.einsum(
        "nck,nk,ks->ncs", SENSITIVITY[:, :, deviation.parameters], deviation.signed_half, t
    )
    # A standard deviation of 2e5 draws is known to about 0.2 %.
    assert np.allclose(found, moved.std(axis=-1), rtol=0.01)
