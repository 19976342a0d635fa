"""Inputs of a few bytes that would take all time or memory are refused; the page says at what."""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from truepose.errors import MachineFileError, RequestError
from truepose.files import limits
from truepose.files.data_file import Column, read_table
from truepose.files.document import read
from truepose.files.ratio import read_quotient
from truepose.files.units import QuantityError, UnitSystem

ROOT = Path(__file__).parent.parent.parent.parent
MACHINES = ROOT / "machines"
PLANAR = MACHINES / "planar_two_slider.toml"

SECONDS = 60
"""Until a command counts as one that hangs; each takes one second or two."""

MEMORY = 4 << 30
"""Bytes of address space that a command may have."""


def bounded(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """`truepose ARGUMENTS...` in a process of limited memory. Raises `TimeoutExpired`."""
    return subprocess.run(
        [sys.executable, "-c", "from truepose.cli import main; main()", *map(str, arguments)],
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)),
        capture_output=True, text=True, timeout=SECONDS, check=False,
    )  # fmt: skip


def written(folder: Path, *, extra: str = "", schema: str = "1") -> Path:
    """A machine file with more in it."""
    file = folder / "machine.toml"
    text = PLANAR.read_text("utf-8").replace("schema = 1", f"schema = {schema}")
    file.write_text(f"{text}\n{extra}\n", "utf-8")
    return file


def set_target(value: str) -> list[str]:
    return ["check", str(PLANAR), "--set", f"accuracy.target={value}"]


@pytest.mark.parametrize(
    ("value", "code", "sentence"),
    [
        ("1 (((99^99)^99)^99)^99 m", "unknown-unit", "unknown unit"),
        ("1 9^--(99^99) m", "unknown-unit", "unknown unit"),
        ("1 9^9³³ m", "unknown-unit", "unknown unit"),
        ("1 9^9_9_9_9_9_9_9 m", "unknown-unit", "unknown unit"),
        (f'"1{" " * 8000}x\\n m"', "too-long", "found a text of 8005 characters"),
        ("[" * 5000, "bad-setting", "nested too deeply: 50 levels or more"),
        ("1" * 5000, "bad-setting", "more than 400 characters"),
    ],
)  # fmt: skip
def test_a_value(value: str, code: str, sentence: str) -> None:
    run = bounded(*set_target(value))
    assert run.returncode == 2
    assert f"error[{code}]" in run.stderr
    assert sentence in run.stderr
    assert "Traceback" not in run.stderr
    assert len(run.stderr) < 2000


def test_a_coverage_with_many_blanks() -> None:
    run = bounded("check", PLANAR, "--set", f'accuracy.at="{"1" * 20000}{" " * 20000}x"')
    assert run.returncode == 2
    assert "error[unknown-choice]" in run.stderr


@pytest.mark.parametrize(
    ("extra", "schema", "sentence"),
    [
        ("x." * 20_000 + "y = 1", "1", "nested too deeply: 50 levels or more"),
        ("x = " + "[" * 5000, "1", "nested too deeply: 50 levels or more"),
        ("", "1" * 5000, "a number or key of more than 400 characters"),
    ],
    ids=["dotted keys", "brackets", "digits"],
)
def test_a_machine_file(extra: str, schema: str, sentence: str, tmp_path: Path) -> None:
    file = written(tmp_path, extra=extra, schema=schema)
    run = bounded("check", file)
    assert run.returncode == 2
    lines = file.read_text("utf-8").splitlines()
    line = len(lines) if extra else 1 + lines.index(f"schema = {schema}")
    assert f"machine.toml:{line}: error[not-toml]: the file is not TOML: {sentence}" in run.stderr


def test_a_setting_of_many_parts() -> None:
    run = bounded("check", PLANAR, "--set", "x." * 20_000 + "y=1")
    assert run.returncode == 2
    assert "error[bad-setting]" in run.stderr
    assert "20001 parts" in run.stderr


