"""The friction width of each joint: the speed over which its dry friction reverses.

A drive that feeds encoder noise into its torque dithers the joint, and dithered dry friction is
wider than that of a robot without noise; so is friction seen through noisy velocities. And the
width that a study states may be wider or narrower than a joint's. Healthy robots would then be said
to lack something. So a joint whose data call for another width, by the same tests as for any
effect, is given the one that fits best; unless an effect that the model lacks at that joint, drag
say, explains more than any width.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.special import chdtri

from dynident.criteria import DEFAULTS
from dynident.diagnosis.search.candidate_shapes import reshaped
from dynident.diagnosis.search.ranking import rank
from dynident.diagnosis.search.scores.candidate_moments import candidate_moments
from dynident.effects import Block, Effect, JointEffect, Parameter, ShapeParameter, catalogue
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence, in_metric_of
from dynident.model import Model, dry_joints
from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import regression_values

_RIVALS = ("viscous_friction", "quadratic_drag")
_AROUND = np.array([0.2, 0.35, 0.6, 1.0, 1.7, 3.0])
"""Times a width that is found beside other dry friction, where both are sought together."""
_OTHER = 0.2
"""Change of such a width, as a logarithm, that sampling and noise of the drive do not make: less of
it has to be worth it by far."""
_CLEARLY = 3.0
"""Times its price that a width brings which is worth it by far: its profile needs no other fit."""


class FrictionWidthColumn(JointEffect):
    """What dry friction that reverses over k times the width has less: no loss at speed."""

    name = "friction_width"
    in_catalogue = False
    law = "Fc (tanh(v/(k w)) - tanh(v/w))"
    sign_of = "opposite spikes on both sides of zero velocity"
    experiment = "move {joint} with less noise in the drive"

    def parameters(self, robot):
        unit = robot.torque_units[robot.names.index(str(self.joint))]
        return (Parameter("Fc", unit, 0.0),)

    def shape_parameters(self, robot):
        grid = (0.1, 0.3, 2.0, 4.0, 8.0)
        # It only says whether another width is called for; which one, the profile says.
        own = DEFAULTS.nuisances
        lower, upper = own.narrowest_width, own.widest_width
        return (ShapeParameter("k", "1", grid, lower=lower, upper=upper),)

    def at_joint(self, block: Block) -> np.ndarray:
        v = block.v[:, [block.index(self.joint)]]
        return block.sign(v / self.shape[0], self.joint) - block.direction(self.joint)


@dataclass(frozen=True, eq=False)
class WidthProfile:
    """What the model misses with each width of one joint's dry friction, all else fitted anew.

    Attributes
    ----------
    evidence, fitted : the recordings, and the model with its width.
    joint : whose width it is.
    """

    evidence: Evidence
    fitted: EvidenceFit
    joint: str

    @property
    def width(self) -> float:
        """The model's own, rad/s or m/s."""
        model = self.fitted.model
        return float(model.friction_widths[model.robot.names.index(self.joint)])

    def _grid(self) -> np.ndarray:
        """Factors of the model's width, between the bounds that the given width sets."""
        given = self.evidence.model
        stated = float(given.friction_widths[given.robot.names.index(self.joint)])
        own = self.evidence.criteria.nuisances
        tried = np.geomspace(own.narrowest_width, own.widest_width, own.widths)
        return tried * stated / self.width

    def missed(self, factors: np.ndarray) -> np.ndarray:
        """Squared systematic residual, whitened, with widths that are so many times the model's."""
        column = FrictionWidthColumn(self.joint)
        shaped = [column.shaped(float(k)) for k in factors]
        return missed_instead(self.evidence, self.fitted, shaped)

    def best(self) -> tuple[float, float]:
        """Factor of the width that misses least, and what it misses."""
        grid = self._grid()
        missed = self.missed(grid)
        k = int(np.argmin(missed))
        low, high = grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
        found: Any = minimize_scalar(
            lambda x: self.missed(np.exp([x]))[0],
            bounds=(np.log(low), np.log(high)),
            method="bounded",
            options={"xatol": 1e-2, "maxiter": 20},
        )
        if found.fun < missed[k]:
            return float(np.exp(found.x)), float(found.fun)
        return float(grid[k]), float(missed[k])

    def interval(self) -> tuple[float, float]:
        """95 % interval of the width by its profile; zero or infinity where that has no end."""
        grid = self._grid()
        least = float(self.missed(np.ones(1))[0])
        limit = least + float(chdtri(1, 0.05))

        def excess(x: float) -> float:
            return float(self.missed(np.exp([x]))[0]) - limit

        above = self.missed(grid) > limit
        lower, upper = 0.0, np.inf
        below_one, over_one = grid[(grid < 1) & above], grid[(grid > 1) & above]
        if len(below_one):
            lower = self.width * math.exp(_root(excess, float(np.log(below_one[-1])), 0.0))
        if len(over_one):
            upper = self.width * math.exp(_root(excess, 0.0, float(np.log(over_one[0]))))
        return lower, upper


