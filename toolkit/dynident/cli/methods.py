"""The options that choose how parameters are estimated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import TYPE_CHECKING, Any, Literal

import click

from dynident.errors import DynidentError, StudyError

if TYPE_CHECKING:
    from dynident.closed_loop import Controller
    from dynident.fit import IV
    from dynident.study import Study


@dataclass(frozen=True)
class Chosen:
    """What the options say.

    Attributes
    ----------
    method : "least-squares" or "iv".
    instruments : "loop", "periods" or "filtered"; None where nothing is said.
    cutoff : Hz, of filtered instruments.
    start : where the iterations begin; None where nothing is said.
    """

    method: Literal["least-squares", "iv"]
    instruments: Literal["loop", "periods", "filtered"] | None
    cutoff: float | None
    start: Literal["least_squares", "description", "regular"] | None

    def __post_init__(self) -> None:
        for name in ("instruments", "cutoff", "start"):
            if self.method != "iv" and getattr(self, name) is not None:
                raise click.UsageError(f"--{name} goes with --method iv")
        if (self.instruments == "filtered") != (self.cutoff is not None):
            raise click.UsageError("--instruments filtered and --cutoff HZ go together")
        if self.start and self.instruments in ("periods", "filtered"):
            raise click.UsageError(
                f"--start has no part in --instruments {self.instruments}: nothing is iterated"
            )

    def iv(self, study: Study, weighting: Literal["joint", "none"], tell: Callable[..., Any]) -> IV:
        """Return the instrumental variable estimator of a study.

        Raises
        ------
        StudyError
            If the loop is to be simulated, and the study does not know its controller, its rate
            or the reference of a training recording.
        """
        from dynident.fit import IV, Filtered, SwappedPeriods

        start = self.start or "least_squares"
        if self.instruments == "periods":
            periods: Any = SwappedPeriods()
            return IV(periods, weighting=weighting, tell=tell)
        if self.instruments == "filtered":
            assert self.cutoff is not None
            return IV(Filtered(self.cutoff), weighting=weighting, tell=tell)
        if study.controller is None:
            mend = "state the one that ran, or choose --instruments periods or filtered"
            what = "has no [controller], so that its loop cannot be simulated for instruments"
            raise StudyError(what, str(study.path), mend)
        require_rate(study, study.controller)
        for recording in study.train.recordings:
            if recording.q_ref is None:
                mend = (
                    f"add columns q_ref.{recording.joints[0]}, ..., or choose --instruments "
                    "periods or --instruments filtered --cutoff HZ"
                )
                raise StudyError("the recording has no reference", recording.where, mend)
        return IV(study.controller, start=start, weighting=weighting, tell=tell)


def require_rate(study: Study, controller: Controller) -> None:
    """Refuse a controller that cannot be simulated, under the name of its file.

    Raises
    ------
    StudyError
        If its rate is not stated.
    """
    try:
        controller.simulated_rate()
    except DynidentError as error:
        raise StudyError(error.what, f"{study.path}: {error.where}", error.mend) from None


def method_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options that choose the method; it gets them as `chosen`."""

    @click.option(
        "--method",
        type=click.Choice(["least-squares", "iv"]),
        default="least-squares",
        show_default=True,
        help="iv: instrumental variables, right although the positions are noisy.",
    )
    @click.option(
        "--instruments",
        type=click.Choice(["loop", "periods", "filtered"]),
        help="Of iv: the simulated loop (default), other periods, or filtered measurements.",
    )
    @click.option("--cutoff", type=click.FloatRange(0, min_open=True), help="Of these filters, Hz.")
    @click.option(
        "--start",
        type=click.Choice(["least_squares", "description", "regular"]),
        help="Where iv begins to iterate; default: least_squares.",
    )
    @wraps(command)
    def run(*args: Any, method, instruments, cutoff, start, **options: Any) -> Any:
        return command(*args, chosen=Chosen(method, instruments, cutoff, start), **options)

    return run
