"""Edits of a machine file's text by which every band of its keys becomes one value, or goes.

A ratio that is known within limits (`scale_error`, `lead_error`) becomes the one that a machine
has; the force of unknown direction a plain force. Bands that no key can state as one value are
taken out, and with them what follows the pose: play, resolution, a periodic error of unknown phase,
measured positions, guideways that may lean. What these do at one pose the tolerance table can say.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fnmatch import fnmatchcase
from typing import Any

import tomlkit
from tomlkit.items import Comment, Item, Table, Whitespace

from truepose.arrays import Floats
from truepose.calibration.result.toml_edits import MachineText
from truepose.files.dimensions import BY_UNIT, FREEDOMS
from truepose.files.document import ARRAY_TABLES
from truepose.machine import Machine
from truepose.machine.shared_keys import EACH
from truepose.machine.tables.workspace import WAYS
from truepose.sources import REGISTRY
from truepose.sources.actuator import Actuator
from truepose.sources.guideway import Guideway
from truepose.sources.sensor import Sensor
from truepose.sources.tolerance import DimensionalTolerance

Row = dict[str, Any]
Edit = Callable[[str, Row], Row]
"""What becomes of a key's table, of the row of this path; an empty one goes."""

_JOINTS = ("base_joint", "platform_joint")
_CLEARANCES = ("clearance", "axial_clearance")
_LEANS = ("squareness", "parallelism")
_FORCES = ("force", "cutting", "kienzle")
_LENGTH_TOLERANCE = "length_tolerance"
_OTHERS = "# what else its parts deviate by at this pose:"


