"""The one state that all windows of a studio share: it takes messages, and says what to tell.

It knows no network and no clock; what it does beyond its own state is read and save files in the
machine's folder. A message either changes the state, which then has a new number, or is refused
and changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from truepose.errors import Problem, RequestError, TrueposeError
from truepose.files.one_run import once_more
from truepose.files.wording import one_of
from truepose.language import spoken
from truepose.machine import Machine
from truepose.runs.dataset import component_units
from truepose.runs.quantities import quantities
from truepose.studio import messages
from truepose.studio.answers import ANSWERS, CONDITION, POSE, DroppedFile, changed
from truepose.studio.edited_file import OpenedFile
from truepose.studio.fields import descriptions, fields_of, refusal
from truepose.studio.jobs import Asked, AskedTab, Given, Job
from truepose.studio.settings import Edits, History, Settings, ShownCondition
from truepose.studio.tabs import TABS

EVERY = tuple(kind.name for kind in ANSWERS)
"""Names of answers, the quickest first."""

MOST_FILES = 8
"""Dropped files that are held."""
LARGEST_FILE = 20_000_000
"""Bytes of a dropped file."""
ROOM = messages.MOST_SENT - 25_000
"""Bytes of a message for fields, beside their descriptions."""

UNITS = {"position": "m", "orientation": "rad"}
"""SI unit of a quantity."""

Message = dict[str, Any]


@dataclass(frozen=True)
class Replies:
    """What comes of a message: what to tell who sent it, and what to tell everyone.

    `ask`: whether there is something to be answered anew. `fields`: whether the fields are others,
    which everyone is told after that.
    """

    sender: tuple[Message, ...] = ()
    everyone: tuple[Message, ...] = ()
    ask: bool = False
    fields: bool = False


@dataclass
class SharedState:
    """The state: the file, the settings with their history, and what follows from them.

    `number` counts states. `tabs`: what each window shows, by the window's number.
    """

    file: OpenedFile
    history: History = field(default_factory=History)
    number: int = 0
    changed_on_disk: bool = False
    files: dict[int, DroppedFile] = field(default_factory=dict)
    tabs: dict[int, AskedTab] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._machine = self.file.machine(self.settings.edits)
        self._text = self.file.edited(self.settings.edits, self._machine)
        self._own_texts: dict[str, str] = {}
        self._due: set[Asked] = set(EVERY)
        self._given: dict[Asked, Message] = {}
        self._next_file = 1
        self._note_own_texts()

    @classmethod
    def opened(cls, path: Path, history: History | None = None) -> SharedState:
        """Of a machine file, with a history that was kept, as far as the file takes it.

        Raises `MachineFileError` where the file itself has problems.
        """
        file = OpenedFile.read(path)
        if history is not None:
            nowhere = replace(history, now=Settings(history.now.edits))
            for kept in (history, nowhere):
                try:
                    state = cls(file, kept)
                    state._require_shown(kept.now)
                except TrueposeError:
                    continue  # the file is another one since
                return state
        return cls(file)

    @property
    def settings(self) -> Settings:
        """What is asked now."""
        return self.history.now

    @property
    def machine(self) -> Machine:
        """The machine with the edits."""
        return self._machine

    @property
    def text(self) -> str:
        """The file with the edits written into it."""
        return self._text

    # --- messages

    def receive(self, message: messages.Received, window: int = 0) -> Replies:
        """What comes of a message of a window.

        Raises `MachineFileError` and `RequestError` where it is refused; nothing is changed then.
        """
        with once_more():  # what was read for one message is no input of the next
            return self._receive(message, window)

    def _receive(self, message: messages.Received, window: int) -> Replies:
        if isinstance(message, messages.EditMessage):
            return self._edit(message)
        if isinstance(message, messages.ShowMessage):
            return self._show(message)
        if isinstance(message, messages.UndoMessage):
            return self._move(self.history.undone())
        if isinstance(message, messages.RedoMessage):
            return self._move(self.history.redone())
        if isinstance(message, messages.ResetMessage):
            return self._move(self.history.reset())
        if isinstance(message, messages.DifferenceMessage):
            return Replies(sender=(self.difference(),))
        if isinstance(message, messages.SaveMessage):
            digest = self.file.save_as(message.name, self._text, replace=message.replace)
            saved = {"type": "saved", "number": self.number, "name": message.name, "hash": digest}
            return Replies(sender=(saved,))
        if isinstance(message, messages.ReloadMessage):
            return self._reload(keep=message.edits == "keep")
        if isinstance(message, messages.ForgetMessage):
            self.files.pop(message.file, None)
            return Replies(everyone=(self.state(),))
        return self._show_tab(message, window)

    def left(self, window: int) -> None:
        """A window is closed."""
        self.tabs.pop(window, None)
        self._forget_tabs()

    def job(self) -> Job | None:
        """What is to be answered now, in its order; None where there is nothing."""
        shown = dict.fromkeys(self.tabs.values())
        asked = tuple(one for one in (*EVERY, *shown) if one in self._due)
        if not asked:
            return None
        files = self.files if any(isinstance(one, AskedTab) for one in asked) else {}
        text, path = self._text, self.file.path
        held, language = dict(files), spoken().code
        return Job(self.number, path, text, self.settings, asked, held, language)

    def given(self, given: Given) -> list[tuple[list[int] | None, Message]]:
        """Take an answer: what to tell, and which windows; None: all of them."""
        asked = given.asked
        if given.last and given.number == self.number:
            self._due.discard(asked)
        if given.value is None and given.problems is None:
            return []
        is_tab = isinstance(asked, AskedTab)
        message: Message = {
            "type": "tab" if is_tab else "answer",
            "number": given.number,
            "name": asked.name if isinstance(asked, AskedTab) else asked,
        }
        if given.problems is None:
            message["value"] = given.value
        else:
            message["problems"] = given.problems
        windows = [window for window, tab in self.tabs.items() if tab == asked]
        if windows or not is_tab:
            self._given[asked] = message
        return [(windows if is_tab else None, message)]

    def drop(self, name: str, content: bytes) -> int:
        """Hold a dropped file, the oldest goes where there are many; its number.

        Raises `RequestError` (file-too-large).
        """
        if len(content) > LARGEST_FILE:
            raise too_large(name)
        number, self._next_file = self._next_file, self._next_file + 1
        self.files[number] = DroppedFile(name, content)
        while len(self.files) > MOST_FILES:
            del self.files[min(self.files)]
        return number

    def file_is(self, digest: str | None) -> Replies:
        """Note what the machine file is now on the disk, by its SHA-256; None: gone."""
        differs = digest != self.file.hash
        if differs == self.changed_on_disk and not differs:
            return Replies()
        self.changed_on_disk = differs
        said = ({"type": "changed", "hash": digest},) if differs else ()
        return Replies(everyone=(*said, self.state()))

    # --- what is told

    def greeting(self) -> list[Message]:
        """What a new window is told: the state, the fields, and the answers that are there."""
        there = [self._given[name] for name in EVERY if name in self._given]
        return [self.state(), *self.fields(), *there]

    def computing(self) -> Message:
        """Which answers come, in their order; tabs by their names."""
        job = self.job()
        asked = () if job is None else job.asked
        names = [one.name if isinstance(one, AskedTab) else one for one in asked]
        return {"type": "computing", "number": self.number, "answers": list(dict.fromkeys(names))}

    def state(self) -> Message:
        """The state as every window is told it."""
        machine, kinds = self._machine, quantities(self._machine.components)
        return {
            "type": "state",
            "number": self.number,
            **self.settings.to_json(),
            "undo": len(self.history.past),
            "redo": len(self.history.future),
            "file": {
                "name": self.file.path.name,
                "hash": self.file.hash,
                "changed": self.changed_on_disk,
            },
            "machine": {
                "name": machine.name,
                "commanded": list(machine.commanded),
                "components": list(machine.components),
                "component_units": [str(unit) for unit in component_units(machine)],
                "quantities": list(kinds),
                "quantity_units": [UNITS[kind] for kind in kinds],
            },
            "holds": [name for name in EVERY if name not in self._due],
            "files": [
                {"file": number, "name": held.name, "size": len(held.content)}
                for number, held in self.files.items()
            ],
        }

    def fields(self) -> list[Message]:
        """The fields of the file, in messages."""
        every = fields_of(self._text, self._machine, self._own_texts)
        rows = [row.to_json() for row in every]
        about = descriptions()
        told, first = [], 0
        for piece in messages.pieces(rows, ROOM):
            used = {row["about"] for row in piece}
            told.append(
                {
                    "type": "fields",
                    "number": self.number,
                    "first": first,
                    "total": len(rows),
                    "fields": piece,
                    "about": {name: about[name] for name in sorted(used) if name in about},
                }
            )
            first += len(piece)
        return told

    def difference(self) -> Message:
        """The difference to the file, as much of it as a message holds."""
        lines: list[str] = []
        room, cut = messages.MOST_SENT // 2, False
        for line in self.file.difference(self._text):
            room -= len(line.encode()) + 8
            if room < 0:
                cut = True
                break
            lines.append(line)
        text = "".join(lines)
        return {"type": "difference", "number": self.number, "text": text, "cut": cut}

    # --- inside

    def _edit(self, message: messages.EditMessage) -> Replies:
        """Other edits; a value that the file itself has takes the edit back."""
        own = self._own_texts
        plain = [(key, None if own.get(key) == value else value) for key, value in message.pairs()]
        return self._move(self.history.changed(self.settings.edited(plain), joins=message.joins))

    def _show(self, message: messages.ShowMessage) -> Replies:
        settings = self.settings
        pose, condition = settings.pose, settings.condition
        if POSE in message.model_fields_set:
            pose = None if message.pose is None else tuple(message.pose)
        if CONDITION in message.model_fields_set:
            shown = message.condition
            condition = None if shown is None else ShownCondition.from_json(shown.model_dump())
        return self._move(self.history.changed(Settings(settings.edits, pose, condition)))

    def _move(self, history: History) -> Replies:
        """Take other settings, if the file takes them."""
        before, after = self.history, history
        if after == before:
            return Replies(sender=(self.state(),))
        machine, text = self._machine, self._text
        edited = after.now.edits != before.now.edits
        if edited:
            machine, text = self._evaluated(after.now.edits)
        self._require_shown(after.now, machine)
        what = changed(before.now, after.now)
        kept = (self._machine, self._text, self.history, self._due)
        self._machine, self._text, self.history = machine, text, after
        self._due = self._due | {kind.name for kind in ANSWERS if kind.follows & what}
        self._due |= {tab for tab in self.tabs.values() if TABS[tab.name].follows & what}
        state = self.state() | {"number": self.number + 1}
        try:
            _require_room(state)
        except RequestError:
            self._machine, self._text, self.history, self._due = kept
            raise
        self.number += 1
        return Replies(everyone=(state,), ask=True, fields=edited)

    def _show_tab(self, message: messages.TabMessage, window: int) -> Replies:
        """Note what a window shows. It is answered from what is there, or anew."""
        self.tabs.pop(window, None)
        if message.name is None:
            self._forget_tabs()
            return Replies()
        if message.name not in TABS:
            raise RequestError(
                Problem(
                    "unknown-choice",
                    "there is no such tab",
                    found=message.name,
                    expected=one_of(TABS),
                )
            )
        tab = AskedTab(message.name, tuple(sorted(message.options.items())))
        self.tabs[window] = tab
        self._forget_tabs()
        if tab in self._given and tab not in self._due:
            return Replies(sender=(self._given[tab],))
        self._due.add(tab)
        return Replies(ask=True)

    def _forget_tabs(self) -> None:
        """Nothing is kept of tabs that no window shows."""
        shown = set(self.tabs.values())
        for asked in [*self._due, *self._given]:
            if isinstance(asked, AskedTab) and asked not in shown:
                self._due.discard(asked)
                self._given.pop(asked, None)

    def _evaluated(self, edits: Edits) -> tuple[Machine, str]:
        """The machine of the text with the edits, and that text. Raises as `OpenedFile.machine`."""
        text = self.file.edited(edits)
        # What is saved is what is answered: the text is read, not the settings.
        return OpenedFile(self.file.path, self.file.hash, text).machine(), text

    def _require_shown(self, settings: Settings, machine: Machine | None = None) -> None:
        """Raise `RequestError` where the pose or the condition is not one of this machine."""
        machine = self._machine if machine is None else machine
        count = len(machine.commanded)
        if settings.pose is not None and len(settings.pose) != count:
            raise RequestError(
                Problem(
                    "bad-poses",
                    "the pose shown is none of this machine",
                    found=f"{len(settings.pose)} numbers",
                    expected=f"{count}, of {' '.join(machine.commanded)}",
                )
            )
        if settings.condition is not None:
            machine.with_condition(settings.condition.of(machine.condition))

    def _reload(self, *, keep: bool) -> Replies:
        """Read the file again. Edits that it does not take any more are a refusal."""
        history = self.history if keep else History(replace(self.settings, edits=()))
        fresh = SharedState(OpenedFile.read(self.file.path), history, self.number + 1)
        try:
            fresh._require_shown(history.now)
        except RequestError:  # another machine than the one that was shown
            nowhere = replace(history.now, pose=None, condition=None)
            fresh.history = replace(history, now=nowhere)
        self.file, self.history, self.number = fresh.file, fresh.history, fresh.number
        self._machine, self._text = fresh.machine, fresh.text
        self._due = {*EVERY, *self.tabs.values()}
        self._own_texts, self.changed_on_disk = fresh._own_texts, False
        return Replies(everyone=(self.state(),), ask=True, fields=True)

    def _note_own_texts(self) -> None:
        """The texts of the file's fields, by which an edit is seen to change nothing."""
        machine = self._machine if not self.settings.edits else None
        try:
            machine = machine or self.file.machine()
        except TrueposeError:
            return  # a file that only its edits make whole
        own = fields_of(self.file.text, machine)
        self._own_texts = {row.key: row.text for row in own}


def refused(message: Any, failure: TrueposeError) -> Message:
    """What is told of a message that was refused, in the file's own words."""
    return {"type": "refused", "of": message, "problems": refusal(failure)}


def too_large(name: str) -> RequestError:
    """What is raised for a dropped file of more than `LARGEST_FILE`."""
    return RequestError(
        Problem(
            "file-too-large",
            "the dropped file is too large",
            file=name[:200],
            found=f"more than {LARGEST_FILE // 1_000_000} MB",
            expected=f"at most {LARGEST_FILE // 1_000_000} MB",
        )
    )


def _require_room(state: Message) -> None:
    """Raise `RequestError` (bad-setting) where a message does not hold the edits."""
    if not messages.fits(state):
        raise RequestError(
            Problem(
                "bad-setting",
                "there are more edits than the studio holds",
                found=f"{len(state['edits'])} edits",
                expected="fewer; save the file, and open that",
            )
        )


__all__ = ["LARGEST_FILE", "Replies", "SharedState", "refused", "too_large"]
