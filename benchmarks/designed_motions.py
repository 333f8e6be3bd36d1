"""Designed motions against random ones within the same limits.

    python benchmarks/designed_motions.py --random 1000

For arms of two, ten and seven joints, or the problems that `--arms` names: the geometric mean of
the standard deviations of all parameters with the designed motion over that with the best, and with
the median, of many random motions (Fourier series of the same period and harmonics, each as large
as the limits allow), as if nothing had been recorded, and with what the recordings of the study
tell, which hides much; the worst of these ratios; and processor time. Then pairs of effects: phi,
the squared distance in standard deviations, with the recordings so far, over that with the best of
200 random motions; what the motion adds to the phi of these recordings over what the best random
motion adds; phi of a motion that is designed as if nothing had been recorded, over that with the
best of 200; and the length of usual motion that a design of 10 s is worth. With `--starts 20` it is
seen whether a search from more places finds more.

Other tools minimise the condition number of the base regressor, without gradients (S. Bethge,
J. Malzahn, N. Tsagarakis and D. Caldwell, "FloBaRoID - a software package for the identification of
robot dynamics parameters", 2017). With `--condition 5000` that objective is minimised here, too,
among the same motions within the same limits, as if nothing had been recorded: by Powell's method
from the best of the random motions, with that many evaluations. Printed are the standard deviations
of the design over those of that motion, both condition numbers, and processor times.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.optimize import minimize

import dynident as di
from dynident.closed_loop import load_experiment, write_experiment
from dynident.effects import effects_of
from dynident.experiment_design import DesignTask, RecordingDesign
from dynident.experiment_design.motion_program import FINER, MotionProgram
from dynident.tables import Table

PROBLEMS = Path(__file__).resolve().parents[1] / "problems"
ARMS = ("hidden_effect", "anthropomorphic_arm", "seven_joint_arm")
PAIRS = (
    ("joint_zero@J", "joint_spring@J"),
    ("torque_offset@J", "base_tilt"),
    ("quadratic_drag@J", "viscous_friction@J"),
    ("stribeck_friction@J", "viscous_friction@J"),
    ("stribeck_friction@J", "quadratic_drag@J"),
    ("load_friction@J", "coulomb_friction@J"),
    ("joint_spring@J", "torque_offset@J"),
    ("torque_ripple@J", "joint_spring@J"),
    ("rotor_inertia@J", "joint_coupling@J:K"),
    ("asymmetric_friction@J", "torque_offset@J"),
)


def study_of(name: str) -> di.Study:
    """The study of a problem; where it has none, virtual measurements are made."""
    if (PROBLEMS / name / "study.toml").exists():
        return di.load(PROBLEMS / name / "study.toml")
    with TemporaryDirectory() as folder:
        write_experiment(load_experiment(PROBLEMS / name / "experiment.toml"), Path(folder))
        return di.load(Path(folder) / "study.toml")


def unrecorded(found: RecordingDesign, starts: int, seed: int) -> RecordingDesign:
    """The design as if nothing had been recorded: what recordings tell hides what motions do."""
    (one,) = found.program.informations
    program = replace(found.program, informations=(replace(one, prior=np.zeros_like(one.prior)),))
    return replace(found, program=program, motion=program.solved(starts, seed))


def ratios(found: RecordingDesign, count: int) -> tuple[float, float, float, float]:
    """Sigma over that of the best and of the median random motion; the worst; and their CPU s."""
    program, began = found.program, time.process_time()
    some = (program.within(program.motions.random(50_000 + k)) for k in range(count))
    losses = sorted((program.loss(one), k) for k, one in enumerate(some) if one is not None)
    spent = time.process_time() - began
    last, ours = program.information.last, program.loss(found.motion.variables)
    best, median = losses[0][0], losses[len(losses) // 2][0]
    winner = program.within(program.motions.random(50_000 + losses[0][1]))
    with np.errstate(invalid="ignore"):  # what no motion tells is infinite in both
        each = found.sigma(found.motion.variables) / found.sigma(winner)
    mean = [float(np.exp((ours - one) / (2 * last))) for one in (best, median)]
    return mean[0], mean[1], float(np.nanmax(each)), spent


_STRUCTURAL = 1e-12  # of the largest singular value: what is less is zero for every motion


@dataclass(frozen=True)
class Rival:
    """The motion of the least condition number.

    Attributes
    ----------
    loss : of the design's own objective there.
    sigma : (p,) of all parameters.
    condition : of the regressor.
    spent : s of the processor.
    """

    loss: float
    sigma: np.ndarray
    condition: float
    spent: float


def condition(program: MotionProgram, variables: np.ndarray) -> float:
    """Condition number of the regressor of a motion within the limits; infinite for others.

    Of what any motion tells: columns of effects may be those of bodies, whatever the motion.
    """
    t = program.motions.times(program.instants)
    inside = program.within(variables)
    if inside is None:
        return float("inf")
    asked = program.information
    rows = asked.columns.along(t, *program.motions.trajectory(inside).at(t)) @ asked.mix
    sizes = np.linalg.svd(rows.reshape(-1, rows.shape[2]), compute_uv=False)
    told = sizes[sizes > _STRUCTURAL * sizes[0]]
    return float(told[0] / told[-1])


def by_condition_number(found: RecordingDesign, count: int, evaluations: int) -> Rival:
    """Minimise the condition number, from the best of many random motions, without gradients."""
    program, began = found.program, time.process_time()
    starts = (program.motions.random(50_000 + k) for k in range(count))
    best = min(starts, key=lambda one: condition(program, one))

    def asked(flat: np.ndarray) -> float:
        # Finite beyond the limits, for the line searches.
        return min(np.log(condition(program, flat.reshape(best.shape))), 100.0)

    ended = minimize(asked, best.ravel(), method="Powell", options={"maxfev": evaluations})
    inside = program.within(ended.x.reshape(best.shape))
    assert inside is not None
    spent = time.process_time() - began
    # On the grid on which a design is chosen.
    loss = program.loss(inside, FINER)
    return Rival(loss, found.sigma(inside), condition(program, inside), spent)


def beside(name: str, found: RecordingDesign, rival: Rival, ours: float) -> tuple[str, ...]:
    """One row: the design over the motion of the least condition number."""
    own = found.motion.variables
    mean = np.exp((found.motion.loss - rival.loss) / (2 * found.program.information.last))
    with np.errstate(invalid="ignore"):
        each = found.sigma(own) / rival.sigma
    worst, numbers = np.nanmax(each), (condition(found.program, own), rival.condition)
    cells = (f"{x:.3g}" for x in (mean, worst, *numbers, ours, rival.spent))
    return name, *cells


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--random", type=int, default=1000, help="random motions")
    parser.add_argument("--starts", type=int, default=DesignTask.starts)
    parser.add_argument("--seeds", type=int, default=1, help="designs of each arm")
    parser.add_argument("--arms", nargs="*", default=ARMS)
    parser.add_argument("--condition", type=int, default=0, help="evaluations")
    parser.add_argument("--only", choices=("all", "parameters", "pairs"), default="all")
    asked = parser.parse_args()
    rows, pairs, rivals = [], [], []
    for name in asked.arms:
        study = study_of(name)
        for seed in range(asked.seeds if asked.only != "pairs" else 0):
            task = DesignTask(repeat=1, harmonics=5, starts=asked.starts, seed=100 * seed)
            found = di.design(study.model, study.train, task, progress=lambda _: None)
            began = time.process_time()
            alone = unrecorded(found, asked.starts, task.seed)
            ours = time.process_time() - began
            if asked.condition:
                other = by_condition_number(alone, asked.random, asked.condition)
                rivals.append(beside(f"{name}, seed {seed}", alone, other, ours))
            for words, one in (("alone", alone), ("with recordings", found)):
                best, median, worst, theirs = ratios(one, asked.random)
                cells = (f"{best:.2f}", f"{median:.2f}", f"{worst:.2f}", f"{ours:.1f}")
                title = f"{name}, {study.robot.n} joints, {words}"
                rows.append((title, str(seed), *cells, f"{theirs:.1f}"))
        if asked.only != "parameters":
            pairs += [told_apart(study, name, pair, asked.starts) for pair in PAIRS]
    heads = ("arm", "seed", "over the best", "over the median", "worst", "s", "s, random")
    print(Table("Standard deviations, designed over random", heads, tuple(rows)))
    if rivals:
        heads = ("arm", "sigma, mean", "worst", "condition", "least", "s", "s, least")
        print(Table("Designed over the least condition number", heads, tuple(rivals)))
    heads = ("arm", "pair", "phi over best of 200", "gain over it", "alone", "worth, s", "s")
    print(Table("Pairs told apart by 10 s", heads, tuple(pairs)))


def told_apart(study, name: str, pair: tuple[str, str], starts: int) -> tuple[str, ...]:
    """One row: how much better a pair is told apart than by the best of 200 random motions."""
    names = study.robot.names
    # The last joint's zero is a part of its own bodies' parameters: nothing tells it.
    joint, other = (names[1], names[2]) if len(names) > 2 else names
    first, second = (
        effects_of(one.replace("@J", f"@{joint}").replace(":K", f":{other}"), study.robot)[0]
        for one in pair
    )
    task = DesignTask(repeat=1, harmonics=5, starts=starts, tell=((first, second),))
    began = time.process_time()
    label = f"{first.label} or {second.label}"
    try:
        found = di.design(study.model, study.train, task, progress=lambda _: None)
    except di.DynidentError as error:
        return name, label, error.what, "", "", "", ""
    spent, one = time.process_time() - began, found.separations[0]
    ours, best = phis(found)
    if best <= 0:
        return name, label, "no motion tells them", "", "", "", f"{spent:.1f}"
    asked = found.program.information
    so_far = float(asked.about(np.zeros_like(asked.prior))[0, 0])
    alone = phis(unrecorded(found, starts, task.seed))
    figures = ours / best, (ours - so_far) / (best - so_far), alone[0] / alone[1]
    return name, label, *(f"{x:.2f}" for x in figures), f"{10.0 * one.worth:.0f}", f"{spent:.1f}"


def phis(found: RecordingDesign) -> tuple[float, float]:
    """Phi with the design, and with the best of 200 random motions."""
    program, asked = found.program, found.program.information

    def phi(variables: np.ndarray) -> float:
        return float(asked.about(program.told(asked, variables))[0, 0])

    some = (program.within(program.motions.random(70_000 + k)) for k in range(200))
    return phi(found.motion.variables), max(phi(each) for each in some if each is not None)


if __name__ == "__main__":
    main()
