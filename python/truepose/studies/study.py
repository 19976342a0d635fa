"""Run a study: prepare it, evaluate its blocks, keep what is done."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose._kernel import instruction_set
from truepose.arrays import Flags, Indices
from truepose.cluster.instruction_sets import computing_with
from truepose.cluster.options import requested_cluster
from truepose.errors import Problem, RequestError
from truepose.files.writing import require_own_place
from truepose.machine import Machine
from truepose.runs.arguments import checked
from truepose.runs.poses import Progress
from truepose.studies.base_machine import BaseMachine, read_base
from truepose.studies.block import (
    Arrays,
    BlockTask,
    empty_arrays,
    evaluate_block,
)
from truepose.studies.constraints import Constraints, required_constraints
from truepose.studies.dataset import DONE, done_variable, labels_of, results_of
from truepose.studies.design import FACTORIAL, SOBOL
from truepose.studies.evaluators import BlockEvaluator, Local, evaluator_of
from truepose.studies.lock import only_writer
from truepose.studies.minimise import Minimised, undrawn
from truepose.studies.objectives import MINIMISE, Objective, required_objective
from truepose.studies.optimiser import require_no_design, require_search
from truepose.studies.plan import StudyPlan, plan_of, try_values
from truepose.studies.quantities import QUICK_NAMES, Kinematics, chosen
from truepose.studies.store import (
    ENDING,
    PLANNED,
    StudyStore,
    created,
    require_packages,
    sweep_beside,
)
from truepose.studies.varied_keys import VariedKey, read_varied
from truepose.version import version

if TYPE_CHECKING:
    import xarray as xr

LARGEST_BLOCK = 64
"""Variants that are evaluated before they are written: what a lost process loses at most."""

BLOCKS = 64
"""Blocks that a study of few variants has."""

MEASURED = 3
"""Variants that are evaluated to say how long all will take."""

ON_DISK = 4096
"""Bytes that a file takes at least."""

PARTS = {
    "machine_hash": "the machine file",
    "data_files": "the data files",
    "settings": "what is set for all variants",
    "vary": "what is varied",
    "design": "the design",
    "count": "the count of variants",
    "seed": "the seed",
    "quantities": "the quantities",
    "reach": "the reach",
    "conditioning": "the conditioning that is asked for",
    "travel_left": "the travel that is to be left",
    MINIMISE: "what is minimised",
    "truepose_version": "the version of truepose",
}
"""What makes a study this one, and how it is called where another has another."""


@dataclass(frozen=True, eq=False)
class PreparedStudy:
    """A study before any variant: what is asked for, tried on the base file."""

    base: BaseMachine
    machine: Machine
    varied: tuple[VariedKey, ...]
    quantities: tuple[str, ...]
    constraints: Constraints
    key: Mapping[str, Any]

    @property
    def objective(self) -> Objective | None:
        """What an optimiser is to make small; None of a study whose plan is drawn."""
        name = self.key[MINIMISE]
        return None if name is None else required_objective(name)

    def plan(self) -> StudyPlan:
        """Draw the plan; of an optimiser an empty one. Raises as `laid_out`, `require_search`."""
        asked = self.key
        if self.objective is not None:
            return undrawn(self.varied, require_search(self.varied, asked["count"]))
        return plan_of(self.varied, asked["design"], asked["count"], asked["seed"])

    def block(self, plan: StudyPlan) -> int:
        """Variants that are kept at once: few, so that little is lost with a process."""
        if self.objective is not None:
            return 1
        return min(LARGEST_BLOCK, max(1, -(-len(plan) // BLOCKS)))

    def task(self, instructions: str) -> BlockTask:
        """What all blocks have."""
        return BlockTask(0, self.base, (), self.quantities, self.constraints, instructions)

    def tasks(
        self, plan: StudyPlan, numbers: Indices, block: int, instructions: str
    ) -> Iterator[BlockTask]:
        """The blocks of these `numbers`, of so many variants each."""
        empty = self.task(instructions)
        for number in numbers.tolist():
            rows = range(number * block, min((number + 1) * block, len(plan)))
            yield empty.of(number, tuple(plan.of_variant(row) for row in rows))


@dataclass(frozen=True)
class StudyCost:
    """What a study takes: `variants`; `seconds` on this computer; `files` of `size` bytes in all.

    Measured on `measured` of its variants; a store has the results and the plan, blocks rounded up
    to what a disk gives.
    """

    variants: int
    seconds: float
    size: int
    files: int
    measured: int


@checked
def study(
    machine: Machine | str | Path,
    vary: Mapping[str, str] | Sequence[str],
    *,
    design: str = FACTORIAL,
    count: int | None = None,
    seed: int = 0,
    settings: Mapping[str, str] | Sequence[str] = (),
    quantities: Sequence[str] = QUICK_NAMES,
    reach: float = 1.0,
    conditioning: float | None = None,
    travel_left: float | None = None,
    minimise: str | None = None,
    output: str | Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    tls: str | Path | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Evaluate many variants of a machine file, at the poses of that file.

    `machine`: the file, or a machine as it was loaded from one. `vary`: what differs,
    `{"strut.*.stiffness": "30:120:4 N/um", "strut.*.material": "steel,invar"}` or a list of
    "KEY=VALUES" (docs/studies.md). `design`: "factorial", or "latin-hypercube" or "sobol" with a
    `count` of variants and a `seed`. `settings`: changes that all variants have. `quantities`: what
    is computed, of "error", "verdict", "shares", "coverage", "kinematics". A variant that has less
    than the share `reach` of the poses of the base file is infeasible, and has no numbers; so is
    one whose `conditioning` (0 to 1) is worse at a pose, or one of whose drives has less than the
    share `travel_left` of its travel to either end, where these are given.

    `minimise`: an optimiser draws the variants, `count` of them, that make a number small: "error",
    "known", "coverage-before" or "coverage-after". All variables go from one end to the other then,
    "30:120 N/um"; there is no `design`. Every evaluation is kept, in its order.

    `output`: a store (.zarr) into which results are written block by block; the same call goes on
    with one that is not finished. `workers`: so many processes of this computer evaluate, or those
    of the dask.distributed `scheduler` at "tcp://HOST:PORT", or "tls://HOST:PORT" and `tls`, a
    folder with ca.pem, cert.pem and key.pem; the numbers are the same (docs/scale.md).
    `progress` is called with (variants done, variants to be done).
    Ctrl-C ends the study with what is done; the attribute `interrupted` is 1 then.

    The Dataset, SI, over the dim variant: the plan (`setting`, `value`), `status` ("ok",
    "infeasible", "failed", "not computed"), `reason`, `reach`, and the quantities.

    Raises `MachineFileError` and `RequestError` as `truepose.load` does, and `RequestError`:
    bad-vary, bad-design, study-too-large, bad-seed, bad-reach, bad-constraint, unknown-choice,
    no-workspace, no-pose-left, machine-file-changed, extra-missing, output-ending,
    output-not-writable, output-exists, other-study, store-in-use, bad-workers, no-scheduler,
    no-worker, worker-lost.
    """
    cluster = requested_cluster(workers, scheduler, tls)
    path = None if output is None else Path(output)
    if path is not None:
        require_store(path)
    prepared = prepare(
        machine,
        vary,
        design=design,
        count=count,
        seed=seed,
        settings=settings,
        quantities=quantities,
        reach=reach,
        conditioning=conditioning,
        travel_left=travel_left,
        minimise=minimise,
    )
    with evaluator_of(cluster) as evaluator:
        return run(prepared, path, evaluator=evaluator, progress=progress)


