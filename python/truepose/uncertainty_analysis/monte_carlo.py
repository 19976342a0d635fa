"""Monte Carlo: the exact error of machines drawn at random, with its coverage interval.

A sample is one machine: its variables are drawn once and it goes to every pose. Random numbers are
counter-based (`truepose._kernel.Variables`), so a sample depends on the seed and its number alone.
Memory does not grow with the samples: moments, extremes and histograms are kept.

A sample that cannot be assembled is a machine too, and in no interval: what says of which share of
the machines something holds (quantiles, intervals, ellipses) counts it as beyond both ends, as
many samples on either side. Where too many fail for the share asked, there is no such number. What
describes errors (mean, standard deviation, covariance, extremes) is of those that have one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from truepose._kernel import Tallies
from truepose.cluster.evaluator import Here, TaskEvaluator, evaluator_of
from truepose.cluster.options import refuse_workers, requested_cluster
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.runs.arguments import checked
from truepose.runs.dataset import (
    Schema,
    Variable,
    label,
    quantity_coords,
)
from truepose.runs.first_order import first_order
from truepose.runs.poses import (
    BAND,
    Progress,
    reason_unless,
)
from truepose.runs.quantities import POSITIONS
from truepose.runs.run import Run, in_parts
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock
from truepose.uncertainty_analysis.arguments import (
    DIGITS,
    required_digits,
    required_probability,
    required_samples,
    required_seed,
)
from truepose.uncertainty_analysis.failed_samples import lost_text
from truepose.uncertainty_analysis.functions.dataset import function_dataset
from truepose.uncertainty_analysis.machine_sampler import (
    FINENESS,
    LEVELS,
    MachineSampler,
    statistics,
)
from truepose.uncertainty_analysis.model import FunctionModel, first_order_variances
from truepose.uncertainty_analysis.sampler import Draws, Random, Sampler, sobol
from truepose.uncertainty_analysis.stopping_rule import Adaptive, FixedNumber, StoppingRule

if TYPE_CHECKING:
    import xarray as xr

    from truepose.uncertainty_analysis.functions.inputs import Correlation, Input

POSES = 32
"""Poses that are sampled together, from the same draws: their histograms take some 6 MB, which stay
near the processor."""

_EACH = ("pose", "component")
_SIZE = ("pose", "quantity")

SCHEMA: Schema = {
    "mean": Variable(_EACH, "component", "mean of the error, of samples that have one"),
    "standard_deviation": Variable(_EACH, "component", "standard deviation of the error"),
    "covariance": Variable((*_EACH, "other_component"), "covariance", "covariance of the error"),
    "lower": Variable(_EACH, "component", "lower end of the symmetric coverage interval"),
    "upper": Variable(_EACH, "component", "upper end of the symmetric coverage interval"),
    "shortest_lower": Variable(_EACH, "component", "lower end of the shortest coverage interval"),
    "shortest_upper": Variable(_EACH, "component", "upper end of the shortest coverage interval"),
    "minimum": Variable(_EACH, "component", "lowest error of a sample"),
    "maximum": Variable(_EACH, "component", "highest error of a sample"),
    "quantile": Variable((*_EACH, "level"), "component", "error that a share of samples is below"),
    "samples": Variable(("pose",), "1", "samples with a result", np.int64),
    "failed": Variable(
        ("pose",), "1", "samples without a result, beyond both ends of every interval", np.int64
    ),
}

MACHINE: Schema = {
    "magnitude_mean": Variable(_SIZE, "quantity", "mean size of the error"),
    "magnitude_upper": Variable(
        _SIZE,
        "quantity",
        "upper end of the coverage interval from zero: size that the probability asked is below",
    ),
    "magnitude_maximum": Variable(_SIZE, "quantity", "largest size of the error of a sample"),
    "magnitude_quantile": Variable(
        (*_SIZE, "level"), "quantity", "size of the error that a share of samples is below"
    ),
}
"""What a machine's result has besides."""

ELLIPSE: Schema = {
    "ellipse_centre": Variable(("pose", "axis"), "m", "centre of the coverage ellipsoid"),
    "ellipse": Variable(
        ("pose", "axis", "other_axis"), "m^2", "E of the ellipsoid (e - c)' E^-1 (e - c) <= 1"
    ),
}
"""What the result of a machine whose tool moves has besides."""


