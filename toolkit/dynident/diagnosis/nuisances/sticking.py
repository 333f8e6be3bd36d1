"""Joints that stick: reversals at which nothing tells the dry friction.

While a joint stands, its dry friction is whatever the other torques ask for, and no function of its
speed. A joint sticks at its reversals where dry friction is sharp; then it also turns around within
the noise of its speed, so that even the sign of its friction is not known. What the model misses
there would be called Stribeck friction, a delay or elasticity. So these rows of that joint say
nothing, of the model or of what it lacks.

A joint counts as sticking if it is seen to stand (within the noise of its speed, for longer than it
takes to pass through zero), or if the friction width that the data call for is below that noise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy

from dynident.criteria import StickingCriteria
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.runs import Run
from dynident.fitting.sampling import Sampled
from dynident.model import Model
from dynident.recording.filters import butterworth
from dynident.recording.white_noise import encoder_noise_std
from dynident.tables import percent

_FREQUENCIES = 4096  # at which a filter's response is taken


def without_sticking(
    evidence: Evidence, held: Evidence | None, fitted: EvidenceFit
) -> tuple[Evidence, Evidence | None]:
    """Leave out the reversals of joints that stick.

    Parameters
    ----------
    evidence, held : the training and the test recordings; `held` may be None.
    fitted : the model as it fits the training recordings, with the friction widths that they call
        for.

    Returns
    -------
    Both, without the rows of these joints around their reversals; the same objects where no joint
    sticks, or the reversals of all that do are left out already.
    """
    joints = sticking_joints(evidence, fitted)
    known = _left_out(evidence)
    if set(joints) <= set(known):
        return evidence, held
    every = (*known, *(joint for joint in joints if joint not in known))
    return without_reversals(evidence, every), held and without_reversals(held, every)


def _left_out(evidence: Evidence) -> tuple[str, ...]:
    """Return the joints whose reversals are left out."""
    certain = np.all(np.concatenate([run.certain_rows for run in evidence.runs]), axis=0)
    names = evidence.model.robot.names
    return tuple(joint for joint, whole in zip(names, certain.tolist(), strict=True) if not whole)


def sticking_joints(evidence: Evidence, fitted: EvidenceFit) -> tuple[str, ...]:
    """Return the names of the joints that stick at their reversals.

    Parameters
    ----------
    evidence, fitted : as for `without_sticking`.

    Returns
    -------
    In the order of the robot's joints; only those with dry friction in the model. None where the
    study asks for every row (`Filter.ends` is "keep").
    """
    if any(run.replicates[0].parallel.filter.ends == "keep" for run in evidence.runs):
        return ()  # a published recipe uses every row
    criteria, nuisances = evidence.criteria.sticking, evidence.criteria.nuisances
    model, given = fitted.model, evidence.model
    noise = np.max([speed_noise(run.replicates[0]) for run in evidence.runs], axis=0)
    bound = nuisances.at_bound * nuisances.narrowest_width * np.array(given.friction_widths)
    resolved = np.maximum(criteria.resolved * noise, bound)
    return tuple(
        joint
        for j, joint in enumerate(model.robot.names)
        if f"coulomb_friction@{joint}" in model.slices
        and (model.friction_widths[j] <= resolved[j] or _stands(evidence, j, criteria))
    )


def without_reversals(evidence: Evidence, joints: tuple[str, ...]) -> Evidence:
    """Return the evidence without the rows of these joints around their reversals, no others."""
    model, criteria = evidence.model, evidence.criteria.sticking
    return evidence.with_runs(
        tuple(_without_reversals(run, model, joints, criteria) for run in evidence.runs)
    )


def sticking_notes(evidence: Evidence) -> tuple[str, ...]:
    """Joints that stick, and how many of their rows that makes useless, in plain words."""
    if all(run.uncertain is None for run in evidence.runs):
        return ()
    uncertain = ~np.concatenate([run.certain_rows for run in evidence.runs])
    return tuple(
        f"{joint} stands still at many of its stops, or its dry friction reverses within the noise "
        f"of its speed: no data tell that friction, and {percent(share, 0)} of the joint's rows, "
        "those around its stops, count neither in the fit nor in the errors."
        for joint, share in zip(evidence.model.robot.names, uncertain.mean(axis=0), strict=True)
        if share
    )


def _without_reversals(
    run: Run, model: Model, joints: tuple[str, ...], criteria: StickingCriteria
) -> Run:
    sampled = run.replicates[0]
    uncertain = np.zeros(sampled.v.shape, dtype=bool)
    for joint in joints:
        j = model.robot.names.index(joint)
        v = sampled.motion.v[:, j]
        # Around a reversal the speed is off by what the position's low-pass rounds.
        rounded = criteria.rounded * float(np.sqrt(np.mean(v**2)))
        reach = max(criteria.noise * speed_noise(sampled)[j], rounded)
        near = sampled.filtered((np.abs(v) < reach).astype(float))
        rows = np.abs(near) > criteria.spread
        # What is left must say something.
        uncertain[:, j] = rows if np.mean(rows) <= criteria.most else False
    return replace(run, uncertain=uncertain)


def _stands(evidence: Evidence, j: int, criteria: StickingCriteria) -> bool:
    """Whether a joint is seen to stand at many of its stops."""
    stops = [
        stop
        for run in evidence.runs
        for stop in _stops(
            run.replicates[0].motion.v[:, j], criteria.noise * speed_noise(run.replicates[0])[j]
        )
    ]
    longer = sum(within > criteria.longer * around for within, around in stops)
    return longer >= max(criteria.stops, criteria.stops_share * len(stops))


def _stops(v: np.ndarray, reach: float) -> Iterator[tuple[int, int]]:
    """Samples of each stop within a speed, and between that and three times as much."""
    wide, narrow = np.abs(v) < 3.0 * reach, np.abs(v) < reach
    edges = np.diff(np.concatenate([[0], wide.astype(int), [0]]))
    for start, stop in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        within = int(np.count_nonzero(narrow[start:stop]))
        if within:
            yield within, int(stop - start) - within


def speed_noise(sampled: Sampled) -> np.ndarray:
    """Standard deviation of the noise in a recording's speed, (n,) rad/s or m/s.

    White noise of the encoders, through the low-pass of the positions and the central difference.
    """
    rate = sampled.motion.rate_hz
    angle = np.linspace(0.0, np.pi, _FREQUENCIES)
    gain = np.sin(angle) * rate
    cutoff = sampled.parallel.filter.position_cutoff_hz
    if cutoff:
        _, response = scipy.signal.sosfreqz(butterworth(rate, cutoff), angle)
        gain = gain * np.abs(response) ** 2
    share = float(np.sqrt(np.trapezoid(gain**2, angle) / np.pi))
    return encoder_noise_std(sampled.recording.q) * share
