"""Pairs of effects that recordings leave open, and whether designed recordings settle them.

    python benchmarks/settled_pairs.py --seeds 5

A two-link arm has an effect that a few recordings of small motions cannot tell from another. The
diagnosis names both; the next recording is designed, simulated in closed loop with the arm as it
truly is, by the package's own simulator or by MuJoCo (`--plant mujoco`: its integrator, recordings
that begin in mid-motion; dry friction is its own constraint at odd seeds, and tanh at even ones),
and the diagnosis repeated with it. Printed are, of the cases in which both were named:
in how many the right effect alone is named afterwards; the separation that was predicted; and that
which was measured, the square root of the fall of the squared residual, over the noise, from the
model with the other effect, in the shape in which it imitates most, to that with the right one:
least, median and most, over that predicted, and how often it is within the interval of that (of
the cases in which the right effect was named first, and its size told).
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

import dynident as di
from dynident.closed_loop import Experiment, ExperimentRun, Fourier, TrueEffect, load_experiment
from dynident.experiment_design import DesignTask
from dynident.experiment_design.telling.imitations import shapes_of
from dynident.experiment_design.virtual_recording import ClosedDesignLoop, close_design_loop
from dynident.fitting.sampling import sample
from dynident.tables import Table

PROBLEM = Path(__file__).resolve().parents[1] / "problems" / "hidden_effect"
TASK = DesignTask(duration=8.0, repeat=2, harmonics=5, starts=1)


@dataclass(frozen=True)
class OpenPair:
    """An effect that is hidden, its values, and the one that it is taken for, or taken with.

    Attributes
    ----------
    hidden : its label; of an effect that the study names, the study without it.
    values, shape : of it.
    rival : label of the other.
    reach : rad, largest distance of the small motions from their centre.
    """

    hidden: str
    values: tuple[float, ...]
    rival: str
    shape: tuple[float, ...] = ()
    reach: float = 0.5


PAIRS = (
    OpenPair("quadratic_drag@elbow", (0.3,), "stribeck_friction@elbow"),
    OpenPair("quadratic_drag@shoulder", (0.3,), "stribeck_friction@shoulder"),
    OpenPair("joint_spring@elbow", (0.1, 0.0), "torque_ripple@elbow"),
    OpenPair("joint_spring@shoulder", (5.0, 0.0), "torque_ripple@shoulder"),
    OpenPair("torque_offset@elbow", (0.3,), "torque_ripple@elbow", reach=0.2),
    OpenPair("torque_offset@shoulder", (0.3,), "torque_ripple@shoulder"),
    OpenPair("torque_ripple@elbow", (0.1, 0.1), "joint_spring@elbow", (1.5,), 0.25),
    OpenPair("torque_ripple@shoulder", (0.3, 0.3), "torque_offset@shoulder", (1.5,)),
)


def truth(base: Experiment, pair: OpenPair, seed: int) -> Experiment:
    """The arm with a hidden effect, in three recordings of small motions."""
    robot = base.robot
    known = [one for one in base.effects if not one.hidden and one.effect.label != pair.hidden]
    (hidden,) = TrueEffect.of(pair.hidden, robot, pair.values, hidden=True)
    hidden = replace(hidden, effect=hidden.effect.shaped(*pair.shape or hidden.effect.shape))
    runs = tuple(
        ExperimentRun(
            trajectory=Fourier.random(robot, 8.0, [seed, k], amplitude=pair.reach, speed=1.5),
            duration=16.0,
            file=f"small{k + 1}.csv",
        )
        for k in range(3)
    )
    return replace(base, effects=(*known, hidden), runs=runs, seed=seed)


def in_mujoco(made: Experiment) -> Experiment:
    """The same experiment with MuJoCo's arm."""
    from blind_study.circumstances import STOPS_WITHIN, Circumstances
    from blind_study.mujoco_lab import MujocoLaboratory

    said = Circumstances(
        friction="constraint" if made.seed % 2 else "tanh",
        time_constant=STOPS_WITHIN[0],
        rate_hz=made.controller.simulated_rate(),
        repetition="stated",
        jitter=0.0,
        feedforward="none",
    )
    own = {one.name: getattr(made, one.name) for one in fields(Experiment)}
    return MujocoLaboratory(
        **own,
        circumstances=said,
        width=0.0 if said.friction == "constraint" else made.friction_width,
        torque_noise=tuple(made.sensors.each("torque_std", made.robot.n)),
    )