@dataclass(frozen=True)
class _Options:
    probability: float
    samples: int | None
    seed: int
    digits: int
    sampling: str

    @property
    def stop(self) -> StoppingRule:
        """When there are enough samples."""
        if self.samples is None:
            return Adaptive(self.probability, self.digits)
        return FixedNumber(self.samples)

    @property
    def attrs(self) -> dict[str, Any]:
        return {
            "seed": self.seed,
            "probability": self.probability,
            "sampling": self.sampling,
            "digits": self.digits if self.samples is None else 0,
        }

    def draws(self, of: Variables | FunctionModel) -> Draws:
        """The variables' samples."""
        random = Random(of, self.seed)
        return random if self.sampling == "random" else sobol(random, self.samples or 0)


@overload
def monte_carlo(
    model: Machine,
    poses: ArrayLike | None = None,
    samples: int | None = None,
    seed: int = 0,
    probability: float = 0.95,
    *,
    condition: Condition | None = None,
    digits: int = DIGITS,
    sampling: Literal["random", "sobol"] = "random",
    workers: int | None = None,
    scheduler: str | None = None,
    tls: str | Path | None = None,
    progress: Progress | None = None,
) -> xr.Dataset: ...


@overload
def monte_carlo(
    model: Callable[..., Any],
    poses: Mapping[str, Input] | None = None,
    samples: int | None = None,
    seed: int = 0,
    probability: float = 0.95,
    *,
    inputs: Mapping[str, Input] | None = None,
    correlation: Correlation = None,
    digits: int = DIGITS,
    sampling: Literal["random", "sobol"] = "random",
    progress: Progress | None = None,
) -> xr.Dataset: ...


