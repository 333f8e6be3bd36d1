"""How an effect acts on a simulated plant: each way is nothing by default.

An effect is simulated from the same law as its columns: the force of the columns is the default,
and an effect that changes bodies, drives or transmissions says so in one of the other ways instead.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from dynident.effects.block import Block
from dynident.effects.terms import Term
from dynident.effects.transmission import Transmission
from dynident.robot import Robot


class SimulatedEffect(ABC):
    """The simulation side of an effect.

    Attributes
    ----------
    memory : number of internal states that a simulation of it keeps.
    """

    memory: ClassVar[int] = 0

    @property
    def not_simulated(self) -> str:
        """Why it cannot be simulated; empty where it can."""
        return ""

    @abstractmethod
    def columns(self, block: Block) -> np.ndarray:
        """Torque per unit of each linear parameter, (T, n, k) in N m or N."""

    def simulated_force(self, values: Sequence[float], block: Block) -> np.ndarray:
        """Torque that it takes from the drives, (T, n), from t, q and v alone."""
        return self.columns(block) @ np.asarray(values, dtype=float)

    def simulated_terms(self, values: Sequence[float], robot: Robot) -> tuple[Term, ...] | None:
        """The same force as terms that a simulator evaluates natively; None if it has others.

        Such a force is evaluated in Python, which takes longer. Empty where there is no force.
        """
        return None

    def simulated_inertia(self, values: Sequence[float], robot: Robot) -> np.ndarray:
        """Addition to the joint-space inertia matrix, (n, n)."""
        return np.zeros((robot.n, robot.n))

    def simulated_robot(self, values: Sequence[float], robot: Robot) -> Robot:
        """The robot with the effect on board, where the effect is a change of its bodies."""
        return robot

    def simulated_gain(self, values: Sequence[float], robot: Robot) -> np.ndarray:
        """Recorded torque per torque that acts, (n,)."""
        return np.ones(robot.n)

    def simulated_rate(self, values: Sequence[float], block: Block) -> np.ndarray:
        """Rate of its internal states, (T, memory) per s, from t, q, v and `block.memory`."""
        return np.zeros((len(block.t), self.memory))

    def simulated_transmission(self, values: Sequence[float], robot: Robot) -> Transmission | None:
        """What it puts between a motor and its link; None for nothing."""
        return None

    def simulated_loss(self, values: Sequence[float], robot: Robot) -> np.ndarray:
        """Dry friction per transmitted torque, (n,): torque needed + loss abs(torque) sign(v)."""
        return np.zeros(robot.n)

    def simulated_delay(self, values: Sequence[float], robot: Robot) -> np.ndarray:
        """Time by which the recorded torque is late, (n,) s: it is that which acted then."""
        return np.zeros(robot.n)
