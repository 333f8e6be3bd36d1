"""What the JSON file of an estimate holds: its parts as written, and the kind and range of values.

In: the basis and the model of an estimate, or JSON. Out: tables of plain values, or parts whose
every value is one that it may be. How the sizes of arrays belong together is for `estimate_file`
to say, which knows the model.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from dynident.effects import Effect, origin_of
from dynident.inertia import LARGEST
from dynident.model import Model
from dynident.robot import BaseParameters

FORMAT = "dynident-estimate-1"
"""Name and version of the file's format."""


def _not_null(value: object) -> object:
    return float("nan") if value is None else value


def _reported(value: float) -> float:
    if value < 0.0 or LARGEST <= value < float("inf"):
        raise ValueError(f"a size is not negative, and below {LARGEST:g}")
    return value


# A covariance is a square.
_Square = Annotated[float, Field(gt=-(LARGEST**2), lt=LARGEST**2)]
_Number = Annotated[float, Field(gt=-LARGEST, lt=LARGEST)]
_Size = Annotated[float, Field(ge=0.0, lt=LARGEST)]
_Positive = Annotated[float, Field(gt=0.0, lt=LARGEST)]
# What nothing is computed from: unknown (NaN, null) where nothing was fitted.
_Reported = Annotated[float, BeforeValidator(_not_null), AfterValidator(_reported)]
_Index = Annotated[int, Field(ge=0)]


class _Part(BaseModel):
    model_config = ConfigDict(strict=True)


class _Parameter(_Part):
    name: str
    value: _Number
    sigma: _Size | None
    unit: str
    expression: str


class BasisPart(_Part):
    """What the data identify."""

    names: list[str]
    independent: list[_Index]
    dependent: list[_Index]
    expressions: list[str]
    K: list[list[_Number]]
    scale: list[_Size]
    diagonal: list[_Size]
    tolerance: _Size


class _Recording(_Part):
    file: str
    sha256: str
    filter: str


class _Origin(_Part):
    module: str
    file: str
    package: str


class _Effect(_Part):
    effect: str
    joint: str | None
    source: str | None
    shape: list[_Number]
    point: list[_Number] = []
    origin: _Origin | None = None


class _Range(_Part):
    name: str
    lower: _Number
    upper: _Number


class _Law(_Part):
    name: str
    torque: str
    shape: list[_Range] = []


class _ShapePart(_Part):
    name: str
    value: _Number
    sigma: _Size | None
    unit: str


class ModelPart(_Part):
    """The model that was fitted."""

    robot: str
    joints: list[str]
    gravity: list[_Number]
    friction_width: _Positive | list[_Positive]
    effects: list[_Effect]
    laws: list[_Law] = []


class EstimateFile(_Part):
    """The whole file."""

    format: Literal["dynident-estimate-1"]
    method: str
    status: str
    parameters: list[_Parameter]
    covariance: list[list[_Square]]
    basis: BasisPart
    torque_std: list[_Reported]
    joint_errors: list[_Reported]
    error: _Reported
    condition_number: _Reported
    rows: Annotated[int, Field(ge=0, le=10**15)]
    notes: list[str]
    sigma_words: str = ""
    headline: str = ""
    shapes: list[_ShapePart] = []
    recordings: list[_Recording]
    links: dict[str, list[_Number]] | None = None
    certificate: dict[str, Any] | None = None
    iterations: dict[str, Any] | None = None
    model: ModelPart


def basis_part(basis: BaseParameters) -> dict[str, Any]:
    """Return what the data identify as JSON holds it."""
    return {
        "names": list(basis.names),
        "independent": list(basis.independent),
        "dependent": list(basis.dependent),
        "expressions": list(basis.expressions),
        "K": basis.K.tolist(),
        "scale": basis.scale.tolist(),
        "diagonal": basis.diagonal.tolist(),
        "tolerance": basis.tolerance,
    }


def _width(width: float | tuple[float, ...]) -> float | list[float]:
    return list(width) if isinstance(width, tuple) else width


def _origin_part(effect: Effect) -> dict[str, Any]:
    """Where an effect of one's own came from; nothing of the package's."""
    origin = origin_of(type(effect))
    return {} if origin is None else {"origin": asdict(origin)}


def model_part(model: Model) -> dict[str, Any]:
    """Return a model as JSON holds it, with the robot description in it."""
    description = model.robot.description
    return {
        "robot": description.text if description else None,
        "joints": list(model.robot.names),
        "gravity": [float(g) for g in model.robot.gravity],
        "friction_width": _width(model.friction_width),
        "effects": [
            {
                "effect": effect.name,
                "joint": effect.joint,
                "source": effect.source,
                "shape": list(effect.shape),
                "point": list(effect.point),
                **_origin_part(effect),
            }
            for effect in model.effects
        ],
        "laws": [
            {
                "name": law.name,
                "torque": law.torque,
                "shape": [{"name": n, "lower": low, "upper": up} for n, low, up in law.shape],
            }
            for law in model.laws
        ],
    }
