"""Other laws of dry friction: how it reverses is no finding, unless no law of it does as well.

The model's dry friction is Fc tanh(v / w). A joint's may go through zero along a line, over another
width, and sooner or later than its speed: a lag of friction behind speed is measured on machines
(Hess and Soom, ASME Journal of Tribology 112, 1990), a lead comes from how torque and position are
sampled, or from a simulator's constraint. And a drive that feeds noise into its torque dithers the
joint: the speed jitters, and dry friction is what it is in the mean over the jitter. What the model
then misses at its reversals, Stribeck friction, a delay or presliding would take off too. So
whatever is said to be missing at a joint with dry friction must explain more than any such law does
in the place of the model's.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import minimize

from dynident.diagnosis.nuisances.friction_width import missed_instead
from dynident.diagnosis.nuisances.other_reversals import (
    AT_ONCE,
    LATEST,
    LAWS,
    TURNED,
    OtherReversal,
)
from dynident.diagnosis.search.ranking import joints_below_noise, rank
from dynident.diagnosis.search.scores.score import Score
from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence, signal_by_joint
from dynident.model import Model, dry_joints

_STEP, _STEP_OF_RANGE = 0.3, 0.025
"""First steps of a search for a shape, of a logarithm or of the range."""
_USUAL = 99.0
"""Percentile of a joint's acceleration that counts as its highest."""
_AS_MUCH = 0.5
"""Share of what an effect explains that a law must explain at least, to stand in for it."""
_AT_MOST, _NOISE = 2.0, 3.0
"""Times what is left at a joint, and standard deviations of its noise, that a law may explain."""
_BETWEEN = 0.2
"""Part of what a law may explain, by which it may exceed its neighbours on the grid: 0.04 is the
most that was seen, of 264 searches for one."""


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

    column: OtherReversal
    drop: float
    words: str
    within: float

    @property
    def joint(self) -> str:
        """Where."""
        return str(self.column.joint)

    @property
    def lags(self) -> bool:
        """Whether it reverses after the joint."""
        return self.lead_s <= -AT_ONCE

    @property
    def lead_s(self) -> float:
        """By which it reverses before the joint."""
        return self.column.lead_s


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
    dry = [joint for joint in joints if joint in dry_joints(model)]
    gates = evidence.criteria.gates
    # What it explains more than they do must itself be worth an effect.
    least = (gates.later_share if added else gates.first_share) * fitted.error_total
    least = max(one.penalised - least, _AS_MUCH * one.penalised)
    found = _laws_at(evidence, fitted, dry, least)
    if sum(law.drop for law in found) < least:
        return ()
    beside = fit_evidence(evidence, fitted.model + tuple(law.column for law in found), fitted)
    again = rank(evidence, beside, added, only=(one.effect,)).passing
    if any(not _is_one_more_law(other.effect, model) for other in again):
        return ()  # it explains something else than they do
    return tuple(found)


def _is_one_more_law(effect: Effect, model: Model) -> bool:
    """Whether an effect that falls with the speed does so within that of a reversal.

    Such is Stribeck friction over a speed like the friction width.
    """
    if effect.joint is None or not effect.shape:
        return False
    at = model.robot.names.index(effect.joint)
    first, *_ = effect.shape_parameters(model.robot)
    is_speed = first.unit == f"{model.robot.units[at]}/s"
    return is_speed and effect.shape[0] <= TURNED * float(model.friction_widths[at])


def _laws_at(
    evidence: Evidence, fitted: EvidenceFit, joints: list[str], least: float
) -> list[ReversalLaw]:
    """Laws at joints that explain something; fewer where all of them are too little by far."""
    worth, most = 2.0 * np.log(fitted.rows), _at_most(evidence, fitted)
    found: dict[str, ReversalLaw] = {}
    waiting = sorted(joints, key=lambda one: -most[one])
    while waiting:
        hope = sum(most[joint] for joint in waiting)
        if sum(law.drop for law in found.values()) + hope < least:
            break
        joint = waiting.pop(0)
        others = sum(law.drop for law in found.values()) + sum(most[one] for one in waiting)
        law = _best_law(evidence, fitted, joint, least - others - _BETWEEN * most[joint])
        if law.drop > worth and abs(law.lead_s) < LATEST:
            found[joint] = law
    return [found[joint] for joint in joints if joint in found]


