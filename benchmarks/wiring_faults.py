"""Put every single fault of the wiring into recordings, and see whether it is named.

    python benchmarks/wiring_faults.py [--seeds 3] [--first 100] [--joints 2 6 7] [--failures]
    python benchmarks/wiring_faults.py --problems hidden_effect panda ...

Robots of two, six and seven joints with lengths, masses and friction drawn at random are simulated
in closed loop (`blind_study.robots`); their user is told other masses. With `--problems` the faults
go into the recordings of these problems instead. Beside them are studies that state another gravity
than there was. The table says how often each kind of fault was
named, kind and joints, how often the likely ratio of a gear was within a quarter of the true one,
whether the recordings without a fault were left alone, and how long a check took.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from blind_study.robots import specimen
from dynident.closed_loop import Experiment, ExperimentRun, Fourier, Sensors, TrueEffect
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.study import load
from dynident.wiring import Fault, check_wiring

ROOT = Path(__file__).resolve().parents[1]
RATE_HZ, PERIOD, REPETITIONS = 250.0, 8.0, 2
GEARS = (81.0, -50.0, 100.0)
"""Ratios of a joint, of its position alone, of its torque alone."""
KNOWN = ("viscous_friction", "coulomb_friction", "rotor_inertia")

Change = Callable[[Recording], Recording]


@dataclass(frozen=True)
class Injected:
    """One fault that is put into recordings, and what it has to be called.

    Attributes
    ----------
    kind : as `Fault.kind`; several where a word more or less is no error.
    joints : numbers of the joints that are to be named.
    change : what is done to each recording.
    ratio : of the gear, where there is one.
    gravity : (3,) m/s^2 that the study states, where it has that wrong.
    """

    kind: tuple[str, ...]
    joints: tuple[int, ...]
    change: Change
    ratio: float | None = None
    gravity: tuple[float, ...] | None = None

    def told(self, model: Model) -> Model:
        """The model as its user has it."""
        if self.gravity is None:
            return model
        return replace(model, robot=model.robot.with_gravity(self.gravity))

    def is_named(self, found: tuple[Fault, ...], names: tuple[str, ...]) -> bool:
        """Whether it was reported, first of all faults."""
        wanted = {names[j] for j in self.joints}
        return bool(found) and found[0].kind in self.kind and set(found[0].joints) == wanted


def column_faults(n: int) -> Iterator[Injected]:
    """Yield every single fault of the columns of n joints."""
    every = tuple(range(n))
    for i in every:
        yield Injected(("torque_sign",), (i,), lambda r, i=i: _changed(r, tau=(i, -1.0)))
    yield Injected(
        ("torque_signs",) if n > 1 else ("torque_sign",), every, lambda r: r.replace(tau=-r.tau)
    )
    for i, j in combinations(every, 2):
        swap = np.array(every)
        swap[[i, j]] = j, i
        yield Injected(
            ("torques_exchanged",), (i, j), lambda r, at=swap: r.replace(tau=r.tau[:, at])
        )
        yield Injected(("positions_exchanged",), (i, j), lambda r, at=swap: _moved(r, r.q[:, at]))
        yield Injected(
            ("joints_exchanged",),
            (i, j),
            lambda r, at=swap: _moved(r, r.q[:, at]).replace(tau=r.tau[:, at]),
        )
    yield Injected(("degrees",), every, lambda r: _moved(r, np.rad2deg(r.q)))
    yield Injected(("torque_unit",), every, lambda r: r.replace(tau=1e3 * r.tau))
    for i in every:
        yield Injected(("degrees",), (i,), lambda r, i=i: _changed(r, q=(i, 180 / np.pi)))
        yield Injected(("torque_unit",), (i,), lambda r, i=i: _changed(r, tau=(i, 1e3)))
        yield from _gears(i)


def _gears(i: int) -> Iterator[Injected]:
    both, position, torque = GEARS
    yield Injected(
        ("motor_side",), (i,), lambda r: _changed(r, q=(i, both), tau=(i, 1 / both)), both
    )
    yield Injected(("motor_side_position",), (i,), lambda r: _changed(r, q=(i, position)), position)
    yield Injected(("motor_side_torque",), (i,), lambda r: _changed(r, tau=(i, 1 / torque)), torque)


def mounting_faults() -> Iterator[Injected]:
    """Yield mountings that a study forgets, of robots that stand upright, or has wrong."""
    for gravity in ((9.81, 0.0, 0.0), (0.0, -9.81, 0.0), (0.0, 0.0, 9.81), (5.9, 4.9, -6.1)):
        yield Injected(("gravity",), (), lambda r: r, gravity=gravity)


def data_faults(n: int) -> Iterator[Injected]:
    """Yield faults of data: one source for two columns, a period that is wrong."""
    for i, j in combinations(range(n), 2):
        for scale in (1.0, -0.5):
            yield Injected(
                ("one_source",),
                (i, j),
                lambda r, s=scale, i=i, j=j: r.replace(tau=_with(r.tau, j, s * r.tau[:, i])),
            )
        yield Injected(
            ("one_source",), (i, j), lambda r, i=i, j=j: _moved(r, _with(r.q, j, r.q[:, i]))
        )
    for factor in (0.7, 0.995, 1.004, 1.3):
        yield Injected(("period",), (), lambda r, f=factor: _stretched(r, f))


def _stretched(recording: Recording, factor: float) -> Recording:
    assert recording.period
    return recording.replace(period=factor * recording.period)


def _changed(
    recording: Recording,
    q: tuple[int, float] | None = None,
    tau: tuple[int, float] | None = None,
) -> Recording:
    """One column of positions or torques times a factor."""
    if q is not None:
        recording = _moved(recording, _with(recording.q, q[0], q[1] * recording.q[:, q[0]]))
    if tau is not None:
        torque = _with(recording.tau, tau[0], tau[1] * recording.tau[:, tau[0]])
        recording = recording.replace(tau=torque)
    return recording


def _moved(recording: Recording, q: np.ndarray) -> Recording:
    return recording.replace(q=q, v=None, a=None, q_ref=None)


def _with(x: np.ndarray, column: int, values: np.ndarray) -> np.ndarray:
    changed = np.array(x)
    changed[:, column] = values
    return changed


def broken(dataset: Dataset, change: Change) -> Dataset:
    """A dataset with a fault in every recording."""
    return replace(dataset, recordings=tuple(change(one) for one in dataset.recordings))


def simulated(joints: int, seed: int, runs: int = 2) -> tuple[Model, Dataset]:
    """A robot drawn at random, as its user knows it, and recordings of what it does.

    Parameters
    ----------
    joints : 2, 6 or 7.
    seed : of robot, trajectories and noise.
    runs : recordings.
    """
    made = specimen(joints, RATE_HZ, np.random.default_rng([seed, joints]))
    robot = made.robot
    sizes = (made.viscous, made.dry, made.rotor)
    truth = tuple(
        one
        for name, values in zip(KNOWN, sizes, strict=True)
        for joint, value in zip(robot.names, values, strict=True)
        for one in TrueEffect.of(f"{name}@{joint}", robot, [float(value)])
    )
    trajectories = (
        Fourier.random(robot, PERIOD, [seed, r], amplitude=made.amplitude, speed=made.speed)  # type: ignore[arg-type]
        for r in range(runs)
    )
    duration = PERIOD * REPETITIONS
    recordings = Experiment(
        robot=robot,
        controller=made.controller,
        runs=tuple(
            ExperimentRun(trajectory=one, duration=duration, file=f"run{r + 1}.npz")
            for r, one in enumerate(trajectories)
        ),
        effects=truth,
        sensors=Sensors(position_std=2e-5, torque_std=tuple(0.05 * made.dry)),
        seed=seed,
    ).run()
    model = Model(made.nominal)
    for name in KNOWN[:2]:
        model = model + name
    return model, Dataset(tuple(one.replace(period=PERIOD) for one in recordings))


@dataclass
class Count:
    """How often faults of a kind were named."""

    named: int = 0
    ratios: int = 0
    gears: int = 0
    total: int = 0
    seconds: float = 0.0


def tried(
    model: Model, train: Dataset, count: dict[str, Count], label: str, failures: list[str]
) -> None:
    """Put every fault into recordings in turn, and count which are named."""
    names = model.robot.names
    started = time.perf_counter()
    said = check_wiring(model, train)
    healthy = count.setdefault("none", Count())
    healthy.total += 1
    healthy.named += not said
    healthy.seconds += time.perf_counter() - started
    failures += [f"{label}: nothing is wrong, but: {one.sentence}" for one in said]
    faults = [*column_faults(model.robot.n), *mounting_faults()]
    if all(one.period for one in train.recordings):
        faults += data_faults(model.robot.n)
    for fault in faults:
        started = time.perf_counter()
        said = check_wiring(fault.told(model), broken(train, fault.change))
        one = count.setdefault(fault.kind[0], Count())
        one.seconds += time.perf_counter() - started
        one.total += 1
        right = fault.is_named(said, names)
        one.named += right
        if fault.ratio is not None:
            one.gears += 1
            one.ratios += right and _near(said[0].what, fault.ratio)
        if not right:
            what = [f"{f.kind} {f.joints}" for f in said]
            failures.append(f"{label}: {fault.kind[0]} {fault.joints}: {what}")


def _near(what: str, ratio: float) -> bool:
    stated = float(what.rsplit(" ", 1)[1].strip(")"))
    return abs(stated / ratio - 1) < 0.25


def main() -> None:
    """Inject, check, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--joints", type=int, nargs="*", default=[2, 6, 7])
    parser.add_argument("--problems", nargs="*")
    parser.add_argument("--failures", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    failures: list[str] = []
    groups: dict[str, dict[str, Count]] = {}
    if options.problems:
        for name in options.problems:
            study = load(ROOT / "problems" / name / "study.toml")
            tried(study.model, study.train, groups.setdefault(name, {}), name, failures)
    else:
        for joints in options.joints:
            for seed in range(options.first, options.first + options.seeds):
                model, train = simulated(joints, seed)
                label = f"{joints} joints, seed {seed}"
                tried(model, train, groups.setdefault(f"{joints} joints", {}), label, failures)
    for group, count in groups.items():
        _show(group, count)
    if options.failures:
        print("\n".join(failures))


def _show(group: str, count: dict[str, Count]) -> None:
    print(f"\n{group:22s} {'named':>11s} {'ratio':>9s} {'s each':>7s}")
    for kind, one in count.items():
        ratio = f"{one.ratios}/{one.gears}" if one.gears else ""
        named = f"{one.named}/{one.total}"
        print(f"  {kind:20s} {named:>11s} {ratio:>9s} {one.seconds / one.total:7.2f}")
    faults = [one for kind, one in count.items() if kind != "none"]
    named, total = (sum(getattr(one, key) for one in faults) for key in ("named", "total"))
    print(f"  {'all faults':20s} {f'{named}/{total}':>11s} {named / total:9.1%}")


if __name__ == "__main__":
    main()
