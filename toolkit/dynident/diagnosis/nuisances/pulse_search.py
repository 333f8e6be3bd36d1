"""Contacts: bursts in one repetition of a period only, found in what repetitions do not share.

What a model lacks is the same in every repetition and cancels in their differences; so does not a
push. What changes slowly, a level or friction that falls as a drive warms up, is taken out of
every repetition before. The rest is whitened by a noise model that a burst cannot inflate, and
searched by matched filters: Gaussian pulses of many widths at all times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import minimize

from dynident.criteria import ContactCriteria, Criteria
from dynident.diagnosis.nuisances.changes import (
    QUARTER,
    Changes,
    Repeated,
    chance_of,
    changes_of,
    degrees_of_freedom,
    scanned,
)
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, residuals
from dynident.evidence.runs import Run
from dynident.fitting.sampling import Sampled


@dataclass(frozen=True, kw_only=True)
class DisturbancePulse:
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
    p_value : that noise alone shows its like anywhere in the data, see `ContactCriteria`.
    """

    run: int
    number: int
    repetition: int
    joint: str
    time: float
    width: float
    amplitude: float
    p_value: float


def find_contacts(evidence: Evidence, fitted: EvidenceFit) -> tuple[DisturbancePulse, ...]:
    """Find bursts in single repetitions; the most significant first.

    Parameters
    ----------
    evidence, fitted : the runs, and the model whose residual is compared; a poor model will do.

    Returns
    -------
    None at all where nothing repeats.
    """
    found = []
    folded = residuals(evidence, fitted.model, fitted.values)
    for r, (run, residual) in enumerate(zip(evidence.runs, folded, strict=True)):
        if run.kind != "repeated" or len(run.index) < 2:
            continue
        first, recording = run.replicates[0], run.recording
        seen = ~np.any(_made_up(first)[run.index], axis=0)
        for j, joint in enumerate(recording.joints):
            if not run.certain(j).any() or _is_rounding(evidence, run, residual[:, :, j], j):
                continue
            found.append(
                Repeated(
                    run=r,
                    number=recording.number,
                    joint=joint,
                    t=first.t[run.index] + recording.start,
                    residual=residual[:, :, j],
                    speed=first.v[:, j][run.index],
                    certain=run.certain(j) & seen,
                )
            )
    return pulses_in(found, evidence.criteria)


def _made_up(sampled: Sampled) -> np.ndarray:
    """Rows (T,) that filters make up beyond the ends of a recording, where a study keeps them."""
    filter, rate = sampled.parallel.filter, sampled.recording.rate_hz
    margins = np.array(replace(filter, ends="drop").margins(rate)) / rate
    begin, end = margins + sampled.parallel.transient
    t = sampled.recording.t
    return (sampled.t < t[0] + begin) | (sampled.t > t[-1] - end)


def _is_rounding(evidence: Evidence, run: Run, residual: np.ndarray, joint: int) -> bool:
    """Whether repetitions, (P, S), differ by no more than nothing can resolve."""
    differences = residual - residual.mean(axis=0)
    torque = run.replicates[0].tau[run.index, joint]
    size, all_of_it = (float(np.sqrt(np.mean(x**2))) for x in (differences, torque))
    return size <= evidence.criteria.verdict.resolution * all_of_it


def pulses_in(data: Sequence[Repeated], criteria: Criteria) -> tuple[DisturbancePulse, ...]:
    """Find pulses in residuals of any joints and recordings; the most significant first."""
    by_joint = {one.joint: [s for s in data if s.joint == one.joint] for one in data}
    places = {joint: _place(series, criteria) for joint, series in by_joint.items()}
    found: list[DisturbancePulse] = []
    while len(found) < criteria.contacts.most:
        best = _best([one for one in places.values() if one is not None], criteria.contacts)
        if best is None:
            break
        found.append(best)
        by_joint[best.joint] = [_cleared(one, best) for one in by_joint[best.joint]]
        places[best.joint] = _place(by_joint[best.joint], criteria)
    return tuple(sorted(found, key=lambda pulse: pulse.p_value))


