"""One set after another: drawn, spoilt, calibrated, judged."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from calibration_study.blunders import FACTORS, KINDS, Kind, Measured, Spoilt
from calibration_study.judge import Answer, Tool, answer_of, tools
from calibration_study.kinematics import NoRootError
from calibration_study.truth import (
    FAMILIES,
    SPATIAL_POSITION,
    Floats,
    Random,
    Table,
    Twin,
    csv_of,
    drawn_twin,
    instrument_of,
    observed,
    random_of,
)

JUDGED = 12
"""Poses of the workspace at which the tool is looked at."""
ROWS = (14, 36)
TRIES = 20
INFORMATIVE = ("tracker", "known tracker", "pose")
"""Instruments that see enough for a yes; of the others good data may be refused for good reason."""
HARMLESS = 0.1
"""Of the stated 95 %: a blunder that changes the tool's distance by less does nothing to it."""
CHANCE = 3.0
"""Standard errors of a share that are given to chance."""


@dataclass(frozen=True)
class Result:
    """A set, and what became of it.

    `position`, `rotation`: how far the tool is off over the stated 95 %, at the headline's pose;
    nan where there is no such freedom, or nothing was found. `ratio`: the worse of both; `without`:
    the same of the readings without the blunder, asked only where the tool is beyond.
    """

    kind: str
    seed: int
    family: str
    instrument: str
    rows: int
    factor: float
    size: float
    accepted: bool
    found: bool
    first: str
    named: bool
    mentioned: bool
    position: float
    rotation: float
    share_beyond: float
    seconds: float
    without: float = math.nan

    @property
    def ratio(self) -> float:
        return worse(self.position, self.rotation)

    @property
    def demanded(self) -> bool:
        """Whether a law asks for it: of a graded blunder, only where it can be detected."""
        return not KINDS[self.kind].graded or self.factor >= 1.0

    @property
    def beyond(self) -> bool:
        """Whether the tool is farther off than stated, or cannot be told at all."""
        return not self.found or self.ratio > 1.0

    @property
    def moved(self) -> bool:
        """Whether it is so for the blunder: heights all of the other sign turn their own frame."""
        return self.beyond and not abs(self.ratio - self.without) < HARMLESS


def worse(position: float, rotation: float) -> float:
    """Of two ratios; nan where there is none."""
    both = [ratio for ratio in (position, rotation) if not math.isnan(ratio)]
    return max(both) if both else math.nan


@dataclass(frozen=True, eq=False)
class DrawnSet:
    """A machine, good readings of it, and the same spoilt."""

    kind: Kind
    seed: int
    twin: Twin
    instrument: str
    spoilt: Spoilt
    judged: Floats
    folder: Path

    def write(self, *tables: Table) -> Path:
        path = self.folder / f"{self.kind.name.replace(' ', '-')}-{self.seed}.csv"
        path.write_text(csv_of(self.twin, *(tables or (self.spoilt.table,))), encoding="utf-8")
        return path


def drawn_set(
    name: str, seed: int, folder: Path, factors: tuple[float, float] = FACTORS
) -> DrawnSet:
    """The set of a kind and a seed: what is drawn and cannot be made is drawn again."""
    kind = KINDS[name]
    for attempt in range(TRIES):
        random = random_of("set", name, seed, attempt)
        found = _attempt(kind, seed, random, folder, factors)
        if found is not None:
            return found
    raise ValueError(f"{name} {seed}: no set in {TRIES} draws")


def _attempt(
    kind: Kind, seed: int, random: Random, folder: Path, factors: tuple[float, float]
) -> DrawnSet | None:
    instrument = str(random.choice(kind.instruments))
    families = FAMILIES
    if instrument == "heights":
        families = SPATIAL_POSITION
    if instrument == "scales":
        families = ("hexapod", "3rpr")
    family = str(random.choice(families))
    try:
        twin = drawn_twin(family, int(random.integers(100_000)), folder)
    except ValueError:
        return None
    if instrument == "pose" and not {"a", "b", "c"} & set(twin.description["dof"]):
        instrument = "tracker"
    count = int(random.integers(*ROWS))
    device = instrument_of(instrument, twin, random)
    poses = twin.poses(count, random)
    if instrument == "heights" and random.uniform() < 0.5:
        poses[:, twin.description["commanded"].index("z")] = poses[0, 2]
    try:
        table = observed(twin, device, poses, random)
        path = folder / f"{kind.name.replace(' ', '-')}-{seed}-good.csv"

        def written(good: Table) -> Path:
            path.write_text(csv_of(twin, good), encoding="utf-8")
            return path

        spoilt = kind.make(Measured(twin, table, written, factors), random)
    except NoRootError:
        return None
    if spoilt is None:
        return None
    judged = twin.poses(JUDGED, random)
    return DrawnSet(kind, seed, twin, instrument, spoilt, judged, folder)


