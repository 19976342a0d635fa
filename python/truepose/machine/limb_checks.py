"""What is wrong with a limb: names, families, what is said twice, lengths, and chains that differ.

A limb says which joints it has; its closures say what it does not let the platform do. Both have to
be the same: whatever the chain leaves free at home, no closure may hold, and the other way round.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from truepose._kernel import Machine as KernelMachine
from truepose.arrays import Floats
from truepose.errors import Fault, Problem
from truepose.files.document import Document
from truepose.files.units import UnitSystem
from truepose.files.wording import did_you_mean, one_of
from truepose.machine.carriages import CHAINS, beams_reach
from truepose.machine.chains import Beam, ChainJoint, Vector
from truepose.machine.elements import guide_kinds
from truepose.machine.limbs import FAMILIES, Limb
from truepose.machine.parts import Drive, Guide, Strut
from truepose.spatial import quaternion_to_matrix

RECIPROCAL = 5e-3
"""Of a closure's wrench, per unit: how much it may work on a motion that the chain leaves free.

A machine that was calibrated is crooked by what its tolerances allow, and still the same machine.
"""

_FREE = {"prismatic": 1, "revolute": 1, "universal": 2, "spherical": 3}
"""Freedoms of each joint."""


@dataclass(frozen=True)
class Parts:
    """What limbs refer to."""

    document: Document
    drives: Sequence[Drive]
    struts: Sequence[Strut]
    guides: Sequence[Guide]
    limbs: Sequence[Limb]
    lengths: Sequence[float | None]
    """Of each strut, m; None where its drive is its length."""
    bases: Sequence[Vector]
    """Of each strut, m."""
    units: UnitSystem

    def shown(self, length: float) -> str:
        """A length in the file's unit, for people."""
        unit = self.units.shown()["length"]
        return f"{float(unit.to_file(length)):.6g} {unit.label}"


def problems(parts: Parts) -> Iterator[Problem]:
    """What is wrong with limbs before anything is built from them."""
    taken: dict[str, str] = {}
    for index, limb in enumerate(parts.limbs):
        found = [*_names(parts, limb), *_twice(parts, limb, taken)]
        found = found or [*_family(parts, limb), *_lengths(parts, limb)]
        for fault, key in found:
            yield parts.document.problem(fault, ("limb", index, *key))
    for index, drive in enumerate(parts.drives):
        for fault in _of_drive(parts, drive) if drive.chain else ():
            yield parts.document.problem(fault, ("drive", index, "chain"))


def unsupported(parts: Parts) -> Iterator[Problem]:
    """What gives way by a matrix in a machine with more closures than freedoms: all refused."""
    fault = Fault(
        "unsupported-chain",
        "the machine has more closures than freedoms, and shares loads by single stiffnesses",
        found="a chain of joints and beams",
        expected="as many closures as freedoms, or no chain",
        hint="the struts' own stiffness and base_stiffness are taken there",
    )
    for index, _ in enumerate(parts.limbs):
        yield parts.document.problem(fault, ("limb", index, "chain"))
    for index, drive in enumerate(parts.drives):
        if drive.chain:
            yield parts.document.problem(fault, ("drive", index, "chain"))


def _of_drive(parts: Parts, drive: Drive) -> Iterator[Fault]:
    """A chain that is not what moves such a body, is said twice, or does not make the arm."""
    joints = tuple(part.kind for part in drive.chain if isinstance(part, ChainJoint))
    beams = [part for part in drive.chain if isinstance(part, Beam)]
    wanted = CHAINS.get(drive.kind)
    first = isinstance(drive.chain[0], ChainJoint)
    if wanted is None or joints != wanted or not first or (beams and drive.kind != "crank"):
        expected = "no chain: it moves no body that struts stand on"
        if wanted is not None:
            expected = f"{wanted[0]}{', then the beams of the arm' * (drive.kind == 'crank')}"
        yield Fault(
            "unsupported-chain",
            f"what a {drive.kind} drive moves does not stand on such a chain",
            found=", ".join(
                "beam" if isinstance(part, Beam) else part.kind for part in drive.chain
            ),
            expected=expected,
        )
        return
    carried = [at for at, strut in enumerate(parts.struts) if strut.drive == drive.name]
    names = {parts.struts[at].name for at in carried}
    twice = [f"limb {limb.name}" for limb in parts.limbs if limb.strut in names]
    twice += [
        f"base_stiffness of strut {parts.struts[at].name}"
        for at in carried
        if parts.struts[at].base_stiffness is not None
    ]
    if twice:
        yield Fault(
            "excluding-keys",
            f"what drive {drive.name} moves is said to give way twice",
            found=f"a chain of the drive, and {', '.join(twice)}",
            expected="one of them",
        )
    if not (beams and carried):
        return
    reach = beams_reach(drive, np.array([parts.bases[at] for at in carried]))
    stated = sum(beam.length for beam in beams if beam.length is not None)
    rests = sum(beam.length is None for beam in beams)
    whole = math.isclose(stated, reach, rel_tol=1e-6)
    if reach <= 0.0 or rests > 1 or (rests and stated >= reach) or not (rests or whole):
        yield Fault(
            "zero-length",
            "the beams do not make the arm",
            found=f"beams of {parts.shown(stated)}, and {rests} without a length",
            expected=f"{parts.shown(reach)} from the axis to the middle of the base joints, or one "
            "beam that takes the rest",
        )


