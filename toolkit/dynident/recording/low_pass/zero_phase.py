"""Filters forward and backward: without delay, a group of columns at a time.

Compiled from C where that can be had, SciPy's operations one by one; elsewhere in blocks, which is
the same up to rounding.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np

from dynident.batch import c_function, side_by_side
from dynident.errors import RecordingError
from dynident.recording.low_pass.block_filter import filtered_rows
from dynident.recording.low_pass.sections import state_at_rest

_LANES, _MOST_LANES = 4, 8
"""Columns that are filtered together; eight where the processor has vectors as wide: others are
slower than with four."""
_AT_ONCE = 2**18  # numbers that are filtered at a time without a compiler; bounds the memory
_LONG = np.dtype(ctypes.c_long)
_SIZE, _PLACE = ctypes.c_long, ctypes.c_void_p
_ARGUMENTS = (*(_SIZE,) * 3, *(_PLACE,) * 5, _SIZE, *(_PLACE,) * 3)
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
    const double *rest, const double *const *x, const long *down, lanes{lanes} *w,
    long kept, const long *rows, double *const *y, const long *below)
{{
    const long all = samples + 2 * padding;
    lanes{lanes} *first = w + padding, *last = first + samples - 1;
    const double *each[{lanes}];
    long step[{lanes}];
    for (long v = 0; v < {lanes}; v++) each[v] = x[v < some ? v : 0];
    for (long v = 0; v < {lanes}; v++) step[v] = down[v < some ? v : 0];
    for (long k = 0; k < samples; k++)
        for (long v = 0; v < {lanes}; v++) first[k][v] = each[v][k * step[v]];
    for (long k = 1; k <= padding; k++) {{
        first[-k] = 2.0 * *first - first[k];
        last[k] = 2.0 * *last - last[-k];
    }}
    filter{lanes}(all, sos, rest, w, 1);
    filter{lanes}(all, sos, rest, w + all - 1, -1);
    for (long v = 0; v < some; v++)
        for (long k = 0; k < kept; k++) y[v][k * below[v]] = first[rows[k]][v];
}}
"""
_SOURCE = """\
{narrow}
#ifdef __AVX512F__
{wide}
#endif
void {entry}(long samples, long padding, long columns, const double *sos, const double *rest,
    const double *const *x, const long *down, double *w,
    long kept, const long *rows, double *const *y, const long *below)
{{
    long c = 0;
#ifdef __AVX512F__
    for (; columns - c > {few}; c += {many})
        group{many}(samples, padding, columns - c < {many} ? columns - c : {many}, sos, rest,
            x + c, down + c, (lanes{many} *)w, kept, rows, y + c, below + c);
#endif
    for (; c < columns; c += {few})
        group{few}(samples, padding, columns - c < {few} ? columns - c : {few}, sos, rest,
            x + c, down + c, (lanes{few} *)w, kept, rows, y + c, below + c);
}}
"""


@dataclass(frozen=True, eq=False)
class FilteredColumns:
    """Columns to filter, and where they go.

    Attributes
    ----------
    x : (T, k) of any quantity.
    chosen : numbers of the columns that are filtered.
    out : (R, k) whose other columns stay as they are.
    """

    x: np.ndarray
    chosen: np.ndarray
    out: np.ndarray


def zero_phase(
    x: np.ndarray, sections: np.ndarray, padding: int, where: str | None = None
) -> np.ndarray:
    """Filter forward and backward along axis 0, as SciPy's `sosfiltfilt` with odd padding.

    Parameters
    ----------
    x : (T, ...) of any quantity.
    sections, padding, where : as for `zero_phase_columns`.

    Returns
    -------
    (T, ...) filtered twice, without delay.

    Raises
    ------
    RecordingError
        If x has no more rows than the padding.
    """
    flat = np.asarray(x, dtype=float).reshape(len(x), math.prod(x.shape[1:]))
    one = FilteredColumns(flat, np.arange(flat.shape[1]), np.empty(flat.shape))
    zero_phase_columns([one], sections, padding, where)
    return one.out.reshape(x.shape)


