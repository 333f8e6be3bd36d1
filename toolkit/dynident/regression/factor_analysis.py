"""Joint factor analysis of noisy inputs and output: a round of EM on sufficient statistics.

Model of sample i with inputs m: y ~ N(sum z_m, py); z_m ~ N(wz_m t_m, pz_m); x_m ~ N(wx_m t_m,
px_m); t_m ~ N(0, 1). The Bayesian form has wz_m, wx_m ~ N(0, 1/alpha_m) with one relevance
alpha_m ~ Gamma for both, so that an input that does not matter goes as a whole.

Ting, Mistry, Peters, Schaal and Nakanishi, "Bayesian Nonlinear Parameter Estimation of Rigid Body
Dynamics", RSS 2006, section III and appendix. There every iteration passes over all samples; given
z and t eliminated as here it needs X'X, X'y, y'y and N alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import digamma, gammaln

from dynident.moments import SecondMoments

LEAST_VARIANCE = 1e-9
"""Variance that none falls below, in units of the input's or the output's own: below it the bound
of a million samples would be rounding."""

LEAST_RELIABILITY = 0.5
"""Least reliability that the Bayesian form unfolds b_true with where the noise is not known."""

_ROUNDING = 10 * float(np.finfo(float).eps)
_DEPENDENT = 1e-13  # eigenvalue over the largest, below which inputs are combinations of others


@dataclass(frozen=True, eq=False, kw_only=True)
class Loadings:
    """The factors' posterior and the variances, (d,) each but py.

    Attributes
    ----------
    wz, wx : means of the weights of output and input on the factor t.
    wz_var, wx_var : their variances; zero in plain joint factor analysis.
    relevance : mean of alpha, the precision of both weights' prior; zero there too.
    pz, px : variances of z and of the inputs' noise.
    py : variance of the output's noise.
    """

    wz: np.ndarray
    wx: np.ndarray
    wz_var: np.ndarray
    wx_var: np.ndarray
    relevance: np.ndarray
    pz: np.ndarray
    px: np.ndarray
    py: float

    @property
    def noisy(self) -> np.ndarray:
        """Coefficients for inputs with their noise, b_noise = wx wz / (wx^2 + px), (d,)."""
        return self.wx * self.wz / (self.wx**2 + self.px)

    @property
    def reliability(self) -> np.ndarray:
        """Share of each input's variance that is no noise, wx^2 / (wx^2 + px), (d,)."""
        return self.wx**2 / (self.wx**2 + self.px)


@dataclass(frozen=True)
class Gamma:
    """Prior of the relevance alpha: shape a0 and rate b0, both near zero to say nothing."""

    shape: float = 1e-8
    rate: float = 1e-8


def start_of(
    statistics: SecondMoments, reliability: np.ndarray | float, prior: Gamma | None
) -> Loadings:
    """Return factors that predict as least squares does, with a reliability of each input.

    Half of the residual's variance is the output's noise, the rest is shared evenly by the z.

    Parameters
    ----------
    statistics : standardised: every input and the output have variance 1.
    reliability : of the inputs, between 0 and 1; the data alone do not identify it.
    prior : None for plain joint factor analysis.
    """
    d, N = statistics.inputs, statistics.count
    rho = np.broadcast_to(np.asarray(reliability, dtype=float), (d,))
    spectrum = np.linalg.eigvalsh(statistics.gram)
    full = d > 0 and spectrum[0] > _DEPENDENT * spectrum[-1] and d + 1 < N
    # Else a ridge of one sample: dependent inputs share what they explain.
    ridge = np.zeros((d, d)) if full else np.eye(d)
    found = np.linalg.solve(statistics.gram + ridge, statistics.cross)
    # Where there are more inputs than rows nothing is left, and no variance may be zero.
    least = 0.0 if full else 1e-3 * statistics.power
    left = max(statistics.residual(found), least) / N
    wx = np.sqrt(rho)
    wz = found / wx
    pz = np.full(d, max(left / (2 * max(d, 1)), LEAST_VARIANCE))
    px, py = np.maximum(1.0 - rho, LEAST_VARIANCE), max(left / 2, LEAST_VARIANCE)
    return begun(
        Loadings(wz=wz, wx=wx, wz_var=wx * 0, wx_var=wx * 0, relevance=wx * 0, pz=pz, px=px, py=py),
        N,
        prior,
    )


def begun(factors: Loadings, count: int, prior: Gamma | None) -> Loadings:
    """Return factors with the relevance and variances that follow from their weights.

    Parameters
    ----------
    factors : with weights and the variances of z, of the inputs and of the output.
    count : samples.
    prior : of the relevance; None for plain joint factor analysis, which has none.
    """
    if prior is None:
        return factors
    rate = prior.rate + (factors.wz**2 + factors.wx**2) / 2
    relevance = (prior.shape + 1) / rate
    return replace(
        factors,
        relevance=relevance,
        wz_var=1 / (count / factors.pz + relevance),
        wx_var=1 / (count / factors.px + relevance),
    )


