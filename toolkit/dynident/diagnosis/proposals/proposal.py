"""A law that is proposed: what it says, how well, and what does as well."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dynident.effects import LawEffect
from dynident.tables import finite, number, percent


@dataclass(frozen=True, eq=False)
class LawPicture:
    """What the model leaves on held-out data, where the law says this much or that.

    Where the law is right, its means lie on the diagonal, within the noise band.

    Attributes
    ----------
    law : (b,) N m or N, mean torque of the law in classes of as many rows each, ascending.
    residual : (b,) mean of what the model leaves there without the law.
    band : (b,) two standard errors of that by the noise; NaN where it is unknown.
    torque_unit : N m or N.
    """

    law: np.ndarray
    residual: np.ndarray
    band: np.ndarray
    torque_unit: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Proposal:
    """A law that takes off what the catalogue leaves. It is a proposal: the verdict stays.

    Attributes
    ----------
    effect : the law at its joint, with the shapes found.
    values, sigma : (k,) coefficients and their standard deviations, the shapes estimated too.
    shape_sigma : (s,) of the shapes.
    explains : share of the systematic squared residual that it takes off, at all joints.
    is_explanation : whether it is enough for these recordings: it is the only law that is proposed,
        takes most, what is left does not change with what the law depends on, and nothing but noise
        is left on held-out data, as far as that is known.
    p_value : of the hypothesis that it has no part beside the model, at the friction widths that
        `remark` may say, times the number of terms tried.
    tried : how many terms that were.
    test_error_before, test_error_after : relative error on held-out data.
    noise_floor : the least that a model can reach; None where the noise is unknown.
    instead_of : labels of effects that the catalogue has added and that it makes superfluous: it
        was found without them, with fewer parameters.
    rivals : laws that do as well on the held-out blocks, as far as can be told, best first.
    remark : on what it rests, where that is doubtful.
    picture : to be drawn; None where there is none.

    Examples
    --------
    >>> first = di.diagnose(study.model, study.train, study.test).proposals[0]
    >>> print(first.sentence, first.named_values)
    >>> better = di.fit(study.model + first.effect, study.train)
    >>> law_picture(first)  # of dynident.reporting.pictures.plots
    """

    effect: LawEffect
    values: tuple[float, ...]
    sigma: tuple[float, ...]
    shape_sigma: tuple[float, ...]
    explains: float
    is_explanation: bool
    p_value: float
    tried: int
    test_error_before: float
    test_error_after: float
    noise_floor: float | None
    instead_of: tuple[str, ...] = ()
    rivals: tuple[LawEffect, ...] = ()
    remark: str = ""
    picture: LawPicture | None = None

    @property
    def torque(self) -> str:
        """The formula."""
        return self.effect.made_of.torque

    @property
    def named_values(self) -> dict[str, float]:
        """Values of coefficients and shapes, by their names in the formula."""
        law = self.effect.made_of
        shapes = [name for name, _, _ in law.shape]
        linear = dict(zip(law.linear, self.values, strict=True))
        return {**linear, **dict(zip(shapes, self.effect.shape, strict=True))}

    @property
    def sentence(self) -> str:
        """What it does, in plain words."""
        # Another law, which nobody tried, may do as well: that it is the cause is not said.
        does = "would be enough for these recordings"
        if self.noise_floor is None:
            does += ", if what is left is noise"
        if not self.is_explanation:
            does = "would help, and not be enough"
        law = "A law that no catalogue has"
        if self.instead_of:
            law = f"Instead of {', '.join(self.instead_of)}, a law that no catalogue has"
        parts = [
            f"{law} {does}: at {self.effect.joint} the torque "
            f"{self.torque} takes {percent(self.explains, 0)} of the systematic square, and the "
            f"held-out error falls from {percent(self.test_error_before)} to "
            f"{percent(self.test_error_after)}",
            f" (noise floor {percent(self.noise_floor)})" if self.noise_floor else "",
            f". It is the best of {self.tried} terms: a proposal, not a finding.",
        ]
        if self.rivals:
            others = ", ".join(_words(one) for one in self.rivals)
            parts.append(f" As well does, as far as this data can tell: {others}.")
        if self.remark:
            parts.append(f" {self.remark}")
        return "".join(parts)

    def rows(self, robot: Any) -> tuple[tuple[str, str, str, str], ...]:
        """Name, value, sigma and unit of each of its parameters."""
        names = tuple(self.named_values)
        values = tuple(self.named_values.values())
        units = [one.unit for one in self.effect.parameters(robot)]
        units += [one.unit for one in self.effect.shape_parameters(robot)]
        spread = (*self.sigma, *self.shape_sigma)
        return tuple(
            (name, number(value, 4), number(sigma, 2), unit)
            for name, value, sigma, unit in zip(names, values, spread, units, strict=True)
        )

    def to_dict(self) -> dict[str, Any]:
        """The proposal as JSON has it."""
        law = self.effect.made_of
        return {
            "torque": law.torque,
            "joint": self.effect.joint,
            "shape": {name: [low, high] for name, low, high in law.shape},
            "values": self.named_values,
            "sigma": dict(
                zip(
                    self.named_values,
                    (finite(one) for one in (*self.sigma, *self.shape_sigma)),
                    strict=True,
                )
            ),
            "explains": self.explains,
            "is_explanation": self.is_explanation,
            "remark": self.remark,
            "p_value": self.p_value,
            "tried": self.tried,
            "test_error_before": self.test_error_before,
            "test_error_after": self.test_error_after,
            "noise_floor": self.noise_floor,
            "instead_of": list(self.instead_of),
            "rivals": [_words(one) for one in self.rivals],
        }


def _words(effect: LawEffect) -> str:
    """The formula of a rival, where it sits, and its shapes."""
    names = [name for name, _, _ in effect.made_of.shape]
    shapes = [f"{n} = {number(x, 3)}" for n, x in zip(names, effect.shape, strict=True)]
    own = f"{effect.made_of.torque} at {effect.joint}"
    return f"{own} ({', '.join(shapes)})" if shapes else own
