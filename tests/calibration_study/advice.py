"""The advice of a refused calibration, followed to the letter by somebody who reads only that.

The first sentence of the advice that asks for anything is read; what it asks for is measured on the
machine as built, with the blunder still in it where that stays (a wrong sign does), and everything
is calibrated again. What is not understood here is followed by nobody.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration_study.judge import Answer, answer_of, commanded_of, stated_95
from calibration_study.study import DrawnSet
from calibration_study.truth import (
    MM,
    Floats,
    Instrument,
    Random,
    Table,
    Twin,
    csv_of,
    instrument_of,
    observed,
    random_of,
)
from machine_file import file_at, rows_of, text_of
from truepose.calibration.acceptance import sentences
from truepose.calibration.instruments import REGISTRY

MOST = 3
"""Times that somebody goes back to the machine."""
BETTER = 0.99
"""A tool that is known to less than this of what it was is known better."""
NOTHING = r"none of the further measurements that were tried helps|no further measurement"

YES, BETTER_NO, NAMED, NONE_HELPS, WORSE = (
    "yes",
    "better-founded no",
    "the blunder is named",
    "nothing helps, and it says so",
    "no better",
)
GOOD_ENDS = (YES, BETTER_NO, NAMED, NONE_HELPS)
"""A no is better founded where the tool is known better than at first, where it names the blunder,
or where it says that nothing which was tried would turn it."""


@dataclass(frozen=True, eq=False)
class State:
    """What lies on the table: the machine file, which may know more by now, and all readings."""

    twin: Twin
    tables: tuple[Table, ...]


@dataclass(frozen=True)
class Followed:
    """How it ended, and what was done on the way."""

    end: str
    steps: tuple[str, ...]


Step = Callable[["Follower", State, re.Match[str]], State | None]


@dataclass(frozen=True, eq=False)
class Follower:
    """Somebody who follows the advice of one set."""

    drawn: DrawnSet
    random: Random

    def followed(self, answer: Answer) -> Followed:
        """From a refusal to its end."""
        first, now = answer, answer
        state = State(self.drawn.twin, (self.drawn.spoilt.table,))
        steps: list[str] = []
        for _ in range(MOST):
            if now.accepted:
                break
            wanted = self._next(state, now)
            if wanted is None:
                break
            words, state = wanted
            steps.append(words)
            now = self._calibrated(state)
        return Followed(self._end(first, now, steps), tuple(steps))

    def _next(self, state: State, answer: Answer) -> tuple[str, State] | None:
        """What is asked for first and can be done, done."""
        kind, spoilt = self.drawn.kind, self.drawn.spoilt
        blamed = answer.code and kind.is_named(answer.first, answer.named_rows(), spoilt)
        if blamed:
            # "It looks as if x and y were exchanged": who looks finds it, and mends it.
            return f"mended: {answer.sentence}", replace(
                state, tables=(spoilt.mended, *state.tables[1:])
            )
        for sentence in advised(answer):
            done = self._done(state, answer, sentence)
            if done is not None:
                return sentence, done
        rows = sorted(row for row in answer.named_rows() if row < state.tables[0].count)
        if rows:
            return f"measured again: rows {rows}", self._again(state, rows)
        return None

    def _done(self, state: State, answer: Answer, sentence: str) -> State | None:
        """A sentence's first alternative all of whose parts are understood."""
        for alternative in re.split(r",? or (?=measure|probe|read)", sentence):
            found: State | None = state
            for part in re.split(r",? and (?=measure|probe|read)", alternative):
                found = None if found is None else self._part(found, answer, part)
            if found is not None:
                return found
        return None

    def _part(self, state: State, answer: Answer, part: str) -> State | None:
        for pattern, step in STEPS.items():
            match = re.search(pattern, part, re.I)
            if match is not None:
                return step(self, state, match)
        match = re.search(r"measure (.+?) \(to ([\d.]+) (µm|um|mm)\)", part, re.I)
        if match is None or answer.found is None:
            return None
        sigma = float(match[2]) * (1e-3 if match[3] == "mm" else 1e-6)
        names = parameters_called(match[1], answer)
        return self.measured_parts(state, names, sigma) if names else None

    def _calibrated(self, state: State) -> Answer:
        path = self.drawn.folder / f"{self.drawn.kind.name.replace(' ', '-')}-followed.csv"
        path.write_text(csv_of(state.twin, *state.tables), encoding="utf-8")
        return answer_of(state.twin, path, self.drawn.judged)

    def _end(self, first: Answer, last: Answer, steps: Sequence[str]) -> str:
        if last.accepted:
            return YES
        if steps and self.drawn.kind.is_named(last.first, last.named_rows(), self.drawn.spoilt):
            return NAMED
        if steps and headline(self.drawn.twin, last) < BETTER * headline(self.drawn.twin, first):
            return BETTER_NO
        if any(re.search(NOTHING, sentence) for sentence in advised(last)):
            return NONE_HELPS
        return WORSE

    # ---- what people do ----

    def more_poses(self, state: State, match: re.Match[str]) -> State:
        """So many further rows of an instrument, anywhere in the workspace."""
        count = int(match[1])
        number = next(
            (i for i, table in enumerate(state.tables) if table.instrument.name == match[2]), 0
        )
        return self._added(state, number, self.drawn.twin.poses(count, self.random))

    def another_height(self, state: State, match: re.Match[str]) -> State | None:
        """One row at another commanded coordinate."""
        commanded = commanded_of(self.drawn.twin)
        if match[1] not in commanded:
            return None
        at = commanded.index(match[1])
        given = self.drawn.twin.loaded.poses()[:, at]
        pose = state.tables[0].poses[:1].copy()
        ends = np.array([given.min(), given.max()])
        pose[0, at] = ends[np.argmax(np.abs(ends - pose[0, at]))]
        return self._added(state, 0, pose)

    def other_coordinates(self, state: State, match: re.Match[str]) -> State:
        """The same probe reads further coordinates at the same poses."""
        table = state.tables[0]
        device = replace(
            table.instrument, kind="position", columns=("x", "y", "z"), unknown=("z", "a", "b")
        )
        values = observed(self.drawn.twin, device, table.poses, self.random).values
        for own, column in enumerate(table.instrument.columns):
            values[:, device.columns.index(column)] = table.values[:, own]
        return replace(state, tables=(Table(device, table.poses, values), *state.tables[1:]))

    def tracker(self, state: State, match: re.Match[str]) -> State:
        """A laser tracker, standing anywhere, reads the tool at the same poses, to 10 um."""
        drawn = instrument_of("tracker", self.drawn.twin, self.random)
        device = replace(drawn, name="laser", target=np.zeros(3), sigma={"m": 10e-6, "rad": 50e-6})
        more = observed(self.drawn.twin, device, state.tables[0].poses, self.random)
        return replace(state, tables=(*state.tables, more))

    def measured_parts(self, state: State, names: Sequence[str], sigma: float) -> State:
        """Parts in the hand, to a standard uncertainty."""
        nominal = dict(zip(state.twin.loaded.parameters, state.twin.loaded.nominal, strict=True))
        off = np.array([state.twin.deviation.get(name, 0.0) for name in names])
        off += sigma * self.random.standard_normal(off.size)
        if "parameter" not in REGISTRY:
            return replace(state, twin=_with_bands(state.twin, names, off, sigma))
        device = Instrument(
            f"calliper{len(state.tables)}",
            "parameter",
            tuple(f"parameter.{name}" for name in names),
            {"m": sigma},
        )
        values = np.array([[nominal[name] for name in names]]) + off
        nowhere = np.full((1, state.tables[0].poses.shape[1]), np.nan)
        return replace(state, tables=(*state.tables, Table(device, nowhere, values)))

    def _added(self, state: State, number: int, poses: Floats) -> State:
        table = state.tables[number]
        more = observed(self.drawn.twin, table.instrument, poses, self.random)
        if number == 0:
            more = self.drawn.spoilt.again(more)
        tables = list(state.tables)
        tables[number] = table.and_rows(more)
        return replace(state, tables=tuple(tables))

    def _again(self, state: State, rows: Sequence[int]) -> State:
        """Rows that do not fit, measured once more in place of those."""
        table, spoilt_rows = state.tables[0], self.drawn.spoilt.mended.count
        right = np.vstack([self.drawn.spoilt.mended.poses, table.poses[spoilt_rows:]])
        poses = right[rows]
        anew = observed(self.drawn.twin, table.instrument, poses, self.random)
        values = table.values.copy()
        values[rows] = self.drawn.spoilt.again(anew).values
        return replace(state, tables=(table.with_values(values), *state.tables[1:]))


