"""How an instrumental variable estimate came about: its iterations and what they rest on."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from dynident.tables import Table, number, percent


class Ending(StrEnum):
    """How the iterations ended."""

    CONVERGED = "converged"
    DIRECT = "solved"  # nothing to iterate: the instruments do not depend on the estimate
    ROUNDS_EXHAUSTED = "not converged"
    NOT_SIMULATED = "cannot be simulated"
    DOUBTFUL_LOOP = "doubtful loop"


@dataclass(frozen=True)
class Way:
    """How the instruments of an iteration came from the estimate before it.

    Attributes
    ----------
    share : of the way from the last estimate that was taken: 1 but for damped iterations.
    projected : whether the nearest possible robot was simulated in place of the estimate.
    """

    share: float
    projected: bool = False


@dataclass(frozen=True, kw_only=True)
class Round:
    """One iteration.

    Attributes
    ----------
    values : (p,) the estimate after it.
    error_measured : norm of y - W x over the norm of y, W the regressor as it was measured.
    error_simulated : the same with the instruments V in place of W.
    correlation : smallest canonical correlation of instruments and regressor.
    way : how its instruments were made.
    """

    values: np.ndarray
    error_measured: float
    error_simulated: float
    correlation: float
    way: Way = field(default_factory=lambda: Way(1.0))


@dataclass(frozen=True, eq=False, kw_only=True)
class Convergence:
    """The iterations of an instrumental variable estimate.

    Attributes
    ----------
    names, units : of the parameters.
    start : (p,) where they began.
    start_name : in words.
    rounds : one for each iteration.
    ending : how they ended.
    message : what stopped them, in words; empty where they converged.
    sigma : (p,) standard deviations with the noise carried through filters and derivatives,
        without its expected bias.
    textbook_sigma : (p,) those that take the rows' errors as independent.
    expected_bias : (p,) what the encoders' noise does to the estimate in the mean, since no
        instrument corrects columns that bend within the noise (dry friction); NaN where it does
        not differ from zero significantly.
    sampling_bias : (p,) what central differences and held torques do to it, without any noise; NaN
        where the instruments are not simulated.
    position_std : (n,) encoder noise behind `sigma`, rad or m.
    torque_std : (n,) white torque noise behind it, N m or N.
    noise_source : "given" or "measured".
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    start: np.ndarray
    start_name: str
    rounds: tuple[Round, ...]
    ending: Ending
    message: str
    sigma: np.ndarray
    textbook_sigma: np.ndarray
    expected_bias: np.ndarray
    sampling_bias: np.ndarray
    position_std: np.ndarray
    torque_std: np.ndarray
    noise_source: str

    @property
    def values(self) -> np.ndarray:
        """Estimates of every iteration, the start first, (rounds + 1, p)."""
        return np.vstack([self.start, *(one.values for one in self.rounds)])

    @property
    def errors_measured(self) -> np.ndarray:
        """Relative errors with the measured regressor, (rounds,)."""
        return np.array([one.error_measured for one in self.rounds])

    @property
    def errors_simulated(self) -> np.ndarray:
        """Relative errors with the simulated regressor, (rounds,)."""
        return np.array([one.error_simulated for one in self.rounds])

    @property
    def sentence(self) -> str:
        """How they ended, for a status line."""
        if self.ending is Ending.DIRECT:
            return self.ending.value
        rounds = len(self.rounds)
        plural = "" if rounds == 1 else "s"
        return f"{self.ending.value} after {rounds} iteration{plural}"

    def tables(self) -> tuple[Table, Table]:
        """The iterations, and both kinds of standard deviation."""
        return self.round_table(), self.sigma_table()

    def round_table(self) -> Table:
        """Parameters and errors, iteration by iteration."""
        count = len(self.rounds)
        # Of a long history only its two ends are shown.
        shown = list(range(count + 1)) if count <= 6 else [0, 1, 2, 3, count - 1, count]
        heads = ("start" if k == 0 else str(k) for k in shown)
        rows = [
            (name, *(number(float(self.values[k, i]), 5) for k in shown), unit)
            for i, (name, unit) in enumerate(zip(self.names, self.units, strict=True))
        ]
        for title, errors in (
            ("error, regressor measured", self.errors_measured),
            ("error, regressor simulated", self.errors_simulated),
        ):
            cells = ("" if k == 0 else percent(float(errors[k - 1])) for k in shown)
            rows.append((title, *cells, ""))
        notes = (
            f"Start: {self.start_name}; {self.sentence}.",
            "The error with the measured regressor has the noise of the positions in it, and least "
            "squares has the smallest of all by definition: judge by the other.",
        )
        return Table("Iterations", ("parameter", *heads, "unit"), tuple(rows), notes)

    def sigma_table(self) -> Table:
        """Standard deviations, carried and textbook."""
        columns = (self.sigma, self.textbook_sigma, self.expected_bias, self.sampling_bias)
        rows = tuple(
            (name, *(number(float(x[i]), 3) for x in columns), self.units[i])
            for i, name in enumerate(self.names)
        )
        stds = ", ".join(number(float(x), 3) for x in self.position_std)
        what = "torque noise"
        if self.noise_source == "measured":
            what = "white torque noise, both from the spectrum of the residual"
        torque = ", ".join(number(float(x), 3) for x in self.torque_std)
        notes = (
            f"sigma: encoder noise ({stds}) and {what} ({torque}), {self.noise_source}, "
            "through derivatives and filters. textbook: errors of the rows as if independent. "
            "bias: expected, and not subtracted; that of noise is in the sigma of the parameters.",
        )
        heads = ("parameter", "sigma", "textbook sigma", "bias, noise", "bias, sampling", "unit")
        return Table("Standard deviations", heads, rows, notes)

    def to_dict(self) -> dict[str, Any]:
        """The iterations as JSON holds them."""
        return {
            "start": {"name": self.start_name, "values": _listed(self.start)},
            "rounds": [
                {
                    "values": _listed(one.values),
                    "error_measured": one.error_measured,
                    "error_simulated": one.error_simulated,
                    "correlation": one.correlation,
                    "step": one.way.share,
                    "projected": one.way.projected,
                }
                for one in self.rounds
            ],
            "ending": self.ending.value,
            "message": self.message,
            "sigma": _listed(self.sigma),
            "textbook_sigma": _listed(self.textbook_sigma),
            "expected_bias": _listed(self.expected_bias),
            "sampling_bias": _listed(self.sampling_bias),
            "noise": {
                "source": self.noise_source,
                "position_std": _listed(self.position_std),
                "torque_std": _listed(self.torque_std),
            },
        }


def _listed(values: np.ndarray) -> list[float | None]:
    return [float(x) if np.isfinite(x) else None for x in values]