class OneValues:
    """Edits of one text. `deviations`: of all parameters (n_parameter,), SI, by source."""

    def __init__(
        self, text: MachineText, machine: Machine, deviations: Mapping[str, Floats]
    ) -> None:
        self._text, self._machine, self._deviations = text, machine, deviations
        self._at = {name: column for column, name in enumerate(machine.parameters)}

    def bands_of_keys(self) -> None:
        """The one value of every ratio within limits; what else has a band goes."""
        self._no_play()
        self._rewrite("drive", "sensor", self._sensor)
        self._rewrite("drive", "actuator", self._actuator)
        self._rewrite("drive", "guideway", self._guideway)

    def no_sources(self) -> None:
        """Take out every key of an error source, and all that acts: the condition is neutral."""
        self._no_play()
        for source in REGISTRY:
            if source is not DimensionalTolerance:  # `tolerances` has its keys, in their order
                for table, model in source.tables.items():
                    for key in model.model_fields:
                        self._take_out(table, key)
        condition = self._text.toml.get("condition", {})
        reference = condition.get("reference_temperature")
        if condition:
            del self._text.toml["condition"]
        neutral = tomlkit.table()
        if reference is not None:
            neutral["reference_temperature"] = reference
        neutral["gravity"] = "0 m/s^2"
        self._text.append(tomlkit.dumps({"condition": neutral}))

    def force(self, force: Floats) -> None:
        """A force (3,), N, base axes, in place of the envelope and of what gave one before."""
        condition = self._text.toml["condition"]
        for key in ("envelope", *_FORCES[1:]):
            if key in condition:
                del condition[key]
        # A platform that moves in a plane takes no force across it.
        axes = [axis for axis in "xyz" if force["xyz".index(axis)] or axis in self._machine.dof]
        condition["force"] = _value(
            {axis: self._text.written(force["xyz".index(axis)], "force", None) for axis in axes}
        )

    def no_envelope(self) -> None:
        """Take out a force of unknown direction that nothing gives way to."""
        condition = self._text.toml.get("condition", {})
        if "envelope" in condition:
            del condition["envelope"]

    def pose(self, pose: Floats) -> None:
        """The one pose (n_commanded,) in place of the workspace; home stays where it is."""
        machine, toml = self._machine, self._text.toml
        if not isinstance(toml.get("workspace"), Table):
            toml.pop("workspace", None)
            toml["workspace"] = tomlkit.table()
        workspace = toml["workspace"]
        for key in ("home", *WAYS):
            if key in workspace:
                del workspace[key]
        home = dict(zip(machine.dof, machine.home.tolist(), strict=True))
        workspace["home"] = _value(
            {freedom: self._freedom(freedom, value) for freedom, value in home.items()}
        )
        row = [
            self._freedom(freedom, value)
            for freedom, value in zip(machine.commanded, pose.tolist(), strict=True)
        ]
        workspace["poses"] = _value([row])

    def tolerances(self, values: Mapping[str, float]) -> None:
        """One value, SI, for each parameter, in place of all tolerances and correlations.

        In the order of the file, where an entry of it stood for the parameter.
        """
        self._text.toml.pop("correlation", None)
        left = dict(values)
        for strut, column in zip(
            self._machine.struts, self._machine.kernel.length_parameters, strict=True
        ):
            row = self._text.row("strut", strut.name)
            shared = self._shared("strut")
            name = self._machine.parameters[int(column)]
            if _LENGTH_TOLERANCE not in row and _LENGTH_TOLERANCE not in shared:
                continue
            if name in left:
                row[_LENGTH_TOLERANCE] = self._band(name, left.pop(name))
            else:
                row.pop(_LENGTH_TOLERANCE, None)
        self._shared("strut").pop(_LENGTH_TOLERANCE, None)
        self._tolerance_table(left)

    # --- inside

    def _freedom(self, freedom: str, value: float) -> float | str:
        dimension = FREEDOMS[freedom]
        unit = self._machine.file_units[dimension]
        # A grid's 50.000000000000014 mm is 50 mm, to the rounding of a coordinate.
        return self._text.written(float(unit.to_si(unit.to_file(value))), dimension, None)

    def _band(self, name: str, value: float) -> Item:
        """A band of equal limits."""
        dimension = BY_UNIT[self._machine.units[self._at[name]]]
        return _value([self._text.written(value, dimension, None)] * 2)

    def _tolerance_table(self, left: dict[str, float]) -> None:
        old = self._text.toml.get("tolerance")
        new = tomlkit.table()
        body = old.value.body if isinstance(old, Table) else []
        for key, item in body:
            if key is None:
                if isinstance(item, Comment | Whitespace):
                    new.add(item)
                continue
            pattern = key.key
            if item.trivia.comment:
                new.add(Comment(_trivia(item.trivia.comment)))
            for name in [n for n in left if n == pattern or fnmatchcase(n, pattern)]:
                new.add(name, self._band(name, left.pop(name)))
        if left and len(new.value.body):
            new.add(Comment(_trivia(_OTHERS)))
        for name, value in left.items():
            new.add(name, self._band(name, value))
        if isinstance(old, Table):
            self._text.toml["tolerance"] = new
        else:
            self._text.toml.pop("tolerance", None)
            if new:
                self._text.append(tomlkit.dumps({"tolerance": new}))

    def _no_play(self) -> None:
        self._rewrite("drive", "backlash", lambda path, row: {})
        for joint in _JOINTS:
            self._rewrite("strut", joint, lambda path, row: _without(row, _CLEARANCES))
        self._text.toml.pop("clearance", None)

    def _sensor(self, path: str, row: Row) -> Row:
        readings = {
            reading.drive: reading
            for source in self._machine.sources
            if isinstance(source, Sensor)
            for reading in source.readings
        }
        band = readings[path].scale_error
        row = _without(row, ("resolution", "varies", "scale_error_varies"))
        if band is None:
            return {}
        return row if band.half == 0.0 else row | {"scale_error": self._ratio(path, "sensor")}

    def _actuator(self, path: str, row: Row) -> Row:
        actuations = {
            actuation.drive: actuation
            for source in self._machine.sources
            if isinstance(source, Actuator)
            for actuation in source.actuations
        }
        of = actuations[path]
        if of.table is not None:
            return {}
        row = _without(row, ("varies",))
        if of.periodic is not None and of.periodic.phase is None:
            row = _without(row, ("periodic",))
        if of.lead_error is not None and of.lead_error.half > 0.0:
            row = row | {"lead_error": self._ratio(path, "actuator")}
        return row if "lead_error" in row or "periodic" in row else {}

    def _ratio(self, path: str, source: str) -> float:
        """The error of a drive's scale, as a plain ratio."""
        column = self._at[f"{path}.scale"]
        return float(self._deviations[source][column] / self._machine.nominal[column])

    def _guideway(self, path: str, row: Row) -> Row:
        rails = {
            rail.drive: rail
            for source in self._machine.sources
            if isinstance(source, Guideway)
            for rail in source.rails
        }
        rail = rails[path]
        named = [key for key in _LEANS if key in row]
        unknown = [key for key, lean in zip(named, rail.leans, strict=True) if lean.band.half > 0.0]
        row = _without(row, unknown)
        shapes = row.get("straightness", [])
        known = [
            row_of_shape
            for row_of_shape, shape in zip(shapes, rail.shapes, strict=True)
            if shape.known
        ]
        row = _without(row, ("straightness",)) | ({"straightness": known} if known else {})
        stays = ("straightness", "table", *_LEANS)
        return row if any(key in row for key in stays) else {}

    def _shared(self, table: str) -> Any:
        """What `[each.*]` says for the rows of a table; empty where it says nothing."""
        shared = self._text.toml.get(EACH, {})
        return shared.get(table, {})

    def _take_out(self, table: str, key: str) -> None:
        """Take a key out of a table, or of every row of it."""
        if table in ARRAY_TABLES:
            self._rewrite(table, key, lambda path, row: {})
        elif table in self._text.toml:
            self._text.toml[table].pop(key, None)

    def _rewrite(self, table: str, key: str, edit: Edit) -> None:
        """Edit the table of a key in every row, which may have it from `[each.*]`."""
        if table not in ARRAY_TABLES or table not in self._text.toml:
            return
        shared = self._shared(table)
        common = _unwrap(shared[key]) if key in shared else None
        relying: list[tuple[Any, Row]] = []
        for row in self._text.toml[table]:
            path = f"{table}.{row['name']}"
            if key in row:
                _edit_in_place(row, key, edit(path, _unwrap(row[key])))
            elif common is not None:
                relying.append((row, edit(path, common)))
        if common is None or all(new == common for _, new in relying):
            return
        if all(new == relying[0][1] for _, new in relying):
            _edit_in_place(shared, key, relying[0][1])
            return
        del shared[key]
        for row, new in relying:
            if new:
                row[key] = _value(new)


