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
from dynident.settings import in_unit

FORMAT = "dynident-estimate-1"
"""Name and version of the file's format."""


def _not_null(value: object) -> object:
    return float("nan") if value is None else value


def _reported(value: float) -> float:
    if value < 0.0 or LARGEST <= value < float("inf"):
        raise ValueError(f"a size is not negative, and below {LARGEST:g}")
    return value


# A covariance is a square.
_Square = Annotated[float, Field(gt=-(LARGEST**2), lt=LARGEST**2, allow_inf_nan=False)]
_Number = Annotated[float, Field(gt=-LARGEST, lt=LARGEST, allow_inf_nan=False)]
_Size = Annotated[float, Field(ge=0.0, lt=LARGEST, allow_inf_nan=False)]
_Positive = Annotated[float, Field(gt=0.0, lt=LARGEST, allow_inf_nan=False)]
# What nothing is computed from: unknown (NaN, null) where nothing was fitted.
_Reported = Annotated[
    float,
    BeforeValidator(_not_null, json_schema_input_type=_Size | None),
    AfterValidator(_reported),
]
_Index = Annotated[int, Field(ge=0)]


class _Part(BaseModel):
    # What stands under a key is what the published schema says of it.
    model_config = ConfigDict(strict=True, defer_build=True)


class _Parameter(_Part):
    """A parameter of the model."""

    name: str
    """As `Izz.forearm` or `Fc@elbow`, see the page of symbols."""
    value: _Number
    """In `unit`; what the data do not identify keeps the value of the description."""
    sigma: _Size | None
    """Standard deviation of `identified`, in `unit`; null where that is null, and where the method
    has no covariance."""
    unit: str
    """Of value and sigma."""
    expression: str
    """The parameter as a combination of the standard ones of links and effects."""
    identified: _Number | None = None
    """What the data identify under this name, in `unit`: of a combination, its value; null where
    that is nothing."""
    stands_for: str = ""
    """The combination that is identified under this name, or why there is none."""


class BasisPart(_Part):
    """What the data identify: independent columns, and what depends on them."""

    names: list[str]
    """All parameters, in the order of the model."""
    independent: list[_Index]
    """Places of those that stand for the base parameters, ascending."""
    dependent: list[_Index]
    """Places of the others."""
    expressions: list[str]
    """Each base parameter as a combination of parameters."""
    K: list[list[_Number]]
    """(independent, dependent): the columns of the dependent are those of the independent times
    K."""
    scale: list[_Size]
    """Norm of each column, by which it was divided before the rank was decided."""
    diagonal: list[_Size]
    """Of the triangular factor, in the order of its pivots."""
    tolerance: _Size
    """Share of the first entry of `diagonal` below which a column is dependent."""


class _Recording(_Part):
    """A recording that the estimate rests on."""

    file: str
    """Its name."""
    sha256: str
    """Of the file's content."""
    filter: str
    """How it was filtered, in words."""


class _Origin(_Part):
    """Where an effect of one's own came from."""

    module: str
    """By which it was imported."""
    file: str
    """Its name without its folder; empty for a notebook's cell and a console."""
    package: str
    """That was installed and brings it; empty for none."""


class _Effect(_Part):
    """An effect of the model."""

    effect: str
    """Its name in the catalogue, or `law:NAME`."""
    joint: str | None
    """The joint whose torque changes; null for an effect of the whole robot."""
    source: str | None
    """The other joint of a coupling."""
    shape: list[_Number]
    """Its shape parameters, as they were found."""
    point: list[_Number] = []
    """Values at which columns are taken that are not linear in them."""
    origin: _Origin | None = None
    """Of an effect of one's own."""


class _Range(_Part):
    """A parameter inside a law, with its range."""

    name: str
    """As in the formula."""
    lower: _Number
    """Least that is sought."""
    upper: _Number
    """Most that is sought."""


class _Law(_Part):
    """An effect as a formula."""

    name: str
    """NAME of `law:NAME`."""
    torque: str
    """The formula."""
    shape: list[_Range] = []
    """Parameters inside it."""


class _ShapePart(_Part):
    """A parameter inside an effect, in which the torque is not linear."""

    name: str
    """As `vs@elbow`."""
    value: _Number
    """In `unit`."""
    sigma: _Size | None
    """Standard deviation, in `unit`; null where it is not known."""
    unit: str
    """Of value and sigma."""


class ModelPart(_Part):
    """The model that was fitted."""

    robot: str
    """Its description, the whole text."""
    joints: list[str]
    """In the order of columns."""
    gravity: list[_Number] = Field(json_schema_extra=in_unit("m/s^2"))
    """In the axes of the description's base."""
    friction_width: _Positive | list[_Positive] = Field(json_schema_extra=in_unit("rad/s or m/s"))
    """Speed within which dry friction turns over; one, or one per joint."""
    effects: list[_Effect]
    """Those that were fitted."""
    laws: list[_Law] = []
    """Formulas that they need."""


class EstimateFile(_Part):
    """Identified parameters, with what they rest on."""

    format: Literal["dynident-estimate-1"]
    """Name and version of the format."""
    method: str
    """How it was estimated."""
    status: str
    """The solver's word."""
    parameters: list[_Parameter]
    """In the order of the model."""
    covariance: list[list[_Square]]
    """Of the parameters, in products of their units; rows of those that are not identified on
    their own are zero."""
    basis: BasisPart
    """What the data identify."""
    torque_std: list[_Reported] = Field(json_schema_extra=in_unit("N m or N"))
    """Standard deviation of the torque residual of each joint; null where nothing was fitted."""
    joint_errors: list[_Reported] = Field(json_schema_extra=in_unit("1"))
    """Of each joint: norm of the residual over norm of the torque, on the data of the fit."""
    error: _Reported = Field(json_schema_extra=in_unit("1"))
    """The same over all joints."""
    condition_number: _Reported = Field(json_schema_extra=in_unit("1"))
    """Of the columns identified, as they were weighted."""
    rows: Annotated[int, Field(ge=0, le=10**15)]
    """Number of equations."""
    notes: list[str]
    """Caveats in plain words."""
    sigma_words: str = ""
    """What the standard deviations hold, where the method has its own."""
    headline: str = ""
    """What is to be read before any number: that the model is rejected; empty if it is not."""
    standing: list[str] = []
    """Joints that stand at their stops, of which rows around these did not count."""
    shapes: list[_ShapePart] = []
    """Parameters inside effects, as they were found."""
    recordings: list[_Recording]
    """Those that it rests on."""
    links: dict[str, list[_Number]] | None = None
    """Inertial parameters of each link in its own frame (mass, first moments, Ixx, Ixy, Ixz, Iyy,
    Iyz, Izz about its origin), where the fit chose them; null where only base parameters are
    known."""
    certificate: dict[str, Any] | None = None
    """How far a constrained fit is from the optimum of its problem; not read back."""
    iterations: dict[str, Any] | None = None
    """Of an instrumental variable estimate; not read back."""
    model: ModelPart
    """The model that was fitted."""


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
