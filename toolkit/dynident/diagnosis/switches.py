"""Any of the effects added, switched on or off: each choice fitted anew and judged held out.

In: the path of a search. Out: for every subset of its steps the held-out error of each joint, and
the torque predicted where the effects matter most. Shapes (widths, frequencies, ...) stay as the
final model has them; all other values are fitted anew, on the training recordings alone. The
columns are those that the search evaluated; what it fitted and judged itself is taken as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from dynident.diagnosis.nuisances.friction_width import with_friction_width
from dynident.diagnosis.search.path import Path, judged_on
from dynident.effects import Effect
from dynident.errors import FitError
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.held_out import HeldOut

MOST = 4
"""Switches at most, for every one doubles the fits; the last one has all effects that follow."""
_ROWS = 300
"""Of the window that is drawn: what a screen resolves."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SwitchedOn:
    """The model with some of the effects.

    Attributes
    ----------
    on : of each switch, whether its effects are in the model.
    error : held-out torque error over all joints, relative.
    joint_errors : (n,) of each joint; NaN without torque.
    predicted : (W, n) torque in the window, N m or N.
    """

    on: tuple[bool, ...]
    error: float
    joint_errors: np.ndarray
    predicted: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class Switches:
    """Every choice among the effects added.

    Attributes
    ----------
    effects : of each switch, in the order of the steps.
    choices : all 2^k, none of the effects first and all of them last.
    recording : of the window: the stretch in which the effects change the prediction most.
    t : (W,) s.
    measured : (W, n) torque, N m or N.
    """

    effects: tuple[tuple[Effect, ...], ...]
    choices: tuple[SwitchedOn, ...]
    recording: str
    t: np.ndarray
    measured: np.ndarray


def switches_of(evidence: Evidence, held: Evidence | None, path: Path) -> Switches | None:
    """Fit and judge every choice among the effects of a path.

    Parameters
    ----------
    evidence, held : training and test recordings; without the latter blocks of time are held out.
    path : from the model as given to the final one.

    Returns
    -------
    The choices; None where nothing was added, or the recordings cannot carry one of the models.
    """
    if not path.found:
        return None
    groups = _groups(path)
    known: dict[int, HeldOut] = {}
    for many in range(len(groups) + 1):
        known[many] = path.judged[sum(map(len, groups[:many]))]
    found: dict[tuple[bool, ...], HeldOut] = {}
    try:
        for on in product((False, True), repeat=len(groups)):
            many = sum(on)
            labels = [
                one for group, is_on in zip(groups, on, strict=True) if is_on for one in group
            ]
            if on == (True,) * many + (False,) * (len(groups) - many):
                found[on] = known[many]
            else:
                effects = list(map(path.final.model.effect, labels))
                fit = _fitted(evidence, path.stages[0], effects)
                found[on] = judged_on(evidence, held, fit)
    except FitError:
        return None
    run, rows = _where(path.judged[0], path.judged[-1])
    return Switches(
        effects=tuple(tuple(map(path.final.model.effect, group)) for group in groups),
        choices=tuple(
            SwitchedOn(
                on=on,
                error=judged.error,
                joint_errors=judged.joint_errors,
                predicted=judged.runs[run].predicted[rows],
            )
            for on, judged in found.items()
        ),
        recording=path.judged[0].runs[run].name,
        t=path.judged[0].runs[run].t[rows],
        measured=path.judged[0].runs[run].measured[rows],
    )


def _fitted(evidence: Evidence, start: EvidenceFit, effects: list[Effect]) -> EvidenceFit:
    """Fit the model as given with effects more, as the stages of a path are fitted."""
    wider = (start.model + tuple(effects)).with_shapes(tuple(effects))
    return with_friction_width(evidence, fit_evidence(evidence, wider, start))


def _groups(path: Path) -> list[list[str]]:
    """Labels of the effects of each switch: what was added together at several joints is one."""
    groups: list[list[str]] = []
    previous = ""
    for one in path.found:
        head = one.with_it or one.score.effect.label
        if groups and head == previous:
            groups[-1].append(one.score.effect.label)
        else:
            groups.append([one.score.effect.label])
        previous = head
    last = [label for group in groups[MOST - 1 :] for label in group]
    return [*groups[: MOST - 1], *([last] if last else [])]


def _where(before: HeldOut, after: HeldOut) -> tuple[int, slice]:
    """Return the run, and the stretch of it, in which two models differ most."""
    scale = np.where(before.torque_rms > 0, before.torque_rms, np.inf)
    best, found = -1.0, (0, slice(0, 0))
    for r, (old, new) in enumerate(zip(before.runs, after.runs, strict=True)):
        square = np.sum(((new.predicted - old.predicted) / scale) ** 2, axis=1)
        rows = min(_ROWS, len(square))
        total = np.concatenate([[0.0], np.cumsum(square)])
        here = total[rows:] - total[:-rows]
        if here.max() > best:
            first = int(here.argmax())
            best, found = float(here.max()), (r, slice(first, first + rows))
    return found
