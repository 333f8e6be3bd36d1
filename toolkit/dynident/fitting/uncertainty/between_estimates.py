"""Yesterday's robot and today's: which parameters have changed beyond their joint uncertainty.

Two estimates from recordings that have nothing in common are independent, so the difference d of
what both identify has the covariance S = S_old + S_new. Whether anything has changed is asked of
all together, by d' S^-1 d, which is chi-square where nothing has. Only where that rejects are
parameters named, by z = d / sigma(d), with the p values corrected by Holm for their number: where
nothing has changed, any claim at all is as rare as the first test alone makes it.

What a model lacks biases both estimates; where the motions differ so do the biases, and the
difference has a part that no covariance holds. Estimates whose sigma contains lack of fit carry it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import chdtrc, ndtr

from dynident.errors import FitError
from dynident.fitting.estimate import Estimate
from dynident.fitting.uncertainty.between_robots import common_basis, holm
from dynident.fitting.uncertainty.comparable_estimates import require_comparable
from dynident.tables import Shown, Table, json_row, number, p_value

LEVEL = 0.05
"""Probability that anything is said to have changed where nothing has."""
_NOTHING = 1e-10
"""Share of the largest eigenvalue of a correlation below which a direction has no variance."""
_INTERVAL = 1.959964


@dataclass(frozen=True, kw_only=True)
class ParameterChange:
    """A parameter, or a combination that both estimates identify, then and now.

    Attributes
    ----------
    parameter, unit : name of its head, as in the table of an estimate.
    stands_for : the combination; empty where it is the parameter alone.
    before, after : values.
    sigma : standard deviation of the difference.
    z : the difference over it.
    p_adjusted : that any of all parameters seems to have changed as much, by Holm.
    has_changed : beyond the joint uncertainty, by this and by the test of all together.
    """

    parameter: str
    unit: str
    stands_for: str
    before: float
    after: float
    sigma: float
    z: float
    p_adjusted: float
    has_changed: bool


@dataclass(frozen=True, kw_only=True)
class EstimateChanges(Shown):
    """What two estimates of one robot say of the time between them.

    Attributes
    ----------
    parameters : the surest change first.
    statistic, freedom, p_value : of the hypothesis that nothing has changed, chi-square.
    caveats : in plain words.
    """

    parameters: tuple[ParameterChange, ...]
    statistic: float
    freedom: int
    p_value: float
    caveats: tuple[str, ...] = ()

    @property
    def changed(self) -> tuple[ParameterChange, ...]:
        """Parameters that have changed beyond their joint uncertainty."""
        return tuple(one for one in self.parameters if one.has_changed)

    @property
    def sentence(self) -> str:
        """The answer in plain words."""
        count = len(self.changed)
        if count:
            has = "have" if count > 1 else "has"
            of = f"{count} of {len(self.parameters)} parameters"
            return f"{of} {has} changed beyond the joint uncertainty."
        if self.p_value < LEVEL:
            return (
                "Something has changed beyond the joint uncertainty, and no parameter alone tells "
                "what."
            )
        return (
            f"None of {len(self.parameters)} parameters has changed beyond the joint uncertainty."
        )

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `changes --json`."""
        return {
            "changed": [one.parameter for one in self.changed],
            "chi_square": {
                "statistic": self.statistic,
                "freedom": self.freedom,
                "p_value": self.p_value,
            },
            "parameters": [json_row(one) for one in self.parameters],
            "caveats": list(self.caveats),
        }

    def table(self) -> Table:
        """Every parameter, the surest change first."""
        rows = tuple(
            (
                one.parameter,
                number(one.before, 4),
                number(one.after, 4),
                f"{number(one.after - one.before, 3)} \u00b1 {number(_INTERVAL * one.sigma, 2)}",
                one.unit,
                number(one.z, 3),
                p_value(one.p_adjusted),
                "changed" if one.has_changed else "",
                one.stands_for,
            )
            for one in self.parameters
        )
        head = (
            "parameter",
            "before",
            "after",
            "change, 95 %",
            "unit",
            "z",
            "p",
            "finding",
            "stands for",
        )
        overall = (
            f"All together: chi-square {number(self.statistic, 4)} with {self.freedom} degrees of "
            f"freedom, p {p_value(self.p_value)}."
        )
        each = (
            "p: corrected (Holm) for all parameters. One is said to have changed where both p, its "
            f"own and that of all together, are below {LEVEL:g}."
        )
        return Table("Parameters then and now", head, rows, (overall, each))

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        return (self.sentence, self.table(), *self.caveats)


