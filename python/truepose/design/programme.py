"""The programme: the cheapest grades that all cuts allow, by HiGHS.

    minimise    cost . x
    where       the columns x of every tie add up to 1, each 0 or 1
                coefficients x <= most, a row for every cut, scaled to the limit of its quantity

Without whole columns it is the relaxation, whose optimum is a lower bound. One thread and the same
rows in the same order: the same answer. HiGHS: Huangfu & Hall, Math. Prog. Comp. 10 (2018) 119-142.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.errors import Problem, RequestError

if TYPE_CHECKING:
    import highspy

FEASIBLE = 1e-9
"""By how much a row may be exceeded, of its limit: the least that HiGHS takes is 1e-10."""

_ROUNDING = 1e-9
"""Of a bound: what the solver's arithmetic may have put on it."""

_NODES = 500
"""Nodes of the search for fewer kinds of columns: a number, so that it ends the same everywhere."""

_LISTEN = 0.05
"""Seconds between two looks at whether Ctrl-C was pressed."""


@dataclass(frozen=True, eq=False)
class ProgrammeSolution:
    """Columns x (x,), their cost, and the `bound` below which no columns that are allowed cost.

    `dual` (n,): of the relaxation, by how much the cost falls where the right side of a row rises
    by its limit; zeros of whole columns.
    """

    x: Floats
    cost: float
    bound: float
    dual: Floats


class Programme:
    """Columns of one grade a tie: `cost` (x,) and the tie that each is of, `tie_of` (x,)."""

    def __init__(self, cost: Floats, tie_of: Indices) -> None:
        self._cost, self._tie_of = cost, tie_of
        # Costs of any unit are brought near 1, where the solver's tolerances mean something.
        self._unit = float(cost.max(initial=0.0)) or 1.0

    def relaxed(self, coefficients: Floats, most: Floats) -> ProgrammeSolution | None:
        """The optimum with columns between 0 and 1, rows (n, x) and (n,); None where there is none.

        Raises `KeyboardInterrupt` on Ctrl-C.
        """
        return self._solved(coefficients, most, None)

    def whole(
        self, coefficients: Floats, most: Floats, gap: float, start: Floats | None = None
    ) -> ProgrammeSolution | None:
        """Whole columns within `gap` of the cheapest; None where there are none.

        `start` (x,): columns that are known to be allowed. Raises `KeyboardInterrupt` on Ctrl-C.
        """
        return self._solved(coefficients, most, gap, start)

    def plainest(
        self, coefficients: Floats, most: Floats, kind_of: Indices, budget: float, start: Floats
    ) -> ProgrammeSolution | None:
        """Whole columns of as few kinds as are found, of which none costs more than the `budget`.

        `kind_of` (x,): the kind of each column, from 0; `start` (x,): columns that are allowed.
        Ends after `_NODES` nodes: fewer kinds may then be possible. Raises `KeyboardInterrupt`.
        """
        import highspy

        stop = _Stop()
        solver = _solver(stop)
        kinds = int(kind_of.max()) + 1
        # A kind is dearer than all that money can say; of equally many the cheapest.
        self._fill(solver, coefficients, most, whole=True, share=0.5 / max(budget, 1e-300))
        count = self._cost.size
        for kind in range(kinds):
            solver.addCol(1.0, 0.0, 1.0, 0, np.empty(0, np.int32), np.empty(0))
            members = np.flatnonzero(kind_of == kind)
            for column in members.tolist():
                pair = np.array([column, count + kind], np.int32)
                solver.addRow(-highspy.kHighsInf, 0.0, 2, pair, np.array([1.0, -1.0]))
        whole = np.full(kinds, int(highspy.HighsVarType.kInteger), np.uint8)
        solver.changeColsIntegrality(kinds, np.arange(count, count + kinds, dtype=np.int32), whole)
        paid = np.arange(count, dtype=np.int32)
        unit = budget or 1.0
        solver.addRow(-highspy.kHighsInf, 1.0 + FEASIBLE, count, paid, self._cost / unit)
        solver.setOptionValue("mip_max_nodes", _NODES)
        used = np.zeros(kinds)
        used[np.unique(kind_of[start > 0.5])] = 1.0
        every = np.concatenate([start, used])
        solver.setSolution(every.size, np.arange(every.size, dtype=np.int32), every)
        _run(solver, stop)
        status = solver.getModelStatus()
        if status == highspy.HighsModelStatus.kInterrupt:
            raise KeyboardInterrupt
        if (
            solver.getInfo().primal_solution_status
            != highspy.SolutionStatus.kSolutionStatusFeasible
        ):
            return None
        x = self._rounded(np.asarray(solver.getSolution().col_value, np.float64)[:count])
        return ProgrammeSolution(x, float(self._cost @ x), 0.0, np.zeros(len(most)))

    def _solved(
        self, coefficients: Floats, most: Floats, gap: float | None, start: Floats | None = None
    ) -> ProgrammeSolution | None:
        if not self._cost.size:
            nothing = np.zeros(len(most))
            free = bool((most >= -FEASIBLE).all())
            return ProgrammeSolution(self._cost.copy(), 0.0, 0.0, nothing) if free else None
        stop = _Stop()
        solver = _solver(stop)
        self._fill(solver, coefficients, most, whole=gap is not None)
        if gap is not None:
            solver.setOptionValue("mip_rel_gap", gap)
            solver.setOptionValue("mip_abs_gap", 0.0)
            if start is not None:
                columns = np.arange(start.size, dtype=np.int32)
                solver.setSolution(start.size, columns, start)
        _run(solver, stop)
        return self._read(solver, len(most), whole=gap is not None)

    def _fill(
        self,
        solver: highspy.Highs,
        coefficients: Floats,
        most: Floats,
        *,
        whole: bool,
        share: float | None = None,
    ) -> None:
        """Columns and rows; costs in their own unit, or times `share`."""
        import highspy

        count, none = self._cost.size, np.empty(0)
        costs = self._cost / self._unit if share is None else self._cost * share
        zeros, ones = np.zeros(count), np.ones(count)
        start = np.zeros(count, np.int32)
        solver.addCols(count, costs, zeros, ones, 0, start, np.empty(0, np.int32), none)
        if whole:
            kind = np.full(count, int(highspy.HighsVarType.kInteger), np.uint8)
            solver.changeColsIntegrality(count, np.arange(count, dtype=np.int32), kind)
        for tie in range(int(self._tie_of.max()) + 1):
            members = np.flatnonzero(self._tie_of == tie).astype(np.int32)
            solver.addRow(1.0, 1.0, members.size, members, np.ones(members.size))
        for row, right in zip(coefficients, most.tolist(), strict=True):
            columns = np.flatnonzero(row).astype(np.int32)
            solver.addRow(-highspy.kHighsInf, right, columns.size, columns, row[columns])

    def _read(self, solver: highspy.Highs, count: int, *, whole: bool) -> ProgrammeSolution | None:
        import highspy

        status = solver.getModelStatus()
        if status == highspy.HighsModelStatus.kInterrupt:
            raise KeyboardInterrupt
        if status != highspy.HighsModelStatus.kOptimal:
            if status == highspy.HighsModelStatus.kInfeasible:
                return None
            raise RuntimeError(f"HiGHS: {solver.modelStatusToString(status)}")
        solution, info = solver.getSolution(), solver.getInfo()
        x = np.clip(np.asarray(solution.col_value, np.float64), 0.0, 1.0)
        bound = info.mip_dual_bound if whole else info.objective_function_value
        dual = np.zeros(count)
        if whole:
            x = self._rounded(x)
        elif count:
            dual = np.maximum(-np.asarray(solution.row_dual, np.float64)[-count:], 0.0)
        bound -= _ROUNDING * (1.0 + abs(bound))
        return ProgrammeSolution(
            x, float(self._cost @ x), max(bound, 0.0) * self._unit, dual * self._unit
        )

    def _rounded(self, x: Floats) -> Floats:
        """The columns as whole as they are meant: the largest of every tie."""
        rounded = np.zeros(x.size)
        for tie in range(int(self._tie_of.max()) + 1):
            members = np.flatnonzero(self._tie_of == tie)
            rounded[members[np.argmax(x[members])]] = 1.0
        return rounded


