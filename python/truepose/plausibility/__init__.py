"""What looks odd about a machine: blunders that are no error, told beside the answer.

    for oddity in truepose.oddities(machine):
        print(oddity.code, oddity.sentence)

A rule is a file here and its line in `RULES`. It says nothing about a machine that is sound,
whatever its size and family, and changes no answer; `docs/looks_odd.md` has all rules with their
thresholds and where these come from.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from truepose.plausibility import (
    acceleration,
    axis_reversed,
    broken_symmetry,
    crank_travel,
    crossed_struts,
    doubled_strut,
    exchanged_ends,
    expansion,
    far_tool,
    fine_tolerance,
    fixed_at,
    gradient,
    home_out_of_reach,
    idle_tolerance,
    machine_size,
    mass,
    mirrored_order,
    modulus,
    overstrained,
    rail_down,
    reference_temperature,
    section,
    singular_home,
    slipped_decimal,
    stiffness,
    target,
    telescope_stroke,
    temperature,
    wide_band,
    wide_tolerance,
    working_mode,
    workspace_angles,
    workspace_face,
    workspace_size,
)
from truepose.plausibility._base import MachineAtHome, Oddity, Rule
from truepose.runs.arguments import checked

if TYPE_CHECKING:
    from truepose.arrays import Codes
    from truepose.machine import Machine

RULES: tuple[Rule, ...] = (
    machine_size.RULE,
    workspace_size.RULE,
    workspace_angles.RULE,
    crank_travel.RULE,
    telescope_stroke.RULE,
    far_tool.RULE,
    fixed_at.RULE,
    axis_reversed.RULE,
    working_mode.RULE,
    rail_down.RULE,
    exchanged_ends.RULE,
    mirrored_order.RULE,
    crossed_struts.RULE,
    doubled_strut.RULE,
    broken_symmetry.RULE,
    slipped_decimal.RULE,
    home_out_of_reach.RULE,
    singular_home.RULE,
    workspace_face.RULE,
    temperature.RULE,
    reference_temperature.RULE,
    gradient.RULE,
    expansion.RULE,
    modulus.RULE,
    section.RULE,
    stiffness.RULE,
    mass.RULE,
    acceleration.RULE,
    overstrained.RULE,
    wide_tolerance.RULE,
    fine_tolerance.RULE,
    idle_tolerance.RULE,
    wide_band.RULE,
    target.RULE,
)
"""Every rule, in the order in which oddities are told: what the others follow from goes first."""


@checked
def oddities(machine: Machine) -> tuple[Oddity, ...]:
    """What looks odd about a machine, the likeliest cause first; none of a sound one.

    At its home pose, nominal, in the base frame, and over its workspace. Raises `ArgumentError`
    (bad-argument) for what is no machine.
    """
    return _looked_at(MachineAtHome(machine))


def oddities_where_checked(machine: Machine, status: Codes) -> tuple[Oddity, ...]:
    """The same where the kernel's status codes (n_pose,) of the workspace's poses are known."""
    return _looked_at(MachineAtHome(machine, status))


def _looked_at(view: MachineAtHome) -> tuple[Oddity, ...]:
    return tuple(oddity for rule in RULES for oddity in rule.oddities(view))


__all__ = ["RULES", "Oddity", "Rule", "oddities", "oddities_where_checked"]
