"""The options that choose how parameters are estimated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import click

from dynident.cli.group import collected
from dynident.errors import DynidentError, StudyError
from dynident.regression.names import REGRESSIONS, WITH_INPUT_NOISE

if TYPE_CHECKING:
    from dynident.closed_loop import Controller
    from dynident.fitting import IV, Method
    from dynident.regression.identifiability import ReliabilityProfile, StartSensitivity
    from dynident.study import Study


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """What the options say.

    Attributes
    ----------
    method : "least-squares", "iv", or one of `REGRESSIONS`.
    instruments : "loop", "periods" or "filtered"; None where nothing is said.
    cutoff : Hz, of filtered instruments.
    start : where the iterations begin; None where nothing is said.
    input_noise : "repeats" or "encoders": where a regression takes it from; None for nowhere.
    """

    method: str
    instruments: Literal["loop", "periods", "filtered"] | None
    cutoff: float | None
    start: Literal["least_squares", "description", "regular"] | None
    input_noise: Literal["repeats", "encoders"] | None = None

    def __post_init__(self) -> None:
        if self.input_noise is not None and self.method not in WITH_INPUT_NOISE:
            raise click.UsageError("--input-noise goes with --method corrected, factors or bayes")
        if self.method == "corrected" and self.input_noise is None:
            raise click.UsageError("--method corrected needs --input-noise repeats or encoders")
        for name in ("instruments", "cutoff", "start"):
            if self.method != "iv" and getattr(self, name) is not None:
                raise click.UsageError(f"--{name} goes with --method iv")
        if (self.instruments == "filtered") != (self.cutoff is not None):
            raise click.UsageError("--instruments filtered and --cutoff HZ go together")
        if self.start and self.instruments in ("periods", "filtered"):
            raise click.UsageError(
                f"--start has no part in --instruments {self.instruments}: nothing is iterated"
            )

    def estimator(
        self, study: Study, weighting: Literal["joint", "none"], show_progress: Callable[..., Any]
    ) -> Method:
        """Return the estimator of a study; raises what `iv` raises.

        Parameters
        ----------
        study : for controller and recordings.
        weighting : of the joints.
        show_progress : called from round to round of the instruments.
        """
        from dynident.fitting import LeastSquares, Regression

        if self.method == "iv":
            return self.iv(study, weighting, show_progress)
        if self.method in REGRESSIONS:
            return Regression(self.method, self.input_noise or "none")
        return LeastSquares(weighting)

    def require_unknown_noise(self) -> None:
        """Refuse to ask what data tell of the inputs' noise where there is none to find."""
        if self.method not in ("factors", "bayes") or self.input_noise:
            raise click.UsageError(
                "--identifiability goes with --method factors or bayes, without --input-noise"
            )

    def identifiability(self, study: Study) -> tuple[StartSensitivity, ReliabilityProfile]:
        """Return what start and prior decide of the inputs' noise instead of the data."""
        from dynident.fitting import Regression
        from dynident.regression.identifiability import reliability_profile, start_sensitivity

        found: Any = Regression(self.method).regressor(study.model, study.train)
        return start_sensitivity(found), reliability_profile(found)

    def iv(
        self, study: Study, weighting: Literal["joint", "none"], show_progress: Callable[..., Any]
    ) -> IV:
        """Return the instrumental variable estimator of a study.

        Parameters
        ----------
        study, weighting, show_progress : as in `estimator`.

        Raises
        ------
        StudyError
            If the loop is to be simulated, and the study does not know its controller, its rate
            or the reference of a training recording.
        """
        from dynident.fitting import IV, Filtered, SwappedPeriods

        start = self.start or "least_squares"
        if self.instruments == "periods":
            periods: Any = SwappedPeriods()
            return IV(periods, weighting=weighting, progress=show_progress)
        if self.instruments == "filtered":
            assert self.cutoff is not None
            return IV(Filtered(self.cutoff), weighting=weighting, progress=show_progress)
        if study.controller is None:
            remedy = "state the one that ran, or choose --instruments periods or filtered"
            what = "has no [controller], so that its loop cannot be simulated for instruments"
            raise StudyError(what, str(study.path), remedy)
        require_rate(study, study.controller)
        for recording in study.train.recordings:
            if recording.q_ref is None:
                remedy = (
                    f"add columns q_ref.{recording.joints[0]}, ..., or choose --instruments "
                    "periods or --instruments filtered --cutoff HZ"
                )
                raise StudyError("the recording has no reference", recording.where, remedy)
        return IV(study.controller, start=start, weighting=weighting, progress=show_progress)


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
        raise StudyError(error.what, f"{study.path}: {error.where}", error.remedy) from None


_METHOD_OPTIONS = (
    click.option(
        "--method",
        type=click.Choice(["least-squares", "iv", *REGRESSIONS]),
        default="least-squares",
        show_default=True,
        help="iv: instrumental variables, right although the positions are noisy. corrected: least "
        "squares less a known input noise. bayes: joint factor analysis. The rest to compare with.",
    ),
    click.option(
        "--input-noise",
        type=click.Choice(["repeats", "encoders"]),
        help="Of corrected, factors and bayes: measured on repetitions, or carried from [noise].",
    ),
    click.option(
        "--instruments",
        type=click.Choice(["loop", "periods", "filtered"]),
        help="Of iv: the simulated loop (default), other periods, or filtered measurements.",
    ),
    click.option("--cutoff", type=click.FloatRange(0, min_open=True), help="Of these filters, Hz."),
    click.option(
        "--start",
        type=click.Choice(["least_squares", "description", "regular"]),
        help="Where iv begins to iterate; default: least_squares.",
    ),
)


def method_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options that choose the method; it gets them as `chosen`."""
    command = collected(chosen=Chosen)(command)
    for option in reversed(_METHOD_OPTIONS):
        command = option(command)
    return command
