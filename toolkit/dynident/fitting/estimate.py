"""What a fit returns: values with units, uncertainties, and what they rest on."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from dynident import files
from dynident.arguments import checked
from dynident.errors import FitError, warn
from dynident.fitting.estimate_schema import FORMAT, basis_part, model_part
from dynident.fitting.history import Convergence
from dynident.inertia import margins
from dynident.model import Model
from dynident.nlp import Certificate
from dynident.robot import BaseParameters, Robot
from dynident.robot.patching import write
from dynident.tables import Shown, Table, number, percent, relative

_MUCH_LEFT = 0.2
"""Share of a joint's torque beyond which a fit says that something may be missing."""
_INDEPENDENT = "sigma takes the errors of the equations as independent"
"""How the words of such a sigma begin, in files, too."""

_SHARED = 1e-9  # coefficient of a combination that is more than rounding
_LISTED = 6  # names in a sentence


@dataclass(frozen=True)
class DataSource:
    """A recording that an estimate rests on: its file and the SHA-256 of the file's content."""

    file: str
    sha256: str
    filter: str


@dataclass(frozen=True, kw_only=True)
class ShapeValue:
    """A parameter inside an effect, in which the torque is not linear.

    Attributes
    ----------
    name : as `vs@elbow`.
    value, sigma : in `unit`; sigma NaN where it is not known.
    unit : of both.
    """

    name: str
    value: float
    sigma: float
    unit: str


