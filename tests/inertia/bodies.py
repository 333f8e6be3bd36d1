"""Bodies of every shape and size, made of point masses so that the truth is known by definition."""

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

# Along how many axes a body of some shape extends.
SHAPES = {"point": 0, "rod": 1, "plate": 2, "solid": 3}
SINGULAR = ("point", "rod", "plate")


@dataclass(frozen=True, eq=False)
class Matter:
    """Point masses (k,) at points (k, 3), and the units in which its parameters are near one."""

    points: NDArray[np.float64]
    masses: NDArray[np.float64]

    @property
    def phi(self) -> NDArray[np.float64]:
        moment = self.masses @ self.points
        second = self.points.T @ (self.masses[:, None] * self.points)
        inertia = np.trace(second) * np.eye(3) - second
        six = [inertia[i] for i in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
        return np.array([self.masses.sum(), *moment, *six])

    @property
    def size(self) -> NDArray[np.float64]:
        """Of each parameter (10,): m, m l (3), m l^2 (6), l the farthest point."""
        mass = self.masses.sum()
        length = np.max(np.linalg.norm(self.points, axis=1))
        return mass * np.repeat([1.0, length, length**2], [1, 3, 6])

    def kinetic_energy(self, omega, v) -> float:
        velocities = v + np.cross(omega, self.points)
        return float(0.5 * self.masses @ np.sum(velocities**2, axis=1))


def matter(seed: int, shape: str, mass: float, length: float) -> Matter:
    """Seven points of a shape, turned and moved away from the origin."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(7, 3))
    points[:, SHAPES[shape] :] = 0.0
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    points = points @ turn.T + rng.normal(size=3)
    masses = rng.uniform(0.1, 2.0, 7)
    return Matter(length * points, mass * masses / masses.sum())


def _log_uniform(low: float, high: float):
    return st.floats(np.log10(low), np.log10(high)).map(lambda x: 10.0**x)


def bodies(*shapes: str):
    """Strategy: bodies from 1e-9 to 1e6 kg and from 0.1 mm to 1 km."""
    return st.builds(
        matter,
        st.integers(0, 2**32 - 1),
        st.sampled_from(shapes or tuple(SHAPES)),
        _log_uniform(1e-9, 1e6),
        _log_uniform(1e-4, 1e3),
    )


def assert_same(found, wanted, size, digits):
    """Compare parameter by parameter, relative to its size."""
    np.testing.assert_allclose(found / size, wanted / size, rtol=0, atol=digits)
