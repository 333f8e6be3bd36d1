"""Joints that stand: rows in which dry friction is whatever the other torques ask for.

A joint is seen to stand if its speed stays within its noise for longer than it takes to pass
through zero. Around a stop no function of the speed tells its friction: these rows of that joint
count neither in fits nor in errors.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from dynident.criteria import DEFAULTS, StickingCriteria
from dynident.fitting.reversals.joint_speeds import REST_S, JointSpeeds, rest_range
from dynident.fitting.sampling import LEAST_ROWS, Sampled, sample
from dynident.formulas import quoted_joint
from dynident.model import Model, dry_joints
from dynident.recording import Dataset, Filter, Recording, uniform
from dynident.tables import listed, number, percent


def stands(every: Iterable[JointSpeeds], criteria: StickingCriteria) -> np.ndarray:
    """Return which joints are seen to stand at many of their stops, (n,) mask.

    A rest at an end of a recording is no stop; a joint that rests throughout one stands. Counted in
    samples, a passage may last one longer within a band than it does, and one shorter on either
    side of it: a joint that passes from one sample to the next is not seen to stand.

    Parameters
    ----------
    every : speeds of each recording.
    criteria : what is standing, and at how many stops.
    """
    longer, count, rests = 0.0, 0.0, False
    for speeds in every:
        limits = criteria.noise * speeds.noise + speeds.ringing
        each = _stops(speeds.used(), limits)
        rests = rests | speeds.rests
        count += np.array([len(stops) for stops in each])
        longer += np.array(
            [
                sum(one.within - 1 > criteria.longer * (one.around + 2) for one in stops)
                for stops in each
            ]
        )
    return rests | (longer >= np.maximum(criteria.stops, criteria.stops_share * count))


def near_stops(
    speeds: JointSpeeds,
    criteria: StickingCriteria,
    least: float = 0.0,
    joints: Sequence[int] | None = None,
    rounding: float = 0.0,
) -> np.ndarray:
    """Return the rows of each joint around its stops, (T, n) mask of the rows that are used.

    Parameters
    ----------
    speeds : of the recording.
    criteria : how far around.
    least : speed within which a joint's friction is not known, where that is more than the noise.
    joints : numbers of those that are looked at; None for all. The others have no such rows.
    rounding : s, `JointSpeeds.rounding` of joints that stand: beside a stop they are given a speed.
    """
    limits = np.maximum(_unknown_within(speeds, criteria), least)
    if joints is not None:
        limits[np.setdiff1d(np.arange(len(limits)), joints)] = -1.0
    near = np.concatenate(list(speeds.slower(limits, rounding)))
    return np.abs(near) > criteria.spread


def resting(sampled: Sampled) -> np.ndarray:
    """Return the rows of joints that rest, (T, n) mask: their position stays for a while.

    As between moves from point to point, or where one joint moves after the other. A joint that
    creeps within the noise of its speed does not rest.

    Parameters
    ----------
    sampled : the recording.
    """
    q, window = sampled.q, max(int(REST_S * sampled.rate_hz), 1)
    if len(q) < window:
        return np.tile(np.ptp(q, axis=0) <= rest_range(sampled), (len(q), 1))
    highest = maximum_filter1d(q, window, axis=0, mode="nearest")
    travel = highest - minimum_filter1d(q, window, axis=0, mode="nearest")
    still = (travel <= rest_range(sampled)).astype(np.uint8)
    return maximum_filter1d(still, window, axis=0, mode="nearest").astype(bool)


def few_enough(near: np.ndarray, rest: np.ndarray, criteria: StickingCriteria) -> np.ndarray:
    """Return of which joints the rows around stops may be left out, (n,) mask.

    While a joint moves it must not turn around most of the time, and some rows must be left.

    Parameters
    ----------
    near, rest : (N, n) masks of the rows around stops, and of those of long rests among them.
    criteria : which share may be left out.
    """
    moving, turning = np.sum(~rest, axis=0), np.sum(near & ~rest, axis=0)
    left = np.sum(~near, axis=0) >= LEAST_ROWS
    return (turning <= criteria.most * moving) & left


def without_stops(
    model: Model | Collection[Model], dataset: Dataset, standing: Collection[str] = ()
) -> Dataset:
    """Return a dataset whose recordings say which rows around stops do not count.

    Of joints with dry friction in the model that are seen to stand, with those that the low-pass of
    the positions has rounded. Where too few rows of a joint would be left, these count, and where
    there are too few still, all of them; as they do where the filter keeps the ends.

    Parameters
    ----------
    model : whose dry friction it is; of several models, that of any.
    dataset : as it was recorded; one that has been looked at comes back as it is.
    standing : joints that are known to stand, of other recordings of the robot: a short one may
        show too few stops.

    Raises
    ------
    RecordingError
        If a recording does not suit its filter.
    """
    recordings = dataset.recordings
    keeps = dataset.filter is not None and dataset.filter.ends == "keep"
    if not recordings or keeps or any(one.stops for one in recordings):
        return dataset
    models = [model] if isinstance(model, Model) else list(model)
    dry = np.isin(models[0].robot.names, [joint for one in models for joint in dry_joints(one)])
    if not dry.any():
        return dataset
    recordings, criteria = tuple(uniform(one) for one in recordings), DEFAULTS.sticking
    known = np.isin(models[0].robot.names, list(standing))
    which = dry & (known | stands(_speeds(recordings, dataset.filter), criteria))
    if not which.any():
        return dataset
    rest = np.concatenate([resting(sample(one, dataset.filter)) for one in recordings])
    near, few = _around_stops(recordings, dataset.filter, (rest, which), criteria)
    which = which & (few | (known & rest.all(axis=0)))
    pairs = zip(recordings, near, strict=True)
    marked = [with_stops(sample(one, dataset.filter), rows & which) for one, rows in pairs]
    return replace(dataset, recordings=tuple(marked))


def standing_in(dataset: Dataset) -> tuple[str, ...]:
    """Return the joints of which rows around stops do not count.

    Parameters
    ----------
    dataset : from `without_stops`.
    """
    marked = [one for one in dataset.recordings if one.stops]
    joints = marked[0].joints if marked else ()
    return tuple(
        joint for j, joint in enumerate(joints) if any(len(one.stops[j]) for one in marked)
    )


def _around_stops(
    recordings: Sequence[Recording],
    filter: Filter | None,
    rest_of: tuple[np.ndarray, np.ndarray],
    criteria: StickingCriteria,
) -> tuple[list[np.ndarray], np.ndarray]:
    """Rows around stops of each recording, (T, n) masks, and where they are few enough, (n,).

    Parameters
    ----------
    recordings, filter : all of them.
    rest_of : (N, n) mask of the rows of long rests, and (n,) of the joints that are asked for.
    criteria : how many are few.

    Returns
    -------
    With those that the low-pass of positions has rounded, at joints of which enough are left.
    """
    rest, which = rest_of
    some = np.flatnonzero(which).tolist()
    near = [
        near_stops(one, criteria, 0.0, some, one.rounding) for one in _speeds(recordings, filter)
    ]
    few = few_enough(np.concatenate(near), rest, criteria)
    left = np.flatnonzero(which & ~few).tolist()
    if left:
        narrow = (near_stops(one, criteria, 0.0, left) for one in _speeds(recordings, filter))
        near = [np.where(few, one, other) for one, other in zip(near, narrow, strict=True)]
        few = few_enough(np.concatenate(near), rest, criteria)
    return near, few


def _speeds(recordings: Sequence[Recording], filter: Filter | None) -> Iterator[JointSpeeds]:
    """Speeds of one recording after the other: those of many are not kept."""
    return (JointSpeeds(sample(one, filter)) for one in recordings)


def standing_note(dataset: Dataset) -> str:
    """Say of which joints rows around stops do not count, and how many; empty for none.

    Parameters
    ----------
    dataset : from `without_stops`.
    """
    marked = [one for one in dataset.recordings if one.stops]
    if not marked:
        return ""
    counting = np.concatenate([sample(one, dataset.filter).counting for one in marked])
    shares = dict(zip(marked[0].joints, (1.0 - counting.mean(axis=0)).tolist(), strict=True))
    shares = {joint: share for joint, share in shares.items() if share > 0}
    if not shares:
        return ""
    verb, their = ("stands", "its") if len(shares) == 1 else ("stand", "their")
    return (
        f"{listed(list(shares))} {verb} still at many of {their} stops, where dry friction is "
        f"whatever the other torques ask for: {left_out_words(shares)}"
    )


def too_wide_note(model: Model, dataset: Dataset) -> str:
    """Say which joints stand at less than their friction width; empty for none.

    A joint whose dry friction reversed over a wider speed would creep where these stand.

    Parameters
    ----------
    model : that has the widths.
    dataset : from `without_stops`.

    Returns
    -------
    With the line of a study that mends it.
    """
    standing, criteria = standing_in(dataset), DEFAULTS.sticking
    if not standing:
        return ""
    every = _speeds(dataset.recordings, dataset.filter)
    each = [(_unknown_within(one, criteria), one.rests) for one in every]
    speed = np.max([slow for slow, _ in each], axis=0)
    rest = np.all([rests for _, rests in each], axis=0)
    widths = dict(zip(model.robot.names, map(float, model.friction_widths), strict=True))
    narrower = {
        joint: float(number(one / criteria.noise, 1))
        for joint, one, idle in zip(model.robot.names, speed, rest, strict=True)
        if joint in standing and one < widths[joint] and not idle
    }
    if not narrower:
        return ""
    return (
        "The friction width of the model is more than the speed within which "
        f"{listed(list(narrower))} stood. Friction that reverses over so much lets a joint creep, "
        f"and Coulomb friction comes out too large: {width_advice(widths | narrower)}"
    )


def width_advice(widths: Mapping[str, float]) -> str:
    """Say what to write into a study for other friction widths than the model's.

    Parameters
    ----------
    widths : of every joint, rad/s or m/s: one that the key does not name would have the default.
    """
    each = ", ".join(f"{quoted_joint(joint)} = {width!r}" for joint, width in widths.items())
    return (
        "write, above the first table of the study, in place of any that it has:\n"
        f"    friction_width = {{ {each} }}"
    )


def left_out_words(shares: dict[str, float]) -> str:
    """Say what rows around stops are good for, and how many they are.

    Parameters
    ----------
    shares : of the rows of each joint, by its name.
    """
    low, high = (percent(one, 0) for one in (min(shares.values()), max(shares.values())))
    share = low if low == high else f"{low.removesuffix(' %')} to {high}"
    stops = "the joint's" if len(shares) == 1 else "each joint's"
    return (
        f"no data tell that friction, and {share} of {stops} rows, those around stops, count "
        "neither in the fit nor in the errors."
    )


def _unknown_within(speeds: JointSpeeds, criteria: StickingCriteria) -> np.ndarray:
    """Speed within which nothing tells the sign of a joint's dry friction, (n,).

    That of its noise, and around a reversal what the low-pass of the positions rounds.
    """
    return np.maximum(criteria.noise * speeds.noise, criteria.rounded * speeds.rms)


def with_stops(sampled: Sampled, rows: np.ndarray) -> Recording:
    """Return a recording that says when its rows do not count.

    Parameters
    ----------
    sampled : the recording.
    rows : (T, n) mask of those that are used.
    """
    half = 0.5 / sampled.rate_hz
    stops = []
    for column in rows.T:
        first, after = _stretches(column).T
        stops.append(np.stack([sampled.t[first] - half, sampled.t[after - 1] + half], axis=1))
    return sampled.recording.replace(stops=tuple(stops))


def _stretches(mask: np.ndarray) -> np.ndarray:
    """First row, and the row after the last, of each stretch of a mask (T,), (k, 2)."""
    edges = np.diff(np.concatenate([[0], mask.astype(int), [0]]))
    return np.stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)], axis=1)


@dataclass(frozen=True)
class _Stop:
    """A stop in samples: from the first to before the last below three times a speed.

    Attributes
    ----------
    start, stop : samples.
    within : how many of them are below that speed.
    """

    start: int
    stop: int
    within: int

    @property
    def around(self) -> int:
        """How many are above that speed."""
        return self.stop - self.start - self.within


def _stops(parts: Iterable[np.ndarray], limits: np.ndarray) -> list[list[_Stop]]:
    """Stops of each joint before which and after which it moves.

    Parameters
    ----------
    parts : consecutive speeds, (T, n) each.
    limits : (n,) speed of standing.
    """
    found: list[list[_Stop]] = [[] for _ in limits]
    first = 0
    for v in parts:
        wide, narrow = np.abs(v) < 3.0 * limits, np.abs(v) < limits
        for j, stops in enumerate(found):
            inside = np.concatenate([[0], np.cumsum(narrow[:, j])])
            for start, stop in _stretches(wide[:, j]).tolist():
                begun, within = first + start, int(inside[stop] - inside[start])
                if stops and stops[-1].stop == begun:  # it goes on from the part before
                    before = stops.pop()
                    begun, within = before.start, before.within + within
                stops.append(_Stop(begun, first + stop, within))
        first += len(v)
    return [
        [one for one in stops if one.within and one.start > 0 and one.stop < first]
        for stops in found
    ]
