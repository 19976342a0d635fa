"""Where the tool of a parallel kinematic machine really is, why, and what to command instead.

    import truepose as tp

    machine = tp.load("machines/planar_two_slider.toml")
    errors = tp.budget(machine)
    corrections = tp.compensate(machine)

Everything is imported when it is first used, so that `import truepose` costs nothing.
"""

from __future__ import annotations

TYPE_CHECKING = False  # to type checkers true; `typing` is not imported for it

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path
    from typing import Any

    from truepose import errors
    from truepose._kernel import threads
    from truepose.calibration.calibrate import calibrate
    from truepose.calibration.planning.plan import plan
    from truepose.compensation.compensate import compensate
    from truepose.controllers import export, import_machine
    from truepose.controllers.gcode import correct_program
    from truepose.design.allocate import allocate
    from truepose.error_budget.evaluate import budget
    from truepose.error_budget.over_time import over_time
    from truepose.error_budget.strain import strain
    from truepose.machine import Condition, Machine
    from truepose.machine_tests.circular import circular_test
    from truepose.plausibility import oddities
    from truepose.reporting.check import check
    from truepose.reporting.compare import compare
    from truepose.reporting.report import report
    from truepose.runs.forward_solutions import forward_solutions
    from truepose.runs.working_modes import inverse_solutions
    from truepose.studies.study import study
    from truepose.uncertainty_analysis.bounds import bounds
    from truepose.uncertainty_analysis.functions.inputs import Input
    from truepose.uncertainty_analysis.monte_carlo import monte_carlo
    from truepose.uncertainty_analysis.shares import shares
    from truepose.uncertainty_analysis.uncertainty import uncertainty
    from truepose.uncertainty_analysis.worst_case import worst_case
    from truepose.verdict.accuracy import accuracy
    from truepose.verdict.tightening import tightening
    from truepose.workpiece.evaluate import part

    __version__: str

_WHERE = {
    "Condition": "truepose.machine",
    "Input": "truepose.uncertainty_analysis.functions.inputs",
    "Machine": "truepose.machine",
    "accuracy": "truepose.verdict.accuracy",
    "allocate": "truepose.design.allocate",
    "bounds": "truepose.uncertainty_analysis.bounds",
    "budget": "truepose.error_budget.evaluate",
    "calibrate": "truepose.calibration.calibrate",
    "check": "truepose.reporting.check",
    "circular_test": "truepose.machine_tests.circular",
    "compare": "truepose.reporting.compare",
    "compensate": "truepose.compensation.compensate",
    "correct_program": "truepose.controllers.gcode",
    "export": "truepose.controllers",
    "forward_solutions": "truepose.runs.forward_solutions",
    "import_machine": "truepose.controllers",
    "inverse_solutions": "truepose.runs.working_modes",
    "monte_carlo": "truepose.uncertainty_analysis.monte_carlo",
    "oddities": "truepose.plausibility",
    "over_time": "truepose.error_budget.over_time",
    "part": "truepose.workpiece.evaluate",
    "plan": "truepose.calibration.planning.plan",
    "report": "truepose.reporting.report",
    "shares": "truepose.uncertainty_analysis.shares",
    "strain": "truepose.error_budget.strain",
    "study": "truepose.studies.study",
    "threads": "truepose._kernel",
    "tightening": "truepose.verdict.tightening",
    "uncertainty": "truepose.uncertainty_analysis.uncertainty",
    "worst_case": "truepose.uncertainty_analysis.worst_case",
}

_HANDED_ON = {
    "answers_html": "truepose.reporting.notebook",
    "calibration_html": "truepose.reporting.notebook",
    "facts_of_answer": "truepose.reporting.notebook",
    "plot": "truepose.reporting.plot",
}
"""Not public: what methods of lower layers hand on to (`lazy_names.of_the_package`)."""

__all__ = [
    "Condition",
    "Input",
    "Machine",
    "__version__",
    "accuracy",
    "allocate",
    "bounds",
    "budget",
    "calibrate",
    "check",
    "circular_test",
    "compare",
    "compensate",
    "correct_program",
    "errors",
    "export",
    "forward_solutions",
    "import_machine",
    "inverse_solutions",
    "load",
    "monte_carlo",
    "oddities",
    "over_time",
    "part",
    "plan",
    "report",
    "shares",
    "strain",
    "study",
    "threads",
    "tightening",
    "uncertainty",
    "worst_case",
]


def load(path: str | Path, settings: Mapping[str, str] | Sequence[str] = ()) -> Machine:
    """Read a machine file.

    `settings` changes its values before they are validated: `["strut.1.length=501"]` or
    `{"strut.1.length": "501"}`, in the file's units. Raises `truepose.errors.MachineFileError`
    with every problem of the file at once, `RequestError` for a setting that leads nowhere.
    """
    from truepose import machine, sources

    return machine.load(path, settings=settings, registry=sources.REGISTRY)


if not TYPE_CHECKING:  # type checkers know the names above, and refuse all others

    def __getattr__(name: str) -> Any:
        from importlib import import_module

        where = _WHERE.get(name) or _HANDED_ON.get(name)
        if where is not None:
            value = getattr(import_module(where), name)
        elif name == "errors":
            value = import_module("truepose.errors")
        elif name == "__version__":
            from truepose.version import version

            value = version()
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted(__all__)
