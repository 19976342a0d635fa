"""What the page of a studio says, by the names that its scripts have for it."""

from __future__ import annotations

from typing import Any

from truepose.language import say

PLAIN = {
    "apart": "How far each is from each",
    "apart_caption": "Far counts a rotation at the machine's characteristic length. Travel and "
    "leaning are those of the joints at that pose; the workspace is between the ends of its poses.",
    "as_in_file": "As in the file",
    "assembly_modes": "Forward solutions: where else these joints lead",
    "at_pose": "at the pose shown",
    "at_rest": "everything is answered",
    "budget_caption": "As `truepose budget` ranks them, over the poses of the file.",
    "calibration_caption": "Drop a file of measurements of this machine: what it says of it, as "
    "`truepose calibrate` does. It is held in memory alone.",
    "characteristic": "quantity",
    "choose_file": "Choose a file",
    "component": "Component",
    "computes": "computing: {what}",
    "computing": "computing",
    "connecting": "connecting",
    "cut": "There is more; save the file to have all of it.",
    "draw_witness": "Draw it",
    "drawn_elsewhere": "That machine is drawn at its pose alone:",
    "drawn_known": "what is known",
    "drawn_there": "It is {size} off.",
    "drawn_witness": "a machine found, {state}, {quantity}",
    "edits": "{count} values changed",
    "evaluate": "Evaluate",
    "expected": "expected: {expected}",
    "farthest_at": "A machine is farthest off at",
    "feature": "feature",
    "features": "Features file",
    "fields_all": "{total} values",
    "fields_changed": "{total} values, {changed} changed",
    "fields_found": "{found} of {total} values",
    "file_shown": "File shown",
    "find_fields": "Find its numbers in the file",
    "first": "first order",
    "fit": "Residuals over their uncertainty: {before} before, {after} after the fit (rms); Birge "
    "ratio {birge}, {count} readings, {freedom} degrees of freedom.",
    "forget": "Forget it",
    "found": "found: {found}",
    "found_value": "found",
    "from_commanded": "from the pose shown",
    "from_nearest": "from the nearest other",
    "go_there": "Show this pose",
    "highest_over": "highest over the workspace",
    "in_file": "in the file: {value}",
    "in_workspace": "workspace",
    "inside": "inside",
    "joint_residual": "inverse misses the joints by",
    "largest_at": "{quantity}: largest {size}, at {time}.",
    "left_out": "Poses left out: {why}",
    "limits": "limits",
    "line": "line",
    "linear_share": "linear",
    "lost": "The studio does not answer; the page keeps trying. Start it again with the same file.",
    "measured_share": "measured",
    "modes_caption": "The nominal machine at the pose shown: no tolerance, load or temperature.",
    "modes_signs": "The first is the file's own. A sign for each drive, in their order: on which "
    "side of its strut it stands; a point for a drive that has one side only.",
    "modes_unsolved": "{count} other combinations do not reach the pose.",
    "no_answer": "no answer",
    "no_difference": "Nothing is changed.",
    "no_edits": "as in the file",
    "no_joints": "No joint coordinates reach the pose shown.",
    "no_log": "The file has no temperature log. With `temperature_log` under `[condition]`, a CSV "
    "of temperatures over time, the error over time stands here.",
    "no_modes": "There is no other working mode: every drive has one way to reach the pose.",
    "no_programs": "There is no program in that folder.",
    "no_suspicions": "None.",
    "not_complete": "{found} found from {starts} starts, of which {converged} converged. Not "
    "proven complete: what no start reaches is not found.",
    "not_connected": "The studio does not answer: nothing was changed.",
    "not_in_file": "not in the file",
    "not_live": "There are no quick numbers: {why}.",
    "one_edit": "1 value changed",
    "one_refused": "1 value refused",
    "other_condition": "{changed}; shown at other temperatures or another load",
    "or_drop": "or drop one here, at most 20 MB.",
    "outside": "outside",
    "over_workspace": "largest over the workspace",
    "parameter": "parameter",
    "parameters_left_out": "{count} smaller ones are not shown.",
    "part_caption": "A program, and a file of features if the program names none, in the folder of "
    "the machine file.",
    "part_points": "{points} points of the path, {samples} machines at random.",
    "plan": "Plan",
    "plan_poses": "Poses to measure next",
    "planned": "Poses to measure next",
    "pose_of": "pose",
    "pose_shown": "Pose shown:",
    "poses_left_out": "{count} poses; the machine cannot take {out} others.",
    "poses_used": "{count} poses.",
    "program": "Program",
    "programs_there": "Programs there: {names}.",
    "quantity": "Quantity",
    "rank": "rank",
    "reached": "starts that reach it",
    "reading": "reading",
    "report_command": "Its report by a command:",
    "residual": "struts open by",
    "residual_after": "after the fit",
    "residual_before": "before",
    "residuals": "Residuals, over their uncertainty, the farthest off first",
    "refused": "{count} values refused",
    "rests": "{answer}: {on}.",
    "rms": "rms over the workspace",
    "rms_after": "{quantity} then known to, rms",
    "rows_left_out": "{count} more are not shown.",
    "saved": "Saved as {name}.",
    "search_again": "Search",
    "shapley": "Shapley",
    "share": "share",
    "shares_caption": "Shares of the variance at the pose shown.",
    "si_joint": "m or rad",
    "solution": "number",
    "some_changed": "{count}, {changed} changed",
    "source_of": "source",
    "sources_caption": "Each source alone, as commanded; known error, and with its tolerances, to "
    "first order.",
    "spread": "{component} spreads by {size} (standard deviation) at the pose shown.",
    "stands": "joints",
    "starts": "Starts",
    "steps": "{count} steps",
    "stores_left_out": "{count} more studies are not listed.",
    "studies_caption": "Studies of `truepose study` in the folder of the machine file: many "
    "variants, of which those that are ok are ranked by their linear maximum.",
    "studies_none": "There is no study in the folder of the machine file. A command makes one:",
    "study": "Study",
    "study_dots": "Each dot is a variant, the large one the best; dashed is what the file shown "
    "asks.",
    "study_other": "It is of another machine file, or the file was changed since: the numbers are "
    "not those of the file shown.",
    "study_set": "Set it",
    "study_set_about": "Give the file these values, in place of all that is changed",
    "study_statuses": "{variants} variants: {counts}.",
    "study_causes": "Not ok",
    "study_over": "Linear maximum of {quantity} over",
    "suspicions": "Suspicions",
    "take_back": "take the change back ({before})",
    "too_large": "The file is larger than 20 MB.",
    "total": "total",
    "uncertainty": "uncertainty",
    "uncertainty_before": "uncertainty before",
    "unknown": "unknown",
    "unknowns": "What was found",
    "variant": "variant",
    "weight": "weight",
    "where": "where",
    "witness": "That machine: {causes}.",
    "working_mode": "working mode",
    "working_modes": "Working modes: which joints reach this pose",
}

