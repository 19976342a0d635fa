"""Random machines are what they say: reproducible, sound, and of every kind."""

from __future__ import annotations

import tomllib
from collections import Counter

import numpy as np

from drawn_topics import TOPICS
from machine_file import rows_of
from machine_under_test import OK
from random_machines import DRAWN, DrawnMachine


def test_a_drawn_machine_is_a_file_whose_poses_are_all_reached(drawn: DrawnMachine) -> None:
    """On both roads: the loader's, and the standard library's description of the same text."""
    assert drawn.loaded.parameters == drawn.kernel.parameters
    assert np.abs(drawn.loaded.nominal - drawn.kernel.nominal).max() < 1e-13
    _, status = drawn.loaded.inverse(drawn.poses, status=True)
    assert (status == OK).all()
    _, status = drawn.loaded.sensitivity(drawn.loaded.poses(), status=True)
    assert (status == OK).all()
    assert tomllib.loads(drawn.text) == drawn.file


def test_drawing_again_gives_the_same_file() -> None:
    for machine in DRAWN[::9]:
        assert DrawnMachine(machine.like, machine.number).text == machine.text


def test_a_topic_left_out_changes_no_other() -> None:
    for machine in DRAWN[::9]:
        alone = machine.file_with("tolerance")
        assert alone.get("tolerance") == machine.file.get("tolerance")
        assert "condition" not in alone
        both = machine.file_with("tolerance", "wrench")
        assert both["condition"]["force"] == machine.file_with(*TOPICS)["condition"]["force"]


def test_every_topic_source_and_form_is_among_them() -> None:
    topics = Counter(topic for machine in DRAWN for topic in machine.topics)
    assert len(topics) == len(TOPICS)
    assert min(topics.values()) > 50
    sources = Counter(source.name for machine in DRAWN for source in machine.loaded.sources)
    assert min(sources.values()) >= 10
    assert len(sources) == 10
    bands = [
        band
        for machine in DRAWN
        for band in (
            *machine.file.get("tolerance", {}).values(),
            *(
                row["length_tolerance"]
                for row in machine.file["strut"]
                if "length_tolerance" in row
            ),
        )
    ]
    assert {type(band) for band in bands} == {float, str, list, dict}
    words = {band.get("distribution") for band in bands if isinstance(band, dict)}
    assert {"triangular", "arcsine", "two-point", "normal", "student-t", "discrete"} <= words
    drives = [row for machine in DRAWN for row in rows_of(machine.file, "drive")]
    for key in ("offset", "scale", "fixed_at", "mass", "stiffness", "backlash", "guideway"):
        assert sum(key in row for row in drives) > 50, key
