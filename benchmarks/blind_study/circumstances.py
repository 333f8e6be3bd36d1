"""What else is drawn of a case whose robot is MuJoCo's: friction, clock, cuts and controller."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from blind_study.cases import BLOCK, Case, draw
from dynident.effects import FRICTION_WIDTH

JOINTS = {2: 50, 3: 10, 4: 8, 5: 7, 6: 12, 7: 13}
"""Cases of each number of joints in a block."""
RATES_HZ = {200.0: 0.15, 500.0: 0.25, 1000.0: 0.35, 2000.0: 0.15, 5000.0: 0.10}
"""Sampling rates and their shares."""
STOPS_WITHIN = (6e-4, 4e-3)
"""s, time constants of MuJoCo's friction constraint: a joint sticks below some 0.001 rad/s."""
SHARPNESS = (0.4, 2.5)
"""True width of smooth friction over the width that the study states, where it is misstated."""
JITTER = (0.005, 0.1)
"""Of a sample, standard deviation of the clock where it jitters."""


@dataclass(frozen=True, kw_only=True)
class Circumstances:
    """How a robot in MuJoCo is driven and recorded.

    Attributes
    ----------
    friction : "constraint", MuJoCo's own, or "tanh" of the speed over a width.
    time_constant : s, of that constraint.
    rate_hz : of controller and record.
    repetition : "stated" where the records repeat a period that the study states, or "none".
    jitter : of a sample, standard deviation of its time; 0 for none.
    feedforward : what the controller adds along the reference: "nominal" rigid body, or "none".
    """

    friction: Literal["constraint", "tanh"]
    time_constant: float
    rate_hz: float
    repetition: Literal["stated", "none"]
    jitter: float
    feedforward: Literal["nominal", "none"]

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class MujocoCase(Case):
    """A case with its circumstances; half of a block's cases have the constraint's friction."""

    circumstances: Circumstances = field(kw_only=True)

    @property
    def name(self) -> str:
        return f"{super().name}_mujoco"


def draw_mujoco(seed: int, count: int, first: int = 0) -> list[MujocoCase]:
    """Draw cases `first` to `first + count - 1` of a seed, as `draw` does, for MuJoCo."""
    cases = draw(seed, count, first, JOINTS)
    return [placed(case) for case in cases]


def placed(case: Case) -> MujocoCase:
    """Return a case as one whose robot is MuJoCo's."""
    rng = np.random.default_rng([case.seed, case.number, 7])
    low, high = np.log(STOPS_WITHIN)
    constant = float(np.exp(rng.uniform(low, high)))
    rate = float(rng.choice(list(RATES_HZ), p=list(RATES_HZ.values())))
    repetition = str(rng.choice(["stated", "none"]))
    jitter = float(np.exp(rng.uniform(*np.log(JITTER)))) if rng.random() < 1 / 3 else 0.0
    feedforward = str(rng.choice(["nominal", "none"]))
    sharpness = float(np.exp(rng.uniform(*np.log(SHARPNESS)))) if rng.random() < 0.5 else 1.0
    says_width = rng.random() < 0.5
    if any(one.effect == "contact" for one in case.hidden):
        repetition = "stated"  # a burst is what sets repetitions apart
    tight = bool(_tight(case.seed, case.number // BLOCK)[case.number % BLOCK])
    changes: dict[str, Any] = {name: getattr(case, name) for name in case.__dataclass_fields__}
    if tight:
        # No width describes it; the study states the usual one, or some other.
        changes["stated_width"] = case.width if says_width else FRICTION_WIDTH
        changes["width"] = 0.0
    else:
        changes["stated_width"] = case.width
        changes["width"] = case.width * sharpness
    circumstances = Circumstances(
        friction="constraint" if tight else "tanh",
        time_constant=constant,
        rate_hz=rate,
        repetition=repetition,  # type: ignore[arg-type]
        jitter=jitter,
        feedforward=feedforward,  # type: ignore[arg-type]
    )
    return MujocoCase(**changes, circumstances=circumstances)


@lru_cache(8)
def _tight(seed: int, block: int) -> np.ndarray:
    """Which cases of a block have the constraint's friction: each half of every kind."""
    rng = np.random.default_rng([seed, block, 8])
    kinds = np.array([case.kind for case in draw(seed, BLOCK, block * BLOCK, JOINTS)])
    found = np.zeros(BLOCK, dtype=bool)
    for kind in sorted(set(kinds)):
        places = rng.permutation(np.flatnonzero(kinds == kind))
        found[places[: (len(places) + block % 2) // 2]] = True
    return found
