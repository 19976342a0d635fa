"""The registries of adapters and of readers: who completes a line reads them; they import none."""

from __future__ import annotations

REGISTRY: dict[str, str] = {
    "c": "truepose.controllers.c:C",
    "linuxcnc": "truepose.controllers.linuxcnc:LinuxCNC",
    "linuxcnc-genhexkins": "truepose.controllers.linuxcnc_genhexkins:LinuxCncGenhexkins",
    "linuxcnc-lineardelta": "truepose.controllers.linuxcnc_lineardelta:LinuxCncLinearDelta",
    "klipper": "truepose.controllers.klipper:Klipper",
    "marlin": "truepose.controllers.marlin:Marlin",
    "reprap": "truepose.controllers.reprap:RepRap",
    "pose-map": "truepose.controllers.pose_map:PoseMap",
}
"""Name on the command line -> module and class of the adapter."""

READERS: dict[str, str] = {
    "klipper": "truepose.controllers.klipper.read:KlipperReader",
    "marlin": "truepose.controllers.marlin.read:MarlinReader",
    "reprap": "truepose.controllers.reprap.read:RepRapReader",
    "linuxcnc-genhexkins": "truepose.controllers.linuxcnc_genhexkins.read:GenhexkinsReader",
    "linuxcnc-lineardelta": "truepose.controllers.linuxcnc_lineardelta.read:LinearDeltaKinsReader",
    "joint-centres": "truepose.controllers.joint_centres.read:JointCentresReader",
}
"""Name on the command line -> module and class of the reader of that controller's files."""

EDITORS: dict[str, str] = {
    "linuxcnc-genhexkins": "truepose.controllers._hal_lines:edits",
    "linuxcnc-lineardelta": "truepose.controllers._hal_lines:edits",
    "klipper": "truepose.controllers.klipper.against:edits",
    "marlin": "truepose.controllers.marlin.against:edits",
    "reprap": "truepose.controllers._word_lines:edits",
}
"""Name on the command line -> what says which lines of the user's own file are to change."""
