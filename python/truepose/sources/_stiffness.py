"""What the sources that bend the machine have in common: which parts say how stiff they are."""

from __future__ import annotations

from collections.abc import Sequence

from truepose.errors import Problem
from truepose.machine import Drive, Strut
from truepose.machine.compliances import known
from truepose.machine.limbs import Limb


def lacking(
    drives: Sequence[Drive], struts: Sequence[Strut], limbs: Sequence[Limb], cause: str
) -> list[Problem]:
    """A problem (no-stiffness) for every limb along which nothing says how stiff it is.

    `cause` is what bends the machine: "a force acts on the tool".
    """
    return [
        _no_stiffness(strut, cause)
        for strut, stiff in zip(struts, known(drives, struts, limbs), strict=True)
        if not stiff
    ]


def _no_stiffness(strut: Strut, cause: str) -> Problem:
    missing = [
        name
        for name, value in (("section_area", strut.area), ("modulus", strut.modulus))
        if value is None
    ]
    return Problem(
        code="no-stiffness",
        message=f"{cause}, but nothing says how stiff strut {strut.name} is",
        path=strut.part,
        found="no " + " and no ".join(missing),
        expected="section_area and modulus (or material), or an outright axial stiffness; or a "
        "stiffness of its joints, its drive or what its base joint stands on",
        hint='for example section_area = "28.3 mm^2" and material = "steel"',
    )
