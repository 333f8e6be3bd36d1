"""Two arrays that ought to be equal, and are not: said with figures."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

_AXES = ("sample", "joint", "column", "shape parameter")


def differs(
    what: str,
    found: ArrayLike,
    expected: ArrayLike,
    *,
    relative: float = 0.0,
    absolute: float = 0.0,
) -> Iterator[str]:
    """Yield how two arrays differ, at the entry that is furthest off; nothing where they agree.

    Parameters
    ----------
    what : is compared, for the words.
    found, expected : of one shape; what is not finite differs.
    relative, absolute : differences that are allowed, in sum.
    """
    one, other = np.asarray(found), np.asarray(expected, dtype=float)
    if one.shape != other.shape:
        yield f"{what} has the shape {one.shape} where {other.shape} is due"
        return
    with np.errstate(all="ignore"):
        gap = np.abs(one - other) - (absolute + relative * np.abs(other))
    gap = np.where(np.isnan(gap), np.inf, gap)
    if not np.any(gap > 0):
        return
    at = np.unravel_index(int(np.argmax(gap)), gap.shape)
    place = ", ".join(f"{axis} {i}" for axis, i in zip(_AXES, at, strict=False))
    yield f"{what} is {one[at]:.6g} where {other[at]:.6g} is due" + (f" ({place})" if place else "")
