"""The messages between page and server: JSON objects, each a model; `docs/studio.md` lists them.

What comes from the page is read with them. What the server sends is written as plain values; the
models of it make the schema, and the tests hold every message against it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from truepose.errors import Problem, RequestError

MOST_SENT = 60_000
"""Bytes of a message of the server."""
MOST_RECEIVED = 64_000
"""Bytes of a message of the page."""
MOST_EDITS = 400
"""Edits of one message."""

Text = Annotated[str, Field(max_length=4000)]
Name = Annotated[str, Field(max_length=200)]
Number = Annotated[float, Field(allow_inf_nan=False)]


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class ConditionOfMessage(_Message):
    """A condition: temperatures of parts, K, and the wrench on the tool, N and N m."""

    temperature: dict[Name, Number]
    wrench: Annotated[list[Number], Field(min_length=6, max_length=6)]


class EditMessage(_Message):
    """Values of the file, one step, all or none; null takes the edit of a key back.

    `joins`: the step is the last one, as of a slider that is dragged on.
    """

    type: Literal["edit"]
    edits: Annotated[
        list[Annotated[list[Text | None], Field(min_length=2, max_length=2)]],
        Field(min_length=1, max_length=MOST_EDITS),
    ]
    joins: bool = False

    def pairs(self) -> list[tuple[str, str | None]]:
        """Keys and values. Raises `RequestError` (bad-argument) where a key is null."""
        pairs = []
        for key, value in self.edits:
            if key is None:
                raise _not_known("an edit whose key is null")
            pairs.append((key, value))
        return pairs


class ShowMessage(_Message):
    """What is shown; a key that is left out stays as it was."""

    type: Literal["show"]
    pose: Annotated[list[Number], Field(max_length=6)] | None = None
    condition: ConditionOfMessage | None = None


class UndoMessage(_Message):
    """One step of edits back."""

    type: Literal["undo"]


class RedoMessage(_Message):
    """One step of edits forward again."""

    type: Literal["redo"]


class ResetMessage(_Message):
    """All edits back; a step too."""

    type: Literal["reset"]


class TabMessage(_Message):
    """The tab that this window shows, or none."""

    type: Literal["tab"]
    name: Name | None = None
    options: dict[Name, int | float | Text | bool | None] = Field(default_factory=dict)


class DifferenceMessage(_Message):
    """Asks for the difference to the file."""

    type: Literal["difference"]


class SaveMessage(_Message):
    """Save as: the name of a file in the machine's folder, and whether one may be there already."""

    type: Literal["save"]
    name: Name
    replace: bool = False


class ReloadMessage(_Message):
    """Read the machine file again, with the edits or without them."""

    type: Literal["reload"]
    edits: Literal["keep", "drop"] = "keep"


class ForgetMessage(_Message):
    """Drop a file from memory."""

    type: Literal["forget"]
    file: int


Received = (
    EditMessage
    | ShowMessage
    | UndoMessage
    | RedoMessage
    | ResetMessage
    | TabMessage
    | DifferenceMessage
    | SaveMessage
    | ReloadMessage
    | ForgetMessage
)


def in_place_of(earlier: Received, later: Received) -> Received | None:
    """One message in place of two that wait, where the later says all that the earlier does."""
    if isinstance(earlier, EditMessage) and isinstance(later, EditMessage):
        every = {edit[0] for edit in later.edits}
        if all(edit[0] in every for edit in earlier.edits):
            return later.model_copy(update={"joins": earlier.joins and later.joins})
        return None
    both = isinstance(earlier, ShowMessage) and isinstance(later, ShowMessage)
    return later if both and earlier.model_fields_set <= later.model_fields_set else None


_RECEIVED: TypeAdapter[Received] = TypeAdapter(Annotated[Received, Field(discriminator="type")])


class ProblemOfMessage(_Message):
    """A problem, as `--format json` of every command has it."""

    code: str
    message: str
    file: str | None
    line: int | None
    path: str | None
    found: str | None
    expected: str | None
    hint: str | None
    column: int | None = None


class FileOfMessage(_Message):
    """The machine file: its name, its SHA-256, and whether somebody else has changed it."""

    name: str
    hash: str
    changed: bool


class DroppedOfMessage(_Message):
    """A dropped file that is held in memory."""

    file: int
    name: str
    size: int


class MachineOfMessage(_Message):
    """What the numbers of the answers are of."""

    name: str
    commanded: list[str]
    components: list[str]
    component_units: list[str]
    quantities: list[str]
    quantity_units: list[str]


class StateMessage(_Message):
    """The state, to every window: first, and after every change."""

    type: Literal["state"]
    number: int
    edits: list[list[str]]
    pose: list[float] | None
    condition: ConditionOfMessage | None
    undo: int
    redo: int
    file: FileOfMessage
    machine: MachineOfMessage
    holds: list[str]
    files: list[DroppedOfMessage]


