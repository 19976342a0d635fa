"""Tolerances that are not identified, considered: what they leave uncertain at the tool.

Where only some parameters are to be found, the others are not exact: their tolerances move the
readings, which the fit explains by what it may move, and they move the tool. This is the
Schmidt-Kalman consider analysis (S. F. Schmidt, Application of state-space methods to navigation
problems, Advances in Control Systems 3 (1966) 293-340; G. J. Bierman, Factorization methods for
discrete sequential estimation, 1977, chapter 8). With J, J_c the whitened derivatives of the
readings to what was found and to the rest, S, S_c those of the tool, P, P_c what is known
beforehand, C the covariance of the fit and W its weights:

    K = -C J^T W J_c
    after  = S C S^T + (S_c + S K) P_c (S_c + S K)^T        before = S P S^T + S_c P_c S_c^T
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.acceptance.observability import (
    covariance_root,
)
from truepose.calibration.acceptance.tool_uncertainty import (
    Considered,
)
from truepose.calibration.identification.equations import whitened
from truepose.calibration.identification.fit import Fit
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.tool_effects import relative_tool, tool_effects
from truepose.calibration.identification.unknowns import Unknowns, unknowns_of
from truepose.errors import RequestError
from truepose.machine import Machine


def consider_covariance(
    machine: Machine, fitted: Fit, identify: Sequence[str], poses: Floats
) -> Considered | None:
    """None where every tolerance was identified.

    `identify`: as it was asked; `poses` (n, n_commanded), at which the tool counts, all of them
    within reach of the calibrated machine.
    """
    every = _with_unidentified(machine, fitted, identify)
    if every is None:
        return None
    count = every.n_machine
    identified = np.array([every.names.index(name) for name in fitted.unknowns.names], np.intp)
    values = np.zeros(every.count)
    values[identified] = fitted.values
    unidentified = np.setdiff1d(np.arange(count), identified)
    problem = IdentificationProblem(machine, fitted.measurements, every)
    rows = np.sqrt(fitted.weights)[:, np.newaxis] * whitened(problem, values) / fitted.birge
    effects = tool_effects(machine, every, values, poses)
    tool, relative = relative_tool(machine, effects, rows, every)
    prior = np.asarray(every.prior_covariance, np.float64)[:count, :count]
    none = np.zeros((0, count))
    exact = np.zeros((count, fitted.unknowns.n_machine))
    exact[identified[: exact.shape[1]]] = covariance_root(
        fitted.covariance[: exact.shape[1], : exact.shape[1]]
    )
    root, part = _roots(fitted, every, rows, identified, unidentified)
    return Considered(
        tuple(every.labels[number] for number in unidentified),
        every.labels[:count],
        tool.beforehand(prior),
        tool.uncertainty(root, none),
        tool.uncertainty(exact, none),
        tool.uncertainty(part, none),
        relative,
    )


def _with_unidentified(machine: Machine, fitted: Fit, identify: Sequence[str]) -> Unknowns | None:
    """What was identified, and all tolerances that were not; None where there are none."""
    if not identify:
        return None
    try:
        every = unknowns_of(machine, fitted.measurements)
    except RequestError:  # no tolerance at all
        return None
    identified = set(fitted.unknowns.names)
    unidentified = [name for name in every.names[: every.n_machine] if name not in identified]
    if not unidentified:
        return None
    return unknowns_of(machine, fitted.measurements, [*identify, *unidentified])


def _roots(
    fitted: Fit, every: Unknowns, rows: Floats, identified: Indices, unidentified: Indices
) -> tuple[Floats, Floats]:
    """Roots (n_machine, k) of the covariance of all errors, and of what the rest makes of it.

    `rows` (m, n) of all unknowns, weighted; `found`: where those of the fit are among them.
    """
    own = fitted.unknowns
    n, count = own.n_machine, every.n_machine
    gain = fitted.covariance @ rows[:, identified].T
    response = -gain @ rows[:, unidentified]
    beforehand = covariance_root(every.prior_covariance[:count, :count])
    known = np.zeros((own.count, beforehand.shape[1]))
    known[:n] = beforehand[identified[:n]]
    held = Prior.of(own, tolerances=fitted.use_prior).rows
    of_instruments = Prior.of(own, tolerances=False).rows
    of_identified = (
        fitted.covariance @ (held.T @ (held @ known)) + response @ beforehand[unidentified]
    )
    # Readings err, and so does what was known of the instruments.
    errors = np.hstack([gain, fitted.covariance @ of_instruments.T])
    noise = np.asarray(np.linalg.qr(errors[:n].T, mode="r"), np.float64).T
    # The fit takes what was not identified for nominal: middles of bands off zero stay in it.
    middle = response[:n] @ every.prior_mean[unidentified]
    of_prior = np.zeros_like(beforehand)
    of_prior[identified[:n]], of_prior[unidentified] = of_identified[:n], beforehand[unidentified]
    of_data = np.zeros((count, noise.shape[1] + 1))
    of_data[identified[:n]] = np.column_stack([noise, middle])
    alone = covariance_root(every.prior_covariance[np.ix_(unidentified, unidentified)])
    part = np.zeros((count, alone.shape[1] + 1))
    part[identified[:n]] = np.column_stack([response[:n] @ alone, middle])
    part[unidentified, :-1] = alone
    return np.hstack([of_prior, of_data]), part


__all__ = ["consider_covariance"]
