"""Data files: what a CSV table may say, and one clear problem for everything that is wrong."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from truepose.files.data_file import MOST_PROBLEMS, Column, DataFiles, DataTable, read_table
from truepose.files.document import Document

COLUMNS = (
    Column("time", "time"),
    Column("strut.1", "temperature", required=False),
    Column("share", "ratio", required=False),
    Column("direction", None, required=False, words=("up", "down")),
    Column("note", None, required=False),
)
LINE = 7


def read(
    folder: Path, content: str | bytes, columns: tuple[Column, ...] = COLUMNS
) -> tuple[DataTable | None, DataFiles]:
    """The table of a file `data.csv`, named in line 7 of a machine file beside it."""
    if isinstance(content, str):
        content = content.encode()
    (folder / "data.csv").write_bytes(content)
    data = {"condition": {"temperature_log": "data.csv"}}
    key = ("condition", "temperature_log")
    document = Document(str(folder / "m.toml"), "m.toml", "", data, {key: LINE})
    files = DataFiles(document)
    return files.read("data.csv", columns, key), files


def test_columns_in_si_with_the_lines_they_stand_in(tmp_path: Path) -> None:
    text = (
        "\ufeff# of Monday\n"
        " strut.1 (degC) , time [min],share (%),direction\r\n"
        "\r\n"
        '20,0,50,up\r\n"21.5",  1.5 , 5e1,down\r\n'
        "  # the end\n"
        ",,,\n"
    )
    table, files = read(tmp_path, text)
    assert files.problems == []
    assert table is not None
    assert table.columns == ("strut.1", "time", "share", "direction")
    assert np.allclose(table.numbers["time"], [0.0, 90.0])
    assert np.allclose(table.numbers["strut.1"], [293.15, 294.65])
    assert np.allclose(table.numbers["share"], 0.5)
    assert table.texts == {"direction": ("up", "down")}
    assert table.lines.tolist() == [4, 5]
    assert table.n_row == 2
    assert table.shown("time", 1) == "1.5 min"
    content = (tmp_path / "data.csv").read_bytes()
    assert files.hashes == {"data.csv": hashlib.sha256(content).hexdigest()}


def test_a_ratio_may_do_without_a_unit_and_free_words_are_taken_as_they_are(
    tmp_path: Path,
) -> None:
    table, _ = read(tmp_path, 'time (s),share,note\n1,0.5,"cold, wet"\n2,1,dry\n')
    assert table is not None
    assert table.numbers["share"].tolist() == [0.5, 1.0]
    assert table.texts["note"] == ("cold, wet", "dry")


@dataclass(frozen=True)
class Bad:
    """A text with exactly one problem, at `line` of the data file (None: of the whole file)."""

    code: str
    text: str | bytes
    line: int | None
    words: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.code}: {self.text!r}"


def bad(code: str, text: str | bytes, line: int | None, *words: str) -> Bad:
    return Bad(code, text, line, words)


CASES = [
    bad("no-rows", "", None, "no header"),
    bad("no-rows", "# nothing\n\n", None, "no header"),
    bad("no-rows", "time (s)\n", 1, "no row below"),
    bad("not-csv", "time (s);strut.1 (degC)\n0;20\n", 1, "semicolons", "commas"),
    bad("not-csv", "time (s)\tstrut.1 (degC)\n0\t20\n", 1, "tabs"),
    bad("not-csv", 'time (s),note\n0,a\n1,"b\n2,c\n', 3, "quotation mark"),
    bad("not-utf8", b"time (s)\n0\n\xff\n", 3, "0xff"),
    bad("not-utf8", "time (s)\n0\n".encode("utf-16"), 1, "UTF-16"),
    bad("no-unit", "time\n0\n", 1, "time: the header names no unit", '"time (s)"'),
    bad("no-unit", "time ()\n0\n", 1, "no unit"),
    bad("unknown-unit", "time (sec onds)\n0\n", 1, 'unknown unit "sec onds"'),
    bad("wrong-dimension", "time (mm)\n0\n", 1, "expected a time, found a length"),
    bad("wrong-dimension", "time (s),strut.1 (delta_degC)\n0,1\n", 1, "a temperature difference"),
    bad("wrong-dimension", "time (s),direction (mm)\n0,up\n", 1, "a column of words has no unit"),
    bad(
        "unknown-column", "time (s),strut.9 (degC)\n0,20\n", 1, "strut.9", 'did you mean "strut.1"'
    ),
    bad("unknown-column", "tyme (s)\n0\n", 1, 'did you mean "time"'),
    bad("unknown-column", "time (s),\n0,\n", 1, "column 2 has no name"),
    bad("missing-column", "strut.1 (degC)\n20\n", 1, "no column time", '"time (s)"'),
    bad("doubled-column", "time (s),time (min)\n0,1\n", 1, "time: the column is there twice"),
    bad("ragged-row", "time (s),strut.1 (degC)\n0,20\n1\n", 3, "too few", "1 cell", "2 cells"),
    bad("ragged-row", "time (s),strut.1 (degC)\n0,20,5\n", 2, "too many", "a point, not a comma"),
    bad("empty-cell", "time (s),strut.1 (degC)\n0,\n", 2, "strut.1: the cell is empty"),
    bad("empty-cell", "time (s),direction\n0,\n", 2, "one of up, down"),
    bad("not-a-number", "time (s)\nsoon\n", 2, "time: the cell is not a number", '"soon"'),
    bad("not-a-number", "time (s)\n5 s\n", 2, "a unit stands in the header"),
    bad("not-a-number", 'time (s)\n"0,5"\n', 2, "a point, not a comma"),
    bad("not-a-number", "time (s)\n1_000\n", 2, "not a number"),
    bad("not-finite", "time (s)\nnan\n", 2, "not finite"),
    bad("not-finite", "time (s)\n-inf\n", 2, "not finite"),
    bad("not-finite", "time (year)\n1e308\n", 2, "not finite"),
    bad("unknown-choice", "time (s),direction\n0,Up\n", 2, '"Up"', 'did you mean "up"'),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_bad_data_file_gives_one_problem(case: Bad, tmp_path: Path) -> None:
    table, files = read(tmp_path, case.text)
    assert table is None
    (problem,) = files.problems
    assert problem.code == case.code
    assert problem.file == str(tmp_path / "data.csv")
    assert problem.line == case.line
    assert problem.found
    assert problem.expected
    for word in case.words:
        assert word in str(problem)


def test_all_problems_of_a_file_at_once(tmp_path: Path) -> None:
    text = "time,strut.1 (mm),dirction\n0,20\nx,20,up\n1,,up\n"
    _, files = read(tmp_path, text)
    assert [(problem.code, problem.line) for problem in files.problems] == [
        ("no-unit", 1),
        ("wrong-dimension", 1),
        ("unknown-column", 1),
        ("ragged-row", 2),
        ("not-a-number", 3),
        ("empty-cell", 4),
    ]


def test_one_kind_of_problem_is_counted_not_repeated_without_end(tmp_path: Path) -> None:
    _, files = read(tmp_path, "time (s)\n" + "x\n" * (MOST_PROBLEMS + 30))
    assert len(files.problems) == MOST_PROBLEMS
    assert "and in 30 more rows" in files.problems[-1].message


@pytest.mark.parametrize(
    ("name", "code", "words"),
    [
        ("dat.csv", "file-missing", "did you mean"),
        ("", "file-is-directory", "data.csv"),
        ("a\0b", "file-unreadable", "null"),
    ],
)
def test_a_file_that_cannot_be_read_is_wrong_where_it_is_named(
    name: str, code: str, words: str, tmp_path: Path
) -> None:
    _, files = read(tmp_path, "time (s)\n0\n")
    assert files.read(name, COLUMNS, ("condition", "temperature_log")) is None
    (problem,) = files.problems
    assert problem.code == code
    assert problem.file == str(tmp_path / "m.toml")
    assert problem.line == LINE
    assert "relative to the machine file" in str(problem)
    assert words in str(problem)


CELLS = st.sampled_from(
    ["time (s)", "time", "strut.1 (degC)", "share", "0", "1.5", "nan", "", '"', "up", "#", "(", "]"]
)
ROWS = st.lists(st.lists(CELLS | st.text(max_size=4), max_size=4).map(",".join), max_size=6)


@settings(max_examples=300, deadline=None)
@given(
    content=ROWS.map("\n".join).map(lambda text: text.encode("utf-8", "replace"))
    | st.binary(max_size=40)
)
def test_any_bytes_are_a_table_or_problems(
    content: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    table, files = read(tmp_path_factory.getbasetemp(), content)
    assert (table is None) == bool(files.problems)
    if table is not None:
        assert table.n_row > 0
        assert all(np.isfinite(each).all() for each in table.numbers.values())
        assert {len(each) for each in (*table.numbers.values(), *table.texts.values())} == {
            table.n_row
        }


BLANKS = (
    Column("x", "length"),
    Column("y", "length", required=False, blank=True),
    Column("word", None, required=False, words=("up", "down"), blank=True),
)


def test_cells_that_may_be_empty() -> None:
    found = read_table("m.csv", "m.csv", "\n# c\nx (mm),y (mm),word\n1,,\n2,3,up\n", BLANKS)
    assert found.problems == ()
    assert found.table is not None
    assert np.array_equal(found.table.numbers["y"], [np.nan, 0.003], equal_nan=True)
    assert found.table.texts["word"] == ("", "up")
    assert found.table.header_line == 3
    assert not any(flags.any() for flags in found.unreadable.values())


def test_a_table_as_far_as_it_can_be_read() -> None:
    text = "x (mm),y (s),word\n,1,upp\n1,2\n2,,up\n3,nan,\n"
    found = read_table("m.csv", "m.csv", text, BLANKS)
    codes = {problem.code for problem in found.problems}
    assert codes == {"wrong-dimension", "empty-cell", "unknown-choice", "ragged-row", "not-finite"}
    assert found.table is not None
    assert found.table.lines.tolist() == [2, 4, 5]
    assert found.unreadable["x"].tolist() == [True, False, False]
    assert found.unreadable["y"].all()  # the unit is none, so no number of it means anything
    assert found.unreadable["word"].tolist() == [True, False, False]
    assert read_table("m.csv", "m.csv", "", BLANKS).table is None
