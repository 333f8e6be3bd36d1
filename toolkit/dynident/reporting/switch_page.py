"""Effects switched on and off on the page: the choices as data, the picture, the words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go

from dynident.diagnosis.effect_groups import grouped_title
from dynident.diagnosis.result import Diagnosis
from dynident.reporting.content import AFTER_COLOUR, BEFORE_COLOUR, GREY
from dynident.reporting.pictures.look import dressed, plain

_DIGITS = 5
"""Of torques and errors in the page."""


@dataclass(frozen=True, kw_only=True)
class SwitchSection:
    """What the section shows.

    Attributes
    ----------
    titles : of each switch.
    joints : their names, in the order of the robot.
    first : the joint whose torque is drawn first.
    recording, start, stop : of the window, s.
    figure : torque of that joint in the window.
    data : for the script of the page.
    """

    titles: tuple[str, ...]
    joints: tuple[str, ...]
    first: int
    recording: str
    start: float
    stop: float
    figure: go.Figure
    data: dict[str, Any]


def switch_section(diagnosis: Diagnosis) -> SwitchSection | None:
    """Return what the section on switching shows; None where no choice was fitted."""
    found = diagnosis.switches
    if found is None:
        return None
    joints = tuple(joint.name for joint in diagnosis.joints)
    worst = max(diagnosis.joints, key=lambda one: _fall(one.error_before, one.error_after)).name
    first = joints.index(worst)
    choices = {"".join(str(int(on)) for on in one.on): one for one in found.choices}
    return SwitchSection(
        titles=tuple(grouped_title(group, len(joints)) for group in found.effects),
        joints=joints,
        first=first,
        recording=found.recording,
        start=float(found.t[0]),
        stop=float(found.t[-1]),
        figure=_figure(diagnosis, first),
        data={
            "units": [joint.torque_unit for joint in diagnosis.joints],
            "floor": diagnosis.test_error.noise_floor,
            "floors": [joint.noise_share for joint in diagnosis.joints],
            "measured": _numbers(found.measured.T),
            "choices": {
                key: {
                    "error": one.error,
                    "joints": _numbers(one.joint_errors),
                    "predicted": _numbers(one.predicted.T),
                }
                for key, one in choices.items()
            },
        },
    )


def _fall(before: float, after: float) -> float:
    return before - after if np.isfinite(before - after) else -np.inf


def _numbers(values: np.ndarray) -> Any:
    """Numbers as JSON has them, rounded; None where there is none."""
    if values.ndim > 1:
        return [_numbers(row) for row in values]
    return [float(f"{x:.{_DIGITS}g}") if np.isfinite(x) else None for x in values]


def _figure(diagnosis: Diagnosis, joint: int) -> go.Figure:
    """Torque in the window: measured, as given and as chosen; the script changes the last."""
    found = diagnosis.switches
    assert found is not None
    given = found.choices[0].predicted[:, joint]
    lines = (
        ("measured", found.measured[:, joint], {"color": GREY, "width": 3}),
        ("model as given", given, {"color": BEFORE_COLOUR, "width": 1.5, "dash": "dash"}),
        ("with what is switched on", given, {"color": AFTER_COLOUR, "width": 1.8}),
    )
    figure = go.Figure()
    for name, torque, line in lines:
        y = _numbers(torque)
        figure.add_trace(
            go.Scatter(x=_numbers(found.t), y=y, name=plain(name), line=line, mode="lines")
        )
    figure.update_xaxes(title="time (s)")
    figure.update_yaxes(title=f"torque ({diagnosis.joints[joint].torque_unit})")
    return dressed(figure, 330, top=60)
