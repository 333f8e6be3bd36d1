"""Second-order sections: those of SciPy, which is too slow to load."""

import numpy as np
import pytest
from scipy import signal

from dynident.errors import RecordingError
from dynident.recording import lowpass
from dynident.recording.low_pass.sections import (
    butterworth_sections,
    normal_form,
    response,
    slowest_pole,
    state_at_rest,
)

CHEBYSHEV = np.asarray(signal.cheby1(8, 0.05, 0.2, output="sos"))
SPREAD = CHEBYSHEV.copy()
"""The same filter with its gain in all sections, where it is in the first."""
SPREAD[:, :3] *= [[0.125], [2.0], [2.0], [2.0]]


@pytest.mark.parametrize("order", [2, 4, 8])
@pytest.mark.parametrize("share", [1e-5, 0.04, 0.5, 0.97])
def test_a_butterworth_low_pass_is_that_of_scipy(order: int, share: float) -> None:
    want = np.asarray(signal.butter(order, share, output="sos"))
    found = butterworth_sections(share, order)
    np.testing.assert_allclose(found, want, rtol=1e-13)
    # At its cut-off it lets half of the power through.
    assert abs(response(found, np.array([np.pi * share]))[0]) ** 2 == pytest.approx(0.5, rel=1e-8)


@pytest.mark.parametrize("sections", [butterworth_sections(0.1, 4), CHEBYSHEV])
def test_what_is_asked_of_a_filter_is_what_scipy_says(sections: np.ndarray) -> None:
    angle = np.linspace(0.0, np.pi, 50)
    want = signal.sosfreqz(sections, angle)[1]
    np.testing.assert_allclose(response(sections, angle), want, atol=1e-13)
    np.testing.assert_allclose(state_at_rest(sections), signal.sosfilt_zi(sections), rtol=1e-12)
    _, poles, _ = signal.sos2zpk(sections)
    assert slowest_pole(sections) == pytest.approx(np.abs(np.asarray(poles)).max(), rel=1e-13)


def test_a_filter_that_was_at_rest_stays_there() -> None:
    sections = butterworth_sections(0.02, 4)
    out, _ = signal.sosfilt(sections, np.ones(50), zi=state_at_rest(sections))
    np.testing.assert_allclose(out, 1.0, atol=1e-10)


@pytest.mark.parametrize(
    "sections",
    [*(butterworth_sections(share, 4) for share in (1e-3, 0.1, 0.5, 0.97)), CHEBYSHEV, SPREAD],
)
def test_the_normal_form_is_the_same_filter(sections: np.ndarray) -> None:
    form = normal_form(sections)
    angle = np.linspace(0.01, np.pi - 0.01, 50)
    turn = np.exp(1j * angle)[:, None, None] * np.eye(len(form.into)) - form.across
    into = np.broadcast_to(form.into[:, None], (len(angle), len(form.into), 1))
    found = form.through + (form.out @ np.linalg.solve(turn, into))[:, 0]
    np.testing.assert_allclose(found, signal.sosfreqz(sections, angle)[1], rtol=0, atol=1e-12)
    # At rest at one it stays, and gives what the sections do of a constant.
    np.testing.assert_allclose(form.across @ form.rest + form.into, form.rest, atol=1e-14)
    constant = np.prod(sections[:, :3].sum(axis=1) / sections[:, 3:].sum(axis=1))
    assert form.out @ form.rest + form.through == pytest.approx(constant, rel=1e-9)


def test_a_section_of_real_poles_has_no_normal_form() -> None:
    with pytest.raises(ValueError, match="real poles"):
        normal_form(np.array([[1.0, 2.0, 1.0, 1.0, -0.75, 0.125]]))


def test_an_odd_order_is_refused() -> None:
    with pytest.raises(RecordingError, match="even order"):
        lowpass(np.zeros(100), 100.0, 10.0, order=3)
