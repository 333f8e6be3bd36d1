"""Filters forward and backward: compiled or not, they are SciPy's."""

import numpy as np
import pytest
from scipy import signal

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
def test_columns_of_several_arrays_are_those_of_each_alone(wish, monkeypatch):
    """Some of their columns and rows, wherever these lie and go; what is not asked for stays."""
    monkeypatch.setenv("DYNIDENT_COMPILE", wish)
    sections = np.asarray(signal.butter(4, 0.1, output="sos"))
    random, rows = np.random.default_rng(1), np.arange(2, 150, 7)
    wide = random.standard_normal((150, 9))
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
        want[:, part.chosen] = zero_phase(part.x, sections, PADDING)[rows][:, part.chosen]
        np.testing.assert_array_equal(part.out, want)
    short = FilteredColumns(wide[:100], np.arange(9), np.empty((len(rows), 9)))
    with pytest.raises(ValueError, match="as many samples"):
        zero_phase_columns([*parts, short], sections, PADDING, rows=rows)
