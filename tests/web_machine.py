"""A machine in the page's kernel beside the library's, in any condition."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

import truepose as tp
from truepose.arrays import Floats
from truepose.live import bundle
from truepose.machine import Condition, Machine
from truepose.runs.displacement import sum_deviations
from truepose.runs.poses import PoseRun
from truepose.runs.variables import Variables, variables_of
from truepose.sources import PoseBlock, Source
from truepose.uncertainty_analysis.truncation import Ends
from web_kernel import WebKernel


@dataclass(frozen=True, eq=False)
class WebMachine:
    """A machine file, known to a running module by a number."""

    kernel: WebKernel
    machine: Machine
    bundle: dict[str, Any]
    number: int

    @classmethod
    def of(
        cls, kernel: WebKernel, path: Path, settings: Mapping[str, str] | None = None
    ) -> WebMachine:
        machine = tp.load(path, settings=dict(settings or {}))
        made = bundle(machine)
        return cls(kernel, machine, made, kernel.ask("machine", bundle=made)["machine"])

    def ask(self, op: str, times: int = 1, **values: Any) -> dict[str, Any]:
        return self.kernel.ask(op, times, machine=self.number, **values)

    @cached_property
    def live(self) -> list[Source]:
        """The sources that the page evaluates."""
        names = {source["name"] for source in self.bundle["sources"] if source["live"]}
        return [source for source in self.machine.sources if source.name in names]

    def poses(self, count: int, seed: int) -> Floats:
        """Drawn from the workspace's box."""
        workspace = self.bundle["workspace"]
        low, high = np.array(workspace["low"]), np.array(workspace["high"])
        return low + (high - low) * np.random.default_rng(seed).random((count, low.size))

    def condition(self, seed: int) -> tuple[dict[str, Any], Condition]:
        """Other temperatures of parts and another wrench, for the page and for the library."""
        random = np.random.default_rng(seed)
        reference = self.bundle["reference_temperature"]
        temperature = {
            part["part"]: reference + float(random.uniform(-10.0, 30.0))
            for part in self.bundle["parts"]
        }
        wrench = [0.0] * 6
        if any(source.get("under_wrench") for source in self.bundle["sources"]):
            wrench = [*random.uniform(-200.0, 200.0, 3).tolist(), *random.uniform(-5.0, 5.0, 3)]
        page = {"temperature": temperature, "wrench": wrench}
        file = self.machine.condition
        given = file.replace(
            temperature=temperature if temperature else file.reference_temperature,
            force=tuple(wrench[:3]),
            moment=tuple(wrench[3:]),
        )
        return page, given

    def block(self, poses: Floats, condition: Condition) -> PoseBlock:
        """The usable ones of some poses."""
        (block,) = PoseRun(self.machine, poses, condition)
        return replace(block, condition=condition)

    def variables(self, block: PoseBlock) -> Variables:
        """What the live sources leave unknown there, as bounds and samples take it."""
        acting = [source for source in self.live if source.acts(block.condition)]
        deviations = [source.deviation(self.machine, block.condition, block) for source in acting]
        return Ends.of(None).truncated(variables_of(self.machine, acting, deviations))

    def moved(self, block: PoseBlock) -> Any:
        """What the live sources are known to do there, together."""
        parts = []
        for source in self.live:
            if source.acts(block.condition):
                deviation = source.deviation(self.machine, block.condition, block)
                parts.append((deviation.parameters, deviation.shift))
        return sum_deviations(parts)
