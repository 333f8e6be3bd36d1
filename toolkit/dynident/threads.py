"""One thread for small matrices.

The factorisations here are of tall matrices with tens of columns. Several threads gain nothing on
them, and where the processors are busy they wait for each other: ten times slower and worse.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


@cache
def _controller():
    # Looked up once: the search runs through a callback that would swallow a Ctrl-C.
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def single_threaded(function: Callable[P, T]) -> Callable[P, T]:
    """Run a function with the linear algebra libraries on one thread."""

    @wraps(function)
    def run(*args: P.args, **kwargs: P.kwargs) -> T:
        with _controller().limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return run
