"""CasADi functions of an instant, evaluated at all instants of a motion without copies."""

from __future__ import annotations

from typing import Any

import numpy as np


class MappedFunction:
    """A CasADi function at many instants, from arrays to arrays.

    To convert CasADi's matrices to arrays takes as long as to evaluate a small robot's columns:
    here the function reads and writes arrays that are made once.

    Parameters
    ----------
    function : casadi.Function whose arguments and results are dense.
    instants : at which it is evaluated.
    """

    def __init__(self, function: Any, instants: int) -> None:
        mapped = function.map(instants)
        arguments, results = range(function.n_in()), range(function.n_out())
        self._inside = [_array(instants, function.size_in(k)) for k in arguments]
        self._outside = [_array(instants, function.size_out(k)) for k in results]
        # The buffer must live as long as what it calls.
        self._buffer, self._call = mapped.buffer()
        for k, one in enumerate(self._inside):
            self._buffer.set_arg(k, memoryview(one))  # type: ignore[arg-type]
        for k, one in enumerate(self._outside):
            self._buffer.set_res(k, memoryview(one))  # type: ignore[arg-type]

    def __call__(self, *arguments: np.ndarray) -> list[np.ndarray]:
        """Return the results at all instants: views that the next call writes to.

        Parameters
        ----------
        arguments : (instants, c, r) for an argument of r rows and c columns.

        Returns
        -------
        Of each result likewise.
        """
        for own, given in zip(self._inside, arguments, strict=True):
            own[...] = given
        self._call()
        return self._outside


def _array(instants: int, size: tuple[int, int]) -> np.ndarray:
    """As CasADi has matrices: column by column, and those of instants side by side."""
    rows, columns = size
    return np.zeros((instants, columns, rows))
