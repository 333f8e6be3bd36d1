"""A recording: what a robot did and which torques it took."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import KW_ONLY, dataclass, field
from dataclasses import replace as _replace
from itertools import pairwise
from mmap import mmap
from typing import Any, Literal

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.masks import within
from dynident.settings import LONGEST_TIME
from dynident.words import nearest

USES = ("train", "test")
TORQUES = ("measured", "held_command")
TEXTS = (".csv", ".txt", ".dat", ".tsv")
"""Suffixes of tables of text, whose lines can be counted."""
LARGEST = 1e30
"""Magnitude beyond which a number can be no measurement, and powers of it overflow."""
_AT_ONCE = 1 << 18  # time stamps that are looked at
_ROUNDED = 0.2  # share of time stamps that are there twice from which they are rounded
SIGNALS = ("q", "tau", "v", "a", "q_ref", "temperature")
"""What a sample holds at each joint."""


@dataclass(frozen=True)
class Provenance:
    """Where the numbers of a recording come from.

    Attributes
    ----------
    file : path of the file as it was given; empty for a recording made in memory.
    sha256 : hexadecimal digits of the file's content; empty likewise.
    filter : what was done to the numbers since, in words; empty if nothing.
    record : which recording of a file that holds several; empty if it holds one.
    columns : (ours, the file's name of it, scale) of each column that was read; empty likewise.
    skipped : what else the file holds that was not read, in words each.
    first_line : line of the first sample in a text file, from 1; 0 where lines are not counted.
    comment_lines : lines of comment, ascending; those above that one do not count.
    place : where the samples were put if they were too many for the memory, in words.
    unwrapped : joints whose positions jumped by whole turns, and are read as going on.
    began : s that the clock of the file showed at t = 0; zero where t is that clock.
    """

    file: str = ""
    sha256: str = ""
    filter: str = ""
    record: str = ""
    _: KW_ONLY
    columns: tuple[tuple[str, str, float], ...] = ()
    skipped: tuple[str, ...] = ()
    first_line: int = 2
    comment_lines: tuple[int, ...] = ()
    place: str = ""
    unwrapped: tuple[str, ...] = ()
    began: float = 0.0

    def line(self, index: int) -> int:
        """Return the line of a sample in a text file, given its index from 0; 0 if unknown."""
        number = index + self.first_line
        for comment in self.comment_lines:
            number += self.first_line <= comment <= number
        return number if self.first_line else 0

    def row(self, index: int, where: str) -> str:
        """How messages call a sample, given its index from 0: row, and line in a text file.

        Parameters
        ----------
        index : of the sample.
        where : how they call the recording.
        """
        number = self.line(index) if where.lower().endswith(TEXTS) else 0
        line = f" (line {number})" if number else ""
        return f"{where}, row {index + 1}{line}"


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """A stretch of a recording that is not used, from `start` to `stop` in s, and why."""

    reason: str
    start: float
    stop: float


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """Samples of a robot's motion and torques, checked and read-only.

    Attributes
    ----------
    t : (T,) s, strictly increasing. This and all signals may be files that are mapped into memory
        to be read, of any length: they are looked at part by part, and so do fits by least squares.
        They should have a uniform clock: a jittered one is resampled as a whole, into memory.
    q : (T, n) rad, or m for prismatic joints.
    tau : (T, n) N m, or N for prismatic joints.
    joints : n names, the order of the columns.
    v, a : (T, n) recorded velocity and acceleration, or None.
    q_ref : (T, n) reference position, or None.
    temperature : (T, n) degrees Celsius of the motors, NaN at joints where it is not recorded; None
        where it is recorded at no joint.
    period : s after which the excitation repeats, or None.
    start : s, when the recording began in the session (for effects of warm-up).
    window : (t0, t1) s on the clock of `t`, or None: what to use of it once the whole is filtered.
    use : "train" or "test".
    payload : whether the payload under study was on board; None where there is none.
    load : name of the load that it carried, of those that the study describes; empty for none.
    torque : "measured", or "held_command" where the torque of sample k acts until sample k + 1.
    number : its place among the recordings of a study, from 1; 0 where that does not matter.
    name : for tables; the file's name without its suffix by default.
    provenance : file, hash, filter.
    continuous : joints that turn without end, as their robot says.
    left_out : stretches that `usable_rows.usable` has found to be of no use, which its window then
        excludes; None where nobody has looked.
    stops : (k, 2) s for each joint, from when to when rows of that joint do not count, since it
        stands there; empty where all count. Copies with other positions keep them.

    Raises
    ------
    RecordingError
        If a shape does not fit, a value is not finite, time does not strictly increase, a joint's
        name is missing or repeated, or a setting is out of its range. The message names the
        joint's column and the row (the first sample is row 1).
    """

    t: np.ndarray
    q: np.ndarray
    tau: np.ndarray
    joints: tuple[str, ...]
    _: KW_ONLY
    v: np.ndarray | None = None
    a: np.ndarray | None = None
    q_ref: np.ndarray | None = None
    temperature: np.ndarray | None = None
    period: float | None = None
    start: float = 0.0
    window: tuple[float, float] | None = None
    use: Literal["train", "test"] = "train"
    payload: bool | None = None
    load: str = ""
    torque: Literal["measured", "held_command"] = "measured"
    number: int = 0
    name: str = ""
    continuous: tuple[str, ...] = ()
    provenance: Provenance = field(default_factory=Provenance)
    left_out: tuple[LeftOut, ...] | None = None
    stops: tuple[np.ndarray, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", _joint_names(self.joints, self.where))
        object.__setattr__(self, "t", self._numbers("t", self.t))
        if self.t.ndim != 1:
            raise RecordingError(f"t has the shape {self.t.shape}", self.where, "make it (T,)")
        if len(self.t) < 2:
            raise RecordingError(
                f"holds {len(self.t)} sample{'s' * (len(self.t) != 1)}",
                self.where,
                "a recording needs at least 2; is the file complete?",
            )
        for signal in SIGNALS:
            value = getattr(self, signal)
            if value is not None or signal in ("q", "tau"):
                object.__setattr__(self, signal, self._signal(signal, value))
        if self.temperature is not None and np.isnan(self.temperature).all():
            object.__setattr__(self, "temperature", None)
        self._check_finite()
        self._check_time()
        self._check_settings()

    # --- what it says --------------------------------------------------------------------------

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joints)

    @property
    def samples(self) -> int:
        """Number of samples, T."""
        return len(self.t)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.t[-1] - self.t[0])

    @property
    def rate_hz(self) -> float:
        """Mean sampling rate, (T - 1) / (t[-1] - t[0])."""
        return (self.samples - 1) / self.duration

    @property
    def jitter(self) -> float:
        """Largest departure of a time step from the mean one, relative to the mean one."""
        mean = self.duration / (self.samples - 1)
        return max(float(np.max(np.abs(np.diff(t) - mean))) for t in _parts(self.t)) / mean

    @property
    def where(self) -> str:
        """How messages call this recording: its file (and record in it), else its name."""
        source = self.provenance
        record = f", record {source.record}" if source.record else ""
        return source.file + record if source.file else self.name or "recording"

    def row(self, index: int) -> str:
        """How messages call a sample, given its index from 0: file and row (and line, in CSV)."""
        return self.provenance.row(index, self.where)

    def __repr__(self) -> str:
        joints = ", ".join(self.joints)
        size = f"{self.samples} samples at {self.rate_hz:.4g} Hz, {self.duration:.4g} s"
        return f"<Recording {self.name or self.where}: {joints}; {size}; {self.use}>"

    # --- with changes --------------------------------------------------------------------------

    def replace(self, **changes: Any) -> Recording:
        """Return the recording with other values of some attributes, checked anew."""
        return _replace(self, **changes)

    def select(self, joints: Sequence[str]) -> Recording:
        """Return the recording of these joints only, in this order.

        Columns of files that are mapped into memory stay there where they are evenly apart and in
        the recording's order; others are copied.

        Raises
        ------
        RecordingError
            If one of them is not in the recording.
        """
        missing = [joint for joint in joints if joint not in self.joints]
        if missing:
            remedy = nearest(missing[0], self.joints, "joints")
            raise RecordingError(f"no joint '{missing[0]}'", self.where, remedy)
        picked = [self.joints.index(joint) for joint in joints]
        stops = tuple(self.stops[j] for j in picked) if self.stops else ()
        continuous = tuple(name for name in self.continuous if name in joints)
        signals = self._mapped(lambda x: _columns(x, picked))
        return self.replace(joints=tuple(joints), continuous=continuous, stops=stops, **signals)

    def cut(self, t0: float | None = None, t1: float | None = None) -> Recording:
        """Return the samples with t0 <= t < t1 (s, as in `t`); None leaves that side open.

        Raises
        ------
        RecordingError
            If fewer than 2 samples are left.
        """
        kept = np.flatnonzero(within(self.t, t0, t1, self.where))
        return self.part(slice(int(kept[0]), int(kept[-1]) + 1))

    def part(self, rows: slice) -> Recording:
        """Return some consecutive samples.

        Raises
        ------
        RecordingError
            If there are fewer than 2.
        """
        source = _replace(self.provenance, first_line=self.provenance.line(rows.start or 0))
        return self.replace(t=self.t[rows], **self._mapped(lambda x: x[rows]), provenance=source)

    def _mapped(self, change: Callable[[np.ndarray], np.ndarray]) -> dict[str, Any]:
        """Each signal changed alike, those that are absent left absent."""
        present = {signal: getattr(self, signal) for signal in SIGNALS}
        return {signal: None if x is None else change(x) for signal, x in present.items()}

    # --- checks --------------------------------------------------------------------------------

    def _numbers(self, column: str, value: Any) -> np.ndarray:
        """Value as a read-only array of doubles; one that is one already, or a file's, is shared.

        Of a file that is mapped into memory (`np.load(..., mmap_mode="r")`) no copy is made.
        """
        if (
            isinstance(value, np.ndarray)
            and value.dtype == np.float64
            and not value.flags.writeable
            and (value.base is None or isinstance(_owner(value), mmap))
        ):
            return value.view(np.ndarray) if isinstance(value, np.memmap) else value
        try:
            if np.iscomplexobj(value):
                raise ValueError
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            remedy = "give an array of real numbers"
            raise RecordingError(f"{column} does not hold numbers", self.where, remedy) from None
        array.setflags(write=False)
        return array

    def _signal(self, signal: str, value: Any) -> np.ndarray:
        array = self._numbers(signal, value)
        if array.shape == (self.samples,) and self.n == 1:
            array = self._numbers(signal, array[:, None])
        if array.shape != (self.samples, self.n):
            raise RecordingError(
                f"{signal} has the shape {array.shape} where {self.samples} time stamps and "
                f"{self.n} joint{'s' * (self.n != 1)} ask for {(self.samples, self.n)}",
                self.where,
                "give one row a sample and one column a joint",
            )
        return array

    def _check_finite(self) -> None:
        if not (self.t.min() > -LARGEST and self.t.max() < LARGEST):
            row = int(np.argmax(~(np.abs(self.t) < LARGEST)))
            self._not_finite("t", row, self.t[row])
        for signal in SIGNALS:
            x = getattr(self, signal)
            if x is None or (x.min() > -LARGEST and x.max() < LARGEST):  # false where one is NaN
                continue
            bad = ~(np.abs(x) < LARGEST)
            if signal == "temperature":
                bad &= ~np.isnan(x).all(axis=0)
            if not bad.any():
                continue
            row, joint = (int(i) for i in np.argwhere(bad)[0])
            self._not_finite(f"{signal}.{self.joints[joint]}", row, x[row, joint])

    def _not_finite(self, column: str, row: int, value: float) -> None:
        what = "is beyond any unit" if np.isfinite(value) else "is not a finite number"
        raise RecordingError(
            f"{value} {what}",
            f"{self.row(row)}, column {column}",
            "repair or cut the gap; a recording has a number in every cell",
        )

    def _check_time(self) -> None:
        if all(np.all(np.diff(t) > 0) for t in _parts(self.t)):
            return
        late = np.flatnonzero(np.diff(self.t) <= 0)
        row = int(late[0]) + 1
        before, here = float(self.t[row - 1]), float(self.t[row])
        if before == here:
            what, remedy = f"the time stamp {here!r} s is there twice", "drop one of the two rows"
            if len(late) > _ROUNDED * len(self.t):
                remedy = "log it with more digits: it is rounded to more than a sample"
        else:
            what, remedy = f"time goes back from {before!r} to {here!r} s", "sort the rows by time"
        more = f" ({len(late)} such rows)" if len(late) > 1 else ""
        raise RecordingError(what + more, f"{self.row(row)}, column t", remedy)

    def _check_settings(self) -> None:
        def positive(name: str, unit: str, value: Any, least: float) -> float:
            number = _number(value)
            if not (math.isfinite(number) and number > least):
                remedy = f"choose it above {least:.4g} {unit}"
                raise RecordingError(f"{name} = {value!r}", self.where, remedy)
            return number

        if self.period is not None:
            # Two samples a period is the least that can show any motion at all.
            step = self.duration / (self.samples - 1)
            object.__setattr__(self, "period", positive("period", "s", self.period, 2 * step))
            if self.period > LONGEST_TIME:
                what, remedy = f"period = {self.period:g} s", "is it given in s?"
                raise RecordingError(what, self.where, remedy)
        if not math.isfinite(_number(self.start)):
            raise RecordingError(f"start = {self.start!r}", self.where, "give a time in s")
        if self.window is not None:
            given = self.window if isinstance(self.window, Iterable) else ()
            window = tuple(_number(limit) for limit in given)
            if len(window) != 2 or not window[0] < window[1]:
                remedy = "give two times in s, the earlier one first"
                raise RecordingError(f"window = {self.window!r}", self.where, remedy)
            object.__setattr__(self, "window", window)
        whole = isinstance(self.number, (int, np.integer)) and not isinstance(self.number, bool)
        if not (whole and 0 <= self.number < 2**31):
            remedy = "give its place, from 1, or 0"
            raise RecordingError(f"number = {self.number!r}", self.where, remedy)
        for key, valid in (("use", USES), ("torque", TORQUES)):
            if getattr(self, key) not in valid:
                choices = " or ".join(f'"{one}"' for one in valid)
                raise RecordingError(
                    f"{key} = {getattr(self, key)!r}", self.where, f"write {choices}"
                )
        if self.payload not in (None, True, False):
            raise RecordingError(f"payload = {self.payload!r}", self.where, "write true or false")


def _columns(x: np.ndarray, picked: list[int]) -> np.ndarray:
    """Columns of x (T, n); a view where they are evenly apart, else read-only."""
    steps = {two - one for one, two in pairwise(picked)} or {1}
    if picked and len(steps) == 1 and min(steps) > 0:
        return x[:, picked[0] : picked[-1] + 1 : steps.pop()]
    found = np.take(x, picked, axis=1)
    found.setflags(write=False)  # then it is not copied again
    return found


def _owner(array: np.ndarray) -> object:
    """What holds the memory of an array."""
    base: Any = array
    while isinstance(base, np.ndarray) and base.base is not None:
        base = base.base
    return base


def _parts(t: np.ndarray) -> Iterator[np.ndarray]:
    """Time stamps (T,) part by part, each beginning with the last one of the part before."""
    for start in range(0, max(1, len(t) - 1), _AT_ONCE):
        yield t[start : start + _AT_ONCE + 1]


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def _joint_names(joints: Any, where: str) -> tuple[str, ...]:
    if isinstance(joints, str):
        raise RecordingError(
            f"joints = {joints!r} is one text", where, f'write a list: ["{joints}"]'
        )
    if not isinstance(joints, Iterable):
        raise RecordingError(f"joints = {joints!r} is no list", where, 'write a list: ["elbow"]')
    names = tuple(joints)
    if not names:
        raise RecordingError("no joints are named", where, "name at least one")
    for name in names:
        if not isinstance(name, str) or name != name.strip() or not (name and name.isprintable()):
            remedy = "a joint is named by one line of text without blanks around it"
            raise RecordingError(f"{name!r} is no name of a joint", where, remedy)
        if names.count(name) > 1:
            raise RecordingError(f"the joint '{name}' is named twice", where, "name it once")
    return names
