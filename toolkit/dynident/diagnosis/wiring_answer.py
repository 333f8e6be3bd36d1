"""What the wiring check has to say in a diagnosis: a fault, or values that no robot has."""

from __future__ import annotations

from dataclasses import dataclass, replace

from dynident.criteria import WiringCriteria
from dynident.diagnosis.result import Diagnosis
from dynident.model import Model
from dynident.recording import Dataset
from dynident.wiring import Fault, check_wiring, impossible_values
from dynident.wiring.wiring_rows import WiringRows, rows_of


@dataclass(frozen=True, eq=False, kw_only=True)
class Wiring:
    """Recordings checked against the robot, before they are searched for missing physics.

    Attributes
    ----------
    faults : of columns and data; where there are any, they are the answer.
    rows : of the training recordings, for what comes after.
    criteria : of the check.
    """

    faults: tuple[Fault, ...]
    rows: WiringRows
    criteria: WiringCriteria

    @classmethod
    def of(
        cls, model: Model, train: Dataset, test: Dataset | None, criteria: WiringCriteria
    ) -> Wiring:
        """Check recordings; see `check_wiring`.

        Parameters
        ----------
        model, train, test, criteria : as there.

        Returns
        -------
        The faults, and the rows that they were sought on.
        """
        return cls(
            faults=check_wiring(model, train, test, criteria),
            rows=rows_of(train, criteria.rows, criteria.independent_hz),
            criteria=criteria,
        )

    def heeded(self, found: Diagnosis) -> Diagnosis:
        """Return the diagnosis with its verdict withheld where the wiring or a value is wrong."""
        if self.faults:
            return replace(
                found,
                wiring=self.faults,
                verdict="unexplained",
                steps=(),
                candidates=(),
                remaining=(),
            )
        if found.verdict == "unexplained":
            return found
        final = found.after
        impossible = impossible_values(
            final.model, final.values, final.covariance, self.rows, self.criteria
        )
        if not impossible:
            return found
        return replace(found, impossible=impossible, verdict="unexplained")
