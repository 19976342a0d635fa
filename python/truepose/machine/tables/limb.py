"""`[[limb]]`: what the closures of a strut and of guides are made of, and how stiff that is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Literal

from pydantic import Field, model_validator

from truepose.errors import Fault
from truepose.files.file_table import FileTable, PartName
from truepose.files.quantity import (
    AcrossStiffness,
    Area,
    Direction,
    Expansion,
    Mass,
    Modulus,
    PositiveLength,
    Ratio,
    RigidStiffness,
    Scale,
    SecondMoment,
    ShearCoefficient,
    TiltStiffness,
    refuse,
)
from truepose.machine.materials import MATERIALS, MaterialName
from truepose.machine.sections import Section, bar, box, h_beam, rectangle, tube

JointKind = Literal["prismatic", "revolute", "universal", "spherical"]
BeamKind = Literal["tube", "bar", "box", "rectangle", "h", "section", "rigid"]

JOINT_KEYS: Mapping[str, tuple[str, ...]] = {
    "prismatic": ("across", "tilt"),
    "revolute": ("radial", "axial", "tilt"),
    "universal": ("radial", "axial", "tilt"),
    "spherical": ("radial", "axial"),
}
"""What each joint transmits, and so has a stiffness against."""

BEAM_KEYS: Mapping[str, tuple[str, ...]] = {
    "tube": ("outside", "wall"),
    "bar": ("diameter",),
    "box": ("height", "width", "wall"),
    "rectangle": ("height", "width"),
    "h": ("height", "width", "web", "flange"),
    "section": ("area", "moments", "torsion", "shear_coefficient"),
    "rigid": (),
}
"""The measures of each section."""

_OF_BEAMS = ("length", "material", "modulus", "shear_modulus", "poisson", "expansion")
_OF_BEAMS_TOO = ("shear_coefficient",)


def _listed(keys: Iterable[str]) -> str:
    return ", ".join(keys)


class LimbPartTable(FileTable):
    """A joint or a beam of a limb's `chain`."""

    joint: JointKind | None = Field(None, description="Which joint this is; of a beam none.")
    beam: BeamKind | None = Field(
        None,
        description="Which section the beam has; `section`: of a stated area and moments; `rigid`: "
        "it does not give way.",
    )
    stiffness: Literal["rigid"] | None = Field(
        None, description='`"rigid"`: a joint that does not give way, instead of its stiffnesses.'
    )
    radial: RigidStiffness | None = Field(
        None,
        description="Of a joint: stiffness across the axis of a revolute, of another across the "
        'limb; a stiffness, or "rigid".',
    )
    axial: RigidStiffness | None = Field(
        None, description="Of a joint: along the axis of a revolute, of another along the limb."
    )
    across: AcrossStiffness | None = Field(
        None,
        description="Of a prismatic: across its way; one stiffness, or [y, z], y along `axis` of "
        "the limb.",
    )
    tilt: TiltStiffness | None = Field(
        None,
        description="Of a joint: against turning where it does not turn; of a prismatic one "
        "stiffness, or [about its way, about y, about z].",
    )
    axis: Direction | None = Field(
        None,
        description="Of a prismatic: its y axis. Default: `axis` of the limb; of a drive's "
        "carriage any.",
    )
    length: PositiveLength | None = Field(
        None, description="Of a beam. Default: what the other beams leave of the limb."
    )
    outside: PositiveLength | None = Field(None, description="Outside diameter of a tube.")
    diameter: PositiveLength | None = Field(None, description="Diameter of a bar.")
    wall: PositiveLength | None = Field(None, description="Wall of a tube or a box.")
    height: PositiveLength | None = Field(
        None, description="Of a box, a rectangle or an H outside, along `axis` of the limb."
    )
    width: PositiveLength | None = Field(
        None, description="Of a box, a rectangle or an H outside, across `axis` of the limb."
    )
    web: PositiveLength | None = Field(None, description="Thickness of an H's web.")
    flange: PositiveLength | None = Field(None, description="Thickness of an H's flanges.")
    area: Area | None = Field(None, description="Of a `section`.")
    moments: tuple[SecondMoment, SecondMoment] | None = Field(
        None,
        strict=False,
        description="Of a `section`: second moments of area about y (bending along z) and about z.",
    )
    torsion: SecondMoment | None = Field(None, description="Of a `section`: torsion constant.")
    shear_coefficient: ShearCoefficient | None = Field(
        None,
        description="By which the area counts in shear; one number, or [along y, along z]. "
        "Default, but of a `section`: after Cowper (1966), from Poisson's ratio.",
    )
    material: MaterialName | None = Field(
        None,
        description="Gives `modulus`, `poisson` and `expansion` where they are not written.",
    )
    modulus: Modulus | None = Field(None, description="Young's modulus of a beam.")
    shear_modulus: Modulus | None = Field(
        None, description="Of a beam. Default: modulus / 2 (1 + poisson)."
    )
    poisson: Ratio | None = Field(None, description="Poisson's ratio of a beam.")
    expansion: Expansion | None = Field(
        None, description="Coefficient of linear thermal expansion of a beam."
    )

    @model_validator(mode="after")
    def _is_one_thing(self) -> LimbPartTable:
        given = [key for key in type(self).model_fields if getattr(self, key) is not None]
        if (self.joint is None) == (self.beam is None):
            refuse(
                Fault(
                    "excluding-keys" if self.joint else "missing-key",
                    "a part of a limb is a joint or a beam",
                    found=_listed(given) if given else "nothing",
                    expected="joint or beam",
                )
            )
        kind = self.joint or self.beam
        if self.joint is not None:
            needed = () if self.stiffness else JOINT_KEYS[self.joint]
            allowed = {"joint", "stiffness", *needed}
            allowed |= {"axis"} if self.joint == "prismatic" else set()
        else:
            assert self.beam is not None
            needed = BEAM_KEYS[self.beam]
            rigid = self.beam == "rigid"
            own = ("length", "material", "expansion") if rigid else (*_OF_BEAMS, *_OF_BEAMS_TOO)
            allowed = {"beam", *needed, *own}
        missing = [key for key in needed if getattr(self, key) is None]
        if missing:
            way_out = ', or stiffness = "rigid"' if self.joint else ""
            refuse(
                Fault(
                    "missing-key",
                    f"a {kind} {'joint' if self.joint else 'beam'} without {_listed(missing)}",
                    found=_listed(given),
                    expected=f"{_listed(needed)}{way_out}",
                )
            )
        if self.beam is not None and self.beam != "rigid":
            self._says_its_material()
        surplus = [key for key in given if key not in allowed]
        if surplus:
            refuse(
                Fault(
                    "unknown-key",
                    f"a {kind} {'joint' if self.joint else 'beam'} has no {_listed(surplus)}",
                    found=_listed(surplus),
                    expected=_listed(sorted(allowed)),
                )
            )
        return self

    @property
    def poisson_ratio(self) -> float | None:
        """Stated, or that of the material; None where neither says it."""
        if self.poisson is not None or self.material is None:
            return self.poisson
        return MATERIALS[self.material].poisson

    def _says_its_material(self) -> None:
        lacking = []
        if self.modulus is None and self.material is None:
            lacking.append("modulus")
        if self.poisson_ratio is None and (
            self.shear_modulus is None or self.shear_coefficient is None
        ):
            lacking.append("poisson (or shear_modulus and shear_coefficient)")
        if lacking:
            refuse(
                Fault(
                    "missing-key",
                    f"nothing says what a {self.beam} beam is made of: no {_listed(lacking)}",
                    found=self.material or "no material",
                    expected='material = "steel", or ' + _listed(lacking),
                )
            )
        for thick, thin in (
            ("outside", "wall"),
            ("height", "wall"),
            ("width", "wall"),
            ("height", "flange"),
            ("width", "web"),
        ):
            whole, part = getattr(self, thick), getattr(self, thin)
            twice = 1.0 if thin == "web" else 2.0
            if whole is not None and part is not None and twice * part >= whole:
                refuse(
                    Fault(
                        "empty-section",
                        f"the {thin} of a {self.beam} leaves nothing of its {thick}",
                        found=f"{thin} {part:g} m, {thick} {whole:g} m",
                        expected=f"{'twice ' if twice == 2.0 else ''}the {thin} below the {thick}",
                    )
                )


