"""What goes wrong, as data: codes, problems and the exceptions that carry them.

A `Problem` is one thing that is wrong with what the user gave: a code from `CATALOGUE`, where it
is, what was found there, what was expected instead, and a hint. A `TrueposeError` carries one or
more of them. A pose that cannot be used is not a problem of the input but of the machine: it is a
status code in a result, or one `PoseError` for the whole call.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace

CATALOGUE: dict[str, str] = {
    # the file as such
    "file-missing": "the machine file, or a data file, is not there",
    "file-is-directory": "a directory was given where a file is wanted",
    "file-too-large": "the file is larger than any of its kind",
    "file-unreadable": "the file is there but cannot be read",
    "not-utf8": "the file is not UTF-8 text",
    "not-toml": "the file is not TOML",
    "unsupported-schema": "the file is written for another version of the machine file",
    # keys and values
    "unknown-key": "a key that nothing reads, most often a misspelt one",
    "missing-key": "a key that must be there is not",
    "wrong-type": "the value is of another type than the key takes",
    "unknown-choice": "the value is none of the words that the key takes",
    "excluding-keys": "two keys that exclude each other",
    # data files
    "not-csv": "the data file is no table of cells separated by commas",
    "unknown-column": "a column of a data file that nothing reads, most often a misspelt one",
    "missing-column": "a column that the data file must have is not there",
    "doubled-column": "a column that the data file has twice",
    "ragged-row": "a row with more or fewer cells than the header",
    "empty-cell": "a cell of a data file with nothing in it",
    "not-a-number": "a cell of a data file that is not a number",
    "no-rows": "a data file without a header or without a row below it",
    "time-backwards": "a time of a log that is not after the one before it",
    "outside-log": "a time that the temperature log does not reach to",
    # quantities
    "no-unit": "a number, or a column, whose unit nothing declares",
    "unknown-unit": "a unit that is not known, or text that is not a number with a unit",
    "wrong-dimension": "a quantity of another dimension than the key takes",
    "not-finite": "not a finite number",
    "too-long": "text longer than any value of its kind",
    "too-large": "a number of no size that anything has, from a slip in an exponent",
    "not-positive": "zero or negative where only a positive quantity makes sense",
    "negative": "negative where only zero or more makes sense",
    "not-a-fraction": "a fraction that is not from 0 to 1",
    "zero-direction": "a direction of no length",
    # the machine's structure
    "bad-name": "a name that cannot be used",
    "family-contradiction": "a joint centre, or other geometry, that is not what [family] gives",
    "duplicate-name": "two drives, two struts or two freedoms with one name",
    "unknown-drive": "a strut names a drive that is not there",
    "unused-drive": "a drive that carries no strut",
    "unwanted-length": "a length for a strut whose length is its drive's coordinate",
    "unwanted-carriage": "a carriage of a drive that moves none",
    "closure-count": "too few or too many closures for the platform's freedoms",
    "drive-count": "not as many drives as commanded freedoms",
    "unknown-freedom": "a freedom that the platform does not have, or that is not commanded",
    "freedom-order": "freedoms in another order than x y z a b c",
    "unknown-part": "a part that the machine does not have",
    "unwanted-backlash": "backlash of a drive whose position is measured behind it",
    "screw-not-driven": "a non-captive screw on a strut whose length no drive sets",
    "screw-axis-parallel": "a universal joint's axis along its strut: its turn is not defined",
    "home-unreachable": "the machine cannot be placed at home, from which something counts",
    "unwanted-clearance": "a clearance on a joint that can have none",
    "no-mass": "gravity or an acceleration is asked for, but nothing has a mass",
    "travel-reversed": "a travel whose end is not above its start",
    "loose-platform": "guides that leave the platform a motion of its own",
    "unsupported-chain": "joints, in this order, of which truepose makes no limb or carriage yet",
    "open-chain": "a limb whose joints leave other motions free than its closures",
    "zero-length": "beams that do not make the length of their limb",
    "empty-section": "walls that leave nothing of a section's outside",
    "not-buildable": "the kernel cannot build this machine",
    # materials and tolerances
    "unknown-material": "a material that is not in the table",
    "unknown-tolerance-class": "a tolerance class that is not in the tables",
    "tolerance-out-of-range": "the standard gives this class no value for this size",
    "tolerance-of-offset": "a band of what a limb or a carriage gives way by",
    "tolerance-matches-nothing": "a tolerance for parameters that the machine does not have",
    "tolerance-twice": "two tolerances for one parameter",
    "tolerance-without-effect": "a tolerance that is set where all parameters have another",
    "tolerance-mixes-kinds": "one tolerance for parameters of several kinds, such as m and rad",
    "unwanted-lead-error": "a lead error of a drive whose position is measured behind it",
    "unwanted-guideway": "a guideway of a drive that runs on none",
    "direction-along-guideway": "a direction of straightness that is not across its guideway",
    "too-few-runs": "a measured position with too few runs for its spread",
    "doubled-position": "a position that a table has twice",
    "travel-not-covered": "a table that does not reach over the travel of its drive",
    "group-distributions": "a group of tolerances that vary together, of two distributions",
    "bad-distribution": "values and probabilities that are no distribution",
    "too-few-degrees-of-freedom": "a Student distribution that has no standard deviation",
    "band-reversed": "a band whose lower end is above its upper one",
    "bad-correlation": "a correlation that is no number from -1 to 1, or a matrix that is none",
    "correlation-matches-nothing": "a correlation of what has no tolerance",
    "correlation-too-few": "a correlation of fewer than two variables",
    "correlation-matrix-shape": "a matrix of correlations of another size than its names",
    "correlation-pattern": "a pattern where a matrix of correlations needs names in their order",
    "correlation-twice": "two variables given two correlations, or one with itself",
    "correlation-not-semidefinite": "correlations that cannot all hold at once",
    "no-expansion": "a temperature is given for a part that gives no expansion",
    "tolerance-reversed": "a tolerance whose upper limit is below its lower one",
    # costs, from which a design is chosen
    "cost-matches-nothing": "a cost of a parameter or a part that the machine does not have",
    "cost-twice": "two costs of one tolerance, or of one key of a part",
    "cost-falls": "a cost that falls as the tolerance gets tighter",
    "no-cost": "a design is wanted of a file that does not say what may be chosen",
    "option-not-set": "an option of a choice that the file cannot set",
    "bad-allocation": "an allocation that cannot be made as it is asked",
    "target-out-of-reach": "a target that no choice keeps, with everything at its finest",
    # the workspace
    "grid-count": "a grid count that is not a whole number of one or more",
    "grid-ends": "a grid count of one with two different ends",
    "grid-too-large": "a workspace of more poses than are allowed",
    "no-accuracy": "the accuracy asked is required of a file that asks for none",
    "no-workspace": "poses are wanted from a file that gives no workspace",
    # plain functions
    "no-input": "a function without inputs that are uncertain",
    "unknown-input": "an input that the function, or the inputs given, do not have",
    "bad-function": "a function that does not return an array for arrays",
    # requests
    "bad-setting": "a --set, or a TRUEPOSE_ variable, that is not what it can be",
    "unknown-parameter": "a parameter that the machine does not have",
    "no-stiffness": "a stiffness is wanted of a strut that gives none",
    "guide-taken-rigid": "a warning: guides carry load, and how they bend is not in the results",
    "bad-condition": "a condition of values that cannot be",
    "no-source": "the file gives no error source to evaluate",
    "correlation-out-of-reach": "a correlation that two distributions of these shapes cannot have",
    "bad-samples": "a number of samples that nothing can be estimated from",
    "bad-seed": "a seed of random numbers that is no whole number from 0 to 2^64 - 1",
    "nothing-varies": "shares of a variance are wanted, but no deviation has a band",
    "nothing-strains": "internal forces are wanted of a machine with as many closures as freedoms",
    "bad-argument": "an argument of a call in Python is of another kind or shape",
    "bad-poses": "the poses given are not finite numbers of the right shape",
    "bad-region": "a region of the workspace that cannot be read, or is none",
    "region-out-of-reach": "a region with poses that the machine cannot be commanded to",
    "bad-resume": "a result that a search for bounds cannot go on from",
    "bad-gap": "a gap that bounds cannot be closed to",
    "bad-truncation": "a number of standard deviations that a distribution cannot be cut at",
    "no-proof": "bounds are wanted where the method has no proof to give",
    "bad-rule": "there is no such decision rule",
    "bad-sampling": "there is no such way of sampling",
    "bad-probability": "a coverage probability that is not between 0 and 1",
    "bad-digits": "a number of significant digits that nobody states an uncertainty with",
    "no-temperature-log": "an error over time is wanted, but there is no temperature log",
    "bad-times": "the times given are not finite numbers",
    "no-pose-left": "the machine can reach none of the poses",
    "not-live": "a live page is wanted of a machine that is not its file's, or of too few poses",
    "unusable-pose": "a pose cannot be used, and --strict makes that an error",
    "output-not-writable": "the output cannot be written",
    "extra-missing": "an optional package that this needs is not installed",
    "output-ending": "the ending of the output file is not one that can be written",
    "output-is-input": "the output would write over a file that is read",
    "output-twice": "two outputs of one command are the same file",
    "stdin-twice": "standard input is given for two files of one command",
    "output-exists": "a new file is wanted where there is one already",
    "machine-file-changed": "a machine file that is not the one that was read",
    "no-witness": "a witness is wanted where no machine exceeds the accuracy asked",
    "witness-not-written": "a witness that a machine file cannot say",
    "no-browser": "a PDF is wanted where no browser is installed that prints it",
    "browser-failed": "the browser that prints a PDF did not start, or did not print",
    "no-live-kernel": "a live page is wanted where the kernel for browsers was not built",
    "unknown-language": "a language that the report is not written in",
    "unknown-kind": "a kind of machine that is not in the library",
    "no-family": "joint centres are to follow from a family, in a file without one",
    "unknown-code": "a code to be explained that nothing gives",
    # studies
    "bad-vary": "a variable of a study that cannot be read, or that changes the poses",
    "bad-design": "a design of a study without what it needs, or with what it does not take",
    "bad-constraint": "a conditioning or travel to spare that no variant can be asked for",
    "bad-reach": "a share of the poses that no variant can be asked for",
    "study-too-large": "a study of more variants than are allowed",
    "other-study": "a store that holds another study than the one that is asked for",
    "store-in-use": "a store of a study that another process writes to",
    # workers
    "bad-workers": "workers that cannot be asked for so",
    "no-scheduler": "a scheduler of workers that does not answer, or no more",
    "no-worker": "no worker is there that may compute",
    "worker-lost": "workers that are lost at their tasks again and again",
    # controllers
    "unknown-controller": "a controller that there is no adapter for",
    "bad-option": "an option of a controller's adapter that it does not have or cannot read",
    "controller-cannot": "a machine that the controller has no way to take",
    "no-difference": "a difference to a file is wanted that has no lines for the numbers",
    "import-unrecognised": "a file that no reader of a controller's format knows",
    "import-declined": "a controller's file of a machine that is not imported",
    "import-incomplete": "a controller's file that does not say what a machine needs",
    "import-include": "a file that another includes, and that is not read",
    "import-syntax": "a line that the controller's format does not have",
    "import-value": "a value that the controller itself does not take",
    "import-steps": "positions that were counted in other steps than the file has now",
    "import-no-measurements": "measurements are wanted of a controller's file that keeps none",
    # calibration
    "controller-unsaid": "a calibrated file that does not say which geometry its controller has",
    "controller-contradicted": "a controller said to hold the drawing, of a file without it",
    "too-few-measurements": "fewer readings than unknowns",
    "no-fit": "measurements that no machine near the nominal one explains",
    "no-unknowns": "a calibration with nothing to identify",
    "bad-band": "a half band of an unknown that cannot be read",
    "bad-prior": "a tolerance that says nothing of one number: a group's whose middles do not move "
    "as the group does, or one that varies with each run or visit",
    "other-machine": "measurements of another machine: its joints, freedoms or struts differ",
    "unknown-instrument": "a row of an instrument that is not declared",
    "no-uncertainty": "a reading of which nothing says how uncertain it is",
    "unwanted-value": "a value that the instrument of the row does not read",
    "not-a-direction": "a direction that is no unit vector",
    "commanded-out-of-reach": "a commanded pose, or joints, that the machine cannot be at",
    "excluding-columns": "columns of a data file that exclude each other",
    "nothing-measured": "measurements without a column of readings",
    "bad-measurements": "arrays of measurements that are not what they must be",
    "bad-hash": "a hash that is no SHA-256",
    "calibration-file-changed": "a machine file that changed since it was read",
    "calibration-undetermined": "an unknown without a finite uncertainty, which no file can state",
    "not-the-same-machine": "two machine files to be compared that have different parameters",
    "calibration-refused": "a calibration that is to be written though the answer is no",
    "calibration-not-written": "a calibrated file that does not say what was found",
    "plan-budget": "a number of poses that cannot be planned",
    "plan-instrument": "an instrument whose readings cannot be planned",
    "plan-option": "an option of a plan or of its program that is not what it can be",
    "plan-way": "a planned pose to which no straight way leads",
    # parts
    "part-address": "a place in a program that cannot be read",
    "part-not-there": "a feature or datum that is said to be where the program has nothing",
    "part-no-motion": "lines of a feature or datum that move nothing at feed",
    "part-shared": "lines that belong to two features, or to a feature and a datum, in part",
    "part-comment": "a comment of a program about a feature that cannot be read",
    "part-nowhere": "a feature or datum of which nothing says where it is in the program",
    "feature-elements": "elements that are not what a kind of feature is about",
    "feature-too-few-points": "so few points that any lie on such a shape exactly",
    "feature-no-circle": "points that are on no circle",
    "feature-short-arc": "an arc that is too short for what is asked of it",
    "feature-direction": "walls or faces that are not parallel, or not at the angle asked for",
    "feature-datums": "datums that form no frame, or none of what a feature needs",
    "no-feature": "a part of which no feature is named",
    "nothing-found": "features are to be proposed of a program that has none of those looked for",
    "unknown-datum": "a datum that the part does not have",
    # tests of machines
    "test-option": "an option of a test that is not what it can be, or is lacking",
    "circle-out-of-reach": "a circle that the machine cannot drive",
    "test-readings": "readings that are none of the test",
    # programs
    "gcode-not-text": "a byte that no program has outside of comments",
    "gcode-line-too-long": "a line of a program longer than a controller reads",
    "gcode-bad-character": "a character that no word begins with",
    "gcode-comment": "a comment that is not closed, or one within another",
    "gcode-no-number": "a letter of a program without its number",
    "gcode-bad-number": "a number of a program that cannot be read",
    "gcode-number-range": "a number of a program too large to be kept exactly",
    "gcode-parameters": "a program that computes: parameters, expressions, functions",
    "gcode-flow": "a program with subprograms, loops or conditions",
    "gcode-block-delete": "a line that begins with /, and nobody says whether it counts",
    "gcode-word-twice": "a letter twice in one block",
    "gcode-modal-group": "two codes of one block that exclude each other",
    "gcode-too-many-codes": "more M codes in a block than a controller takes",
    "gcode-unknown-code": "a G or M code that is not known",
    "gcode-unsupported": "a G or M code that cannot be corrected exactly",
    "gcode-unused-word": "a word that nothing in its block uses",
    "gcode-shared-word": "a word that two codes of its block use",
    "gcode-missing-word": "a word that a code needs is not there",
    "gcode-bad-value": "a word with a number that its code cannot take",
    "gcode-no-offset": "a work offset that nobody has given",
    "gcode-no-units": "a length before G20 or G21 says what it is",
    "gcode-no-motion": "an axis word where no motion is active",
    "gcode-no-feed": "a move at feed before a feed rate is given",
    "gcode-position-unknown": "a move whose start or end is not known",
    "gcode-arc": "an arc that does not close, or is none",
    "gcode-division": "a block that cannot be divided or corrected as asked",
    "bad-along": "a file of what varies along the way is not for this machine and part",
    "gcode-pose": "a move of a program onto or over a pose that the machine cannot be commanded to",
    "gcode-singularity": "a move of a program onto or through a singularity",
    "gcode-tolerance": "a move of a program that no division brings within the tolerance",
    "gcode-axis": "a move of an axis that the platform moves in but that cannot be commanded",
    "gcode-start": "the machine cannot be where the program is said to start",
    "gcode-proof": "a corrected program that, read back, does not keep its tolerance",
    "gcode-no-better": "a corrected program that errs as much as the program did, or more",
    "bad-correction": "an option of a program, or of its correction, that is not what it can be",
}
"""Every code with its meaning in one line. A `Problem` refuses a code that is not here."""


@dataclass(frozen=True)
class Fault:
    """What is wrong, wherever it stands: a code from `CATALOGUE`, and what to tell people.

    `found` is what stands there, `expected` what should, `hint` what to do about it. With its place
    it becomes a `Problem`.
    """

    code: str
    message: str
    found: str | None = None
    expected: str | None = None
    hint: str | None = None

    def about(self, subject: str | None) -> Fault:
        """The same with what it is about before the message, if there is anything to name."""
        return self if subject is None else replace(self, message=f"{subject}: {self.message}")

    def at(
        self,
        file: str | None = None,
        line: int | None = None,
        path: str | None = None,
        column: int | None = None,
    ) -> Problem:
        """The problem that it is at a place."""
        return Problem(
            self.code,
            self.message,
            file,
            line,
            path,
            self.found,
            self.expected,
            self.hint,
            column,
        )


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong with the input, for people (`str`) and for programs (`to_dict`).

    `line` and `column` count from 1. `path` is the key inside the file, rows of an array by their
    name: `strut.1.length`.
    """

    code: str
    message: str
    file: str | None = None
    line: int | None = None
    path: str | None = None
    found: str | None = None
    expected: str | None = None
    hint: str | None = None
    column: int | None = None

    def __post_init__(self) -> None:
        if self.code not in CATALOGUE:
            raise ValueError(f"{self.code!r} is not in truepose.errors.CATALOGUE")

    @property
    def fault(self) -> Fault:
        """What is wrong, without its place."""
        return Fault(self.code, self.message, self.found, self.expected, self.hint)

    @property
    def place(self) -> tuple[str, ...]:
        """File, line and column, as far as they are known."""
        known = []
        for part in (self.file, self.line, self.column):
            if part is None:
                break
            known.append(str(part))
        return tuple(known)

    def __str__(self) -> str:
        place = "".join(f"{part}:" for part in self.place)
        lines = [f"{place} error[{self.code}]: {self.message}".lstrip()]
        for label in ("found", "expected", "hint"):
            value = getattr(self, label)
            if value is not None:
                lines.append(f"  {label + ':':9} {value}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, str | int | None]:
        """The fields by name, for JSON."""
        return asdict(self)


def in_order(problems: Iterable[Problem]) -> list[Problem]:
    """Each once: file by file, in each file's order."""
    every = list(dict.fromkeys(problems))
    files = list(dict.fromkeys(problem.file for problem in every))
    return sorted(every, key=lambda p: (files.index(p.file), p.line is None, p.line or 0))


class ReadingError(ValueError):
    """A value that cannot be read.

    Its `fault` becomes a `Problem` where its place in the file is known.
    """

    def __init__(
        self,
        code: str,
        message: str,
        *,
        found: str | None = None,
        expected: str | None = None,
        hint: str | None = None,
    ) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.found = found
        self.expected = expected
        self.hint = hint

    @property
    def fault(self) -> Fault:
        """What is wrong with the value."""
        return Fault(self.code, self.message, self.found, self.expected, self.hint)


class TrueposeError(Exception):
    """The input cannot be used; `problems` says why, one entry per thing that is wrong."""

    def __init__(self, *problems: Problem) -> None:
        super().__init__(*problems)
        self.problems: tuple[Problem, ...] = problems

    def __str__(self) -> str:
        return "\n".join(str(problem) for problem in self.problems)


class MachineFileError(TrueposeError):
    """The machine file, or the machine that it describes, is wrong."""


class PartError(TrueposeError):
    """What is said of a part's features, in their file or in the program, is wrong."""


class RequestError(TrueposeError):
    """What was asked of a good machine file is wrong: a setting, an option, poses, an output."""


class ArgumentError(RequestError, TypeError, ValueError):
    """An argument of a call is of another kind or shape than the call takes (bad-argument)."""

    @classmethod
    def of(cls, name: str, value: object, expected: str) -> ArgumentError:
        """That `name` is no such thing as is expected."""
        return cls(wrong_argument(name, value, expected))


def wrong_argument(name: str, value: object, expected: str) -> Problem:
    """The problem that the argument `name` is not what is expected."""
    shown = repr(value) if isinstance(value, str | int | float | None) else ""
    found = f"{shown[:60]}, of type " if shown else "something of type "
    return Problem(
        "bad-argument",
        f"{name} is not what this call takes",
        found=f"{found}{type(value).__name__}",
        expected=expected,
    )


class PoseError(ValueError):
    """Some poses of a call cannot be used.

    `count` is how many, `index` the first of them (flat, over the leading shape), `status` its
    status by name (`unreachable`, `singular`, ...), `reason` a sentence that says why.
    """

    def __init__(self, count: int, index: int, status: str, reason: str) -> None:
        super().__init__(count, index, status, reason)
        self.count = count
        self.index = index
        self.status = status
        self.reason = reason

    def __str__(self) -> str:
        poses = "1 pose" if self.count == 1 else f"{self.count} poses"
        first = f"the first is number {self.index}"
        return f"{poses} cannot be used, {first}: {self.status}: {self.reason}"
