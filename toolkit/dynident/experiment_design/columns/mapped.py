"""CasADi functions of an instant, evaluated at all instants of a motion without copies."""

from __future__ import annotations

from typing import Any

import numpy as np


def mapped(function: Any, *arguments: np.ndarray) -> list[np.ndarray]:
    """Evaluate a CasADi function at many instants, from arrays to arrays.

    CasADi reads and writes the arrays themselves: to convert its matrices takes as long as to
    evaluate the columns of a small robot.

    Parameters
    ----------
    function : casadi.Function whose arguments and results are dense.
    arguments : (T, c, r) for an argument of r rows and c columns, at T instants, one or more.

    Returns
    -------
    (T, c, r) of each result of r rows and c columns.

    Raises
    ------
    ValueError
        If the function takes another number of arguments, or of another size, or is sparse.
    """
    instants = len(arguments[0])
    inside = [np.ascontiguousarray(one, dtype=float) for one in arguments]
    # As CasADi has matrices: column by column, and those of instants side by side.
    taken = [(instants, *reversed(function.size_in(k))) for k in range(function.n_in())]
    if [one.shape for one in inside] != taken:
        raise ValueError(f"{function.name()} takes {taken}, not {[one.shape for one in inside]}")
    results = range(function.n_out())
    sparsities = [function.sparsity_in(k) for k in range(function.n_in())]
    sparsities += [function.sparsity_out(k) for k in results]
    if not all(one.is_dense() for one in sparsities):
        raise ValueError(f"{function.name()} has a sparse argument or result")
    outside = [np.empty((instants, *reversed(function.size_out(k)))) for k in results]
    buffer, call = function.map(instants).buffer()
    for k, one in enumerate(inside):
        buffer.set_arg(k, memoryview(one))  # type: ignore[arg-type]
    for k, one in enumerate(outside):
        buffer.set_res(k, memoryview(one))  # type: ignore[arg-type]
    call()
    return outside
