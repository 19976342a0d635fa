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
from truepose.language import marked, say, say_counted
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
            return say("{value} times the noise", value=sentences.times(value, digits))
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
        return say("Yes: {gain}.", gain=gain)
    wrong = [reason.sentence for reason in reasons if reason.code == WRONG_DATA]
    others = "; ".join(reason.sentence for reason in reasons if reason.code != WRONG_DATA)
    if not wrong:
        return say("No: {reasons}.", reasons=others)
    no = say("No: {reasons}.", reasons=wrong[0])
    return f"{no} {say('As they are: {others}.', others=others)}" if others else no


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
        text = say(
            "the tool's {quantity} becomes known to within {size} at the worst pose ({percent} %)",
            quantity=_named(size),
            size=_of(size, size.after, shown),
            percent=marked(f"{100.0 * KEPT:g}"),
        )
        if size.before is not None:
            text += ", " + say("against {size} before", size=_of(size, size.before, shown))
        texts.append(text)
    if texts and left_out:
        texts[-1] += ", " + say("{names} left out", names=sentences.listed(left_out))
    texts = texts or [say("the unknowns are determined")]
    if falling is not None:
        was, now = (falling.shown(size, shown) for size in (falling.before, falling.after))
        texts.append(
            say(
                "on poses that were not fitted the error falls from {was} to {now}",
                was=was,
                now=now,
            )
        )
    return "; ".join(texts)


def left_out_of(after: ToolUncertainty, relative: bool) -> list[str]:
    """What the promised sizes of the tool do not hold, in words."""
    parasitic = [name for name in after.components if name not in after.commanded]
    moved = [
        name
        for name in parasitic
        if after.standard[:, after.components.index(name)].max(initial=0.0) > 0.0
    ]
    texts = [say("where the machine as a whole stands in the room")] if relative else []
    if moved:
        texts.append(say("its parasitic motion in {names}", names=sentences.listed(moved)))
    return texts


# --- reasons against it ---------------------------------------------------------------------------


def _wrong_data(values: Values, shown: ShownUnits) -> str:
    # They begin with the instrument's name, which stays as it is written.
    return say("the measurements look wrong. {suspected}", suspected=". ".join(values["suspected"]))


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
        known = say("its tolerance is {half}", half=sentences.stated(half, unit, shown))
    else:
        sigma = sentences.quantity(values["deviation"], unit, units=shown)
        known = say("its tolerance already to {sigma}", sigma=sigma)
    if np.isfinite(half) and own > NOTHING * half:
        text = say(
            "the measurements say almost nothing about {label}, {known}", label=label, known=known
        )
    else:
        uncertainty = sentences.quantity(own, unit, units=shown)
        text = say(
            "the measurements determine {label} only to {uncertainty}, {known}",
            label=label,
            uncertainty=uncertainty,
            known=known,
        )
    more = values["others"]
    if more:
        others = say_counted(
            "one more unknown is less certain than the tolerance, too",
            "{count} more are less certain than the tolerance, too",
            more,
        )
        text += f" ({others})"
    return text


def _of(size: ToolSize, value: float, shown: ShownUnits) -> str:
    return sentences.quantity(value, size.unit, units=shown)


def _named(size: ToolSize) -> str:
    return say("position") if size.quantity == "position" else say("rotation")


def _compared(size: ToolSize, shown: ShownUnits, *, measured: bool = False) -> dict[str, str]:
    """The places of a sentence that compares a size with what it was."""
    before = _of(size, size.before or 0.0, shown)
    return {
        "quantity": _named(size),
        "size": _of(size, size.after, shown),
        "before": say("{size} measured before", size=before)
        if measured
        else say("{size} of the machine as filed", size=before),
    }


def _kept(values: Values) -> str:
    if not values["kept"]:
        return ""
    return "; " + say("but the machine as filed already keeps the accuracy that is asked")


def _no_gain(values: Values, shown: ShownUnits) -> str:
    first, *rest = (
        _compared(size, shown, measured=bool(values["measured"])) for size in values["sizes"]
    )
    text = say(
        "at the worst pose of the workspace the tool's {quantity} would be uncertain by {size}, "
        "against {before}",
        **first,
    )
    for other in rest:
        text += ", " + say("and the tool's {quantity} by {size}, against {before}", **other)
    return text + _kept(values)


def _not_identified(values: Values, shown: ShownUnits) -> str:
    """As a reason; as a warning (with `exact`) what would be if they were exact."""
    named = sentences.listed(sentences.collapsed(values["labels"], values["every"]))
    if "exact" not in values:
        first, *rest = (_compared(size, shown) for size in values["sizes"])
        text = say(
            "the tolerances that were not identified ({names}) leave the tool's {quantity} "
            "uncertain by {size}, against {before}",
            names=named,
            **first,
        )
        for other in rest:
            text += ", " + say(
                "and the tool's {quantity} uncertain by {size}, against {before}", **other
            )
        asked = say("at the worst pose of the workspace: identify them too")
        return f"{text}, {asked}{_kept(values)}"
    more = [
        say(
            "the tool's {quantity} would be known to {size} instead of {other}",
            quantity=_named(size),
            size=_of(size, size.after, shown),
            other=_of(size, size.before or 0.0, shown),
        )
        for size in values["exact"]
    ]
    return say(
        "{names} were not identified and count with their tolerances: if they were exact, "
        "{more}; identify them too if this is too uncertain",
        names=named,
        more=sentences.listed(more),
    )


