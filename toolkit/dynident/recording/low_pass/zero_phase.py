"""Filters forward and backward: without delay, a group of columns at a time.

Compiled from C where that can be had, and by SciPy elsewhere, operation by operation the same.
"""

from __future__ import annotations

import ctypes
import math
from functools import cache, lru_cache
from typing import Any

import numpy as np

from dynident.batch import c_function, side_by_side
from dynident.errors import RecordingError
from dynident.recording.low_pass.sections import state_at_rest

_MOST_LANES = 8  # columns that are filtered together: wider vectors than the processor's are slow
_AT_ONCE = 64  # columns that SciPy filters at a time; bounds the temporary memory
_LONG = np.dtype(ctypes.c_long)
_SIZE, _PLACE = ctypes.c_long, ctypes.c_void_p
_READ = (_SIZE, _SIZE, _SIZE, _PLACE, _PLACE, _PLACE, _SIZE, _PLACE)
_ARGUMENTS = (*_READ, _PLACE, _SIZE, _PLACE, _PLACE, _SIZE, _PLACE)
_ENTRY = "dynident_zero_phase"
_GROUP = """\
typedef double lanes{lanes} __attribute__((vector_size({bytes}), aligned(8)));

static void filter{lanes}(long samples, const double *sos, const double *rest, lanes{lanes} *w,
    long step)
{{
    lanes{lanes} x, y, {states};
{start}
    for (long k = 0; k < samples; k++, w += step) {{
        y = *w;
{sections}
        *w = y;
    }}
}}

static void group{lanes}(long samples, long padding, long some, const double *sos,
    const double *rest, const double *x, long down, const long *from, lanes{lanes} *w,
    long kept, const long *rows, double *y, long below, const long *to)
{{
    const long all = samples + 2 * padding;
    lanes{lanes} *first = w + padding, *last = first + samples - 1;
    const double *each[{lanes}];
    for (long v = 0; v < {lanes}; v++) each[v] = x + from[v < some ? v : 0];
    for (long k = 0; k < samples; k++)
        for (long v = 0; v < {lanes}; v++) first[k][v] = each[v][k * down];
    for (long k = 1; k <= padding; k++) {{
        first[-k] = 2.0 * *first - first[k];
        last[k] = 2.0 * *last - last[-k];
    }}
    filter{lanes}(all, sos, rest, w, 1);
    filter{lanes}(all, sos, rest, w + all - 1, -1);
    for (long v = 0; v < some; v++)
        for (long k = 0; k < kept; k++) y[to[v] + k * below] = first[rows[k]][v];
}}
"""
_SOURCE = """\
{narrow}
#ifdef __AVX512F__
{wide}
#endif
void {entry}(long samples, long padding, long columns, const double *sos, const double *rest,
    const double *x, long down, const long *from, double *w,
    long kept, const long *rows, double *y, long below, const long *to)
{{
    long c = 0;
#ifdef __AVX512F__
    for (; columns - c > 4; c += 8)
        group8(samples, padding, columns - c < 8 ? columns - c : 8, sos, rest, x, down, from + c,
            (lanes8 *)w, kept, rows, y, below, to + c);
#endif
    for (; c < columns; c += 4)
        group4(samples, padding, columns - c < 4 ? columns - c : 4, sos, rest, x, down, from + c,
            (lanes4 *)w, kept, rows, y, below, to + c);
}}
"""


