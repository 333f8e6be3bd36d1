"""Other laws of dry friction: how it reverses is no finding, unless no law of it does as well.

The model's dry friction is Fc tanh(v / w). A joint's may go through zero along a line, over another
width, and sooner or later than its speed: a lag of friction behind speed is measured on machines
(Hess and Soom, ASME Journal of Tribology 112, 1990), a lead comes from how torque and position are
sampled, or from a simulator's constraint. What the model then misses at its reversals, Stribeck
friction, a delay or presliding would take off too. So whatever is said to be missing at a joint
with dry friction must explain more than any such law does in the place of the model's.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import minimize

from dynident.diagnosis.nuisances.friction_width import FrictionWidthColumn, missed_instead
from dynident.diagnosis.search.ranking import joints_below_noise, rank
from dynident.diagnosis.search.scoring import Score
from dynident.effects import Block, ShapeParameter
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence, signal_by_joint
from dynident.tables import number

_WIDTHS = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4)
_LEADS = (-8e-3, -4e-3, -2e-3, -1e-3, 0.0, 1e-3, 2e-3, 4e-3, 8e-3)
_RANGE = (0.02, 15.0)
"""Narrowest and widest law that is tried, over the model's width."""
_LATEST = 0.01
"""s by which friction may reverse before the joint, or after it; a law that wants more is none."""
_TURNED = 3.0
"""Speed over the width at which dry friction has turned: tanh(3) is 0.995."""
_USUAL = 99.0
"""Percentile of a joint's acceleration that counts as its highest."""
_AS_MUCH = 0.5
"""Share of what an effect explains that a law must explain at least, to stand in for it."""
_AT_MOST, _NOISE = 2.0, 3.0
"""Times what is left at a joint, and standard deviations of its noise, that a law may explain."""
_AT_ONCE = 5e-5
"""s, below which it reverses with the joint."""


