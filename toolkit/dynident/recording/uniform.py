"""Jittered time stamps: recordings onto a uniform clock."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from weakref import WeakKeyDictionary

import numpy as np

from dynident.errors import RecordingError, warn
from dynident.recording.recording import SIGNALS, Recording

TOLERANCE = 1e-3
"""Relative jitter up to which a recording counts as uniform."""
_LONGEST_GAP = (20, 0.05)
"""A gap is too long to be bridged if it exceeds both so many samples and so many s."""
_LONG = 1.5
"""Of the usual time step, above which a step has left samples out."""
_EXCEPTIONS = 0.05
"""Share of the steps that may have left samples out: more are how the clock goes."""
_UNEXPLAINED = 0.2
"""Share of the missing samples by which the length of the record may say otherwise."""
_LONGEST_STALE = 5
"""Repeated rows in a run up to which they are a stale reading, not a robot at rest."""


@dataclass(eq=False)
class _Said:
    """Whether a warning was said, of a recording and of its copies with other windows."""

    yet: bool = False


@dataclass(frozen=True, eq=False)
class _Even:
    """A recording on a uniform clock, and the warning that goes with it."""

    recording: Recording
    words: str
    said: _Said = field(default_factory=_Said)


_EVEN: WeakKeyDictionary[Recording, _Even] = WeakKeyDictionary()
"""Resampled recordings by the jittered ones, for as long as these are in use."""


def uniform(recording: Recording) -> Recording:
    """Return the recording on a uniform clock.

    Recordings with a jitter below 1e-3 are returned as they are, unless their period is no whole
    number of samples. Others are interpolated by cubic splines. Before that, rows that repeat
    every position, velocity and torque of the row before are dropped (runs of up to 5): they are
    the same reading logged twice, under a time stamp that is not its own. Longer runs are a robot
    at rest, and stay. Held commands are averaged over each new step instead, which keeps them
    held commands.

    A recording is resampled once, and so are its copies with another window: all of its samples
    stay in memory from then on, while it is in use. Files that are mapped into memory should
    therefore have a uniform clock.

    Parameters
    ----------
    recording : T samples.

    Returns
    -------
    Recording
        At the mean rate, that of a clock without gaps where few samples are missing, which are
        filled in; or at the nearest at which the period is a whole number of samples.

    Raises
    ------
    RecordingError
        If a gap exceeds 20 samples and 0.05 s: what happened there cannot be guessed.

    Warns
    -----
    DynidentWarning
        Once, if it was resampled, naming the jitter and how many rows were dropped. The spread of
        true sampling instants about their stamps becomes noise that no filter undoes.
    """
    even = _EVEN.get(recording) or _shared(recording)
    if even is None:
        step = _step(recording)
        if step is None and recording.jitter <= TOLERANCE:
            return recording
        even = _resampled(recording, step)
    _EVEN[recording] = even
    even.said.yet = even.said.yet or warn(f"{recording.where}: {even.words}")
    return even.recording


def _shared(recording: Recording) -> _Even | None:
    """What has been made of the same samples under another window, say."""
    for other, even in list(_EVEN.items()):
        if all(getattr(other, name) is getattr(recording, name) for name in ("t", *SIGNALS)) and (
            other.period,
            other.torque,
        ) == (recording.period, recording.torque):
            done = even.recording
            same = {name: getattr(done, name) for name in ("t", *SIGNALS)}
            filter = _history(recording, done.rate_hz)
            source = replace(recording.provenance, filter=filter)
            return _Even(recording.replace(provenance=source, **same), even.words, even.said)
    return None


def _history(recording: Recording, rate_hz: float) -> str:
    """What was done to a recording that is now at a uniform rate."""
    before = recording.provenance.filter
    return f"{before}, {_done(rate_hz)}" if before else _done(rate_hz)


def _done(rate_hz: float) -> str:
    return f"resampled to {rate_hz:.6g} Hz"


def _resampled(recording: Recording, step: float | None) -> _Even:
    """Put a recording on a clock of this step in s; None for its mean one."""
    jitter = recording.jitter
    jittered = jitter > TOLERANCE
    fresh = _fresh(recording) if jittered else np.ones(recording.samples, dtype=bool)
    t = recording.t[fresh]
    _refuse_gaps(recording, np.flatnonzero(fresh))
    missing = _missing(recording.t)
    step = step or recording.duration / (recording.samples - 1 + missing)
    grid = t[0] + step * np.arange(int(np.floor((t[-1] - t[0]) / step * (1 + 1e-12))) + 1)
    signals = {
        signal: None
        if (x := getattr(recording, signal)) is None
        else _interpolated(t, x, fresh, grid)
        for signal in SIGNALS
    }
    if recording.torque == "held_command":
        signals["tau"] = _held(recording.t, recording.tau, grid)
    if jittered:
        why = _irregular(recording.t, missing)
        dropped = recording.samples - int(fresh.sum())
        if dropped:
            share = 100 * dropped / recording.samples
            why += f", and {dropped} rows ({share:.2g} %) repeat the reading before"
    else:
        why = f"the period of {recording.period:g} s is no whole number of samples"
    for x in (grid, *signals.values()):
        if x is not None:
            x.setflags(write=False)  # then it is not copied
    source = replace(recording.provenance, filter=_history(recording, 1 / step))
    even = recording.replace(t=grid, provenance=source, **signals)
    return _Even(even, f"{why}; {_done(1 / step)}")


def _missing(t: np.ndarray) -> int:
    """Samples that a clock (T,) has left out: their steps are longer, and no others are shorter."""
    steps = np.diff(t)
    usual = float(np.median(steps))
    if not usual > 0:
        return 0
    long = steps > _LONG * usual
    lost = np.sum(np.round(steps[long] / usual) - 1)
    # A clock of bursts, of rounded stamps or of events has long steps as a rule: none is missing.
    if np.mean(long) > _EXCEPTIONS or lost > 2 * _EXCEPTIONS * len(steps):
        return 0
    # Where readings come late, the next steps are short: nothing is missing then.
    surplus = (t[-1] - t[0]) / usual - len(steps)
    return int(lost) if abs(surplus - lost) <= 1.0 + _UNEXPLAINED * lost else 0


def _irregular(t: np.ndarray, missing: int) -> str:
    """What is irregular about a clock, in words."""
    steps = np.diff(t)
    step = (t[-1] - t[0]) / (len(steps) + missing)
    own = steps[steps <= _LONG * step] if missing else steps
    jitter = float(np.max(np.abs(own - step))) / step
    said = [f"{missing} samples are missing"] if missing else []
    if jitter > TOLERANCE or not missing:
        said.append(f"the time stamps are jittered by {100 * jitter:.3g} % of a step")
    return ", and ".join(said)


def _interpolated(t: np.ndarray, x: np.ndarray, fresh: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Splines of the fresh rows of x (T, n) at other times; columns not recorded stay so."""
    from scipy.interpolate import CubicSpline

    found = np.full((len(grid), x.shape[1]), np.nan)
    for k in range(x.shape[1]):  # one by one: a spline takes many times its samples' memory
        column = x[fresh, k]
        if np.isfinite(column).all():
            found[:, k] = CubicSpline(t, column)(grid)
    return found


