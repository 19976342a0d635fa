"""Blunders that owners make in a machine file, each in a machine of the library.

`BLUNDERS` are made in the file's plain tables (machine_file.py), by what somebody would have typed;
each has the code of the rule that should find it.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass

from build_machine import MACHINES
from machine_file import File, file_at


@dataclass(frozen=True)
class Blunder:
    """What somebody typed: a change of a library machine's file, and the code that it gives."""

    name: str
    machine: str
    code: str
    change: Callable[[File], None]

    @property
    def file(self) -> File:
        """The tables of the file with the blunder in it."""
        file = copy.deepcopy(file_at(MACHINES / f"{self.machine}.toml"))
        self.change(file)
        return file


BLUNDERS: list[Blunder] = []


def _blunder(machine: str, code: str) -> Callable[[Callable[[File], None]], Callable[[File], None]]:
    def register(change: Callable[[File], None]) -> Callable[[File], None]:
        BLUNDERS.append(Blunder(change.__name__.lstrip("_"), machine, code, change))
        return change

    return register


def _swap(rows: list[dict], one: int, other: int, key: str) -> None:
    rows[one][key], rows[other][key] = rows[other][key], rows[one][key]


@_blunder("tripod", "machine-size")
def _metres_for_millimetres(file: File) -> None:
    file["units"]["length"] = "m"


@_blunder("hexapod", "machine-size")
def _micrometres_for_inches(file: File) -> None:
    file["units"]["length"] = "um"


@_blunder("linapod", "workspace-size")
def _workspace_in_metres(file: File) -> None:
    for axis, (first, last, count) in file["workspace"]["grid"].items():
        if axis in "xyz":
            file["workspace"]["grid"][axis] = [first / 1000, last / 1000, count]
    file["workspace"]["home"] = {"z": 200}


@_blunder("hexaglide", "workspace-angles")
def _degrees_as_radians_in_the_workspace(file: File) -> None:
    file["units"]["angle"] = "rad"


@_blunder("five_bar", "crank-travel")
def _degrees_as_radians_of_cranks(file: File) -> None:
    file["units"]["angle"] = "rad"


@_blunder("tripod", "telescope-stroke")
def _travel_with_a_digit_too_few(file: File) -> None:
    for drive in file["drive"]:
        drive["travel"] = [50, 1000]


@_blunder("3prs", "far-tool")
def _tool_in_micrometres(file: File) -> None:
    file["machine"]["tool"] = [0, 0, -120000]


@_blunder("linapod", "fixed-far")
def _bearing_of_a_screw_with_a_digit_too_many(file: File) -> None:
    for drive in file["drive"]:
        drive["fixed_at"] = 14000


@_blunder("walking_6psu", "axis-reversed")
def _axis_with_the_wrong_sign(file: File) -> None:
    file["drive"][1]["axis"] = [0, 0, -1]


@_blunder("five_bar", "axis-reversed")
def _cranks_that_turn_the_other_way(file: File) -> None:
    for drive in file["drive"]:
        drive["axis"] = [0, 0, -1]


@_blunder("planar_two_slider", "other-working-mode")
def _working_mode_of_the_other_side(file: File) -> None:
    file["drive"][0]["working_mode"] = "-"


@_blunder("rotary_delta", "other-working-mode")
def _elbows_the_other_way(file: File) -> None:
    for drive in file["drive"]:
        drive["working_mode"] = "-"


@_blunder("linear_delta", "rail-down")
def _rails_that_point_down(file: File) -> None:
    for drive in file["drive"]:
        drive["axis"] = [0, 0, -1]


@_blunder("hexapod", "exchanged-ends")
def _base_and_platform_exchanged(file: File) -> None:
    for strut in file["strut"]:
        strut["base"], strut["platform"] = strut["platform"], strut["base"]


@_blunder("3rpr", "exchanged-ends")
def _base_and_platform_exchanged_in_a_plane(file: File) -> None:
    for strut in file["strut"]:
        strut["base"], strut["platform"] = strut["platform"], strut["base"]


@_blunder("3rrr", "mirrored-order")
def _two_platform_joints_exchanged(file: File) -> None:
    _swap(file["strut"], 0, 1, "platform")


@_blunder("hexapod", "mirrored-order")
def _platform_counted_the_other_way_round(file: File) -> None:
    joints = [strut["platform"] for strut in file["strut"]]
    for strut, joint in zip(file["strut"], [joints[1], joints[0], *joints[:1:-1]], strict=True):
        strut["platform"] = joint


@_blunder("linapod", "crossed-struts")
def _crossed_struts(file: File) -> None:
    _swap(file["strut"], 0, 1, "platform")


@_blunder("linear_delta", "crossed-struts")
def _rods_of_a_pair_crossed(file: File) -> None:
    _swap(file["strut"], 0, 1, "platform")
    for strut in file["strut"][:2]:
        strut["length"] = 336.73


@_blunder("hexapod_all_sources", "doubled-strut")
def _strut_copied_and_not_changed(file: File) -> None:
    for key in ("base", "platform"):
        file["strut"][2][key] = list(file["strut"][0][key])


@_blunder("tricept", "broken-symmetry")
def _sign_of_a_base_joint(file: File) -> None:
    file["strut"][2]["base"] = [433.012702, 250, 0]


