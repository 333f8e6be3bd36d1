"""Hide one effect of the catalogue at a time in a two-link arm, and see whether it is found.

    python benchmarks/hidden_effects.py [--strengths 1 3 10] [--healthy 20] [--jobs 2] [--out FILE]

For each effect and strength: 4 training and 2 test runs of 16 s at 1 kHz, simulated in closed
loop, are diagnosed with a model that lacks the effect. A strength is the systematic residual that
the effect leaves over the noise, root mean square, at its joint; it is set by simulating the
effect without noise first. The table says what was suggested first and how the held-out error
ends; healthy robots follow, on which nothing should be found, and an effect that is not in the
catalogue, for which the answer should be "none of these explains it".
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from blind_study.foreign import PositionDependentViscosity
from dynident.closed_loop import Controller, Experiment, ExperimentRun, Fourier, Sensors, TrueEffect
from dynident.diagnosis import diagnose
from dynident.effects import catalogue
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import Robot

ARM = """<robot name="two_link">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0.01 0"/><mass value="4"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.06" iyz="0" izz="0.06"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0.15 -0.01 0"/><mass value="2"/>
    <inertia ixx="0.004" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin rpy="1.5707963267948966 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2.5" upper="2.5" velocity="6" effort="200"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2.5" upper="2.5" velocity="6" effort="100"/></joint>