def missed_instead(
    evidence: Evidence, fitted: EvidenceFit, laws: Sequence[JointEffect]
) -> np.ndarray:
    """Squared systematic residual, whitened, with other dry friction instead of the model's.

    Parameters
    ----------
    evidence, fitted : the recordings, and the model as it fits them.
    laws : one effect at one joint, with any number of shapes: what dry friction of another law has
        more than the model's.

    Returns
    -------
    One for each; all parameters are fitted anew.
    """
    at = fitted.model.slices[f"coulomb_friction@{laws[0].joint}"].start
    known, reliable = fitted.pooled, fitted.criteria.noise.reliable
    found = []
    for each, alone in candidate_moments(evidence, fitted, laws):
        beside, own = each.pooled(), alone.pooled()
        products = [
            _widened(whole, cross[:, 0], square[0, 0], at)
            for whole, cross, square in (
                (known.total, beside.total, own.total),
                (known.signal, beside.signal, own.signal),
            )
        ]
        moments = SecondMoments(products[0], known.counts, None, products[1])
        combination = np.append(-regression_values(moments, reliable), 1.0)
        found.append(float(combination @ moments.signal @ combination))
    return np.array(found)


def _root(excess: Callable[[float], float], low: float, high: float) -> float:
    """Where a profile crosses its limit, to 1 %."""
    found: Any = brentq(excess, low, high, xtol=1e-2)
    return float(found)


def _widened(products: np.ndarray, cross: np.ndarray, square: float, at: int) -> np.ndarray:
    """Products of columns of which one has another column added to it."""
    found = products.copy()
    found[at, :] += cross
    found[:, at] += cross
    found[at, at] += square
    return found


def with_friction_width(evidence: Evidence, fitted: EvidenceFit) -> EvidenceFit:
    """Return the fit with another friction width at the joints where the data call for it.

    Parameters
    ----------
    evidence : the training recordings.
    fitted : the model as it fits them.

    Returns
    -------
    As it is where no joint calls for another width, or none fits better.
    """
    robot = fitted.model.robot
    dry = [str(e.joint) for e in fitted.model.effects if e.name == "coulomb_friction"]
    fitted = _reconsidered(evidence, fitted)
    wanted = tuple(FrictionWidthColumn(joint).on(robot) for joint in dry)
    if not wanted:
        return fitted
    for score in rank(evidence, fitted, 0, only=wanted, least=0.0).passing:
        joint = str(score.effect.joint)
        factor, missed = WidthProfile(evidence, fitted, joint).best()
        drop = fitted.error_signal - missed - _price(fitted)
        if drop <= 0 or drop < _best_rival(evidence, fitted, joint):
            continue
        width = factor * WidthProfile(evidence, fitted, joint).width
        model = fitted.model.with_friction_width(joint, width)
        other = fit_evidence(evidence, model, fitted)
        # The profile holds Coulomb friction alone: other friction at the joint has the width too.
        if _drop(evidence, fitted, other) > _price(fitted):
            fitted = other
    for joint in dry:
        fitted = _with_shapes(evidence, fitted, joint)
    return fitted


def at_best_widths(evidence: Evidence, fitted: EvidenceFit, joints: Collection[str]) -> EvidenceFit:
    """Return the fit with the friction widths that fit best, whether or not they are worth it.

    Noise that a stiff loop feeds into the drive dithers friction over as much as its speeds,
    however narrow the stated width.

    Parameters
    ----------
    evidence : the training recordings.
    fitted : the model as it fits them.
    joints : whose widths; those without dry friction stay.

    Returns
    -------
    As it is where no other width fits better.
    """
    model, own = fitted.model, evidence.criteria.nuisances
    speed = np.concatenate([one.v for run in evidence.runs for one in run.replicates])
    for joint, stated, usual in zip(
        model.robot.names, evidence.model.friction_widths, np.std(speed, axis=0), strict=True
    ):
        if joint not in joints or joint not in dry_joints(model):
            continue
        profile = WidthProfile(evidence, fitted, joint)
        widest = max(own.widest_width * stated, usual)
        tried = np.geomspace(own.narrowest_width * stated, widest, 2 * own.widths)
        missed = profile.missed(tried / profile.width)
        if missed.min() < fitted.error_signal:
            model = model.with_friction_width(joint, float(tried[np.argmin(missed)]))
    return fitted if model is fitted.model else fit_evidence(evidence, model, fitted)