STEPS: dict[str, Step] = {
    r"measure (\d+) more poses over the whole workspace with (\S+)": Follower.more_poses,
    r"row at another commanded ([a-cx-z])": Follower.another_height,
    r"probe in (.+) too": Follower.other_coordinates,
    r"as a laser tracker does": Follower.tracker,
}
"""What sentences ask for, and who does it."""


def _with_bands(twin: Twin, names: Sequence[str], off: Floats, sigma: float) -> Twin:
    """Where no file of measurements can say it: the bands of the machine file do."""
    file = file_at(twin.path)
    table = file.setdefault("tolerance", {})
    for name, read in zip(names, off, strict=True):
        band = [MM * (read - 2.0 * sigma), MM * (read + 2.0 * sigma)]
        table[name] = {"band": band, "distribution": "normal", "sigmas": 2}
        for strut in rows_of(file, "strut"):
            if name == f"strut.{strut['name']}.length":
                strut.pop("length_tolerance", None)
    path = twin.path.with_name(f"{twin.path.stem}-measured.toml")
    path.write_text(text_of(file), encoding="utf-8")
    return Twin(path, twin.description, twin.deviation)


def advised(answer: Answer) -> list[str]:
    """Sentences that may ask for something: of suspicions that refuse, then the remedy."""
    if answer.found is None:
        return list(answer.sentences)
    told = [each.sentence for each in answer.found.suspicions if each.refuses]
    remedy = answer.found.gate.remedy
    return [*told, *([] if remedy is None else [remedy.sentence])]


