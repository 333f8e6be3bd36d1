"""Whether the usual filter lets so much noise of the positions through that parameters shrink.

Least squares takes the columns as exact: what noise makes of velocities and accelerations makes
parameters smaller, whatever it comes from, encoders, or a clock that misses when samples were
taken. Of white noise little is left at half the cut-off and more at the whole, so that the values
found behind the usual filter predict the torque below half of it worse than values found there.
Without such noise they predict it as well: more rows tell more. What values leave of the rows
that they were fitted to is less than the noise by sqrt(1 - p / N), p parameters in N independent
equations, and is made up for that; N are those that a band has, two per hertz and second.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dynident.errors import DynidentError, without_warnings
from dynident.fitting.linear_solution import solve_factors
from dynident.fitting.sampling import sample
from dynident.model import Model
from dynident.moments.factors import TriangularFactors, combine, factorise
from dynident.recording import Filter, Recording, suited_filter
from dynident.tables import number

_SAMPLES = 60_000
"""Of all recordings, that are looked at."""
_SHARES = (0.5, 0.25)
_ENOUGH = 5
"""Independent equations for each parameter behind the lower cut-offs, without which the usual ones
stay: with fewer, noise of the torque may move parameters by more than that of positions did. With 5
and more the lower ones were nearer to the truth in all simulated arms that got them
(`benchmarks/draft_filters.py`)."""
_WORSE = 1.15
"""Relative error over that of values found behind the lower cut-off, from which that is taken: of
simulated and measured arms in six without such noise it is 1.00 to 1.03, in two with some 1.1, on a
Panda with a jittered clock 1.2, on a double pendulum with a bad one 1.45."""


def suitable_filter(
    model: Model, recordings: Sequence[Recording], take: Callable[[str, list[str], str], int]
) -> Filter | None:
    """Return the filter with lower cut-offs that recordings need; None for the usual one.

    Parameters
    ----------
    model : that the study starts with.
    recordings : that are to be fitted.
    take : takes a decision: (subject, choices, reason) -> which of them.
    """
    some = [_begin(one, _SAMPLES // len(recordings)) for one in recordings]
    usual = chosen = suited_filter(recordings)
    reason = ""
    try:
        found = _factors(model, some, usual)
        for share in _SHARES:
            lower = _at_share(usual, share)
            narrow = _factors(model, some, lower)
            own = solve_factors(model, narrow)
            rank, independent = len(own.basis.independent), _independent(narrow.rows, lower)
            if independent < _ENOUGH * rank:
                break
            values = solve_factors(model, found).values
            before, after = (
                narrow.relative(narrow.residual_norms(x)) for x in (values, own.values)
            )
            if before < _WORSE * after / np.sqrt(1.0 - rank / independent):
                break
            reason = (
                f"values fitted behind {_words(chosen)} leave {number(100 * before, 3)} % of the "
                f"torque below {lower.cutoff_hz:g} Hz, values fitted there "
                f"{number(100 * after, 3)} %, which is less by more than their fit to it makes: "
                "noise of positions or clock may make the former too small"
            )
            found, chosen = narrow, lower
    except DynidentError:  # too little is left behind the lower filter
        pass
    if chosen is usual or take("filter", [_words(chosen), _words(usual)], reason) == 1:
        return None
    return chosen


def _at_share(usual: Filter, share: float) -> Filter:
    """A filter with its cut-offs and rate at a share of what they are."""
    assert usual.position_cutoff_hz and usual.cutoff_hz and usual.rate_hz
    return replace(
        usual,
        position_cutoff_hz=share * usual.position_cutoff_hz,
        cutoff_hz=share * usual.cutoff_hz,
        rate_hz=share * usual.rate_hz,
    )


def _independent(rows: int, settings: Filter) -> float:
    """How many equations behind a low-pass say as much as so many rows of it."""
    assert settings.cutoff_hz and settings.rate_hz
    return rows * min(1.0, 2 * settings.cutoff_hz / settings.rate_hz)


def _words(one: Filter) -> str:
    return f"{one.position_cutoff_hz:g} and {one.cutoff_hz:g} Hz"


def _begin(one: Recording, samples: int) -> Recording:
    """The first samples of a recording; none of its repetitions count."""
    one = one.replace(period=None)
    return one if one.samples <= samples else one.part(slice(0, max(samples, 2)))


def _factors(model: Model, recordings: Sequence[Recording], settings: Filter) -> TriangularFactors:
    """Factors of all rows behind a filter."""
    with without_warnings(), np.errstate(all="ignore"):
        # Whoever fits the recordings is the one to warn of their clock.
        return combine([factorise(sample(one, settings).rows(model)) for one in recordings])
