"""Forces made of terms as Drake's own systems, in C++.

Two `MultilayerPerceptron`s of the plant's state, each there only if it is needed. One has a tanh
layer for dry friction, and for springs and viscous friction too: tanh(e x) / e is x to the last
digit where e is small enough, and one network costs less than two and their sum. The other has a
layer of rectifiers for magnitudes, |x| = max(x, 0) + max(-x, 0). All weights live in the Context:
other coefficients, of any sign, need no other diagram.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.primitives import Adder, MultilayerPerceptron
from pydrake.systems.primitives import PerceptronActivationType as Activation

from dynident.closed_loop.plant.side_by_side import Bodies
from dynident.effects import Term

Unit = tuple[str, tuple[int, ...]]
"""A law, and the entries of the plant's velocities whose motion it is taken of: a hidden unit."""

_STRAIGHT = 2.0**-40
"""e above: of x = 1e5 the last digit is lost. A power of two, so that scaling rounds nothing."""


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
                widths.append(float(mechanism.friction_widths[list(term.of or (term.at,))].max()))
        return cls(tuple(terms), tuple(widths), len(bodies.place))

    @property
    def smooth(self) -> tuple[Unit, ...]:
        """Units of the tanh layer; a constant needs one to stand behind."""
        units = {(t.law, t.of) for t in self.terms if t.law in ("position", "speed", "sign")}
        if not units and any(term.law == "constant" for term in self.terms):
            units = {("speed", (0,))}
        return tuple(sorted(units))

    @property
    def rectified(self) -> tuple[Unit, ...]:
        """Units of which a pair of rectifiers makes the magnitude."""
        return tuple(sorted({(t.law, t.of) for t in self.terms if t.law == "magnitude"}))


class Layers:
    """The systems of some terms; `Terms` of the same structure may be set later.

    Parameters
    ----------
    builder : Drake's diagram builder.
    state : output port of the plant's state (2 N,).
    terms : the structure.
    """

    def __init__(self, builder: Any, state: Any, terms: Terms) -> None:
        self._smooth, self._rectified = terms.smooth, terms.rectified
        self._networks: list[Any] = []
        for hidden, activation in (
            (len(self._smooth), Activation.kTanh),
            (2 * len(self._rectified), Activation.kReLU),
        ):
            if hidden:
                sizes = [2 * terms.size, hidden, terms.size]
                network = MultilayerPerceptron(sizes, [activation, Activation.kIdentity])
                self._networks.append(builder.AddSystem(network))
        for network in self._networks:
            builder.Connect(state, network.get_input_port())

    @property
    def outputs(self) -> list[Any]:
        """Output ports whose sum is the force (N,)."""
        return [network.get_output_port() for network in self._networks]

    def set(self, root: Any, terms: Terms) -> None:
        """Write the weights of terms of the same structure into the diagram's Context."""
        weights = []
        if self._smooth:
            weights.append(_smooth_weights(terms, self._smooth))
        if self._rectified:
            weights.append(_rectified_weights(terms, self._rectified))
        for network, (inner, outer, bias) in zip(self._networks, weights, strict=True):
            context = network.GetMyMutableContextFromRoot(root)
            network.SetWeights(context, 0, inner)
            network.SetBiases(context, 0, np.zeros(len(inner)))
            network.SetWeights(context, 1, outer)
            network.SetBiases(context, 1, bias)


Weights = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Weights of the hidden layer (H, 2 N), of the output (N, H), and its bias (N,)."""


def _smooth_weights(terms: Terms, units: Sequence[Unit]) -> Weights:
    size = terms.size
    inner, outer, bias = _zeros(len(units), 2 * size), _zeros(size, len(units)), np.zeros(size)
    for term, width in zip(terms.terms, terms.widths, strict=True):
        if term.law == "constant":
            bias[term.at] -= term.coefficient
        elif term.law != "magnitude":
            unit = units.index((term.law, term.of))
            slope = 1.0 / width if term.law == "sign" else _STRAIGHT
            first = 0 if term.law == "position" else size
            inner[unit, [first + i for i in term.of]] = slope
            outer[term.at, unit] -= term.coefficient / (1.0 if term.law == "sign" else slope)
    return inner, outer, bias


def _rectified_weights(terms: Terms, units: Sequence[Unit]) -> Weights:
    size, count = terms.size, len(units)
    inner, outer = _zeros(2 * count, 2 * size), _zeros(size, 2 * count)
    for term in terms.terms:
        if term.law == "magnitude":
            unit = units.index((term.law, term.of))
            for half, sign in ((unit, 1.0), (unit + count, -1.0)):
                inner[half, [size + i for i in term.of]] = sign
                outer[term.at, half] -= term.coefficient
    return inner, outer, np.zeros(size)


def summed(builder: Any, outputs: Sequence[Any], size: int) -> Any:
    """Return an output port of the sum of others; of one, itself.

    Parameters
    ----------
    builder : Drake's diagram builder.
    outputs : ports of vectors (size,).
    size : of each vector.
    """
    if len(outputs) == 1:
        return outputs[0]
    adder: Any = builder.AddSystem(Adder(len(outputs), size))
    for k, one in enumerate(outputs):
        builder.Connect(one, adder.get_input_port(k))
    return adder.get_output_port()


def _zeros(rows: int, columns: int) -> np.ndarray:
    # The bindings take weights column by column only.
    return np.zeros((rows, columns), order="F")