ANSWERS = {
    "known": "known error",
    "machine": "the machine for this page",
    "shares": "shares",
    "verdict": "verdict",
}

TABS = {
    "budget": "Budget",
    "calibration": "Calibration",
    "modes": "Modes",
    "over_time": "Over time",
    "part": "Part",
    "shares": "Shares",
    "sources": "Sources",
    "studies": "Studies",
}

STANDINGS = {
    "joint_limit": "a strut leans beyond its joint's limit",
    "ok": "inside travel",
    "out_of_travel": "beyond a drive's travel",
}

LINES = {
    "found": "a machine found",
    "linear": "linear maximum",
    "proven": "proven: none above",
}

EXPLAINED = {
    "found": "The largest error of one machine inside its tolerances, solved exactly.",
    "linear": "Known error, and what tolerances add to it at most, to first order.",
    "proven": "No machine inside its tolerances is farther off at any of the poses: a proof.",
}

WEIGHTS = {"dominant": "dominant", "negligible": "negligible", "relevant": "relevant"}

STATES = {
    "after compensation": "after compensation",
    "before compensation": "before compensation",
}

PART_VERDICTS = {
    "NOT met": "NOT met",
    "NOT within": "NOT within",
    "met": "met",
    "undecided": "undecided",
    "within": "within",
}


STATUSES = {
    "failed": "failed",
    "infeasible": "infeasible",
    "not computed": "not computed",
    "ok": "ok",
}


def labels() -> dict[str, Any]:
    """All of it, in the language spoken."""
    return {
        **{name: say(PLAIN[name]) for name in PLAIN},
        "answers": {name: say(ANSWERS[name]) for name in ANSWERS},
        "tabs": {name: say(TABS[name]) for name in TABS},
        "standings": {name: say(STANDINGS[name]) for name in STANDINGS},
        "lines": {name: say(LINES[name]) for name in LINES},
        "line_explained": {name: say(EXPLAINED[name]) for name in EXPLAINED},
        "weights": {name: say(WEIGHTS[name]) for name in WEIGHTS},
        "states": {name: say(STATES[name]) for name in STATES},
        "study_status": {name: say(STATUSES[name]) for name in STATUSES},
        "part_verdicts": {name: say(PART_VERDICTS[name]) for name in PART_VERDICTS},
    }


__all__ = ["labels"]
