"""What faults of the wiring make of a diagnosis: they are its answer."""

from __future__ import annotations

from dataclasses import replace

from dynident.diagnosis.result import Diagnosis
from dynident.wiring import Fault


def answered_by(faults: tuple[Fault, ...], found: Diagnosis) -> Diagnosis:
    """Return the diagnosis with its verdict withheld where columns or data are not what is said.

    Parameters
    ----------
    faults : from `check_wiring`.
    found : what else is known of the model as given; nothing was added where there are faults.

    Returns
    -------
    As it is where there are none.
    """
    if not faults:
        return found
    return replace(
        found,
        wiring=faults,
        verdict="unexplained",
        impossible=(),
        steps=(),
        candidates=(),
        remaining=(),
    )