class FieldOfMessage(_Message):
    """A number of the file, or a list of them, with its unit and what it is."""

    key: str
    text: str
    file: str | None
    table: str
    about: str
    unit: str
    dimension: str
    group: bool
    choices: list[str]
    edited: bool


class FieldsMessage(_Message):
    """Fields of the file, in pieces: `first` of `total`."""

    type: Literal["fields"]
    number: int
    first: int
    total: int
    fields: list[FieldOfMessage]
    about: dict[str, str]


class RefusedMessage(_Message):
    """A message that changed nothing, and why; to who sent it."""

    type: Literal["refused"]
    of: Any
    problems: list[ProblemOfMessage]


class ComputingMessage(_Message):
    """Which answers come, in their order."""

    type: Literal["computing"]
    number: int
    answers: list[str]


class AnswerMessage(_Message):
    """An answer, or problems where there is none."""

    type: Literal["answer", "tab"]
    number: int
    name: str
    value: dict[str, Any] | list[dict[str, Any]] | None = None
    problems: list[ProblemOfMessage] | None = None


class DifferenceOfMessage(_Message):
    """The unified difference to the file; `cut` where there was more than a message holds."""

    type: Literal["difference"]
    number: int
    text: str
    cut: bool


class SavedMessage(_Message):
    """What was saved, to who asked."""

    type: Literal["saved"]
    number: int
    name: str
    hash: str


class ChangedMessage(_Message):
    """The machine file was changed by somebody else; `hash` null: it is gone."""

    type: Literal["changed"]
    hash: str | None


Sent = (
    StateMessage
    | FieldsMessage
    | RefusedMessage
    | ComputingMessage
    | AnswerMessage
    | DifferenceOfMessage
    | SavedMessage
    | ChangedMessage
)

SENT: TypeAdapter[Sent] = TypeAdapter(Annotated[Sent, Field(discriminator="type")])


def received(text: str) -> Received:
    """What the page sent. Raises `RequestError` (bad-argument) for anything else."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        raise _not_known("no JSON") from None
    try:
        return _RECEIVED.validate_python(value)
    except ValidationError as failure:
        first = failure.errors(include_url=False, include_context=False, include_input=False)[0]
        at = ".".join(str(part) for part in first["loc"])
        wrong = f"{at}: {first['msg']}" if at else str(first["msg"])
        raise _not_known(wrong[:500]) from None


def _not_known(what: str) -> RequestError:
    return RequestError(
        Problem(
            "bad-argument",
            "the message is none that the studio knows",
            found=what,
            expected="one of docs/studio.md",
        )
    )


def fits(message: dict[str, Any]) -> bool:
    """Whether a message is small enough to be sent."""
    return len(_dumped(message).encode()) <= MOST_SENT


def written(message: dict[str, Any]) -> str:
    """A message as it is sent: JSON of at most `MOST_SENT` bytes.

    An answer that would be larger is told as a problem: its page has the numbers by a command.
    """
    text = _dumped(message)
    if len(text.encode()) <= MOST_SENT:
        return text
    problem = Problem(
        "file-too-large",
        "the answer is too large for the page; the command line has it",
        found=f"{len(text.encode())} bytes",
        expected=f"at most {MOST_SENT}",
    )
    kept = {key: message[key] for key in ("type", "number", "name") if key in message}
    return _dumped(kept | {"problems": [problem.to_dict()]})


def pieces(fields: Sequence[dict[str, Any]], room: int) -> list[list[dict[str, Any]]]:
    """Rows in their order, in lists whose JSON has at most `room` bytes each."""
    lists: list[list[dict[str, Any]]] = [[]]
    used = 0
    for row in fields:
        size = len(_dumped(row).encode()) + 2
        if used + size > room and lists[-1]:
            lists.append([])
            used = 0
        lists[-1].append(row)
        used += size
    return lists


def schema_text() -> str:
    """The JSON schema of all messages, as a file has it."""
    definitions = {
        name: adapter.json_schema(ref_template="#/$defs/{model}")
        for name, adapter in (("from_page", _RECEIVED), ("from_server", SENT))
    }
    defs: dict[str, Any] = {}
    for schema in definitions.values():
        defs |= schema.pop("$defs", {})
    whole = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "truepose studio messages",
        "anyOf": [{"$ref": f"#/$defs/{name}"} for name in definitions],
        "$defs": definitions | defs,
    }
    return json.dumps(whole, indent=2, ensure_ascii=False) + "\n"


def _dumped(message: Any) -> str:
    return json.dumps(message, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


__all__ = [
    "MOST_RECEIVED",
    "MOST_SENT",
    "SENT",
    "Received",
    "fits",
    "in_place_of",
    "pieces",
    "received",
    "schema_text",
    "written",
]