def parameters_called(words: str, answer: Answer) -> list[str]:
    """Parameters that "every rod length", "one rod length" or "rod length a" may mean."""
    assert answer.found is not None
    gate = answer.found.gate
    for name, label in zip(gate.names, gate.labels, strict=True):
        if words == label:
            return [name]
    for which in ("every", "one"):
        family = [
            name
            for name, label in zip(gate.names, gate.labels, strict=True)
            if sentences.some(label, gate.labels, which) == words
        ]
        if family:
            return family if which == "every" else family[:1]
    return []


def headline(twin: Twin, answer: Answer) -> float:
    """m or rad: the highest that is stated, of position where there is any; inf without a fit."""
    if answer.found is None:
        return float("inf")
    stated = stated_95(answer.found, commanded_of(twin))
    first = stated.get("position", stated.get("rotation", np.array([np.inf])))
    return float(first.max())


def follow(drawn: DrawnSet, answer: Answer | None = None) -> Followed | None:
    """Of a refused set; None where the answer is yes at once. `answer`: the first, if known."""
    if answer is None:
        answer = answer_of(drawn.twin, drawn.write(), drawn.judged)
    if answer.accepted:
        return None
    return Follower(drawn, random_of("follow", drawn.kind.name, drawn.seed)).followed(answer)


__all__ = ["GOOD_ENDS", "Followed", "follow"]
