"""Which poses to measure, so that the calibrated machine is known best at the tool.

Every pose of the workspace that can be measured is a candidate: what the instrument would read
there changes by so much a unit of every unknown (the machine's and the instrument's own). A set of
poses leaves the unknowns with the covariance C = (prior + sum of the readings' information)^-1, in
which the instrument's own unknowns are included, and the tool with S C S^T at a
pose, S being the machine's sensitivity there. The set whose mean of the trace of that over the
workspace is least, rotations weighted by the characteristic length, is searched by exchange
(`exchange.py`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats, Indices
from truepose.calibration.acceptance.observability import project_out_instruments, row_covariance
from truepose.calibration.acceptance.tool_uncertainty import Tool, tool_components
from truepose.calibration.identification.tool_effects import tool_effects
from truepose.calibration.identification.unknowns import Unknowns, unknowns_of
from truepose.calibration.instruments import Instrument
from truepose.calibration.planning import exchange
from truepose.calibration.planning.exchange import (
    CRITERIA,
    STARTS,
    WIDE,
    Candidates,
    Criterion,
    Progress,
)
from truepose.calibration.planning.poses import Placed, short_way, workspace_poses
from truepose.calibration.planning.readings import planned, whitened
from truepose.errors import ArgumentError, Problem, RequestError
from truepose.files.wording import one_of
from truepose.machine import Condition, Machine
from truepose.representation import Facts, Represented
from truepose.runs.arguments import checked
from truepose.runs.dataset import (
    Variable,
    commanded_units,
    data_variable,
    joint_units,
    label,
    labelled_dataset,
    provenance,
    quantity_coords,
)
from truepose.runs.quantities import POSITIONS
from truepose.uncertainty_analysis.arguments import required_seed

if TYPE_CHECKING:
    import xarray as xr

DOMINATED = 0.5
"""An unknown of which the readings give less than this share of the information is called
dominated by its prior."""

UNDETERMINED = 1e3
"""A combination of unknowns counts as undetermined below so many times `WIDE` of information."""

SEEN = 1e-12
"""Share of a squared effect along what is undetermined that is no rounding."""

STEEP = 100.0
"""A reading that changes so many times as fast as it usually does is near a singularity."""

MOST_POSES = 1000
"""A plan is for people who carry an instrument round a machine."""


@dataclass(frozen=True, eq=False, repr=False)
class Plan(Represented):
    """Poses to measure, in an order that makes a short way, and what they buy; SI.

    `poses` (n, n_commanded), `joints` (n, n_joint). `rank` (n,): each pose's place, from 1, in the
    order in which every further pose buys most. Standard uncertainties of the calibrated machine at
    the tool, the length of the vector: `rms` and `highest` (n + 1, n_quantity) over the workspace,
    of position and, where the platform turns, orientation, after so many poses in the order of
    `rank`, the first before any; inf where nothing determines what the tool depends on.
    `relative`: but for where the whole machine stands, which an instrument in an unknown frame
    cannot tell. `before`, `after` (n_unknown,): standard uncertainty of each unknown, inf where
    nothing is known. `value`: the criterion. `n_candidate`: poses there were to choose from;
    `left_out`: poses that cannot be used or lie near a singularity. `searches`: from how many
    starts it is the best; `interrupted`: Ctrl-C ended the search before there were more.
    """

    machine: Machine
    instruments: tuple[Instrument, ...]
    criterion: Criterion
    unknowns: Unknowns
    condition: Condition
    poses: Floats
    joints: Floats
    rank: Indices
    rms: Floats
    highest: Floats
    before: Floats
    after: Floats
    value: float
    n_candidate: int
    left_out: int
    repeated: bool
    relative: bool
    seed: int
    searches: int
    interrupted: bool

    def _facts(self) -> Facts:
        yield "machine", self.machine
        yield "instruments", self.instruments
        yield "poses", len(self.poses)
        yield "of candidates", self.n_candidate
        yield "left out", self.left_out
        yield "unknowns", self.unknowns.count
        yield "criterion", self.criterion
        yield "tool known to (rms, m and rad)", self.rms[-1].tolist()
        yield "before", self.rms[0].tolist()

    @property
    def from_data(self) -> Floats:
        """(n_unknown,) share, 0 to 1, of what is then known of each unknown that is measured."""
        known = np.isfinite(self.after)
        ratio = np.divide(self.after, self.before, out=np.ones(known.size), where=known)
        return np.asarray(1.0 - np.square(ratio), np.float64)

    @property
    def prior_dominated(self) -> tuple[str, ...]:
        """Labels of the unknowns of which the readings give less information than the prior."""
        weak = self.from_data < DOMINATED
        return tuple(self.unknowns.labels[number] for number in np.flatnonzero(weak).tolist())

    @property
    def dataset(self) -> xr.Dataset:
        """Everything as data; `docs/planning.md` is its schema."""
        return _dataset(self)


@checked
def plan(
    machine: Machine,
    instrument: Instrument | Iterable[Instrument],
    budget: int,
    *,
    criterion: Criterion = "tool",
    candidates: ArrayLike | None = None,
    condition: Condition | None = None,
    identify: Iterable[str] = (),
    starts: int = STARTS,
    seed: int = 0,
    progress: Progress | None = None,
) -> Plan:
    """The `budget` poses to measure that leave the least uncertainty at the tool.

    `instrument`: one, or several that all read at every pose; their uncertainties are what they
    state. `criterion`: "tool", the mean variance over the workspace, or "determinant", the volume
    of the ellipsoid of all unknowns (D-optimal). `candidates` (..., n_commanded): poses to choose
    from; default those of the workspace. `condition`: in which is measured; default: reference
    temperature, nothing on the tool. `identify`: patterns of parameters and properties to find
    beside those with a tolerance. A pose is taken twice only where there are fewer than `budget`.
    `progress(starts done, starts)`; Ctrl-C gives the best plan so far, once there is one.

    Raises `RequestError`: plan-budget, plan-option, plan-instrument, no-workspace, bad-poses,
    no-pose-left, and what `unknowns_of` raises.
    """
    count = counted_poses(budget)
    if criterion not in CRITERIA:
        raise RequestError(
            Problem(
                "plan-option",
                "there is no such criterion of a plan",
                found=repr(criterion),
                expected=one_of(CRITERIA),
            )
        )
    required_seed(seed)
    if not 0 <= starts <= MOST_STARTS:
        raise ArgumentError.of("starts", starts, f"a whole number from 0 to {MOST_STARTS}")
    field = Field(
        machine, instrument, candidates=candidates, condition=condition, identify=identify
    )
    design = exchange.best(
        field.candidates, count, criterion=criterion, starts=starts, seed=seed, progress=progress
    )
    ordered = design.chosen
    rms, highest = field.curve(ordered)
    way = short_way(machine, field.placed.poses[ordered])
    rank = np.empty(count, np.intp)
    rank[:] = way + 1
    before = np.sqrt(np.diagonal(field.unknowns.prior_covariance))
    return Plan(
        machine,
        field.instruments,
        criterion,
        field.unknowns,
        field.condition,
        field.placed.poses[ordered][way],
        field.placed.joints[ordered][way],
        rank,
        rms,
        highest,
        before,
        np.minimum(field.deviations(ordered), before),
        design.value,
        len(field.placed),
        field.placed.left_out,
        count > len(field.placed),
        field.relative,
        seed,
        len(design.reached),
        design.interrupted,
    )


MOST_STARTS = 10_000
"""Searches that a plan begins: a few dozen find the best."""


def _instruments(given: Instrument | Iterable[Instrument]) -> tuple[Instrument, ...]:
    """One or some. Raises `ArgumentError` for what are none."""
    try:
        found = (given,) if isinstance(given, Instrument) else tuple(given)
    except TypeError:
        found = (given,)  # type: ignore[assignment]
    for each in found:
        if not isinstance(each, Instrument):
            raise ArgumentError.of("instrument", each, "a truepose.calibration.Instrument, or some")
    return found


class Field:
    """What a plan chooses from: the candidate poses, what would be read there, and the workspace.

    `placed`: the poses that may be measured. `candidates`: their readings as plain arrays. `tool`
    (n_pose, n_component, n): displacement and rotation of the tool per unit of each unknown, over
    the workspace.
    """

    def __init__(
        self,
        machine: Machine,
        instrument: Instrument | Iterable[Instrument],
        *,
        candidates: ArrayLike | None = None,
        condition: Condition | None = None,
        identify: Iterable[str] = (),
    ) -> None:
        self.machine = machine
        self.instruments = _instruments(instrument)
        if candidates is None:
            offered = Placed(machine, workspace_poses(machine), of_file=True)
            over = offered
        else:
            offered = Placed(machine, candidates)
            over = offered
            if machine.workspace is not None:
                over = Placed(machine, workspace_poses(machine), of_file=True)
        regular = offered.away_from_singularities()
        measurements = planned(machine, self.instruments, offered, condition)
        self.condition = measurements.conditions[0]
        self.unknowns = unknowns_of(machine, measurements, identify=tuple(identify))
        blocks = whitened(machine, measurements, self.unknowns, len(offered))
        usable = regular & self._readable(blocks)
        if not usable.any():
            names = ", ".join(measuring.name for measuring in self.instruments)
            raise RequestError(
                Problem(
                    "plan-instrument",
                    f"{names}: at none of the poses can a reading be told from the next",
                    machine.file,
                    found=f"{len(offered)} poses at singularities of what is read",
                    expected="poses at which what is read changes smoothly",
                    hint="look at frame and target: a distance from the target itself is none",
                )
            )
        self.placed = offered.select(usable)
        self.tool, self.relative = _tool(machine, self.unknowns, over, blocks[usable])
        components = np.array([name in POSITIONS for name in machine.components])
        self._parts = [part for part in (components, ~components) if part.any()]
        self._weights = np.where(components, 1.0, machine.characteristic_length)[:, np.newaxis]
        self._blocks = blocks[usable]
        self.candidates = self._weighted_candidates()

    def _readable(self, blocks: Floats) -> Flags:
        """(n,) of candidates (n, k, n_unknown) where no reading is near a singularity of its own.

        As the angle of a strut about an axis is where the two are parallel.
        """
        sigma = np.sqrt(np.diagonal(self.unknowns.prior_covariance))
        sizes = np.linalg.norm(blocks * np.where(np.isfinite(sigma), sigma, 1.0), axis=2)
        finite: Flags = np.isfinite(sizes).all(axis=1)
        if not finite.any():
            return finite
        return np.asarray((sizes <= STEEP * np.median(sizes[finite], axis=0)).all(axis=1), np.bool_)

    def _weighted_candidates(self) -> Candidates:
        return Candidates(self._blocks, self.tool * self._weights, _information(self.unknowns))

    def assess_as(self, other: Field) -> None:
        """Assess the tool as another field of the same machine does: by the same effects."""
        n_machine = self.unknowns.n_machine
        tool = np.zeros((*other.tool.shape[:2], self.unknowns.count))
        tool[:, :, :n_machine] = other.tool[:, :, :n_machine]
        self.tool = tool
        self.relative = other.relative
        self.candidates = self._weighted_candidates()

    @property
    def mean_before(self) -> float:
        """The criterion "tool" before any reading."""
        return self.candidates.value(np.empty(0, np.intp))

    def curve(self, ordered: Indices) -> tuple[Floats, Floats]:
        """(m + 1, n_quantity) rms and highest uncertainty after 0, 1, ... m of the candidates."""
        after = [self.after(ordered[:count]) for count in range(len(ordered) + 1)]
        return np.array([rms for rms, _ in after]), np.array([highest for _, highest in after])

    def after(self, chosen: Indices) -> tuple[Floats, Floats]:
        """(n_quantity,) rms and highest standard uncertainty at the tool after some candidates."""
        variance = self._at_tool(chosen)
        return np.sqrt(variance.mean(axis=0)), np.sqrt(variance.max(axis=0))

    def deviations(self, chosen: Indices) -> Floats:
        """(n,) standard uncertainty of each unknown after some candidates, inf if open."""
        known = CombinationVariance(self.candidates, chosen)
        return np.sqrt(known.variance(np.eye(self.unknowns.count))) * self.candidates.scale

    def _at_tool(self, chosen: Indices) -> Floats:
        """(n_pose, n_quantity) variance of position and orientation at the tool, inf if open."""
        known = CombinationVariance(self.candidates, chosen)
        rows = self.tool * self.candidates.scale
        variance = known.variance(rows.reshape(-1, rows.shape[2])).reshape(rows.shape[:2])
        return np.stack([variance[:, part].sum(axis=1) for part in self._parts], axis=1)


class CombinationVariance:
    """Variances of linear combinations of unknowns after some candidates, scaled as these are.

    Unknowns with a prior always have a finite variance; the others are determined by the readings
    only: where those do not, the Schur complement of the information has an eigenvalue near zero.
    """

    def __init__(self, candidates: Candidates, chosen: Indices) -> None:
        information = candidates.information(chosen)
        self._open = candidates.open
        inner = information[np.ix_(~self._open, ~self._open)]
        across = information[np.ix_(~self._open, self._open)]
        self._half = np.linalg.inv(np.linalg.cholesky(inner))
        self._follows = self._half.T @ (self._half @ across)
        outer = information[np.ix_(self._open, self._open)] - across.T @ self._follows
        self._size, self._axes = np.linalg.eigh(outer)

    def variance(self, rows: Floats) -> Floats:
        """(m,) of combinations `rows` (m, n), inf where nothing determines them."""
        own = rows[:, self._open]
        of_prior: Floats = rows[:, ~self._open]
        variance = np.square(of_prior @ self._half.T).sum(axis=1)
        lost = self._size < UNDETERMINED * WIDE
        squares = np.square((own - of_prior @ self._follows) @ self._axes)
        variance += squares[:, ~lost] @ (1.0 / self._size[~lost])
        # What follows the undetermined only by rounding does not count.
        directly = np.square(own @ self._axes)
        whole = directly.sum(axis=1)
        return np.where(directly[:, lost].sum(axis=1) > SEEN * whole, np.inf, variance)


def counted_poses(budget: int) -> int:
    """The number of poses asked for. Raises `RequestError` (plan-budget)."""
    try:
        count = int(budget)
    except (TypeError, ValueError, OverflowError):
        count = 0
    if count != budget or not 1 <= count <= MOST_POSES:
        raise RequestError(
            Problem(
                "plan-budget",
                "so many poses cannot be planned",
                found=str(budget),
                expected=f"a whole number of poses from 1 to {MOST_POSES}",
            )
        )
    return count


def _information(unknowns: Unknowns) -> Floats:
    """(n, n) of the prior; zero along unknowns without one."""
    covariance = unknowns.prior_covariance
    known = np.isfinite(np.diagonal(covariance))
    information = np.zeros_like(covariance)
    inner = np.ix_(known, known)
    scale = np.sqrt(np.diagonal(covariance)[known])
    if scale.size:
        correlation = covariance[inner] / np.outer(scale, scale)
        # What is correlated fully has no inverse; a ridge binds it, a pseudoinverse would free it.
        correlation = correlation + WIDE * np.eye(scale.size)
        information[inner] = np.linalg.inv(correlation) / np.outer(scale, scale)
    return information


def _tool(
    machine: Machine, unknowns: Unknowns, over: Placed, blocks: Floats
) -> tuple[Floats, bool]:
    """(n_pose, n_component, n) what each unknown does to the tool, over poses that can be used.

    Where an instrument's own frame is unknown no reading tells where the whole machine stands: that
    part of every effect is removed, as in the acceptance, and the flag is set.
    """
    n_machine = unknowns.n_machine
    own = tool_effects(machine, unknowns, unknowns.prior_mean, over.poses)
    effects = np.zeros((*own.effects.shape[:2], unknowns.count))
    effects[:, :, :n_machine] = own.effects
    if n_machine == unknowns.count:
        return effects, False
    sigma = np.sqrt(np.diagonal(unknowns.prior_covariance))[:n_machine]
    triangle = np.linalg.qr(blocks.reshape(-1, unknowns.count), mode="r")
    seen = row_covariance(project_out_instruments(triangle, n_machine, sigma))
    tool = Tool.of(own.effects, tool_components(machine), own.positions)
    gauge = tool.sort(seen, with_gauge=True).gauge
    effects[:, :, :n_machine] = tool.relative(gauge).effects
    return effects, len(gauge) > 0


def _dataset(plan: Plan) -> xr.Dataset:
    machine, unknowns = plan.machine, plan.unknowns
    n_pose = len(plan.poses)
    units = {
        "joint": joint_units(machine),
        "quantity": [str(unit) for unit in quantity_coords(machine)["quantity_units"].values],
        "sought": list(unknowns.units),
    }

    def variable(dims: tuple[str, ...], values: ArrayLike, unit: str, meaning: str) -> xr.Variable:
        return data_variable(Variable(dims, unit, meaning), values, units)

    data = {
        "joint_nominal": variable(
            ("pose", "joint"), plan.joints, "joint", "joint coordinate, nominal command"
        ),
        "rank": variable(
            ("pose",), plan.rank, "1", "place, from 1, in the order in which poses buy most"
        ),
        "rms": variable(
            ("count", "quantity"), plan.rms, "quantity", "rms uncertainty at the tool over poses"
        ),
        "highest": variable(
            ("count", "quantity"), plan.highest, "quantity", "highest uncertainty at the tool"
        ),
        "before": variable(
            ("sought",), plan.before, "sought", "standard uncertainty of the unknown before"
        ),
        "after": variable(("sought",), plan.after, "sought", "the same after all poses"),
        "from_data": variable(
            ("sought",), plan.from_data, "1", "share of what is known that is measured"
        ),
    }
    labels = {
        "pose": label("pose", np.arange(n_pose), "number of the pose in the order of measuring"),
        "count": label("count", np.arange(n_pose + 1), "poses measured, in the order of rank"),
        "joint": label("joint", list(machine.joints), "actuated joint"),
        "joint_units": label("joint", units["joint"], "unit of the joint coordinate"),
        "sought": label("sought", list(unknowns.names), "what is to be found"),
        "sought_units": label("sought", units["sought"], "unit of the unknown"),
        **quantity_coords(machine),
    }
    for column, freedom in enumerate(machine.commanded):
        unit = commanded_units(machine)[column]
        meaning = f"pose {freedom}, commanded"
        labels[f"pose_{freedom}"] = label("pose", plan.poses[:, column], meaning, unit)
    attrs = provenance(machine, plan.condition)
    attrs |= {
        "instruments": ", ".join(instrument.name for instrument in plan.instruments),
        "criterion": plan.criterion,
        "criterion_value": plan.value,
        "candidates": plan.n_candidate,
        "candidates_left_out": plan.left_out,
        "without_place_of_machine": int(plan.relative),
        "seed": str(plan.seed),
        "interrupted": int(plan.interrupted),
    }
    return labelled_dataset(data, labels, attrs)