def without(run: Run, pulses: Sequence[DisturbancePulse], criteria: ContactCriteria) -> Run:
    """Return a run without the instants of pulses, in all repetitions.

    That is some widths on either side, or a share of the repetition where that is less.

    Parameters
    ----------
    run : Run
    pulses : of this run; others must not be among them.
    criteria : how much is left out.
    """
    if not pulses:
        return run
    t = run.replicates[0].t[run.index] + run.recording.start
    kept = np.ones(t.shape[1], dtype=bool)
    for pulse in pulses:
        reach = min(criteria.reach * pulse.width, criteria.left_out * float(t[0, -1] - t[0, 0]))
        kept &= ~np.any(np.abs(t - pulse.time) < reach, axis=0)
    before = np.concatenate([[0], np.cumsum(kept)])
    left_out = ~run.kept
    left_out[run.index[:, ~kept].ravel()] = True
    return replace(
        run, index=run.index[:, kept], edges=np.unique(before[run.edges]), left_out=left_out
    )


# --- one search ---------------------------------------------------------------------------------


def _best(
    places: Sequence[tuple[_PulsePlace, int]], criteria: ContactCriteria
) -> DisturbancePulse | None:
    """The most significant pulse; None where none is.

    Parameters
    ----------
    places : of each joint, with how many were tried there.
    criteria : what is significant.
    """
    if not places:
        return None
    best = min(place for place, _ in places)
    p_value = min(1.0, best.chance * sum(tried for _, tried in places))
    if p_value >= criteria.level:
        return None
    return _refined(best, p_value, criteria)


def _place(series: Sequence[Repeated], criteria: Criteria) -> tuple[_PulsePlace, int] | None:
    """Where a pulse stands out most at a joint, and how many places were tried; None for none."""
    nothing = [np.zeros(s.t.shape[1], dtype=bool) for s in series]
    places = _places(changes_of(series, nothing, criteria), criteria.contacts)
    if not places:
        return None
    return _looked_at(min(places), series, criteria), sum(place.tried for place in places)


def _looked_at(peak: _PulsePlace, series: Sequence[Repeated], criteria: Criteria) -> _PulsePlace:
    """What stands out most, by noise measured without it.

    A burst hides behind itself at first: in the slow changes, and in the noise's scale and tails.
    The first closer look is believed whatever it shows; others, while they raise it, find its
    place and width better.
    """
    for look in range(criteria.contacts.looks):
        if peak.chance > criteria.contacts.worth_a_look:
            break
        about = [_about(peak, k, s, criteria.contacts) for k, s in enumerate(series)]
        places = _places(changes_of(series, about, criteria), criteria.contacts)
        if not places or (look and min(places) >= peak):
            break
        peak = min(places)
    return peak


@dataclass(frozen=True, order=True)
class _PulsePlace:
    """The place at which a pulse of one width stands out most.

    Attributes
    ----------
    chance : probability of its like there under noise alone.
    short_of : minus its z value, which tells places apart whose chance is too small for a number.
    series : whose it is, among those of its joint.
    row, width : in rows.
    tried : number of places of that width.
    of : the series.
    """

    chance: float
    short_of: float
    series: int
    row: float
    width: float
    tried: int
    of: Changes = field(compare=False)


def _widths(criteria: ContactCriteria) -> list[float]:
    """Widths of the pulses that are sought, s."""
    return np.geomspace(criteria.narrowest, criteria.widest, criteria.widths).tolist()


def _places(prepared: Sequence[Changes], criteria: ContactCriteria) -> list[_PulsePlace]:
    """The best place of each width, for the series of one joint."""
    found, narrowest = [], None
    for width in _widths(criteria):
        tried = _tried(prepared, width, criteria)
        if tried is None:
            continue
        best = int(np.argmax(tried.z))
        k = int(tried.series[best])
        rows = width / prepared[k].of.step
        row = float(tried.rows[best])
        # Single samples, of which there are most, show how heavy the tails are: but not those
        # that this pulse covers, which would speak against itself.
        narrowest = narrowest or (tried, tried.witnesses(width, criteria))
        single, witnesses = narrowest
        apart = np.abs(single.instants - tried.instants[best]) > criteria.reach * width
        away = witnesses & (apart | (single.series != k))
        degrees = degrees_of_freedom(single.own[away if away.any() else witnesses], criteria)
        z = float(tried.z[best]) * prepared[k].certainty(row, rows)
        chance = chance_of(z, degrees, rows)
        found.append(_PulsePlace(chance, -z, k, row, rows, len(tried.z), prepared[k]))
    return found