def zero_phase_columns(
    parts: Sequence[FilteredColumns],
    sections: np.ndarray,
    padding: int,
    where: str | None = None,
    *,
    rows: np.ndarray | None = None,
) -> None:
    """Filter columns of several arrays as `zero_phase`, and write them where they go.

    Parameters
    ----------
    parts : of as many samples.
    sections : of the filter, (s, 6) as `butterworth_sections` gives them, with complex poles.
    padding : samples of point reflection at each end.
    where : file, for messages.
    rows : (R,) the rows that are wanted, one at least; None for all.

    Raises
    ------
    RecordingError
        If there are no more rows than the padding.
    ValueError
        If the parts are not of as many samples.
    """
    samples = len(parts[0].x)
    if any(len(one.x) != samples for one in parts):  # compiled, it would read what is not theirs
        raise ValueError("columns that are filtered together have as many samples")
    if samples <= padding:
        raise RecordingError(
            f"{samples} samples are too few to filter", where, f"at least {padding + 1} are needed"
        )
    wanted = np.arange(samples) if rows is None else np.asarray(rows, dtype=int)
    function = c_function(_source(len(sections)), _ENTRY)
    if function is not None:
        _compiled(function, parts, sections, padding, wanted)
        return
    columns = [(one.x[:, c], one.out[:, c]) for one in parts for c in one.chosen.tolist()]
    count = max(1, _AT_ONCE // samples)
    for start in range(0, len(columns), count):
        some = columns[start : start + count]
        with np.errstate(over="ignore", invalid="ignore"):  # not finite where the column is not
            found = filtered_rows([x for x, _ in some], sections, padding, wanted)
        for (_, out), y in zip(some, found, strict=True):
            out[:] = y


@cache
def _source(sections: int) -> str:
    """A filter of so many sections in C."""
    few, many = (_group(lanes, sections) for lanes in (_LANES, _MOST_LANES))
    return _SOURCE.format(entry=_ENTRY, few=_LANES, many=_MOST_LANES, narrow=few, wide=many)


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
    parts: Sequence[FilteredColumns],
    sections: np.ndarray,
    padding: int,
    rows: np.ndarray,
) -> None:
    """Write wanted rows of columns to their places."""
    samples = len(parts[0].x)
    work = side_by_side((samples + 2 * padding) * _MOST_LANES, ())
    sos, rest = np.ascontiguousarray(sections), _state_at_rest(sections.tobytes(), len(sections))
    read, written = [_whole_strides(one.x) for one in parts], [one.out for one in parts]
    chosen = [one.chosen.tolist() for one in parts]
    (x, down), (y, below) = _places(read, chosen), _places(written, chosen)
    rows = np.ascontiguousarray(rows, dtype=_LONG)
    if function.argtypes is None:
        function.argtypes = _ARGUMENTS
    given, found = (
        [one.ctypes.data for one in some] for some in ((sos, rest, x, down, work), (rows, y, below))
    )
    function(samples, padding, len(x), *given, len(rows), *found)


def _whole_strides(x: np.ndarray) -> np.ndarray:
    """Columns (T, k) whose numbers are whole numbers apart: those of packed records are copied."""
    apart = x.flags.aligned and all(stride % x.itemsize == 0 for stride in x.strides)
    return x if apart else x.copy()


def _places(
    every: Sequence[np.ndarray], chosen: Sequence[Sequence[int]]
) -> tuple[np.ndarray, np.ndarray]:
    """Address of the first number of each column, and numbers from one sample to the next."""
    first, steps = [], []
    for one, columns in zip(every, chosen, strict=True):
        (down, across), start = one.strides, one.ctypes.data
        first += [start + across * column for column in columns]
        steps += [down // one.itemsize] * len(columns)
    return np.array(first, dtype=np.uintp), np.array(steps, dtype=_LONG)


@lru_cache(32)
def _state_at_rest(sections: bytes, count: int) -> np.ndarray:
    """State of each section after a long time at one, (count, 2)."""
    return state_at_rest(np.frombuffer(sections).reshape(count, 6))
