"""What the pictures of a diagnosis show, whichever library draws them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from dynident.diagnosis.details import Candidate, Step, Trace
from dynident.diagnosis.effect_groups import grouped_title
from dynident.diagnosis.result import Diagnosis
from dynident.effects import Effect
from dynident.errors import DynidentError
from dynident.evidence.maps import SPECTRA, ResidualMap
from dynident.words import nearest

GIVEN = "model as given"
BAND = "noise band"
LABEL = 0.25
"""Share of the width of the waterfall that the text of a row takes on a phone."""
BEFORE_COLOUR = "#d9660a"
AFTER_COLOUR = "#1f7fc4"
GREY = "#808080"


@dataclass(frozen=True, kw_only=True)
class Bar:
    """One row of the waterfall: an error, or the part of it that an effect takes away.

    Attributes
    ----------
    lines : label, a line of text each.
    start, stop : where the bar begins and ends, in %.
    kind : "given", "added" (one effect) or "final".
    text : what is written at its end.
    """

    lines: tuple[str, ...]
    start: float
    stop: float
    kind: Literal["given", "added", "final"]
    text: str

    def text_from(self, floor: float, width: float) -> float:
        """Where its text begins, in %: at its end, or behind the line of the floor that it crosses.

        Parameters
        ----------
        floor : of the noise, in %; zero where it is unknown.
        width : of the picture, in %.
        """
        end = max(self.start, self.stop)
        return floor if end < floor < end + LABEL * width else end


def recording_titles(stretches: Sequence[tuple[str, np.ndarray]]) -> tuple[str, ...]:
    """Names by which stretches of recordings are told apart: those of one file by their time, too.

    Parameters
    ----------
    stretches : name of the recording and times (T,) in s, each.
    """
    many = Counter(name for name, _ in stretches)
    return tuple(
        f"{name}, {t[0]:.3g} to {t[-1]:.3g} s" if many[name] > 1 and len(t) else name
        for name, t in stretches
    )


@dataclass(frozen=True)
class StepGroup:
    """Steps that are told as one: an effect that was added at several joints.

    Attributes
    ----------
    title : as "coulomb friction at all six joints".
    steps : one after the other.
    others : what the data cannot tell from one of them, but for what was added, too.
    """

    title: str
    steps: tuple[Step, ...]
    others: tuple[Effect, ...]


def step_groups(diagnosis: Diagnosis) -> tuple[StepGroup, ...]:
    """Return the effects added, those of one kind that every joint has together."""
    found: list[list[Step]] = []
    for step in diagnosis.steps:
        last = found[-1][0].effect if found else None
        if last and step.effect.at_every_joint and step.effect.name == last.name:
            found[-1].append(step)
        else:
            found.append([step])
    joints, added = len(diagnosis.joints), {step.effect.label for step in diagnosis.steps}
    return tuple(
        StepGroup(
            title=grouped_title([one.effect for one in group], joints),
            steps=tuple(group),
            others=tuple(
                {
                    one.label: one
                    for step in group
                    for one in step.indistinguishable
                    if one.label not in added
                }.values()
            ),
        )
        for group in found
    )


def bars(diagnosis: Diagnosis) -> tuple[Bar, ...]:
    """Rows of the waterfall of held-out error, from the model as given to the final one."""
    error = diagnosis.test_error
    found = [
        Bar(
            lines=(GIVEN,),
            start=0.0,
            stop=100 * error.before,
            kind="given",
            text=f"{100 * error.before:.2f} %",
        )
    ]
    for group in step_groups(diagnosis):
        before = 100 * group.steps[0].test_error_before
        after = 100 * group.steps[-1].test_error_after
        change = f"{after - before:+.2f}".replace("-", "\u2212")
        change = change if change.strip("+\u22120.") else "under 0.01"
        found.append(
            Bar(lines=_group_lines(group), start=after, stop=before, kind="added", text=change)
        )
    if diagnosis.steps:
        name = "with all of these" if len(diagnosis.steps) > 1 else "with it added"
        found.append(
            Bar(
                lines=(name,),
                start=0.0,
                stop=100 * error.after,
                kind="final",
                text=f"{100 * error.after:.2f} %",
            )
        )
    return tuple(found)


def _group_lines(group: StepGroup) -> tuple[str, ...]:
    lines = wrapped(f"+ {group.title}")
    match group.others:
        case ():
            return lines
        case (other,):
            first = group.steps[0].effect
            here = (other.joint, other.source) == (first.joint, first.source)
            return (*lines, f"or {other.name.replace('_', ' ') if here else other.title}")
        case others:
            return (*lines, f"or {len(others)} others")


def wrapped(title: str) -> tuple[str, ...]:
    """An effect's title on two lines: what it is, and where."""
    what, at, where = title.partition(" at ")
    return (what, f"at {where}") if at else (what,)