def require_solver() -> None:
    """Raise `RequestError` (extra-missing) where HiGHS is not installed."""
    try:
        import highspy  # noqa: F401
    except ImportError:
        raise RequestError(
            Problem(
                "extra-missing",
                "a design is chosen by HiGHS, which is not installed",
                found="no package highspy",
                expected="highspy",
                hint="pip install 'truepose[design]'",
            )
        ) from None


class _Stop:
    """Whether the solver is to stop: set by Ctrl-C, asked by its callback."""

    def __init__(self) -> None:
        self.asked = False

    def __call__(self, _kind: Any, _message: str, _out: Any, into: Any, _data: Any) -> None:
        if self.asked and into is not None:
            into.user_interrupt = True


def _solver(stop: _Stop) -> highspy.Highs:
    import highspy

    class Quiet(highspy.Highs):
        """HiGHS without the line that its wrapper prints on stdout when it begins."""

        def __init__(self) -> None:
            super(highspy.Highs, self).__init__()
            self.setOptionValue("output_flag", False)
            self.setCallback(stop, None)
            self.startCallback(highspy.cb.HighsCallbackType.kCallbackMipInterrupt)
            self.startCallback(highspy.cb.HighsCallbackType.kCallbackSimplexInterrupt)

    solver = Quiet()
    for option, value in (
        ("threads", 1),
        ("parallel", "off"),
        ("random_seed", 0),
        ("primal_feasibility_tolerance", FEASIBLE),
        ("mip_feasibility_tolerance", FEASIBLE),
    ):
        solver.setOptionValue(option, value)
    return solver


def _run(solver: highspy.Highs, stop: _Stop) -> None:
    """Solve beside the main thread, which alone is told of Ctrl-C."""
    failed: list[BaseException] = []

    def run() -> None:
        try:
            solver.run()
        except BaseException as failure:  # told where it was asked
            failed.append(failure)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(_LISTEN)
    except KeyboardInterrupt:
        stop.asked = True
        thread.join()
        raise
    if failed:
        raise failed[0]


__all__ = ["FEASIBLE", "Programme", "ProgrammeSolution", "require_solver"]
