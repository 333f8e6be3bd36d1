"""A function as a list of additions, subtractions and products, replayed over blocks of samples.

CasADi keeps a scalar function as a list of instructions on work slots. Each of them is one NumPy
call on a row of samples here, so that Python is entered once an instruction and block, not once an
instruction and sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from dynident.batch.memory import side_by_side
from dynident.batch.newton_euler import Equations
from dynident.late_modules import LateModule

ca: Any = LateModule("casadi")

BLOCK = 4096
"""Samples of a block at most: a call costs little beside them, and a few hundred slots of them
stay in the cache. Measured: half as many take a fifth longer, a quarter three quarters."""

OPERATIONS = "+-*"
"""By the numbers that they have on a tape."""

_UFUNCS = (np.add, np.subtract, np.multiply)
_ADD, _SUB, _MUL = range(3)

Step = tuple[int, int, int]


@dataclass(frozen=True, eq=False, kw_only=True)
class Tape:
    """Instructions on places: inputs, then constants, work slots, and results.

    Attributes
    ----------
    inputs : how many.
    constants : (c,) numbers.
    slots : how many.
    places : where each result belongs.
    steps : (k, 4) of int32: operation, left, right, target; the last three by the numbers of
        places in the above order.
    """

    inputs: int
    constants: np.ndarray
    slots: int
    places: tuple[tuple[int, ...], ...]
    steps: np.ndarray

    @cached_property
    def _calls(self) -> list[tuple[Any, int, int, int]]:
        return [(_UFUNCS[code], left, right, to) for code, left, right, to in self.steps.tolist()]

    def replay(self, inputs: Sequence[Any], results: Sequence[np.ndarray]) -> None:
        """Evaluate at all samples.

        Parameters
        ----------
        inputs : of each, (T,), or a number.
        results : of each place, (T,), to be written.
        """
        samples = len(results[0]) if results else 0
        size = min(BLOCK, samples)
        work = list(np.moveaxis(side_by_side(size, (self.slots,)), 0, -1))
        for start in range(0, samples, max(size, 1)):
            part = slice(start, min(start + size, samples))
            at: list[Any] = [x if np.ndim(x) == 0 else x[part] for x in inputs]
            at += self.constants.tolist()
            at += [row[: part.stop - start] for row in work]
            at += [row[part] for row in results]
            # Overflow is the caller's to judge, from the results.
            with np.errstate(all="ignore"):
                for ufunc, left, right, to in self._calls:
                    ufunc(at[left], at[right], at[to])


def tape_of(terms: Equations) -> Tape:
    """Return the instructions of some expressions.

    Parameters
    ----------
    terms : their inputs, expressions and places.
    """
    values = _Values(terms)
    kept = _Storage(values)
    start = {"input": 0, "constant": terms.inputs.numel()}
    start["slot"] = start["constant"] + len(values.constants)
    start["result"] = start["slot"] + kept.slots

    def place(value: int) -> int:
        kind, index = values.outside(value) if value < 0 else kept.home[value]
        return start[kind] + index

    steps = [
        (code, place(left), place(right), place(number))
        for number, (code, left, right) in enumerate(values.steps)
    ]
    # What is an input, a number or another result as well.
    steps += [
        (_ADD, place(value), start["constant"], start["result"] + index)
        for index, value in kept.copies
    ]
    return Tape(
        inputs=start["constant"],
        constants=np.array(values.constants),
        slots=kept.slots,
        places=terms.places,
        steps=np.array(steps, dtype=np.int32).reshape(-1, 4),
    )


class _Storage:
    """Where each value is kept: slots as few as there are values alive at a time.

    Attributes
    ----------
    home : ("slot" or "result", index) of each step's value. A result is computed where it belongs,
        and read from there.
    copies : (result, value) that no step writes.
    slots : how many are needed.
    """

    def __init__(self, values: _Values) -> None:
        self.home: dict[int, tuple[str, int]] = {}
        self.copies: list[tuple[int, int]] = []
        self.slots = 0
        for index, value in enumerate(values.results):
            if value >= 0 and value not in self.home:
                self.home[value] = ("result", index)
            else:
                self.copies.append((index, value))
        last = {value: k for k, (_, *used) in enumerate(values.steps) for value in used}
        free: list[int] = []
        for k, (_, *used) in enumerate(values.steps):
            for value in set(used):
                if value >= 0 and last[value] == k and self.home[value][0] == "slot":
                    free.append(self.home[value][1])
            if k not in self.home:
                if not free:
                    free.append(self.slots)
                    self.slots += 1
                self.home[k] = ("slot", free.pop())


class _Values:
    """What a function computes, each value once.

    Attributes
    ----------
    constants : numbers in use; the first is 0.
    steps : (operation, left, right) each, of values: the number of a step, or one below zero of
        what comes from outside.
    results : value of each expression.
    """

    def __init__(self, terms: Equations) -> None:
        self.constants = [0.0]
        self.steps: list[Step] = []
        self.results = [0] * len(terms.places)
        self._inputs = terms.inputs.numel()
        self._known: dict[Step, int] = {}
        self._numbers = {0.0: 0}
        self._walk(ca.Function("terms", [terms.inputs], [terms.expressions]))

    def outside(self, value: int) -> tuple[str, int]:
        """Which input or constant a value below zero stands for."""
        index = -1 - value
        if index < self._inputs:
            return "input", index
        return "constant", index - self._inputs

    def _walk(self, function: Any) -> None:
        held: dict[int, int] = {}  # the value in each of CasADi's slots
        output, given, constant = ca.OP_OUTPUT, ca.OP_INPUT, ca.OP_CONST
        operations = {
            ca.OP_ADD: lambda left, right: self._step(_ADD, left, right),
            ca.OP_SUB: lambda left, right: self._step(_SUB, left, right),
            ca.OP_MUL: lambda left, right: self._step(_MUL, left, right),
            ca.OP_NEG: lambda one: self._step(_MUL, self._constant(-1.0), one),
            ca.OP_TWICE: lambda one: self._step(_ADD, one, one),
            ca.OP_SQ: lambda one: self._step(_MUL, one, one),
        }
        for k in range(function.n_instructions()):
            kind, used = function.instruction_id(k), function.instruction_input(k)
            made = function.instruction_output(k)
            if kind == output:
                self.results[made[1]] = held[used[0]]
            elif kind == given:
                held[made[0]] = -1 - used[1]
            elif kind == constant:
                held[made[0]] = self._constant(function.instruction_constant(k))
            else:
                held[made[0]] = operations[kind](*(held[slot] for slot in used))

    def _step(self, code: int, left: int, right: int) -> int:
        if code != _SUB and right < left:
            left, right = right, left
        key = (code, left, right)
        if key not in self._known:
            self._known[key] = len(self.steps)
            self.steps.append(key)
        return self._known[key]

    def _constant(self, number: float) -> int:
        if number not in self._numbers:
            self._numbers[number] = len(self.constants)
            self.constants.append(number)
        return -1 - self._inputs - self._numbers[number]