def chain_problems(
    parts: Parts, machine: KernelMachine, joints: Floats, placement: Floats
) -> Iterator[Problem]:
    """Chains that do not leave free what their closures do, at one pose.

    `joints` (n_joint,), `placement` (7,) at home; nothing is looked at where these are not finite.
    """
    if not (np.isfinite(joints).all() and np.isfinite(placement).all()):
        return
    for index, limb in enumerate(parts.limbs):
        fault = _closed(parts, limb, machine, joints, placement)
        if fault is not None:
            yield parts.document.problem(fault, ("limb", index, "chain"))


_Found = tuple[Fault, tuple[str | int, ...]]


def _names(parts: Parts, limb: Limb) -> Iterator[_Found]:
    struts = [strut.name for strut in parts.struts]
    guides = [guide.name for guide in parts.guides]
    if limb.strut is not None and limb.strut not in struts:
        yield _unknown("strut", limb.strut, struts), ("strut",)
    for number, name in enumerate(limb.guides):
        if name not in guides:
            yield _unknown("guide", name, guides), ("guides", number)
    if limb.strut is None and not limb.guides:
        yield (
            Fault(
                "missing-key",
                "a limb of neither strut nor guide holds nothing",
                found="no strut, no guides",
                expected="strut, guides, or both",
            ),
            (),
        )


def _unknown(table: str, name: str, known: Sequence[str]) -> Fault:
    return Fault(
        "unknown-part",
        f'there is no {table} "{name}"',
        found=f'"{name}"',
        expected=one_of(f'"{each}"' for each in known) if known else f"a [[{table}]]",
        hint=did_you_mean(name, known),
    )


def _twice(parts: Parts, limb: Limb, taken: dict[str, str]) -> Iterator[_Found]:
    """Parts of two limbs, and stiffnesses that stand in a row and in the limb as well."""
    of_limb = [f"guide {name}" for name in limb.guides]
    of_limb += [f"strut {limb.strut}"] if limb.strut is not None else []
    for name in of_limb:
        if name in taken:
            yield (
                Fault(
                    "duplicate-name",
                    f"{name} belongs to two limbs",
                    found=f"{name}, of limb {taken[name]} already",
                    expected="every strut and guide in one limb at most",
                ),
                (),
            )
        taken.setdefault(name, limb.name)
    strut = _strut(parts, limb)
    if strut is None:
        return
    said = {
        "stiffness": strut.stiffness is not None,
        "section_area": strut.area is not None,
        "base_stiffness": strut.base_stiffness is not None,
        "base_joint.stiffness": strut.base_joint.stiffness is not None,
        "platform_joint.stiffness": strut.platform_joint.stiffness is not None,
    }
    for key, given in said.items():
        if given:
            yield (
                Fault(
                    "excluding-keys",
                    f"how stiff strut {strut.name} is stands in the strut and in its limb",
                    found=f"{key} of the strut, and a chain",
                    expected="one of them",
                    hint=f"leave {key} of strut {strut.name} away: the chain says it",
                ),
                (),
            )


