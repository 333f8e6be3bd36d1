"""What proposed laws are worth: their torque beside that of the true law, on held-out motion.

The true torque is computed by `drawn_laws`, from the recorded motion, smoothed; that of a proposal
by its formula, from the same motion.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import optimize, signal

from blind_study.drawn_laws import DrawnLaw
from dynident.formulas import Formula, Signal, evaluate, parse_formula
from dynident.recording import Recording
from dynident.study import load

_CUTOFF_HZ = 25.0
_ROWS = 4000
_RIVAL = re.compile(r"(?P<torque>.*) at (?P<joint>\w+)(?: \((?P<shape>.*)\))?")


@dataclass(frozen=True, kw_only=True)
class LawMark:
    """One proposal.

    Attributes
    ----------
    joint : whether it is at the true one.
    differs : root mean square of its torque less the true one's, over that of the true one: of the
        torques as they are, or of what no column of the study's model can make up for, whichever
        is less.
    same_form : whether values of its parameters make it the true law.
    errors : deviation of its parameters from those, in standard deviations; empty without them.
    """

    joint: bool
    differs: float
    same_form: bool
    errors: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class _Motion:
    """Samples of held-out motion, and what a law takes of them.

    Attributes
    ----------
    names : of the joints.
    t, q, v, a : (T,), (T, n) each.
    load, width, joint : N m without the law; rad/s; of the joint of the law that is evaluated.
    known : values of parameters.
    """

    names: tuple[str, ...]
    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    load: np.ndarray
    width: float
    joint: int
    known: dict[str, float]

    def signal(self, signal: Signal) -> Any:
        j = self.joint if signal.joint is None else self.names.index(signal.joint)
        match signal.quantity:
            case "t":
                return self.t
            case "load":
                return self.load[:, j]
        return getattr(self, signal.quantity)[:, j]

    def parameter(self, name: str) -> float:
        return self.known[name]

    def sign(self, speed: Any, joints: tuple[str | None, ...]) -> Any:
        return np.tanh(speed / self.width)


class HeldOutLaw:
    """The true law on the test recordings of a study.

    Parameters
    ----------
    study : its file.
    said : law and amount, as the truth tells them.
    """

    def __init__(self, study: Path, said: dict[str, Any]) -> None:
        loaded = load(study)
        self._law, self._amount = DrawnLaw.of(said["drawn"]), float(said["amount"])
        self._names = loaded.model.robot.names
        parts = [self._smoothed(one) for one in loaded.test.recordings]
        every = max(1, sum(len(part[0]) for part in parts) // _ROWS)
        t, q, v, a, load_, true = (np.concatenate(one)[::every] for one in zip(*parts, strict=True))
        self._samples = (t, q, v, a, load_)
        model = loaded.model
        values = np.zeros(model.size) if model.needs_values else None
        carried = loaded.test.recordings[0].payload or False
        self._columns = model.columns(
            model.block(t, q, v, a, carries_payload=carried), values
        ).reshape(-1, model.size)
        self._true = true
        self._left = self._beside_model(self._at(true, self._law.joint))

    def _smoothed(self, one: Recording) -> tuple[np.ndarray, ...]:
        """Return t, q, v, a, load and the true torque of one recording."""
        step = 1.0 / one.rate_hz
        low = signal.butter(4, min(0.8, 2 * _CUTOFF_HZ * step), output="sos")
        q, tau = (signal.sosfiltfilt(low, x, axis=0) for x in (one.q, one.tau))
        v = np.gradient(q, step, axis=0)
        a = np.gradient(v, step, axis=0)
        j = self._law.joint
        memory = self._law.past(step, v)
        true = self._law.beside(tau[:, j], q.T, v.T, self._amount, memory)
        load_ = np.array(tau)
        load_[:, j] -= true
        return one.t + one.start, q, v, a, load_, true

    def _at(self, torque: np.ndarray, joint: int) -> np.ndarray:
        """A torque at one joint as one of all, (T n,)."""
        full = np.zeros((len(torque), len(self._names)))
        full[:, joint] = torque
        return full.ravel()

    def _beside_model(self, torque: np.ndarray) -> np.ndarray:
        scale = np.linalg.norm(self._columns, axis=0)
        columns = self._columns[:, scale > 0] / scale[scale > 0]
        return torque - columns @ np.linalg.lstsq(columns, torque, rcond=1e-9)[0]

    def mark(self, said: dict[str, Any]) -> LawMark:
        """Mark a proposal as `dynident explain --json` tells it."""
        joint, formula = self._names.index(said["joint"]), parse_formula(said["torque"])
        names = list(said["values"])
        start = np.array([said["values"][name] for name in names])
        torque = self._torque(formula, joint, names, start)
        difference = self._at(torque, joint) - self._at(self._true, self._law.joint)
        differs = min(
            _rms(difference) / _rms(self._at(self._true, self._law.joint)),
            _rms(self._beside_model(difference)) / max(_rms(self._left), 1e-12),
        )
        if joint != self._law.joint:
            return LawMark(joint=False, differs=differs, same_form=False, errors=())
        size = np.maximum(np.abs(start), 1e-6)
        size_of_true = max(_rms(self._true), 1e-12)

        def miss(x: np.ndarray) -> np.ndarray:
            found = self._torque(formula, joint, names, x * size) - self._true
            return np.nan_to_num(found, nan=1e6, posinf=1e6, neginf=-1e6) / size_of_true

        best = optimize.least_squares(miss, start / size, max_nfev=100)
        same = _rms(best.fun) < _SAME
        sigma = [said["sigma"][name] or np.nan for name in names]
        errors = tuple(float(e) for e in (start - best.x * size) / sigma) if same else ()
        return LawMark(joint=True, differs=differs, same_form=bool(same), errors=errors)

    def mark_rival(self, text: str) -> bool:
        """Whether a rival, written as `explain` writes it, can be the true law."""
        match = _RIVAL.fullmatch(text)
        if match is None or match["joint"] not in self._names:
            return False
        joint, formula = self._names.index(match["joint"]), parse_formula(match["torque"])
        pairs = [one.split(" = ") for one in (match["shape"] or "").split(", ") if one]
        known = {name: float(value) for name, value in pairs}
        linear = sorted(set(re.findall(r"\bc\d*\b", match["torque"])))
        columns = []
        for one in linear:
            values = {**known, **dict.fromkeys(linear, 0.0), one: 1.0}
            torque = self._torque(formula, joint, list(values), list(values.values()))
            columns.append(self._beside_model(self._at(torque, joint)))
        among = np.stack(columns, axis=1)
        left = self._left - among @ np.linalg.lstsq(among, self._left, rcond=1e-9)[0]
        return _rms(left) <= AGREES * _rms(self._left)

    def _torque(
        self, formula: Formula, joint: int, names: Sequence[str], values: Any
    ) -> np.ndarray:
        known = dict(zip(names, values, strict=True))
        motion = _Motion(self._names, *self._samples, self._law.width, joint, known)
        found = np.asarray(evaluate(formula, motion), dtype=float)
        return np.broadcast_to(found, len(self._true))


AGREES = 0.1
"""Of the true torque, root mean square, up to which another is the same law."""
_SAME = 0.02


def marks(study: Path, law: dict[str, Any] | None, answer: dict[str, Any]) -> dict[str, Any]:
    """Return what the proposals of an answer are worth, to be kept beside it.

    Parameters
    ----------
    study : whose test recordings are there still.
    law : as the truth tells it; None where nothing is hidden.
    answer : of `dynident explain --json`.
    """
    proposals = answer.get("proposals", [])
    if law is None or not proposals:
        return {"proposed": len(proposals)}
    held = HeldOutLaw(study, law)
    found = [held.mark(one) for one in proposals]
    return {
        "proposed": len(proposals),
        "marks": [
            {
                "joint": one.joint,
                "differs": one.differs,
                "same_form": one.same_form,
                "errors": list(one.errors),
            }
            for one in found
        ],
        "rivals": [held.mark_rival(text) for text in proposals[0]["rivals"]],
    }


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(x))))
