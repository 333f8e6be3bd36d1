"""What one repetition does not share with the others, whitened, and pulses fitted to it.

What changes slowly, a level or friction that falls as a drive warms up, is taken out of every
repetition before. Bursts are to have no say in the noise model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from scipy.special import stdtr, stdtrit

from dynident.criteria import ContactCriteria, Criteria
from dynident.effects import FRICTION_WIDTH
from dynident.evidence.noise_model import SpeedClasses, measure_noise

_DEPENDENT = 1e-8
"""Size of a direction of the slow changes over the largest, below which it is none."""
QUARTER = 0.6745
"""Median of the absolute value of a standard normal variable."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Repeated:
    """The residual of one joint in the repetitions of one recording.

    Attributes
    ----------
    run, number, joint : as in `DisturbancePulse`.
    t : (P, S) s, in the session.
    residual : (P, S) N m or N.
    speed : (P, S) rad/s or m/s.
    certain : (S,) instants that count: where the joint sticks, repetitions differ without a push.
    """

    run: int
    number: int
    joint: str
    t: np.ndarray
    residual: np.ndarray
    speed: np.ndarray
    certain: np.ndarray

    @cached_property
    def step(self) -> float:
        """Time from one instant to the next, s."""
        return float(np.median(np.diff(self.t, axis=1)))

    @cached_property
    def _known(self) -> dict[tuple[bytes, ContactCriteria], np.ndarray]:
        return {}

    def changes(self, kept: np.ndarray, criteria: ContactCriteria) -> np.ndarray:
        """As `_changes`, worked out once: looks about a peak leave the other series as they are.

        Parameters
        ----------
        kept : (S,) instants that count.
        criteria : of contacts.
        """
        asked = kept.tobytes(), criteria
        found = self._known.get(asked)
        if found is None:
            found = self._known[asked] = _changes(self, kept, criteria)
            found.setflags(write=False)
        return found