PLANTS = {"own": lambda made: made, "mujoco": in_mujoco}


def measured(loop: ClosedDesignLoop, recorded: di.Dataset, group: int) -> float:
    """Standard deviations by which the recordings, with the designed one, prefer the first."""
    first, *others = loop.designed.task.tell[group]
    model = loop.before.after.model - first.label
    every = replace(recorded, recordings=(*recorded.recordings, loop.recording))
    noise = loop.designed.estimate.torque_std
    right = left(model + first, every, noise)
    wrong = min(left(model + one, every, noise) for one in shapes_of(others, model.robot))
    return float(np.sqrt(max(wrong - right, 0.0)))


def left(model: di.Model, data: di.Dataset, noise: np.ndarray) -> float:
    """Squared residual of a model that is fitted to all recordings, in units of the noise."""
    columns, torque = [], []
    for recording in data.recordings:
        sampled = sample(recording, data.filter)
        found = np.concatenate(list(sampled.columns(model)))
        columns.append((found / noise[None, :, None]).reshape(-1, model.size))
        torque.append((sampled.tau / noise).ravel())
    whole, wanted = np.concatenate(columns), np.concatenate(torque)
    values = np.linalg.lstsq(whole, wanted, rcond=1e-10)[0]
    return float(np.sum((wanted - whole @ values) ** 2))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=0, help="seed")
    parser.add_argument("--pairs", nargs="*", help="hidden effects; default: all")
    parser.add_argument("--plant", choices=sorted(PLANTS), default="own")
    asked = parser.parse_args()
    study = di.load(PROBLEM / "study.toml")
    base = load_experiment(PROBLEM / "experiment.toml")
    rows = []
    for pair in PAIRS:
        if asked.pairs and pair.hidden not in asked.pairs:
            continue
        model = study.model
        model = model - pair.hidden if pair.hidden in [x.label for x in model.effects] else model
        both, decides, right, wrong, within, intervals = 0, 0, 0, 0, 0, 0
        predicted, found, so_far = [], [], []
        for seed in range(asked.first, asked.first + asked.seeds):
            made = PLANTS[asked.plant](truth(base, pair, seed))
            recorded = replace(study.train, recordings=made.run())
            try:
                loop = close_design_loop(model, recorded, made, TASK, lambda _: None)
            except di.DynidentError:
                continue  # nothing was open
            groups = [{one.label for one in group} for group in loop.designed.task.tell]
            meant = [k for k, one in enumerate(groups) if {pair.hidden, pair.rival} <= one]
            if not meant:
                continue
            both += 1
            named = {step.effect.label: step for step in loop.after.steps}
            own = named.get(pair.hidden)
            settled = own is not None and not own.indistinguishable and pair.rival not in named
            right += settled
            wrong += own is None and pair.rival in named
            separation = loop.designed.separations[meant[0]]
            predicted.append(separation.designed)
            so_far.append(separation.recorded)
            decides += separation.decides
            told = separation.designed > 0
            if told and loop.designed.task.tell[meant[0]][0].label == pair.hidden:
                size = measured(loop, recorded, meant[0])
                found.append(size / separation.designed)
                if separation.predicted.interval:
                    low, high = separation.predicted.interval
                    within += low <= size <= high
                    intervals += 1
        middle = [f"{np.median(x):.2g}" if x else "" for x in (so_far, predicted)]
        ends = (min(found), np.median(found), max(found)) if found else ()
        over = ", ".join(f"{one:.2f}" for one in ends)
        inside = f"{within} of {intervals}"
        counts = (str(one) for one in (decides, right, wrong))
        cells = (f"{both} of {asked.seeds}", *counts, *middle, over, inside)
        rows.append((pair.hidden, pair.rival, *cells))
        print(rows[-1], flush=True)
    heads = (
        "hidden",
        "taken for",
        "open",
        "said to decide",
        "then right alone",
        "then wrong",
        "sigma so far",
        "predicted",
        "measured over it",
        "within its interval",
    )
    print(Table("Pairs that a designed recording settles", heads, tuple(rows)))


if __name__ == "__main__":
    main()