@checked
@dataclass(frozen=True, kw_only=True, repr=False)
class Estimate(Shown):
    """Identified parameters of a model.

    Attributes
    ----------
    model : the model that was fitted, with its shape parameters as refined.
    values : (p,) in the order of `model.names`. Combinations that the data do not excite keep
        the values of the robot description.
    covariance : (p, p); rows of parameters that are not identified on their own are zero.
    basis : which combinations of `model.names` the data identify, and the rank decision.
    torque_std : (n,) standard deviation of the torque residual, N m or N.
    joint_errors : (n,) norm of the residual over norm of the torque, on the data of the fit.
    error : the same over all joints.
    condition_number : of the columns identified, as they were weighted.
    rows : number of equations.
    method : how it was estimated.
    status : the solver's word.
    notes : caveats in plain words.
    sources : the recordings.
    links : inertial parameters (10,) of each link in its own frame, by name, where the fit chose
        them (constrained fits do); None where only the base parameters are known.
    certificate : how far a constrained fit is from the optimum of its problem.
    history : the iterations of an instrumental variable estimate.
    details : tables of what else the method has to say.
    sigma_words : what the standard deviations hold, where the method has its own.
    headline : what is to be read before any number, that the model is rejected, say; or empty.
    shapes : parameters inside effects, as they were found.
    trading_off : names of parameters of which the data tell no size, because another shape of their
        effect with another size does the same.
    standing : joints that stand at their stops, of which rows around these did not count.
    """

    model: Model
    values: np.ndarray
    covariance: np.ndarray
    basis: BaseParameters
    torque_std: np.ndarray
    joint_errors: np.ndarray
    error: float
    condition_number: float
    rows: int
    method: str
    status: str
    notes: tuple[str, ...] = ()
    sources: tuple[DataSource, ...] = ()
    links: dict[str, np.ndarray] | None = None
    certificate: Certificate | None = None
    history: Convergence | None = None
    details: tuple[Table, ...] = ()
    sigma_words: str = ""
    headline: str = ""
    shapes: tuple[ShapeValue, ...] = ()
    trading_off: tuple[str, ...] = ()
    standing: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.model.names

    @cached_property
    def identified(self) -> np.ndarray:
        """Which parameters are identified, alone or as the head of a combination, (p,) bool."""
        found = np.zeros(self.model.size, dtype=bool)
        found[list(self.basis.independent)] = True
        return found & ~np.isin(self.names, self.trading_off)

    @property
    def alone(self) -> np.ndarray:
        """Which parameters are identified on their own, not only with others, (p,) bool."""
        shared = np.zeros(self.model.size, dtype=bool)
        shared[list(self.basis.independent)] = np.any(np.abs(self.basis.K) > _SHARED, axis=1)
        return self.identified & ~shared

    @property
    def identified_values(self) -> np.ndarray:
        """What the data identify under each parameter's name, (p,); NaN where that is nothing.

        Where a parameter is the head of a combination, its value is that of the combination, see
        `stands_for`; those of `values` are one way to share it out.
        """
        values = np.array(self.values)
        values[list(self.basis.independent)] = self.basis.coordinates(self.values)
        values[~self.identified] = np.nan
        return values

    @property
    def stands_for(self) -> tuple[str, ...]:
        """What is identified under each parameter's name, (p,): a combination, or why nothing.

        Empty where it is the parameter alone.
        """
        found = dict.fromkeys(self.names, "not identified on its own, only in combinations")
        found |= dict.fromkeys(self.basis.unidentifiable, "without influence on these torques")
        heads = [self.names[i] for i in self.basis.independent]
        found |= dict(zip(heads, self.model.stands_for(self.basis), strict=True))
        found |= dict.fromkeys(self.trading_off, "not determined: size and shape trade off")
        return tuple(found[name] for name in self.names)

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviations of `identified_values`, (p,); NaN where nothing is identified.

        All of them NaN where the method has no covariance to give (a matrix of zeros).
        """
        sigma = np.sqrt(np.clip(np.diag(self.covariance), 0.0, None))
        return np.where(self.identified & np.any(self.covariance), sigma, np.nan)

    @cached_property
    def robot(self) -> Robot:
        """The robot with the identified base parameters.

        What the data do not identify (how a base parameter is shared among the links) stays as
        near to the given description as it can, unless the fit chose it (`links`); without that
        the links need not be physically consistent.
        """
        robot = self.model.robot
        if self.links is not None:
            return robot.with_links(self.links)
        rigid = self.values[: len(self.model.base.independent)]
        return robot.with_theta(self.model.base.lift(rigid, robot.theta))

    def effect_values(self, label: str) -> np.ndarray:
        """Parameters of one effect, by its label."""
        return self.values[self.model.slices[label]]

    def value(self, name: str) -> float:
        """One parameter by its name.

        Raises
        ------
        FitError
            If there is no such parameter.
        """
        if name not in self.names:
            raise FitError(f"no parameter '{name}'", remedy=f"parameters: {', '.join(self.names)}")
        return float(self.values[self.names.index(name)])

    # --- in words ------------------------------------------------------------------------------

    def parameter_table(self) -> Table:
        """Values, standard deviations and what each parameter is a combination of."""
        columns = (
            self.names,
            self.identified_values,
            self.sigma,
            self.model.units,
            self.stands_for,
        )
        rows = (
            (name, number(value, 6), number(sigma, 3), relative(value, sigma), unit, words)
            for name, value, sigma, unit, words in zip(*columns, strict=True)
        )
        columns = ("parameter", "value", "sigma", "relative", "unit", "stands for")
        return Table("Parameters", columns, tuple(rows), self._parameter_notes())

    def shape_table(self) -> Table:
        """Parameters inside effects."""
        rows = tuple(
            (one.name, number(one.value, 6), number(one.sigma, 3), one.unit) for one in self.shapes
        )
        return Table("Parameters inside effects", ("parameter", "value", "sigma", "unit"), rows)

    def error_table(self) -> Table:
        """Torque errors on the data of the fit."""
        robot = self.model.robot
        rows = tuple(
            (name, percent(error), number(std, 3), unit)
            for name, error, std, unit in zip(
                robot.names, self.joint_errors, self.torque_std, robot.torque_units, strict=True
            )
        )
        columns = ("joint", "relative error", "residual std", "unit")
        title = f"Torque error on the data of the fit: {percent(self.error, 4)}"
        far = [
            name
            for name, error in zip(robot.names, self.joint_errors, strict=True)
            if error > _MUCH_LEFT
        ]
        advice = (
            f"At {', '.join(far)} the model leaves more than {percent(_MUCH_LEFT, 0)} of the "
            "torque: `dynident explain` looks for what it lacks."
        )
        return Table(title, columns, rows, (advice,) if far else ())

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        proved = (self.certificate.table(),) if self.certificate else ()
        iterated = self.history.tables() if self.history else ()
        own = (*iterated, *self.details)
        first = (self.headline,) if self.headline else ()
        inside = (self.shape_table(),) if self.shapes else ()
        return (
            *first,
            self.parameter_table(),
            *inside,
            *own,
            self.error_table(),
            *proved,
            *self.notes,
        )

    def _parameter_notes(self) -> tuple[str, ...]:
        return (
            f"{self.method}; {self.rows} equations, {len(self.basis.independent)} of "
            f"{self.model.size} parameters identified ({_decision(self.basis)}), "
            f"condition number {self.condition_number:.6g}; {self.status}.",
            self.words_of_sigma,
        )

    @property
    def words_of_sigma(self) -> str:
        """What the standard deviations hold, and what they do not."""
        if self.sigma_words:
            return self.sigma_words
        if not np.any(self.covariance):
            return "No sigma: the method has none to give."
        return (
            f"{_INDEPENDENT}, which those of rows behind a low-pass are not; what the model lacks "
            "is not in it."
        )

    @property
    def takes_rows_as_independent(self) -> bool:
        """Whether the standard deviations leave out that rows behind a low-pass share noise."""
        return self.words_of_sigma.startswith(_INDEPENDENT)

    # --- files ---------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """The estimate as JSON holds it, with the robot description in it."""
        model, sigma = self.model, self.sigma
        identified, stands_for = self.identified_values, self.stands_for
        return {
            "format": FORMAT,
            "method": self.method,
            "status": self.status,
            "parameters": [
                {
                    "name": name,
                    "value": float(self.values[i]),
                    "sigma": float(sigma[i]) if np.isfinite(sigma[i]) else None,
                    "unit": model.units[i],
                    "expression": model.expressions[i],
                    "identified": float(identified[i]) if np.isfinite(identified[i]) else None,
                    "stands_for": stands_for[i],
                }
                for i, name in enumerate(self.names)
            ],
            "covariance": self.covariance.tolist(),
            "basis": basis_part(self.basis),
            "torque_std": self.torque_std.tolist(),
            "joint_errors": self.joint_errors.tolist(),
            "error": self.error,
            "condition_number": self.condition_number,
            "rows": self.rows,
            "notes": list(self.notes),
            "sigma_words": self.words_of_sigma,
            "headline": self.headline,
            "standing": list(self.standing),
            "recordings": [vars(source) for source in self.sources],
            "shapes": [
                {
                    "name": one.name,
                    "value": one.value,
                    "sigma": one.sigma if np.isfinite(one.sigma) else None,
                    "unit": one.unit,
                }
                for one in self.shapes
            ],
            "links": self.links and {name: phi.tolist() for name, phi in self.links.items()},
            "certificate": self.certificate and self.certificate.to_dict(),
            "iterations": self.history and self.history.to_dict(),
            "model": model_part(model),
        }

    def save(self, path: str | Path) -> Path:
        """Write the estimate as JSON, with the robot description in it.

        Raises
        ------
        FileError
            If the file cannot be written; an old one is then untouched.
        """
        return files.write_text(path, json.dumps(self.to_dict(), indent=1, allow_nan=True) + "\n")

    def write_robot(self, path: str | Path) -> Path:
        """Write the robot description with the identified inertial parameters.

        A patched copy of the given description; see `robot` for what the data do not identify.

        Raises
        ------
        RobotError
            If the format cannot hold the parameters (a massless link with a first moment, say).

        Warns
        -----
        DynidentWarning
            If no rigid body can have the parameters of a link.
        """
        written = write(self.robot, path)
        if broken := self.inconsistent_links():
            what = f"{path}: no rigid body can have the parameters of {', '.join(broken)}"
            left = "What the data cannot tell was left as given"
            warn(f"{what}. {left}; --consistency full (`Constrained` in Python) fits others")
        return written

    def inconsistent_links(self) -> tuple[str, ...]:
        """Moving links of `robot` whose inertial parameters no rigid body can have."""
        return tuple(
            link.name
            for link in self.robot.links
            if link.joint >= 0 and not margins(link.phi).consistent
        )


def unidentified(basis: BaseParameters) -> tuple[str, ...]:
    """Return the caveat that data leave parameters open; empty where they identify all."""
    if not basis.dependent:
        return ()
    idle = basis.unidentifiable
    shared = [basis.names[i] for i in basis.dependent if basis.names[i] not in idle]
    words = f"The data do not excite every parameter: rank {basis.rank} of {len(basis.names)}."
    if shared:
        words += f" Not identified on their own, only in combination: {', '.join(shared)}."
    if idle:
        words += f" Without influence on these torques: {', '.join(idle)}."
    return (words,)


def nearly_hidden(base: BaseParameters) -> tuple[str, ...]:
    """Return what the digits of a description would show alone; empty where nothing is.

    Parameters
    ----------
    base : of the structure, `Model.base`.
    """
    names = base.nearly_hidden
    if not names:
        return ()
    listed = ", ".join(names[:_LISTED])
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return (
        f"Left as described, for next to nothing shows them: {listed}{more}. They would vanish but "
        f"for angles or distances of the description of less than {base.tolerance:.0e}, as where "
        "pi/2 is written 1.5708.",
    )


def _decision(basis: BaseParameters) -> str:
    """How the rank was decided, in words."""
    if basis.rank == len(basis.names):
        least = float(basis.diagonal[-1] / basis.diagonal[0])
        return f"full rank, smallest direction {least:.2g} of the largest"
    if not np.isfinite(basis.gap):
        return f"at tolerance {basis.tolerance:.0e}, the others only in combination with these"
    return f"rank gap {basis.gap:.2g} at tolerance {basis.tolerance:.0e}"
