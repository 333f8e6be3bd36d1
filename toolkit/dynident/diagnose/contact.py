"""Contacts: bursts in one repetition of a period only, found in what repetitions do not share.

What a model lacks is the same in every repetition and cancels in their differences; so does not a
push. What changes slowly, a level or friction that falls as a drive warms up, is taken out of
every repetition before. The rest is whitened by a noise model that a burst cannot inflate, and
searched by matched filters: Gaussian bumps of many widths at all times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter, oaconvolve
from scipy.stats import t as student

from dynident.diagnose.evidence import ColumnStore
from dynident.diagnose.noise import ORDER, measure_noise
from dynident.diagnose.present import Present, residuals
from dynident.diagnose.runs import Run
from dynident.effects import FRICTION_WIDTH

LEVEL = 1e-6
"""p value below which a bump is a contact.

The noise is measured with the place that stands out most left out, and tails are extrapolated: p
values of healthy data come out up to a hundred times too small. Those of pushes that matter are
smaller by many powers of ten.
"""
WIDTHS = tuple(float(w) for w in np.geomspace(0.02, 0.6, 9))
"""s, of the bumps that are searched."""

_MOST = 8  # bumps in one diagnosis: beyond that it is no contact but noise of another kind
_REACH = 4.0  # widths on either side beyond which a bump is nothing
_SHARE = 1 / 12  # of a repetition, the widest bump: it must not be most of what is compared
_STRIDE = 0.25  # of a width, from one position to the next
_QUANTILES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0)  # of speeds: noise is worst at rest
_FEWEST = 40  # samples that show a scale
_CLIP = 3.0  # standard deviations beyond which a sample tells nothing of the noise
_PEAKS = 5  # positions, with what surrounds them, that are no witnesses of the noise
_TAILS = (0.95, 0.99, 0.997)  # quantiles at which tails are measured
_QUARTER = 0.6745  # median of the absolute value of a standard normal variable
_LEAST_IN_TAIL = 5  # values beyond a quantile that show it
_DEGREES = np.array([3.0, 4, 5, 6, 8, 10, 14, 20, 30, 60, 200])  # of freedom: how heavy tails are


@dataclass(frozen=True)
class Bump:
    """A burst in one repetition: amplitude exp(-((t - time) / width)^2 / 2).

    Attributes
    ----------
    run : its place among the runs.
    number : of the recording, see `Recording.number`.
    repetition : from 0.
    joint : name.
    time : s, in the session.
    width : s.
    amplitude : N m or N.
    p_value : that noise alone shows its like anywhere in the data, see `LEVEL`.
    """

    run: int
    number: int
    repetition: int
    joint: str
    time: float
    width: float
    amplitude: float
    p_value: float


@dataclass(frozen=True, eq=False)
class Repeated:
    """The residual of one joint in the repetitions of one recording.

    Attributes
    ----------
    run, number, joint : as in `Bump`.
    t : (P, S) s, in the session.
    residual : (P, S) N m or N.
    speed : (P, S) rad/s or m/s.
    """

    run: int
    number: int
    joint: str
    t: np.ndarray
    residual: np.ndarray
    speed: np.ndarray

    @property
    def step(self) -> float:
        """Time from one instant to the next, s."""
        return float(np.median(np.diff(self.t, axis=1)))


def find_contacts(store: ColumnStore, present: Present) -> tuple[Bump, ...]:
    """Find bursts in single repetitions; the most significant first.

    Parameters
    ----------
    store, present : the runs, and the model whose residual is compared; a poor model will do.

    Returns
    -------
    None at all where nothing repeats.
    """
    found = []
    folded = residuals(store, present.model, present.values)
    for r, (run, residual) in enumerate(zip(store.runs, folded, strict=True)):
        if run.kind != "repeated" or len(run.index) < 2:
            continue
        first, recording = run.versions[0], run.recording
        for j, joint in enumerate(recording.joints):
            found.append(
                Repeated(
                    r,
                    recording.number,
                    joint,
                    first.t[run.index] + recording.start,
                    residual[:, :, j],
                    first.v[:, j][run.index],
                )
            )
    return bumps_in(found)


def bumps_in(data: Sequence[Repeated]) -> tuple[Bump, ...]:
    """Find bumps in residuals of any joints and recordings; the most significant first."""
    left, found = list(data), []
    while len(found) < _MOST:
        best = _best(left)
        if best is None or best.p_value >= LEVEL:
            break
        found.append(best)
        left = [_cleared(one, best) for one in left]
    return tuple(sorted(found, key=lambda bump: bump.p_value))


def without(run: Run, bumps: Sequence[Bump]) -> Run:
    """Return a run without the instants of bumps, in all repetitions.

    That is four widths on either side, or a quarter of the repetition where that is less.

    Parameters
    ----------
    run : Run
    bumps : of this run; others must not be among them.
    """
    if not bumps:
        return run
    t = run.versions[0].t[run.index] + run.recording.start
    kept = np.ones(t.shape[1], dtype=bool)
    for bump in bumps:
        reach = min(_REACH * bump.width, float(t[0, -1] - t[0, 0]) / 4)
        kept &= ~np.any(np.abs(t - bump.time) < reach, axis=0)
    before = np.concatenate([[0], np.cumsum(kept)])
    left_out = ~run.kept
    left_out[run.index[:, ~kept].ravel()] = True
    return replace(
        run, index=run.index[:, kept], edges=np.unique(before[run.edges]), left_out=left_out
    )


# --- one search ---------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Prepared:
    """Differences of one series, in the order of time, with their noise.

    Attributes
    ----------
    of : the series.
    change : (P S,) what each repetition does not share with the others.
    still : (P S,) one over the noise's local standard deviation.
    colour : (ORDER + 1,) whitening filter.
    """

    of: Repeated
    change: np.ndarray
    still: np.ndarray
    colour: np.ndarray

    def match(self, signal: np.ndarray, rows: np.ndarray, width: float) -> np.ndarray:
        """Fit bumps of a width (in rows) at rows (M,), any real numbers, to a signal (P S,).

        Returns
        -------
        (2, M) z value under Gaussian noise, and amplitude.
        """
        length = len(signal)
        half = int(np.ceil(_REACH * width))
        around = np.round(rows).astype(int)[:, None] + np.arange(-half, half + 1 + ORDER)
        inside = (around >= 0) & (around < length)
        at = np.clip(around, 0, length - 1)
        bump = np.exp(-(((around - rows[:, None]) / width) ** 2) / 2) * inside
        template = lfilter(self.colour, [1.0], bump * self.still[at], axis=1) * inside
        white = lfilter(self.colour, [1.0], signal * self.still)
        product = np.sum(template * white[at], axis=1)
        power = np.maximum(np.sum(template**2, axis=1), 1e-300)
        return np.stack([product / np.sqrt(power), product / power])


def _scanned(one: _Prepared, width: float) -> np.ndarray:
    """The z value of `_Prepared.match` at every row, (P S,), by convolutions."""
    half = int(np.ceil(_REACH * width))
    bump = np.exp(-((np.arange(-half, half + 1) / width) ** 2) / 2)
    white = lfilter(one.colour, [1.0], one.change * one.still)
    back = lfilter(one.colour, [1.0], white[::-1])[::-1] * one.still
    product = _convolved(back, bump)
    # The whitened bump's square: over the lags that the filter mixes.
    power = np.zeros(len(back))
    for lag in range(min(len(one.colour), len(bump))):
        both = float(one.colour[: len(one.colour) - lag] @ one.colour[lag:])
        pairs = one.still[: len(back) - lag] * one.still[lag:]
        kernel = bump[: len(bump) - lag] * bump[lag:]
        full = np.pad(oaconvolve(pairs, kernel[::-1]), len(one.colour))
        start = len(one.colour) + half - lag
        power += (1.0 if lag == 0 else 2.0) * both * full[start : start + len(back)]
    return product / np.sqrt(np.maximum(power, 1e-300))


def _convolved(signal: np.ndarray, bump: np.ndarray) -> np.ndarray:
    half = len(bump) // 2
    return oaconvolve(signal, bump)[half : half + len(signal)]


def _best(data: Sequence[Repeated]) -> Bump | None:
    """The most significant bump, whether it is or not."""
    by_joint = {one.joint: [s for s in data if s.joint == one.joint] for one in data}
    found, positions = [], 0
    for series in by_joint.values():
        places = _places(_prepare(series, [np.zeros(s.t.shape[1], dtype=bool) for s in series]))
        if not places:
            continue
        # Once more, by noise measured without what stands out most.
        peak = min(places)
        places = _places(_prepare(series, [_about(peak, k, s) for k, s in enumerate(series)]))
        found += places
        positions += sum(place.tried for place in places)
    if not found:
        return None
    best = min(found)
    return _refined(best, min(1.0, best.chance * positions))


@dataclass(frozen=True, order=True)
class _Place:
    """The place at which a bump of one width stands out most.

    Attributes
    ----------
    chance : probability of its like there under noise alone.
    series : whose it is, among those of its joint.
    row, width : in rows.
    tried : number of places of that width.
    of : the series.
    """

    chance: float
    series: int
    row: float
    width: float
    tried: int
    of: _Prepared = field(compare=False)


def _places(prepared: Sequence[_Prepared]) -> list[_Place]:
    """The best place of each width, for the series of one joint."""
    found, degrees = [], 0.0
    for width in WIDTHS:
        tried = _tried(prepared, width)
        if tried is None:
            continue
        # Single samples, of which there are most, show how heavy the tails are.
        degrees = degrees or _degrees(tried.z[tried.witnesses(width)])
        best = int(np.argmax(tried.z))
        k = int(tried.series[best])
        rows = width / prepared[k].of.step
        chance = _chance(float(tried.z[best]), degrees, rows)
        found.append(_Place(chance, k, float(tried.rows[best]), rows, len(tried.z), prepared[k]))
    return found


def _about(peak: _Place, k: int, one: Repeated) -> np.ndarray:
    """Instants (S,) of a series about a peak, in whichever repetition it is."""
    instants = one.t.shape[1]
    away = np.abs(np.arange(instants) - peak.row % instants)
    return (k == peak.series) & (away < min(3 * peak.width, instants / 8))


@dataclass(frozen=True, eq=False)
class _Tried:
    """Bumps of one width at M places.

    Attributes
    ----------
    z : (M,) absolute z values.
    series : (M,) whose they are.
    rows : (M,) where they are in it.
    instants : (M,) s, where they are in the period.
    """

    z: np.ndarray
    series: np.ndarray
    rows: np.ndarray
    instants: np.ndarray

    def witnesses(self, width: float) -> np.ndarray:
        """Which places tell the noise: not those about the peaks, in any repetition of these."""
        kept = np.ones(len(self.z), dtype=bool)
        for _ in range(_PEAKS):
            peak = np.argmax(np.where(kept, self.z, -1.0))
            near = np.abs(self.instants - self.instants[peak]) < _REACH * width
            fewer = kept & ~(near & (self.series == self.series[peak]))
            if fewer.sum() < len(kept) / 2:
                break
            kept = fewer
        return kept


def _tried(prepared: Sequence[_Prepared], width: float) -> _Tried | None:
    """Try bumps of a width (s) everywhere; None where it is too wide for every series."""
    parts = []
    for k, one in enumerate(prepared):
        repetitions, instants = one.of.residual.shape
        rows_wide = width / one.of.step
        if rows_wide > _SHARE * instants:
            continue
        rows = np.arange(0, repetitions * instants, max(1, int(_STRIDE * rows_wide)))
        z = np.abs(_scanned(one, rows_wide)[rows])
        # Where a whole repetition is unlike the others, no place in it stands out.
        of = rows // instants
        usual = [_usual(z[of == p], rows[of == p], rows_wide) for p in range(repetitions)]
        z = z / np.maximum(usual, 1.0)[of]
        parts.append((z, np.full(len(rows), k), rows, rows % instants * one.of.step))
    return _Tried(*(np.concatenate(part) for part in zip(*parts, strict=True))) if parts else None


def _usual(z: np.ndarray, rows: np.ndarray, width: float) -> float:
    """Standard deviation of z values (M,) as their median says it, but for those at the largest."""
    away = np.abs(rows - rows[np.argmax(z)]) > 3 * width
    return float(np.median(z[away] if away.any() else z)) / _QUARTER


def _degrees(z: np.ndarray) -> float:
    """Degrees of freedom of Student's distribution with tails like these, at their heaviest."""
    middle = max(float(np.median(z)), 1e-300)
    quarter = student.ppf(0.75, _DEGREES)
    return min(
        float(np.interp(-value / middle, -student.ppf(0.5 + q / 2, _DEGREES) / quarter, _DEGREES))
        for q, value in zip(_TAILS, np.quantile(z, _TAILS), strict=True)
        if (1 - q) * len(z) >= _LEAST_IN_TAIL or q == _TAILS[0]
    )


