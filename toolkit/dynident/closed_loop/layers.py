"""Forces made of terms as Drake's own systems, in C++.

Three `MultilayerPerceptron`s of the plant's state, each there only if it is needed: an identity
layer for constants, springs and viscous friction; a tanh layer for dry friction; and a layer of
rectifiers for magnitudes, |x| = max(x, 0) + max(-x, 0). All weights live in the Context: other
coefficients, of any sign, need no other diagram.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.primitives import Adder, MultilayerPerceptron
from pydrake.systems.primitives import PerceptronActivationType as Activation

from dynident.closed_loop.compiled import Bodies
from dynident.effects import Term

Unit = tuple[int, ...]
"""Entries of the plant's velocities whose sum one hidden unit sees."""


@dataclass(frozen=True)
class Terms:
    """Terms of mechanisms side by side, in the plant's order.

    Attributes
    ----------
    terms : of all mechanisms; `at` and `of` are entries of the plant's velocities.
    widths : of the dry friction of each.
    size : N, number of velocities.
    """

    terms: tuple[Term, ...]
    widths: tuple[float, ...]
    size: int

    @classmethod
    def of(cls, bodies: Bodies) -> Terms:
        """Return the terms of mechanisms that stand in a plant."""
        terms, widths = [], []
        n = bodies.mechanisms[0].robot.n
        for k, mechanism in enumerate(bodies.mechanisms):
            own = bodies.place[k * n : k * n + n]
            for term in mechanism.terms:
                of = tuple(sorted(int(own[i]) for i in term.of))
                terms.append(Term(int(own[term.at]), term.law, of, term.coefficient))
                widths.append(mechanism.friction_width)
        return cls(tuple(terms), tuple(widths), len(bodies.place))

    @property
    def is_linear(self) -> bool:
        """Whether some are linear in the state."""
        return any(term.law in ("constant", "position", "speed") for term in self.terms)

    def units(self, law: str) -> tuple[Unit, ...]:
        """Return the distinct sums of speeds that a law is taken of."""
        return tuple(sorted({term.of for term in self.terms if term.law == law}))


class Layers:
    """The systems of some terms; `Terms` of the same structure may be set later.

    Parameters
    ----------
    builder : Drake's diagram builder.
    state : output port of the plant's state (2 N,).
    terms : the structure.
    """

    def __init__(self, builder: Any, state: Any, terms: Terms) -> None:
        size = terms.size
        self._signs, self._magnitudes = terms.units("sign"), terms.units("magnitude")
        self._linear = self._dry = self._rectified = None
        if terms.is_linear:
            self._linear = _network([2 * size, size], [Activation.kIdentity])
        if self._signs:
            self._dry = _network(
                [2 * size, len(self._signs), size], [Activation.kTanh, Activation.kIdentity]
            )
        if self._magnitudes:
            self._rectified = _network(
                [2 * size, 2 * len(self._magnitudes), size],
                [Activation.kReLU, Activation.kIdentity],
            )
        self._systems = [
            builder.AddSystem(one)
            for one in (self._linear, self._dry, self._rectified)
            if one is not None
        ]
        for one in self._systems:
            builder.Connect(state, one.get_input_port())

    @property
    def outputs(self) -> list[Any]:
        """Output ports whose sum is the force (N,)."""
        return [one.get_output_port() for one in self._systems]

    def set(self, root: Any, terms: Terms) -> None:
        """Write the weights of terms of the same structure into the diagram's Context."""
        size = terms.size
        if self._linear is not None:
            W, b = _zeros(size, 2 * size), np.zeros(size)
            for term in terms.terms:
                if term.law == "constant":
                    b[term.at] -= term.coefficient
                elif term.law in ("position", "speed"):
                    offset = size if term.law == "speed" else 0
                    for i in term.of:
                        W[term.at, i + offset] -= term.coefficient
            _write(self._linear, root, [(W, b)])
        if self._dry is not None:
            count = len(self._signs)
            inner, outer = _zeros(count, 2 * size), _zeros(size, count)
            for term, width in zip(terms.terms, terms.widths, strict=True):
                if term.law == "sign":
                    unit = self._signs.index(term.of)
                    for i in term.of:
                        inner[unit, size + i] = 1.0 / width
                    outer[term.at, unit] -= term.coefficient
            _write(self._dry, root, [(inner, np.zeros(count)), (outer, np.zeros(size))])
        if self._rectified is not None:
            count = len(self._magnitudes)
            inner, outer = _zeros(2 * count, 2 * size), _zeros(size, 2 * count)
            for term in terms.terms:
                if term.law == "magnitude":
                    unit = self._magnitudes.index(term.of)
                    for half, sign in ((unit, 1.0), (unit + count, -1.0)):
                        for i in term.of:
                            inner[half, size + i] = sign
                        outer[term.at, half] -= term.coefficient
            _write(self._rectified, root, [(inner, np.zeros(2 * count)), (outer, np.zeros(size))])


def summed(builder: Any, outputs: Sequence[Any], size: int) -> Any:
    """Return an output port (size,) of the sum of others; of one, itself."""
    if len(outputs) == 1:
        return outputs[0]
    adder: Any = builder.AddSystem(Adder(len(outputs), size))
    for k, one in enumerate(outputs):
        builder.Connect(one, adder.get_input_port(k))
    return adder.get_output_port()


def _network(sizes: list[int], activations: list[Any]) -> Any:
    return MultilayerPerceptron(sizes, activations)


def _zeros(rows: int, columns: int) -> np.ndarray:
    # The bindings take weights column by column only.
    return np.zeros((rows, columns), order="F")


def _write(network: Any, root: Any, weights: Sequence[tuple[np.ndarray, np.ndarray]]) -> None:
    context = network.GetMyMutableContextFromRoot(root)
    for layer, (W, b) in enumerate(weights):
        network.SetWeights(context, layer, W)
        network.SetBiases(context, layer, b)
