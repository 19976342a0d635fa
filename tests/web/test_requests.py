"""Whatever is asked, the page's kernel answers: nothing traps, and what was freed is not kept."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from build_machine import machine_files
from sweeps import sweep
from web_kernel import RefusedError, WebKernel
from web_machine import WebMachine

HEXAPOD = next(path for path in machine_files() if path.stem == "hexapod")


@pytest.fixture(scope="module")
def hexapod(kernel: WebKernel) -> Iterator[WebMachine]:
    machine = WebMachine.of(kernel, HEXAPOD)
    yield machine
    kernel.ask("free", machine=machine.number)


def refused(kernel: WebKernel, op: str, **values: Any) -> tuple[str, str]:
    with pytest.raises(RefusedError) as raised:
        kernel.ask(op, **values)
    code, message, place = raised.value.args
    assert message
    return code, place


@pytest.mark.parametrize(
    "line",
    [
        "",
        "{",
        "null",
        "[]",
        "{}",
        '{"op":7}',
        '{"op":"?"}',
        '{"op":"free"}',
        '"' + "[" * 500,
        "[" * 500,
        '{"op":"errors","machine":1e400}',
        '{"op":"machine","bundle":' + "[" * 100 + "]" * 100 + "}",
    ],
)
def test_what_is_no_request_is_refused(kernel: WebKernel, line: str) -> None:
    assert json.loads(kernel.line(line))["error"]["code"] == "bad-request"


def test_unknown_numbers_and_wrong_lengths_are_refused(hexapod: WebMachine) -> None:
    kernel, number = hexapod.kernel, hexapod.number
    home = hexapod.bundle["workspace"]["home"]
    assert refused(kernel, "place", machine=10**9, poses=[home])[0] == "unknown-machine"
    assert refused(kernel, "more", run=10**9, first=0, count=1)[0] == "unknown-run"
    assert refused(kernel, "free", run=number)[0] == "unknown-run"
    bad: list[tuple[str, dict[str, Any]]] = [
        ("place", {"poses": [home[:-1]]}),
        ("place", {"poses": [[*home[:-1], None]]}),
        ("place", {"poses": home}),
        ("errors", {"poses": [home], "condition": {"temperature": {"nowhere": 300.0}}}),
        ("errors", {"poses": [home], "condition": {"wrench": [1.0]}}),
        ("errors", {"poses": [home], "scale": {"half_width": {"nothing": 1.0}}}),
        ("errors", {"poses": [home], "scale": {"compliance": -1.0}}),
        ("errors", {"poses": [home], "command": "somehow"}),
        ("sensitivities", {"poses": [home], "columns": [10**6]}),
        ("sensitivities", {"poses": [home], "columns": [-1]}),
        ("loads", {"poses": [home], "columns": [0], "wrench": [0.0] * 5}),
        ("largest", {"pose": [home]}),
        ("bounds", {"pose": [home]}),
        ("samples", {"pose": home, "seed": -1}),
        ("samples", {"pose": home}),
    ]
    for op, values in bad:
        code, place = refused(kernel, op, machine=number, **values)
        assert code == "bad-request", (op, values)
        assert place.startswith("request")


def test_numbers_of_any_size_are_answered(hexapod: WebMachine) -> None:
    home = hexapod.bundle["workspace"]["home"]
    parts = [part["part"] for part in hexapod.bundle["parts"]]
    groups = {one["group"] for one in hexapod.bundle["variables"]}
    codes = set()
    for size in (1e-300, 1.0, 1e3, 1e12, 1e150, 1e308):
        pose = [size * value for value in home]
        condition = {"temperature": dict.fromkeys(parts, size), "wrench": [size] * 6}
        scale = {"half_width": dict.fromkeys(groups, size), "compliance": size}
        for asked, at, wide in (
            (condition, pose, None),
            (condition, home, None),
            (None, home, scale),
        ):
            given = {"condition": asked, "scale": wide}
            for command in ("nominal", "corrected"):
                reply = hexapod.ask(
                    "errors",
                    poses=[at],
                    command=command,
                    centres_actual=True,
                    sources=True,
                    **given,
                )
                assert len(reply["errors"]) == 1
                for op in ("largest", "bounds", "worst"):
                    assert hexapod.ask(op, pose=at, command=command, **given)["status"]
            try:
                run = hexapod.ask("samples", pose=at, seed=1, **given)["run"]
            except RefusedError as error:
                codes.add(error.args[0])
                continue
            hexapod.kernel.ask("more", run=run, first=0, count=300)
            assert hexapod.kernel.ask("read", run=run, probabilities=[0.5])["count"] <= 300
            hexapod.kernel.ask("free", run=run)
    assert codes == {"no-pose"}


def test_a_run_keeps_its_parts_apart(hexapod: WebMachine) -> None:
    kernel, home = hexapod.kernel, hexapod.bundle["workspace"]["home"]
    run, other = (hexapod.ask("samples", pose=home, seed=seed)["run"] for seed in (1, 2))
    kernel.ask("more", run=run, first=100, count=100)
    for first in (0, 100, 199):
        assert refused(kernel, "more", run=run, first=first, count=101)[0] == "drawn-already"
    assert refused(kernel, "more", run=run, first=2**64 - 1, count=5)[0] == "too-many-samples"
    assert refused(kernel, "more", run=run, first=300, count=2**60)[0] == "too-many-samples"
    tally = kernel.ask("take", run=run)["tally"]
    for wrong in ("", "?", "AAAA", tally[:-4], tally[4:], tally):
        assert (
            refused(kernel, "merge", run=other if wrong is tally else run, tally=wrong)[0]
            == "bad-tally"
        )
    assert refused(kernel, "merge", run=run, tally=tally)[0] == "drawn-already"
    assert refused(kernel, "read", run=run, probabilities=[1.5])[0] == "bad-request"
    for number in (run, other):
        kernel.ask("free", run=number)
    assert refused(kernel, "read", run=run, probabilities=[])[0] == "unknown-run"


SPOILT = [None, -1, 0, 1.5, 1e300, "", "x", [], {}, [None], True, 10**18]


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=sweep), pytest.param(2, marks=sweep)])
def test_spoilt_bundles_are_refused_or_work(kernel: WebKernel, seed: int) -> None:
    machine = WebMachine.of(kernel, HEXAPOD)
    random = np.random.default_rng(seed)
    codes = set()
    for _ in range(400):
        spoilt = copy.deepcopy(machine.bundle)
        at: Any = spoilt
        while True:
            keys = list(at) if isinstance(at, dict) else list(range(len(at)))
            key = keys[random.integers(len(keys))]
            if not (isinstance(at[key], dict | list) and at[key]) or random.random() < 0.1:
                break
            at = at[key]
        value = SPOILT[random.integers(len(SPOILT))]
        if value is None and isinstance(at, dict):
            del at[key]
        else:
            at[key] = value
        try:
            number = kernel.ask("machine", bundle=spoilt)["machine"]
        except RefusedError as error:
            codes.add(error.args[0])
            continue
        home = machine.bundle["workspace"]["home"]
        for op, asked in (
            ("errors", {"poses": [home]}),
            ("bounds", {"pose": home}),
            ("worst", {"pose": home}),
        ):
            try:
                kernel.ask(op, machine=number, **asked)
            except RefusedError as error:
                codes.add(error.args[0])
        kernel.ask("free", machine=number)
    assert len(codes) > 2
    kernel.ask("free", machine=machine.number)


def test_another_schema_and_a_made_up_law_are_refused(hexapod: WebMachine) -> None:
    bundle = hexapod.bundle
    assert refused(hexapod.kernel, "machine", bundle={**bundle, "schema": 2})[0] == "unknown-schema"
    for term in (
        [10**6, 0.0, 0.0, None],
        [0, 0.0, 1.0, None],
        [0, 0.0, 1.0, 99],
        [0, None, 0.0, None],
        [0],
    ):
        source = {"name": "made-up", "doc": "", "live": True, "at_reference": [term]}
        code, place = refused(
            hexapod.kernel, "machine", bundle={**bundle, "sources": [*bundle["sources"], source]}
        )
        assert code == "bad-request"
        assert place.startswith(f"request.bundle.sources[{len(bundle['sources'])}].at_reference[0]")
    variables = [
        {**bundle["variables"][0], "distribution": {"kind": "bell"}},
        *bundle["variables"][1:],
    ]
    assert (
        refused(hexapod.kernel, "machine", bundle={**bundle, "variables": variables})[0]
        == "bad-request"
    )
    names = ["other", *bundle["parameters"][1:]]
    assert (
        refused(hexapod.kernel, "machine", bundle={**bundle, "parameters": names})[0]
        == "bad-request"
    )


def test_memory_does_not_grow_with_steps_and_runs(hexapod: WebMachine) -> None:
    kernel, home = hexapod.kernel, hexapod.bundle["workspace"]["home"]
    page, _ = hexapod.condition(1)

    def steps(count: int) -> None:
        hexapod.ask(
            "errors", count, poses=[home], condition=page, sources=True, centres_actual=True
        )
        hexapod.ask("errors", max(count // 100, 1), poses=hexapod.poses(300, 1), condition=page)

    def runs(count: int) -> None:
        for seed in range(count):
            run = hexapod.ask("samples", pose=home, condition=page, seed=seed)["run"]
            kernel.ask("more", run=run, first=0, count=256)
            kernel.ask("take", run=run)
            kernel.ask("free", run=run)
            again = WebMachine.of(kernel, HEXAPOD) if seed % 250 == 249 else None
            if again is not None:
                kernel.ask("free", machine=again.number)

    steps(100)
    runs(250)
    before = kernel.memory
    steps(10_000)
    runs(1_000)
    assert kernel.memory == before
