"""Which joints of a diagnosis are in order, and which are to be looked at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import plotly.graph_objects as go

from dynident.diagnosis.details import JointResult
from dynident.diagnosis.result import Diagnosis
from dynident.reporting.content import AFTER_COLOUR, BEFORE_COLOUR, GIVEN, GREY, after_name
from dynident.reporting.pictures.look import dressed, mark, plain
from dynident.tables import number

MOST_OPEN = 1
"""Joints whose residual maps are shown without asking."""

_NOISE_ALONE = "nothing is left but noise"

State = Literal["fine", "repaired", "failing", "unknown"]


@dataclass(frozen=True)
class JointState:
    """How a joint does.

    Attributes
    ----------
    joint : its errors.
    state : "fine", "repaired" (by an effect added), "failing", or "unknown" without a noise floor.
    words : the same as a clause.
    badness : larger is to be looked at sooner.
    """

    joint: JointResult
    state: State
    words: str
    badness: tuple[int, float]


def states(diagnosis: Diagnosis) -> tuple[JointState, ...]:
    """Every joint, the worst first."""
    found = (_state(diagnosis, joint) for joint in diagnosis.joints)
    return tuple(sorted(found, key=lambda one: one.badness, reverse=True))


def opened(diagnosis: Diagnosis) -> frozenset[str]:
    """Joints whose maps are shown without asking: the worst one."""
    order = states(diagnosis)
    bad = [one for one in order if one.state not in ("fine", "unknown")] or list(order[:1])
    return frozenset(one.joint.name for one in bad[:MOST_OPEN])


def _state(diagnosis: Diagnosis, joint: JointResult) -> JointState:
    named = any(step.effect.joint == joint.name for step in diagnosis.steps)
    before, after = joint.ratio_before, joint.ratio_after
    if joint.name in diagnosis.following_motion:
        words = "what is left follows the motion: it is not all noise"
        return JointState(joint, "failing", words, (2, joint.error_after))
    if diagnosis.only_bursts and joint.name in diagnosis.bursts:
        words = "a few bursts hold most of what is left: it is hardly noise"
        return JointState(joint, "failing", words, (2, joint.error_after))
    if joint.error_after != joint.error_after:
        words = "none of its rows tells anything: it stands, or has no torque"
        return JointState(joint, "unknown", words, (0, 0.0))
    if before is None or after is None:
        words = "an effect was added here" if named else "the noise is unknown"
        return JointState(joint, "unknown", words, (named, joint.error_before))
    # By the measure of the verdict: else a page would contradict itself.
    beyond, open_still = diagnosis.criteria.verdict.within_noise, diagnosis.verdict == "unexplained"
    if after > beyond and open_still:
        words = f"what is left is {number(after, 2)} times the noise"
        return JointState(joint, "failing", words, (2, after))
    if diagnosis.steps and (named or before > beyond):
        words = f"from {number(before, 2)} times the noise down to it"
        return JointState(joint, "repaired", words, (1, before))
    # Where the verdict is that nothing is missing, a large ratio is one of few samples.
    words = "nothing beyond the noise shows on held-out data" if open_still else _NOISE_ALONE
    return JointState(joint, "fine", words, (0, before))


def joint_errors(diagnosis: Diagnosis) -> go.Figure:
    """Torque error of each joint, as given and with the effects added, over the noise floor."""
    joints = diagnosis.joints
    rows = list(range(len(joints)))
    figure = go.Figure()
    if any(joint.noise_share is not None for joint in joints):
        figure.add_trace(
            go.Bar(
                orientation="h",
                y=rows,
                x=[None if j.noise_share is None else 100 * j.noise_share for j in joints],
                width=0.7,
                name="noise",
                marker={"color": "rgba(128,128,128,0.4)"},
                hovertemplate="noise %{x:.3f} %<extra></extra>",
            )
        )
    drawn = [(GIVEN, [100 * j.error_before for j in joints], BEFORE_COLOUR, "circle-open")]
    if diagnosis.steps:
        after = [100 * j.error_after for j in joints]
        drawn.append((after_name(diagnosis), after, AFTER_COLOUR, "diamond"))
        for row, start, stop in zip(rows, drawn[0][1], after, strict=True):
            way = {"color": GREY, "width": 1, "dash": "dot"}
            figure.add_shape(
                type="line", x0=start, x1=stop, y0=row, y1=row, line=way, layer="below"
            )
    for name, errors, colour, symbol in drawn:
        figure.add_trace(
            go.Scatter(
                x=errors,
                y=rows,
                mode="markers",
                name=plain(name),
                marker=mark(colour, symbol),
                hovertemplate="%{x:.3f} %<extra></extra>",
                showlegend=True,
            )
        )
    figure.update_xaxes(title="held-out torque error (%)", rangemode="tozero", fixedrange=True)
    figure.update_yaxes(
        tickvals=rows,
        ticktext=[plain(joint.name) for joint in joints],
        range=[len(rows) - 0.4, -0.6],
        automargin=True,
        fixedrange=True,
        showgrid=False,
        zeroline=False,
        ticklabelstandoff=6,
    )
    # The page has one legend for this picture and for the maps.
    return dressed(figure, 76 + 34 * len(rows)).update_layout(showlegend=False)
