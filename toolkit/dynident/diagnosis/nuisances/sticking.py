"""Joints that stick: reversals at which nothing tells the dry friction.

While a joint stands, its dry friction is whatever the other torques ask for, and no function of its
speed. A joint sticks at its reversals where dry friction is sharp; then it also turns around within
the noise of its speed, so that even the sign of its friction is not known. What the model misses
there would be called Stribeck friction, a delay or elasticity. So these rows of that joint say
nothing, of the model or of what it lacks.

A joint counts as sticking if it is seen to stand (within the noise of its speed, for longer than it
takes to pass through zero), if the friction width that the data call for is below that noise, or if
commands are held and many of its reversals fall between two samples: what a held command meets
until the next one is the mean of a friction that reverses there, and no friction of the mean speed.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from dynident.criteria import StickingCriteria
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.runs import Run
from dynident.fitting.reversals.joint_speeds import JointSpeeds
from dynident.fitting.reversals.standing_joints import (
    few_enough,
    left_out_words,
    near_stops,
    resting,
    stands,
)
from dynident.model import dry_joints
from dynident.tables import listed

NearStop = Callable[[Evidence, Run, int, float], np.ndarray]


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
    known = left_out_at(evidence)
    if set(joints) <= set(known):
        return evidence, held
    every = (*known, *(joint for joint in joints if joint not in known))
    return without_reversals(evidence, every), held and without_reversals(held, every)


def sticking_joints(evidence: Evidence, fitted: EvidenceFit) -> tuple[str, ...]:
    """Return the names of the joints that stick at their reversals.

    Parameters
    ----------
    evidence, fitted : as for `without_sticking`.

    Returns
    -------
    In the order of the robot's joints; only those with dry friction in the model, of which enough
    rows are left. None where the study asks for every row (`Filter.ends` is "keep").
    """
    if every_row_is_asked_for(evidence):
        return ()
    criteria, nuisances = evidence.criteria.sticking, evidence.criteria.nuisances
    model, given = fitted.model, evidence.model
    every = [_speeds(evidence, run) for run in evidence.runs]
    noise, standing = np.max([one.noise for one in every], axis=0), stands(every, criteria)
    bound = nuisances.at_bound * nuisances.narrowest_width * np.array(given.friction_widths)
    resolved = np.maximum(criteria.resolved * noise, bound)
    return tuple(
        joint
        for j, joint in enumerate(model.robot.names)
        if joint in dry_joints(model)
        and (
            model.friction_widths[j] <= resolved[j]
            or standing[j]
            or _between_samples(evidence, j, model.friction_widths[j], criteria)
        )
        and _may_leave_out(evidence, j)
    )


def every_row_is_asked_for(evidence: Evidence) -> bool:
    """Whether the study asks for every row, as a published recipe does."""
    return any(run.replicates[0].parallel.filter.ends == "keep" for run in evidence.runs)


def without_reversals(
    evidence: Evidence, joints: tuple[str, ...], within: Mapping[str, float] | None = None
) -> Evidence:
    """Return the evidence without the rows of these joints around their reversals.

    With those that the low-pass of the positions has rounded, where a joint is seen to stand and
    enough rows are left. All rows of a joint stay of which these recordings would leave too few;
    what was left out before stays so.

    Parameters
    ----------
    evidence : as for `without_sticking`.
    joints : names.
    within : rad/s or m/s, for some of them: speed within which their dry friction is not known,
        where that is more than the noise of the speed.
    """
    names, reach = evidence.model.robot.names, within or {}
    columns = [(names.index(joint), reach.get(joint, 0.0)) for joint in joints]
    wide = _may_widen(evidence, columns)
    columns = [
        (j, least)
        for j, least in columns
        if j in wide or _may_leave_out(evidence, j, least) or _rests(evidence, j)
    ]
    runs = []
    for run in evidence.runs:
        uncertain = ~run.certain_rows
        for j, least in columns:
            near_stop = _near_rounded if j in wide else _near_stops
            uncertain[:, j] |= near_stop(evidence, run, j, least)
        runs.append(replace(run, uncertain=uncertain))
    return evidence.with_runs(tuple(runs))


def seen_alike(
    others: Sequence[Evidence],
    evidence: Evidence,
    within: Mapping[str, float] | None = None,
    joint: str | None = None,
) -> tuple[Evidence, ...]:
    """Return the same recordings behind other filters, without the same reversals.

    The lower a cut-off, the more rows a reversal takes with it. Where too few would be left they
    stay in, and these are not the same recordings seen through another filter: they are dropped.

    Parameters
    ----------
    others : recordings of the evidence behind other filters.
    evidence : which leaves reversals out.
    within : as of `without_reversals`.
    joint : whose rows must be the same; None for those of all joints.
    """
    joints = left_out_at(evidence)
    same = {one for one in joints if joint in (None, one)}
    wide = same & _widened(evidence, joints, within)
    return tuple(
        without_reversals(one, joints, within)
        for one in others
        if wide == same & _widened(one, joints, within)
        and same <= set(left_out_at(without_reversals(one, joints, within)))
    )


def left_out_at(evidence: Evidence) -> tuple[str, ...]:
    """Return the joints whose reversals are left out."""
    certain = np.all(np.concatenate([run.certain_rows for run in evidence.runs]), axis=0)
    names = evidence.model.robot.names
    return tuple(joint for joint, whole in zip(names, certain.tolist(), strict=True) if not whole)


def shares_left_out(evidence: Evidence) -> dict[str, float]:
    """Return the share of rows around its reversals that is left out, for joints that have any."""
    shares = 1.0 - np.concatenate([run.certain_rows for run in evidence.runs]).mean(axis=0)
    every = zip(evidence.model.robot.names, shares.tolist(), strict=True)
    return {joint: share for joint, share in every if share > 0}


def sticking_notes(evidence: Evidence, others: Collection[str] = ()) -> tuple[str, ...]:
    """Joints that stick, and how many of their rows that makes useless, in plain words.

    Parameters
    ----------
    evidence : of the training recordings.
    others : joints whose rows are left out for another reason.
    """
    shares = {j: s for j, s in shares_left_out(evidence).items() if j not in others}
    if not shares:
        return ()
    stand, their = ("stands", "its") if len(shares) == 1 else ("stand", "their")
    return (
        f"{listed(list(shares))} {stand} still at many of {their} stops, or {their} dry friction "
        f"reverses within the noise of {their} speed or within a held command: "
        f"{left_out_words(shares)} Backlash, presliding or whatever else acts there alone would "
        "not be seen.",
    )


def _widened(
    evidence: Evidence, joints: Collection[str], within: Mapping[str, float] | None
) -> set[str]:
    """Joints of which rows that are rounded go, too."""
    names, reach = evidence.model.robot.names, within or {}
    columns = [(names.index(joint), reach.get(joint, 0.0)) for joint in joints]
    return {names[j] for j in _may_widen(evidence, columns)}


def _may_widen(evidence: Evidence, columns: Sequence[tuple[int, float]]) -> list[int]:
    """Which joints are seen to stand, and have enough rows without those that are rounded.

    Parameters
    ----------
    evidence : of the recordings.
    columns : numbers of joints, each with the speed within which its friction is not known.
    """
    if not columns:
        return []
    every = [_speeds(evidence, run) for run in evidence.runs]
    stood = stands(every, evidence.criteria.sticking)
    return [j for j, least in columns if stood[j] and _are_few(evidence, j, least, _near_rounded)]


def _may_leave_out(evidence: Evidence, j: int, least: float = 0.0) -> bool:
    """Whether enough of a joint's rows are left without its reversals."""
    return _are_few(evidence, j, least, _near_stops)