def require_store(path: Path) -> None:
    """Refuse a store that cannot be written, before any work.

    Raises `RequestError`: output-ending, output-not-writable, extra-missing.
    """
    require_own_place(path, ENDING)
    require_packages()


def prepare(
    machine: Machine | str | Path,
    vary: Mapping[str, str] | Sequence[str],
    *,
    design: str,
    count: int | None,
    seed: int,
    settings: Mapping[str, str] | Sequence[str],
    quantities: Sequence[str],
    reach: float,
    conditioning: float | None = None,
    travel_left: float | None = None,
    minimise: str | None = None,
) -> PreparedStudy:
    """Read the base file, and what is varied of it; arguments and errors as `study`."""
    constraints = required_constraints(reach, conditioning, travel_left)
    wanted = list(quantities)
    if minimise is not None:
        wanted.append(required_objective(minimise).quantity)
        require_no_design(design)
    if constraints.needs_kinematics:
        wanted.append(Kinematics.name)
    names = tuple(one.name for one in chosen(wanted))
    given = [f"{k}={v}" for k, v in settings.items()] if isinstance(settings, Mapping) else settings
    own = [f"{k}={v}" for k, v in machine.settings.items()] if isinstance(machine, Machine) else []
    path = machine.path if isinstance(machine, Machine) else machine
    base, loaded = read_base(path, (*own, *given))
    if isinstance(machine, Machine):
        _require_same(machine, replace(base, settings=tuple(own)))
    varied = read_varied(vary, loaded)
    key = {
        "machine_hash": loaded.file_hash,
        "settings": list(base.settings),
        "vary": [f"{k}={v}" for k, v in vary.items()] if isinstance(vary, Mapping) else list(vary),
        "design": design,
        "count": count,
        "seed": seed,
        "quantities": list(names),
        "reach": constraints.reach,
        "conditioning": constraints.conditioning,
        "travel_left": constraints.travel_left,
        MINIMISE: minimise,
        "truepose_version": version(),
    }
    prepared = PreparedStudy(base, loaded, varied, names, constraints, key)
    size = len(prepared.plan())  # a plan that cannot be drawn is told before values are tried
    base = try_values(base, varied)
    key |= {"seed": int(seed), "count": None if design == FACTORIAL and minimise is None else size}
    return replace(prepared, base=base, key={**key, "data_files": base.data_hashes})


