"""How large an effect could have been and not been found: what "nothing is missing" is worth.

The standard deviations of an effect's values and the gates say which values would have passed, and
its columns which torque these make. What is quoted is the largest torque of those that would have
passed just so, whatever the proportions of several values.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import special

from dynident.diagnosis.details import place
from dynident.diagnosis.search.ranking import Ranking
from dynident.diagnosis.search.scores.score import Score
from dynident.diagnosis.search.scores.scoring import price
from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.held_out import HeldOut
from dynident.tables import Table, number

POWER = 0.95
"""Chance that noise leaves an effect of this size above a gate."""


@dataclass(frozen=True, kw_only=True)
class DetectionLimit:
    """The torque of an effect at a joint from which it would have been found.

    Attributes
    ----------
    effect : with the shape at which it does best.
    at : the joint.
    torque_rms : over the recorded motion, N m or N.
    torque_unit : which of them.
    """

    effect: Effect
    at: str
    torque_rms: float
    torque_unit: str

    def to_dict(self) -> dict[str, str | float | None]:
        """As `--json` has it."""
        return {**place(self.effect), "at": self.at, "torque_rms": self.torque_rms}


def detection_limits(
    evidence: Evidence,
    held: Evidence | None,
    fitted: EvidenceFit,
    ranking: Ranking,
    trained: HeldOut,
) -> tuple[DetectionLimit, ...]:
    """Return how large each candidate could have been without passing the gates.

    Parameters
    ----------
    evidence, held : of the training and of the test recordings; `held` may be None.
    fitted : the model that was said to be complete.
    ranking : of the candidates on that model.
    trained : what it leaves of the training recordings.

    Returns
    -------
    One for each effect that the data can show: of an effect at a joint, of the torque there; of one
    of the whole robot, at each joint at which it acts.
    """
    robot, found = fitted.model.robot, []
    beside_steps = _deviations_beside_steps(trained, fitted)
    share = 1.0 if held is None else _rows(held) / _rows(evidence)
    for one in ranking.scores:
        if one.rank == 0 or one.covariance is None:
            continue
        deviations = max(
            _deviations_to_pass(one, fitted, ranking.tests), _deviations_to_stay(one, fitted, share)
        )
        for joint, squares in zip(
            one.effect.acting_at(robot), _mean_squares(one, evidence, fitted), strict=True
        ):
            largest = float(np.linalg.eigvals(one.covariance @ squares).real.max())
            torque = max(deviations, beside_steps[joint]) * np.sqrt(max(largest, 0.0))
            name, unit = robot.names[joint], robot.torque_units[joint]
            # What an effect at another joint makes here is no limit of one that is here.
            elsewhere = one.effect.joint not in (None, name)
            if np.isfinite(torque) and torque > 0 and not elsewhere:
                found.append(
                    DetectionLimit(effect=one.effect, at=name, torque_rms=torque, torque_unit=unit)
                )
    return tuple(found)


def _deviations_beside_steps(trained: HeldOut, fitted: EvidenceFit) -> np.ndarray:
    """Standard deviations at which an effect is no longer taken for encoders' steps, by joint.

    Zero where these were not looked at: then what is left is the noise.
    """
    if trained.rounding is None or trained.noise_std is None:
        return np.zeros(fitted.model.robot.n)
    power = trained.rounding / np.where(trained.noise_std > 0, trained.noise_std, np.inf) ** 2
    rows = fitted.rows / fitted.model.robot.n
    return np.sqrt(rows * (power + fitted.criteria.verdict.within_noise**2))


def _deviations_to_stay(one: Score, fitted: EvidenceFit, share: float) -> float:
    """Standard deviations at which an effect lowers the test residual, and by enough to be kept.

    With a share of the rows, the test recordings know it so much less well. Noise changes the fall
    of a squared residual by twice its own standard deviation times the effect's norm.
    """
    joints = len(one.effect.acting_at(fitted.model.robot)) / fitted.model.robot.n
    rows = share * fitted.rows * joints
    least = fitted.criteria.search.least_fall * rows
    chance = float(special.ndtri(POWER))
    return float(max(np.sqrt(least) + chance, 2.0 * chance) / np.sqrt(share))


def _rows(evidence: Evidence) -> int:
    return sum(run.index.size for run in evidence.runs)


def _deviations_to_pass(one: Score, fitted: EvidenceFit, tests: int) -> float:
    """Standard deviations at which an effect passes every gate, in a share `POWER` of cases."""
    gates, robot = fitted.criteria.gates, fitted.model.robot
    blocks, rank = len(fitted.moments.signal), one.rank
    wald = np.inf
    if blocks > rank + 1:
        # Of the test that takes blocks of time as its sampling units, corrected for all tests.
        quantile = float(special.fdtri(rank, blocks - rank, 1.0 - gates.level / max(tests, 1)))
        wald = quantile * rank * (blocks - 1) / (blocks - rank)
    worth = float(price(fitted, one.effect, rank, len(tuple(one.effect.variants(robot)))))
    share = max(gates.first_share, gates.least_gain)
    least = max(wald, worth, share / (1.0 - share) * fitted.error_total)
    return float(np.sqrt(least) + special.ndtri(POWER))


def _mean_squares(one: Score, evidence: Evidence, fitted: EvidenceFit) -> np.ndarray:
    """Mean products of an effect's columns at each joint where it acts, (J, k, k)."""
    products, rows = 0.0, 0
    for r, (each,) in enumerate(evidence.first_look([one.effect], fitted.model, fitted.values)):
        if one.payload_recordings is not None and not one.payload_recordings[r]:
            continue
        for signal in each:
            used = signal[evidence.runs[r].kept]
            products = products + np.einsum("tjk,tjl->jkl", used, used)
            rows += len(used)
    return np.asarray(products) / max(rows, 1)


