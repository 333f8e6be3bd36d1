"""A few hundred rows of all recordings: motion and torque as the regression sees them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dynident.errors import without_warnings
from dynident.fitting.sampling import sample
from dynident.recording import Dataset


@dataclass(frozen=True, eq=False, kw_only=True)
class WiringRows:
    """Rows on which assignments of columns to joints are compared.

    Attributes
    ----------
    q, v, a : (T, n) rad or m, and their derivatives.
    tau : (T, n) N m or N.
    counts : (T, n) mask of each joint's rows: around a stop its dry friction is as others ask.
    independent : about how many of the rows are worth counting: neighbours err alike.
    motors : (n, n) speeds of the motors, behind their gears, from those of the joints, where a
        motor turns two of them: it then rubs at both; None where each turns one.
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    tau: np.ndarray
    counts: np.ndarray
    independent: float
    motors: np.ndarray | None = None

    def moved(self, change: np.ndarray) -> WiringRows:
        """Return the rows with positions `change @ q`, (n, n): joints exchanged, or rescaled."""
        q, v, a = (x @ change.T for x in (self.q, self.v, self.a))
        motors = None if self.motors is None else self.motors @ np.linalg.inv(change)
        counts = self.counts[:, np.abs(change).argmax(axis=1)]
        return replace(self, q=q, v=v, a=a, counts=counts, motors=motors)

    def held(self, joint: int) -> WiringRows:
        """Return the rows with a joint (a column) that stands still where it is on average."""
        q, v, a = self.q.copy(), self.v.copy(), self.a.copy()
        q[:, joint], v[:, joint], a[:, joint] = q[:, joint].mean(), 0.0, 0.0
        return replace(self, q=q, v=v, a=a)

    def thinned(self, most: int) -> WiringRows:
        """Return at most so many of the rows, evenly."""
        at = np.unique(np.linspace(0, len(self.q) - 1, min(most, len(self.q))).round().astype(int))
        return self.picked(at)

    def picked(self, at: np.ndarray | slice) -> WiringRows:
        """Return some of the rows."""
        arrays = {name: getattr(self, name)[at] for name in ("q", "v", "a", "tau", "counts")}
        return replace(self, **arrays)


def rows_of(dataset: Dataset, most: int, independent_hz: float) -> WiringRows:
    """Pick rows from all recordings, evenly in time.

    Parameters
    ----------
    dataset : the recordings, filtered as their study says; from `without_stops`, if joints stand.
    most : rows that are picked, about.
    independent_hz : 1/s, rows that count as independent.

    Returns
    -------
    Rows of all recordings, one after the other.

    Raises
    ------
    RecordingError
        If a recording does not suit its filter.
    """
    parts = []
    duration = 0.0
    each = max(20, -(-most // len(dataset.recordings)))
    for recording in dataset.recordings:
        with without_warnings():
            one = sample(recording.replace(period=None), dataset.filter)
        duration += len(one.t) / one.rate_hz
        at = np.unique(np.linspace(0, len(one.t) - 1, min(each, len(one.t))).round().astype(int))
        parts.append([x[at] for x in (one.q, one.v, one.a, one.tau, one.counting)])
    q, v, a, tau, counts = (np.concatenate(pieces) for pieces in zip(*parts, strict=True))
    independent = max(1.0, min(float(len(q)), duration * independent_hz) * float(counts.mean()))
    return WiringRows(q=q, v=v, a=a, tau=tau, counts=counts, independent=independent)
