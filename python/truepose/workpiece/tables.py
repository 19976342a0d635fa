"""The tables of a features file, but for the keys that each kind of feature brings."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from truepose.errors import Fault
from truepose.files.file_table import FileTable, Name
from truepose.files.quantity import NonNegativeLength, refuse
from truepose.files.units import shown_value, type_phrase
from truepose.workpiece.features._base import Method
from truepose.workpiece.stretches import Address, Interval, lines_of, numbers_of, tool_of

Plane = Literal["xy", "zx", "yz"]
Alignment = Literal["clamped", "best-fit", "datums"]


def _text(value: Any, expected: str) -> str:
    if isinstance(value, bool) or not isinstance(value, str | int):
        refuse(
            Fault(
                "wrong-type",
                f"expected {expected}, found {type_phrase(value)}",
                found=shown_value(value),
                expected=expected,
            )
        )
    return str(value)


def _read(parse: Callable[[str], Any], expected: str) -> Callable[[Any], Any]:
    """One text, as it is parsed; a fault is refused."""

    def read(value: Any) -> Any:
        parsed = parse(_text(value, expected))
        if isinstance(parsed, Fault):
            refuse(parsed)
        return parsed

    return read


def _each(one: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """One text, or a list of one for each element, as a tuple of what they are."""

    def read(value: Any) -> Any:
        if isinstance(value, list) and not value:
            refuse(Fault("wrong-type", "an empty list", found="[]", expected="one entry or more"))
        return tuple(map(one, value)) if isinstance(value, list) else (one(value),)

    return read


def _words(text: str) -> str | Fault:
    fault = Fault(
        "part-address",
        "no comment holds this, as it is empty",
        found=shown_value(text),
        expected='words of a comment, such as "finish"',
    )
    return text.strip() or fault


_LINES = _read(lines_of, 'lines, such as "12-15"')
_NUMBERS = _read(numbers_of, 'N numbers, such as "N100-N140"')
_TOOL = _read(tool_of, 'a tool, such as "T3"')
_COMMENT = _read(_words, "words of a comment")

Lines = Annotated[tuple[tuple[Interval, ...], ...] | None, BeforeValidator(_each(_LINES))]
Numbers = Annotated[tuple[Interval, ...] | None, BeforeValidator(_each(_NUMBERS))]
Tool = Annotated[int | None, BeforeValidator(_TOOL)]
Comments = Annotated[tuple[str, ...] | None, BeforeValidator(_each(_COMMENT))]


class PlaceTable(FileTable):
    """Where in the program: all that is given must hold."""

    lines: Lines = Field(
        None,
        description='Lines of the program, the first is 1: `"12-15"`. Of a feature of several '
        'elements a list, an entry each: `["12", "14"]`.',
    )
    n: Numbers = Field(None, description='From one N number to another: `"N100-N140"`, or a list.')
    tool: Tool = Field(None, description='The tool that is loaded: `"T3"`.')
    comment: Comments = Field(
        None,
        description="Words of a comment: the lines behind it, up to the next line that is a "
        "comment alone; or a list.",
    )

    @model_validator(mode="after")
    def _as_long(self) -> Self:
        given = [several for several in (self.lines, self.n, self.comment) if several is not None]
        count = max(map(len, given), default=1)
        if any(len(several) not in (1, count) for several in given):
            refuse(
                Fault(
                    "part-address",
                    "lines, N numbers and comments are lists of another length each",
                    found=" and ".join(str(len(several)) for several in given) + " entries",
                    expected="one entry for all elements, or one for each",
                )
            )
        return self

    def addresses(self) -> tuple[Address, ...]:
        """One for each element; none where nothing is said."""
        given = [several for several in (self.lines, self.n, self.comment) if several is not None]
        if not given and self.tool is None:
            return ()
        count = max(map(len, given), default=1)
        return tuple(
            Address(_of(self.lines, at), _of(self.n, at), self.tool, _of(self.comment, at))
            for at in range(count)
        )


def _of(several: tuple[Any, ...] | None, at: int) -> Any:
    return None if several is None else several[at if len(several) > 1 else 0]


class DatumTable(PlaceTable):
    """One datum: the face, the bore or the edge that others are measured from."""

    name: Name = Field(description="Its name, such as `A`.")
    tool_radius: NonNegativeLength | None = Field(
        None, description="Of the tool there; default: that of `[part]`."
    )


class FeatureTable(PlaceTable):
    """One feature: where it is in the program, and what the drawing asks of it."""

    name: Name = Field(description="Its name.")
    kind: str = Field(description="What it is.")
    datums: list[Name] = Field(
        default_factory=list, description="Names of the datums that it refers to, in their order."
    )
    evaluate: Method | None = Field(
        None, description="The operators of the standards (`iso`), or `least-squares`."
    )
    tool_radius: NonNegativeLength | None = Field(
        None, description="Of the tool there; default: that of `[part]`."
    )


class PartTable(FileTable):
    """What holds for the whole part."""

    operations: PlaceTable | None = Field(
        None,
        description="Which operations count, such as the finishing pass: what else the program "
        "does belongs to no feature.",
    )
    tool_radius: NonNegativeLength = Field(0.0, description="Of the tool; default 0.")
    plane: Plane | None = Field(
        None, description="Working plane of all elements. Default: as G17, G18 or G19 say there."
    )
    evaluate: Method = Field(
        "iso", description="The operators of the standards (`iso`), or `least-squares`."
    )
    alignment: Alignment = Field(
        "clamped",
        description="In which coordinates the part is judged: the machine's, as it is clamped; "
        "`best-fit` to all its points; `datums`, the frame of those of `datums`.",
    )
    datums: list[Name] = Field(
        default_factory=list, description="Names of the datums of the frame, in their order."
    )


__all__ = ["Alignment", "DatumTable", "FeatureTable", "PartTable", "PlaceTable", "Plane"]