class Posterior:
    """Q(Z, T) of all samples at once; names as in the module's docstring, sums over the samples.

    Given the inputs, t has the precision a; `seen` is each input's variance with the weights'
    doubt in it; `b` is that of E[y | x], which differs from `factors.noisy` by that doubt.

    The covariance of (z, t) is the same for every sample. With t eliminated, which is diagonal,
    one Sherman-Morrison step is left: <z_i> = b x_i + kappa (y_i - b'x_i) and
    <t_i> = ct x_i + e <z_i>.
    """

    # Rounds come by the thousand on tens of numbers: what costs is the number of calls.
    def __init__(self, factors: Loadings, statistics: SecondMoments) -> None:
        self.factors, self.statistics = factors, statistics
        f, total = factors, statistics.total
        mz, mx, pz, px = f.wz, f.wx, f.pz, f.px
        mx2 = mx**2
        # Sums of what is positive throughout: with little noise, differences would lose all digits.
        self.A = 1 + f.wz_var / pz + f.wx_var / px
        self.a = self.A + mz**2 / pz + mx2 / px
        self.seen = px * self.A + mx2
        self.g = pz * px * self.a / self.seen
        self.s = float(self.g.sum())
        self.b = mz * mx / self.seen
        self.kappa = self.g / (f.py + self.s)
        self.ct, self.e = mx / (px * self.a), mz / (pz * self.a)
        self.v = total[:-1, -1] - total[:-1, :-1] @ self.b
        self.R = statistics.residual(self.b)
        self.Gd = total.diagonal()[:-1]

    @property
    def rounding(self) -> float:
        """Nats of the bound that are rounding: of its logarithms, and of the residual's squares."""
        N, d = self.statistics.count, self.statistics.inputs
        squares = self.statistics.power / (self.factors.py + self.s)
        return _ROUNDING * (N * (d + 1) + squares)

    def bound(self, prior: Gamma | None) -> float:
        """Lower bound of the log evidence, nats."""
        f, N, d = self.factors, self.statistics.count, self.statistics.inputs
        logs = np.sum(np.log(self.seen)) + np.log(f.py) + np.log1p(self.s / f.py)
        squares = self.R / (f.py + self.s) + np.sum(self.Gd * self.A / self.seen)
        likelihood = -N / 2 * ((d + 1) * np.log(2 * np.pi) + logs) - 0.5 * squares
        return float(likelihood + (self._of_weights(prior) if prior else 0.0))

    def _of_weights(self, prior: Gamma) -> float:
        """What the priors of weights and relevance, and their entropies, add to the bound."""
        f, a0, b0 = self.factors, prior.shape, prior.rate
        shape, rate = a0 + 1, (a0 + 1) / f.relevance
        log_relevance = digamma(shape) - np.log(rate)
        squares = f.wz**2 + f.wz_var + (f.wx**2 + f.wx_var)
        weights = log_relevance - np.log(2 * np.pi) - f.relevance * squares / 2
        weights += (np.log(2 * np.pi * np.e * f.wz_var) + np.log(2 * np.pi * np.e * f.wx_var)) / 2
        own = a0 * np.log(b0) - gammaln(a0) + (a0 - 1) * log_relevance - b0 * f.relevance
        entropy = shape - np.log(rate) + gammaln(shape) + (1 - shape) * digamma(shape)
        return float(np.sum(weights + own + entropy))

    def updated(self, prior: Gamma | None, known: np.ndarray) -> Loadings:
        """Return weights, relevance and variances that maximise the bound, one after the other.

        Inputs that are `known` (d,) keep the variance px of their noise.
        """
        f, N = self.factors, self.statistics.count
        Gd, b, kappa, ct, e = self.Gd, self.b, self.kappa, self.ct, self.e
        var_z = self.g - self.g**2 / (f.py + self.s)
        xz = b * Gd + kappa * self.v
        zz = b * xz + kappa * (b * self.v + kappa * self.R) + N * var_z
        xt = ct * Gd + e * xz
        zt = ct * xz + e * zz
        tt = ct * xt + e * zt + N / self.a

        wz_var, wx_var = 1 / (tt / f.pz + f.relevance), 1 / (tt / f.px + f.relevance)
        wz, wx = wz_var * zt / f.pz, wx_var * xt / f.px
        if prior is None:
            wz_var, wx_var, relevance = f.wz_var, f.wx_var, f.relevance
            Ez, Ex = wz**2, wx**2
        else:
            Ez, Ex = wz**2 + wz_var, wx**2 + wx_var
            relevance = (prior.shape + 1) / (prior.rate + (Ez + Ex) / 2)
        shrink = f.py / (f.py + self.s)
        py = max(shrink**2 * self.R / N + self.s * shrink, LEAST_VARIANCE)
        pz = np.maximum((zz - 2 * wz * zt + Ez * tt) / N, LEAST_VARIANCE)
        px = np.maximum((Gd - 2 * wx * xt + Ex * tt) / N, LEAST_VARIANCE)
        return Loadings(
            wz=wz,
            wx=wx,
            wz_var=wz_var,
            wx_var=wx_var,
            relevance=relevance,
            pz=pz,
            px=np.where(known, f.px, px),
            py=float(py),
        )