def estimate_changes(before: Estimate, after: Estimate) -> EstimateChanges:
    """Compare two estimates of one robot, made from different recordings.

    Parameters
    ----------
    before, after : of one model: the same effects of a robot with the same parameters.

    Raises
    ------
    FitError
        If they are of other robots, effects or friction widths, rest on a recording in common
        (they are then not independent), have no covariance, or identify nothing in common.
    """
    require_comparable(before, after)
    basis = common_basis([before.basis, after.basis])
    if not basis.rank:
        raise FitError("the two estimates identify no combination of parameters in common")
    B, heads = basis.combination, list(basis.independent)
    values = [B @ one.values for one in (before, after)]
    S = np.sum([B @ one.covariance @ B.T for one in (before, after)], axis=0)
    sigma = np.sqrt(np.clip(np.diag(S), 0.0, None))
    known = sigma > 0
    difference = (values[1] - values[0])[known]
    z = difference / sigma[known]
    adjusted = holm(2.0 * ndtr(-np.abs(z)))
    statistic, freedom = _mahalanobis(z, S[np.ix_(known, known)])
    p_of_all = float(chdtrc(freedom, statistic))
    places = np.flatnonzero(known)
    found = [
        ParameterChange(
            parameter=before.names[heads[k]],
            unit=before.model.units[heads[k]],
            stands_for=""
            if basis.expressions[k] == before.names[heads[k]]
            else basis.expressions[k],
            before=float(values[0][k]),
            after=float(values[1][k]),
            sigma=float(sigma[k]),
            z=float(z[i]),
            p_adjusted=float(adjusted[i]),
            has_changed=bool(max(p_of_all, adjusted[i]) < LEVEL),
        )
        for i, k in enumerate(places)
    ]
    return EstimateChanges(
        parameters=tuple(sorted(found, key=lambda one: (one.p_adjusted, -abs(one.z)))),
        statistic=statistic,
        freedom=freedom,
        p_value=p_of_all,
        caveats=_caveats(before, after),
    )


def _mahalanobis(z: np.ndarray, S: np.ndarray) -> tuple[float, int]:
    """Return d' S^-1 d and its degrees of freedom, on the directions that have a variance."""
    scale = np.sqrt(np.diag(S))
    sizes, directions = np.linalg.eigh(S / np.outer(scale, scale))
    kept = sizes > _NOTHING * sizes[-1]
    parts = directions[:, kept].T @ z
    return float(np.sum(parts**2 / sizes[kept])), int(kept.sum())


def _caveats(before: Estimate, after: Estimate) -> tuple[str, ...]:
    found = []
    shapes = [
        {one.label: one.shape for one in estimate.model.effects} for estimate in (before, after)
    ]
    other = sorted(label for label, shape in shapes[0].items() if shape != shapes[1][label])
    if other:
        found.append(
            f"Shapes differ ({', '.join(other)}): the values of these effects are not quite the "
            "same quantities."
        )
    if before.headline or after.headline:
        found.append(
            "A model is rejected: what it lacks may differ between the two motions, and show as a "
            "change that is none."
        )
    if any(one.takes_rows_as_independent for one in (before, after)):
        found.append(
            "An estimate's sigma takes the errors of its equations as independent, which those of "
            "rows behind a low-pass are not: it may be too small, and changes are then found that "
            "are none. Fit with a method whose sigma counts what rows share."
        )
    return tuple(found)