def after_name(diagnosis: Diagnosis) -> str:
    """Legend of the final model."""
    if len(diagnosis.steps) == 1:
        return f"with {diagnosis.steps[0].effect.title} added"
    return f"with {len(diagnosis.steps)} effects added"


def maps_of(diagnosis: Diagnosis, joint: str) -> tuple[ResidualMap, ...]:
    """Residual maps of a joint.

    Raises
    ------
    DynidentError
        If the diagnosis has no such joint, or no map of it.
    """
    known = [one.name for one in diagnosis.joints]
    if joint not in known:
        raise DynidentError(f"no joint '{joint}'", remedy=nearest(joint, known, "joints"))
    found = tuple(one for one in diagnosis.maps if one.joint == joint)
    if not found:
        raise DynidentError("the diagnosis has no residual map of it", f"joint '{joint}'")
    return found


def noise_of(diagnosis: Diagnosis, joint: str) -> float | None:
    """Noise of a joint's torque, rms in N m or N; None where it is unknown."""
    return next((one.noise_rms for one in diagnosis.joints if one.name == joint), None)


def x_title(one: ResidualMap) -> str:
    """Label of the horizontal axis of a residual map."""
    if is_spectrum(one):
        return one.unit or one.against
    unit = one.unit.replace("^2", "\u00b2")
    return f"{one.against} ({unit})" if unit else one.against


def y_title(one: ResidualMap) -> str:
    """Label of the vertical axis of a residual map."""
    return f"{'amplitude' if is_spectrum(one) else 'mean residual'} ({one.torque_unit})"


def is_spectrum(one: ResidualMap) -> bool:
    """Whether a map shows amplitudes, which have no sign."""
    return one.against in SPECTRA


def seen(one: ResidualMap) -> str:
    """What a residual map shows, in words; its own sentence where it has one."""
    if one.sentence:
        return one.sentence[0].upper() + one.sentence[1:].rstrip(".") + "."
    if not np.isfinite(one.band).any():
        return "Not judged: the noise is unknown, and nothing here has a name."
    beyond = _beyond(one, one.before)
    return f"{beyond}, without a simple shape." if "points" in beyond else f"{beyond}."


def left(one: ResidualMap) -> str:
    """What the effects added leave of a residual map, in words.

    Empty without a noise band, and where there was nothing before either.
    """
    words = f"{_beyond(one, one.after)}."
    return words if np.isfinite(one.band).any() and words != seen(one) else ""


def _beyond(one: ResidualMap, mean: np.ndarray) -> str:
    known = np.isfinite(one.band)
    count = int(np.sum(np.abs(mean[known]) > one.band[known]))
    # The band is two standard errors: one bin in twenty lies outside by chance.
    if count <= max(1.0, 0.1 * known.sum()):
        return "Within the noise"
    return f"Beyond the noise at {count} of {known.sum()} points"


def ranked(diagnosis: Diagnosis, most: int = 10) -> tuple[Candidate, ...]:
    """The best candidates on the model as given that this data can show at all."""
    return tuple(c for c in diagnosis.candidates if c.status != "absorbed")[:most]


def first_set(diagnosis: Diagnosis) -> frozenset[str]:
    """Labels of the first effect and of those that this data cannot tell from it.

    Empty where there is but one of them.
    """
    first = diagnosis.best
    if first is None or not first.indistinguishable:
        return frozenset()
    return frozenset(effect.label for effect in (first.effect, *first.indistinguishable))


def thinned(trace: Trace, points: int) -> np.ndarray:
    """Samples of a trace that draw the same picture with fewer points.

    The trace is cut into equal stretches; of each, the extremes of the torque and of both
    residuals are kept, so that no peak is lost.

    Parameters
    ----------
    trace : Trace
        Of T samples.
    points : int
        About how many samples to keep at most, 16 or more.

    Returns
    -------
    (<= points,) indices, increasing.
    """
    return kept_of(
        (trace.measured, trace.measured - trace.before, trace.measured - trace.after), points
    )


def kept_of(signals: Sequence[np.ndarray], points: int) -> np.ndarray:
    """`thinned` for any signals, (T,) each."""
    samples = len(signals[0])
    if samples <= points:
        return np.arange(samples)
    edges = np.linspace(0, samples, max(points - 2, 14) // 6 + 1).astype(int)
    kept = {0, samples - 1}
    for start, stop in pairwise(edges):
        for signal in signals:
            stretch = signal[start:stop]
            kept.update((start + int(stretch.argmin()), start + int(stretch.argmax())))
    return np.array(sorted(kept))
