"""Filters as second-order sections: the Butterworth low-pass, and what is asked of any filter.

The same as in `scipy.signal`, which is not loaded for it: with all of statistics, which it loads in
turn, it takes longer than most fits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np


def butterworth_sections(share: float, order: int) -> np.ndarray:
    """Return a digital Butterworth low-pass, as `scipy.signal.butter`.

    Parameters
    ----------
    share : its cut-off in half the sampling rate, between 0 and 1.
    order : even.

    Returns
    -------
    (order / 2, 6) rows b0 b1 b2 1 a1 a2, the gain in the first, the slowest poles in the last.
    """
    # Of each pair of poles of the analogue filter one, through the bilinear transform.
    angles = np.pi * np.arange(1, order, 2) / (2 * order)
    poles = -np.tan(np.pi * share / 2) * np.exp(1j * angles)
    digital = (1 + poles) / (1 - poles)
    sections = np.zeros((order // 2, 6))
    sections[:, :3] = 1.0, 2.0, 1.0
    sections[:, 3:] = np.stack([np.ones(len(poles)), -2 * digital.real, np.abs(digital) ** 2], 1)
    sections[0, :3] *= np.prod(np.abs(poles) ** 2 / np.abs(1 - poles) ** 2)
    return sections


def response(sections: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return what a filter makes of harmonic signals, as `scipy.signal.sosfreqz`.

    Parameters
    ----------
    sections : (s, 6)
    angle : (F,) rad from sample to sample.

    Returns
    -------
    (F,) complex.
    """
    back = np.exp(-1j * angle)
    powers = np.stack([np.ones_like(back), back, back**2])
    return np.prod((sections[:, :3] @ powers) / (sections[:, 3:] @ powers), axis=0)


def state_at_rest(sections: np.ndarray) -> np.ndarray:
    """Return the state of each section after a long time at one, as `scipy.signal.sosfilt_zi`.

    Parameters
    ----------
    sections : (s, 6)

    Returns
    -------
    (s, 2) of direct form II transposed.
    """
    forward, backward = sections[:, :3], sections[:, 3:]
    into = forward[:, 1:] - backward[:, 1:] * forward[:, :1]
    first = into.sum(axis=1) / backward.sum(axis=1)
    second = (1.0 + backward[:, 1]) * first - into[:, 0]
    gains = forward.sum(axis=1) / backward.sum(axis=1)
    enters = np.cumprod(np.append(1.0, gains[:-1]))
    return np.stack([first, second], axis=1) * enters[:, None]


@dataclass(frozen=True, eq=False, kw_only=True)
class NormalForm:
    """A filter with n states s: s' = across s + into x, y = out s + through x.

    Each pair of states turns and fades as a pair of poles, and so do its roundings; those of direct
    forms are summed up twice for low cut-offs, which lose digits.

    Attributes
    ----------
    across : (n, n)
    into, out : (n,)
    through : what a sample makes of itself.
    rest : (n,) states after a long time at one.
    """

    across: np.ndarray
    into: np.ndarray
    out: np.ndarray
    through: float
    rest: np.ndarray


def normal_form(sections: np.ndarray) -> NormalForm:
    """Return a filter as pairs of poles, each fed by those before it.

    Parameters
    ----------
    sections : (s, 6), each with a pair of complex poles, as the low-passes of even order have.

    Raises
    ------
    ValueError
        If a section has real poles.
    """
    n = 2 * len(sections)
    across, into, out, rest = np.zeros((n, n)), np.zeros(n), np.zeros(n), np.zeros(n)
    through = gain = 1.0  # of a sample, of a constant
    for i, (b0, b1, b2, _, a1, a2) in enumerate(sections.tolist()):
        # From the pole to one, which for low cut-offs is little: in this order nothing is lost.
        constant, half = 1.0 + a1 + a2, 1.0 + a1 / 2.0
        if constant <= half * half:
            raise ValueError("a section of a filter has real poles")
        short = complex(half, -math.sqrt(constant - half * half))
        pole = 1.0 - short
        residue = ((b0 * pole + b1) * pole + b2) / (2j * pole.imag)
        pair, enters = slice(2 * i, 2 * i + 2), np.array([residue.real, residue.imag])
        across[pair] += np.outer(enters, out)
        across[pair, pair] += [[pole.real, -pole.imag], [pole.imag, pole.real]]
        into[pair] = enters * through
        still = residue * gain / short
        rest[pair] = still.real, still.imag
        out *= b0
        out[2 * i] = 2.0
        through *= b0
        gain *= (b0 + b1 + b2) / constant
    return NormalForm(across=across, into=into, out=out, through=through, rest=rest)


def slowest_pole(sections: np.ndarray) -> float:
    """Return by how much a filter's slowest part fades from sample to sample.

    Parameters
    ----------
    sections : (s, 6)
    """
    return _slowest_of(np.asarray(sections[:, 3:], dtype=float).tobytes())


@lru_cache(64)
def _slowest_of(denominators: bytes) -> float:
    """The same of 1 a1 a2 of each section; a fit asks for that of one filter many times."""
    each = np.frombuffer(denominators).reshape(-1, 3)
    return max(float(np.abs(np.roots(one)).max()) for one in each)
