"""The coverage interval holds the truth as often as it says: over machines that were really built.

A true machine is drawn from what its file knows of it, and driven by commands of the nominal one;
nobody knows its error, but the interval, drawn from other random numbers, holds it 95 times of 100.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from machine_texts import HEXAPOD, PLANAR, edited, load_text
from reference_kinematics import rotation_of_quaternion, vector_of
from truepose.machine import Machine
from truepose.probability.copula import Copula
from truepose.runs.poses import PoseRun, required_sources
from truepose.runs.variables import Variables, variables_at

Array = NDArray[np.float64]

TRUE_MACHINES = 1000
POSES = 25
"""Each is the command of as many of the true machines."""
SAMPLES = 20_000
PROBABILITY = 0.95
SIGMAS = 3.5
"""Binomial standard deviations that the share may be off by."""
SEED = 2026

FILES = ["planar_two_slider", "3rpr", "hexapod", "linear_delta", "hexapod_all_sources", "tricept"]

# All kinds of distributions, some correlated, some wide enough to bend the answer.
MIXED_PLANAR = edited(
    PLANAR,
    (
        "length_tolerance = [-0.3, 0.3]",
        'length_tolerance = { band = 2.0, distribution = "triangular" }',
    ),
    (
        "[workspace]",
        "[tolerance]\n"
        '"strut.*.base.x" = { band = 1.0, distribution = "normal", sigmas = 2 }\n'
        '"strut.*.base.y" = { band = [-0.4, 1.0], distribution = "arcsine" }\n'
        '"strut.2.length" = { band = 3.0, distribution = "student-t", dof = 4, sigmas = 2 }\n'
        '"tool.?" = { values = [-0.1, 0.0, 0.3], probabilities = [0.5, 0.3, 0.2], '
        'distribution = "discrete" }\n'
        '[[correlation]]\nbetween = ["strut.1.base.x", "strut.2.base.x"]\ncoefficient = 0.6\n'
        "[workspace]",
    ),
)
MIXED_HEXAPOD = HEXAPOD + (
    '\n[tolerance]\n"strut.*.base.?" = { band = 1.0, distribution = "normal", sigmas = 3 }\n'
    '"strut.*.platform.?" = { band = 0.5, distribution = "triangular" }\n'
    '"drive.*.offset" = { band = 0.5, group = "one gauge" }\n'
)


def placements_of(machine: Machine, commanded: Array, changed: dict[str, float]) -> Array:
    """Where a machine as built takes the nominal command: (7,) tool point and quaternion."""
    built = machine.kernel.replace(changed)
    joints = machine.kernel.inverse(commanded)
    start = machine.kernel.pose_of(machine.kernel.placement_of(commanded[np.newaxis]))[0]
    found: Array = built.placement_of(built.forward(joints, start)[np.newaxis])[0]
    return found


def error_of(machine: Machine, commanded: Array, changed: dict[str, float]) -> Array:
    """(n_component,) as m and rad, base frame."""
    actual = placements_of(machine, commanded, changed)
    nominal = placements_of(machine, commanded, {})
    turn = rotation_of_quaternion(actual[3:]) @ rotation_of_quaternion(nominal[3:]).T
    error = np.concatenate([actual[:3] - nominal[:3], vector_of(turn)])
    names = ("x", "y", "z", "rx", "ry", "rz")
    found: Array = error[[names.index(name) for name in machine.components]]
    return found


def drawn_by_numpy(moves: Variables, count: int) -> Array:
    """(count, n_variable) variables, by other random numbers than the kernel's."""
    random = np.random.default_rng(SEED)
    uniform = random.uniform(size=(count, len(moves.names)))
    t = np.stack(
        [each.quantile(u) for each, u in zip(moves.distributions, uniform.T, strict=True)], axis=1
    )
    copula = Copula.of(moves.distributions, moves.correlation, moves.names)
    if copula.linked.size:
        normals = random.multivariate_normal(np.zeros(len(copula.linked)), copula.latent, count)
        t[:, copula.linked] = copula.variables(normals)
    return t


def true_errors(machine: Machine, poses: Array) -> Array:
    """(pose, true machine, component) of machines drawn at random, each driven to one pose."""
    (block,) = PoseRun(machine, poses, machine.condition)
    moves = variables_at(machine, block, required_sources(machine, machine.condition))
    each = TRUE_MACHINES // len(poses)
    drawn = drawn_by_numpy(moves, TRUE_MACHINES)
    errors = np.empty((len(poses), each, len(machine.components)))
    for number, t in enumerate(drawn):
        pose, place = divmod(number, each)
        columns, deviations = moves.at(pose).parameters_moved(t[np.newaxis])
        changed = {
            machine.parameters[column]: float(machine.nominal[column] + deviation)
            for column, deviation in zip(columns.tolist(), deviations[0], strict=True)
        }
        errors[pose, place] = error_of(machine, poses[pose], changed)
    return errors


def assert_covers(machine: Machine) -> None:
    every = machine.poses()
    poses = every[np.linspace(0, len(every) - 1, POSES).astype(int)]
    errors = true_errors(machine, poses)
    found = tp.monte_carlo(machine, poses, SAMPLES, probability=PROBABILITY)
    slack = SIGMAS * np.sqrt(PROBABILITY * (1.0 - PROBABILITY) / TRUE_MACHINES)
    for kind in ("", "shortest_"):
        lower = found[f"{kind}lower"].values[:, np.newaxis]
        upper = found[f"{kind}upper"].values[:, np.newaxis]
        share = ((errors >= lower) & (errors <= upper)).mean(axis=(0, 1))
        assert share == pytest.approx([PROBABILITY] * len(share), abs=slack), kind
    # One-sided for sizes, and the ellipse for the position.
    places = np.array([name in "xyz" for name in machine.components])
    size = np.linalg.norm(errors[..., places], axis=-1)
    upper = found.magnitude_upper.values[:, :1]
    assert (size <= upper).mean() == pytest.approx(PROBABILITY, abs=slack)
    away = errors[..., places] - found.ellipse_centre.values[:, np.newaxis]
    inverse = np.linalg.inv(found.ellipse.values)
    square = np.einsum("psi,pij,psj->ps", away, inverse, away)
    assert (square <= 1.0).mean() == pytest.approx(PROBABILITY, abs=slack)


@pytest.mark.parametrize("name", FILES)
def test_of_machine_files(name: str) -> None:
    assert_covers(tp.load(MACHINES / f"{name}.toml"))


@pytest.mark.parametrize("text", [MIXED_PLANAR, MIXED_HEXAPOD], ids=["planar", "hexapod"])
def test_of_all_kinds_of_distributions(tmp_path: Path, text: str) -> None:
    assert_covers(load_text(tmp_path, text))