def result_of(drawn: DrawnSet) -> Result:
    """Calibrate and judge."""
    start = time.perf_counter()
    answer = answer_of(drawn.twin, drawn.write(), drawn.judged)
    seconds = time.perf_counter() - start
    return judged(drawn, answer, seconds)


def judged(drawn: DrawnSet, answer: Answer, seconds: float) -> Result:
    kind, spoilt = drawn.kind, drawn.spoilt
    off = _off(drawn, answer)
    rows = answer.named_rows()
    result = Result(
        kind=kind.name,
        seed=drawn.seed,
        family=drawn.twin.family,
        instrument=drawn.instrument,
        rows=spoilt.table.count,
        factor=spoilt.factor,
        size=spoilt.size,
        accepted=answer.accepted,
        found=answer.found is not None,
        first=answer.first[:240],
        named=kind.is_named(answer.first, rows, spoilt),
        mentioned=kind.is_named(answer.first, rows, spoilt)
        or (bool(kind.words) and answer.mentions(kind.words)),
        position=_ratio(off, "position"),
        rotation=_ratio(off, "rotation"),
        share_beyond=max((each.share_beyond for each in off.values()), default=math.nan),
        seconds=seconds,
    )
    if not (result.found and result.beyond and kind.make is not KINDS["none"].make):
        return result
    mended = _off(drawn, answer_of(drawn.twin, drawn.write(spoilt.mended), drawn.judged))
    return replace(result, without=worse(*(_ratio(mended, each) for each in QUANTITIES)))


QUANTITIES = ("position", "rotation")


def _off(drawn: DrawnSet, answer: Answer) -> dict[str, Tool]:
    return {} if answer.found is None else {t.quantity: t for t in tools(drawn.twin, answer.found)}


def _ratio(off: dict[str, Tool], quantity: str) -> float:
    return off[quantity].ratio if quantity in off else math.nan


@dataclass(frozen=True)
class Rates:
    """Of the sets of one kind that are demanded: how many, and shares. Empty ones are nan.

    `excess`: of those that are accepted but not demanded, how many have their tool beyond.
    """

    kind: str
    count: int
    accepted: float
    beyond_of_accepted: float
    allowed: float
    moved: int
    named_of_moved: float
    named: float
    no_answer: float
    excess: float


def share(flags: Iterable[bool]) -> float:
    """Of them that are true; nan of none."""
    every = list(flags)
    return sum(every) / len(every) if every else math.nan


def allowed_share(count: int) -> float:
    """Of tools beyond the stated 95 %: 5 %, and three standard errors for chance."""
    return 0.05 + CHANCE * math.sqrt(0.05 * 0.95 / count)


def rates(kind: str, every: Iterable[Result]) -> Rates:
    """Of one kind."""
    mine = [each for each in every if each.kind == kind]
    own = [each for each in mine if each.demanded]
    accepted = [each for each in own if each.accepted]
    moved = [each for each in own if each.moved]
    by_quantity = [
        [ratio for ratio in ratios if not math.isnan(ratio)]
        for ratios in ([e.position for e in accepted], [e.rotation for e in accepted])
    ]
    # Each quantity by itself, for the stated 95 % are of each: the one that is nearer to its limit.
    compared = [
        (share(ratio > 1.0 for ratio in ratios), allowed_share(len(ratios)))
        for ratios in by_quantity
        if ratios
    ]
    beyond, allowed = max(compared, key=lambda at: at[0] - at[1], default=(math.nan, math.nan))
    return Rates(
        kind,
        len(own),
        share(each.accepted for each in own),
        beyond,
        allowed,
        len(moved),
        share(each.named for each in moved),
        share(each.named for each in own),
        share(not each.found for each in own),
        share(each.beyond for each in mine if each.accepted and not each.demanded),
    )


def as_row(result: Result) -> dict[str, object]:
    """For a line of JSON."""
    return {
        name: str(value) if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in asdict(result).items()
    }


def of_row(row: dict[str, Any]) -> Result:
    """Back again."""
    numbers = {"factor", "size", "position", "rotation", "share_beyond", "seconds", "without"}
    return Result(**{name: float(v) if name in numbers else v for name, v in row.items()})
