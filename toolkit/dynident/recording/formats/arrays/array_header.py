"""What an array that NumPy saved says of itself before its numbers begin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import IO

import numpy as np

NUMBERS = "fiub"
"""Kinds of data types that are numbers."""


@dataclass(frozen=True)
class ArrayHeader:
    """Shape of an array in a file, whether its columns lie one after the other, and its type."""

    shape: tuple[int, ...]
    by_columns: bool
    dtype: np.dtype


def read_array_header(stream: IO[bytes]) -> ArrayHeader | None:
    """Read up to the first number of an array; None of a version that holds other than numbers.

    Raises
    ------
    ValueError
        If no array begins here, or one of no possible shape.
    """
    version = np.lib.format.read_magic(stream)
    read = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if read is None:
        return None
    header = ArrayHeader(*read(stream))
    if any(count < 0 for count in header.shape):
        raise ValueError(f"an array has no shape {header.shape}")
    return header
