"""Yesterday's robot and today's: which parameters have changed beyond their joint uncertainty.

Two estimates from recordings that have nothing in common are independent, so the difference d of
what both identify has the covariance S = S_old + S_new. Whether anything has changed is asked once,
by d' S^-1 d, which is chi-square where nothing has; which parameter, by z = d / sigma(d), with the
p values corrected by Holm for their number.

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
from dynident.tables import Shown, Table, json_row, number, p_value

LEVEL = 0.05
"""Probability that any parameter is said to have changed where none has."""
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
    """

    parameter: str
    unit: str
    stands_for: str
    before: float
    after: float
    sigma: float
    z: float
    p_adjusted: float

    @property
    def has_changed(self) -> bool:
        """Whether it has changed beyond the joint uncertainty."""
        return self.p_adjusted < LEVEL


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
            "parameters": [
                {**json_row(one), "has_changed": one.has_changed} for one in self.parameters
            ],
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
        each = f"p: corrected (Holm) for all parameters; below {LEVEL:g} one has changed."
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
        If they are of other robots or of other effects, rest on a recording in common (they are
        then not independent), have no covariance, or identify nothing in common.
    """
    _require_comparable(before, after)
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
        )
        for i, k in enumerate(places)
    ]
    return EstimateChanges(
        parameters=tuple(sorted(found, key=lambda one: (one.p_adjusted, -abs(one.z)))),
        statistic=statistic,
        freedom=freedom,
        p_value=float(chdtrc(freedom, statistic)),
        caveats=_caveats(before, after),
    )


def _mahalanobis(z: np.ndarray, S: np.ndarray) -> tuple[float, int]:
    """Return d' S^-1 d and its degrees of freedom, on the directions that have a variance."""
    scale = np.sqrt(np.diag(S))
    sizes, directions = np.linalg.eigh(S / np.outer(scale, scale))
    kept = sizes > _NOTHING * sizes[-1]
    parts = directions[:, kept].T @ z
    return float(np.sum(parts**2 / sizes[kept])), int(kept.sum())


def _require_comparable(before: Estimate, after: Estimate) -> None:
    old, new = before.model, after.model
    if old.robot.names != new.robot.names or old.base.names != new.base.names:
        remedy = "compare two estimates from one description"
        raise FitError("the two estimates are of different robots", remedy=remedy)
    effects = [{one.label for one in model.effects} for model in (old, new)]
    if effects[0] != effects[1]:
        only = sorted(effects[0] ^ effects[1])
        named = ", ".join(only[:3]) + (f" and {len(only) - 3} more" if len(only) > 3 else "")
        what = f"only one of the two estimates has {named}: beside other effects, values differ"
        raise FitError(what, remedy="fit both with the same effects")
    if before.names != after.names:
        what = "the two estimates have other base parameters: the descriptions differ"
        raise FitError(what, remedy="compare two estimates from one description")
    if not (np.any(before.covariance) and np.any(after.covariance)):
        raise FitError("an estimate has no covariance", remedy="take a method that has one")
    shared = {one.sha256 for one in before.sources} & {one.sha256 for one in after.sources} - {""}
    if shared:
        file = next(one.file for one in after.sources if one.sha256 in shared)
        what = f"both estimates rest on {file}: they are not independent"
        raise FitError(what, remedy="fit each to recordings of its own")


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
    return tuple(found)
