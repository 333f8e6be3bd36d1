"""What a draft had to decide: what was chosen, why, and what else it may be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace


@dataclass(frozen=True, kw_only=True)
class Decision:
    """A choice that the files alone do not settle.

    Attributes
    ----------
    subject : what it is about: columns, or a key of the study.
    choices : in words, the likeliest first.
    reason : why the first one.
    chosen : which of them was taken.
    """

    subject: str
    choices: tuple[str, ...]
    reason: str
    chosen: int = 0

    @property
    def words(self) -> str:
        """What was chosen."""
        return self.choices[self.chosen]

    @property
    def is_open(self) -> bool:
        """Whether it could have gone otherwise."""
        return len(self.choices) > 1


Ask = Callable[[Decision], int]
"""Whoever knows the robot: which of the choices it is."""


def decided(decision: Decision, ask: Ask | None) -> Decision:
    """Return the decision as whoever is asked takes it; the likeliest choice where nobody is.

    Parameters
    ----------
    decision : with its choices.
    ask : None in a pipe.
    """
    if ask is None or not decision.is_open:
        return decision
    chosen = ask(decision)
    # What speaks for the likeliest choice is no reason for another.
    reason = "so it was said" if chosen else decision.reason
    return replace(decision, chosen=chosen, reason=reason)