@pytest.mark.parametrize("header", ["time" + " " * 20_000 + "x)(", " " * 20_000 + "(s" * 20_000])
def test_a_header(header: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(f"{header}\n0\n", "utf-8")
    file = written(tmp_path)
    run = bounded("check", file, "--set", "condition.temperature_log=log.csv")
    assert run.returncode == 2
    assert "error[unknown-column]" in run.stderr


def test_a_header_of_many_cells() -> None:
    columns = [Column("time", "time")]
    found = read_table("log.csv", "log.csv", "time (s)" + "," * 2000 + "\n0\n", columns)
    assert found.table is None
    (problem,) = found.problems
    assert (problem.code, problem.line, problem.found) == ("not-csv", 1, "2001 cells")
    most = read_table("log.csv", "log.csv", "time (s)" + ",x" * 1999 + "\n0\n", columns)
    assert {problem.code for problem in most.problems} == {"unknown-column", "ragged-row"}


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("time (s)", "time", "s"),
        (" time [s] ", "time", "s"),
        ("time(s)", "time", "s"),
        ("time (1/(s))", "time", "1/(s)"),
        ("time", "time", None),
        ("time ()", "time", None),
        ("time (s]", "time (s]", None),
        ("time (s) x", "time (s) x", None),
        ("(s)", "", "s"),
        ("", "", None),
    ],
)
def test_a_header_is_a_name_and_a_unit(header: str, name: str, unit: str | None) -> None:
    # By a second road: the expression that took long, on headers of which it does not.
    match = re.match(r"\s*([^(\[]*?)\s*(?:\((.*)\)|\[(.*)\])?\s*\Z", header, re.DOTALL)
    taken = (match[1], match[2] or match[3]) if match else (header.strip(), None)
    assert taken == (name, unit)
    found = read_table("log.csv", "log.csv", f"{header},x (m)\n0,0\n", [Column("time", "time")])
    columns = () if found.table is None else found.table.columns
    assert (columns == ("time",)) == (name == "time")
    if name == "time":
        assert (found.problems[0].code == "no-unit") == (unit is None)


def test_what_is_at_a_limit_is_taken(tmp_path: Path) -> None:
    units = UnitSystem({})
    most = "12.5" + " " * (limits.LONGEST_QUANTITY - 6) + "mm"
    assert len(most) == limits.LONGEST_QUANTITY
    assert units.read(most, "length") == 0.0125
    with pytest.raises(QuantityError, match="201 characters"):
        units.read(" " + most, "length")
    assert units.read("2 m^12/m^11", "length") == 2.0
    with pytest.raises(QuantityError, match="unknown unit"):
        units.read("2 m^13/m^12", "length")
    with pytest.raises(QuantityError, match="unknown unit"):
        units.read("2 ((m^3)^5)/m^14", "length")
    assert units.read("2 ((m^3)^4)/m^11", "length") == 2.0

    within = "x." * (limits.DEEPEST_NESTING - 1) + "y = 1"
    for extra, deep in ((within, False), ("x." + within, True)):
        file = tmp_path / "keys.toml"
        file.write_text(extra, "utf-8")
        if deep:
            with pytest.raises(MachineFileError, match="nested too deeply"):
                read(file)
        else:
            assert list(read(file).data) == ["x"]


def test_dots_and_brackets_of_texts_and_lists_count_for_nothing(tmp_path: Path) -> None:
    file = tmp_path / "texts.toml"
    numbers = ", ".join(["1.5"] * 300)
    file.write_text(
        f'a = "{"x." * 100}{"[" * 100}"\nb = """\n{"x." * 100}\\"""{"[" * 100}"""\n'
        f"c = '{'.' * 100}'\nd = '''{'[' * 100}''\n'''\n# {'[' * 100}\ne = [{numbers}]\n"
        + "".join(f"[[t.u]]\nv.w = [[{n}]]\n" for n in range(100)),
        "utf-8",
    )
    assert len(read(file).data["t"]["u"]) == 100


def test_a_unit_of_no_size() -> None:
    with pytest.raises(QuantityError, match="a unit of no size that anything has") as caught:
        UnitSystem({}).read("1 (ym/Ym)^4 m", "length")
    assert caught.value.code == "too-large"


