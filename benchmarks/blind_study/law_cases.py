"""The cases of the study of laws: what is hidden is a law that no catalogue has, or nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from blind_study.cases import Case, Hidden, Kind, draw_case
from blind_study.circumstances import placed
from blind_study.drawn_laws import NAME, Family

BLOCK = 16
FAMILIES: tuple[Family, ...] = ("library", "library", "library", "library", "memory", "outside")
"""Of the laws in a block; all its other cases are healthy."""
JOINTS = {2: 0.6, 3: 0.08, 4: 0.08, 5: 0.06, 6: 0.09, 7: 0.09}
RATIOS = (1.2, 10.0)
"""Residual that a law leaves, over the noise."""
OF_MUJOCO = 0.4
"""Share of the cases whose robot MuJoCo moves; laws of load are only there."""


def draw_laws(seed: int, count: int, first: int = 0) -> list[Case]:
    """Draw cases `first` to `first + count - 1` of a seed."""
    return [_drawn(seed, number) for number in range(first, first + count)]


def family_of(case: Case) -> Family:
    """Return whether a case's law is in the library, has memory, or is outside."""
    order = np.random.default_rng([case.seed, case.number // BLOCK, 11]).permutation(BLOCK)
    return FAMILIES[int(order[case.number % BLOCK])]


def _drawn(seed: int, number: int) -> Case:
    rng = np.random.default_rng([seed, number, 12])
    order = np.random.default_rng([seed, number // BLOCK, 11]).permutation(BLOCK)
    joints = int(rng.choice(list(JOINTS), p=list(JOINTS.values())))
    hides = int(order[number % BLOCK]) < len(FAMILIES)
    kind: Kind = "law" if hides else "healthy"
    case = replace(draw_case(seed, number, kind, joints, []), variant="laws")
    if hides:
        ratio = float(np.exp(rng.uniform(*np.log(RATIOS))))
        # Joint and source are drawn with the law.
        case = replace(case, hidden=(Hidden(NAME, 0, 0, ratio),))
    return placed(case) if rng.random() < OF_MUJOCO else case