def _are_few(evidence: Evidence, j: int, least: float, near_stop: NearStop) -> bool:
    near, rest = [np.zeros(0, dtype=bool)], [np.zeros(0, dtype=bool)]
    for run in evidence.runs:
        near.append(np.any(near_stop(evidence, run, j, least)[run.index], axis=0))
        rest.append(np.all(_resting(evidence, run)[:, j][run.index], axis=0))
    both, at_rest = (np.concatenate(one)[:, None] for one in (near, rest))
    return bool(few_enough(both, at_rest, evidence.criteria.sticking)[0])


def _rests(evidence: Evidence, j: int) -> bool:
    """Whether a joint rests throughout the recordings."""
    return all(bool(_resting(evidence, run)[:, j].all()) for run in evidence.runs)


def _resting(evidence: Evidence, run: Run) -> np.ndarray:
    """Rows of joints that rest, (T, n) mask; asked for with every model."""
    sampled = run.replicates[0]
    known, kept = evidence.cache.along(sampled.motion), sampled.kept
    key = ("resting", kept.start, kept.stop)
    if key not in known:
        known[key] = resting(sampled)
    return known[key]


def _near_stops(evidence: Evidence, run: Run, j: int, least: float) -> np.ndarray:
    """Rows of a joint around its reversals, (T,) mask."""
    return _cached_stops(evidence, run, j, least, 0.0)


def _near_rounded(evidence: Evidence, run: Run, j: int, least: float) -> np.ndarray:
    """The same with those to which the low-pass of the positions gives a speed beside a stop."""
    return _cached_stops(evidence, run, j, least, _speeds(evidence, run).rounding)


def _cached_stops(
    evidence: Evidence, run: Run, j: int, least: float, rounding: float
) -> np.ndarray:
    """Rows of a joint around its stops, (T,) mask; asked for with every model.

    Parameters
    ----------
    evidence, run : a recording of it.
    j : number of the joint.
    least, rounding : as for `near_stops`.
    """
    sampled = run.replicates[0]
    known, kept = evidence.cache.along(sampled.motion), sampled.kept
    key = ("near stops", j, least, rounding, kept.start, kept.stop)
    if key not in known:
        speeds = _speeds(evidence, run)
        known[key] = near_stops(speeds, evidence.criteria.sticking, least, [j], rounding)[:, j]
    return known[key]


def _speeds(evidence: Evidence, run: Run) -> JointSpeeds:
    """Speeds in all samples of a recording, kept once they are computed."""
    sampled = run.replicates[0]
    known, kept = evidence.cache.along(sampled.motion), sampled.kept
    key = ("speeds", kept.start, kept.stop)
    if key not in known:
        known[key] = JointSpeeds(sampled)
    return known[key]


def _between_samples(evidence: Evidence, j: int, width: float, criteria: StickingCriteria) -> bool:
    """Whether many of a joint's reversals are over while one command is held."""
    held = [run for run in evidence.runs if run.recording.torque == "held_command"]
    if not held:
        return False
    moved = [np.concatenate([v[:, j] for v in _speeds(evidence, run).used()]) for run in held]
    steps = [np.abs(np.diff(v))[v[1:] * v[:-1] < 0] for v in moved]
    quick = np.concatenate(steps) > criteria.coarse * width
    return bool(np.sum(quick) >= max(criteria.stops, criteria.stops_share * len(quick)))
