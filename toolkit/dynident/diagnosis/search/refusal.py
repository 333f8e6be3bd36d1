"""Steps that a fit refuses: impossible together with the model, or made by the filter.

Where nothing repeats and no noise is stated, columns carry noise that nothing takes out: least
squares shrinks what is multiplied with it, and other effects stand in. That noise changes with the
filter, and a physical parameter does not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.criteria import GateCriteria
from dynident.diagnosis.details import IMPOSSIBLE
from dynident.diagnosis.search.payload_recordings import marked
from dynident.effects import Block, Effect
from dynident.errors import RecordingError
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence, friction_reach
from dynident.evidence.runs import gather
from dynident.model import (
    Impossible,
    Model,
    beyond_bounds,
    impossible_joints,
    levels_not_met,
)
from dynident.recording import Dataset, default_filter
from dynident.tables import percent


def recorded_states(evidence: Evidence, model: Model) -> Block:
    """Return states of all recordings, spread evenly over each, as effects see them."""
    blocks, many = [], evidence.criteria.gates.states
    for run in evidence.runs:
        rows = run.rows(model)
        at = np.unique(np.linspace(0, len(rows.t) - 1, many).round().astype(int))
        warm = None if rows.temperature is None else rows.temperature[at]
        some = replace(rows, t=rows.t[at], q=rows.q[at], v=rows.v[at], a=rows.a[at])
        blocks.append(replace(some, temperature=warm))
    warm = [one.temperature for one in blocks if one.temperature is not None]
    return replace(
        blocks[0],
        t=np.concatenate([one.t for one in blocks]),
        q=np.concatenate([one.q for one in blocks]),
        v=np.concatenate([one.v for one in blocks]),
        a=np.concatenate([one.a for one in blocks]),
        temperature=np.concatenate(warm) if len(warm) == len(blocks) else None,
    )


def impossible_in(
    evidence: Evidence, fitted: EvidenceFit, gates: GateCriteria
) -> tuple[Impossible, ...]:
    """Return what the fitted values make, at the states recorded, that no robot can have.

    Parameters
    ----------
    evidence : the training recordings.
    fitted : the model as it fits them.
    gates : from how many standard deviations something is impossible.
    """
    found = fitted.model, fitted.values, fitted.covariance
    sigma = np.sqrt(np.clip(np.diag(fitted.covariance), 0.0, None))
    return (
        *beyond_bounds(*found[:2], np.where(fitted.alone, sigma, 0.0), gates),
        *impossible_joints(*found, recorded_states(evidence, fitted.model), gates),
        *levels_not_met(*found, friction_reach(evidence, fitted.values), gates),
    )


def impossible_joints_of(
    evidence: Evidence, model: Model, values: np.ndarray, covariance: np.ndarray
) -> tuple[str, ...]:
    """Say which joints of a model have an inertia, or a friction, that is negative beyond doubt.

    Parameters
    ----------
    evidence : the training recordings.
    model, values, covariance : the model, (p,) and (p, p) of its parameters.

    Returns
    -------
    A clause for each that makes a part of the joint's torque that is worth a word.
    """
    gates, names = evidence.criteria.gates, model.robot.names
    torque = np.concatenate([run.replicates[0].tau for run in evidence.runs])
    least = gates.worth_a_word * np.sqrt(np.mean(torque**2, axis=0))
    states = recorded_states(evidence, model)
    found = impossible_joints(model, values, covariance, states, gates)
    return tuple(one.what for one in found if one.torque > least[names.index(one.joint)])


def newly_impossible(evidence: Evidence, fitted: EvidenceFit, wider: EvidenceFit) -> str:
    """Say what a wider model makes impossible that was possible without its last effect.

    Parameters
    ----------
    evidence : the training recordings.
    fitted, wider : the model without the effect and with it.

    Returns
    -------
    In words; empty where there is nothing.
    """
    gates = evidence.criteria.gates
    found = impossible_in(evidence, wider, gates)
    if not found:
        return ""
    doubtful = replace(gates, beyond_bounds=min(gates.doubtful, gates.beyond_bounds))
    before = impossible_in(evidence, fitted, doubtful)
    new = [one.what for one in found if not any(_was(old, one, gates) for old in before)]
    return f"{IMPOSSIBLE}: {'; '.join(new)}" if new else ""


def _was(old: Impossible, new: Impossible, gates: GateCriteria) -> bool:
    """Whether what is impossible was as far from possible already, within its uncertainty."""
    # A joint's negative inertia is the mass matrix's: one that is left of it is not new.
    inertia = new.where == "mass matrix" and old.where.startswith("inertia at")
    same = old.where == new.where or inertia
    return same and new.value >= old.value - gates.beyond_bounds * old.std


def narrower(evidence: Evidence, train: Dataset) -> tuple[Evidence, ...]:
    """Return the evidence of the same recordings behind filters with lower cut-offs.

    Parameters
    ----------
    evidence : of the training recordings.
    train : these recordings.

    Returns
    -------
    None of them where noise in the columns is known, and allowed for; or nothing is left of a
    recording.
    """
    if any(run.kind != "single" or run.columns_from != "recording" for run in evidence.runs):
        return ()
    rate = min(one.rate_hz for one in train.recordings)
    criteria, own = evidence.criteria, train.filter or default_filter(rate)
    found = []
    for share in (criteria.gates.filter_share, criteria.gates.second_filter_share):
        lower = replace(train, filter=own.narrowed(share, rate))
        try:
            runs = gather(lower, criteria.noise, samples_hz=criteria.fit.samples_hz)
        except RecordingError:
            break
        found.append(Evidence(evidence.model, runs, criteria=criteria))
    return tuple(found)


def follows_the_filter(
    evidence: Evidence, narrow: tuple[Evidence, ...], wider: EvidenceFit, effect: Effect
) -> str:
    """Say by how much an effect's torque changes with the filter, if it does.

    What noise makes of an effect rises and falls with the cut-off. So any two filters are compared,
    not only each with the first, whose value may lie between those of two others.

    Parameters
    ----------
    evidence : the training recordings, marked with those that carry a payload.
    narrow : as from `narrower`, from the highest cut-off to the lowest.
    wider : the model with the effect, as it fits the recordings behind their own filter.
    effect : that was added.

    Returns
    -------
    In words; empty where it makes the same torque, or that does not matter.
    """
    payloads = [run.recording.payload for run in evidence.runs]
    own = wider.model.slices[effect.label]
    every = [(wider.values[own], wider.covariance[own, own])]
    for one in narrow:
        lower = marked(one, payloads)
        again = fit_evidence(lower, wider.model)
        gram = _gram(lower, wider, effect)
        second, covariance = again.values[own], again.covariance[own, own]
        for first, before in every:
            # What two fits to the same recordings have in common makes this too much.
            doubt = np.trace(gram @ (before + covariance))
            if _changed(gram, doubt, first, second, evidence.criteria.gates):
                return _how_it_changes(gram, every[0][0], first, second)
        every.append((second, covariance))
    return ""


def _gram(lower: Evidence, wider: EvidenceFit, effect: Effect) -> np.ndarray:
    """Return the products of an effect's columns behind a lower filter, (k, k): rows that count."""
    own = wider.model.slices[effect.label]
    whole = wider.model.effect(effect.label)
    gram = np.zeros((own.stop - own.start,) * 2)
    joints = list(whole.acting_at(wider.model.robot))
    for number, run in enumerate(lower.runs):
        for columns in lower.of(whole, number, wider.model, wider.values):
            rows = columns[run.certain_rows[:, joints]]
            gram += rows.T @ rows
    return gram


