"""Memory and time of least squares on a 7-joint arm, beside a dense solve.

    python benchmarks/least_squares_memory.py [--samples 100000 300000 1000000]

Recordings of 100 000 samples at 1 kHz are fitted at the full rate. What is printed is the peak
memory above the recordings themselves: it must not grow with their number. The peer stacks the
whole regressor and calls numpy.linalg.lstsq, for the smallest size only.
"""

from __future__ import annotations

import argparse
import time
import tracemalloc

import numpy as np

from dynident.fitting import LeastSquares
from dynident.fitting.sampling import sample
from dynident.model import Model
from dynident.recording import Dataset, Filter, Recording
from dynident.robot import Robot

PIECE = 100_000
RATE_HZ = 1000.0
FULL_RATE = Filter(position_cutoff_hz=None, cutoff_hz=None, rate_hz=None, edge_s=(0.01, 0.01))


def arm() -> Robot:
    """Seven revolute joints, axes crossing by turns, as most light-weight arms have them."""
    parts = ['<robot name="seven"><link name="base"/>']
    parent = "base"
    for i in range(7):
        turn = (0.0, 1.57, -1.57, 1.57, -1.57, 1.57, -1.57)[i]
        parts.append(
            f'<link name="l{i}"><inertial><origin xyz="0.01 0.02 0.1"/>'
            f'<mass value="{4 - 0.4 * i}"/>'
            '<inertia ixx="0.03" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.01"/></inertial></link>'
            f'<joint name="j{i}" type="revolute"><parent link="{parent}"/><child link="l{i}"/>'
            f'<origin xyz="0 0 0.2" rpy="{turn} 0 0"/><axis xyz="0 0 1"/>'
            '<limit lower="-3" upper="3" velocity="3" effort="100"/></joint>'
        )
        parent = f"l{i}"
    return Robot.from_text("".join(parts) + "</robot>")


def recording(model: Model, values: np.ndarray, seed: int) -> Recording:
    rng = np.random.default_rng(seed)
    t = np.arange(PIECE) / RATE_HZ
    k = 2 * np.pi / 20.0 * np.arange(1, 6)
    s = rng.normal(size=(7, 5)) * 0.5 / np.arange(1, 6)
    q, v, a = (np.sin(t[:, None] * k) @ s.T, np.cos(t[:, None] * k) @ (s * k).T, None)
    a = -np.sin(t[:, None] * k) @ (s * k**2).T
    theta = np.zeros(70)
    theta[list(model.base.independent)] = values
    tau = model.robot.inverse_dynamics(q, v, a, theta)
    return Recording(t, q, tau + 0.1 * rng.normal(size=tau.shape), model.robot.names)


def dense(model: Model, one: Recording) -> np.ndarray:
    motion = sample(one, FULL_RATE).motion
    regressor = model.robot.regressor(motion.q, motion.v, motion.a)
    base = regressor[:, :, list(model.base.independent)].reshape(-1, model.size)
    return np.linalg.lstsq(base, motion.tau.ravel(), rcond=None)[0]


def measured(what) -> tuple[float, float]:
    """Peak memory in MiB above what was there, and CPU seconds."""
    tracemalloc.start()
    started = time.process_time()
    what()
    cpu = time.process_time() - started
    peak = tracemalloc.get_traced_memory()[1] / 2**20
    tracemalloc.stop()
    return peak, cpu


def show(samples: int, name: str, peak: float, cpu: float) -> None:
    print(f"{samples:9d} {name:22s} {peak:9.0f} {cpu:7.1f} {1e6 * cpu / samples:10.1f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--samples", type=int, nargs="*", default=[100_000, 300_000, 1_000_000])
    sizes = parser.parse_args().samples
    model = Model(arm())
    values = model.given_values()
    method = LeastSquares("none")
    pieces = [recording(model, values, seed) for seed in range(max(sizes) // PIECE)]
    print(f"{'samples':>9s} {'method':22s} {'peak MiB':>9s} {'CPU s':>7s} {'us/sample':>10s}")
    for size in sizes:
        data = Dataset(tuple(pieces[: size // PIECE]), FULL_RATE)
        peak, cpu = measured(lambda data=data: method.fit(model, data))
        show(size, "dynident, blocked QR", peak, cpu)
    peak, cpu = measured(lambda: dense(model, pieces[0]))
    show(PIECE, "dense numpy lstsq", peak, cpu)


if __name__ == "__main__":
    main()
