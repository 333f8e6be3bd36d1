"""How often 95 % intervals hold the truth, on arms that share no code with the package.

    python benchmarks/coverage.py --seeds 200

Two links move by equations of their own, six axes by MuJoCo. Each seed is another motion and
another draw of noise. Beside the intervals that `fit` gives stand those of errors taken as
independent from row to row.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import numpy as np

import dynident as di
import six_axis_loop
import two_link_loop
from dynident.recording import Dataset, Filter
from six_axis_loop import SixAxisLab
from two_link_loop import Lab

_TORQUE = (2.0, 0.8)
_QUIET = (0.4, 0.2)
_SHARP = 0.02  # rad/s, over which dry friction reverses


@dataclass(frozen=True, kw_only=True)
class Case:
    """Recordings, how they are fitted, and which parameters are judged.

    Attributes
    ----------
    arm : module of the arm that is recorded: its model and its true parameters.
    inertial : whether only inertial parameters are.
    width : rad/s, over which the model's dry friction reverses; None: as the arm's module has it.
    """

    name: str
    lab: Lab | SixAxisLab
    arm: ModuleType = two_link_loop
    filter: Filter | None = None
    method: Any = None
    inertial: bool = False
    width: float | None = None
    rival: Any = field(default_factory=lambda: di.LeastSquares(errors="independent"))


def cases() -> tuple[Case, ...]:
    """All of them."""
    loop = di.IV(two_link_loop.controller(), start="description")
    found = [
        Case(name="LS, torque noise, default filter", lab=Lab(torque_std=_TORQUE)),
        Case(name="LS, torque noise, no filter", lab=Lab(torque_std=_TORQUE), filter=Filter()),
    ]
    for std in (1e-5, 3e-5, 1e-4):
        lab = Lab(torque_std=_TORQUE, position_std=std)
        found.append(Case(name=f"LS, encoder {std:g} rad too, default filter", lab=lab))
        name = f"LS, encoder {std:g} rad too, inertial"
        found.append(Case(name=name, lab=lab, inertial=True))
    lab = Lab(torque_std=_TORQUE, position_std=1e-5)
    found.append(Case(name="LS, encoder 1e-05 rad too, no filter", lab=lab, filter=Filter()))
    lacking = Lab(torque_std=_QUIET, stribeck=0.4)
    found.append(Case(name="LS, Stribeck friction missing", lab=lacking))
    lacking = Lab(torque_std=_QUIET, stribeck=0.4, period=True)
    found.append(Case(name="LS, the same with repetitions", lab=lacking))
    for std in (1e-5, 3e-5):
        lab = Lab(seconds=5.0, position_std=std, torque_std=_QUIET)
        for words, settings in (("no filter", Filter()), ("default filter", None)):
            name = f"IV, noise measured, encoder {std:g} rad, {words}, inertial"
            case = Case(name=name, lab=lab, filter=settings, method=loop, inertial=True, rival=None)
            found.append(case)
    for colour in (0.05, 0.2):
        noise = f"torque noise over {colour:g} s, default filter"
        lab = Lab(torque_std=_TORQUE, colour_s=colour)
        found.append(Case(name=f"LS, {noise}", lab=lab))
    for rate, seconds, waves_s in ((200.0, 24.0, 8.0), (200.0, 24.0, 2.0), (1000.0, 24.0, 2.0)):
        lab = Lab(
            torque_std=(0.1, 0.05),
            position_std=1e-5,
            width=_SHARP,
            rate_hz=rate,
            gain=rate / two_link_loop.RATE,
            waves_s=waves_s,
            seconds=seconds,
        )
        name = f"LS, sharp friction, little noise, {rate:g} Hz, motion from {1 / waves_s:g} Hz on"
        found.append(Case(name=name, lab=lab, width=_SHARP))
    for words, lab in (
        ("torque noise", SixAxisLab()),
        ("encoder 3e-05 rad too", SixAxisLab(position_std=3e-5)),
        ("torque noise over 0.05 s", SixAxisLab(colour_s=0.05)),
        ("torque noise over 0.2 s", SixAxisLab(colour_s=0.2)),
    ):
        found.append(
            Case(name=f"LS, six axes, {words}, default filter", lab=lab, arm=six_axis_loop)
        )
    return tuple(found)


def coverage(case: Case, seeds: range) -> tuple[float, float]:
    """Share of the truth within 1.96 sigma, of the method and of its rival (NaN if none)."""
    model = case.arm.model(*filter(None, [case.width]))
    truth = case.arm.truth(model)
    part = slice(0, model.base.rank if case.inertial else model.size)
    recordings = [
        one
        for start in range(seeds.start, seeds.stop, 50)
        for one in case.lab.recordings(range(start, min(start + 50, seeds.stop)))
    ]
    found = []
    for method in (case.method, case.rival):
        if method is None and found:
            found.append(np.nan)
            continue
        inside = []
        for one in recordings:
            estimate = di.fit(model, Dataset((one,), case.filter), method)
            inside.append((np.abs(estimate.values - truth) < 1.96 * estimate.sigma)[part])
        found.append(float(np.mean(inside)))
    return found[0], found[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--first", type=int, default=9000, help="seed to begin with")
    parser.add_argument("--only", default="", help="cases whose name holds this")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.seeds)
    print(f"{'coverage of 95 % intervals':62s} fit    rows independent", flush=True)
    for case in cases():
        if options.only in case.name:
            ours, rival = coverage(case, seeds)
            print(f"{case.name:62s} {ours:.3f}  {rival:.3f}", flush=True)


if __name__ == "__main__":
    main()
