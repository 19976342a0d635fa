"""A hexapod's forward kinematics in JAX: one pose's Newton, differentiated and mapped by JAX.

The residual is written once; its derivatives are JAX's own (`jacfwd`), poses are mapped (`vmap`)
and all is compiled (`jit`) in double precision. JAX is needed (`requirements-peers.txt`).
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.numpy_hexapod import Array

jax.config.update("jax_enable_x64", True)


def displacement(
    placements: Array, base: Array, platform: Array, lengths: Array, steps: int
) -> Array:
    """(n, 6) displacement of tool point and rotation vector from `placements` (n, 7).

    Geometry (n, 6, 3), (n, 6, 3) and strut lengths (n, 6), m; so many steps for every pose.
    """
    return np.asarray(_displacements(placements, base, platform, lengths, steps))


def _rotation(quaternion: jax.Array) -> jax.Array:
    w, x, y, z = quaternion
    s = 2.0 / (quaternion @ quaternion)
    return jnp.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
            [s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)],
            [s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)],
        ]
    )


def _residual(moved: jax.Array, start: jax.Array, arms: jax.Array, squares: jax.Array) -> jax.Array:
    """(6,) of a shift and half of a rotation's imaginary part over its real one."""
    turn = jnp.concatenate([jnp.ones(1), moved[3:]])
    struts = start + moved[:3] + arms @ _rotation(turn).T
    return 0.5 * (jnp.einsum("ij,ij->i", struts, struts) - squares)


def _one(
    placement: jax.Array, base: jax.Array, platform: jax.Array, lengths: jax.Array, steps: int
) -> jax.Array:
    arms = platform @ _rotation(placement[3:]).T
    given = placement[:3] - base, arms, lengths * lengths
    moved = jnp.zeros(6)
    for _ in range(steps):
        slopes = jax.jacfwd(_residual)(moved, *given)
        moved -= jnp.linalg.solve(slopes, _residual(moved, *given))
    imaginary = moved[3:]
    tangent = jnp.sqrt(imaginary @ imaginary)
    tiny = tangent < 1e-150
    factor = jnp.where(tiny, 2.0, 2.0 * jnp.arctan(tangent) / jnp.where(tiny, 1.0, tangent))
    return jnp.concatenate([moved[:3], imaginary * factor])


_displacements = jax.jit(jax.vmap(_one, in_axes=(0, 0, 0, 0, None)), static_argnums=4)