def _family(parts: Parts, limb: Limb) -> Iterator[_Found]:
    family = FAMILIES.get(limb.family)
    if family is None:
        yield (
            Fault(
                "unsupported-chain",
                f"limbs of the family {limb.family or 'without joints'} cannot be computed yet",
                found=" ".join(joint.kind for joint in limb.joints) or "no joint",
                expected=one_of(FAMILIES),
                hint="the initials of its joints, from the base or the carriage to the platform",
            ),
            ("chain",),
        )
        return
    strut = _strut(parts, limb)
    drive = next((each for each in parts.drives if strut and each.name == strut.drive), None)
    kinds = {guide.name: guide.kind for guide in parts.guides}
    guides = tuple(sorted(kinds[name] for name in limb.guides))
    held = " and ".join(family.drives) + " drive" if family.has_strut else "no strut"
    wanted = " or ".join(_listed(each) for each in family.guides)
    fits = (drive.kind if drive else None) in family.drives if family.has_strut else strut is None
    if not fits or guides not in family.guides:
        yield (
            Fault(
                "open-chain",
                f"a limb of the family {limb.family} has other closures than this one",
                found=f"{_on(strut, drive)}; guides: {_listed(guides)}",
                expected=f"{'a strut on a ' if family.has_strut else ''}{held}; guides: {wanted}",
                hint=_left_free(limb, guides, family.guides),
            ),
            (),
        )
    elif limb.axis is None and limb.family not in ("UPS", "PUS"):
        yield (
            Fault(
                "missing-key",
                "nothing says how the limb is turned",
                found="no axis",
                expected="axis: of the revolute joint; of a tube the y of its section, platform "
                "axes",
            ),
            ("axis",),
        )
    carried = [each for each in parts.struts if drive and each.drive == drive.name]
    if len(carried) > 1 and limb.family != "UPS":
        yield (
            Fault(
                "unsupported-chain",
                f"the carriage of drive {strut.drive if strut else ''} carries several struts",
                found=f"struts {', '.join(each.name for each in carried)}",
                expected="one limb a carriage, or no [[limb]] of its struts: what a "
                "carriage of several stands on is the chain of its [[drive]]",
            ),
            ("strut",),
        )


def _left_free(limb: Limb, guides: Sequence[str], wanted: Sequence[Sequence[str]]) -> str:
    """What the closures hold too little, or too much, for the joints of the chain."""
    free = sum(_FREE[joint.kind] for joint in limb.joints) - (1 if limb.strut else 0)
    held = (1 if limb.strut else 0) + sum(2 if kind == "line" else 1 for kind in guides)
    verdict = f"its joints leave {free} freedoms, so it holds {6 - free}; its closures hold {held}"
    if 6 - free > held:
        return f"{verdict}: {6 - free - held} too few"
    if 6 - free < held:
        return f"{verdict}: {held - 6 + free} too many"
    return verdict


def _on(strut: Strut | None, drive: Drive | None) -> str:
    if strut is None:
        return "no strut"
    return "a strut on the frame" if drive is None else f"a strut on a {drive.kind} drive"


def _listed(words: Sequence[str]) -> str:
    return ", ".join(words) or "none"


def _lengths(parts: Parts, limb: Limb) -> Iterator[_Found]:
    """The beams make the limb: one takes the rest, where its length is not the beams' own."""
    rests = [beam for beam in limb.beams if beam.length is None]
    stated = sum(beam.length for beam in limb.beams if beam.length is not None)
    shortest, fixed = _shortest(parts, limb)
    if not limb.beams:
        found, expected = "no beam", 'a beam, or beam = "rigid"'
    elif len(rests) > 1:
        found, expected = f"{len(rests)} beams without a length", "one at most"
    elif rests and shortest is not None and stated >= shortest:
        found = f"beams of {parts.shown(stated)} in a limb of {parts.shown(shortest)}"
        expected = "something left for the beam without a length"
    elif not rests and not (fixed and shortest and math.isclose(stated, shortest, rel_tol=1e-9)):
        found = f"beams of {parts.shown(stated)}"
        expected = (
            f"{parts.shown(shortest)}, the strut's length"
            if fixed and shortest
            else "one beam without a length, for the limb has not always the same"
        )
    else:
        return
    fault = Fault("zero-length", "the beams do not make the limb", found=found, expected=expected)
    yield fault, ("chain",)


