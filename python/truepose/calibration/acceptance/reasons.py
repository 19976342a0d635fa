"""The reasons of a verdict as data, a code and values, and the sentences that are made of them.

This is the only place where the verdict is put into words: nothing that decides reads a sentence.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from truepose.calibration.acceptance import sentences
from truepose.calibration.acceptance.tool_uncertainty import KEPT, ToolUncertainty
from truepose.files.shown_units import METRIC, ShownUnits
from truepose.representation import Facts, Represented

NOTHING = 100.0
"""Half bands of a tolerance: a larger uncertainty is said in words, not as a number."""

Values = Mapping[str, Any]


@dataclass(frozen=True, eq=False, repr=False)
class Reason(Represented):
    """A reason against the calibration, or a warning: its code, and the values it rests on, SI.

    `docs/calibration_gate.md` lists the codes; the functions of `SENTENCES` read the values.
    `shown`: the units of the sentence.
    """

    code: str
    values: Values = field(default_factory=dict)
    shown: ShownUnits = METRIC

    def _facts(self) -> Facts:
        yield "code", self.code
        yield "sentence", self.sentence

    @property
    def sentence(self) -> str:
        """For people, without its full stop."""
        return SENTENCES[self.code](self.values, self.shown)


@dataclass(frozen=True)
class HeldOut:
    """Root mean square of errors at poses that were not fitted, before and after, and its noise.

    All in `unit` ("m", "rad"), or normalised by the uncertainties ("1", noise 1). `consistent`:
    the error after is no larger than the fit promises for these poses, which then say nothing
    against it: where it promises little, what it knows of the tool shows that.
    """

    before: float
    after: float
    noise: float = 1.0
    unit: str = "1"
    consistent: bool = False

    def shown(self, value: float, units: ShownUnits, digits: int = 2) -> str:
        """A value of it for people: "12 µm", "1.2 times the noise"."""
        if self.unit == "1":
            return f"{sentences.times(value, digits)} times the noise"
        return sentences.quantity(value, self.unit, digits, units)


class ToolSize(NamedTuple):
    """`quantity` of the tool, "position" or "rotation", at the worst pose: m or rad.

    `before`: what it is compared with, None where there is nothing.
    """

    quantity: str
    unit: str
    after: float
    before: float | None = None


Sizes = tuple[float | None, float | None]


def at_worst_pose(after: tuple[float, float], before: Sizes = (None, None)) -> list[ToolSize]:
    """Position and rotation at the worst pose."""
    quantities = (("position", "m"), ("rotation", "rad"))
    return [
        ToolSize(*named, size, was)
        for named, size, was in zip(quantities, after, before, strict=True)
    ]


def open_clauses(values: Values) -> list[str]:
    """What directions leave open. `open`: pairs of them (k, n), and whether within tolerances."""
    return [
        clause
        for directions, within in values["open"]
        for clause in sentences.undetermined(
            directions, values["labels"], values["by"], within_tolerances=within
        )
    ]


def verdict_sentences(reasons: Sequence[Reason], gain: str) -> str:
    """Yes with its `gain`, or no with its reasons."""
    if not reasons:
        return f"Yes: {gain}."
    wrong = [reason.sentence for reason in reasons if reason.code == WRONG_DATA]
    others = "; ".join(reason.sentence for reason in reasons if reason.code != WRONG_DATA)
    if not wrong:
        return f"No: {others}."
    return f"No: {wrong[0]}." + (f" As they are: {others}." if others else "")


def gain_sentence(
    sizes: Sequence[ToolSize], left_out: Sequence[str], falling: HeldOut | None, shown: ShownUnits
) -> str:
    """What was gained: `sizes` that the tool keeps, and what they leave out.

    And where one shows it, of the errors that `falling` held.
    """
    texts = []
    for size in sizes:
        if size.after == 0.0 and not size.before:
            continue
        was = "" if size.before is None else f", against {_of(size, size.before, shown)} before"
        texts.append(
            f"the tool's {size.quantity} becomes known to within {_of(size, size.after, shown)} at "
            f"the worst pose ({100.0 * KEPT:g} %){was}"
        )
    if texts and left_out:
        texts[-1] += f", {' and '.join(left_out)} left out"
    texts = texts or ["the unknowns are determined"]
    if falling is not None:
        was, now = (falling.shown(size, shown) for size in (falling.before, falling.after))
        texts.append(f"on poses that were not fitted the error falls from {was} to {now}")
    return "; ".join(texts)


def left_out_of(after: ToolUncertainty, relative: bool) -> list[str]:
    """What the promised sizes of the tool do not hold, in words."""
    parasitic = [name for name in after.components if name not in after.commanded]
    moved = [
        name
        for name in parasitic
        if after.standard[:, after.components.index(name)].max(initial=0.0) > 0.0
    ]
    texts = ["where the machine as a whole stands in the room"] if relative else []
    if moved:
        texts.append(f"its parasitic motion in {sentences.listed(moved)}")
    return texts


# --- reasons against it ---------------------------------------------------------------------------


def _wrong_data(values: Values, shown: ShownUnits) -> str:
    # They begin with the instrument's name, which stays as it is written.
    return f"the measurements look wrong. {'. '.join(values['suspected'])}"


def _open_choice(values: Values, shown: ShownUnits) -> str:
    return "; ".join(values["suspected"])


def _no_fit(values: Values, shown: ShownUnits) -> str:
    failure: str = values["failure"]
    return failure


def _open(values: Values, shown: ShownUnits) -> str:
    return "; ".join(open_clauses(values))


def _less_than_tolerance(values: Values, shown: ShownUnits) -> str:
    label, unit, half, own = (values[key] for key in ("label", "unit", "half", "uncertainty"))
    if np.isfinite(half) and own > half:
        known = f"its tolerance is {sentences.stated(half, unit, shown)}"
    else:
        sigma = sentences.quantity(values["deviation"], unit, units=shown)
        known = f"its tolerance already to {sigma}"
    if np.isfinite(half) and own > NOTHING * half:
        text = f"the measurements say almost nothing about {label}, {known}"
    else:
        uncertainty = sentences.quantity(own, unit, units=shown)
        text = f"the measurements determine {label} only to {uncertainty}, {known}"
    more = values["others"]
    if more:
        others = "one more unknown is" if more == 1 else f"{more} more are"
        text += f" ({others} less certain than the tolerance, too)"
    return text


def _of(size: ToolSize, value: float, shown: ShownUnits) -> str:
    return sentences.quantity(value, size.unit, units=shown)


def _against(sizes: Sequence[ToolSize], link: str, whose: str, shown: ShownUnits) -> list[str]:
    return [
        f"the tool's {size.quantity} {link} {_of(size, size.after, shown)}, against "
        f"{_of(size, size.before or 0.0, shown)} {whose}"
        for size in sizes
    ]


_AS_FILED = "of the machine as filed"


def _kept(values: Values) -> str:
    if not values["kept"]:
        return ""
    return "; but the machine as filed already keeps the accuracy that is asked"


def _no_gain(values: Values, shown: ShownUnits) -> str:
    whose = "measured before" if values["measured"] else _AS_FILED
    first, *rest = values["sizes"]
    texts = _against([first], "would be uncertain by", whose, shown)
    texts += _against(rest, "by", whose, shown)
    return f"at the worst pose of the workspace {', and '.join(texts)}{_kept(values)}"


def _not_identified(values: Values, shown: ShownUnits) -> str:
    """As a reason; as a warning (with `exact`) what would be if they were exact."""
    named = sentences.listed(sentences.collapsed(values["labels"], values["every"]))
    if "exact" not in values:
        texts = ", and ".join(_against(values["sizes"], "uncertain by", _AS_FILED, shown))
        return (
            f"the tolerances that were not identified ({named}) leave {texts}, at the worst pose "
            f"of the workspace: identify them too{_kept(values)}"
        )
    more = [
        f"the tool's {size.quantity} would be known to {_of(size, size.after, shown)} instead of "
        f"{_of(size, size.before or 0.0, shown)}"
        for size in values["exact"]
    ]
    return (
        f"{named} were not identified and count with their tolerances: if they were exact, "
        f"{' and '.join(more)}; identify them too if this is too uncertain"
    )


def _gain_unconfirmed(values: Values, shown: ShownUnits) -> str:
    held: HeldOut = values["held_out"]
    was, now = (held.shown(size, shown, 3) for size in (held.before, held.after))
    much = "nothing" if values["share"] < 0.005 else f"only {100.0 * values['share']:.0f} %"
    return (
        f"of the variance of what is commanded the measurements take away {much}, at the worst "
        f"pose, and poses that were not fitted show no gain: {was} before, {now} after"
        f"{_kept(values)}"
    )


def _not_confirmed(values: Values, shown: ShownUnits) -> str:
    held: HeldOut = values["held_out"]
    was, now = (held.shown(size, shown) for size in (held.before, held.after))
    change = f"falls from {was} to {now} only"
    if held.after >= held.before:
        change = f"does not fall: {was} before, {now} after"
    noise = f"the noise is {held.shown(held.noise, shown)}"
    if held.unit == "1":
        noise = "that is above the noise"
    return f"on poses that were not fitted the error {change}, though {noise}"


def _absurd_value(values: Values, shown: ShownUnits) -> str:
    unit, half, off = values["unit"], values["half"], abs(values["off"])
    would = ""
    if np.isfinite(values["value"]):
        would = f"{sentences.quantity(values['value'], unit, 4, shown)}, "
    times = off / (half if np.isfinite(half) else values["deviation"])
    what = "its tolerance" if np.isfinite(half) else "the standard deviation of its tolerance"
    text = (
        f"{values['label']} would be {would}{sentences.quantity(off, unit, 3, shown)} off its "
        f"drawing, {sentences.times(times)} times {what}"
    )
    more = sentences.collapsed(values["others"], values["every"])
    return f"{text}; {sentences.listed(more)} would be off too" if more else text


def _contradicts_noise(values: Values, shown: ShownUnits) -> str:
    return (
        f"the measurements differ from the calibrated machine {sentences.times(values['rms'])} "
        "times as much as their uncertainties allow: the model, the data or the uncertainties are "
        "wrong"
    )


# --- warnings -------------------------------------------------------------------------------------


def _noise_too_small(values: Values, shown: ShownUnits) -> str:
    return (
        f"the residuals are {sentences.times(values['rms'])} times as large as the stated "
        "uncertainties, which have been multiplied by this factor"
    )


def _noise_too_large(values: Values, shown: ShownUnits) -> str:
    return (
        f"the residuals are only {sentences.times(values['rms'])} times the stated uncertainties, "
        "which seem too large"
    )


def _rests_on_tolerances(values: Values, shown: ShownUnits) -> str:
    return (
        f"{_open(values, shown)}: what is stated for these rests on their tolerances, not on the "
        "measurements"
    )


def _one_sided(values: Values, shown: ShownUnits) -> str:
    size: ToolSize = values["size"]
    known = _of(size, size.after, shown)
    return f"the tool's {size.quantity} is not known better than before, {known}"


def _always(text: str) -> Callable[[Values, ShownUnits], str]:
    return lambda values, shown: text


WRONG_DATA = "data-look-wrong"
OPEN_CHOICE = "open-choice"
"""Of suspicions that the data could be others, not that they are wrong."""
SENTENCES: Mapping[str, Callable[[Values, ShownUnits], str]] = {
    WRONG_DATA: _wrong_data,
    OPEN_CHOICE: _open_choice,
    "no-fit": _no_fit,
    "out-of-reach": _always(
        "the calibrated machine reaches none of the poses of the workspace: it cannot be assembled "
        "there"
    ),
    "not-determined": _open,
    "not-told-apart": _open,
    "less-than-tolerance": _less_than_tolerance,
    "no-gain": _no_gain,
    "gain-unconfirmed": _gain_unconfirmed,
    "not-identified": _not_identified,
    "not-confirmed": _not_confirmed,
    "absurd-value": _absurd_value,
    "contradicts-noise": _contradicts_noise,
    "noise-too-small": _noise_too_small,
    "noise-too-large": _noise_too_large,
    "noise-unchecked": _always(
        "there are no more readings than unknowns, so the stated uncertainties cannot be checked"
    ),
    "rests-on-tolerances": _rests_on_tolerances,
    "gauge": _always(
        "where the machine as a whole stands in the instrument's frame is not determined, which "
        "does not affect its accuracy: the uncertainties at the tool leave it out"
    ),
    "one-sided": _one_sided,
    "nothing-to-compare": _always(
        "not every unknown has a tolerance, and no error was measured before: nothing shows that "
        "the machine becomes better"
    ),
    "not-needed": _always(
        "the machine as filed already keeps the accuracy that is asked: calibration is not needed"
    ),
}
"""By code: the sentence that a reason's values make."""

__all__ = ["HeldOut", "Reason", "ToolSize"]
