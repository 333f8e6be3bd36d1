"""Functions of a tree of joints over many samples: made once a tree, kept, and shared."""

from __future__ import annotations

import ctypes
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from dynident.batch.c_source import ENTRY, LANES, c_source, work_size
from dynident.batch.choice import Choice, Price
from dynident.batch.evaluation import COMPILE_AFTER, LOOK_AFTER, Evaluation
from dynident.batch.joint_tree import JointTree
from dynident.batch.memory import side_by_side
from dynident.batch.newton_euler import SIGNALS, Equations, regressor_equations, torque_equations
from dynident.batch.tape import Tape, tape_of
from dynident.batch.torque_derivatives import torque_derivative_equations

_KEPT = 32  # functions; one of 60 joints takes some MB
_used: dict[Evaluation, None] = {}
_FEW_ANGLES = 2**18  # positions at most, of which cosines and sines are kept


class Kernel:
    """A function of joints' motion, evaluated over blocks of samples.

    Parameters
    ----------
    terms : what is computed.
    shape : of the result at a sample; where there is no term it is zero.
    """

    def __init__(self, terms: Equations, shape: tuple[int, ...]) -> None:
        self.shape = shape
        self._tape: Tape = tape_of(terms)
        self._nowhere = np.ones(shape, dtype=bool)
        self._nowhere[tuple(np.transpose(terms.places))] = False
        self._seen = 0
        self._choice = Choice(lambda: c_source(self._tape), ENTRY, "replayed")

    @property
    def evaluation(self) -> Evaluation:
        """How it was evaluated in the last call, and why."""
        return self._choice.evaluation

    def __call__(
        self,
        q: np.ndarray,
        v: np.ndarray,
        a: np.ndarray,
        *,
        parameters: Sequence[float] = (),
        out: np.ndarray | None = None,
    ) -> np.ndarray:
        """Evaluate at all samples.

        Parameters
        ----------
        q, v, a : (T, n) rad or m, and per s and s^2.
        parameters : what the terms depend on besides.
        out : (T, *shape) to write to, fastest where its memory is that of `side_by_side`; if there
            is none, it is made.

        Returns
        -------
        (T, *shape), as `out`.

        Raises
        ------
        SettingError
            If the environment says something else of compiling than it can.
        TypeError, ValueError
            If the result does not fit into `out`, by its kind of number or its shape, or `out` is
            read-only.
        """
        samples = len(q)
        shape = (samples, *self.shape)
        direct = out is not None and _is_side_by_side(out, shape)
        result = out if out is not None and direct else side_by_side(samples, self.shape)
        rows = np.moveaxis(result, 0, -1)
        rows[self._nowhere] = 0.0
        signals, numbers = _signals(q, v, a), np.array(parameters, dtype=float)
        price = Price(look_after=LOOK_AFTER, compile_after=COMPILE_AFTER)
        self._seen += samples
        function = self._choice.function(self._seen, price)
        _used.setdefault(self.evaluation)
        if function is None or samples < LANES:
            results = [rows[place] for place in self._tape.places]
            self._tape.replay([*signals, *numbers.tolist()], results)
        else:
            self._run(function, signals, numbers, rows)
        if out is None or direct:
            return result
        np.copyto(out, result)
        return out

    def _run(
        self, function: Any, signals: np.ndarray, numbers: np.ndarray, rows: np.ndarray
    ) -> None:
        """Call the compiled function."""
        steps = np.repeat([1, 0], [len(signals), len(numbers)]).astype(ctypes.c_long)
        places = np.array(self._tape.places, dtype=int).reshape(-1, len(self.shape))
        inputs = [_addresses(signals, np.arange(len(signals))[:, None])]
        inputs.append(_addresses(numbers, np.arange(len(numbers))[:, None]))
        given, results = np.concatenate(inputs), _addresses(rows, places)
        work = side_by_side(work_size(self._tape), ())
        every = (given, steps, work, results)
        function(ctypes.c_long(signals.shape[1]), *(ctypes.c_void_p(x.ctypes.data) for x in every))


@lru_cache(maxsize=_KEPT)
def regressor_kernel(tree: JointTree, columns: tuple[int, ...]) -> Kernel:
    """Return the function of some columns of the regressor, (T, n, len(columns)).

    Parameters
    ----------
    tree : the robot.
    columns : ascending; column 10 j + k is parameter k of body j.
    """
    return Kernel(regressor_equations(tree, columns), (tree.n, len(columns)))


@lru_cache(maxsize=_KEPT)
def torque_kernel(tree: JointTree) -> Kernel:
    """Return the function of the torque, (T, n); its parameters are the 10 n of the bodies.

    Parameters
    ----------
    tree : the robot.
    """
    return Kernel(torque_equations(tree), (tree.n,))


@lru_cache(maxsize=_KEPT)
def torque_derivative_kernel(tree: JointTree, joint: int) -> Kernel:
    """Return the function of the torque's derivatives by one joint's q, v and a, (T, 3, n).

    Its parameters are the 10 n of the bodies.

    Parameters
    ----------
    tree : the robot.
    joint : by whose motion.
    """
    return Kernel(torque_derivative_equations(tree, joint), (3, tree.n))


def evaluations() -> tuple[Evaluation, ...]:
    """Return how the functions of many samples were evaluated in this process, each way once."""
    return tuple(_used)


def _signals(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """The inputs (5 n, T), see `dynident.batch.newton_euler.SIGNALS`; each row in one piece."""
    samples, n = q.shape
    signals = np.moveaxis(side_by_side(samples, (SIGNALS, n)), 0, -1)
    signals[2], signals[3], signals[4] = q.T, v.T, a.T
    _turn(signals[2], signals[:2])
    return signals.reshape(SIGNALS * n, samples)


@dataclass(frozen=True)
class _Turned:
    """Positions (n, T), and their cosines and sines (2, n, T)."""

    q: np.ndarray
    both: np.ndarray


_turned: deque[_Turned] = deque(maxlen=4)


def _turn(q: np.ndarray, both: np.ndarray) -> None:
    """Write cosines and sines (2, n, T) of positions (n, T).

    A model is evaluated again and again along the same motion, or along one in which a single joint
    stands elsewhere, and they take longer than all that follows from them.
    """
    left = np.ones(len(q), dtype=bool)
    for known in list(_turned):
        if known.q.shape != q.shape:
            continue
        for j in np.flatnonzero(left & (known.q[:, :1] == q[:, :1]).all(axis=1)):
            if np.array_equal(known.q[j], q[j]):
                both[:, j] = known.both[:, j]
                left[j] = False
    if not left.any():
        return
    for j in np.flatnonzero(left):
        np.cos(q[j], out=both[0, j])
        np.sin(q[j], out=both[1, j])
    if q.size <= _FEW_ANGLES:
        _turned.append(_Turned(q.copy(), both.copy()))


def _is_side_by_side(out: np.ndarray, shape: tuple[int, ...]) -> bool:
    """Whether an array can be written from where each entry begins, sample after sample."""
    fits = out.shape == shape and out.dtype == np.float64 and out.strides[0] == out.itemsize
    return fits and out.flags.aligned and out.flags.writeable


def _addresses(array: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Where the parts of an array at places (k, d) begin, (k,).

    To ask each of hundreds of parts itself costs as much as to compute a short recording.
    """
    strides = np.array(array.strides[: places.shape[1]], dtype=int)
    return (array.ctypes.data + places @ strides).astype(np.uintp)
