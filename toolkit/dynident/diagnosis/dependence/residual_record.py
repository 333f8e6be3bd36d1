"""What a model leaves of the torque in one recording, with the motion that it belongs to."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.held_out import HeldOut, HeldOutRun
from dynident.evidence.runs import Run
from dynident.robot import Robot


@dataclass(frozen=True, eq=False)
class FittedBody:
    """A robot with the parameters that a fit found.

    Attributes
    ----------
    robot : with its bodies.
    rotor : (n,) inertia that rotors add at each joint, kg m^2 or kg.
    """

    robot: Robot
    rotor: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class ResidualRecord:
    """The residual along one stretch of motion; windows of one recording are one stretch.

    Attributes
    ----------
    source : what it was recorded as; windows of one recording have the same.
    t : (T,) s, increasing, on the clock of the recording.
    session : (T,) s, the same on the clock of the session.
    q, v, a, load : (T, n) motion, and the torque that the model predicts; SI units.
    residual : (T, n) measured less predicted torque, N m or N.
    certain : (T, n) mask of the rows by which a joint is judged.
    noise_power : (T, n) mean square of the noise, (N m)^2 or N^2; NaN where it is unknown.
    period : s, of a motion that repeats; None where none is known.
    body : the fitted robot, with its payload where that is on board; None where none is known.
    """

    source: Hashable
    t: np.ndarray
    session: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    load: np.ndarray
    residual: np.ndarray
    certain: np.ndarray
    noise_power: np.ndarray
    period: float | None
    body: FittedBody | None = None

    def rows(self, index: np.ndarray) -> ResidualRecord:
        """Return some of its rows, by an index or a mask (T,)."""
        return ResidualRecord(
            source=self.source,
            period=self.period,
            body=self.body,
            **{name: getattr(self, name)[index] for name in _ARRAYS},
        )


def joints_turning_round(records: Sequence[ResidualRecord]) -> np.ndarray:
    """Joints that turn without end, and go farther than once around, (n,) mask.

    Whole turns tell nothing of their residual: what is a function of the angle comes again.

    Parameters
    ----------
    records : all records; where no robot is known, no joint is one.
    """
    n = records[0].q.shape[1]
    body = records[0].body
    endless = np.zeros(n, bool) if body is None else [j.continuous for j in body.robot.joints]
    ends = [x for one in records for x in (one.q.min(axis=0), one.q.max(axis=0))]
    return np.asarray(endless) & (np.ptp(ends, axis=0) > 2 * np.pi)


_OF_THE_WHOLE = ("source", "period", "body")
_ARRAYS = tuple(one.name for one in fields(ResidualRecord) if one.name not in _OF_THE_WHOLE)


def residual_records(
    judged: HeldOut, runs: tuple[Run, ...], fitted: EvidenceFit
) -> tuple[ResidualRecord, ...]:
    """Return what a model leaves in each recording.

    Parameters
    ----------
    judged : the residual on data that the model was not fitted to.
    runs : the recordings that were judged, in the same order.
    fitted : the model.
    """
    n = judged.runs[0].residual.shape[1]
    unknown = judged.noise_std is None
    power = np.full(n, np.nan) if unknown else np.asarray(judged.noise_std) ** 2
    pairs = enumerate(zip(judged.runs, runs, strict=True))
    bodies = {
        loaded: FittedBody(
            fitted.model.current_robot(fitted.values, carries_payload=loaded),
            fitted.model.rotor(fitted.values),
        )
        for loaded in {bool(run.recording.payload) for run in runs}
    }
    return tuple(
        replace(_record(one, run, power, i), body=bodies[bool(run.recording.payload)])
        for i, (one, run) in pairs
    )


def _record(one: HeldOutRun, run: Run, power: np.ndarray, number: int) -> ResidualRecord:
    recording = run.recording
    windowed = recording.window is not None and recording.period is None
    # Only windows are known to share a clock: two recordings may have one name.
    source = (recording.name, number, id(run))
    if windowed:
        source = ("windows of", recording.where, recording.payload)
    return ResidualRecord(
        source=source,
        t=one.t,
        session=one.t + recording.start,
        q=one.q,
        v=one.v,
        a=one.a,
        load=one.predicted,
        residual=one.residual,
        certain=one.certain,
        noise_power=np.broadcast_to(power, one.residual.shape),
        period=recording.period,
    )


def joined(records: tuple[ResidualRecord, ...]) -> tuple[ResidualRecord, ...]:
    """Join the windows of one recording into one stretch, in the order of time."""
    together: dict[Hashable, list[ResidualRecord]] = {}
    for one in records:
        together.setdefault(one.source, []).append(one)
    return tuple(_joined(group) for group in together.values())


def _joined(group: list[ResidualRecord]) -> ResidualRecord:
    whole = ResidualRecord(
        source=group[0].source,
        period=group[0].period,
        body=group[0].body,
        **{name: np.concatenate([getattr(one, name) for one in group]) for name in _ARRAYS},
    )
    # Windows may overlap: no instant counts twice.
    return whole.rows(np.unique(whole.t, return_index=True)[1])