def _shortest(parts: Parts, limb: Limb) -> tuple[float | None, bool]:
    """The least length that the limb can have, m, if that is known; whether it has no other."""
    strut = _strut(parts, limb)
    if strut is None:
        return None, False
    drive = next((each for each in parts.drives if each.name == strut.drive), None)
    length = parts.lengths[list(parts.struts).index(strut)]
    if length is not None:
        return length, True
    if drive is None:
        return None, False
    offset = float(drive.fields.get("offset", 0.0))  # type: ignore[arg-type]
    scale = float(drive.fields.get("scale", 1.0))  # type: ignore[arg-type]
    return offset + scale * drive.travel[0], False


def _strut(parts: Parts, limb: Limb) -> Strut | None:
    return next((strut for strut in parts.struts if strut.name == limb.strut), None)


def _closed(
    parts: Parts, limb: Limb, machine: KernelMachine, joints: Floats, placement: Floats
) -> Fault | None:
    """Whether the closures hold what the chain does not leave free, and nothing else."""
    if limb.axis is None:
        return None
    number = list(parts.limbs).index(limb)
    counts = [len(_closure_names(parts, each)) for each in parts.limbs]
    first = sum(counts[:number])
    at = joints[np.newaxis], placement[np.newaxis]
    wrenches = machine.limb_wrenches_at(*at)[0, first : first + counts[number]]
    start, end = machine.limb_ends_at(*at)[0, number] - placement[:3]
    free = _passive(parts, limb, start, end, placement)
    # A moment against a force, and a turn against a displacement, at the size of the machine.
    size = machine.characteristic_length
    works = np.abs(wrenches @ free.T) / _sizes(wrenches, size)[:, np.newaxis]
    works = works / _sizes(np.roll(free, 3, axis=1), size) / size
    if (works < RECIPROCAL).all():
        return None
    closure, motion = np.unravel_index(int(np.argmax(works)), works.shape)
    return Fault(
        "open-chain",
        f"the closures of limb {limb.name} hold a motion that its joints leave free",
        found=f"closure {_closure_names(parts, limb)[int(closure)]} works on "
        f"{_MOTIONS[limb.family][int(motion)]} at home, {works.max():.2g} of what it can at most",
        expected="an axis, and guides, such that whatever the joints leave free costs no work",
        hint="the revolute's axis is the normal of the plane, and the plane holds the strut's "
        "platform joint",
    )


_MOTIONS = {
    "PRS": ("turning about the revolute", *(f"turning about {axis} of the ball" for axis in "xyz")),
    "UP": ("turning about the cross's axis on the frame", "and on the tube", "sliding"),
}
_MOTIONS["RPS"] = _MOTIONS["PRS"]


def _passive(parts: Parts, limb: Limb, start: Floats, end: Floats, placement: Floats) -> Floats:
    """(n_free, 6) displacements of the tool point and turns that the chain's joints leave free."""
    along = (end - start) / np.linalg.norm(end - start)
    if limb.family == "UP":
        universal = next(
            guide
            for guide in parts.guides
            if guide.name in limb.guides and guide.kind == "universal"
        )
        on_frame = np.array(universal.fields["base_axis"], np.float64)
        on_tube = quaternion_to_matrix(placement[np.newaxis, 3:])[0] @ np.array(
            universal.fields["platform_axis"], np.float64
        )
        turns = [_turn(on_frame, start), _turn(on_tube, start)]
        return np.stack([*turns, np.concatenate([along, np.zeros(3)])])
    return np.stack([_turn(np.array(limb.axis), start), *(_turn(unit, end) for unit in np.eye(3))])


def _turn(axis: Floats, point: Floats) -> Floats:
    """A turn about an axis through a point, from the tool point."""
    unit = axis / np.linalg.norm(axis)
    return np.concatenate([np.cross(point, unit), unit])


def _sizes(vectors: Floats, size: float) -> Floats:
    """(n,) of forces with moments: the moments over `size`."""
    scaled: Floats = np.linalg.norm(vectors / np.repeat([1.0, size], 3), axis=1)
    return scaled


def _closure_names(parts: Parts, limb: Limb) -> list[str]:
    names = [] if limb.strut is None else [f"strut {limb.strut}"]
    for name in limb.guides:
        kind = next(guide.kind for guide in parts.guides if guide.name == name)
        count = guide_kinds()[kind].closures
        names += (
            [f"guide {name}"] if count == 1 else [f"guide {name}.{k + 1}" for k in range(count)]
        )
    return names


__all__ = ["Parts", "chain_problems", "problems", "unsupported"]
