"""What the readers of LinuxCNC's configurations share: units, limits, the workspace, problems."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal

from truepose.controllers._hal_text import hal_text, ini_entries, value_of
from truepose.controllers._linuxcnc_files import UNITS, Configuration, configuration, is_ini, read
from truepose.controllers._reader import ControllerFile, Setting
from truepose.controllers._template import one_line
from truepose.errors import Fault, Problem, ReadingError
from truepose.files.wording import one_of

Range = tuple[Decimal, Decimal]

UNIT = Setting("LINEAR_UNITS of the configuration, mm or inch, where no INI says it", None)

MEANT = 30
"""How many times the machine's size a limit may be: a larger one says that there is none."""


def configuration_of(file: ControllerFile) -> Configuration:
    """The configuration that a file belongs to."""

    def beside(name: str) -> tuple[str, str] | None:
        try:
            others = file.included(name)
        except ReadingError:
            return None
        return (str(others[0].path), others[0].text) if others else None

    return configuration(file.text, str(file.path), file.path.stem, beside)


def kinematics_named(text: str, kinematics: str) -> bool:
    """Whether a text is an INI with this kinematics, or a HAL file that sets a pin of it."""
    if kinematics not in text:
        return False
    if is_ini(text):
        entry = value_of(ini_entries(text, ""), "KINS", "KINEMATICS")
        return entry is not None and entry.text.split()[:1] == [kinematics]
    return any(pin.key.startswith(f"{kinematics}.") for pin in hal_text(text, "").pins)


def unit_of(
    file: ControllerFile,
    config: Configuration,
    settings: Mapping[str, float | str],
    problems: list[Problem],
) -> tuple[str, Decimal]:
    """The unit of length, as a machine file writes it, and mm of it."""
    entry = value_of(config.ini, "TRAJ", "LINEAR_UNITS")
    text = str(settings.get("units.length", "" if entry is None else entry.text)).lower()
    if text in UNITS:
        return UNITS[text]
    if text:
        message = "the unit of length is not known"
        fault = Fault("import-value", message, repr(text[:40]), one_of(UNITS))
        said = entry is None or "units.length" in settings
        problems.append(
            file.problem(fault) if said or entry is None else fault.at(entry.file, entry.line)
        )
    else:
        problems.append(
            file.problem(
                Fault(
                    "import-incomplete",
                    "nothing says what the numbers' unit is",
                    found="no INI with [TRAJ]LINEAR_UNITS",
                    expected="mm or inch",
                    hint="read the INI, or say it: --set units.length=mm",
                )
            )
        )
    return UNITS["mm"]


def pins(
    file: ControllerFile, config: Configuration, wanted: Sequence[str], problems: list[Problem]
) -> dict[str, Decimal]:
    """The values of pins; those that are missing are one problem."""
    values: dict[str, Decimal] = {}
    missing = []
    for pin in wanted:
        if pin in config.pins:
            value = read(config.pins[pin], problems)
            if value is not None:
                values[pin] = value
        else:
            missing.append(pin)
    if missing:
        driven = [pin for pin in missing if pin in config.driven]
        shown = ", ".join(missing[:4]) + (", ..." if len(missing) > 4 else "")
        problems.append(
            file.problem(
                Fault(
                    "import-incomplete",
                    "pins of the kinematics are not set",
                    found=f"no setp of {shown}"
                    + (f"; {driven[0]} is driven by a signal" if driven else ""),
                    expected=f"setp of all {len(wanted)}",
                    hint=_where(config),
                )
            )
        )
    return values


def _where(config: Configuration) -> str:
    if config.left_out:
        named = ", ".join(config.left_out[:3])
        return f"{named} cannot be read here: what is named belongs beside the INI"
    return "the HAL file that sets them is the one to read, or the INI that names it"


def limits(
    config: Configuration, section: str, size: Decimal, problems: list[Problem]
) -> Range | None:
    """MIN_LIMIT and MAX_LIMIT of a section, None where one is missing or stands for none."""
    ends = []
    for key in ("MIN_LIMIT", "MAX_LIMIT"):
        entry = value_of(config.ini, section, key)
        if entry is None or _no_limit(entry.text):
            return None
        end = read(entry, problems)
        if end is None or abs(end) > MEANT * size:
            return None
        ends.append(end)
    return (ends[0], ends[1]) if ends[0] < ends[1] else None


def _no_limit(text: str) -> bool:
    """Whether a limit is of the size that stands for none, such as 1e99."""
    try:
        return abs(float(text)) > 1e8
    except ValueError:
        return False


def machine_name(config: Configuration, otherwise: str) -> str:
    """The name of the machine, as TOML takes it."""
    entry = value_of(config.ini, "EMC", "MACHINE")
    return (one_line(entry.text)[:80] if entry is not None else "") or otherwise


__all__ = [
    "UNIT",
    "Range",
    "configuration_of",
    "kinematics_named",
    "limits",
    "machine_name",
    "pins",
    "unit_of",
]