</robot>"""
"""A two-link arm that moves in a vertical plane."""

FRICTION = {"viscous_friction": (1.2, 0.5), "coulomb_friction": (1.5, 0.6)}
"""Friction of shoulder and elbow, in the model unless it is what is hidden; N m s and N m."""

UNIT: dict[str, tuple[tuple[float, ...], tuple[tuple[float, float], ...]]] = {
    "viscous_friction": ((0.1,), ()),
    "coulomb_friction": ((0.1,), ()),
    "torque_offset": ((0.1,), ()),
    "asymmetric_friction": ((0.1, 0.1), ()),
    "stribeck_friction": ((0.2,), ((0.05, 0.3),)),
    "quadratic_drag": ((0.1,), ()),
    "joint_spring": ((0.2, -0.1), ()),
    "torque_ripple": ((0.08, 0.06), ((4.0, 20.0),)),
    "rotor_inertia": ((0.02,), ()),
    "payload": ((0.2, 0.06, 0.0, 0.0, 0.0, 0.0, 0.018, 0.0, 0.0, 0.018), ()),
    "drive_gain": ((0.03,), ()),
    "joint_coupling": ((0.1, 0.05, 0.0, 0.0), ()),
    "position_dependent_viscosity": ((0.1,), ()),
}
"""Values of each effect at strength one, up to a factor, and ranges of its shape parameters."""

FOREIGN = PositionDependentViscosity.name
"""The effect that is in no catalogue."""

CONTROLLER = Controller(
    kind="pd", rate_hz=1000.0, kp=(1500.0, 600.0), kd=(80.0, 30.0), derivative_cutoff_hz=80.0
)
SENSORS = Sensors(position_std=2e-5, torque_std=0.1)
PERIOD, DURATION, RUNS, TESTS = 8.0, 16.0, 4, 2


@dataclass(frozen=True)
class Case:
    """One robot to diagnose; `effect` is None for a healthy one."""

    effect: str | None
    joint: str | None
    source: str | None
    strength: float
    seed: int


@dataclass(frozen=True)
class Outcome:
    """What the diagnosis said of a case."""

    case: Case
    ratio: float
    verdict: str
    first: str | None
    alternatives: tuple[str, ...]
    right: bool
    error_before: float
    error_after: float
    over_floor: float
    cpu_s: float


def robot_case(case: Case) -> tuple[Model, Dataset, Dataset]:
    """Simulate a case: the model that lacks the effect, training and test recordings."""
    robot = Robot.from_text(ARM)
    rng = np.random.default_rng([case.seed, 77])
    hidden = _hidden(case, robot, rng)
    known = [
        one
        for name, values in FRICTION.items()
        for joint, value in zip(robot.names, values, strict=True)
        for one in TrueEffect.of(f"{name}@{joint}", robot, [value])
        if not (case.effect == name and case.joint == joint)
    ]
    model = Model(robot, tuple(one.effect for one in known))
    if hidden is not None:
        hidden = _scaled(case, robot, known, hidden)
    truth = [*known, hidden] if hidden is not None else known
    recordings = _recordings(case, robot, truth, RUNS + TESTS)
    return model, Dataset(recordings[:RUNS]), Dataset(recordings[RUNS:])


def _hidden(case: Case, robot: Robot, rng: np.random.Generator) -> TrueEffect | None:
    if case.effect is None:
        return None
    values, ranges = UNIT[case.effect]
    kinds = {**catalogue(), FOREIGN: PositionDependentViscosity}
    effect = kinds[case.effect](case.joint, case.source)
    shape = tuple(float(np.exp(rng.uniform(np.log(a), np.log(b)))) for a, b in ranges)
    return TrueEffect(effect.shaped(*shape).on(robot), values, hidden=True)


def _recordings(
    case: Case, robot: Robot, truth: list[TrueEffect], runs: int
) -> tuple[Recording, ...]:
    made = tuple(
        ExperimentRun(
            trajectory=Fourier.random(
                robot, PERIOD, [case.seed, r], amplitude=[1.6, 1.8], speed=[2.5, 3.0]
            ),
            duration=DURATION,
            file=f"run{r + 1}.csv",
            payload=r % 2 == 1,
        )
        for r in range(runs)
    )
    return Experiment(
        robot=robot,
        controller=CONTROLLER,
        runs=made,
        effects=tuple(truth),
        sensors=SENSORS,
        seed=case.seed,
    ).run()


def _scaled(case: Case, robot: Robot, known: list[TrueEffect], hidden: TrueEffect) -> TrueEffect:
    """Scale an effect so that it leaves `strength` times the noise in the residual."""
    from dynident.evidence.evidence import Evidence
    from dynident.evidence.evidence_fit import fit_evidence
    from dynident.evidence.held_out import on_recordings
    from dynident.evidence.runs import gather

    model = Model(robot, tuple(one.effect for one in known))
    for _ in range(3):
        evidence = Evidence(model, gather(Dataset(_recordings(case, robot, [*known, hidden], 2))))
        judged = on_recordings(evidence, fit_evidence(evidence, model))
        assert judged.ratio is not None
        ratio = float(judged.ratio.max())
        if ratio > 0.3 and abs(ratio / case.strength - 1.0) < 0.15:
            break
        factor = np.clip(case.strength / max(ratio, 0.1), 0.05, 20.0)
        hidden = replace(hidden, values=tuple(float(v * factor) for v in hidden.values))
    return hidden


def run_case(case: Case) -> Outcome:
    """Simulate and diagnose one case."""
    model, train, test = robot_case(case)
    started = time.process_time()
    found = diagnose(model, train, test)
    cpu = time.process_time() - started
    best = found.best
    first = best.effect.label if best else None
    alternatives = tuple(e.label for e in best.indistinguishable) if best else ()
    truth = label(case)
    if truth is None:
        right = found.verdict == "nothing_missing" and best is None
    elif case.effect == FOREIGN:
        right = found.verdict == "unexplained"
    else:
        right = truth in (first, *alternatives)
    floor = found.test_error.noise_floor or float("nan")
    ratios = [j.ratio_before for j in found.joints if j.ratio_before is not None]
    return Outcome(
        case,
        max(ratios),
        found.verdict,
        first,
        alternatives,
        right,
        found.test_error.before,
        found.test_error.after,
        found.test_error.after / floor,
        cpu,
    )


def label(case: Case) -> str | None:
    """The hidden effect, as the diagnosis would name it."""
    if case.effect is None:
        return None
    place = case.joint or ""
    if case.source:
        place += f":{case.source}"
    return f"{case.effect}@{place}" if place else case.effect


def cases(strengths: list[float], healthy: int, seed: int = 0) -> list[Case]:
    """Every effect at every strength, then healthy robots; seeds fixed."""
    found = []
    for number, name in enumerate(n for n in catalogue() if n in UNIT):
        for level, strength in enumerate(strengths):
            number_of_case = seed + 100 * number + level
            joint = ("shoulder", "elbow")[(number + level) % 2]
            source = None
            if name == "rotor_inertia":
                joint = "elbow"  # at the first joint it cannot be told from the links
            if catalogue()[name].place == "robot":
                joint = None
            elif catalogue()[name].place == "pair":
                source = "elbow" if joint == "shoulder" else "shoulder"
            found.append(Case(name, joint, source, strength, number_of_case))
    strange = [
        Case(FOREIGN, joint, None, strength, seed + 4000 + i)
        for i, (joint, strength) in enumerate(product(("shoulder", "elbow"), (3.0, 10.0)))
    ]
    well = [Case(None, None, None, 0.0, seed + 5000 + i) for i in range(healthy)]
    return [*found, *strange, *well]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--strengths", type=float, nargs="*", default=[1.0, 3.0, 10.0])
    parser.add_argument("--healthy", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--effects", nargs="*", help="only these effects")
    parser.add_argument("--out", type=Path, help="also write the outcomes as JSON lines")
    options = parser.parse_args()
    todo = cases(options.strengths, options.healthy, options.seed)
    if options.effects is not None:
        todo = [c for c in todo if c.effect in options.effects]
    outcomes: list[Outcome] = []
    stream = Parallel(n_jobs=options.jobs, return_as="generator")(
        delayed(run_case)(case) for case in todo
    )
    print(f"{'hidden':38s} {'ratio':>6s} {'right':>5s}  first suggestion [cannot be told from]")
    for outcome in stream:
        assert outcome is not None
        outcomes.append(outcome)
        others = f" [{', '.join(outcome.alternatives)}]" if outcome.alternatives else ""
        print(
            f"{label(outcome.case) or 'nothing':38s} {outcome.ratio:6.2f} "
            f"{'yes' if outcome.right else 'NO':>5s}  {outcome.first}{others}; {outcome.verdict}; "
            f"error {100 * outcome.error_before:.2f} -> {100 * outcome.error_after:.2f} %, "
            f"{outcome.over_floor:.3f} of the floor; {outcome.cpu_s:.1f} s CPU",
            flush=True,
        )
        if options.out:
            with options.out.open("a") as handle:
                handle.write(json.dumps(asdict(outcome)) + "\n")
    ill = [o for o in outcomes if o.case.effect and o.case.effect != FOREIGN]
    strange = [o for o in outcomes if o.case.effect == FOREIGN]
    well = [o for o in outcomes if not o.case.effect]
    if ill:
        right = sum(o.right for o in ill)
        near = sum(o.over_floor <= 1.15 for o in ill)
        print(f"\nfirst suggestion right: {right} of {len(ill)}")
        print(f"held-out error at most 1.15 of the floor: {near} of {len(ill)}")
    if strange:
        called = sum(o.right for o in strange)
        print(f'effects outside the catalogue called "none of these": {called} of {len(strange)}')
    if well:
        print(f"nothing added to a healthy robot: {sum(o.right for o in well)} of {len(well)}")
    print(f"median CPU of a diagnosis: {np.median([o.cpu_s for o in outcomes]):.1f} s")


if __name__ == "__main__":
    main()
