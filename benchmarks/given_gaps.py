"""Gaps that a model has, and at which of all sizes and shapes their fit ends.

    python benchmarks/given_gaps.py --first 0 --count 20 [--sought]

Each robot is the two-link arm of `hidden_effects` with play in its shoulder, its size and the
sides' resonance, damping and share of the motor drawn at random, and simulated in closed loop. The
model has the effect, at no shape; with `--sought` it lacks it, and the diagnosis has to find it.
Printed are, of each, the gap that is found and the held-out error over the noise floor; and of all,
how often a gap comes out within 5 %, and the geometric mean of the errors.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from dynident.closed_loop import Experiment, ExperimentRun, Fourier, Sensors, TrueEffect
from dynident.diagnosis import diagnose
from dynident.effects import effects_of
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from dynident.tables import Table
from hidden_effects import ARM, CONTROLLER, FRICTION, PERIOD

LABEL, RUNS, TESTS, DURATION = "backlash@shoulder", 3, 1, 16.0
RANGES = ((12.0, 50.0), (0.05, 0.5), (0.2, 0.6))
"""Resonance, Hz, damping ratio and the motor's share, drawn by their logarithms."""
GAPS = (8e-4, 8e-3)  # rad
HANGING = (-np.pi / 2.0, 0.0)
"""rad about which the arm swings, so that its loads change sign."""
SENSORS = Sensors(position_std=2e-6, torque_std=0.05)


def drawn(number: int, robot: Robot) -> TrueEffect:
    """Return the play of a robot, by its number."""
    rng = np.random.default_rng([9100, number])
    gap, *shape = np.exp(rng.uniform(*np.log(np.array([GAPS, *RANGES])).T))
    (effect,) = effects_of(LABEL, robot)
    return TrueEffect(effect.shaped(*shape).at([gap]), (gap,), hidden=True)


def recordings(number: int, robot: Robot, play: TrueEffect) -> tuple[Recording, ...]:
    """Simulate its runs."""
    known = [
        one
        for name, values in FRICTION.items()
        for joint, value in zip(robot.names, values, strict=True)
        for one in TrueEffect.of(f"{name}@{joint}", robot, [value])
    ]
    runs = tuple(
        ExperimentRun(
            trajectory=Fourier.random(
                robot,
                PERIOD,
                [number, r],
                amplitude=[0.9, 1.2],
                speed=[2.5, 3.0],
                centre=HANGING,
            ),
            duration=DURATION,
            file=f"run{r + 1}.csv",
        )
        for r in range(RUNS + TESTS)
    )
    made = Experiment(
        robot=robot,
        controller=CONTROLLER,
        runs=runs,
        effects=(*known, play),
        sensors=SENSORS,
        seed=number,
    )
    return made.run()


def main() -> None:
    """Draw, simulate, fit and tell."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--sought", action="store_true", help="the model lacks the gap")
    asked = parser.parse_args()
    robot = Robot.from_text(ARM)
    plain = Model(robot) + "viscous_friction" + "coulomb_friction"
    rows, over, near = [], [], 0
    for number in range(asked.first, asked.first + asked.count):
        play = drawn(number, robot)
        every = recordings(number, robot, play)
        train, test = Dataset(every[:RUNS]), Dataset(every[RUNS:])
        started = time.process_time()
        if asked.sought:
            found = diagnose(plain, train, test, propose="never")
        else:
            found = diagnose(plain + LABEL, train, test, most=0, propose="never")
        cpu = time.process_time() - started
        there = LABEL in {one.label for one in found.after.model.effects}
        gap = found.after.effect_values(LABEL)[0] if there else float("nan")
        errors = found.test_error
        over.append(errors.after / (errors.noise_floor or float("nan")))
        near += abs(gap / play.values[0] - 1.0) < 0.05
        shape = ", ".join(f"{one:.3g}" for one in play.effect.shape)
        figures = (f"{1e3 * play.values[0]:.3f}", shape, f"{1e3 * gap:.3f}", f"{over[-1]:.3f}")
        rows.append((str(number), *figures, found.verdict, f"{cpu:.1f}"))
        print(*rows[-1], flush=True)
    mean = float(np.exp(np.mean(np.log(over))))
    head = (
        "robot",
        "gap, mrad",
        "Hz, damping, share",
        "found",
        "error / floor",
        "verdict",
        "CPU, s",
    )
    note = f"{near} of {len(rows)} within 5 %; error over the floor {mean:.3f} (geometric mean)."
    Table("Gaps and what is found", head, tuple(rows), (note,)).show()


if __name__ == "__main__":
    main()