def _at_most(evidence: Evidence, fitted: EvidenceFit) -> dict[str, float]:
    """What a law at each joint may explain, squared residual, whitened.

    Estimated from what is left there, whose noise-free square is known to the noise of a sum of so
    many squares.
    """
    names = fitted.model.robot.names
    noise = _NOISE * np.sqrt(2.0 * fitted.rows / len(names))
    left = _AT_MOST * (np.clip(signal_by_joint(evidence, fitted), 0.0, None) + noise)
    return dict(zip(names, left.tolist(), strict=True))


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
    quiet, most = joints_below_noise(evidence, fitted), _at_most(evidence, fitted)
    dry = (joint for joint in dry_joints(fitted.model) if joint not in quiet)
    every = (_best_law(evidence, fitted, one, least - _BETWEEN * most[one]) for one in dry)
    return tuple(law for law in every if law.drop >= least and not law.lags and law.lead_s < LATEST)


def _best_law(
    evidence: Evidence, fitted: EvidenceFit, joint: str, least: float = -np.inf
) -> ReversalLaw:
    """Return the law that misses least at a joint; the grid's where that drops less than `least`.

    One rival after the other asks for it.
    """
    known = evidence.cache.answers_of(evidence.runs, fitted)
    on_grid, sought = (joint, "on the grid"), (joint, "sought")
    if on_grid not in known:
        known[on_grid] = [_of_the_grid(evidence, fitted, kind(joint)) for kind in LAWS]
    drop = fitted.error_signal - min(missed for missed, _ in known[on_grid])
    if drop < least:
        return _that_misses_least(evidence, fitted, known[on_grid])
    if sought not in known:
        near = [_sought(evidence, fitted, column) for _, column in known[on_grid]]
        known[sought] = _that_misses_least(evidence, fitted, near)
    return known[sought]


def _that_misses_least(
    evidence: Evidence, fitted: EvidenceFit, each: list[tuple[float, OtherReversal]]
) -> ReversalLaw:
    # One that wants more than the latest moment is none, and must not hide another.
    laws = [one for one in each if abs(one[1].lead_s) < LATEST]
    missed, column = min(laws or each, key=lambda one: one[0])
    at = fitted.model.robot.names.index(str(column.joint))
    own = float(fitted.model.friction_widths[at])
    fastest = max(float(np.percentile(np.abs(a), _USUAL)) for a in _accelerations(evidence, at))
    return ReversalLaw(
        column=column,
        drop=fitted.error_signal - missed,
        words=column.in_words(own, f"{fitted.model.robot.units[at]}/s"),
        within=own * column.turned(fastest / own),
    )


def _accelerations(evidence: Evidence, at: int) -> list[np.ndarray]:
    return [run.replicates[0].a[:, at] for run in evidence.runs]


def _of_the_grid(
    evidence: Evidence, fitted: EvidenceFit, column: OtherReversal
) -> tuple[float, OtherReversal]:
    """Return what is missed with the best shape of a law's grid, and that law."""
    wanted = column.shape_parameters(fitted.model.robot)
    shaped = [column.shaped(*shape) for shape in product(*(one.grid for one in wanted))]
    missed = missed_instead(evidence, fitted, shaped)
    best = int(np.argmin(missed))
    return float(missed[best]), shaped[best]


def _sought(
    evidence: Evidence, fitted: EvidenceFit, column: OtherReversal
) -> tuple[float, OtherReversal]:
    """Return what is missed with the best shape near a law's, and that law."""
    wanted = column.shape_parameters(fitted.model.robot)

    def at(x: np.ndarray) -> OtherReversal:
        return column.shaped(*(one.at(float(c)) for one, c in zip(wanted, x, strict=True)))

    def misses(x: np.ndarray) -> float:
        return float(missed_instead(evidence, fitted, [at(x)])[0])

    start = np.array([one.coordinate(x) for one, x in zip(wanted, column.shape, strict=True)])
    steps = np.diag([_STEP if one.lower > 0 else _STEP_OF_RANGE for one in wanted])
    found = minimize(
        misses,
        start,
        method="Nelder-Mead",
        options={
            "initial_simplex": start + np.vstack([np.zeros(len(wanted)), steps]),
            "maxfev": 40,
            "xatol": 1e-2,
            "fatol": 0.5,
        },
    )
    return float(found.fun), at(found.x)
