"""How often 95 % intervals of the effects that a diagnosis adds hold the truth.

    python benchmarks/effect_coverage.py --first 40000 --count 400

A two-link arm that shares no code with the package lacks one effect, whose strength is drawn over a
decade and a half, down to what is not found. Each seed is another motion, strength and draw of
noise; every other one repeats its motion. Of the answers that add the effect its coefficients are
compared with the truth, and all other parameters of the model.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np

import dynident as di
import two_link_loop
from dynident.recording import Dataset
from two_link_loop import COULOMB, Lab

_TORQUE = (0.4, 0.2)
_WEAK = 10.0
"""True value over sigma, below which an effect that was added counts as weak."""


@dataclass(frozen=True, kw_only=True)
class Hidden:
    """An effect of the arm, and what its parameters truly are.

    Attributes
    ----------
    range : of its strength, in the lab's unit.
    true : from the strength to values by the names that an estimate gives them.
    """

    effect: str
    law: str
    range: tuple[float, float]
    true: Callable[[float], Mapping[str, float]]


EFFECTS = (
    Hidden(
        effect="stribeck_friction",
        law="stribeck",
        range=(0.03, 1.0),
        true=lambda x: {"Fs@shoulder": x * COULOMB[0], "Fs@elbow": x * COULOMB[1]},
    ),
    Hidden(
        effect="torque_offset",
        law="offset",
        range=(0.005, 0.15),
        true=lambda x: {"offset@elbow": x},
    ),
    Hidden(
        effect="joint_spring",
        law="spring",
        range=(0.01, 0.3),
        true=lambda x: {"k@elbow": x, "c@elbow": 0.0},
    ),
    Hidden(
        effect="quadratic_drag",
        law="drag",
        range=(0.01, 0.3),
        true=lambda x: {"Fq@elbow": x},
    ),
    Hidden(
        effect="asymmetric_friction",
        law="asymmetry",
        range=(0.01, 0.3),
        true=lambda x: {"dFv@elbow": x, "dFc@elbow": 0.0},
    ),
    Hidden(
        effect="rotor_inertia",
        law="rotor",
        range=(0.001, 0.03),
        true=lambda x: {"Ia@elbow": x},
    ),
)


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What a diagnosis made of one recording.

    Attributes
    ----------
    found : whether the effect was added.
    errors : over sigma, of its coefficients; empty if it was not.
    others : over sigma, of the other parameters.
    strength : true value over sigma of its first coefficient.
    """

    effect: str
    repeats: bool
    found: bool
    errors: tuple[float, ...] = ()
    others: tuple[float, ...] = ()
    strength: float = 0.0


def answer(seed: int) -> Answer:
    """Diagnose one arm."""
    rng = np.random.default_rng([seed, 77])
    hidden = EFFECTS[seed % len(EFFECTS)]
    repeats = bool(seed // len(EFFECTS) % 2)
    strength = float(np.exp(rng.uniform(*np.log(hidden.range))))
    lab = Lab(torque_std=_TORQUE, period=repeats, **{hidden.law: strength})
    recordings = lab.recordings(range(3 * seed, 3 * seed + 3))
    train, test = Dataset(tuple(recordings[:2])), Dataset(tuple(recordings[2:]))
    model = two_link_loop.model()
    said = di.diagnose(model, train, test, propose="never", progress=lambda _: None)
    after = said.after
    true = hidden.true(strength)
    names = list(after.model.names)
    mine = [name for name in true if name in names]
    if not any(step.effect.name == hidden.effect for step in said.steps) or not mine:
        return Answer(effect=hidden.effect, repeats=repeats, found=False)
    known = {**dict(zip(model.names, two_link_loop.truth(model), strict=True)), **true}

    def errors(of: list[str]) -> tuple[float, ...]:
        at = [names.index(name) for name in of]
        wrong = after.values[at] - np.array([known[name] for name in of])
        return tuple((wrong / after.sigma[at])[np.isfinite(after.sigma[at])])

    first = names.index(mine[0])
    return Answer(
        effect=hidden.effect,
        repeats=repeats,
        found=True,
        errors=errors(mine),
        others=errors([name for name in names if name in known and name not in mine]),
        strength=abs(true[mine[0]]) / float(after.sigma[first]),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--first", type=int, default=0, help="seed to begin with")
    parser.add_argument("--count", type=int, default=60, help="arms")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.count)
    with ProcessPoolExecutor(options.jobs) as pool:
        answers = list(pool.map(answer, seeds))
    for words, some in (
        ("all", answers),
        ("weak", [one for one in answers if one.found and one.strength < _WEAK]),
        ("strong", [one for one in answers if one.found and one.strength >= _WEAK]),
        ("repeats", [one for one in answers if one.repeats]),
        ("does not repeat", [one for one in answers if not one.repeats]),
        *((hidden.effect, [a for a in answers if a.effect == hidden.effect]) for hidden in EFFECTS),
    ):
        _show(words, some)


def _show(words: str, answers: list[Answer]) -> None:
    inside = [abs(z) < 1.96 for one in answers for z in one.errors]
    others = [abs(z) < 1.96 for one in answers for z in one.others]
    found = sum(one.found for one in answers)
    print(
        f"{words:24s} added {found} of {len(answers)}; coefficients within "
        f"{sum(inside)} of {len(inside)} = {np.mean(inside or [np.nan]):.3f}; "
        f"others {np.mean(others or [np.nan]):.3f}",
        flush=True,
    )


if __name__ == "__main__":
    main()
