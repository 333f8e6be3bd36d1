"""The low-pass of the positions against another one: does it take away what the torque is made of?

Behind a low-pass near that of columns and torque, accelerations are too small where the torque is
not, and behind none they are made of encoder noise; either looks like a joint that gives way. The
torque knows nothing of the positions' filter: of two, the one with which the equations of motion
leave far less of the very same torque is right.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from dynident.criteria import WiringCriteria
from dynident.effects import effects_of
from dynident.errors import RecordingError, without_warnings
from dynident.fitting.sampling import sample
from dynident.model import Model
from dynident.recording import (
    Dataset,
    Filter,
    default_cutoff,
    default_position_cutoff,
    usual_position_cutoffs,
)
from dynident.tables import listed, percent
from dynident.wiring.fault import Fault

_USUAL = ("viscous_friction", "coulomb_friction", "rotor_inertia", "torque_offset")
"""What many a model lacks and no filter is to be blamed for."""
_SECONDS = 60.0
"""s of recordings that are looked at, about."""
_ROUNDS = 3  # of weighting joints by what is left at them
_RANK = 1e-8


def unsuitable_position_filter(
    model: Model, dataset: Dataset, rate_hz: float, criteria: WiringCriteria
) -> tuple[Fault, ...]:
    """Compare the positions' low-pass with the usual one, on the torque as it is filtered.

    Parameters
    ----------
    model : whose effects that follow from a sample alone are fitted, with usual ones beside them.
    dataset : the recordings.
    rate_hz : of the slowest recording of the study, which the usual low-pass has to suit.
    criteria : by how much another filter must do better.

    Returns
    -------
    A fault if it does at some joint; none where the filter is a usual one.
    """
    stated = dataset.filter
    if stated is None:
        return ()
    usual_hz = default_position_cutoff(rate_hz, stated.cutoff_hz)
    if stated.position_cutoff_hz in usual_position_cutoffs(rate_hz, stated.cutoff_hz):
        return ()
    usual = replace(stated, position_cutoff_hz=usual_hz)
    try:
        whole = _usual_model(model)
        left, least = (
            _unexplained(whole, replace(dataset, filter=one), criteria.rows)
            for one in (stated, usual)
        )
    except RecordingError:
        return ()  # too little is left behind one of them: whoever fits says so
    worse = (left > criteria.filter_ratio * least) & (left > criteria.filter_error)
    if not worse.any():
        return ()
    names = [name for name, is_worse in zip(model.robot.names, worse, strict=True) if is_worse]
    times = np.divide(left, least, out=np.full_like(left, np.inf), where=least > 0)
    worst = int(np.argmax(np.where(worse, times, 0.0)))
    now = "unfiltered" if stated.position_cutoff_hz is None else "low-passed at "
    if stated.position_cutoff_hz is not None:
        now += f"{stated.position_cutoff_hz:g} Hz"
    return (
        Fault(
            kind="position_filter",
            joints=tuple(names),
            what=f"[filter] does not suit the motion of {listed(names)}",
            evidence=f"with positions {now} a fit leaves {percent(left[worst])} of the torque of "
            f"{model.robot.names[worst]}, and {percent(least[worst])} of the same torque with "
            f"positions low-passed at {usual_hz:g} Hz",
            mend=tuple(f"{key} = {value:g}" for key, value in _mending(usual).items()),
            where="Leave [filter] out of the study, or write in it",
        ),
    )


def _mending(usual: Filter) -> dict[str, float]:
    """Keys of [filter] that change; torque that is not filtered holds what no position tells."""
    assert usual.position_cutoff_hz is not None
    position = {"position_cutoff_hz": usual.position_cutoff_hz}
    if usual.cutoff_hz is not None:
        return position
    cutoff, rate = default_cutoff(usual.position_cutoff_hz, usual.rate_hz)
    return position | {"cutoff_hz": cutoff} | ({} if usual.rate_hz else {"rate_hz": rate})


def _usual_model(model: Model) -> Model:
    """The rigid body with what effects say of an instant, and with usual effects."""
    found = model
    for one in model.effects:
        if one.is_payload or not one.is_instantaneous:
            found = found - one
    for name in _USUAL:
        found = found + tuple(one for one in effects_of(name, model.robot) if one not in found)
    return found


def _unexplained(model: Model, dataset: Dataset, most: int) -> np.ndarray:
    """What the best fit to so many rows leaves of each joint's torque, (n,) relative."""
    columns, torque = (np.concatenate(x) for x in zip(*_rows(model, dataset, most), strict=True))
    power = np.mean(torque**2, axis=0)
    weight, moves = np.sqrt(power), power > 0
    left = np.zeros(len(power))
    for _ in range(_ROUNDS):
        some = np.where(moves, 1.0 / np.where(moves, weight, 1.0), 0.0)
        rows = (columns * some[None, :, None]).reshape(-1, model.size)
        size = np.linalg.norm(rows, axis=0)
        scale = np.where(size > 0, size, 1.0)
        values = np.linalg.lstsq(rows / scale, (torque * some).ravel(), rcond=_RANK)[0] / scale
        left = np.sqrt(np.mean((torque - columns @ values) ** 2, axis=0))
        weight = np.maximum(left, 1e-9 * np.sqrt(power))
    return np.where(moves, left / np.sqrt(np.where(moves, power, 1.0)), 0.0)


def _rows(model: Model, dataset: Dataset, most: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield columns (T, n, p) and torques (T, n) of about so many rows, evenly in time."""
    every, seconds = [], 0.0
    for recording in dataset.recordings:
        if recording.window is None and recording.duration > _SECONDS:
            first = float(recording.t[0])
            recording = recording.replace(window=(first, first + _SECONDS))
        with without_warnings():
            every.append(sample(recording.replace(period=None), dataset.filter))
        seconds += every[-1].count / every[-1].rate_hz
        if seconds >= _SECONDS:
            break
    for one in every:
        step = max(1, int(one.rate_hz * seconds / most))
        for columns, torque in one.rows(model):
            yield np.array(columns[::step]), np.array(torque[::step])