def _gain_unconfirmed(values: Values, shown: ShownUnits) -> str:
    held: HeldOut = values["held_out"]
    was, now = (held.shown(size, shown, 3) for size in (held.before, held.after))
    much = (
        say("nothing")
        if values["share"] < 0.005
        else say("only {share} %", share=marked(f"{100.0 * values['share']:.0f}"))
    )
    return say(
        "of the variance of what is commanded the measurements take away {much}, at the "
        "worst pose, and poses that were not fitted show no gain: {was} before, {now} "
        "after",
        much=much,
        was=was,
        now=now,
    ) + _kept(values)


def _not_confirmed(values: Values, shown: ShownUnits) -> str:
    held: HeldOut = values["held_out"]
    was, now = (held.shown(size, shown) for size in (held.before, held.after))
    change = say("falls from {was} to {now} only", was=was, now=now)
    if held.after >= held.before:
        change = say("does not fall: {was} before, {now} after", was=was, now=now)
    noise = say("the noise is {noise}", noise=held.shown(held.noise, shown))
    if held.unit == "1":
        noise = say("that is above the noise")
    return say(
        "on poses that were not fitted the error {change}, though {noise}",
        change=change,
        noise=noise,
    )


def _absurd_value(values: Values, shown: ShownUnits) -> str:
    unit, half, off = values["unit"], values["half"], abs(values["off"])
    would = ""
    if np.isfinite(values["value"]):
        would = f"{sentences.quantity(values['value'], unit, 4, shown)}, "
    times = off / (half if np.isfinite(half) else values["deviation"])
    what = (
        say("its tolerance")
        if np.isfinite(half)
        else say("the standard deviation of its tolerance")
    )
    text = say(
        "{label} would be {would}{off} off its drawing, {times} times {what}",
        label=values["label"],
        would=would,
        off=sentences.quantity(off, unit, 3, shown),
        times=sentences.times(times),
        what=what,
    )
    more = sentences.collapsed(values["others"], values["every"])
    return (
        say("{text}; {names} would be off too", text=text, names=sentences.listed(more))
        if more
        else text
    )


def _contradicts_noise(values: Values, shown: ShownUnits) -> str:
    return say(
        "the measurements differ from the calibrated machine {rms} times as much as their "
        "uncertainties allow: the model, the data or the uncertainties are wrong",
        rms=sentences.times(values["rms"]),
    )


# --- warnings -------------------------------------------------------------------------------------


def _noise_too_small(values: Values, shown: ShownUnits) -> str:
    return say(
        "the residuals are {rms} times as large as the stated uncertainties, which have been "
        "multiplied by this factor",
        rms=sentences.times(values["rms"]),
    )


def _noise_too_large(values: Values, shown: ShownUnits) -> str:
    return say(
        "the residuals are only {rms} times the stated uncertainties, which seem too large",
        rms=sentences.times(values["rms"]),
    )


def _rests_on_tolerances(values: Values, shown: ShownUnits) -> str:
    return say(
        "{open}: what is stated for these rests on their tolerances, not on the measurements",
        open=_open(values, shown),
    )


def _one_sided(values: Values, shown: ShownUnits) -> str:
    size: ToolSize = values["size"]
    known = _of(size, size.after, shown)
    return say(
        "the tool's {quantity} is not known better than before, {known}",
        quantity=_named(size),
        known=known,
    )


def _always(said: Callable[[], str]) -> Callable[[Values, ShownUnits], str]:
    return lambda values, shown: said()


WRONG_DATA = "data-look-wrong"
OPEN_CHOICE = "open-choice"
"""Of suspicions that the data could be others, not that they are wrong."""
SENTENCES: Mapping[str, Callable[[Values, ShownUnits], str]] = {
    WRONG_DATA: _wrong_data,
    OPEN_CHOICE: _open_choice,
    "no-fit": _no_fit,
    "out-of-reach": _always(
        lambda: say(
            "the calibrated machine reaches none of the poses of the workspace: it cannot be "
            "assembled there"
        )
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
        lambda: say(
            "there are no more readings than unknowns, so the stated uncertainties cannot be "
            "checked"
        )
    ),
    "rests-on-tolerances": _rests_on_tolerances,
    "gauge": _always(
        lambda: say(
            "where the machine as a whole stands in the instrument's frame is not determined, "
            "which does not affect its accuracy: the uncertainties at the tool leave it out"
        )
    ),
    "one-sided": _one_sided,
    "nothing-to-compare": _always(
        lambda: say(
            "not every unknown has a tolerance, and no error was measured before: nothing shows "
            "that the machine becomes better"
        )
    ),
    "not-needed": _always(
        lambda: say(
            "the machine as filed already keeps the accuracy that is asked: calibration is not "
            "needed"
        )
    ),
}
"""By code: the sentence that a reason's values make."""

__all__ = ["HeldOut", "Reason", "ToolSize"]