def _with_shapes(evidence: Evidence, fitted: EvidenceFit, joint: str) -> EvidenceFit:
    """The fit with another width at one joint, sought together with other dry friction's shapes.

    Stribeck friction many times too large takes the part of a narrower width: with either held the
    other has its best value, and both are wrong. So do shapes that are speeds, and no others.
    """
    model, robot = fitted.model, fitted.model.robot
    own, at = evidence.criteria.nuisances, robot.names.index(joint)
    width, stated = model.friction_widths[at], evidence.model.friction_widths[at]
    labels = [
        e.label
        for e in model.effects
        if e.joint == joint and e.reverses and not (e.needs_recording or e.time_varying)
        if any(shape.unit == f"{robot.units[at]}/s" for shape in e.shape_parameters(robot))
    ]
    if not labels:
        return fitted
    tried: dict[float, EvidenceFit] = {}

    def missed(x: float) -> float:
        trial = fit_evidence(evidence, model.with_friction_width(joint, float(np.exp(x))), fitted)
        for label in labels:
            effect = trial.model.effect(label)
            others = fit_evidence(evidence, trial.model - effect, trial)
            better = reshaped(evidence, others, trial, effect).effect
            trial = fit_evidence(evidence, trial.model.with_shapes((better,)), trial)
        found = in_metric_of(evidence, trial, fitted).error_signal
        tried[found] = trial
        return found

    grid = np.log(width * _AROUND)
    grid = grid[(grid > np.log(own.narrowest_width * stated)) | (_AROUND == 1.0)]
    values = [missed(x) for x in grid]
    k = int(np.argmin(values))
    bounds = (grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)])
    minimize_scalar(missed, bounds=bounds, method="bounded", options={"xatol": 0.02, "maxiter": 12})
    # The width has to bring it: the shapes alone may have been short of their best.
    best, same = min(tried), values[int(np.argmin(np.abs(grid - np.log(width))))]
    change = abs(np.log(tried[best].model.friction_widths[at] / width))
    price = _price(fitted) * (1.0 if change > _OTHER else _CLEARLY)
    if min(same, fitted.error_signal) - best > price:
        return tried[best]
    return tried[same] if fitted.error_signal - same > _price(fitted) else fitted


def _price(fitted: EvidenceFit) -> float:
    """What a width must explain more than another, squared residual, whitened."""
    return 2.0 * float(np.log(fitted.rows))


def _drop(evidence: Evidence, fitted: EvidenceFit, other: EvidenceFit) -> float:
    """How much less another fit misses, whitened by the noise of the first.

    Each by its own noise would say nothing where nothing tells the noise from the residual.
    """
    return fitted.error_signal - in_metric_of(evidence, other, fitted).error_signal


def _reconsidered(evidence: Evidence, fitted: EvidenceFit) -> EvidenceFit:
    """Return the fit with the stated width where one found before is not worth its price any more.

    While an effect is missing a width may have taken its part. Both are fitted: other friction at
    the joint has the same width, which a profile of Coulomb friction's leaves as it is.
    """
    robot, given = fitted.model.robot, evidence.model.friction_widths
    now = fitted.model.friction_widths
    for joint, stated, width in zip(robot.names, given, now, strict=True):
        if width == stated:
            continue
        model = fitted.model.with_friction_width(joint, float(stated))
        if _is_worth_it(evidence, fitted, model, joint):
            continue
        back = fit_evidence(evidence, model, fitted)
        if _drop(evidence, back, fitted) <= _price(fitted):
            fitted = back
    return fitted


def _is_worth_it(evidence: Evidence, fitted: EvidenceFit, other: Model, joint: str) -> bool:
    """Whether a joint's width is worth its price by far, over that of another model.

    A fit of that model shows it in any case, and takes long where columns depend on the fit. The
    profile takes these as they are, and has another width of Coulomb friction alone.
    """
    label, model = f"coulomb_friction@{joint}", fitted.model
    others = (e for e in model.effects if e.label != label and not e.is_dynamic_response)
    alone = all(model.known_by(one) == other.known_by(one) for one in others)
    if not (alone and fitted.noise_known and label in model.slices):
        return False
    profile = WidthProfile(evidence, fitted, joint)
    factor = float(other.friction_widths[model.robot.names.index(joint)]) / profile.width
    missed = profile.missed(np.array([factor]))[0]
    return bool(missed - fitted.error_signal > _CLEARLY * _price(fitted))


def _best_rival(evidence: Evidence, fitted: EvidenceFit, joint: str) -> float:
    """What the best effect that the model lacks at a joint explains there, less its price."""
    robot = fitted.model.robot
    rivals = tuple(_at(name, joint).on(robot) for name in _RIVALS)
    rivals = tuple(effect for effect in rivals if effect not in fitted.model)
    if not rivals:
        return -np.inf
    passing = rank(evidence, fitted, 0, only=rivals, least=0.0).passing
    return max((one.penalised for one in passing), default=-np.inf)


def _at(name: str, joint: str) -> Effect:
    return catalogue()[name](joint)
