"""Filters forward and backward: compiled or not, they are SciPy's."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy import signal

from dynident.recording.low_pass import zero_phase as module
from dynident.recording.low_pass.zero_phase import (
    FilteredColumns,
    zero_phase,
    zero_phase_columns,
)

PADDING = 12


@pytest.mark.parametrize("wish", ["never", "auto"])
@pytest.mark.parametrize("columns", [0, 1, 3, 8, 17])
@pytest.mark.parametrize(
    "sections",
    [signal.butter(4, 0.1, output="sos"), signal.cheby1(8, 0.05, 0.2, output="sos")],
    ids=["butterworth", "chebyshev"],
)
def test_is_that_of_scipy(wish, columns, sections, monkeypatch):
    """For numbers of columns beside those that are filtered together, in any order of memory."""
    monkeypatch.setenv("DYNIDENT_COMPILE", wish)
    x = np.random.default_rng(0).standard_normal((150, columns)).cumsum(axis=0)
    want = signal.sosfiltfilt(sections, x, axis=0, padtype="odd", padlen=PADDING) if columns else x
    sections = sections.copy()
    sections.setflags(write=False)  # as those that are kept for the next recording
    backward = np.ascontiguousarray(x[::-1, ::-1])[::-1, ::-1]
    for given in (x, np.asfortranarray(x), backward, np.repeat(x, 2, axis=0)[::2]):
        np.testing.assert_allclose(zero_phase(given, sections, PADDING), want, rtol=0, atol=1e-11)
    several = zero_phase(np.stack([x, -x], axis=1), sections, PADDING)
    np.testing.assert_allclose(several, np.stack([want, -want], axis=1), rtol=0, atol=1e-11)


@pytest.mark.parametrize("wish", ["never", "auto"])
def test_a_field_of_packed_records_is_read_as_its_numbers(wish, monkeypatch):
    """Its numbers are no whole number of numbers apart, or begin between two of them."""
    monkeypatch.setenv("DYNIDENT_COMPILE", wish)
    sections = np.asarray(signal.butter(4, 0.1, output="sos"))
    x = np.random.default_rng(0).standard_normal((150, 2)).cumsum(axis=0)
    want = zero_phase(x, sections, PADDING)
    apart = np.zeros(150, dtype=[("x", "f8", 2), ("k", "i4")])
    between = np.zeros(150, dtype=[("k", "i4"), ("x", "f8", 2), ("l", "i4")])
    for records in (apart, between):
        records["x"] = x
        np.testing.assert_array_equal(zero_phase(records["x"], sections, PADDING), want)


@pytest.mark.parametrize("wish", ["never", "auto"])
@pytest.mark.parametrize(("samples", "step"), [(150, 7), (13, 1), (2000, 1), (2000, 20)])
def test_columns_of_several_arrays_are_those_of_each_alone(wish, samples, step, monkeypatch):
    """Some of their columns and rows, wherever these lie and go; what is not asked for stays.

    Of one block and of several, and of more columns than are filtered at a time.
    """
    monkeypatch.setenv("DYNIDENT_COMPILE", wish)
    monkeypatch.setattr(module, "_AT_ONCE", 4 * samples)
    sections = np.asarray(signal.butter(4, 0.1, output="sos"))
    random, rows = np.random.default_rng(1), np.arange(2, samples, step)
    wide = random.standard_normal((samples, 9))
    parts = [
        FilteredColumns(x, np.array(chosen, dtype=int), np.full((len(rows), x.shape[1]), np.nan))
        for x, chosen in (
            (wide, [0, 4, 8]),
            (np.asfortranarray(wide[:, :2]), [1]),
            (wide[::-1], [*range(9)]),
            (wide[:, 3:3], []),
        )
    ]
    zero_phase_columns(parts, sections, PADDING, rows=rows)
    for part in parts:
        want = np.full_like(part.out, np.nan)
        for column in part.chosen:
            alone = FilteredColumns(part.x[:, [column]], np.array([0]), want[:, [column]])
            zero_phase_columns([alone], sections, PADDING, rows=rows)
            want[:, [column]] = alone.out
        np.testing.assert_array_equal(part.out, want)
        want[:, part.chosen] = zero_phase(part.x, sections, PADDING)[rows][:, part.chosen]
        rounding = 1e-14 if wish == "never" else 0.0
        np.testing.assert_allclose(part.out, want, rtol=0, atol=rounding)
    short = FilteredColumns(wide[:-1], np.arange(9), np.empty((len(rows), 9)))
    with pytest.raises(ValueError, match="as many samples"):
        zero_phase_columns([*parts, short], sections, PADDING, rows=rows)


@pytest.mark.parametrize("wish", ["never", "auto"])
@pytest.mark.parametrize("first", [0, 1, 12])
@pytest.mark.parametrize("steps", [1, 2, 20, 95, 97, 300, (3, 4), (20, 50)])
def test_wanted_rows_are_those_of_scipy(wish, first, steps, monkeypatch):
    """However far apart they are, evenly or not, and wherever the record ends."""
    monkeypatch.setenv("DYNIDENT_COMPILE", wish)
    sections = np.asarray(signal.butter(4, 0.05, output="sos"))
    random = np.random.default_rng(2)
    for samples in (13, 14, 59, 95, 96, 97, 191, 192, 193, 800, *random.integers(13, 4000, 6)):
        x = random.standard_normal((samples, 2)).cumsum(axis=0)
        rows = first + np.cumsum(np.append(0, np.resize(steps, samples)))
        rows = np.append(rows[rows < samples - 1], samples - 1)  # the last is wanted, too
        part = FilteredColumns(x, np.arange(2), np.empty((len(rows), 2)))
        zero_phase_columns([part], sections, PADDING, rows=rows)
        want = signal.sosfiltfilt(sections, x, axis=0, padtype="odd", padlen=PADDING)[rows]
        np.testing.assert_allclose(part.out, want, rtol=0, atol=1e-10)


@pytest.mark.parametrize(("wish", "exact"), [("never", 1e-13), ("auto", 1e-11)])
@pytest.mark.parametrize("share", [1e-3, 0.1, 0.97])
def test_low_cutoffs_keep_digits(wish, exact, share, monkeypatch):
    """Against the same recursion with 40 digits; in double precision it loses four at 1e-3."""
    monkeypatch.setenv("DYNIDENT_COMPILE", wish)
    sections = np.asarray(signal.butter(4, share, output="sos"))
    x = np.random.default_rng(3).standard_normal(2000).cumsum()
    with localcontext(prec=40):
        want = _with_many_digits(x, sections)
    found = zero_phase(x, sections, PADDING)
    np.testing.assert_allclose(found, want, rtol=0, atol=exact * np.abs(want).max())


def _with_many_digits(x: np.ndarray, sections: np.ndarray) -> np.ndarray:
    """The filter sample by sample, at rest before the first one that each pass meets."""
    first, last = x[:1], x[-1:]
    y = [
        *map(Decimal, 2 * first - x[PADDING:0:-1]),
        *map(Decimal, x),
        *map(Decimal, 2 * last - x[-2 : -PADDING - 2 : -1]),
    ]
    for _ in range(2):
        for b0, b1, b2, _, a1, a2 in (map(Decimal, row) for row in sections):
            # All before are the first one, and the section has come to what it makes of them.
            x1 = x2 = y[0]
            y1 = y2 = y[0] * (b0 + b1 + b2) / (1 + a1 + a2)
            for k, now in enumerate(y):
                y1, y2 = b0 * now + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2, y1
                x1, x2 = now, x1
                y[k] = y1
        y = y[::-1]
    return np.array(y[PADDING:-PADDING], dtype=float)


@pytest.mark.parametrize("wish", ["never", "auto"])
def test_what_is_not_finite_stays_in_its_column(wish, monkeypatch):
    monkeypatch.setenv("DYNIDENT_COMPILE", wish)
    sections = np.asarray(signal.butter(4, 0.1, output="sos"))
    x = np.random.default_rng(4).standard_normal((300, 3))
    want = zero_phase(x, sections, PADDING)
    x[100, 0], x[200, 2] = np.inf, np.nan
    found = zero_phase(x, sections, PADDING)
    assert not np.isfinite(found[:, [0, 2]]).any()
    np.testing.assert_array_equal(found[:, 1], want[:, 1])
