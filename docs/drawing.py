"""Drawings of machines as small SVG files: lines of the report's own outline, seen from a corner.

`machine_drawing` is a machine at the middle of its workspace; `errors_drawing` shows where the tool
goes instead, before and after compensation, many times enlarged.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

import numpy as np

import truepose as tp
from truepose.arrays import Floats
from truepose.machine import Machine
from truepose.reporting.figures._outline import is_planar, outline
from truepose.reporting.figures._style import AFTER, BEFORE, INK
from truepose.reporting.figures.machine_drawing import GUIDEWAY, PLATFORM, STRUT, WORKSPACE

MARGIN = 14.0
LINE = 18.0
ENLARGED = 50.0
"""Errors are drawn this many times longer than they are."""


@dataclass
class Drawing:
    """Shapes with their points (n, 2), m in the plane of the picture, y upwards."""

    width: float
    height: float
    title: str
    shapes: list[tuple[str, Floats]] = field(default_factory=list)
    legend: list[tuple[str, str]] = field(default_factory=list)

    def line(self, points: Floats, colour: str, width: float) -> None:
        """A polyline in px of width."""
        style = f'fill="none" stroke="{colour}" stroke-width="{width}" stroke-linecap="round"'
        self.shapes.append((f'<polyline points="{{points}}" {style}/>', points))

    def dots(self, points: Floats, fill: str, radius: float, stroke: str = "none") -> None:
        """A circle of this radius, px, about each point."""
        style = f'r="{radius}" fill="{fill}" stroke="{stroke}"'
        self.shapes += [(f'<circle cx="{{x}}" cy="{{y}}" {style}/>', p[None]) for p in points]

    def text(self) -> str:
        """The SVG file."""
        every = np.concatenate([points for _, points in self.shapes])
        low, high = every.min(axis=0), every.max(axis=0)
        free = np.array([self.width, self.height - LINE * len(self.legend)]) - 2 * MARGIN
        scale = float(np.min(free / np.maximum(high - low, 1e-9)))
        origin = MARGIN + (free - scale * (high - low)) / 2
        parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width:g} {self.height:g}"'
            f' width="{self.width:g}" height="{self.height:g}" role="img">',
            f"<title>{escape(self.title)}</title>",
            f'<rect width="{self.width:g}" height="{self.height:g}" rx="6" fill="#FFFFFF"/>',
        ]
        for shape, points in self.shapes:
            at = scale * (points - low) + origin
            at[:, 1] = 2 * MARGIN + free[1] - at[:, 1]
            x, y = at[0]
            coordinates = " ".join(f"{one:.1f},{other:.1f}" for one, other in at)
            parts.append(shape.format(points=coordinates, x=f"{x:.1f}", y=f"{y:.1f}"))
        for number, (colour, words) in enumerate(self.legend):
            y = 2 * MARGIN + free[1] + LINE * number
            parts.append(
                f'<rect x="{MARGIN}" y="{y - 9:.1f}" width="12" height="12" fill="{colour}"/>'
                f'<text x="{MARGIN + 20}" y="{y + 2:.1f}" font-family="sans-serif" font-size="13"'
                f' fill="{INK}">{escape(words)}</text>'
            )
        return "\n".join([*parts, "</svg>", ""])


def _seen(points: Floats, planar: bool) -> Floats:
    """Points (n, 3) of the base frame -> (n, 2) in the plane of the picture."""
    if planar:
        return points[:, :2]
    turn, lean = np.radians(35.0), np.radians(22.0)
    across = np.array([np.cos(turn), np.sin(turn), 0.0])
    away = np.array([-np.sin(turn), np.cos(turn), 0.0])
    up = np.array([0.0, 0.0, np.cos(lean)]) + np.sin(lean) * away
    return points @ np.stack([across, up], axis=1)


def _draw_machine(drawing: Drawing, machine: Machine, pose: Floats) -> None:
    """Guideways, frame, struts, platform and tool point at one commanded pose, back to front."""
    planar, shape = is_planar(machine), outline(machine, pose)

    def lines(polylines: Iterable[Floats], colour: str, width: float) -> None:
        for polyline in polylines:
            if len(polyline):
                drawing.line(_seen(np.asarray(polyline), planar), colour, width)

    lines([shape.frame], GUIDEWAY, 2)
    lines(shape.paths, GUIDEWAY, 5)
    lines(shape.arms, INK, 3)
    lines(shape.struts, STRUT, 3)
    lines([shape.platform], PLATFORM, 3)
    drawing.dots(_seen(shape.struts.reshape(-1, 3), planar), "white", 3.5, INK)
    drawing.dots(_seen(shape.tool[None], planar), PLATFORM, 4)


def _middle(poses: Floats) -> Floats:
    """The pose nearest the middle of (n_pose, n_commanded), each freedom over its range."""
    span = np.ptp(poses, axis=0)
    away = (poses - poses.mean(axis=0)) / np.where(span > 0.0, span, 1.0)
    return poses[np.argmin((away**2).sum(axis=1))]


def machine_drawing(machine: Machine, width: float = 320.0, height: float = 260.0) -> str:
    """SVG of the machine at the pose nearest the middle of its workspace."""
    poses = machine.poses()
    drawing = Drawing(width, height, f"{machine.name}, drawn to scale")
    places = machine.kernel.placement_of(poses)[:, :3]
    drawing.dots(_seen(places, is_planar(machine)), WORKSPACE, 1.2)
    _draw_machine(drawing, machine, _middle(poses))
    return drawing.text()


def errors_drawing(machine: Machine, width: float = 400.0, height: float = 420.0) -> str:
    """SVG of the poses of a planar machine and where its tool goes instead, enlarged."""
    budget, compensated = tp.budget(machine), tp.compensate(machine)
    poses = machine.poses()[compensated["pose"].values]
    drawing = Drawing(width, height, f"Where the tool of {machine.name} goes instead")
    for result, stem, colour, words in (
        (budget, "overall_error", BEFORE, "as drawn"),
        (compensated, "residual", AFTER, "corrected"),
    ):
        ends = [result[f"{stem}_{end}"].values[:, :2] for end in ("lower", "upper")]
        for pose, low, high in zip(poses, *ends, strict=True):
            drawing.line(pose + ENLARGED * np.stack([low, high]), colour, 3)
        drawing.dots(poses + ENLARGED * sum(ends) / 2, colour, 4)
        most = 1e6 * max(float(np.linalg.norm(end, axis=1).max()) for end in ends)
        drawing.legend.append((colour, f"commanded {words}: up to {most:.0f} µm"))
    drawing.dots(poses, "white", 3, INK)
    drawing.legend.append((INK, f"circle: where it should be; errors enlarged {ENLARGED:g} times,"))
    drawing.legend.append(("#FFFFFF", "from all lengths at lower ends to all at upper ends"))
    return drawing.text()


def machine_and_errors(machine: Machine) -> str:
    """SVG of a planar machine, left, and the errors of its tool, right."""
    left = machine_drawing(machine, 320.0, 420.0).replace("<svg", '<svg x="0" y="0"', 1)
    right = errors_drawing(machine).replace("<svg", '<svg x="320" y="0"', 1)
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 420" width="720" height="420"'
        f' role="img">\n<title>{escape(machine.name)} and the errors of its tool</title>\n'
        f'<rect width="720" height="420" fill="#FFFFFF"/>\n{left}{right}</svg>\n'
    )
