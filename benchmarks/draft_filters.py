"""How often `dynident init` lowers the cut-offs of a filter, and whether it should.

    python benchmarks/draft_filters.py [--robots 20] [--first 95700]

Simulated arms of two, six and seven joints, recorded for 3.5 to 40 s at 100 to 1000 Hz with noise
of 1 to 10 % on the torques: as many with exact positions as with noise of the positions that moves
parameters by more than their sigma. For each kind it prints how often lower cut-offs are proposed,
and how often the fit behind them predicts the torque of another motion, free of noise, better than
the fit behind the usual ones.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from arms import chain
from dynident.effects import effects_of
from dynident.fitting import Estimate, fit
from dynident.model import Model
from dynident.recording import Dataset, Filter, Recording, default_filter
from dynident.study_draft.guesses.filter_cutoffs import suitable_filter

JOINTS = (2, 6, 7)
SECONDS = (3.5, 5.0, 8.0, 14.0, 24.0, 40.0)
RATES_HZ = (100.0, 200.0, 250.0, 500.0, 1000.0)
_FREQUENCIES = 2 * np.pi / 8.0 * np.sqrt([1, 5, 10, 17, 26])  # rad/s; they have no common period


@dataclass(frozen=True, eq=False)
class Arm:
    """A simulated arm, recorded once without noise of positions and once with it."""

    model: Model
    values: np.ndarray
    exact: Recording
    noisy: Recording

    def error(self, estimate: Estimate) -> float:
        """Of the torque along another motion, relative to its own at each joint."""
        t, q, v, a = motion(np.random.default_rng(1), self.model.robot.n, np.arange(0, 20, 0.01))
        block = self.model.block(t, q, v, a)
        true, found = (self.model.torque(block, x) for x in (self.values, estimate.values))
        return float(np.sqrt(np.mean(np.mean((found - true) ** 2, 0) / np.mean(true**2, 0))))

    def fit(self, recording: Recording, settings: Filter) -> Estimate:
        return fit(self.model, Dataset((recording,), settings))

    @property
    def shift(self) -> float:
        """Root mean square of what noise of positions moves parameters by, in sigma."""
        settings = default_filter(self.exact.rate_hz)
        noisy, exact = (self.fit(one, settings) for one in (self.noisy, self.exact))
        sigma = np.sqrt(np.diag(noisy.covariance))
        known = sigma > 0
        return float(np.sqrt(np.mean(((noisy.values - exact.values)[known] / sigma[known]) ** 2)))


def motion(
    rng: np.random.Generator, n: int, t: np.ndarray, speed: float = 1.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Sum of five sines at each joint: t (T,), q, v, a (T, n)."""
    k = speed * _FREQUENCIES
    s, c = rng.normal(size=(2, n, 5)) * 0.5 / np.arange(1, 6)
    sin, cos = np.sin(t[:, None] * k), np.cos(t[:, None] * k)
    return (
        t,
        sin @ s.T + cos @ c.T,
        (cos * k) @ s.T - (sin * k) @ c.T,
        -(sin * k**2) @ s.T - (cos * k**2) @ c.T,
    )


def arms(first: int) -> Iterator[Arm]:
    """Arms without end, of the seeds from this one on."""
    for seed in range(first, first + 1_000_000):
        rng = np.random.default_rng([seed, 17])
        robot = chain(JOINTS[seed % 3])
        model = Model(robot) + effects_of("viscous_friction", robot)
        model += effects_of("coulomb_friction", robot)
        values = model.given_values()
        friction = model.slices[f"viscous_friction@{robot.names[0]}"].start
        values[friction:] = rng.uniform(0.05, 0.5, model.size - friction)
        rate = float(rng.choice(RATES_HZ))
        t = np.arange(round(rng.choice(SECONDS) * rate) + 1) / rate
        t, q, v, a = motion(rng, robot.n, t, rng.uniform(0.7, 2.5))
        tau = model.torque(model.block(t, q, v, a), values)
        share = 10 ** rng.uniform(-2, -1)
        tau = tau + share * np.sqrt(np.mean(tau**2, axis=0)) * rng.normal(size=tau.shape)
        exact = Recording(t, q, tau, robot.names, name=f"seed {seed}")
        std = 10 ** rng.uniform(-4.5, -2.7)  # rad
        noisy = exact.replace(q=q + std * rng.normal(size=q.shape))
        yield Arm(model, values, exact, noisy)


def judged(arm: Arm, recording: Recording) -> float | None:
    """Error with the filter that a draft proposes, over that with the usual one; None for none."""
    found = suitable_filter(arm.model, [recording], lambda *_: 0)
    if found is None:
        return None
    usual = default_filter(recording.rate_hz)
    return arm.error(arm.fit(recording, found)) / arm.error(arm.fit(recording, usual))


def report(kind: str, ratios: list[float | None]) -> None:
    """Print a line."""
    told = [one for one in ratios if one is not None]
    nearer = sum(one < 1 for one in told)
    line = f"{kind}: lower cut-offs for {len(told)} of {len(ratios)}"
    if told:
        line += f", nearer to the truth with {nearer}; error times {np.median(told):.2g} (median)"
        line += f", {max(told):.2g} (at worst)"
    print(line, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--first", type=int, default=95700)
    said = parser.parse_args()
    warnings.simplefilter("ignore")
    every = arms(said.first)
    quiet = [next(every) for _ in range(said.robots)]
    report("exact positions", [judged(one, one.exact) for one in quiet])
    shifted = (one for one in arms(said.first) if one.shift > 1)
    noisy = [next(shifted) for _ in range(said.robots)]
    report("noisy positions", [judged(one, one.noisy) for one in noisy])


if __name__ == "__main__":
    main()