def _changed(
    gram: np.ndarray, doubt: float, first: np.ndarray, second: np.ndarray, gates: GateCriteria
) -> bool:
    """Whether two values of an effect make torques that differ, beyond what is uncertain.

    Parameters
    ----------
    gram : products of its columns, (k, k).
    doubt : sum of squares of the torque's standard deviation.
    first, second : the values, (k,) each.
    gates : what is the same, and from how many standard deviations it is not.
    """
    change = _size(gram, first - second)
    most = max(_size(gram, first), _size(gram, second))
    return change > gates.same_value * most and change > gates.beyond_bounds * np.sqrt(doubt)


def _how_it_changes(
    gram: np.ndarray, here: np.ndarray, first: np.ndarray, second: np.ndarray
) -> str:
    """Say how large an effect's torque is with two values, against that with those found here."""
    own = _size(gram, here)
    others = [one for one in (first, second) if one is not here]
    told = [percent(_size(gram, one) / own if own > 0 else np.inf, 0) for one in others]
    return (
        "changes with the filter: behind lower cut-offs its torque is "
        f"{' and '.join(told)} of what it is here, so noise in the columns may make it"
    )


def _size(gram: np.ndarray, values: np.ndarray) -> float:
    """Root of the sum of squares of an effect's torque."""
    return float(np.sqrt(max(values @ gram @ values, 0.0)))