def _chance(z: float, degrees: float, width: float) -> float:
    """Probability of a value as large as z at one place.

    A bump of many rows is a mean of so many samples, whose excess kurtosis falls with their number;
    half of them count, because noise comes in flocks.
    """
    more = max(degrees - 4.0, 0.5) * max(1.0, width / 2)
    wide = max(degrees, 4.0 + more) if width > 2 else degrees
    return 2 * float(student.sf(z / (student.ppf(0.75, wide) / _QUARTER) ** -1, wide))


def _refined(place: _Place, p_value: float) -> Bump:
    """The bump with its best time and width, in the repetition where it is."""
    one, row, width = place.of, place.row, place.width
    least, most = WIDTHS[0] / one.of.step, _SHARE * one.of.residual.shape[1]

    def misfit(x: np.ndarray) -> float:
        wide = width * np.exp(np.clip(x[1], -0.7, 0.7))
        return -abs(float(one.match(one.change, row + width * x[:1], wide)[0, 0]))

    start = np.array([[0.0, 0.0], [0.3, 0.0], [0.0, 0.3]])
    options = {"initial_simplex": start, "maxfev": 60, "xatol": 1e-3, "fatol": 1e-6}
    x = minimize(misfit, start[0], method="Nelder-Mead", options=options).x
    row = float(np.clip(row + width * x[0], 0, one.change.size - 1))
    width = float(np.clip(width * np.exp(np.clip(x[1], -0.7, 0.7)), least, max(most, least)))
    repetitions, instants = one.of.residual.shape
    amplitude = float(one.match(one.change, np.array([row]), width)[1, 0])
    if repetitions == 2:
        # The difference of two is the same in both: the burst is where the residual is larger.
        twin = row + instants if row < instants else row - instants
        sizes = one.match(one.of.residual.ravel(), np.array([row, twin]), width)[1]
        if abs(sizes[1]) > abs(sizes[0]):
            row, amplitude = twin, -amplitude
    time = float(np.interp(row, np.arange(one.change.size), one.of.t.ravel()))
    return Bump(
        one.of.run,
        one.of.number,
        int(row // instants),
        one.of.joint,
        time,
        width * one.of.step,
        amplitude,
        p_value,
    )


def _cleared(one: Repeated, bump: Bump) -> Repeated:
    """Return a series without a bump that was found in it."""
    if (one.run, one.joint) != (bump.run, bump.joint):
        return one
    shape = np.exp(-(((one.t - bump.time) / bump.width) ** 2) / 2)
    return replace(one, residual=one.residual - bump.amplitude * shape)


# --- the noise ----------------------------------------------------------------------------------


def _prepare(series: Sequence[Repeated], left_out: Sequence[np.ndarray]) -> list[_Prepared]:
    """Differences of all series of one joint, with the noise that they have in common.

    `left_out` are the instants (S,) of each series that are no witnesses of the noise.
    """
    kept = [~np.tile(out, len(s.t)) for s, out in zip(series, left_out, strict=True)]
    changes = [_changes(s, ~out) for s, out in zip(series, left_out, strict=True)]
    still = [np.ones(len(change)) for change in changes]
    # Noise follows the speed itself, or, once filtered, the least speed near by.
    for measure in (np.abs, _slowness):
        speeds = [measure(one.speed).ravel() for one in series]
        sizes = [np.abs(c * i)[k] for c, i, k in zip(changes, still, kept, strict=True)]
        witnesses = [s[k] for s, k in zip(speeds, kept, strict=True)]
        at, scales = _scales(np.concatenate(sizes), np.concatenate(witnesses))
        still = [i / np.interp(s, at, scales) for i, s in zip(still, speeds, strict=True)]
    stretches = []
    for change, own, keep in zip(changes, still, kept, strict=True):
        clipped = np.clip(change * own, -_CLIP, _CLIP)
        borders = np.flatnonzero(np.diff(keep)) + 1
        parts = zip(np.split(clipped, borders), np.split(keep, borders), strict=True)
        stretches += [part for part, inside in parts if inside[0] and len(part) > 2 * ORDER]
    # The scale is in `still` already: of this model only the colour is used.
    noise = measure_noise(stretches, [np.zeros(len(part)) for part in stretches])
    colour = noise.colour / noise.std
    return [
        _Prepared(one, change, own, colour)
        for one, change, own in zip(series, changes, still, strict=True)
    ]


def _changes(one: Repeated, kept: np.ndarray) -> np.ndarray:
    """What each repetition does not share with the others' mean, (P S,).

    Less a level and friction of its own, fitted to the instants `kept` (S,) so that bursts have
    little say.
    """
    count = len(one.residual)
    others = (one.residual.sum(axis=0) - one.residual) / (count - 1)
    found = one.residual - others
    for change, v in zip(found, one.speed, strict=True):
        columns = np.column_stack([np.ones_like(v), v, np.tanh(v / FRICTION_WIDTH)])
        weight, rest = kept.astype(float), change
        for step in range(10):
            root = np.sqrt(weight)
            x = np.linalg.lstsq(columns * root[:, None], change * root, rcond=1e-8)[0]
            rest = change - columns @ x
            usual = 1.4826 * float(np.median(np.abs(rest[kept])))
            size = np.abs(rest) / max(usual, 1e-300)
            # Huber's weights find the bulk; Tukey's then forget what is far from it.
            huber = np.minimum(1.0, 1.345 / np.maximum(size, 1e-9))
            tukey = np.maximum(1.0 - (size / 4.685) ** 2, 0.0) ** 2
            weight = kept * (huber if step < 4 else tukey)
        change[:] = rest
    return found.ravel()


def _slowness(speed: np.ndarray) -> np.ndarray:
    """Least absolute speed within two rows, (P, S); zero where the motion turns round."""
    padded = np.pad(speed, ((0, 0), (2, 2)), mode="edge")
    near = np.stack([padded[:, k : k + speed.shape[1]] for k in range(5)])
    turns = (near.min(axis=0) < 0) & (near.max(axis=0) > 0)
    return np.where(turns, 0.0, np.abs(near).min(axis=0))


def _scales(sizes: np.ndarray, slowness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Speeds and the noise's standard deviation there, from the 90 % quantile of its size."""
    order = np.argsort(slowness, kind="stable")
    edges = np.unique((np.array(_QUANTILES) * len(order)).astype(int))
    # Turning points are a kind of their own, be they many or few.
    turning = int(np.sum(slowness == 0.0))
    edges = np.unique([0, turning, *edges[edges > turning], len(order)])
    at, scales, start = [], [], 0
    for stop in edges[1:]:
        if stop - start < _FEWEST and stop < len(order):
            continue
        rows = order[start:stop]
        at.append(float(slowness[rows].mean()))
        scales.append(float(np.quantile(sizes[rows], 0.9)) / 1.645)
        start = stop
    least = 1e-3 * max(max(scales), 1e-300)
    return np.array(at), np.maximum(scales, least)
