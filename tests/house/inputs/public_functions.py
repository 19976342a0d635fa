"""Calls the public functions with what the command line cannot give, and prints the answers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

import truepose as tp


def show(name: str, work: Callable[[], Any]) -> None:
    """Print what a call gives, or the problems that it raises."""
    print(f"== {name}")
    try:
        answer = work()
    except tp.errors.TrueposeError as refused:
        print(refused)
        return
    except (tp.errors.PoseError, tp.errors.ReadingError, ValueError, TypeError) as refused:
        print(type(refused).__name__, refused)
        return
    tell(answer)


def tell(answer: Any) -> None:
    """Print an answer with all its digits."""
    if isinstance(answer, xr.Dataset):
        for key, value in answer.attrs.items():
            print(f"attribute {key}: {value!r}")
        for key, variable in answer.variables.items():
            print(key, variable.dims, dict(variable.attrs), np.ravel(variable.values).tolist())
    elif isinstance(answer, np.ndarray):
        print(answer.tolist())
    elif isinstance(answer, tuple):
        for part in answer:
            tell(part)
    else:
        print(answer)


def strength(load: np.ndarray, width: np.ndarray) -> np.ndarray:
    """A function for inputs."""
    return np.asarray(load / width**2)


machine = tp.load("machine.toml")
poses = machine.poses()[:2]
band, normal = tp.Input.uniform(95.0, 105.0), tp.Input.normal(2.0, 0.1)
inputs = {"load": band, "width": normal}
plain = {"load": band, "width": tp.Input.triangular(1.9, 2.1)}
unknown = machine.condition.replace(temperature={"strut.9": 300.0})
lattice = {"samples": 64, "sampling": "lattice"}
show(
    "parameters",
    lambda: tuple(zip(machine.parameters, machine.nominal, machine.units, strict=True)),
)
show("inverse", lambda: machine.inverse(poses))
show("forward", lambda: machine.forward(machine.inverse(poses), poses))
show("sensitivity", lambda: machine.sensitivity(poses))
show("unreachable", lambda: machine.inverse([9.0, 9.0]))
show("no such parameter", lambda: machine.replace({"strut.9.length": 1.0}))
show("bad value", lambda: machine.replace({"strut.1.length": float("nan")}))
for name in ("budget", "compensate", "accuracy", "strain", "over_time"):
    show(name, lambda name=name: getattr(tp, name)(machine, poses))
    show(f"{name}, bad poses", lambda name=name: getattr(tp, name)(machine, [[1.0, 2.0, 3.0]]))
show("monte_carlo", lambda: tp.monte_carlo(machine, poses, samples=128))
show("bounds", lambda: tp.bounds(machine, poses))
show("shares", lambda: tp.shares(machine, poses, samples=32))
show("worst_case", lambda: tp.worst_case(strength, inputs=inputs))
show("uncertainty", lambda: tp.uncertainty(strength, inputs=inputs))
show(
    "plain worst_case",
    lambda: tp.worst_case(strength, inputs=plain),
)
show("monte_carlo of a function", lambda: tp.monte_carlo(strength, inputs=inputs, samples=256))
show("shares of a function", lambda: tp.shares(strength, inputs=inputs, samples=64))
show("no input", lambda: tp.uncertainty(strength, inputs={}))
show("unknown input", lambda: tp.uncertainty(strength, inputs={**inputs, "height": band}))
show("missing input", lambda: tp.uncertainty(strength, inputs={"load": band}))
show("bad function", lambda: tp.uncertainty(lambda load, width: "much", inputs=inputs))
show("bad probability", lambda: tp.uncertainty(strength, inputs=inputs, probability=2.0))
show("bad digits", lambda: tp.monte_carlo(strength, inputs=inputs, digits=7))
show("bad sampling", lambda: tp.monte_carlo(strength, inputs=inputs, **lattice))
show("bad seed", lambda: tp.monte_carlo(machine, poses, samples=64, seed=-1))
show("bad samples", lambda: tp.monte_carlo(machine, poses, samples=0))
show("bad gap", lambda: tp.bounds(machine, region={"x": (0.29, 0.31), "y": (0.19, 0.21)}, gap=-1.0))
show("bad region", lambda: tp.bounds(machine, region={"x": (0.29,)}))
show("bad truncation", lambda: tp.bounds(machine, poses, truncate=-1.0))
show("bad times", lambda: tp.over_time(machine, poses, times=[float("nan")]))
show("bad condition", lambda: machine.condition.replace(temperature=-5.0))
show("bad condition key", lambda: machine.condition.replace(temperatur=300.0))
show("bad force", lambda: machine.condition.replace(force=(1.0,)))
show(
    "unknown part",
    lambda: tp.budget(machine, poses, machine.condition.replace(temperature={"strut.9": 300.0})),
)
show("no pose", lambda: tp.budget(machine, [[9.0, 9.0]]))
show("export", lambda: sorted(tp.export(machine, "pose-map", {"count": "3"}).files))
show("calibrate nothing", lambda: tp.calibrate(machine, "none.csv"))
show("bad input", lambda: tp.Input.normal(1.0, -1.0))
show("bad distribution", lambda: tp.Input.discrete([1.0, 2.0], [0.5, 0.7]))
show("threads", lambda: tp.threads())