@_blunder("linapod", "broken-symmetry")
def _sign_of_a_platform_joint(file: File) -> None:
    file["strut"][3]["platform"] = [64.704761, -241.481457, 0]


@_blunder("walking_6psu", "broken-symmetry")
def _x_and_y_of_a_rail_exchanged(file: File) -> None:
    file["drive"][5]["origin"] = [76.514, 244.529, -178.076]


@_blunder("3prs", "slipped-decimal")
def _point_slipped_in_a_length(file: File) -> None:
    file["strut"][1]["length"] = 50.0


@_blunder("linear_delta", "slipped-decimal")
def _point_slipped_in_a_tolerance(file: File) -> None:
    file["strut"][4]["length_tolerance"] = 0.2


@_blunder("rotary_delta", "slipped-decimal")
def _point_slipped_in_a_section(file: File) -> None:
    file["strut"][2]["section_area"] = "2.827 mm^2"


@_blunder("tripod", "home-out-of-reach")
def _base_a_digit_too_high(file: File) -> None:
    for strut in file["strut"]:
        strut["base"][2] = 9000


@_blunder("hexapod", "singular-home")
def _base_and_platform_of_one_shape(file: File) -> None:
    for strut in file["strut"]:
        strut["platform"] = [0.4 * value for value in strut["base"]]


@_blunder("planar_two_slider", "workspace-face")
def _workspace_a_digit_too_wide(file: File) -> None:
    file["workspace"]["grid"]["x"] = [200, 4000, 5]


@_blunder("3rps", "workspace-face")
def _workspace_higher_than_the_struts_are_long(file: File) -> None:
    file["workspace"]["grid"]["z"] = [700, 1080, 5]


@_blunder("pentapod", "odd-temperature")
def _308_degrees_celsius(file: File) -> None:
    file["condition"]["temperature"] = 308


@_blunder("hexapod", "odd-temperature")
def _celsius_declared_as_kelvin(file: File) -> None:
    file["units"]["temperature"] = "K"
    file["condition"]["reference_temperature"] = 293.15


@_blunder("3rrr", "odd-reference-temperature")
def _fahrenheit_for_the_reference(file: File) -> None:
    file["condition"]["reference_temperature"] = 68


@_blunder("linapod", "steep-gradient")
def _gradient_per_millimetre(file: File) -> None:
    file["condition"]["gradient"] = {"frame": ["0 K/m", "0 K/m", "2 K/mm"]}


@_blunder("planar_two_slider", "odd-expansion")
def _expansion_without_its_power_of_ten(file: File) -> None:
    for strut in file["strut"]:
        strut["expansion"] = "11 1/K"


@_blunder("planar_two_slider", "odd-modulus")
def _megapascal_for_gigapascal(file: File) -> None:
    for strut in file["strut"]:
        strut["modulus"] = "210 MPa"


@_blunder("linear_delta", "odd-section")
def _square_metres_for_square_millimetres(file: File) -> None:
    for strut in file["strut"]:
        strut["section_area"] = "28.27 m^2"


@_blunder("3rpr", "odd-stiffness")
def _newton_per_metre_for_micrometre(file: File) -> None:
    for strut in file["strut"]:
        strut["stiffness"] = "40 N/m"


@_blunder("hexapod_all_sources", "odd-mass")
def _gram_for_kilogram(file: File) -> None:
    file["platform"]["mass"] = 25000


@_blunder("hexapod_all_sources", "odd-acceleration")
def _gravity_in_millimetres(file: File) -> None:
    file["condition"]["gravity"] = "9810 m/s^2"


@_blunder("tripod", "overstrained")
def _kilonewton_for_newton(file: File) -> None:
    file["condition"]["force"] = {"x": "100 kN", "z": "-150 kN"}


@_blunder("five_bar", "wide-tolerance")
def _tolerance_in_centimetres(file: File) -> None:
    for strut in file["strut"]:
        strut["length_tolerance"] = "2 cm"


@_blunder("3rrr", "wide-tolerance")
def _radians_for_degrees_of_a_crank(file: File) -> None:
    file["tolerance"]["drive.*.offset"] = "0.04 rad"


@_blunder("orthoglide", "fine-tolerance")
def _tolerance_in_metres(file: File) -> None:
    for strut in file["strut"]:
        strut["length_tolerance"] = "2e-5 um"


@_blunder("linear_delta", "idle-tolerance")
def _rods_by_a_pattern_beside_their_own(file: File) -> None:
    file["tolerance"]["strut.*.length"] = 0.01


@_blunder("hexapod_all_sources", "wide-band")
def _millimetres_of_play_for_micrometres(file: File) -> None:
    for drive in file["drive"]:
        drive["backlash"] = {"play": "40 mm", "threshold": "40 N"}


@_blunder("hexapod_all_sources", "wide-band")
def _scale_error_in_percent_of_one(file: File) -> None:
    for drive in file["drive"]:
        drive["sensor"] = {"resolution": "1 um", "scale_error": "5 %"}


@_blunder("overconstrained", "odd-target")
def _accuracy_in_metres(file: File) -> None:
    file["accuracy"]["target"] = "0.2 m"


@_blunder("3rpr", "odd-target")
def _angle_target_in_radians(file: File) -> None:
    file["accuracy"]["angle_target"] = "0.3 rad"
