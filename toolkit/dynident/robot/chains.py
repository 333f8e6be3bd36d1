"""Refuse closed chains by name, before Drake sees them."""

from __future__ import annotations

from dynident.errors import UnsupportedError

_MEND = "cut the loop by removing one of the joints"


class Chains:
    """Who carries whom, as the joints of a description say it.

    Parameters
    ----------
    where : str
        The file, for messages.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self.parents: dict[str, str] = {}

    def attach(self, joint: str, parent: str, child: str) -> None:
        """Record a joint.

        Raises
        ------
        RobotError
            If the child has a parent already.
        """
        if child in self.parents:
            raise UnsupportedError(
                f"has a second parent, by joint '{joint}': closed chains are not supported",
                f"{self.where}: link '{child}'",
                _MEND,
            )
        self.parents[child] = parent

    def refuse_loops(self) -> None:
        """Raise RobotError if a link is its own ancestor."""
        for name in self.parents:
            seen = {name}
            while name in self.parents:
                name = self.parents[name]
                if name in seen:
                    raise UnsupportedError(
                        "is its own ancestor: closed chains are not supported",
                        f"{self.where}: link '{name}'",
                        _MEND,
                    )
                seen.add(name)
