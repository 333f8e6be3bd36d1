"""Criteria of what recordings say of a model: noise, the fit of the diagnosis, residual maps."""

from __future__ import annotations

from dataclasses import dataclass

from dynident.criteria.criterion import TWO_LINK_CASES, CriteriaGroup, criterion


@dataclass(frozen=True, kw_only=True)
class NoiseCriteria(CriteriaGroup):
    """How noise is measured, and with what confidence something is said to exceed it."""

    order: int = criterion(
        8,
        "samples",
        "order of the autoregression that describes the colour of the noise",
        TWO_LINK_CASES,
        least=1,
    )
    speed_bins: int = criterion(
        10, "bins", "classes of speed in which the size of the noise is measured", least=1
    )
    samples_per_bin: int = criterion(
        30, "samples", "samples that a class of speed needs to show a size", least=2
    )
    white_share: float = criterion(
        1e-3,
        "1",
        "share of white noise assumed, so that a band without power is not amplified without limit",
        over=0,
        most=1,
    )
    least_scale: float = criterion(
        0.3, "1", "least local standard deviation of the noise over that at all speeds", over=0
    )
    largest_scale: float = criterion(
        4.0, "1", "largest local standard deviation of the noise over that at all speeds", over=0
    )
    lags: int = criterion(
        10,
        "samples",
        "lags up to which noise is correlated, where a mean's variance counts",
        least=1,
    )
    confidence: float = criterion(
        0.99,
        "1",
        "confidence with which a residual must exceed the noise and the doubt about parameters",
        over=0.5,
        most=1.0 - 1e-9,
    )
    copies: int = criterion(
        4, "copies", "noise-augmented copies of a recording whose noise is stated", least=2
    )
    copies_beside_simulation: int = criterion(
        2, "copies", "such copies where the columns come from a simulated motion", least=2
    )
    reliable: float = criterion(
        0.05,
        "1",
        "share of signal in a direction of the columns, below which it is noise and left out",
        over=0,
        most=1,
    )
    blocks: int = criterion(
        20, "blocks", "blocks of time for cross-validation, over all recordings", least=3
    )
    blocks_per_recording: int = criterion(
        3, "blocks", "blocks of time that every recording has at least", least=2
    )


@dataclass(frozen=True, kw_only=True)
class FitCriteria(CriteriaGroup):
    """How the diagnosis fits a model: how often and how exactly."""

    noise_rounds: int = criterion(
        3, "rounds", "fits with the noise measured again after each", least=1
    )
    value_rounds: int = criterion(
        30, "rounds", "fits at most, where columns depend on the model's own values", least=1
    )
    value_tolerance: float = criterion(
        1e-4, "1", "relative change of the values at which such columns have converged", over=0
    )
    samples_hz: float = criterion(
        1000.0,
        "Hz",
        "samples in a second at which columns are evaluated, where a recording has more and the "
        "filter keeps nothing of what they hold",
        over=0,
    )
    instrument_rounds: int = criterion(
        6, "rounds", "simulations of the loop for the first instruments, at most", least=1
    )
    instrument_tolerance: float = criterion(
        0.03,
        "1",
        "change at which instruments have converged: they need not be those of the best fit",
        over=0,
    )


@dataclass(frozen=True, kw_only=True)
class MapCriteria(CriteriaGroup):
    """When a picture of the residual is said to show something."""

    bins: int = criterion(24, "bins", "classes of a quantity in a residual map", least=4)
    samples_per_bin: int = criterion(10, "samples", "samples that a class needs", least=2)
    left_out: float = criterion(
        0.002, "1", "share of the samples at either end that is in no class", least=0, most=0.2
    )
    harmonics: int = criterion(
        60,
        "1",
        "largest number of cycles at which the residual is looked at, in a revolution or over the "
        "travel of a prismatic joint",
        least=4,
    )
    slowest_ripple: int = criterion(
        3, "1", "cycles per revolution from which a line is ripple, and no load or spring", least=1
    )
    slowest_on_a_slide: int = criterion(
        6,
        "1",
        "the same over the travel of a prismatic joint: shapes that are smooth leak into fewer",
        "taste",
        least=1,
    )
    level: float = criterion(1e-3, "1", "level of the tests behind a sentence", over=0, most=1)
    share: float = criterion(
        0.5, "1", "share of a map's variance that a shape must explain to be named", least=0, most=1
    )
    line: float = criterion(
        3.0, "1", "amplitude of a spectral line over the median of the others, to be named"
    )
    band: float = criterion(
        2.0, "1", "half width of the band of noise in a picture, in standard errors"
    )