def _require_same(machine: Machine, base: BaseMachine) -> None:
    """Refuse a machine that is not what its file and its settings say.

    Raises `RequestError` (machine-file-changed).
    """
    again = replace(base, workspace=None).machine()
    if again != machine:
        raise RequestError(
            Problem(
                "machine-file-changed",
                "the machine is not the one of its file, of which variants are made",
                file=machine.path,
                found="another file than was loaded, or a machine with replaced values",
                expected="a machine as truepose.load returns it, or the file",
                hint="give changes as settings=[...]",
            )
        )


def run(
    prepared: PreparedStudy,
    path: Path | None = None,
    *,
    evaluator: BlockEvaluator | None = None,
    progress: Progress | None = None,
    going_on: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Evaluate what is not done yet -> the Dataset of `study`.

    `evaluator`: by default this process. `going_on` is called with how many variants of how many
    are done already, where any are.
    """
    evaluator = Local() if evaluator is None else evaluator
    if path is None:
        plan = prepared.plan()
        kept = _InMemory(prepared, plan, evaluator.begun_with())
        return _evaluated(prepared, plan, kept, evaluator, progress)
    with ExitStack() as stack:
        stack.enter_context(only_writer(path))
        sweep_beside(path)
        store = _store(prepared, path, evaluator)
        plan = store.plan() if prepared.objective is None else prepared.plan()
        done = int(store.done().sum())
        if done and going_on is not None:
            going_on(done, len(plan))
        return _evaluated(prepared, plan, store, evaluator, progress)


def _store(prepared: PreparedStudy, path: Path, evaluator: BlockEvaluator) -> StudyStore:
    """The store at `path` that goes on, or a new one. Raises `RequestError` (other-study)."""
    if path.exists():
        store = StudyStore(path)
        _require_key(prepared.key, store)
        store.sweep()
        return store
    plan = prepared.plan()
    block = prepared.block(plan)
    key = {**prepared.key, "instruction_set": evaluator.begun_with()}
    labels = labels_of(prepared.machine, plan, prepared.quantities, key, block)
    empty = empty_arrays(prepared.quantities, prepared.base.components, len(plan))
    results = results_of(prepared.machine, prepared.quantities, empty)
    return created(path, labels, results, planned=PLANNED if prepared.objective is None else block)


def _require_key(key: Mapping[str, Any], store: StudyStore) -> None:
    problems = [
        Problem(
            "other-study",
            f"the store is of another study: {word} is another",
            file=str(store.path),
            found=_shown(store.key.get(part)),
            expected=_shown(key[part]),
            hint="give another name: --output NAME.zarr; this store stays as it is",
        )
        for part, word in PARTS.items()
        if store.key.get(part) != key[part]
    ]
    if problems:
        raise RequestError(*problems)


def _shown(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {sha[:12]}" for name, sha in value.items()) or "none"
    if isinstance(value, list):
        return "; ".join(map(str, value)) or "none"
    return "none" if value is None else str(value)


class _InMemory:
    """What a study of no store has done: the same as `StudyStore`, of arrays."""

    def __init__(self, prepared: PreparedStudy, plan: StudyPlan, instructions: str) -> None:
        self.block = prepared.block(plan)
        self.key = {**prepared.key, "instruction_set": instructions}
        self._prepared, self._plan = prepared, plan
        self._arrays = empty_arrays(prepared.quantities, prepared.base.components, len(plan))
        self._done = np.zeros(len(plan), np.bool_)

    def done(self) -> Flags:
        return self._done

    def write(self, number: int, arrays: Arrays) -> None:
        rows = slice(number * self.block, (number + 1) * self.block)
        asked = {"setting": self._plan.settings, "value": self._plan.values}
        for name, values in arrays.items():
            (asked[name] if name in asked else self._arrays[name])[rows] = values
        self._done[rows] = True

    def read(self) -> xr.Dataset:
        prepared = self._prepared
        labels = labels_of(prepared.machine, self._plan, prepared.quantities, self.key, self.block)
        results = results_of(prepared.machine, prepared.quantities, self._arrays)
        return labels.assign({**results, DONE: done_variable(self._done)})


def _evaluated(
    prepared: PreparedStudy,
    plan: StudyPlan,
    store: StudyStore | _InMemory,
    evaluator: BlockEvaluator,
    progress: Progress | None,
) -> xr.Dataset:
    """Evaluate the blocks that are not done, and read what there is then."""
    instructions = _usable(store)
    done = store.done()
    left = int((~done).sum())
    numbers = np.unique(np.flatnonzero(~done) // store.block)
    counted, interrupted = 0, False

    def told(more: int) -> None:
        nonlocal counted
        counted += more
        if progress is not None:
            progress(min(counted, left), left)

    try:
        if prepared.objective is None:
            tasks = prepared.tasks(plan, numbers, store.block, instructions)
            for number, arrays in evaluator.evaluate(tasks, told):
                store.write(number, arrays)
        else:
            empty = prepared.task(instructions)
            of = Minimised(
                prepared.objective, prepared.varied, len(plan), prepared.key["seed"], empty
            )
            of.run(store, evaluator, told)
    except KeyboardInterrupt:
        interrupted = True
    return store.read().assign_attrs(interrupted=int(interrupted))


def _usable(store: StudyStore | _InMemory) -> str:
    """The instruction set that the study was begun with.

    Raises `RequestError` (other-study) where this processor has it not: numbers of one study are
    all of one kind, to the last bit.
    """
    name = str(store.key["instruction_set"])
    try:
        with computing_with(name):
            return name
    except (RuntimeError, ValueError) as failure:
        raise RequestError(
            Problem(
                "other-study",
                "the study was begun with instructions that this processor has not",
                found=instruction_set(),
                expected=name,
                hint="go on where it was begun, or give another --output",
            )
        ) from failure


def estimated(prepared: PreparedStudy) -> StudyCost:
    """How many variants a study has, how long they take, how large they are, measured on a few."""
    plan = prepared.plan()
    count, block = len(plan), prepared.block(plan)
    if prepared.objective is not None:
        plan = plan_of(prepared.varied, SOBOL, count, prepared.key["seed"])  # as good as any
    rows = np.unique(np.linspace(0, count - 1, MEASURED).round().astype(np.intp))
    settings = tuple(plan.of_variant(row) for row in rows.tolist())
    task = prepared.task(instruction_set()).of(0, settings)
    begun = time.perf_counter()
    arrays = evaluate_block(task)
    seconds = (time.perf_counter() - begun) / len(rows)
    blocks = -(-count // block)
    size, files = 0, 0
    for values in [*arrays.values(), np.zeros(len(rows), np.bool_)]:
        a_chunk = _bytes(values) * block / len(rows)
        folders = max(values.ndim - 1, 0)  # a chunk lies in one for each dim but its last
        size += blocks * ON_DISK * (1 + int(a_chunk // ON_DISK) + folders)
        files += blocks
    written = sum(len(text) + 4 for row in settings for text in row) * count // len(rows)
    size += written + plan.values.nbytes + len(arrays) * ON_DISK
    return StudyCost(count, seconds * count, size, files, len(rows))


def _bytes(values: np.ndarray) -> int:
    if values.dtype == object:
        return sum(len(str(text).encode()) + 4 for text in values.ravel().tolist())
    return values.nbytes


__all__ = [
    "PreparedStudy",
    "StudyCost",
    "estimated",
    "prepare",
    "require_store",
    "run",
    "study",
]
