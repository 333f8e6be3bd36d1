"""Windows of one recording: evaluated as one, so that none of its samples is evaluated twice.

A study may take several windows out of a recording, which is filtered as a whole. Its columns are
then evaluated once, from the first row of any window to the last of all, and each window has its
own rows of them.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from dynident.fitting.sampling import Sampled
from dynident.recording import Motion


@dataclass(frozen=True, eq=False)
class Source:
    """Where the columns of a recording are evaluated.

    Attributes
    ----------
    sampled : the recording, or all windows of it as one.
    rows : which decimated rows of it are the recording's own.
    """

    sampled: Sampled
    rows: slice

    @property
    def key(self) -> Hashable:
        """A motion, the rows that are kept of it, and whether the payload was on board."""
        kept = self.sampled.kept
        payload = bool(self.sampled.recording.payload)
        return self.sampled.motion, kept.start, kept.stop, payload


def sources(every: Iterable[Sampled]) -> dict[Sampled, Source]:
    """Where the columns of each of several recordings are evaluated.

    Parameters
    ----------
    every : recordings; those that share a motion are windows of one, see `shared_motion`.
    """
    together: dict[Hashable, list[Sampled]] = {}
    for one in dict.fromkeys(every):
        together.setdefault((one.motion, bool(one.recording.payload)), []).append(one)
    found = {}
    for group in together.values():
        first = min(one.kept.start for one in group)
        last = max(one.kept.stop for one in group)
        whole = group[0] if len(group) == 1 else replace(group[0], kept=slice(first, last))
        for one in group:
            rows = slice(one.kept.start - first, one.kept.stop - first)
            found[one] = Source(whole, rows)
    return found


def shared_motion(one: Sampled, others: Iterable[Sampled] = ()) -> Sampled:
    """Return a recording with its whole motion, that of another one of which it is a window.

    Columns are evaluated along it again and again: it is kept, where a fit takes it part by part.

    Parameters
    ----------
    one : the recording.
    others : earlier ones, with theirs.
    """
    one = replace(one, source=one.motion)
    for other in others:
        if (
            other.motion is not one.motion
            and other.parallel.filter == one.parallel.filter
            and other.parallel.period == one.parallel.period
            and other.recording.start == one.recording.start
            and other.recording.temperature is one.recording.temperature
            and _equal(other.motion, one.motion)
        ):
            return replace(one, source=other.source)
    return one


def _equal(one: Motion, other: Motion) -> bool:
    return (one.first, one.every, one.rate_hz, one.samples) == (
        other.first,
        other.every,
        other.rate_hz,
        other.samples,
    ) and all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("t", "q", "v", "a", "tau")
    )
