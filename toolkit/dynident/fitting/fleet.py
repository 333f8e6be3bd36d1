"""Many robots of one kind: an estimate of each, and which one differs from the others in what.

Two robots of one kind are never equal. A robot is odd where a parameter lies farther from those of
the others than its own uncertainty and the usual spread between robots explain; that spread is
estimated from the others alone, so that an odd robot cannot hide in a spread that it makes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import stdtrit

from dynident.clusters import Cluster, spread
from dynident.errors import DynidentError, FitError
from dynident.fitting.comparing.between_robots import (
    against_others,
    common_basis,
    holm,
    usual_value,
    values_in_common,
)
from dynident.fitting.estimate import Estimate
from dynident.fitting.fit_model import Method, fit
from dynident.fitting.row_objective import shaped_effects
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import BaseParameters
from dynident.tables import Shown, Table, json_row, number, p_value, relative

LEVEL = 0.05
"""Probability of any false alarm in a fleet where no robot is odd."""

LEAST_ROBOTS = 3
"""Two robots may differ, but none of them from the others: there is no spread between others."""


@dataclass(frozen=True, kw_only=True)
class RobotComparison:
    """A parameter of a robot against the same parameter of the others.

    Attributes
    ----------
    robot, parameter, unit : names; the parameter is a combination that every robot's data show.
    value, sigma : of this robot, with its own standard deviation.
    usual : mean of the others, weighted.
    spread : standard deviation between the others beyond what their own uncertainty explains.
    z : (value - usual) over the standard deviation of that difference: the robot's own
        uncertainty, the spread between robots and the uncertainty of the mean.
    freedom : degrees of freedom behind that standard deviation.
    p_value : of the hypothesis that this robot is one of the others, by Student's t.
    p_adjusted : by Holm over all robots and parameters.
    """

    robot: str
    parameter: str
    unit: str
    value: float
    sigma: float
    usual: float
    spread: float
    z: float
    freedom: float
    p_value: float
    p_adjusted: float


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Fleet(Shown):
    """Robots of one kind, and which differs from the others in what.

    Attributes
    ----------
    estimates : of each robot, by its name.
    basis : the combinations of parameters that every robot's data identify.
    comparisons : of every robot and combination, the smallest p value first.
    """

    estimates: Mapping[str, Estimate]
    basis: BaseParameters
    comparisons: tuple[RobotComparison, ...]

    @property
    def differences(self) -> tuple[RobotComparison, ...]:
        """Where a robot differs from the others, beyond its uncertainty and the usual spread."""
        return tuple(one for one in self.comparisons if one.p_adjusted < LEVEL)

    @property
    def headline(self) -> str:
        """Which robots differ from the others, in a sentence."""
        odd = dict.fromkeys(one.robot for one in self.differences)
        if not odd:
            return f"None of {len(self.estimates)} robots is seen to differ from the others."
        verb = "differs" if len(odd) == 1 else "differ"
        return f"{', '.join(odd)} {verb} from the others, of {len(self.estimates)} robots."

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        found = self.differences
        title = "Differences" if found else "Nearest to a difference, and none"
        columns = ("robot", "parameter", "value", "sigma", "usual", "spread", "z", "p", "unit")
        rows = tuple(
            (
                one.robot,
                one.parameter,
                *(number(x, 4) for x in (one.value, one.sigma, one.usual, one.spread, one.z)),
                p_value(one.p_adjusted),
                one.unit,
            )
            for one in found or self.comparisons[:3]
        )
        return (self.headline, Table(title, columns, rows, self.notes), self.parameter_table())

    @property
    def notes(self) -> tuple[str, ...]:
        """What a difference is, how large it must be, and what cannot be compared."""
        n, tests = len(self.estimates), len(self.comparisons)
        least = float(-stdtrit(n - 2, LEVEL / tests / 2))
        said = [
            "A robot differs where its value lies beyond both its own uncertainty and the usual "
            "spread between robots, which is that of the others alone. usual: their mean; p: by "
            f"Student's t, corrected (Holm) for all {tests} comparisons, below {LEVEL:g} of which "
            "a difference is told. The spread between robots is taken as normal.",
            f"With {n} robots, z must be beyond {number(least, 3)} at least: their spread is known "
            "from few. Smaller differences stay unseen, and of several odd robots each widens the "
            "spread that the others are judged by.",
        ]
        lost = [self.basis.names[i] for i in self.basis.dependent]
        if lost:
            said.append(
                "Compared in combinations that the data of every robot identify; on their own not "
                f"compared: {', '.join(lost)}."
            )
        ranks = {name: one.basis.rank for name, one in self.estimates.items()}
        if max(ranks.values()) > self.basis.rank:
            more = ", ".join(f"{name} {rank}" for name, rank in ranks.items())
            said.append(
                f"{self.basis.rank} combinations are common to all, of each robot's {more}."
            )
        if any(shaped_effects(one.model) for one in self.estimates.values()):
            said.append(
                "Parameters inside effects (widths, velocities) were refined robot by robot and "
                "are not compared; what they do to the others counts as spread."
            )
        warned = [name for name, one in self.estimates.items() if one.headline]
        if warned:
            said.append(f"Estimates with a warning, their first line: {', '.join(warned)}.")
        return tuple(said)

    def parameter_table(self) -> Table:
        """What is usual in this fleet, parameter by parameter."""
        values, variances = values_in_common(list(self.estimates.values()), self.basis)
        usual = usual_value(values, variances)
        model = next(iter(self.estimates.values())).model
        words, rows = model.stands_for(self.basis), []
        for k, head in enumerate(self.basis.independent):
            name = model.names[head]
            mean, spread = float(usual.mean[k]), float(usual.spread[k])
            share = relative(mean, spread)
            own = number(float(np.sqrt(np.median(variances[:, k]))), 3)
            cells = (number(mean), number(spread, 3), share, own, model.units[head])
            rows.append((name, *cells, words[k]))
        columns = ("parameter", "usual", "spread", "relative", "own sigma", "unit", "stands for")
        notes = (
            "spread: between all robots, beyond their own uncertainty (its median: own sigma).",
        )
        return Table("What is usual", columns, tuple(rows), notes)

    def to_dict(self) -> dict[str, Any]:
        """The fleet as JSON holds it, with the estimate of each robot."""
        return {
            "headline": self.headline,
            "differences": [json_row(one) for one in self.differences],
            "comparisons": [json_row(one) for one in self.comparisons],
            "notes": list(self.notes),
            "estimates": {name: one.to_dict() for name, one in self.estimates.items()},
        }


def fit_fleet(
    model: Model,
    data: Mapping[str, Dataset | Recording],
    method: Method | None = None,
    *,
    client: Cluster | None = None,
) -> Fleet:
    """Identify many robots of one kind, and tell which differs from the others in what.

    For each robot and combination of parameters, theta_i = mu + b_i + e_i with the covariance of
    e_i from its estimate. mu and the variance of b are estimated from the other robots (Paule and
    Mandel, J. Res. NBS 87, 1982), so that z is Student's with one degree of freedom less than
    there are others, or fewer where these are known unequally well (Satterthwaite).

    Parameters
    ----------
    model : of all robots, as described.
    data : recordings of each robot, by its name; three robots at least.
    method : as of `fit`.
    client : of dask.distributed, where the estimates are made; without it they are made here.

    Returns
    -------
    The estimate of each robot, and its differences from the others.

    Raises
    ------
    FitError
        If there are fewer than three robots, the data of one cannot carry the model, the method
        has no covariance, no combination of parameters is identified by all, or the cluster fails.
    """
    if len(data) < LEAST_ROBOTS:
        what = f"{len(data)} robots, where one is compared with at least two others"
        raise FitError(what, remedy="fit each of them with `fit`")
    names, datasets = list(data), list(data.values())
    many = len(names)
    estimates = list(spread(client, _fit_one, names, [model] * many, datasets, [method] * many))
    return compare_robots(dict(zip(names, estimates, strict=True)))


def _fit_one(name: str, model: Model, data: Dataset | Recording, method: Method | None) -> Estimate:
    """Fit one robot; an error says which."""
    try:
        return fit(model, data, method)
    except DynidentError as error:
        raise FitError(str(error), f"robot '{name}'") from error


def compare_robots(estimates: Mapping[str, Estimate]) -> Fleet:
    """Return a fleet of robots that are estimated already, see `fit_fleet`.

    Parameters
    ----------
    estimates : of one model, by the robot's name.

    Raises
    ------
    FitError
        As `fit_fleet`, and if the models have different parameters.
    """
    first = next(iter(estimates.values()))
    for name, one in estimates.items():
        if one.names != first.names:
            raise FitError("other parameters than the first", f"robot '{name}'", "fit one model")
        if not np.any(one.covariance):
            raise FitError("no covariance", f"robot '{name}'", "take a method that has one")
    basis = common_basis([one.basis for one in estimates.values()])
    if not basis.rank:
        raise FitError("no combination of parameters is identified by the data of every robot")
    values, variances = values_in_common(list(estimates.values()), basis)
    found = against_others(values, variances)
    p_adjusted = holm(found.p_value)
    comparisons = [
        RobotComparison(
            robot=name,
            parameter=first.names[head],
            unit=first.model.units[head],
            value=float(values[i, k]),
            sigma=float(np.sqrt(variances[i, k])),
            usual=float(found.usual[i, k]),
            spread=float(found.spread[i, k]),
            z=float(found.z[i, k]),
            freedom=float(found.freedom[i, k]),
            p_value=float(found.p_value[i, k]),
            p_adjusted=float(p_adjusted[i, k]),
        )
        for i, name in enumerate(estimates)
        for k, head in enumerate(basis.independent)
    ]
    comparisons.sort(key=lambda one: one.p_value)
    return Fleet(estimates=dict(estimates), basis=basis, comparisons=tuple(comparisons))