class SmoothReversal(FrictionWidthColumn):
    """What dry friction has more that reverses over k times the width, at another moment."""

    name = "smooth_reversal"
    in_catalogue = False
    law = "Fc (tanh((v + lead a)/(k w)) - tanh(v/w))"
    sign_of = "opposite spikes on both sides of zero velocity"
    experiment = "reverse {joint} at several accelerations"

    def shape_parameters(self, robot):
        return (
            ShapeParameter("k", "1", _WIDTHS, lower=_RANGE[0], upper=_RANGE[1]),
            ShapeParameter("lead", "s", _LEADS, lower=-_LATEST, upper=_LATEST),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        j, (k, lead) = block.index(self.joint), self.shape
        v, a = block.v[:, [j]], block.a[:, [j]]
        width = float(np.broadcast_to(block.friction_width, len(block.names))[j])
        return self.reversal((v + lead * a) / (k * width)) - block.direction(self.joint)

    @staticmethod
    def reversal(x: np.ndarray) -> np.ndarray:
        """Return a smoothed sign of x."""
        return np.tanh(x)


class StraightReversal(SmoothReversal):
    """The same of dry friction that goes through zero along a line."""

    name = "straight_reversal"
    law = "Fc (clip((v + lead a)/(k w), -1, 1) - tanh(v/w))"

    @staticmethod
    def reversal(x: np.ndarray) -> np.ndarray:
        return np.clip(x, -1.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class ReversalLaw:
    """Another law of dry friction at a joint, in the place of the model's.

    Attributes
    ----------
    column : the law, as what it has more than the model's.
    drop : of the squared systematic residual, whitened, all else fitted anew.
    words : the law, a clause.
    within : rad/s or m/s, speed within which it is another one than the model's.
    """

    column: SmoothReversal
    drop: float
    words: str
    within: float

    @property
    def joint(self) -> str:
        return str(self.column.joint)

    @property
    def lags(self) -> bool:
        """Whether it reverses after the joint."""
        return self.lead_s <= -_AT_ONCE

    @property
    def lead_s(self) -> float:
        """By which it reverses before the joint."""
        return self.column.shape[1]


def laws_that_do_as_well(
    evidence: Evidence, fitted: EvidenceFit, one: Score, added: int
) -> tuple[ReversalLaw, ...]:
    """Other laws of dry friction that explain together what an effect would, less its price.

    Parameters
    ----------
    evidence, fitted : the training recordings, and the model as it fits them.
    one : the score of an effect that the model lacks.
    added : number of effects added so far.

    Returns
    -------
    At joints where the effect acts and the model has dry friction, those that explain something;
    empty where the effect explains more, by the share that an effect has to, or passes the gates
    beside them too.
    """
    model = fitted.model
    joints = [model.robot.names[j] for j in one.effect.acting_at(model.robot)]
    dry = [joint for joint in joints if f"coulomb_friction@{joint}" in model.slices]
    gates = evidence.criteria.gates
    # What it explains more than they do must itself be worth an effect.
    least = (gates.later_share if added else gates.first_share) * fitted.error_total
    least = max(one.penalised - least, _AS_MUCH * one.penalised)
    found = _laws_at(evidence, fitted, dry, least)
    if sum(law.drop for law in found) < least:
        return ()
    beside = fit_evidence(evidence, fitted.model + tuple(law.column for law in found), fitted)
    if rank(evidence, beside, added, only=(one.effect,)).passing:
        return ()  # it explains something else than they do
    return tuple(found)


def _laws_at(
    evidence: Evidence, fitted: EvidenceFit, joints: list[str], least: float
) -> list[ReversalLaw]:
    """Laws at joints that explain something; fewer where all of them are too little by far.

    What a law explains is estimated from what is left at its joint, whose noise-free square is
    known to the noise of a sum of so many squares.
    """
    names, worth = fitted.model.robot.names, 2.0 * np.log(fitted.rows)
    noise = _NOISE * np.sqrt(2.0 * fitted.rows / len(names))
    left = _AT_MOST * (np.clip(signal_by_joint(evidence, fitted), 0.0, None) + noise)
    most = dict(zip(names, left, strict=True))
    found: dict[str, ReversalLaw] = {}
    waiting = sorted(joints, key=lambda one: -most[one])
    while waiting:
        hope = sum(most[joint] for joint in waiting)
        if sum(law.drop for law in found.values()) + hope < least:
            break
        joint = waiting.pop(0)
        law = _best_law(evidence, fitted, joint)
        if law.drop > worth and abs(law.lead_s) < _LATEST:
            found[joint] = law
    return [found[joint] for joint in joints if joint in found]


def laws_of_the_rest(evidence: Evidence, fitted: EvidenceFit) -> tuple[ReversalLaw, ...]:
    """Other laws of dry friction that explain a part of what no effect does.

    Only those that reverse with the joint or before it. Friction that lags behind the joint has a
    memory: that is physics which the model lacks.

    Parameters
    ----------
    evidence, fitted : the training recordings, and the model as it fits them.

    Returns
    -------
    At joints where they explain the share of the squared residual that an effect has to; none where
    the noise is unknown.
    """
    if not fitted.noise_known:
        return ()
    least = evidence.criteria.gates.later_share * fitted.error_total
    if fitted.error_signal < least:
        return ()
    quiet, names = joints_below_noise(evidence, fitted), fitted.model.robot.names
    dry = [one for one in names if f"coulomb_friction@{one}" in fitted.model.slices]
    every = (_best_law(evidence, fitted, joint) for joint in dry if joint not in quiet)
    return tuple(
        law for law in every if law.drop >= least and not law.lags and law.lead_s < _LATEST
    )


def _best_law(evidence: Evidence, fitted: EvidenceFit, joint: str) -> ReversalLaw:
    """Return the law that misses least at a joint; one rival after the other asks for it."""
    known = evidence.cache.answers_of(evidence.runs, fitted)
    if joint not in known:
        known[joint] = _law_that_misses_least(evidence, fitted, joint)
    return known[joint]


def _law_that_misses_least(evidence: Evidence, fitted: EvidenceFit, joint: str) -> ReversalLaw:
    each = [_shaped(evidence, fitted, kind(joint)) for kind in (SmoothReversal, StraightReversal)]
    missed, column = min(each, key=lambda one: one[0])
    k, lead = column.shape
    at = fitted.model.robot.names.index(joint)
    own = float(fitted.model.friction_widths[at])
    words = f"reverses over {number(k * own, 2)} {fitted.model.robot.units[at]}/s"
    if abs(lead) >= _AT_ONCE:
        words += f", {number(1e3 * abs(lead), 2)} ms {'before' if lead > 0 else 'after'} the joint"
    fastest = max(float(np.percentile(np.abs(a), _USUAL)) for a in _accelerations(evidence, at))
    return ReversalLaw(
        column=column,
        drop=fitted.error_signal - missed,
        words=words,
        within=_TURNED * max(k, 1.0) * own + abs(lead) * fastest,
    )


def _accelerations(evidence: Evidence, at: int) -> list[np.ndarray]:
    return [run.replicates[0].a[:, at] for run in evidence.runs]


def _shaped(
    evidence: Evidence, fitted: EvidenceFit, column: SmoothReversal
) -> tuple[float, SmoothReversal]:
    """Return what is missed with the best shape of a law, and that law."""
    shapes = list(product(_WIDTHS, _LEADS))
    missed = missed_instead(evidence, fitted, [column.shaped(*shape) for shape in shapes])
    k, lead = shapes[int(np.argmin(missed))]

    def misses(x: np.ndarray) -> float:
        shape = float(np.exp(x[0])), float(x[1])
        return float(missed_instead(evidence, fitted, [column.shaped(*shape)])[0])

    start = np.array([np.log(k), lead])
    found = minimize(
        misses,
        start,
        method="Nelder-Mead",
        bounds=[tuple(np.log(_RANGE)), (-_LATEST, _LATEST)],
        options={
            "initial_simplex": start + np.array([[0.0, 0.0], [0.3, 0.0], [0.0, 5e-4]]),
            "maxfev": 40,
            "xatol": 1e-2,  # 1 % of the width; of the lead, what is missed decides
            "fatol": 0.5,
        },
    )
    return float(found.fun), column.shaped(float(np.exp(found.x[0])), float(found.x[1]))
