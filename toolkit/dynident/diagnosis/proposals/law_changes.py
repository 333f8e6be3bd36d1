"""Whether the torque of a law changes with what it depends on in another way than the law says.

A law outside of the library is imitated by one of it: a saturation by a sign, a step by waves. What
such a law leaves goes with the same positions, speeds and loads.
"""

from __future__ import annotations

import re

from dynident.diagnosis.search.scoring import candidate_moments, score
from dynident.effects import Effect, LawEffect, law_effect
from dynident.errors import EffectError
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.formulas import Signal, quoted_joint

_NAME = "changes"
_OF_A_SPEED = ("{}", "abs({})", "{}^2")
_OF_OTHERS = ("{}", "{}^2")


def change_p_value(evidence: Evidence, fitted: EvidenceFit, effect: LawEffect) -> float:
    """P value of the hypothesis that a law does not change with its own signals.

    The torque of the law, as it was found, times each of them and its square, and times the
    absolute value of a speed, are columns more; the test is that of every effect.

    Parameters
    ----------
    evidence, fitted : the training recordings, and the model with the law as it fits them.
    effect : the law.

    Returns
    -------
    1 where the data do not tell such columns.
    """
    changes = _changes(fitted, effect)
    if changes is None:
        return 1.0
    (parts,) = candidate_moments(evidence, fitted, [changes])
    return score(fitted, changes, *parts, grid=1).p_value


def _changes(fitted: EvidenceFit, effect: LawEffect) -> Effect | None:
    """The law times functions of its signals; None where that is too long for a formula."""
    law, values = effect.made_of, fitted.values[fitted.model.slices[effect.label]].tolist()
    functions = [
        text.format(_written(signal))
        for signal in law.signals
        for text in (_OF_A_SPEED if signal.quantity == "v" else _OF_OTHERS)
    ]
    sum_ = " + ".join(f"d{k}*{text}" for k, text in enumerate(functions, 1))
    known = dict(zip(law.linear, (f"{x:.12g}" for x in values), strict=True))
    name = re.compile(rf"\b({'|'.join(map(re.escape, known))})\b(?![^\[]*\])")
    torque = name.sub(lambda found: f"({known[found[0]]})", law.torque)
    try:
        found = type(law)(name=_NAME, torque=f"({torque})*({sum_})", shape=law.shape)
        return law_effect(found)(effect.joint, shape=effect.shape).on(fitted.model.robot)
    except EffectError:
        return None


def _written(signal: Signal) -> str:
    place = "" if signal.joint is None else f"[{quoted_joint(signal.joint)}]"
    return f"{signal.quantity}{place}"
