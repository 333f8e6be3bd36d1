"""Yesterday's robot and today's: which parameters have changed beyond their joint uncertainty.

Two estimates from recordings that have nothing in common are independent, so the difference d of
what both identify has the covariance S = S_old + S_new. Whether anything has changed is asked of
all together, by d' S^-1 d, which is chi-square where nothing has. Only where that rejects are
parameters named, by z = d / sigma(d), with the p values corrected by Holm for their number: where
nothing has changed, any claim at all is as rare as the first test alone makes it.

What a model lacks biases both estimates; where the motions differ so do the biases, and the
difference has a part that no covariance holds. Estimates whose sigma contains lack of fit carry it.

Where one has an effect that the other has not, a change of what both have must show both as they
were estimated and without that effect: see `unlike_effects`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, ndtr

from dynident.errors import FitError
from dynident.fitting.comparing.between_robots import common_basis, holm, part_of_basis
from dynident.fitting.comparing.changed_parameters import (
    LEVEL,
    EstimateChanges,
    ParameterChange,
)
from dynident.fitting.comparing.comparable_estimates import require_comparable
from dynident.fitting.comparing.unlike_effects import (
    LoneParameter,
    lone_parameters,
    places_of,
    shared_effects,
    without,
)
from dynident.fitting.estimate import Estimate
from dynident.robot import BaseParameters

_NOTHING = 1e-10
"""Share of the largest eigenvalue of a correlation below which a direction has no variance."""


def estimate_changes(before: Estimate, after: Estimate) -> EstimateChanges:
    """Compare two estimates of one robot, made from different recordings.

    Parameters
    ----------
    before, after : of models of a robot with the same parameters; their effects may differ.

    Raises
    ------
    FitError
        If they are of other robots or friction widths, rest on a recording in common (they are
        then not independent), have no covariance, or identify nothing in common.
    """
    require_comparable(before, after)
    labels, pair = shared_effects(before.model, after.model), (before, after)
    places = [places_of(one.model, labels) for one in pair]
    basis = common_basis([part_of_basis(e.basis, k) for e, k in zip(pair, places, strict=True)])
    if not basis.rank:
        raise FitError("the two estimates identify no combination of parameters in common")
    alone = [lone_parameters(one, labels) for one in pair]
    plain = [(one.values, one.covariance) for one in pair]
    contrasts = [_Contrast.of(plain, places, basis)]
    if any(alone):
        bare = [without(e, k) for e, k in zip(pair, places, strict=True)]
        contrasts.append(_Contrast.of(bare, places, basis))
    # What is no change under either hypothesis is none: the larger p keeps the level of both.
    shown, least = contrasts[0], max(contrasts, key=lambda one: one.p_value)
    adjusted = np.max([one.adjusted for one in contrasts], axis=0)
    units = [before.model.units[i] for i in places[0]]
    words, found = before.model.stands_for(basis), []
    for i in np.flatnonzero(shown.sigma > 0):
        head = basis.independent[i]
        found.append(
            ParameterChange(
                parameter=basis.names[head],
                unit=units[head],
                stands_for=words[i],
                before=float(shown.values[0][i]),
                after=float(shown.values[1][i]),
                sigma=float(shown.sigma[i]),
                z=float(shown.z[i]),
                p_adjusted=float(adjusted[i]),
                has_changed=bool(max(least.p_value, adjusted[i]) < LEVEL),
            )
        )
    return EstimateChanges(
        parameters=tuple(sorted(found, key=lambda one: (one.p_adjusted, -abs(one.z)))),
        statistic=least.statistic,
        freedom=least.freedom,
        p_value=least.p_value,
        only_before=alone[0],
        only_after=alone[1],
        caveats=(*_of_other_effects(alone), *_caveats(before, after, labels)),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Contrast:
    """Two sets of values of k combinations, and what their difference says.

    Attributes
    ----------
    values : (2, k).
    sigma, z, adjusted : (k,) of the difference; p values by Holm, 1 where nothing is uncertain.
    statistic, freedom, p_value : of all together.
    """

    values: np.ndarray
    sigma: np.ndarray
    z: np.ndarray
    adjusted: np.ndarray
    statistic: float
    freedom: int
    p_value: float

    @classmethod
    def of(
        cls,
        pair: Sequence[tuple[np.ndarray, np.ndarray]],
        places: Sequence[np.ndarray],
        basis: BaseParameters,
    ) -> _Contrast:
        """Contrast values and covariances, each of its own parameters, at common places."""
        B = basis.combination
        values = np.array([B @ one[k] for (one, _), k in zip(pair, places, strict=True)])
        S = np.sum([B @ C[np.ix_(k, k)] @ B.T for (_, C), k in zip(pair, places, strict=True)], 0)
        sigma = np.sqrt(np.clip(np.diag(S), 0.0, None))
        known = sigma > 0
        if not known.any():
            what = "nothing that the two estimates have in common has a variance"
            raise FitError(what, None, "fit both anew, with the errors of the data")
        z, adjusted = np.zeros(len(sigma)), np.ones(len(sigma))
        z[known] = (values[1] - values[0])[known] / sigma[known]
        adjusted[known] = holm(2.0 * ndtr(-np.abs(z[known])))
        statistic, freedom = _mahalanobis(z[known], S[np.ix_(known, known)])
        return cls(
            values=values,
            sigma=sigma,
            z=z,
            adjusted=adjusted,
            statistic=statistic,
            freedom=freedom,
            p_value=float(chdtrc(freedom, statistic)),
        )


def _mahalanobis(z: np.ndarray, S: np.ndarray) -> tuple[float, int]:
    """Return d' S^-1 d and its degrees of freedom, on the directions that have a variance."""
    scale = np.sqrt(np.diag(S))
    sizes, directions = np.linalg.eigh(S / np.outer(scale, scale))
    kept = sizes > _NOTHING * sizes[-1]
    parts = directions[:, kept].T @ z
    return float(np.sum(parts**2 / sizes[kept])), int(kept.sum())


def _of_other_effects(alone: Sequence[Sequence[LoneParameter]]) -> tuple[str, ...]:
    effects = list(dict.fromkeys(one.effect for found in alone for one in found))
    if not effects:
        return ()
    return (
        f"The models differ by {', '.join(effects)}, beside which other parameters may have other "
        "values though the robot is the same. What both have is said to have changed only where it "
        "has both as estimated (the effect is new, or gone) and with the effect taken out of the "
        "fit that has it, by its covariance (it was there all along). The second is approximate "
        "where weights are measured or errors coloured, and holds if the two motions are alike; in "
        "doubt fit both with the same effects.",
        "That one model alone has an effect says what was fitted, not that the robot has it since "
        "then or has lost it: its value and interval are in the table.",
    )


def _caveats(before: Estimate, after: Estimate, labels: Sequence[str]) -> tuple[str, ...]:
    found = []
    shapes = [
        {one.label: one.shape for one in estimate.model.effects} for estimate in (before, after)
    ]
    other = sorted(label for label in labels if shapes[0][label] != shapes[1][label])
    if other:
        found.append(
            f"Shapes differ ({', '.join(other)}): the values of these effects are not quite the "
            "same quantities."
        )
    if before.headline or after.headline:
        found.append(
            "An estimate comes with a warning, its first line: what is wrong may differ between "
            "the two motions, and show as a change that is none."
        )
    if any(one.takes_rows_as_independent for one in (before, after)):
        found.append(
            "An estimate's sigma takes the errors of its equations as independent, which those of "
            "rows behind a low-pass are not: it may be too small, and changes are then found that "
            "are none. Fit with a method whose sigma counts what rows share."
        )
    return tuple(found)
