"""What the errors of gains and loads add to those of parameters fitted to converted torques."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.fitting.drive_gains.drive_gains import DriveGains
from dynident.fitting.estimate import Estimate


def with_gain_errors(estimate: Estimate, drives: DriveGains) -> Estimate:
    """Return an estimate whose covariance holds the errors of the gains, and that says so.

    The fit to converted torques takes gains and loads for known. With S the derivative of the
    parameters by these, S C S' is what they add (the delta method); an open scale adds nothing,
    and its sentence is in the notes. Of a model with other effects S is not known: its sigma then
    says that it takes the gains for known.

    Parameters
    ----------
    estimate : of recordings that `in_newton_metres` made.
    drives : the gains by which it did.
    """
    notes = (drives.sentence, *estimate.notes) if drives.unit != "N m" else estimate.notes
    n, p = len(drives.joints), len(drives.values)
    kept = list(estimate.basis.independent)
    what = "gains and loads" if drives.loads else "gains"
    if p != estimate.model.size or not np.any(estimate.covariance):
        words = (
            f"{estimate.words_of_sigma} It takes the {what} for known: of a study that has the "
            "effects, `dynident fit` prints sigma that holds their errors too."
        )
        return replace(estimate, sigma_words=words, notes=notes)
    own, others = slice(n, n + p), np.r_[0:n, n + p : len(drives.covariance)]
    across = drives.covariance[own, others]
    added = across @ np.linalg.pinv(drives.covariance[np.ix_(others, others)], hermitian=True)
    combination = estimate.basis.combination
    whole = np.array(estimate.covariance)
    whole[np.ix_(kept, kept)] += combination @ added @ across.T @ combination.T
    words = f"{estimate.words_of_sigma} It holds the errors of the {what} too."
    return replace(estimate, covariance=whole, sigma_words=words, notes=notes)
