"""Memory for blocks of columns, used again as soon as nobody holds it.

An array of tens of megabytes comes from the operating system page by page, every time: for a block
of a regressor that takes longer than to compute it.
"""

from __future__ import annotations

import math
import weakref

import numpy as np

_LEAST = 2**20  # bytes: the memory of smaller arrays is used again anyway
_LINE = 8  # numbers in a line of the cache
_KEPT = 2**28  # bytes at most that are kept while nobody uses them

# By their identity. Each access is one operation, for an array may go at any time in any thread.
_free: dict[int, np.ndarray] = {}


def side_by_side(samples: int, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array (samples, *shape) of any content, the samples of one entry side by side.

    Each entry's begin a line of the cache.

    Parameters
    ----------
    samples, shape : of the array.
    """
    lines = -(-samples // _LINE) | 1  # odd: rows a power of two apart would push each other out
    count = lines * _LINE * math.prod(shape) + _LINE
    if 8 * count < _LEAST:
        flat = np.empty(count)
    else:
        memory = _taken(8 * count)
        # Every view holds `flat`, for below it is a buffer, no array: when it goes, all have gone.
        flat = np.frombuffer(memory.data, dtype=float, count=count)
        weakref.finalize(flat, _give_back, memory).atexit = False
    start = -(flat.ctypes.data // 8) % _LINE
    rows = flat[start : start + count - _LINE].reshape(*shape, lines * _LINE)
    return rows[..., :samples].transpose(len(shape), *range(len(shape)))


def _taken(size: int) -> np.ndarray:
    """Memory of about the size that is free, or new."""
    for key in list(_free):
        memory = _free.pop(key, None)
        if memory is not None and size <= len(memory) <= 2 * size:
            return memory
        if memory is not None:
            _free[key] = memory
    # Blocks have another length now: what is left of the old ones would only be held besides.
    _free.clear()
    # A little more than is asked for, so that the next block, a little longer, fits too; what is
    # not written to takes no memory. NumPy asks for huge pages, where there are any.
    return np.empty(size + size // 4, dtype=np.uint8)


def _give_back(memory: np.ndarray) -> None:
    _free[id(memory)] = memory
    for key in list(_free):
        if sum(map(len, list(_free.values()))) > _KEPT:
            _free.pop(key, None)
