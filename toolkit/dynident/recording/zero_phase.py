"""Filters forward and backward: without delay, a group of columns at a time.

Compiled from C where that can be had, and by SciPy elsewhere, operation by operation the same.
"""

from __future__ import annotations

import ctypes
import math
from functools import cache, lru_cache
from typing import Any

import numpy as np
import scipy

from dynident.batch import c_function
from dynident.errors import RecordingError

_LANES = 8  # columns that are filtered together
_ENTRY = "dynident_zero_phase"
_SOURCE = """\
typedef double lanes __attribute__((vector_size({bytes}), aligned(8)));

static void filter(long samples, const double *sos, const double *rest, lanes *w, long step)
{{
    lanes x, y, {states};
{start}
    for (long k = 0; k < samples; k++, w += step) {{
        y = *w;
{sections}
        *w = y;
    }}
}}

void {entry}(long samples, long padding, long columns, const double *sos, const double *rest,
    const double *x, long down, long across, lanes *w, double *y)
{{
    const long all = samples + 2 * padding;
    lanes *first = w + padding, *last = first + samples - 1;
    for (long c = 0; c < columns; c += {lanes}, x += {lanes} * across, y += {lanes}) {{
        const long some = columns - c < {lanes} ? columns - c : {lanes};
        for (long k = 0; k < samples; k++)
            for (long v = 0; v < {lanes}; v++)
                first[k][v] = x[k * down + (v < some ? v : 0) * across];
        for (long k = 1; k <= padding; k++) {{
            first[-k] = 2.0 * *first - first[k];
            last[k] = 2.0 * *last - last[-k];
        }}
        filter(all, sos, rest, w, 1);
        filter(all, sos, rest, w + all - 1, -1);
        for (long k = 0; k < samples; k++)
            for (long v = 0; v < some; v++) y[k * columns + v] = first[k][v];
    }}
}}
"""


def zero_phase(
    x: np.ndarray, sections: np.ndarray, padding: int, where: str | None = None
) -> np.ndarray:
    """Filter forward and backward along axis 0, as SciPy's `sosfiltfilt` with odd padding.

    Parameters
    ----------
    x : (T, ...) of any quantity.
    sections : of the filter, (s, 6) as `scipy.signal.butter` gives them.
    padding : samples of point reflection at each end.
    where : file, for messages.

    Returns
    -------
    (T, ...) filtered twice, without delay.

    Raises
    ------
    RecordingError
        If x has no more rows than the padding.
    """
    if len(x) <= padding:
        raise RecordingError(
            f"{len(x)} samples are too few to filter", where, f"at least {padding + 1} are needed"
        )
    flat = np.asarray(x, dtype=float).reshape(len(x), math.prod(x.shape[1:]))
    function = c_function(_source(len(sections)), _ENTRY)
    if function is None:
        return _by_scipy(flat, sections, padding).reshape(x.shape)
    return _compiled(function, flat, sections, padding).reshape(x.shape)


@cache
def _source(sections: int) -> str:
    """A filter of so many sections in C; their states stay in registers."""
    each = range(sections)
    return _SOURCE.format(
        bytes=8 * _LANES,
        lanes=_LANES,
        entry=_ENTRY,
        states=", ".join(f"a{s}, b{s}" for s in each),
        start="\n".join(
            f"    a{s} = rest[{2 * s}] * *w, b{s} = rest[{2 * s + 1}] * *w;" for s in each
        ),
        # Direct form II transposed, as in SciPy; each row is b0 b1 b2 1 a1 a2.
        sections="\n".join(
            f"        x = y, y = sos[{6 * s}] * x + a{s};\n"
            f"        a{s} = sos[{6 * s + 1}] * x - sos[{6 * s + 4}] * y + b{s};\n"
            f"        b{s} = sos[{6 * s + 2}] * x - sos[{6 * s + 5}] * y;"
            for s in each
        ),
    )


def _compiled(function: Any, x: np.ndarray, sections: np.ndarray, padding: int) -> np.ndarray:
    samples, columns = x.shape
    if not x.flags.aligned or any(stride % x.itemsize for stride in x.strides):
        x = x.copy()  # a field of packed records: its numbers are no whole numbers apart
    y = np.empty_like(x, order="C")
    work = np.empty((samples + 2 * padding, _LANES))
    sos, rest = np.ascontiguousarray(sections), _state_at_rest(sections.tobytes(), len(sections))
    places = [ctypes.c_void_p(one.ctypes.data) for one in (sos, rest, x, work, y)]
    sizes = [ctypes.c_long(size) for size in (samples, padding, columns)]
    strides = [ctypes.c_long(stride // x.itemsize) for stride in x.strides]
    function(*sizes, *places[:3], *strides, *places[3:])
    return y


def _by_scipy(x: np.ndarray, sections: np.ndarray, padding: int) -> np.ndarray:
    # As sosfiltfilt, to the last bit, but for one or two columns in half the time: the filter's
    # state at rest is kept, and each column lies in one piece.
    columns = x.T
    y = np.empty((len(columns), len(x) + 2 * padding))
    y[:, padding : padding + len(x)] = columns
    y[:, :padding] = 2 * columns[:, :1] - columns[:, padding:0:-1]
    y[:, padding + len(x) :] = 2 * columns[:, -1:] - columns[:, -2 : -padding - 2 : -1]
    state = _state_at_rest(sections.tobytes(), len(sections))[:, None, :]
    for _ in range(2):
        y = scipy.signal.sosfilt(sections, y, axis=1, zi=state * y[None, :, :1])[0][:, ::-1]
    return y[:, padding : padding + len(x)].T


@lru_cache(32)
def _state_at_rest(sections: bytes, count: int) -> np.ndarray:
    """State of each section after a long time at one, (count, 2)."""
    return np.ascontiguousarray(scipy.signal.sosfilt_zi(np.frombuffer(sections).reshape(count, 6)))
