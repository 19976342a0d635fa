"""strut-length: present lengths of struts, from joint centre to joint centre."""

from __future__ import annotations

from truepose.calibration.instruments._base import Kind

KIND = Kind(
    "strut-length",
    "Present lengths of struts between their joint centres: scales on the struts, interferometers.",
    "by lengths of struts alone",
    {"length": "length"},
    has_target=False,
)
