"""Whether what a law leaves changes with the positions, speeds and accelerations that are in it.

A law outside of the library is imitated by one of it: a saturation by a sign, a step by waves. What
such a law leaves goes with the same signals.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from dynident.diagnosis.search.scores.candidate_moments import candidate_moments
from dynident.diagnosis.search.scores.scoring import score
from dynident.effects import Block, JointEffect, LawEffect, Parameter
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.formulas import Signal

_NOT_ASKED = frozenset(("load", "t", "temperature"))
"""Signals that a model predicts, with an error of its own, and those that no motion repeats."""


def change_p_value(evidence: Evidence, fitted: EvidenceFit, effect: LawEffect) -> float:
    """P value of the hypothesis that what a law leaves does not change with the law's signals.

    The torque of the law, as it was found, times one of them, its square, or the absolute value of
    a speed, is a column more, one after the other: all at once they would be too many for blocks of
    time to tell their covariance. The test is that of every effect, times their number.

    Parameters
    ----------
    evidence, fitted : the training recordings, and the model with the law as it fits them.
    effect : the law.

    Returns
    -------
    1 for laws of the load, the time or the temperature, which are not asked.
    """
    if effect.made_of.quantities & _NOT_ASKED:
        return 1.0
    values = tuple(fitted.values[fitted.model.slices[effect.label]].tolist())
    found = []
    for signal in effect.made_of.signals:
        for function in ("itself", "square", *(["size"] if signal.quantity == "v" else [])):
            change = _Change(
                effect.joint, of=effect, values=values, signal=signal, function=function
            )
            (parts,) = candidate_moments(evidence, fitted, [change])
            found.append(score(fitted, change, *parts, grid=1).p_value)
    return min(1.0, len(found) * min(found, default=1.0))


@dataclass(frozen=True)
class _Change(JointEffect):
    """The torque of a law times a function of one of its signals.

    Attributes
    ----------
    of, values : the law, and its coefficients.
    signal, function : of which it is, and which.
    """

    of: LawEffect | None = None
    values: tuple[float, ...] = ()
    signal: Signal | None = None
    function: str = ""
    name: ClassVar[str] = "change of a law"
    in_catalogue: ClassVar[bool] = False

    def parameters(self, robot):
        return (Parameter("d", "1"),)

    def at_joint(self, block: Block) -> np.ndarray:
        assert self.of is not None
        assert self.signal is not None
        x = np.asarray(self.of.signal(self.signal, block))
        factor = {"itself": x, "square": x**2, "size": np.abs(x)}[self.function]
        return (self.of.at_joint(block) @ np.array(self.values) * factor)[:, None]
