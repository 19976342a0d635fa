"""A live page that is open in a browser, asked and moved as its tests do it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import truepose as tp
from browser import PATIENCE, Heard

SHOWN = ["planar_two_slider", "hexapod", "linear_delta", "tricept"]
"""Machines whose live pages are opened."""
QUICK = {"planar_two_slider"}

DRAWN = "() => document.documentElement.dataset.liveReady === 'drawn'"
STEP = """([name, value]) => {
  const input = document.querySelector(`[data-of="${name}"] input[type=number]`);
  input.value = value;
  input.dispatchEvent(new Event("input"));
}"""
SLIDE = """([name, share]) => {
  const range = document.querySelector(`[data-of="${name}"] input[type=range]`);
  range.value = Number(range.min) + share * (range.max - range.min);
  range.dispatchEvent(new Event("input"));
}"""
STEPS = "() => document.getElementById('live').dataset.steps"
NUMBER = """name => {
  const cell = document.querySelector(`#live [data-of="${name}"]`);
  return cell && "si" in cell.dataset ? Number(cell.dataset.si) : null;
}"""
PIXELS = """name => document.querySelector(`#live [data-live="${name}"]`).toDataURL()"""
SETTING = "() => document.getElementById('live-setting').textContent"
SETTLED = """() => {
  const {settled, map} = document.getElementById("live").dataset;
  return settled === "yes" && map === "fine";
}"""
WORD = """state => document.querySelector(`#live [data-of="${state}.verdict"]`).textContent"""


@dataclass(kw_only=True)
class LiveVisit(Heard):
    """A page with a live part, and the machine that it is of.

    `page` is Playwright's, or another browser's with `evaluate` and `wait_for_function`.
    """

    page: Any
    machine: tp.Machine

    @property
    def setting(self) -> Any:
        return json.loads(self.page.evaluate(SETTING))

    def step(self, name: str, value: float) -> None:
        """Type a number into a control, in the units shown, and wait until it is worked out."""
        self._changed(STEP, [name, value])

    def slide(self, name: str, share: float) -> None:
        """The same by its slider, of which this share is to the left."""
        self._changed(SLIDE, [name, share])

    def _changed(self, how: str, by: list[Any]) -> None:
        before = self.page.evaluate(STEPS)
        self.page.evaluate(how, by)
        later = f"before => ({STEPS})() !== before"
        self.page.wait_for_function(later, arg=before, timeout=PATIENCE)

    def settle(self) -> None:
        """Wait until the worker has told everything, and the map is the fine one."""
        self.page.wait_for_function(SETTLED, timeout=PATIENCE)

    def number(self, name: str) -> float | None:
        found: float | None = self.page.evaluate(NUMBER, name)
        return found

    def word(self, state: str) -> str:
        found: str = self.page.evaluate(WORD, state)
        return found

    def pixels(self, name: str) -> str:
        found: str = self.page.evaluate(PIXELS, name)
        return found


def moved(live: LiveVisit) -> tuple[list[float], tp.Condition]:
    """Move a slider of each kind; the pose and the condition that the page shows then, SI."""
    bundle = live.setting["bundle"]
    units, workspace = bundle["units"], bundle["workspace"]
    pose = list(workspace["home"])
    for at, name in enumerate(live.machine.commanded):
        unit = units["length" if name in "xyz" else "angle"]
        shown = (pose[at] + 0.2 * (workspace["high"][at] - workspace["low"][at])) / unit["si"]
        live.step(f"pose.{name}", round(shown, 3))
        pose[at] = round(shown, 3) * unit["si"]
    warm = units["temperature"]
    live.step("temperature", 31.5)
    temperature = dict.fromkeys(
        (one["part"] for one in bundle["parts"]), (31.5 + warm["offset"]) * warm["si"]
    )
    first = bundle["parts"][0]["part"]
    live.step(f"temperature.{first}", 33.0)
    temperature[first] = (33.0 + warm["offset"]) * warm["si"]
    force = list(live.machine.condition.force)
    live.step("force.x", 7.5)
    force[0] = 7.5 * units["force"]["si"]
    return pose, live.machine.condition.replace(temperature=temperature, force=force)
