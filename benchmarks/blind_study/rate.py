"""A figure of the study, with its interval and what is demanded of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scipy import stats


@dataclass(frozen=True)
class Rate:
    """A figure of the study: how often something held, and how often it should."""

    what: str
    held: Sequence[bool]
    demanded: float
    at_most: bool = False

    def row(self) -> tuple[str, str, str, str, str]:
        if not self.held:
            return self.what, "no cases", "", self._demand(), ""
        count, total = sum(map(bool, self.held)), len(self.held)
        interval = stats.binomtest(count, total).proportion_ci(method="wilson")
        value = count / total
        met = value <= self.demanded if self.at_most else value >= self.demanded
        return (
            self.what,
            f"{count}/{total} = {value:.3f}",
            f"{interval.low:.3f} .. {interval.high:.3f}",
            self._demand(),
            "yes" if met else "NO",
        )

    def _demand(self) -> str:
        return f"{'at most' if self.at_most else 'at least'} {self.demanded:g}"
