"""The same numbers twice: in training and test recordings, or in two columns of a recording."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from dynident.criteria import WiringCriteria
from dynident.recording import Dataset, Recording
from dynident.recording.masks import within
from dynident.tables import percent
from dynident.wiring.fault import Fault

_RUN = 20  # consecutive samples that are the same recording where they are equal
_ODD = 0x9E3779B97F4A7C15
_ROWS = 4000  # of a recording, for comparing columns


def shared_recordings(train: Dataset, test: Dataset, criteria: WiringCriteria) -> tuple[Fault, ...]:
    """Test recordings whose samples were fitted as well.

    Parameters
    ----------
    train, test : the recordings, each within its window.
    criteria : which share of the samples is too much.

    Returns
    -------
    One fault of all test recordings that are not held out.
    """
    if not train.recordings or not test.recordings:
        return ()
    fitted = set().union(*(set(_samples(one)) for one in train.recordings))
    shares = {}
    for one in test.recordings:
        own = set(_samples(one))
        share = len(own & fitted) / len(own)
        if share > criteria.shared:
            shares[f"{one.name} (number {one.number})" if one.number else one.name] = share
    if not shares:
        return ()
    return (
        Fault(
            kind="same_data",
            joints=(),
            what=f"test recordings are training data: {', '.join(shares)}",
            evidence=f"{percent(min(shares.values()))} or more of their samples are fitted, so "
            "that their errors judge nothing",
            where="Name other files there, give windows that do not overlap, or leave these "
            '[[recordings]] entries with use = "test" out: then blocks of time are held out',
        ),
    )


def _samples(recording: Recording) -> list[int]:
    """Fingerprints of each run of `_RUN` samples, positions and torques, within the window.

    Single samples of two recordings of one motion may be alike to the last step of the encoders.
    """
    kept = slice(None)
    if recording.window is not None:
        kept = within(recording.t, *recording.window, recording.where)
    rows = np.ascontiguousarray(np.column_stack([recording.q[kept], recording.tau[kept]]))
    bits = rows.view(np.uint64)
    # Polynomials modulo 2^64 in an odd number, whose products wrap.
    powers = np.cumprod(np.full(bits.shape[1] + _RUN, _ODD, dtype=np.uint64))
    each = ((bits ^ (bits >> np.uint64(29))) * powers[: bits.shape[1]]).sum(axis=1, dtype=np.uint64)
    each ^= each >> np.uint64(31)
    run = min(_RUN, len(each))
    found = np.zeros(len(each) - run + 1, dtype=np.uint64)
    for k in range(run):
        found += each[k : k + len(found)] * powers[k]
    return found.tolist()


def twice_recorded(dataset: Dataset, criteria: WiringCriteria) -> tuple[Fault, ...]:
    """Pairs of columns that are one, or proportional, in every recording.

    Parameters
    ----------
    dataset : the recordings.
    criteria : how alike they must be.

    Returns
    -------
    A fault for each pair.
    """
    joints = dataset.recordings[0].joints
    names = [f"{s}.{joint}" for s in ("q", "tau") for joint in joints]
    alike: set[tuple[int, int]] | None = None
    for one in dataset.recordings:
        here = set(_alike(one, criteria.one_source))
        alike = here if alike is None else alike & here
    found = []
    for i, j in sorted(alike or ()):
        pair = f"{names[i]} and {names[j]}"
        found.append(
            Fault(
                kind="one_source",
                joints=tuple(dict.fromkeys((joints[i % len(joints)], joints[j % len(joints)]))),
                what=f"{pair} come from one source",
                evidence="one is a multiple of the other, sample by sample, in every recording",
                where=f"Name in [columns] of the study the column of the file that holds {pair}, "
                "each its own",
            )
        )
    return tuple(found)


def _alike(recording: Recording, tolerance: float) -> list[tuple[int, int]]:
    """Pairs of columns, positions first, of which one is the other times a number, plus one."""
    step = max(1, recording.samples // _ROWS)
    x = np.column_stack([recording.q[::step], recording.tau[::step]])
    x = x - x.mean(axis=0)
    size = np.linalg.norm(x, axis=0)
    moves = size > 1e-9 * np.max(np.abs(x), initial=1e-300)
    x = x / np.where(moves, size, 1.0)
    correlation = x.T @ x
    return [
        (i, j)
        for i, j in combinations(range(x.shape[1]), 2)
        if moves[i] and moves[j] and abs(correlation[i, j]) > 0.999
        if np.linalg.norm(x[:, i] - np.sign(correlation[i, j]) * x[:, j]) < tolerance
    ]