@dataclass(frozen=True, eq=False, kw_only=True)
class Changes:
    """Differences of one series, in the order of time, with their noise.

    The filter looks back. Behind instants that do not count, the noise that it expects is not
    known, and what it leaves there is larger than elsewhere, the smoother the noise the more: these
    rows say nothing of a pulse.

    Attributes
    ----------
    of : the series.
    change : (P S,) what each repetition does not share with the others.
    still : (P S,) one over the noise's local standard deviation; zero where no instant counts.
    colour : (order + 1,) whitening filter.
    kept : (S,) instants to which the slow changes were fitted.
    reach : widths on either side beyond which a pulse is nothing.
    """

    of: Repeated
    change: np.ndarray
    still: np.ndarray
    colour: np.ndarray
    kept: np.ndarray
    reach: float

    @cached_property
    def whole(self) -> np.ndarray:
        """Rows (P S,) before which all that the whitening filter looks back to counts, a mask.

        Not the first instants, before which one repetition has none.
        """
        counts = (self.still > 0).astype(float)
        lost = len(self.colour) - _filtered(np.ones(len(self.colour)), counts)
        known = (lost < 0.5).reshape(self.of.residual.shape)
        # Alike in all repetitions: what one shows is seen, the other way round, in the others.
        return np.tile(known.all(axis=0), len(known))

    def whitened(self, x: np.ndarray, whole: np.ndarray) -> np.ndarray:
        """Samples (T, ...) over the noise; zero where that is not known.

        Parameters
        ----------
        x : over the noise's local standard deviation.
        whole : (T, ...) of these samples.
        """
        return _filtered(self.colour, x) * whole

    @cached_property
    def spectra(self) -> tuple[int, np.ndarray]:
        """What pulses of all widths are convolved with, transformed: see `scanned`.

        Returns
        -------
        Samples of the transform; and the transforms (1 + lags, ...) of the whitened series,
        filtered backward, and of the scales' products at each lag with what the filter makes of
        them in rows that count.
        """
        rows, lags = len(self.change), range(min(len(self.colour), len(self.change)))
        size = int(scipy.fft.next_fast_len(2 * rows, real=True))
        white = self.whitened(self.change * self.still, self.whole)
        signals = np.zeros((1 + len(lags), rows))
        back = _filtered(self.colour, white[::-1])[::-1]
        signals[0] = back * self.still
        for lag in lags:
            both = self.colour[: len(self.colour) - lag] * self.colour[lag:]
            seen = _filtered(both, self.whole[::-1])[::-1][lag:]
            signals[1 + lag, : rows - lag] = self.still[: rows - lag] * self.still[lag:] * seen
        return size, scipy.fft.rfft(signals, size, axis=1)

    def certainty(self, row: float, width: float) -> float:
        """Share of a pulse's z value that is left for two doubts.

        The slow changes are not known exactly. And one sample that is far out is no pulse: what is
        left of z without the sample that speaks for it most.

        Parameters
        ----------
        row, width : of the pulse, in rows.
        """
        instants = len(self.kept)
        p = int(row // instants)
        own = slice(p * instants, (p + 1) * instants)
        pulse = np.exp(-(((np.arange(own.start, own.stop) - row) / width) ** 2) / 2)
        columns = np.column_stack([self.change[own], pulse, *_slow(self.of.speed[p]).T])
        columns = columns * self.still[own, None]
        white = self.whitened(columns, self.whole[own, None])
        change, pulse, slow = white[:, 0], white[:, 1], white[:, 2:]
        power = max(float(pulse @ pulse), 1e-300)
        along = slow.T @ pulse
        unknown = along @ np.linalg.pinv(slow[self.kept].T @ slow[self.kept], 1e-10) @ along
        parts = pulse * change
        total = float(parts.sum())
        largest = int(np.argmax(parts * np.sign(total)))
        rest = max(power - float(pulse[largest] ** 2), 1e-300)
        alone = (total - float(parts[largest])) / total * np.sqrt(power / rest) if total else 1.0
        return float(np.clip(alone, 0.0, 1.0) / np.sqrt(1.0 + unknown / power))

    def match(self, signal: np.ndarray, rows: np.ndarray, width: float) -> np.ndarray:
        """Fit Gaussian pulses of one width to a signal.

        Parameters
        ----------
        signal : (P S,) N m or N
            Torque that is searched, as `change`.
        rows : (M,)
            Centres of the pulses, any real numbers.
        width : rows
            From the centre to where a pulse is 1/e of its height.

        Returns
        -------
        (2, M) z value under Gaussian noise, and amplitude.
        """
        length = len(signal)
        half = int(np.ceil(self.reach * width))
        around = np.round(rows).astype(int)[:, None] + np.arange(-half, half + len(self.colour))
        inside = (around >= 0) & (around < length)
        at = np.clip(around, 0, length - 1)
        pulse = np.exp(-(((around - rows[:, None]) / width) ** 2) / 2) * inside
        template = self.whitened((pulse * self.still[at]).T, (self.whole[at] * inside).T).T
        white = self.whitened(signal * self.still, self.whole)
        product = np.sum(template * white[at], axis=1)
        power = np.maximum(np.sum(template**2, axis=1), 1e-300)
        return np.stack([product / np.sqrt(power), product / power])


def _filtered(colour: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Samples (T, ...) through a filter without feedback, zeros before the first."""
    if x.ndim == 1 and len(x):
        return np.convolve(x, colour)[: len(x)]
    found = np.zeros(x.shape)
    for lag, weight in enumerate(colour[: len(x)]):
        found[lag:] += weight * x[: len(x) - lag]
    return found


def scanned(one: Changes, width: float) -> np.ndarray:
    """The z value of `Changes.match` at every row that is whole, (P S,), by convolutions.

    All of them circular, over twice the rows, so that nothing comes round: what does not depend on
    the width is transformed once.
    """
    rows, (size, spectra) = len(one.change), one.spectra
    half = min(int(np.ceil(one.reach * width)), rows - 1)
    pulse = np.exp(-((np.arange(-half, half + 1) / width) ** 2) / 2)
    kernels = np.zeros((len(spectra), size))
    kernels[0, np.arange(-half, half + 1)] = pulse
    # The whitened pulse's square: over the lags that the filter mixes.
    for lag in range(min(len(spectra) - 1, len(pulse))):
        product = (1.0 if lag == 0 else 2.0) * pulse[: len(pulse) - lag] * pulse[lag:]
        kernels[1 + lag, np.arange(lag - half, half + 1)] = product[::-1]
    turned = spectra * scipy.fft.rfft(kernels, axis=1)
    product, power = scipy.fft.irfft([turned[0], turned[1:].sum(axis=0)], size, axis=1)[:, :rows]
    return np.where(one.whole, product / np.sqrt(np.maximum(power, 1e-300)), 0.0)


def changes_of(
    series: Sequence[Repeated], left_out: Sequence[np.ndarray], criteria: Criteria
) -> list[Changes]:
    """Differences of all series of one joint, with the noise that they have in common.

    `left_out` are the instants (S,) of each series that are no witnesses of the noise.

    Parameters
    ----------
    series : of one joint.
    left_out : instants (S,) of each that say nothing of the noise.
    criteria : of contacts and of the noise.

    Returns
    -------
    One for each series; none where no stretch of instants that count is long enough.
    """
    own_criteria, order = criteria.contacts, criteria.noise.order
    left_out = [out | ~s.certain for s, out in zip(series, left_out, strict=True)]
    certain = [np.tile(s.certain, len(s.t)) for s in series]
    every = np.concatenate(certain)
    kept = [~np.tile(out, len(s.t)) for s, out in zip(series, left_out, strict=True)]
    witnesses = np.concatenate(kept)[every]
    changes = [s.changes(~out, own_criteria) for s, out in zip(series, left_out, strict=True)]
    still = [np.ones(len(change)) for change in changes]
    # Noise follows the speed itself, or, once filtered, the least speed near by.
    for measure in (np.abs, _slowness):
        speeds = [measure(one.speed).ravel() for one in series]
        sizes = [np.abs(c * i) for c, i in zip(changes, still, strict=True)]
        at, scales = _scales(
            np.concatenate(sizes)[every], np.concatenate(speeds)[every], witnesses, own_criteria
        )
        still = [i / np.interp(s, at, scales) for i, s in zip(still, speeds, strict=True)]
    stretches = []
    for change, own, keep in zip(changes, still, kept, strict=True):
        clipped = np.clip(change * own, -own_criteria.clip, own_criteria.clip)
        borders = np.flatnonzero(np.diff(keep)) + 1
        parts = zip(np.split(clipped, borders), np.split(keep, borders), strict=True)
        stretches += [part for part, inside in parts if inside[0] and len(part) > 2 * order]
    still = [own * counts for own, counts in zip(still, certain, strict=True)]
    if not stretches:
        return []  # a joint that sticks, of which no stretch is long enough to show its noise
    # The scale is in `still` already: of this model only the colour is used.
    size = float(np.sqrt(np.mean(np.concatenate(stretches) ** 2)))
    at_rest = SpeedClasses.of([np.zeros(len(part)) for part in stretches], criteria.noise)
    noise = measure_noise(stretches, at_rest, criteria.noise, own_criteria.white_share * size)
    colour = noise.colour / (noise.std * noise.scales[0])
    return [
        Changes(
            of=one, change=change, still=own, colour=colour, kept=~out, reach=own_criteria.reach
        )
        for one, change, own, out in zip(series, changes, still, left_out, strict=True)
    ]


def _changes(one: Repeated, kept: np.ndarray, criteria: ContactCriteria) -> np.ndarray:
    """What each repetition does not share with the others' mean, (P S,).

    Less a level and friction of its own, fitted to the instants `kept` (S,) so that bursts have
    little say.
    """
    count = len(one.residual)
    others = (one.residual.sum(axis=0) - one.residual) / (count - 1)
    found = one.residual - others
    for change, v in zip(found, one.speed, strict=True):
        columns = _slow(v)
        turned, size, _ = np.linalg.svd(columns, full_matrices=False)
        # Orthonormal, so that their products with weights lose no digits.
        slow = np.ascontiguousarray(turned[:, size > _DEPENDENT * size[0]].T)
        weight, rest = kept.astype(float), change
        for step in range(10):
            weighted = slow * weight
            power, axes = np.linalg.eigh(weighted @ slow.T)
            if power[0] > _DEPENDENT * power[-1]:
                rest = change - axes @ ((axes.T @ (weighted @ change)) / power) @ slow
            else:  # over the instants that count they depend on each other
                root = np.sqrt(weight)
                scaled = columns * root[:, None], change * root
                rest = change - columns @ np.linalg.lstsq(*scaled, rcond=_DEPENDENT)[0]
            usual = 1.4826 * float(np.median(np.abs(rest[kept])))
            size = np.abs(rest) / max(usual, 1e-300)
            # Huber's weights find the bulk; Tukey's then forget what is far from it.
            huber = np.minimum(1.0, criteria.huber / np.maximum(size, 1e-9))
            tukey = np.maximum(1.0 - (size / criteria.tukey) ** 2, 0.0) ** 2
            weight = kept * (huber if step < 4 else tukey)
        change[:] = rest
    return found.ravel()


def _slow(speed: np.ndarray) -> np.ndarray:
    """Columns of what may change from repetition to repetition: a level and friction, (S, 3)."""
    return np.column_stack([np.ones_like(speed), speed, np.tanh(speed / FRICTION_WIDTH)])


def _slowness(speed: np.ndarray) -> np.ndarray:
    """Least absolute speed within two rows, (P, S); zero where the motion turns round."""
    padded = np.pad(speed, ((0, 0), (2, 2)), mode="edge")
    near = np.stack([padded[:, k : k + speed.shape[1]] for k in range(5)])
    turns = (near.min(axis=0) < 0) & (near.max(axis=0) > 0)
    return np.where(turns, 0.0, np.abs(near).min(axis=0))


def _scales(
    sizes: np.ndarray, slowness: np.ndarray, witnesses: np.ndarray, criteria: ContactCriteria
) -> tuple[np.ndarray, np.ndarray]:
    """Speeds and the noise's standard deviation there, from the 90 % quantile of its size.

    Parameters
    ----------
    sizes : (T,) of the changes.
    slowness : (T,) their speeds.
    witnesses : (T,) which of them a burst has no part in. They alone are asked at speeds at which
        there are enough of them; elsewhere all are, which may be the only ones that turn round.
    criteria : of contacts.

    Returns
    -------
    Speeds (K,), ascending, and standard deviations (K,).
    """
    order = np.argsort(slowness, kind="stable")
    edges = np.unique((np.array(criteria.speed_quantiles) * len(order)).astype(int))
    # Turning points are a kind of their own, be they many or few.
    turning = int(np.sum(slowness == 0.0))
    edges = np.unique([0, turning, *edges[edges > turning], len(order)])
    at, scales, start = [], [], 0
    for stop in edges[1:]:
        if stop - start < criteria.samples_per_scale and stop < len(order):
            continue
        rows = order[start:stop]
        at.append(float(slowness[rows].mean()))
        apart = rows[witnesses[rows]]
        rows = apart if len(apart) >= criteria.samples_per_scale else rows
        scales.append(float(np.quantile(sizes[rows], 0.9)) / 1.645)
        start = stop
    least = 1e-3 * max(max(scales), 1e-300)
    return np.array(at), np.maximum(scales, least)


# --- tails ---------------------------------------------------------------------------------------


def degrees_of_freedom(z: np.ndarray, criteria: ContactCriteria) -> float:
    """Degrees of freedom of Student's distribution with tails like these, at their heaviest."""
    middle = max(float(np.median(z)), 1e-300)
    degrees, tails = np.array(criteria.degrees), criteria.tails
    quarter = stdtrit(degrees, 0.75)
    return min(
        float(np.interp(-value / middle, -stdtrit(degrees, 0.5 + q / 2) / quarter, degrees))
        for q, value in zip(tails, np.quantile(z, tails), strict=True)
        if (1 - q) * len(z) >= criteria.least_in_tail or q == tails[0]
    )


def chance_of(z: float, degrees: float, width: float) -> float:
    """Probability of a value as large as z at one place.

    A pulse of many rows is a mean of so many samples, whose excess kurtosis falls with their
    number; half of them count, because noise comes in flocks.

    Parameters
    ----------
    z : the value, over the standard deviation of the noise.
    degrees : of freedom, see `degrees_of_freedom`.
    width : of the pulse, in rows.

    Returns
    -------
    Two-sided probability.
    """
    more = max(degrees - 4.0, 0.5) * max(1.0, width / 2)
    wide = max(degrees, 4.0 + more) if width > 2 else degrees
    return 2 * float(stdtr(wide, -z * stdtrit(wide, 0.75) / QUARTER))