def section_of(row: LimbPartTable) -> Section:
    """The section of a beam that is not rigid."""
    poisson = row.poisson_ratio or 0.0
    measures = [getattr(row, key) for key in BEAM_KEYS[str(row.beam)]]
    if row.beam == "section":
        area, (about_y, about_z), torsion, (along_y, along_z) = measures
        return Section(area, about_y, about_z, torsion, along_y, along_z)
    section = _SECTIONS[str(row.beam)](*measures, poisson)
    if row.shear_coefficient is None:
        return section
    along_y, along_z = row.shear_coefficient
    return replace(section, shear_y=along_y, shear_z=along_z)


_SECTIONS: Mapping[str, Callable[..., Section]] = {
    "tube": tube,
    "bar": bar,
    "box": box,
    "rectangle": rectangle,
    "h": h_beam,
}


class LimbTable(FileTable):
    """A limb that says what it is made of: a chain of joints and beams, from base to platform."""

    name: PartName = Field(description="Name of the limb.")
    strut: str | None = Field(None, description="The strut that it contains, by its name.")
    guides: list[str] = Field(
        [], description="The guides that it contains: what it lets the platform not do."
    )
    axis: Direction | None = Field(
        None,
        description="Axis of the limb's revolute joint, axes of the carriage or frame; of a tube "
        "on the platform the y of its section, platform axes.",
    )
    chain: list[LimbPartTable] = Field(
        description="Its joints and beams, from the base or the carriage to the platform."
    )
    compliance: Scale = Field(
        1.0,
        description="By how many times as much its beams give way as their sections and materials "
        "say: a calibration under load finds it.",
    )
    mass: Mass = Field(
        0.0,
        description="Of a tube on the platform, which carries it; that of a strut is the strut's.",
    )
    length: PositiveLength | None = Field(
        None, description="Of a tube on the platform: the whole, with what stands beyond its joint."
    )


__all__ = ["BEAM_KEYS", "JOINT_KEYS", "LimbPartTable", "LimbTable", "section_of"]
