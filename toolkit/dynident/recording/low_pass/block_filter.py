"""Zero-phase filters as matrix products over blocks of samples, where nothing is compiled.

A filter with states s is s' = A s + b x, y = c s + d x. Over a block of samples its states move by
a power of A and a sum of the block's samples, and those that the backward pass meets, as well as
the samples that are wanted, are such sums too. So each block is a row of one matrix product, and
only states are led from block to block. Samples between those that are wanted are never written
out.

Source: C. W. Barnes and S. Shinnaka, "Block-shift invariance and block implementation of
discrete-time filters", IEEE Transactions on Circuits and Systems 27 (1980), for one pass.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dynident.recording.low_pass.sections import NormalForm, normal_form

_SAMPLES = 96  # of a block, about: more are more work, fewer more blocks
_MOST_APART = 256  # wanted samples further apart are taken from others between them
_BLOCKS = 16  # whose states are found in one product


def filtered_rows(
    x: Sequence[np.ndarray], sections: np.ndarray, padding: int, rows: np.ndarray
) -> np.ndarray:
    """Filter columns forward and backward, as SciPy's `sosfiltfilt` with odd padding.

    What comes of a column does not depend on the others, to the last bit.

    Parameters
    ----------
    x : k columns (T,) of any quantity, one at least.
    sections : of the filter, (s, 6) as `butterworth_sections` gives them, with complex poles.
    padding : samples of point reflection at each end, fewer than T.
    rows : (R,) which of the T samples are wanted, one at least.

    Returns
    -------
    (k, R), filtered twice.
    """
    apart = _common_step(rows)
    f = _block_filter(sections.tobytes(), len(sections), apart)
    # The filter is at rest before the first sample: as many more of the same change nothing.
    ahead = -(padding + int(rows.min())) % f.samples
    w = _extended(x, padding, ahead)
    count = (w.shape[1] - 1) // f.samples  # the last block, of one sample at least, is another
    whole, last = np.split(w[:, None], [count * f.samples], axis=2)
    found = whole.reshape(len(w), count, f.samples) @ f.of_samples
    n = len(f.form.rest)
    states = _led(f.form.rest * w[:, :1], found[:, :, :n], f)
    end, backward = _last_block(last, states[:, -1:], f)
    found[:, :, n:] += states[:, :-1] @ f.of_states
    met = _led(backward, found[:, ::-1, n : 2 * n], f)[:, ::-1]
    wanted = f.of_later_states.shape[1]  # of a block
    every = np.empty((len(w), count * wanted + len(range(0, end.shape[1], apart))))
    inner = every[:, : count * wanted].reshape(len(w), count, wanted)
    np.matmul(met[:, 1:], f.of_later_states, out=inner)
    inner += found[:, :, 2 * n :]
    every[:, count * wanted :] = end[:, ::apart]
    del w, whole, last, found  # long records are as large as this, each of them
    return every[:, (ahead + padding + rows) // apart]


def _common_step(rows: np.ndarray) -> int:
    """A number of samples of which all wanted ones are a whole number apart."""
    step = int(np.gcd.reduce(np.diff(rows))) or 1
    return max(apart for apart in range(1, _MOST_APART + 1) if step % apart == 0)


def _extended(x: Sequence[np.ndarray], padding: int, ahead: int) -> np.ndarray:
    """Columns with a point reflection at each end, and so many samples of the first before it."""
    front, samples = ahead + padding, len(x[0])
    w = np.empty((len(x), front + samples + padding))
    inside = w[:, front : front + samples]
    for row, column in zip(inside, x, strict=True):
        row[:] = column
    w[:, ahead:front] = 2 * inside[:, :1] - inside[:, padding:0:-1]
    w[:, front + samples :] = 2 * inside[:, -1:] - inside[:, -2 : -padding - 2 : -1]
    w[:, :ahead] = w[:, ahead : ahead + 1]
    return w


@dataclass(frozen=True, eq=False)
class _BlockFilter:
    """A filter over blocks of L samples, of which m are wanted; n states.

    Row vectors are multiplied from the left. Each product is of what the forward pass adds to its
    states (n), what the backward pass adds to its own (n), and the wanted samples (m).

    Attributes
    ----------
    form : the filter from sample to sample.
    observed : (L, n) c A^i.
    entered : (L, n) A^i b.
    response : (L, L) of samples, from those of the row to those of the column.
    of_samples : (L, 2n + m), by the samples of the block.
    of_states : (n, n + m), by the states before the block; without those of the forward pass.
    of_later_states : (n, m), the wanted samples by the states of the backward pass after the block.
    over_blocks : (g n, g n) states after each of g blocks by what each adds.
    from_before : (n, g n) the same by the states before them.
    over_all : (n, n) states after all of them.
    """

    form: NormalForm
    observed: np.ndarray
    entered: np.ndarray
    response: np.ndarray
    of_samples: np.ndarray
    of_states: np.ndarray
    of_later_states: np.ndarray
    over_blocks: np.ndarray
    from_before: np.ndarray
    over_all: np.ndarray

    @property
    def samples(self) -> int:
        """Of a block."""
        return len(self.response)


@lru_cache(32)
def _block_filter(sections: bytes, count: int, apart: int) -> _BlockFilter:
    """The matrices for wanted samples that are so far apart, the first of a block among them."""
    form = normal_form(np.frombuffer(sections).reshape(count, 6))
    samples = apart * max(1, _SAMPLES // apart)
    powers = _powers(form.across, samples)
    observed, entered = form.out @ powers[:-1], powers[:-1] @ form.into
    impulse = np.append(form.through, entered[:-1] @ form.out)
    lag = np.arange(samples) - np.arange(samples)[:, None]
    response = np.where(lag >= 0, impulse[np.maximum(lag, 0)], 0.0)
    # The backward pass is the forward one in reversed time, so its matrices are those reversed.
    passes = np.hstack([entered, response.T[:, ::apart]])
    blocks = _powers(powers[-1], _BLOCKS)
    n = len(form.rest)
    lag = np.arange(_BLOCKS) - np.arange(_BLOCKS)[:, None]
    over = np.where((lag >= 0)[..., None, None], blocks[np.maximum(lag, 0)], 0.0)
    return _BlockFilter(
        form=form,
        observed=observed,
        entered=entered,
        response=response,
        of_samples=np.hstack([entered[::-1], response @ passes]),
        of_states=observed.T @ passes,
        of_later_states=np.ascontiguousarray(observed[::-1][::apart].T),
        over_blocks=over.transpose(0, 3, 1, 2).reshape(_BLOCKS * n, _BLOCKS * n),
        from_before=blocks[1:].transpose(2, 0, 1).reshape(n, _BLOCKS * n),
        over_all=np.ascontiguousarray(blocks[-1].T),
    )


def _powers(a: np.ndarray, last: int) -> np.ndarray:
    """(last + 1, n, n) the powers of a matrix from the zeroth."""
    found = np.empty((last + 1, *a.shape))
    found[0] = np.eye(len(a))
    for i in range(last):
        found[i + 1] = a @ found[i]
    return found


def _led(first: np.ndarray, added: np.ndarray, f: _BlockFilter) -> np.ndarray:
    """States before each block and after the last: (k, K + 1, n) of (k, n) and (k, K, n)."""
    columns, count, n = added.shape
    groups = math.ceil(count / _BLOCKS)
    padded = np.zeros((columns, groups * _BLOCKS, n))
    padded[:, :count] = added
    within = padded.reshape(columns, groups, _BLOCKS * n) @ f.over_blocks
    before = np.empty((columns, groups, 1, n))
    state = first[:, None]
    for group in range(groups):
        before[:, group] = state
        state = state @ f.over_all + within[:, group, None, -n:]
    within += before[:, :, 0] @ f.from_before
    states = np.empty((columns, count + 1, n))
    states[:, 0] = first
    states[:, 1:] = within.reshape(columns, groups * _BLOCKS, n)[:, :count]
    return states


def _last_block(
    w: np.ndarray, states: np.ndarray, f: _BlockFilter
) -> tuple[np.ndarray, np.ndarray]:
    """The samples of the last block, which may be shorter, and the states that the next meets.

    There the backward pass begins, at rest at what the forward pass ends with.
    """
    some = w.shape[2]
    response, observed = f.response[:some, :some], f.observed[:some]
    y = w @ response + states @ observed.T
    later = f.form.rest * y[:, :, -1:]
    z = y @ response.T + later @ observed[::-1].T
    over = np.linalg.matrix_power(f.form.across, some).T
    return z[:, 0], (later @ over + y @ f.entered[:some])[:, 0]