def _edit_in_place(row: Any, key: str, new: Row) -> None:
    """Make a key's table `new`, with as much of its form as can stay; none where it is empty."""
    old = row[key]
    if not new:
        del row[key]
    elif _unwrap(old) == new:
        return
    elif isinstance(old, Table):
        for name in [name for name in old if name not in new]:
            del old[name]
        for name, value in new.items():
            if _unwrap(old.get(name)) != value:
                old[name] = _value(value)
    else:
        row[key] = _value(new)


def _without(row: Row, keys: tuple[str, ...] | list[str]) -> Row:
    return {key: value for key, value in row.items() if key not in keys}


def _unwrap(item: Any) -> Any:
    return item.unwrap() if hasattr(item, "unwrap") else item


def _value(value: Any) -> Item:
    """A value as TOML on one line, with the spaces that people put into it."""
    return tomlkit.value(_text_of(value))


def _text_of(value: Any) -> str:
    if isinstance(value, Mapping):
        keys = ", ".join(
            f"{tomlkit.key(key).as_string()} = {_text_of(entry)}" for key, entry in value.items()
        )
        return f"{{ {keys} }}" if keys else "{}"
    if isinstance(value, list):
        return f"[{', '.join(map(_text_of, value))}]"
    if isinstance(value, float):
        return repr(float(value))
    return str(tomlkit.item(value).as_string())


def _trivia(comment: str) -> Any:
    return tomlkit.comment(comment.removeprefix("#").strip()).trivia


__all__ = ["OneValues"]
