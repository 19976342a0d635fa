"""What may be asked of `truepose.accuracy`, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, call
from machine_texts import PLANAR, edited, load_text
from sweeps import thinned
from truepose.errors import MachineFileError, RequestError
from truepose.verdict.states import AFTER, BEFORE, STATES


def test_one_state_alone_is_the_same_as_among_both(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    both = tp.accuracy(machine)
    assert [answer.state for answer in both] == list(STATES)
    for state, answer in zip(STATES, both, strict=True):
        (alone,) = tp.accuracy(machine, states=(state, state))
        assert alone.state == state
        assert alone.answer == answer.answer
        assert alone.witness.value == answer.witness.value
        assert alone.bound.value == answer.bound.value


@pytest.mark.parametrize(
    ("states", "found"),
    [
        (("before",), "'before'"),
        ((BEFORE, "After compensation"), "'After compensation'"),
        (AFTER, "'after compensation'"),
        ((), "none"),
    ],
)
def test_other_states_are_refused(tmp_path: Path, states: Any, found: str) -> None:
    with pytest.raises(RequestError) as caught:
        tp.accuracy(load_text(tmp_path, PLANAR), states=states)
    (problem,) = caught.value.problems
    assert (problem.code, problem.found) == ("unknown-choice", found)


# --- a machine that no end of its bands lets assemble


def test_a_band_in_which_nothing_can_be_assembled_is_not_met(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """At every pose one of its machines cannot: there is no budget, but there is an answer."""
    path = tmp_path / "wide.toml"
    path.write_text(edited(PLANAR, ("length_tolerance = [-0.3, 0.3]", "length_tolerance = 450")))
    assert call(capsys, "budget", path).codes == ["no-pose-left"]
    witness = tmp_path / "witness.toml"
    outcome = call(capsys, "check", path, "--set", "accuracy.target=900 mm", "--witness", witness)
    assert outcome.code == 1
    lost = "NOT met  position before compensation: a machine that cannot be"
    assert any(line.startswith(lost) for line in outcome.out.splitlines())
    with pytest.raises(RequestError) as caught:
        tp.budget(tp.load(witness))
    assert "no-pose-left" in [problem.code for problem in caught.value.problems]
    # Half of all machines can be assembled, 95 % cannot.
    share = call(capsys, "check", path, "--set", "accuracy.at=95 %", "--format", "csv")
    assert share.code == 1
    assert "NOT met" in share.out


# --- a machine that only turns


def wrist(asked: str) -> str:
    """Three telescopic struts to a platform that turns about the origin."""
    bases = [(200.0, 0.0, -300.0), (-100.0, 173.0, -300.0), (-100.0, -173.0, -300.0)]
    platforms = [(-40.0, 69.0, 0.0), (-40.0, -69.0, 0.0), (80.0, 0.0, 0.0)]
    text = 'schema = 1\n[machine]\nname = "wrist"\ndof = ["a", "b", "c"]\n'
    text += '[units]\nlength = "mm"\nangle = "deg"\n'
    for number, (base, platform) in enumerate(zip(bases, platforms, strict=True)):
        offset = float(np.linalg.norm(np.subtract(base, platform)))
        text += (
            f'[[drive]]\nname = "d{number}"\nkind = "telescopic"\noffset = {offset}\n'
            f'travel = [-100, 100]\n[[strut]]\nname = "{number}"\ndrive = "d{number}"\n'
            f"base = {list(base)}\nplatform = {list(platform)}\n"
        )
    text += '[tolerance]\n"drive.*.offset" = 0.05\n"strut.*.base.?" = 0.02\n'
    return (
        f"{text}[workspace]\ngrid = {{ a = [-10, 10, 3], b = [-10, 10, 3] }}\n[accuracy]\n{asked}"
    )


def test_of_a_wrist_the_orientation_is_judged(tmp_path: Path) -> None:
    found = tp.accuracy(load_text(tmp_path, wrist('angle_target = "0.1 deg"\n')))
    assert [(each.quantity, each.state) for each in found] == [
        ("orientation", state) for state in STATES
    ]
    assert all(each.answer == "NOT met" for each in found)
    wide = tp.accuracy(load_text(tmp_path, wrist('angle_target = "1 deg"\n')))
    assert all(each.answer == "met" for each in wide)


def test_of_a_wrist_no_position_is_asked(tmp_path: Path) -> None:
    """It was passed over: a machine passed that nobody had judged."""
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, wrist('target = "1 um"\n'))
    (problem,) = caught.value.problems
    assert problem.code == "unknown-freedom"
    assert problem.path == "accuracy.target"


# --- distributions without ends


def test_where_normal_variables_are_taken_to_end_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "normal.toml"
    banded = "length_tolerance = [-0.3, 0.3]"
    normal = 'length_tolerance = { band = 0.3, distribution = "normal", sigmas = 2 }'
    path.write_text(edited(PLANAR, (banded, normal)))
    ends = "taken to end there: normal, 2 sigma"
    for target, word in (("0.1 mm", "NOT met"), ("2 mm", "met")):
        for answer in tp.accuracy(tp.load(path, settings=[f"accuracy.target={target}"])):
            assert (answer.answer, answer.rests_on.partition("; ")[2]) == (word, ends)
    assert ends in " ".join(call(capsys, "bounds", path).out.split())
    for answer in tp.accuracy(load_text(tmp_path, PLANAR)):
        assert ";" not in answer.rests_on


# --- the witness as a machine in space


@pytest.mark.parametrize(
    "name", thinned(["hexapod", "planar_two_slider", "linear_delta", "3prs"], {"planar_two_slider"})
)
def test_joint_centres_of_a_witness_are_those_of_its_forward_solution(name: str) -> None:
    """Its centres follow from its error; here they follow from its joints, solved anew."""
    machine = tp.load(MACHINES / f"{name}.toml")
    for answer in tp.accuracy(machine):
        witness = answer.example
        assert witness is not None
        columns, values = witness.moved
        names = [machine.parameters[column] for column in columns]
        actual = machine.replace(
            dict(zip(names, (machine.nominal[columns] + values[0]).tolist(), strict=True))
        )
        joints = witness.joints[np.newaxis]
        poses = actual.forward(joints, witness.pose)
        there = actual.kernel.joint_centres(joints, actual.kernel.placement_of(poses))[0]
        centres = witness.joint_centres
        assert centres is not None
        assert centres == pytest.approx(there, abs=1e-13)
        assert np.abs(
            centres - machine.kernel.joint_centres(joints, witness.block.placements)
        ).max()


def test_a_witness_that_cannot_be_assembled_is_nowhere(tmp_path: Path) -> None:
    wide = edited(PLANAR, ("length_tolerance = [-0.3, 0.3]", "length_tolerance = 450"))
    witness = tp.accuracy(load_text(tmp_path, wide))[0].example
    assert witness is not None
    assert witness.joint_centres is None