def zero_phase(
    x: np.ndarray,
    sections: np.ndarray,
    padding: int,
    where: str | None = None,
    *,
    rows: np.ndarray | None = None,
    columns: np.ndarray | None = None,
    out: np.ndarray | None = None,
) -> np.ndarray:
    """Filter forward and backward along axis 0, as SciPy's `sosfiltfilt` with odd padding.

    Parameters
    ----------
    x : (T, ...) of any quantity.
    sections : of the filter, (s, 6) as `butterworth_sections` gives them.
    padding : samples of point reflection at each end.
    where : file, for messages.
    rows : (R,) the rows that are wanted; None for all.
    columns : which of the columns of a two-dimensional x are filtered; None for all.
    out : (R, columns of x) whose other columns stay as they are; if there is none, it is made.

    Returns
    -------
    (R, ...) filtered twice, without delay.

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
    some = np.arange(flat.shape[1]) if columns is None else columns
    kept = len(x) if rows is None else len(rows)
    result = np.empty((kept, flat.shape[1])) if out is None else out
    function = c_function(_source(len(sections)), _ENTRY)
    if function is None:
        for part in np.array_split(some, max(1, len(some) // _AT_ONCE)):
            y = _by_scipy(flat[:, part], sections, padding)
            result[:, part] = y if rows is None else y[rows]
    else:
        rows = np.arange(kept) if rows is None else rows
        _compiled(function, flat, sections, padding, (rows, some, result))
    return result.reshape(kept, *x.shape[1:]) if out is None else result


@cache
def _source(sections: int) -> str:
    """A filter of so many sections in C."""
    return _SOURCE.format(
        entry=_ENTRY, narrow=_group(4, sections), wide=_group(_MOST_LANES, sections)
    )


def _group(lanes: int, sections: int) -> str:
    """The filter of so many columns together; the states of all sections stay in registers."""
    each = range(sections)
    return _GROUP.format(
        bytes=8 * lanes,
        lanes=lanes,
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


def _compiled(
    function: Any,
    x: np.ndarray,
    sections: np.ndarray,
    padding: int,
    wanted: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Write wanted rows of the wanted columns to their places in an array."""
    rows, columns, y = wanted
    if not x.flags.aligned or any(stride % x.itemsize for stride in x.strides):
        x = x.copy()  # a field of packed records: its numbers are no whole numbers apart
    samples = len(x)
    work = side_by_side((samples + 2 * padding) * _MOST_LANES, ())
    sos, rest = np.ascontiguousarray(sections), _state_at_rest(sections.tobytes(), len(sections))
    (down, across), (below, beside) = ((s // 8 for s in one.strides) for one in (x, y))
    rows = np.ascontiguousarray(rows, dtype=_LONG)
    places, to = (np.asarray(columns * step, dtype=_LONG) for step in (across, beside))
    read = (one.ctypes.data for one in (sos, rest, x))
    if function.argtypes is None:
        function.argtypes = _ARGUMENTS
    function(
        *(samples, padding, len(columns), *read, down, places.ctypes.data, work.ctypes.data),
        *(len(rows), rows.ctypes.data, y.ctypes.data, below, to.ctypes.data),
    )


def _by_scipy(x: np.ndarray, sections: np.ndarray, padding: int) -> np.ndarray:
    from scipy.signal import sosfilt  # takes long to load

    # As sosfiltfilt, to the last bit, but for one or two columns in half the time: the filter's
    # state at rest is kept, and each column lies in one piece.
    columns = x.T
    sections = sections.copy()  # SciPy takes none that is read-only
    y = np.empty((len(columns), len(x) + 2 * padding))
    y[:, padding : padding + len(x)] = columns
    y[:, :padding] = 2 * columns[:, :1] - columns[:, padding:0:-1]
    y[:, padding + len(x) :] = 2 * columns[:, -1:] - columns[:, -2 : -padding - 2 : -1]
    state = _state_at_rest(sections.tobytes(), len(sections))[:, None, :]
    for _ in range(2):
        y = sosfilt(sections, y, axis=1, zi=state * y[None, :, :1])[0][:, ::-1]
    return y[:, padding : padding + len(x)].T


@lru_cache(32)
def _state_at_rest(sections: bytes, count: int) -> np.ndarray:
    """State of each section after a long time at one, (count, 2)."""
    return state_at_rest(np.frombuffer(sections).reshape(count, 6))