def _about(peak: _PulsePlace, k: int, one: Repeated, criteria: ContactCriteria) -> np.ndarray:
    """Instants (S,) of a series about a peak, in whichever repetition it is."""
    instants = one.t.shape[1]
    away = np.abs(np.arange(instants) - peak.row % instants)
    return (k == peak.series) & (away < min(criteria.peak_reach * peak.width, instants / 8))


@dataclass(frozen=True, eq=False)
class _Tried:
    """Pulses of one width at M places.

    Attributes
    ----------
    z : (M,) absolute z values.
    own : (M,) the same, each over what is usual in its repetition.
    series : (M,) whose they are.
    rows : (M,) where they are in it.
    instants : (M,) s, where they are in the period.
    """

    z: np.ndarray
    own: np.ndarray
    series: np.ndarray
    rows: np.ndarray
    instants: np.ndarray

    def witnesses(self, width: float, criteria: ContactCriteria) -> np.ndarray:
        """Which places show the noise: not those about the peaks, in any repetition of these."""
        kept = np.ones(len(self.z), dtype=bool)
        for _ in range(criteria.peaks):
            peak = np.argmax(np.where(kept, self.z, -1.0))
            near = np.abs(self.instants - self.instants[peak]) < criteria.reach * width
            fewer = kept & ~(near & (self.series == self.series[peak]))
            if fewer.sum() < len(kept) / 2:
                break
            kept = fewer
        return kept


def _tried(prepared: Sequence[Changes], width: float, criteria: ContactCriteria) -> _Tried | None:
    """Try pulses of a width (s) everywhere; None where it is too wide for every series."""
    parts = []
    for k, one in enumerate(prepared):
        repetitions, instants = one.of.residual.shape
        rows_wide = width / one.of.step
        if rows_wide > criteria.widest_share * instants:
            continue
        rows = np.arange(0, repetitions * instants, max(1, int(criteria.stride * rows_wide)))
        rows = rows[one.whole[rows]]
        if len(np.unique(rows // instants)) < repetitions:
            continue
        z = np.abs(scanned(one, rows_wide)[rows])
        # Where a whole repetition is unlike the others, no place in it stands out.
        of, reach = rows // instants, criteria.peak_reach
        usual = [_usual(z[of == p], rows[of == p], reach * rows_wide) for p in range(repetitions)]
        own = z / np.maximum(usual, 1e-300)[of]
        z = z / np.maximum(usual, 1.0)[of]
        parts.append((z, own, np.full(len(rows), k), rows, rows % instants * one.of.step))
    return _Tried(*(np.concatenate(part) for part in zip(*parts, strict=True))) if parts else None


def _usual(z: np.ndarray, rows: np.ndarray, reach: float) -> float:
    """Standard deviation of z values (M,) as their median says it, but for those at the largest."""
    away = np.abs(rows - rows[np.argmax(z)]) > reach
    return float(np.median(z[away] if away.any() else z)) / QUARTER


def _refined(place: _PulsePlace, p_value: float, criteria: ContactCriteria) -> DisturbancePulse:
    """The pulse with its best time and width, in the repetition where it is."""
    one = place.of
    least = criteria.narrowest / one.of.step
    most = criteria.widest_share * one.of.residual.shape[1]
    # The width that is least probable under noise alone need not be the one that fits best.
    near = place.row + place.width * np.linspace(-2.0, 2.0, 17)
    widths = [w for w in np.array(_widths(criteria)) / one.of.step if w <= max(most, least)]
    fits = np.abs([one.match(one.change, near, w)[0] for w in (place.width, *widths)])
    best = np.unravel_index(int(np.argmax(fits)), fits.shape)
    row, width = float(near[best[1]]), (place.width, *widths)[best[0]]

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
    return DisturbancePulse(
        run=one.of.run,
        number=one.of.number,
        repetition=int(row // instants),
        joint=one.of.joint,
        time=time,
        width=width * one.of.step,
        amplitude=amplitude,
        p_value=p_value,
    )


def _cleared(one: Repeated, pulse: DisturbancePulse) -> Repeated:
    """Return a series without a pulse that was found in it."""
    if (one.run, one.joint) != (pulse.run, pulse.joint):
        return one
    shape = np.exp(-(((one.t - pulse.time) / pulse.width) ** 2) / 2)
    return replace(one, residual=one.residual - pulse.amplitude * shape)
