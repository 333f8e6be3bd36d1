"""Parameters with intervals that are widened where the model is rejected."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np

from dynident.diagnosis.result import Diagnosis
from dynident.effects import Effect, ShapeParameter
from dynident.fitting.estimate import Estimate, ShapeValue
from dynident.fitting.uncertainty.shape_errors import shapes_at_ends
from dynident.inertia.parameters import MEANINGS, PARAMETERS
from dynident.recording.dataset import NoiseSource
from dynident.tables import Table, number, relative

_QUANTILE = 1.959964
"""Half width of a 95 % interval, in standard errors."""
_REJECTED = (
    "The model is rejected: a residual beyond the noise remains, and sigma holds noise only."
)


@dataclass(frozen=True)
class Widening:
    """Factors on standard errors: square root of residual over noise variance (Birge ratio).

    A parameter of an effect at one joint has that joint's; what all joints share, the rigid body's
    parameters, has that of all rows together.

    Attributes
    ----------
    joints : by the name of the joint, 1 or more.
    overall : root of their mean square.
    """

    joints: dict[str, float]
    overall: float

    def of(self, joint: str | None) -> float:
        """Factor on the standard errors of a parameter, by the joint that it belongs to."""
        return self.overall if joint is None else self.joints[joint]


def widening_before(diagnosis: Diagnosis) -> Widening | None:
    """Of the model as given; None where it is not rejected, or the noise is unknown."""
    if not diagnosis.steps and diagnosis.verdict != "unexplained":
        return None
    return _widening({j.name: j.ratio_before for j in diagnosis.joints})


def widening_after(diagnosis: Diagnosis) -> Widening | None:
    """Of the final model; None where it is not rejected, or the noise is unknown."""
    if diagnosis.verdict != "unexplained" or diagnosis.impossible or diagnosis.training_only:
        return None  # nothing is left of the held-out data, or that is not why
    return _widening({j.name: j.ratio_after for j in diagnosis.joints})


def _widening(ratios: dict[str, float | None]) -> Widening | None:
    # The residual's variance is the noise's and the systematic part's, which is ratio^2 of it.
    squares = {name: 1.0 + r**2 for name, r in ratios.items() if r is not None}
    if len(squares) < len(ratios) or not squares:
        return None
    joints = {name: float(np.sqrt(square)) for name, square in squares.items()}
    return Widening(joints, float(np.sqrt(np.mean(list(squares.values())))))


def parameter_table(estimate: Estimate, widening: Widening | None, noise: NoiseSource) -> Table:
    """Values with 95 % intervals.

    Parameters
    ----------
    estimate : of the diagnosis.
    widening : None where the model is not rejected.
    noise : where the noise is known from; "unknown": the intervals rest on the residual.

    Returns
    -------
    A row for each parameter, in the order of the model: those of the rigid body come first. Those
    inside effects (widths, frequencies, ...) come last, without intervals where sigma is not known.
    """
    model = estimate.model
    values = estimate.identified_values
    factors = np.ones(model.size)
    if widening is not None:
        factors[:] = widening.overall
        for effect in model.effects:
            factors[model.slices[effect.label]] = widening.of(effect.joint)
    half = _QUANTILE * factors * estimate.sigma
    stands_for = estimate.stands_for
    words = _meanings(estimate)
    rows = tuple(
        (
            name,
            words[i],
            number(values[i], _digits(values[i], half[i])),
            _interval(values[i], half[i]),
            relative(values[i], half[i]),
            model.units[i],
            stands_for[i],
        )
        for i, name in enumerate(model.names)
    )
    rows = (*rows, *_shape_rows(estimate, widening))
    columns = (
        "parameter",
        "what it is",
        "value",
        "95 % interval",
        "\u00b1 relative",
        "unit",
        "stands for",
    )
    how, of_sigma = estimate.parameter_table().notes
    ends = shapes_at_ends(model).values()
    notes = (_in_words(widening, noise), how, *((of_sigma,) if widening is None else ()), *ends)
    return Table("Parameters", columns, rows, notes)


def _meanings(estimate: Estimate) -> list[str]:
    """What each parameter is, in words, and where."""
    model = estimate.model
    found = [_of_body(name) for name in model.names]
    for effect in model.effects:
        for i, one in enumerate(effect.parameters(model.robot), model.slices[effect.label].start):
            found[i] = _placed(one.means, effect)
    return found


def _of_body(name: str) -> str:
    symbol, _, body = name.partition(".")
    if symbol not in PARAMETERS:
        return ""
    return f"{MEANINGS[PARAMETERS.index(symbol)].partition(',')[0]}, {body}"


def _placed(means: str, effect: Effect) -> str:
    words = means or effect.name.replace("_", " ")
    return words if effect.joint is None else f"{words}, {effect.title.partition(' at ')[2]}"


def _shape_rows(estimate: Estimate, widening: Widening | None) -> list[tuple[str, ...]]:
    rows = []
    for effect, one, found in _shapes(estimate):
        factor = 1.0 if widening is None else widening.of(effect.joint)
        x, half = found.value, _QUANTILE * factor * found.sigma
        words, between = _placed(one.means, effect), _interval(x, half)
        if one.lower >= 0.0 and x < half < np.inf:  # no such shape is negative
            between = f"up to {number(x + half, _digits(x, half))}"
        rows.append((found.name, words, number(x, 4), between, relative(x, half), one.unit, ""))
    return rows


def _shapes(estimate: Estimate) -> Iterator[tuple[Effect, ShapeParameter, ShapeValue]]:
    """Every parameter inside an effect; its sigma is NaN where it is not known."""
    model, sigma = estimate.model, {one.name: one.sigma for one in estimate.shapes}
    for effect in model.effects:
        names, parameters = model.shape_names[effect.label], effect.shape_parameters(model.robot)
        for name, one, x in zip(names, parameters, effect.shape, strict=False):
            known = sigma.get(name, float("nan"))
            yield effect, one, ShapeValue(name=name, value=x, sigma=known, unit=one.unit)


def printed_parameters(diagnosis: Diagnosis) -> tuple[Table | str, ...]:
    """Parameters of the effects that were added, as text; nothing where none was.

    Those of the study's own model are in the report. Where the final model is rejected by a noise
    that is known, that is said above them: sigma is not widened.
    """
    estimate, steps = diagnosis.after, diagnosis.steps
    # A contact is an event of one recording: it has a step, and no part in the model.
    added = [one.effect.label for one in steps if one.effect.label in estimate.model.slices]
    if not added:
        return ()
    stands_for, model = estimate.stands_for, estimate.model
    rows = [
        (
            model.names[i],
            *_with_sigma(float(estimate.identified_values[i]), float(estimate.sigma[i])),
            model.units[i],
            stands_for[i],
        )
        for label in added
        for i in range(model.size)[model.slices[label]]
    ]
    inside = [(e, one, x) for e, one, x in _shapes(estimate) if e.label in added]
    rows += [(x.name, *_with_sigma(x.value, x.sigma), x.unit, "") for _, _, x in inside]
    columns = ("parameter", "value", "sigma", "relative", "unit", "stands for")
    if not any(row[-1] for row in rows):
        rows, columns = [row[:-1] for row in rows], columns[:-1]
    every = shapes_at_ends(model)
    ends = [every[x.name] for _, _, x in inside if x.name in every]
    elsewhere = "The report (--report) has all parameters of this model."
    notes = (*_legend(estimate, added), *estimate.parameter_table().notes, *ends, elsewhere)
    table = Table("Parameters of the effects added", columns, tuple(rows), notes)
    return (table,) if widening_after(diagnosis) is None else (_REJECTED, table)


def _with_sigma(value: float, sigma: float) -> tuple[str, str, str]:
    """A value, its standard error and their ratio, in as many digits as the error tells apart."""
    return number(value, _digits(value, sigma)), number(sigma, 2), relative(value, sigma)


def _legend(estimate: Estimate, labels: Collection[str]) -> Iterator[str]:
    """A line for each symbol of some effects: a table with words in each row would be tall."""
    model, means = estimate.model, dict[str, dict[str, None]]()
    for effect in model.effects:
        if effect.label not in labels:
            continue
        linear = effect.parameters(model.robot)
        names = (*model.names[model.slices[effect.label]], *model.shape_names[effect.label])
        every = (*linear, *effect.shape_parameters(model.robot))
        for name, one in zip(names, every, strict=True):
            words = one.means or effect.name.replace("_", " ")
            means.setdefault(name.partition("@")[0], {})[words] = None
    for symbol, words in means.items():
        yield f"{symbol}: {'; or '.join(words)}"


def _interval(value: float, half: float) -> str:
    if not np.isfinite(value) or not np.isfinite(half):
        return "-"
    digits = _digits(value, half)
    return f"{number(value - half, digits)} to {number(value + half, digits)}"


def _digits(value: float, half: float) -> int:
    """As many digits of a value as the width of its interval tells apart."""
    if not (half > 0 and value):
        return 6
    return int(np.clip(np.ceil(np.log10(abs(value) / half)) + 2, 2, 9))


def _in_words(widening: Widening | None, noise: NoiseSource) -> str:
    if widening is None and noise != "unknown":
        return (
            "The intervals carry the noise of the measurement, as they should: what is left of the "
            "torque is within the noise."
        )
    if widening is None:
        return (
            "The noise is unknown, so the whole residual was taken for noise. What the model lacks "
            "may have pushed these values further than the intervals say."
        )
    each = ", ".join(f"{name} {number(x, 3)}" for name, x in widening.joints.items())
    one = len(widening.joints) == 1
    shared = "" if one else f"; {number(widening.overall, 3)} for the parameters that joints share"
    return (
        "This model is rejected: a residual beyond the noise remains. The intervals are therefore "
        "wider than the noise alone would make them, by the root of the residual's variance over "
        f"the noise's (Birge ratio): {each}{shared}. What is missing may still have pushed a value "
        "out of its interval."
    )
