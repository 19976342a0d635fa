"""Calls that only Python can make, of measurements and calibrated files, with what they answer."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import truepose as tp
from truepose.calibration import Frame, Instrument, measurements_of, write_measurements


def show(name: str, work: Callable[[], Any]) -> None:
    """Print what a call gives, or the problems that it raises."""
    print(f"== {name}")
    try:
        print(work())
    except (tp.errors.TrueposeError, TypeError, ValueError) as refused:
        print(type(refused).__name__, refused)


planar, hexapod, warm = (tp.load(f"{name}.toml") for name in ("machine", "hexapod", "warm"))
camera = Instrument("camera", "position", Frame())
wrong = Instrument("camera", "posision", Frame())
poses = planar.poses()[:3]
values = {"x": poses[:, 0], "y": poses[:, 1]}
bare = {"poses": poses, "values": values}
show("no uncertainty", lambda: measurements_of(planar, camera, **bare))
show("bad kind", lambda: measurements_of(planar, wrong, **bare, uncertainty=1e-5))
show("bad poses", lambda: measurements_of(planar, camera, poses=[[1.0]], values=values))
made = measurements_of(planar, camera, **bare, uncertainty=1e-5)
show("written", lambda: write_measurements("made.csv", planar, made))
print(Path("made.csv").read_text())
for times in ([float("nan")], [[1.0]], [-5.0], [30.0], "soon"):
    show(f"over_time at {times}", lambda times=times: tp.over_time(warm, times=times).sizes)
show("a band turned round", lambda: tp.Input.uniform(2.0, 1.0))
show("listed", lambda: tp.Input.empirical([1.0, 2.0, 2.5]).standard_uncertainty)
show("student", lambda: tp.Input.student_t(1.0, 0.1, 1.5))
signs = {"a": tp.Input.two_point(1.0, 2.0), "b": tp.Input.normal(1.0, 0.1)}
strong = {("a", "b"): 0.95}
for correlation in (strong, {("a", "c"): 0.5}, {("a", "b"): 2.0}, [[1.0, 0.5], [0.5, 1.0]]):
    show(
        f"correlation {correlation}",
        lambda correlation=correlation: (
            tp.monte_carlo(lambda a, b: a * b, inputs=signs, correlation=correlation, samples=64)[
                "mean"
            ].values
        ),
    )
refused = tp.calibrate(hexapod, "strut-length.csv")
file, day = "hexapod.toml", "2026-01-31"
show("refused", lambda: refused.save("new.toml", original=file, date=day))
show("no day", lambda: refused.save("new.toml", original=file, date="soon", force=True))
accepted = tp.calibrate(hexapod, "pose.csv")
Path("other.toml").write_text(Path(file).read_text() + "# edited\n")
show("edited", lambda: accepted.save("new.toml", original="other.toml", date=day))
show("saved", lambda: accepted.save("new.toml", original=file, date=day).name)
text = Path("new.toml").read_text()
Path("hash.toml").write_text(text.replace('_hash = "', '_hash = "zz'))
show("hash", lambda: tp.load("hash.toml"))
