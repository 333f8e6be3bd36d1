"""Passes over recordings: here, one after the other, or on a cluster, side by side.

A pass is a function of one recording that returns sums. What adds them up does not ask where they
were made, so that an answer is the same wherever the work is done.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from itertools import islice, repeat
from typing import Any, Protocol, TypeVar

from dynident.errors import FitError
from dynident.threads import single_threaded

T = TypeVar("T")


class Cluster(Protocol):
    """What works elsewhere: the `Client` of dask.distributed, or what has its three methods."""

    def scatter(self, data: Any, /, **settings: Any) -> Any:
        """Send a list of objects; return what stands for each of them in `map`."""

    def map(
        self, function: Callable[..., Any], /, *iterables: Iterable[Any], **settings: Any
    ) -> Any:
        """Start a function on each tuple of arguments.

        Parameters
        ----------
        function : of a module.
        iterables : its arguments.
        settings : of dask.distributed, by which names follow from no content.

        Returns
        -------
        What stands for the results in `gather`.
        """

    def gather(self, futures: Any, /) -> Any:
        """Return what one came to, or several in their order."""


@dataclass(frozen=True, eq=False)
class _Place:
    """A cluster, and which recordings are there."""

    client: Cluster
    sent: dict[int, tuple[Any, Any]] = field(default_factory=dict)

    def stand_ins(self, recordings: Iterable[Any]) -> list[Any]:
        """What stands for recordings there; each is sent once."""
        found = []
        for one in recordings:
            if id(one) not in self.sent:
                # Under a name of its own: one made of the content may be on its way out, from a fit
                # before this one, and would take this one along.
                self.sent[id(one)] = (one, self.client.scatter([one], hash=False)[0])
            found.append(self.sent[id(one)][1])
        return found


_PLACE: ContextVar[_Place | None] = ContextVar("place", default=None)


@contextmanager
def working_on(client: Cluster | None) -> Iterator[None]:
    """Let passes over recordings be made by a cluster; None leaves them where they are."""
    before = _PLACE.get()
    token = _PLACE.set(before if client is None else _Place(client))
    try:
        yield
    finally:
        _PLACE.reset(token)


def over_recordings(
    recordings: Sequence[Any], function: Callable[..., T], *arguments: Any
) -> Iterator[T]:
    """Yield what a function makes of each recording, in their order.

    Parameters
    ----------
    recordings : in any form that can be sent.
    function : of a recording and the arguments; of a module, so that it can be found elsewhere.
    arguments : the same for all.

    Raises
    ------
    FitError
        If the cluster fails; what the function raises comes through.
    """
    place = _PLACE.get()
    if place is None:
        yield from (function(one, *arguments) for one in recordings)
        return
    with _cluster_errors():
        there = place.stand_ins(recordings)
    yield from spread(place.client, function, there, *map(repeat, arguments))


def spread(
    client: Cluster | None, function: Callable[..., T], items: list[Any], *others: Iterable[Any]
) -> Iterator[T]:
    """Yield what a function makes of each item, in their order; one at a time comes back.

    Parameters
    ----------
    client : that does it; None for here.
    function : of a module, so that it can be found elsewhere.
    items : its first argument.
    others : its other arguments, as many or endless.

    Raises
    ------
    FitError
        If the cluster fails; what the function raises comes through.
    """
    count = len(items)
    every = [items, *(list(islice(other, count)) for other in others)]
    if client is None:
        yield from map(function, *every)
        return
    with _cluster_errors():
        futures = list(client.map(_attempt, [function] * count, *every, pure=False))
    for k in range(count):
        with _cluster_errors():
            found, error = client.gather(futures[k])
        futures[k] = None  # else the cluster keeps what it has given
        if error is not None:
            raise error
        yield found


@single_threaded
def _attempt(function: Callable[..., T], *arguments: Any) -> tuple[T | None, Exception | None]:
    """What a function returns, or raises: so that only a cluster's own errors are raised there."""
    try:
        return function(*arguments), None
    except Exception as error:
        return None, error


@contextmanager
def _cluster_errors() -> Iterator[None]:
    """One line for whatever a cluster says when it fails: its errors have no common root."""
    try:
        yield
    except Exception as error:
        said = " ".join(str(error).split())
        said = said if len(said) <= 120 else said[:117] + "..."
        what = f"the cluster failed ({type(error).__name__}{': ' * bool(said)}{said})"
        remedy = "is its client open, and do its workers have the memory? Without client= it is "
        raise FitError(what, remedy=remedy + "done here") from error
