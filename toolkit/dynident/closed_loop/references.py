"""What a loop follows: any function of time, or samples of one."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from dynident.errors import SimulationError
from dynident.recording import Recording

SETTLING = 0.1
"""s, time constant with which a sampled reference comes to rest beyond its samples."""


class Reference(Protocol):
    """A motion that a loop can follow."""

    @property
    def n(self) -> int:
        """Number of joints."""
        ...

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return position, velocity and acceleration at times t (T,) s, each (T, n)."""
        ...


class SampledReference:
    """A reference that is known at samples, with a spline between them.

    The spline is cubic: twice continuously differentiable through q alone, or a Hermite spline
    through q and v where v is given. Time 0 is the first sample. Before it and after the last one
    the reference comes from rest and goes to rest, its speed decaying within `SETTLING`: a loop
    that runs on for the sake of others beside it is not shaken.

    Parameters
    ----------
    t : (T,) s, strictly increasing.
    q : (T, n) rad or m.
    v : (T, n) rad/s or m/s, optional.

    Raises
    ------
    SimulationError
        If a shape does not fit, a number is not finite, or time does not increase.
    """

    def __init__(self, t: np.ndarray, q: np.ndarray, v: np.ndarray | None = None) -> None:
        from scipy.interpolate import CubicHermiteSpline, CubicSpline

        t, q = np.asarray(t, dtype=float), np.asarray(q, dtype=float)
        v = None if v is None else np.asarray(v, dtype=float)
        fits = t.ndim == 1 and len(t) >= 2 and q.ndim == 2 and len(q) == len(t)
        if not fits or (v is not None and v.shape != q.shape):
            shapes = ", ".join(str(x.shape) for x in (t, q, v) if x is not None)
            remedy = "give t (T,) with T of 2 or more, q (T, n), v (T, n) or none"
            raise SimulationError(f"shapes {shapes}", "reference", remedy, reason="reference")
        for name, x in (("t", t), ("q", q), ("v", v)):
            if x is not None and not np.isfinite(x).all():
                raise SimulationError(f"{name} is not finite", "reference", reason="reference")
        if not (np.diff(t) > 0).all():
            what, remedy = "its time does not increase", "sort the samples by time"
            raise SimulationError(what, "reference", remedy, reason="clock")
        t = t - t[0]
        spline = CubicSpline(t, q) if v is None else CubicHermiteSpline(t, q, v)
        self._pieces = (spline, spline.derivative(), spline.derivative(2))
        self._end, self._n = float(t[-1]), q.shape[1]

    @classmethod
    def of(cls, recording: Recording) -> SampledReference:
        """Return the reference of a recording.

        Raises
        ------
        SimulationError
            If the recording has none.
        """
        if recording.q_ref is None:
            what = "the recording has no reference, so its loop cannot be run again"
            remedy = f"add the columns q_ref.{recording.joints[0]}, ..."
            raise SimulationError(what, recording.where, remedy, reason="reference")
        return cls(recording.t, recording.q_ref)

    @property
    def n(self) -> int:
        """Number of joints."""
        return self._n

    @property
    def duration(self) -> float:
        """Time of the last sample, s."""
        return self._end

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return position, velocity and acceleration at times t (T,) s, each (T, n)."""
        t = np.asarray(t, dtype=float)
        inside = np.clip(t, 0.0, self._end)
        q, v, a = (piece(inside) for piece in self._pieces)
        outside = (t - inside)[:, None]
        fading = np.exp(-np.abs(outside) / SETTLING)
        q = q + np.sign(outside) * SETTLING * (1.0 - fading) * v
        a = np.where(outside == 0.0, a, -np.sign(outside) * fading / SETTLING * v)
        return q, fading * v, a