@checked
def monte_carlo(
    model: Machine | Callable[..., Any],
    poses: Any = None,
    samples: int | None = None,
    seed: int = 0,
    probability: float = 0.95,
    *,
    condition: Condition | None = None,
    inputs: Mapping[str, Input] | None = None,
    correlation: Correlation = None,
    digits: int = DIGITS,
    sampling: Literal["random", "sobol"] = "random",
    workers: int | None = None,
    scheduler: str | None = None,
    tls: str | Path | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The distribution of the error, sampled: moments, quantiles and coverage intervals.

    Of a machine: `poses` (..., n_commanded), SI, default the file's workspace; every sample is a
    machine with its parameters deviated as the sources' distributions say, solved exactly. Of a
    plain function: its `inputs`, as the second argument or by name, and their `correlation`.

    `samples` at each pose; by default as many as JCGM 101:2008, 7.9 takes until so many significant
    `digits` of the standard deviation are stable. Intervals hold the share `probability` of the
    samples. `sampling` "sobol": scrambled Sobol points instead of random ones (`samples` a power of
    two; needs scipy). `workers`: so many processes of this computer sample the poses of a machine,
    or those of the dask.distributed `scheduler` at "tcp://HOST:PORT", or "tls://HOST:PORT" and
    `tls`, a folder with ca.pem, cert.pem and key.pem; the numbers are the same (docs/scale.md).
    `progress` is called with (samples done over all poses, samples expected in
    all or 0 while that is not known).
    Ctrl-C, once there are samples, gives the result so far (attribute `interrupted`). The Dataset,
    SI, is described in docs/results.md.

    Raises `RequestError`: bad-samples, bad-seed, bad-probability, bad-digits, bad-poses,
    no-workspace, no-source, no-pose-left, extra-missing, bad-workers, no-scheduler, no-worker,
    worker-lost; `TrueposeError` as the sources do.
    """
    cluster = requested_cluster(workers, scheduler, tls)
    asked = _Options(
        required_probability(probability),
        None if samples is None else required_samples(samples, 2),
        required_seed(seed),
        required_digits(digits),
        _required_sampling(sampling, samples),
    )
    if isinstance(model, Machine):
        with evaluator_of(cluster) as evaluator:
            return _of_machine(model, poses, condition, asked, evaluator, progress)
    if cluster is not None:
        raise refuse_workers(
            cluster,
            "workers share the poses of a machine, and a function has none",
            "for a function",
            "a machine, or no workers",
        )
    of = FunctionModel(model, poses if inputs is None else inputs, correlation)
    return _of_function(of, asked, progress)


def _required_sampling(sampling: str, samples: int | None) -> str:
    if sampling not in ("random", "sobol"):
        raise RequestError(
            Problem(
                "bad-sampling",
                "there is no such way of sampling",
                found=f"{sampling!r}",
                expected='"random" or "sobol"',
            )
        )
    if sampling == "sobol" and (samples is None or samples < 1 or samples & (samples - 1)):
        near = 2 ** max(10, round(math.log2(samples))) if samples else 65536
        raise RequestError(
            Problem(
                "bad-samples",
                "Sobol points fill the bands evenly only in powers of two",
                found="no number of samples" if samples is None else f"{samples}",
                expected=f"a power of two, such as {near}",
            )
        )
    return sampling


class _Account:
    """Samples done over all poses, and expected, for whoever looks on."""

    def __init__(self, progress: Progress | None, n_pose: int) -> None:
        self._progress, self._done = progress, 0
        self._left, self._finished, self._each = n_pose, 0, 0

    def add(self, samples: int, each: int) -> None:
        """Samples done; `each`: expected at a pose, 0 where that is not known."""
        self._done += samples
        # Other poses are expected to need as many as the last.
        self._each = each or self._each
        if self._progress is not None:
            total = self._finished + self._each * self._left if self._each else 0
            self._progress(self._done, max(total, self._done) if total else 0)

    def finish(self, n_pose: int) -> None:
        """So many poses have enough."""
        self._left -= n_pose
        self._finished = self._done


def _of_machine(
    machine: Machine,
    poses: ArrayLike | None,
    condition: Condition | None,
    asked: _Options,
    evaluator: TaskEvaluator,
    progress: Progress | None,
) -> xr.Dataset:
    run = Run(machine, poses, condition)
    axes = [name for name in machine.components if name in POSITIONS]
    schema = {**SCHEMA, **MACHINE, **(ELLIPSE if axes else {})}
    rows = run.begin(schema, level=LEVELS.size, axis=len(axes), other_axis=len(axes))
    account = _Account(progress, len(run.poses))
    interrupted = False
    for block, every in run.with_variables():
        by_part: dict[int, _Sampled] = {}
        listed = list(in_parts(block, every, POSES))
        # The part with the worst pose first: what is stopped early holds it.
        order = _worst_first(machine, block, every)
        try:
            for number, sampled in _sampled_parts(asked, listed, order, evaluator, account):
                by_part[number] = sampled
                interrupted = interrupted or sampled.interrupted
                if interrupted:
                    break
        except KeyboardInterrupt:
            interrupted = True
        for number in sorted(by_part):
            values = by_part[number].values
            if values is not None:
                run.fill(listed[number][0], values, by_part[number].status)
        if interrupted:
            break
    if interrupted and rows.count == 0:
        raise KeyboardInterrupt
    names = list(machine.components)
    coords = {
        "other_component": label("other_component", names, "the other component of a covariance"),
        "level": label("level", LEVELS, "share of the samples"),
        **quantity_coords(machine),
    }
    if axes:
        coords["axis"] = label("axis", axes, "component of the position error")
        coords["other_axis"] = label("other_axis", axes, "the other component")
    dataset = run.dataset(coords=coords)
    dataset.attrs |= {**asked.attrs, "interrupted": int(interrupted)}
    return dataset.assign_attrs(
        not_assembled=lost_text(dataset["failed"], dataset["samples"] + dataset["failed"])
    )


_Part = tuple[PoseBlock, Variables]
"""Some poses, and what is drawn there."""


@dataclass(frozen=True)
class _Sampled:
    """What the samples at some poses say: the values of each, and whether it can be used.

    `values` is None where Ctrl-C came before there were any. `per_pose`: samples at each.
    """

    values: Mapping[str, np.ndarray] | None
    status: np.ndarray
    per_pose: int
    interrupted: bool


def _sampled_parts(
    asked: _Options,
    parts: Sequence[_Part],
    order: Sequence[int],
    evaluator: TaskEvaluator,
    account: _Account,
) -> Iterator[tuple[int, _Sampled]]:
    """The number of each part and its samples, in the `order` here, as they come from workers."""
    here = isinstance(evaluator, Here)
    # What runs here says how far it is, batch by batch, and is drawn once.
    drawn = asked.draws(parts[0][1]) if here else None
    sample = partial(_sampled, told=account.add, draws=drawn) if here else _sampled
    tasks = ((number, parts[number] if here else _alone(parts[number])) for number in order)
    for number, sampled in evaluator.results(sample, asked, tasks):
        n_pose = parts[number][0].indices.size
        if not here:
            account.add(sampled.per_pose * n_pose, sampled.per_pose)
        account.finish(n_pose)
        yield number, sampled


def _alone(part: _Part) -> _Part:
    block, variables = part
    return block.alone(), variables


def _sampled(
    asked: _Options,
    part: _Part,
    told: Callable[[int, int], None] | None = None,
    draws: Draws | None = None,
) -> _Sampled:
    """The samples at the poses of a part, until there are enough; `told` as `Sampler.run`.

    `draws`: those of all parts, which have the same variables; by default made anew.
    """
    block, variables = part
    sampler = MachineSampler(block.machine, block, variables)
    drawn = sampler.run(draws or asked.draws(variables), asked.stop, told or _nobody)
    if drawn.tallies is None:
        return _Sampled(None, np.empty(0, np.uint8), 0, drawn.interrupted)
    return _Sampled(
        sampler.values(drawn.tallies, asked.probability),
        reason_unless(np.asarray(drawn.tallies.count) > 1, BAND),
        drawn.per_pose,
        drawn.interrupted,
    )


def _nobody(samples: int, each: int) -> None:
    """Nobody looks on."""


def _worst_first(machine: Machine, block: PoseBlock, variables: Variables) -> list[int]:
    """Numbers of the parts of a block, the one with the largest first-order variance first."""
    _, effects, _ = first_order(machine, block, variables)
    starts = np.arange(0, block.indices.size, POSES)
    variances = first_order_variances(machine, variables, effects)
    order: list[int] = np.argsort(-np.maximum.reduceat(variances, starts), kind="stable").tolist()
    return order


class _FunctionSampler(Sampler):
    """A plain function: one pose, so to say, and its outputs as columns."""

    n_pose = 1

    def __init__(self, model: FunctionModel) -> None:
        self.model = model
        m = len(model.outputs)
        self._origins, self._widths = np.zeros((1, m)), np.ones((1, m))
        self.failed = 0

    def prepare(self, draws: Draws) -> None:
        """Origins and widths from some first samples."""
        values, fine = self.model.evaluate(draws.rows(0, 1000))
        if not fine.any():
            return
        middle = np.median(values[fine], axis=0)
        variables_at = values[fine].std(axis=0)
        tiny = 1e-15 * np.abs(middle) + np.finfo(np.float64).tiny / np.finfo(np.float64).eps
        self._origins = middle[np.newaxis]
        self._widths = np.maximum(variables_at, tiny)[np.newaxis] / FINENESS

    def begin(self, draws: Draws, count: int) -> Tallies:
        """The first samples: nothing is learnt from them."""
        m = self._origins.shape[1]
        tallies = Tallies(self._origins, self._widths, m, m)
        self.sample(draws, 0, count, tallies)
        return tallies

    def sample(self, draws: Draws, first: int, count: int, into: Tallies) -> None:
        """Evaluates the samples from number `first` on."""
        values, fine = self.model.evaluate(draws.rows(first, count))
        into.add(np.ascontiguousarray(values[fine]))
        into.fail(int((~fine).sum()))

    @property
    def checked(self) -> slice:
        """All outputs."""
        return slice(None)


def _of_function(model: FunctionModel, asked: _Options, progress: Progress | None) -> xr.Dataset:
    sampler = _FunctionSampler(model)
    draws = asked.draws(model)
    sampler.prepare(draws)
    drawn = sampler.run(draws, asked.stop, _Account(progress, 1).add)
    if drawn.tallies is None or drawn.tallies.count[0] < 2:
        if drawn.interrupted:
            raise KeyboardInterrupt
        raise RequestError(
            Problem(
                "bad-samples",
                "too few of the samples have a result",
                found="none or one",
                expected="two or more samples at which the function is finite",
            )
        )
    values = statistics(drawn.tallies, len(model.outputs), asked.probability)
    dataset = function_dataset(
        SCHEMA,
        {name: value[0] for name, value in values.items()},
        model,
        coords={"level": label("level", LEVELS, "share of the samples")},
    )
    dataset.attrs |= {**asked.attrs, "interrupted": int(drawn.interrupted)}
    return dataset.assign_attrs(
        not_assembled=lost_text(
            dataset["failed"], dataset["samples"] + dataset["failed"], plain=True
        )
    )


__all__ = ["ELLIPSE", "MACHINE", "SCHEMA", "monte_carlo"]