def limit_table(limits: tuple[DetectionLimit, ...]) -> Table:
    """What would have been found: a row for each kind of effect, a column for each joint."""
    joints = tuple(dict.fromkeys(one.at for one in limits))
    kinds: dict[str, dict[str, float]] = {}
    for one in limits:
        at = kinds.setdefault(one.effect.name, {})
        # Of several of one kind at a joint (one for each source), the one that is seen last.
        at[one.at] = max(at.get(one.at, 0.0), one.torque_rms)
    rows = tuple(
        (name.replace("_", " "), *(number(at.get(joint), 2) for joint in joints))
        for name, at in sorted(kinds.items())
    )
    units = {joint: _unit(limits, joint) for joint in joints}
    shared, columns = "", tuple(f"{joint}, {unit}" for joint, unit in units.items())
    if len(set(units.values())) == 1:
        shared, columns = f", {units[joints[0]]}", joints
    dashes = any(set(joints) - set(at) for at in kinds.values())
    return Table(
        f"What would have been found: torque (rms{shared}) from which each effect passes the gates",
        ("effect", *columns),
        rows,
        (
            largest_in_words(limits),
            *(("A dash: not looked for there, or nothing that this motion could show.",) * dashes),
            "Along the recorded motion: others show less or more of an effect. The noise of a "
            "single recording moves a limit by up to a third. The limit of an effect with a shape "
            "(the speed of Stribeck friction, the period of a ripple) is that of the shape that "
            "shows best: with another shape, a larger effect may stay unseen.",
        ),
    )


def largest_in_words(limits: tuple[DetectionLimit, ...]) -> str:
    """The largest limit at each joint, as a sentence."""
    parts = []
    for joint in dict.fromkeys(one.at for one in limits):
        last = max((one for one in limits if one.at == joint), key=lambda one: one.torque_rms)
        kind = last.effect.name.replace("_", " ")
        parts.append(f"{number(last.torque_rms, 2)} {last.torque_unit} at {joint} ({kind})")
    return (
        f"Nothing larger was detected than {', '.join(parts)}: in brackets the effect that is seen "
        "last, of others less would have been."
    )


def _unit(limits: tuple[DetectionLimit, ...], joint: str) -> str:
    return next(one.torque_unit for one in limits if one.at == joint)
