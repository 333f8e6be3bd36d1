"""Estimates read back from JSON, only if every number can be what it stands for.

In: a file that `Estimate.save` wrote. Out: the `Estimate`, or a refusal that names the first key
that is wrong.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from dynident import files
from dynident.arguments import checked
from dynident.effects import Law, Origin, catalogue, law_effect
from dynident.errors import DynidentError, EffectError, FitError
from dynident.fitting.estimate import DataSource, Estimate, ShapeValue
from dynident.fitting.estimate_schema import BasisPart, EstimateFile, ModelPart
from dynident.inertia import PARAMETERS
from dynident.model import Model
from dynident.robot import BaseParameters, Robot

_REMEDY = "save one with Estimate.save"
_TRIED = re.compile(r"(constrained-|list\[)")
# Of the standard deviations: what rounding makes of a symmetric matrix is far less.
_SKEW = 1e-6


@checked
def load_estimate(path: str | Path) -> Estimate:
    """Read an estimate that `Estimate.save` wrote.

    Its certificate and its iterations are not read back: a proof holds where it was
    computed.

    Raises
    ------
    FileError
        If the file cannot be read.
    FitError
        If it is not an estimate of this version: a key is missing or of the wrong kind, a number
        is not finite or beyond `LARGEST`, an array has not the size that the model needs, or the
        model in it is none. The first such key is named.
    """
    where = str(path)
    text = files.read_text(path)
    if not text.strip():
        raise FitError("is empty: not a dynident estimate", where, _REMEDY)
    try:
        read = json.loads(text)
        # Half a surrogate pair is text to JSON, and to nothing that would print it.
        json.dumps(read, ensure_ascii=False).encode("utf-8")
        content = EstimateFile.model_validate(read)
    except ValidationError as error:
        raise _refusal(*_first(error), where) from None
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        raise _refusal("not JSON", reason, where) from None
    # Numbers of any size may be in the description: they are judged, not warned of.
    with np.errstate(all="ignore"):
        model = _model(content.model, where)
        return _estimate(content, model, where)


def _is_covariance(square: np.ndarray, std: np.ndarray) -> bool:
    """Whether the correlations (p, p) of parameters are those of anything, but for rounding."""
    held = std > 0.0
    correlations = square[np.ix_(held, held)] / np.outer(std[held], std[held])
    return not held.any() or float(np.linalg.eigvalsh(correlations)[0]) > -_SKEW * len(square)


def _estimate(content: EstimateFile, model: Model, where: str) -> Estimate:
    p, n = model.size, model.robot.n
    names = [parameter.name for parameter in content.parameters]
    _require_same(names, list(model.names), "parameters", where)
    square = _matrix(content.covariance, (p, p), "covariance", where)
    std = np.sqrt(np.clip(np.diag(square), 0.0, None))
    skew = np.abs(square - square.T) > _SKEW * np.outer(std, std)
    if np.any(np.diag(square) < 0.0) or np.any(skew):
        raise _refusal("covariance", "is not symmetric with a diagonal of squares", where)
    if not _is_covariance(square, std):
        raise _refusal("covariance", "has variances below zero in some directions", where)
    known = {link.name for link in model.robot.links}
    for name, phi in (content.links or {}).items():
        if name not in known:
            raise _refusal(f"links.{name[:40]}", "the robot has no such link", where)
        _require_count(phi, len(PARAMETERS), f"links.{name}", where)
    for key in ("torque_std", "joint_errors"):
        _require_count(getattr(content, key), n, key, where)
    kept = {names[i] for i in content.basis.independent if i < p}
    open_ = [one.name for one in content.parameters if one.sigma is None and one.name in kept]
    links = None
    if content.links is not None:
        links = {name: np.array(phi, dtype=float) for name, phi in content.links.items()}
    return Estimate(
        model=model,
        values=np.array([parameter.value for parameter in content.parameters]),
        covariance=square,
        basis=_basis(content.basis, model, where),
        torque_std=np.array(content.torque_std),
        joint_errors=np.array(content.joint_errors),
        error=content.error,
        condition_number=content.condition_number,
        rows=content.rows,
        method=content.method,
        status=content.status,
        notes=tuple(content.notes),
        sources=tuple(DataSource(one.file, one.sha256, one.filter) for one in content.recordings),
        links=links,
        sigma_words=content.sigma_words,
        headline=content.headline,
        standing=tuple(content.standing),
        shapes=tuple(
            ShapeValue(
                name=one.name,
                value=one.value,
                sigma=np.nan if one.sigma is None else one.sigma,
                unit=one.unit,
            )
            for one in content.shapes
        ),
        trading_off=tuple(open_) if np.any(square) else (),
    )


def _model(given: ModelPart, where: str) -> Model:
    _require_count(given.gravity, 3, "model.gravity", where)
    try:
        laws = tuple(
            Law(
                name=one.name,
                torque=one.torque,
                shape=tuple((part.name, part.lower, part.upper) for part in one.shape),
            )
            for one in given.laws
        )
    except EffectError as error:
        raise _refusal("model.laws", str(error), where) from None
    known = {**catalogue(), **{law.label: law_effect(law) for law in laws}}
    for number, one in enumerate(given.effects):
        if one.effect not in known and one.origin is not None:
            origin = Origin(one.origin.module[:40], one.origin.file[:80], one.origin.package[:80])
            raise FitError(origin.missing(one.effect[:40]), where)
        if one.effect not in known:
            what = f"no effect is named '{one.effect[:40]}'"
            raise _refusal(f"model.effects.{number}.effect", what, where)
    try:
        robot = Robot.from_text(given.robot, where, given.joints, given.gravity)
        effects = tuple(
            known[one.effect](one.joint, one.source, tuple(one.shape), tuple(one.point))
            for one in given.effects
        )
        width = given.friction_width
        width = tuple(width) if isinstance(width, list) else width
        model = Model(robot, effects, width, laws)
        # The names are found from the dynamics: some descriptions fail only there.
        assert model.names
    except DynidentError as error:
        raise _refusal("model", str(error).removeprefix(f"{where}: "), where) from None
    return model


def _basis(given: BasisPart, model: Model, where: str) -> BaseParameters:
    p, rank = model.size, len(given.independent)
    _require_same(given.names, list(model.names), "basis.names", where)
    for key in ("independent", "dependent"):
        indices = getattr(given, key)
        if indices != sorted(set(indices)) or any(index >= p for index in indices):
            raise _refusal(f"basis.{key}", f"needs ascending indices below {p}", where)
    if sorted(given.independent + given.dependent) != list(range(p)):
        what = "every parameter belongs to one of independent and dependent"
        raise _refusal("basis.independent", what, where)
    _require_count(given.expressions, rank, "basis.expressions", where)
    _require_count(given.scale, p, "basis.scale", where)
    diagonal = np.array(given.diagonal, dtype=float)
    kept, dropped = diagonal[:rank], diagonal[rank:]
    if not rank <= len(diagonal) <= p:
        what = f"{len(diagonal)} numbers where {rank} to {p} are needed"
        raise _refusal("basis.diagonal", what, where)
    if not np.all(kept > 0.0) or (np.any(dropped) and not dropped[0] > 0.0):
        raise _refusal("basis.diagonal", "is zero where a parameter was kept", where)
    return BaseParameters(
        names=tuple(given.names),
        independent=tuple(given.independent),
        dependent=tuple(given.dependent),
        K=_matrix(given.K, (rank, p - rank), "basis.K", where),
        expressions=tuple(given.expressions),
        scale=np.array(given.scale, dtype=float),
        diagonal=diagonal,
        tolerance=given.tolerance,
    )


# --- refusals -----------------------------------------------------------------------------------


def _refusal(key: str, what: str, where: str) -> FitError:
    line = " ".join(f"{key}: {what}".split())
    return FitError(f"is not a dynident estimate ({line})", where, _REMEDY)


def _first(error: ValidationError) -> tuple[str, str]:
    """The first key that is wrong, and what is wrong with it."""
    first = error.errors(include_url=False, include_input=False)[0]
    # Where a key takes several types, pydantic appends the one that it tried.
    own = [str(part)[:40] for part in first["loc"] if not _TRIED.match(str(part))]
    key = ".".join(own) or "content"
    said = {
        "missing": "is missing",
        "model_type": "a table of keys and values is needed",
        # pydantic would cite an integer of any length.
        "int_from_float": "should be a whole number",
    }
    bound = first.get("ctx", {})
    if first["type"] in ("less_than", "greater_than"):  # in full it would have thirty digits
        sense = first["type"].replace("_", " ")
        said[first["type"]] = f"should be {sense} {bound.get('lt', bound.get('gt')):g}"
    message = said.get(first["type"], first["msg"])
    return key, message[:1].lower() + message[1:]


def _require_count(given: list[Any], needed: int, key: str, where: str) -> None:
    if len(given) != needed:
        raise _refusal(key, f"{len(given)} values where {needed} are needed", where)


def _require_same(given: list[str], needed: list[str], key: str, where: str) -> None:
    _require_count(given, len(needed), key, where)
    for i, (name, wanted) in enumerate(zip(given, needed, strict=True)):
        if name != wanted:
            what = f"'{name[:40]}' where the model has '{wanted}'"
            raise _refusal(f"{key}.{i}", what, where)


def _matrix(given: list[list[float]], shape: tuple[int, int], key: str, where: str) -> np.ndarray:
    _require_count(given, shape[0], key, where)
    for i, row in enumerate(given):
        _require_count(row, shape[1], f"{key}.{i}", where)
    return np.array(given, dtype=float).reshape(shape)
