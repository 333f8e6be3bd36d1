"""Whether the study's low-pass of the positions hides motion, which looks like missing physics."""

from __future__ import annotations

from dataclasses import replace

from dynident.diagnosis.details import HidingFilter
from dynident.diagnosis.result import Diagnosis
from dynident.recording import Dataset, suited_instead


def with_filter_doubt(found: Diagnosis, train: Dataset, test: Dataset | None) -> Diagnosis:
    """Return a diagnosis that doubts the filter, where something is left that it may have made.

    Parameters
    ----------
    found : the diagnosis.
    train, test : the recordings, to all of which one filter is to suit; `test` may be None.

    Returns
    -------
    As it is where nothing is left, or the filter suits the recordings.
    """
    cutoff = None if train.filter is None else train.filter.position_cutoff_hz
    if found.wiring or found.verdict != "unexplained" or not cutoff:
        return found
    every = (*train.recordings, *(() if test is None else test.recordings))
    suited = suited_instead(cutoff, every)
    if suited is None:
        return found
    hiding = HidingFilter(cutoff_hz=cutoff, suited_hz=suited)
    return replace(found, hiding_filter=hiding, notes=(hiding.sentence, *found.notes))
