"""Standard uncertainty: independent variables add as squares (GUM, JCGM 100:2008, 5.1.2).

    u[c]^2 = sum over variables of (effect[c] / sigmas)^2

where the effect is the first-order error of the variable at the end of its band, and `sigmas` that
band in standard deviations: sqrt(3) for a uniform distribution (GUM 4.3.7), k for a normal one.
Within a correlation group the members add with their signs before the square is taken.
"""

from __future__ import annotations

import numpy as np

from truepose.sources._base import Floats


def standard_uncertainty(effects: Floats, sigmas: Floats, scratch: Floats | None = None) -> Floats:
    """(n, n_component) from effects (n, n_component, n_variable) and sigmas (n_variable,).

    `scratch`: where what is on the way may go, such as `effects` itself.
    """
    combined: Floats = np.sqrt(np.square(effects, out=scratch) @ sigmas**-2.0)
    return combined
