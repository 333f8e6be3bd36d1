"""With how much freedom a variance is known whose noise has a measured colour."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.fitting.uncertainty.known_spectrum import MeasuredSpectrum, widths

ROWS = 400.0


def spectrum(shape: np.ndarray, rows: float = ROWS) -> MeasuredSpectrum:
    """Of one joint, whose autocovariances are one shape times one amount."""
    column = shape[:, None]
    return MeasuredSpectrum(
        seen=column, shapes=column, amounts=np.ones(1), pairs=np.array([rows]), count=rows
    )


def test_white_noise_is_known_by_as_many_values_as_there_are_rows() -> None:
    white = np.array([1.0, 0.0, 0.0])
    (freedom,) = spectrum(white[:1]).freedom(np.ones((1, 1)))
    assert freedom == pytest.approx(ROWS)
    (freedom,) = spectrum(white).freedom(np.array([[1.0, 0.0, 0.0]]))
    assert freedom == pytest.approx(ROWS)


def test_noise_in_a_narrow_band_is_known_by_fewer() -> None:
    """The share of the rows that is the band's share of all frequencies."""
    lags, share = np.arange(200), 0.1
    band = np.sinc(share / 2 * lags) * np.cos(np.pi * 0.4 * lags)  # around a fifth of the rate
    draws = np.random.default_rng(0).normal(size=(2000, 1024))
    f = np.abs(np.fft.fftfreq(1024) - 0.2) < share / 4
    inside = np.fft.ifft(np.fft.fft(draws) * (f | f[-np.arange(1024)])).real
    squares = np.mean(inside**2, axis=1)
    counted = 2 * np.mean(squares) ** 2 / np.var(squares)
    # Only the amount is unknown, and only its square is looked at.
    one = spectrum(band, 1024.0)
    looked = MeasuredSpectrum(
        seen=np.concatenate([band[:1, None], np.zeros((199, 1))]),
        shapes=one.shapes,
        amounts=one.amounts,
        pairs=one.pairs,
        count=one.count,
    )
    (freedom,) = looked.freedom(np.eye(200)[:1])
    assert freedom == pytest.approx(counted, rel=0.15)


def test_what_depends_on_no_amount_is_known() -> None:
    one = spectrum(np.array([1.0, 0.5]))
    assert widths(one.freedom(np.zeros((1, 2)))) == pytest.approx(1.0, abs=1e-4)


def test_widths_are_those_of_students_intervals() -> None:
    np.testing.assert_allclose(widths(np.array([10.0])), 2.228139 / 1.959964, rtol=1e-6)