def _step(recording: Recording) -> float | None:
    """Time step that makes the period a whole number of samples; None if it is one, or none."""
    if recording.period is None:
        return None
    missing = _missing(recording.t) if recording.jitter > TOLERANCE else 0
    sampled = (recording.samples - 1 + missing) / recording.duration
    exact = recording.period * sampled
    whole = max(1, round(exact))
    repetitions = recording.duration / recording.period
    in_step = abs(exact - whole) * repetitions <= 0.25
    if in_step and recording.jitter <= TOLERANCE:
        return None
    return recording.period / whole


def _fresh(recording: Recording) -> np.ndarray:
    """Rows that are no repetition of the reading before."""
    signals = [x for name in ("q", "v", "a", "tau") if (x := getattr(recording, name)) is not None]
    same = np.ones(recording.samples, dtype=bool)
    same[0] = False
    for x in signals:
        same[1:] &= (x[1:] == x[:-1]).all(axis=1)
    edges = np.diff(np.concatenate([[0], same.astype(int), [0]]))
    for start, stop in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        if stop - start > _LONGEST_STALE:
            same[start:stop] = False
    return ~same


def is_gap(steps: np.ndarray, rate_hz: float) -> np.ndarray:
    """Which time steps, s, are gaps that cannot be bridged."""
    return (steps * rate_hz > _LONGEST_GAP[0]) & (steps > _LONGEST_GAP[1])


def may_have_gaps(recording: Recording) -> bool:
    """Whether any step is so far from the mean one that it may be a gap."""
    return recording.jitter > _LONGEST_GAP[0] - 1


def _refuse_gaps(recording: Recording, rows: np.ndarray) -> None:
    gaps = np.diff(recording.t[rows])
    longest = int(np.argmax(gaps))
    if is_gap(gaps[longest], recording.rate_hz):
        missing = gaps[longest] * recording.rate_hz
        raise RecordingError(
            f"{gaps[longest]:.3g} s without samples follow (about {missing:.0f} are missing)",
            recording.row(int(rows[longest])),
            "split the recording there in two",
        )


def _held(t: np.ndarray, u: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Mean of a held command over each step of a new clock, exactly; (len(grid), n)."""
    impulse = np.concatenate(
        [np.zeros((1, u.shape[1])), np.cumsum(u[:-1] * np.diff(t)[:, None], 0)]
    )
    ends = np.append(grid, min(grid[-1] + (grid[-1] - grid[-2]), t[-1]))
    at = np.column_stack([np.interp(ends, t, column) for column in impulse.T])
    steps = np.diff(ends)[:, None]
    held = np.divide(
        np.diff(at, axis=0), steps, where=steps > 0, out=np.zeros((len(grid), u.shape[1]))
    )
    # The clock may end on the recording's last sample, whose command acts from there on.
    return np.where(steps > 0, held, u[-1])
