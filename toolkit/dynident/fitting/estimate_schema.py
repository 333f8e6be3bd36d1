"""What the JSON file of an estimate holds: the kind and the range of every value.

How the sizes of its arrays belong together is for `estimate_file` to say, which knows the model.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from dynident.inertia import LARGEST


def _not_null(value: object) -> object:
    return float("nan") if value is None else value


def _told(value: float) -> float:
    if value < 0.0 or LARGEST <= value < float("inf"):
        raise ValueError(f"a size is not negative, and below {LARGEST:g}")
    return value


# A covariance is a square.
_Square = Annotated[float, Field(gt=-(LARGEST**2), lt=LARGEST**2)]
_Number = Annotated[float, Field(gt=-LARGEST, lt=LARGEST)]
_Size = Annotated[float, Field(ge=0.0, lt=LARGEST)]
_Positive = Annotated[float, Field(gt=0.0, lt=LARGEST)]
# What nobody computes with: unknown (NaN, null) where nothing was fitted.
_Told = Annotated[float, BeforeValidator(_not_null), AfterValidator(_told)]
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


class _Effect(_Part):
    effect: str
    joint: str | None
    source: str | None
    shape: list[_Number]
    point: list[_Number] = []


class ModelPart(_Part):
    """The model that was fitted."""

    robot: str
    joints: list[str]
    gravity: list[_Number]
    friction_width: _Positive
    effects: list[_Effect]


class EstimateFile(_Part):
    """The whole file."""

    format: Literal["dynident-estimate-1"]
    method: str
    status: str
    parameters: list[_Parameter]
    covariance: list[list[_Square]]
    basis: BasisPart
    torque_std: list[_Told]
    joint_errors: list[_Told]
    error: _Told
    condition_number: _Told
    rows: Annotated[int, Field(ge=0, le=10**15)]
    notes: list[str]
    sigma_words: str = ""
    recordings: list[_Recording]
    links: dict[str, list[_Number]] | None = None
    certificate: dict[str, Any] | None = None
    iterations: dict[str, Any] | None = None
    model: ModelPart