def test_a_quotient_is_two_quantities() -> None:
    units = UnitSystem({})
    assert read_quotient(" 20 um / 300 mm ", units) == pytest.approx(20e-6 / 0.3, rel=1e-15)
    assert read_quotient("20 um/m", units) is None
    assert read_quotient("/ 300 mm", units) is None
    assert read_quotient("10 arcsec / .5 deg", units) == pytest.approx(20 / 3600, rel=1e-14)


PROGRAM = "G21 G90 G17 F1000\nG0 X200 Y150\nG1 X210\n{}\nM2\n"


@pytest.mark.parametrize(
    ("block", "options", "code", "sentence"),
    [
        ("G2 X210 Y150 I100000000 J0", [], "gcode-division", "628318531"),
        ("G2 X210 Y150 I-10 J0 P100000", [], "gcode-bad-value", "from 1 to 1000"),
        ("G2 X210 Y150 I-10 J0 P1001", [], "gcode-bad-value", "from 1 to 1000"),
        ("G1 X220", ["--tolerance", "1e-30 m"], "bad-correction", "--digits"),
        (
            "G2 X210 Y150 I-20 J0 P1000",
            ["--tolerance", "1e-10 m", "--digits", "8"],
            "gcode-tolerance",
            "at most 500,000 pieces",
        ),
    ],
)
def test_a_program(
    block: str, options: list[str], code: str, sentence: str, tmp_path: Path
) -> None:
    program, out = tmp_path / "program.ngc", tmp_path / "out.ngc"
    program.write_text(PROGRAM.format(block), "utf-8")
    run = bounded("gcode", PLANAR, program, "-o", out, *options)
    assert run.returncode == 2
    assert f"error[{code}]" in run.stderr
    assert sentence in run.stderr
    assert not out.exists()


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("a\\u0000b", "a control character, U+0000"),
        ("a\\u001bb", "a control character, U+001B"),
        ("a\\u0085b", "a control character, U+0085"),
        ("a\\u2028b", "a line separator, U+2028"),
        ("a\\nb", "a control character, U+000A"),
        ("", "nothing"),
        (" ", "nothing but spaces"),
        ("a" * 201, "201 characters"),
    ],
)
@pytest.mark.parametrize("key", ["machine.name", "strut.1.name"])
def test_a_name(key: str, name: str, found: str) -> None:
    import truepose

    with pytest.raises(MachineFileError) as caught:
        truepose.load(PLANAR, settings={key: f'"{name}"'})
    problem = caught.value.problems[0]
    assert (problem.code, problem.found) == ("bad-name", found)
    assert truepose.load(PLANAR, settings={key: f'"{"ä" * 200}"'})


def test_samples() -> None:
    run = bounded("montecarlo", PLANAR, "--samples", "1e18")
    assert run.returncode == 2
    assert "error[bad-samples]" in run.stderr
    assert "at most 1,000,000,000" in run.stderr


def test_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TRUEPOSE_THREADS", "1000000")
    run = bounded("check", PLANAR)
    assert run.returncode == 2
    assert "error[bad-setting]" in run.stderr
    assert f"a whole number from 1 to {limits.MOST_THREADS}" in run.stderr


def test_threads_by_call() -> None:
    import truepose

    with pytest.raises(ValueError, match=f"a whole number from 1 to {limits.MOST_THREADS}"):
        truepose.threads(limits.MOST_THREADS + 1)


def test_the_page_states_every_limit() -> None:
    rows = re.findall(
        r"^\| .+? \| (.+?) \| `([A-Z_]+)` \|", (ROOT / "docs" / "limits.md").read_text(), re.M
    )
    stated = {name: float(number.replace(" ", "")) for number, name in rows}
    assert stated == {name: float(getattr(limits, name)) for name in vars(limits) if name.isupper()}


def test_a_setting_from_python_is_refused_likewise() -> None:
    import truepose

    with pytest.raises(RequestError, match="nested too deeply"):
        truepose.load(PLANAR, settings={"accuracy.target": "[" * 5000})
