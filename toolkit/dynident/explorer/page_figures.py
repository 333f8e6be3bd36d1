"""The pictures of the page: held-out errors, torques of a recording, residual maps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from dynident.closed_loop import Trajectory
from dynident.evidence import ResidualMap
from dynident.evidence.held_out import HeldOut, HeldOutRun
from dynident.explorer.switched_fit import SwitchedFit
from dynident.reporting.content import (
    AFTER_COLOUR,
    BAND,
    BEFORE_COLOUR,
    GIVEN,
    GREY,
    is_spectrum,
    kept_of,
    x_title,
    y_title,
)
from dynident.reporting.pictures.diagnosis_pictures import noise_band
from dynident.reporting.pictures.look import dressed, plain, single_precision

NOW = "with what is switched on"
_POINTS, _MOTION_POINTS = 3000, 401


TORQUE_HEIGHT, MAP_HEIGHT, MOTION_HEIGHT = 470, 350, 320
"""Heights of the pictures of torque, of residuals and of a designed motion, pixels."""


def waiting() -> go.Figure:
    """Return what stands in the place of a picture that is being made."""
    words = {"text": "working ...", "showarrow": False, "font": {"size": 15}}
    empty = {"visible": False}
    figure = go.Figure(layout={"xaxis": empty, "yaxis": empty, "annotations": [words]})
    return dressed(figure, 300)


def bars_height(joints: int) -> int:
    """Height of the bars of so many joints and of all of them, pixels."""
    return 120 + 62 * (joints + 1)


def error_bars(before: SwitchedFit, now: SwitchedFit) -> go.Figure:
    """Held-out error of every joint and of all, before and now, with the noise floor.

    The axis is that of the error before, so that bars are seen to fall.
    """
    joints = [plain(name) for name in (*before.model.robot.names, "all joints")]
    figure = go.Figure()
    for name, fit, colour in ((GIVEN, before, BEFORE_COLOUR), (NOW, now, AFTER_COLOUR)):
        shares = 100 * _errors(fit.judged)
        figure.add_trace(
            go.Bar(
                orientation="h",
                y=joints,
                x=shares,
                name=name,
                marker={"color": colour},
                text=[f"{x:.2f} %" if np.isfinite(x) else "no torque" for x in shares],
                textposition="outside",
                cliponaxis=False,
                hovertemplate="%{x:.3f} %<extra></extra>",
            )
        )
    floors = _floors(now.judged)
    if floors is not None:
        mark = {"symbol": "line-ns", "size": 30, "line": {"width": 3, "color": GREY}}
        figure.add_trace(
            go.Scatter(
                x=100 * floors,
                y=joints,
                mode="markers",
                name="noise floor",
                marker=mark,
                hovertemplate="noise floor %{x:.3f} %<extra></extra>",
            )
        )
    both = np.concatenate([_errors(before.judged), _errors(now.judged)])
    top = 100 * float(np.nanmax(both)) if np.isfinite(both).any() else 1.0
    figure.update_xaxes(title="held-out torque error (%)", range=[0, 1.25 * top], fixedrange=True)
    figure.update_yaxes(autorange="reversed", automargin=True, fixedrange=True, showgrid=False)
    figure.update_layout(barmode="group", bargap=0.3, dragmode=False)
    return dressed(figure, bars_height(before.model.robot.n), top=34)


def measured_and_predicted(
    runs: tuple[HeldOutRun, HeldOutRun], joint: int, unit: str, noise: float | None
) -> go.Figure:
    """Torque of a joint in a recording, measured and predicted, and the residuals below.

    Parameters
    ----------
    runs : the same recording with the model as given, and with what is switched on.
    joint : column of the joint.
    unit : N m or N.
    noise : rms in that unit; None where it is unknown.

    Returns
    -------
    Figure of two rows that zoom together.
    """
    before, now = runs
    measured = before.measured[:, joint]
    lefts = [run.residual[:, joint] for run in runs]
    kept = kept_of((measured, *lefts), _POINTS)
    t = single_precision(before.t[kept])
    figure = make_subplots(
        rows=2, cols=1, shared_xaxes=True, row_heights=[0.6, 0.4], vertical_spacing=0.06
    )
    _line(figure, 1, t, measured[kept], name="measured", line={"color": GREY, "width": 3})
    if noise is not None:
        ends, edge = np.array([t[0], t[-1], t[-1], t[0]]), 2 * noise * np.array([1, 1, -1, -1])
        figure.add_trace(noise_band(ends, edge, f"{BAND} (2 rms)"), row=2, col=1)
    styles = ((GIVEN, before, BEFORE_COLOUR, "dash"), (NOW, now, AFTER_COLOUR, "solid"))
    for (name, run, colour, dash), left in zip(styles, lefts, strict=True):
        line = {"color": colour, "width": 1.8, "dash": dash}
        _line(figure, 1, t, run.predicted[kept, joint], name=name, legendgroup=name, line=line)
        line = {"color": colour, "width": 1.2}
        _line(figure, 2, t, left[kept], name=name, legendgroup=name, showlegend=False, line=line)
    figure.update_xaxes(title="time (s)", row=2, col=1)
    figure.update_yaxes(title=f"torque ({unit})", row=1, col=1)
    figure.update_yaxes(title=f"residual ({unit})", row=2, col=1)
    figure = dressed(figure, TORQUE_HEIGHT, top=30)
    return figure.update_layout(legend={"y": -0.16, "yanchor": "top"})


def zoomed(figure: go.Figure, zoom: object) -> go.Figure:
    """Return a picture with its axes where somebody has moved those of the one before it.

    Parameters
    ----------
    figure : of `measured_and_predicted`; is changed.
    zoom : what the browser tells of the last move, as `{"xaxis.range[0]": 1.5, ...}`.
    """
    said = zoom if isinstance(zoom, Mapping) else {}
    for axis in ("xaxis", "xaxis2", "yaxis", "yaxis2"):
        ends = [said.get(f"{axis}.range[{end}]") for end in (0, 1)]
        if all(isinstance(end, int | float) for end in ends):
            # Both rows share their time.
            to = {"xaxis", "xaxis2"} if axis.startswith("x") else {axis}
            figure.update_layout({one: {"range": ends} for one in to})
    return figure


def map_picture(one: ResidualMap) -> go.Figure:
    """Mean residual against one quantity, before and now, with the noise band."""
    figure, known = go.Figure(), np.isfinite(one.band)
    if known.any():
        x, edge = one.at[known], one.band[known]
        lower = np.zeros_like(edge) if is_spectrum(one) else -edge
        outline = np.concatenate([x, x[::-1]]), np.concatenate([edge, lower[::-1]])
        figure.add_trace(noise_band(*outline, BAND))
    mode = "lines" if is_spectrum(one) else "lines+markers"
    drawn = ((GIVEN, one.before, BEFORE_COLOUR), (NOW, one.after, AFTER_COLOUR))
    for name, values, colour in drawn:
        line = {"color": colour, "width": 2}
        figure.add_trace(go.Scatter(x=one.at, y=values, mode=mode, name=name, line=line))
    figure.update_xaxes(title=x_title(one), fixedrange=True)
    figure.update_yaxes(title=y_title(one), zeroline=True, fixedrange=True)
    figure.update_layout(dragmode=False)
    figure = dressed(figure, MAP_HEIGHT, top=30)
    return figure.update_layout(legend={"y": -0.2, "yanchor": "top"})


def motion_picture(motion: Trajectory, joints: Sequence[str], units: Sequence[str]) -> go.Figure:
    """Positions of all joints over one repetition of a motion.

    Parameters
    ----------
    motion : of n joints.
    joints, units : name and unit, rad or m, of each.

    Returns
    -------
    Figure with a line for each joint.
    """
    t = np.linspace(0.0, motion.period, _MOTION_POINTS)
    q = single_precision(motion.at(t)[0])
    figure = go.Figure()
    for j, (joint, unit) in enumerate(zip(joints, units, strict=True)):
        name = plain(f"{joint} ({unit})")
        figure.add_trace(go.Scatter(x=single_precision(t), y=q[:, j], mode="lines", name=name))
    figure.update_xaxes(title="time (s)", fixedrange=True)
    figure.update_yaxes(title=f"position ({', '.join(dict.fromkeys(units))})", fixedrange=True)
    figure.update_layout(dragmode=False, showlegend=True)
    figure = dressed(figure, MOTION_HEIGHT, top=30)
    return figure.update_layout(legend={"y": -0.25, "yanchor": "top"})


def _errors(judged: HeldOut) -> np.ndarray:
    return np.append(judged.joint_errors, judged.error)


def _floors(judged: HeldOut) -> np.ndarray | None:
    if judged.noise_std is None or judged.floor is None:
        return None
    torque = judged.torque_rms
    return np.append(judged.noise_std / np.where(torque > 0, torque, np.nan), judged.floor)


def _line(figure: go.Figure, row: int, t: np.ndarray, y: np.ndarray, **style) -> None:
    trace = go.Scatter(x=t, y=single_precision(y), mode="lines", **style)
    figure.add_trace(trace, row=row, col=1)
