"""What stands on the page, and where: names of its parts, and the parts that change whole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import dash_bootstrap_components as dbc
from dash import dcc, html

from dynident.diagnosis.dependence.residual_dependence import dependence_sentences
from dynident.explorer.effect_choices import EffectChoice, Group
from dynident.explorer.next_recording import next_recording
from dynident.explorer.opened_study import OpenedStudy
from dynident.explorer.page_figures import MAP_HEIGHT, TORQUE_HEIGHT, bars_height, waiting
from dynident.explorer.tab_state import TabState
from dynident.reporting.content import recording_titles
from dynident.tables import Table

SWITCH = "switch"
EVERY = 700
"""ms between questions how far the diagnosis is."""

# What is recorded stays here: no button that uploads a picture.
_STILL: Any = {
    "displaylogo": False,
    "responsive": True,
    "displayModeBar": False,
    "showSendToCloud": False,
}
_ZOOMED: Any = {
    **_STILL,
    "displayModeBar": True,
    "modeBarButtonsToRemove": ["select2d", "lasso2d", "toImage", "pan2d"],
}
_CHOSEN_BY = (
    "Choosing effects by this error makes it too small: judge the model that you choose by new "
    "recordings."
)
_ASKED = "Asked by a flexible regression, on blocks of time that it was not fitted to:"
_HEADS: dict[Group, str] = {
    "added": "Missing, says the diagnosis",
    "proposed": "Laws proposed for what the catalogue leaves",
    "passing": "Significant and relevant alone, but not added beside those above",
    "others": "Other effects, not significant or not relevant",
}


def whole_page(opened: OpenedStudy, state: TabState, motions: str) -> html.Main:
    """Return the page of a study as it is when a tab is opened.

    Parameters
    ----------
    opened : the study.
    state : of the new tab.
    motions : token under which the motions of designed recordings lie.
    """
    what_to_do = (
        "Switch on what is missing, watch the error on held-out data fall, and write it into the "
        "study."
    )
    return html.Main(
        [
            dcc.Store(id="tab", data=state.to_dict()),
            dcc.Interval(id="tick", interval=EVERY),
            html.Header([html.H1(str(opened.study.path.name)), html.P(what_to_do)]),
            html.P(id="fault", role="alert"),
            html.Div(id="search", role="status", className="card verdict"),
            html.Div([html.Div([_missing(), _values()]), _errors(opened)], className="pair"),
            html.Div(next_recording(opened, motions), id="next"),
            _where_it_fails(opened),
        ]
    )


def _missing() -> html.Section:
    write = html.Button("Nothing to write", id="write", disabled=True)
    return html.Section(
        [
            html.H2("What is missing"),
            html.Div(id="choices"),
            html.Div(write, className="writing"),
            html.P(id="written", role="alert"),
        ],
        className="card",
    )


def _values() -> html.Section:
    return html.Section(
        [
            html.H2("Values of what is switched on"),
            html.P(id="working", role="status", className="quiet"),
            html.Div(id="values"),
        ],
        className="card",
    )


def _errors(opened: OpenedStudy) -> html.Section:
    return html.Section(
        [
            html.H2("Error on held-out data"),
            html.P(id="said", role="status", className="said"),
            _picture("errors", bars_height(len(opened.study.robot.names)), _STILL),
            html.P(_CHOSEN_BY, className="quiet"),
            html.P(id="fitted-by", className="quiet"),
        ],
        className="card falling",
    )


def _picture(name: str, height: int, config: Any) -> dcc.Graph:
    # Its place is as high as the picture, also while a phone is turned and it is drawn anew.
    style = {"minHeight": f"{height}px"}
    return dcc.Graph(id=name, figure=waiting(), config=config, style=style)


def _where_it_fails(opened: OpenedStudy) -> html.Section:
    joints = [(name, place) for place, name in enumerate(opened.study.robot.names)]
    torque = html.Div(
        [
            html.H3("Measured and predicted torque"),
            html.P(id="held", className="quiet"),
            _picture("torque", TORQUE_HEIGHT, _ZOOMED),
        ]
    )
    residual = html.Div(
        [
            html.H3("Mean residual against"),
            _choice("against", "", []),
            html.P(id="seen", className="quiet"),
            _picture("map", MAP_HEIGHT, _STILL),
        ]
    )
    return html.Section(
        [
            html.H2("Where the model fails"),
            html.Div([_choice("joint", "Joint", joints), _recordings(opened)], className="chosen"),
            html.Div([torque, residual], className="pair"),
        ],
        className="card",
    )


def _choice(name: str, title: str, options: list[tuple[str, Any]]) -> html.Fieldset:
    """Radio buttons under a title; the first is chosen."""
    return html.Fieldset(
        [
            html.Legend(title or name, className="" if title else "unseen"),
            dbc.RadioItems(
                id=name,
                options=[{"label": label, "value": value} for label, value in options],
                value=options[0][1] if options else None,
                inline=True,
            ),
        ]
    )


def _recordings(opened: OpenedStudy) -> html.Div:
    """The recordings by number: those to judge by first, and marked."""
    named = recordings_of(opened)
    return html.Div(
        [
            html.Label("Recording", htmlFor="recording"),
            dbc.Select(
                id="recording",
                options=[{"label": words, "value": str(i)} for i, words in enumerate(named)],
                value="0",
            ),
        ],
        className="recording",
    )


def recordings_of(opened: OpenedStudy) -> tuple[str, ...]:
    """Return the names of the recordings, in the order of the page, with what each is for."""
    fit, tested = opened.given.fit(), len(opened.study.test) > 0
    runs = (*fit.judged.runs, *(fit.fitted.runs if tested else ()))
    found = []
    for place, title in enumerate(recording_titles([(run.name, run.t) for run in runs])):
        use = "fitted" if place >= len(fit.judged.runs) else "held out"
        found.append(f"{title} ({use if tested else 'held out block by block'})")
    return tuple(found)


def switches(choices: Sequence[EffectChoice], state: TabState) -> list[Any]:
    """Return the effects in their groups, each with its switch.

    Parameters
    ----------
    choices : in their order.
    state : which are on, and which are written and stay on.
    """
    found: list[Any] = []
    for group, head in _HEADS.items():
        rows = [
            _switch(place, one, state) for place, one in enumerate(choices) if one.group == group
        ]
        if not rows:
            continue
        if group in ("added", "proposed"):
            found += [html.H3(head), *rows]
        else:
            found.append(html.Details([html.Summary(f"{head} ({len(rows)})"), *rows]))
    if not any(one.group == "added" for one in choices):
        found.insert(0, html.P("The diagnosis adds nothing to this model."))
    return found


def _switch(place: int, one: EffectChoice, state: TabState) -> html.Div:
    written = one.label in state.written
    title = one.effect.title[:1].upper() + one.effect.title[1:]
    name = f"{title}, in the study now" if written else title
    disabled = written or bool(one.refusal)
    options: Any = [{"label": name, "value": one.label, "disabled": disabled}]
    meaning = type(one.effect).meaning
    return html.Div(
        [
            dbc.Checklist(
                id={"type": SWITCH, "place": place},
                options=options,
                value=[one.label] if one.label in state.on else [],
                className="switch",
            ),
            html.P(meaning[:1].upper() + meaning[1:] + "." if meaning else "", className="quiet"),
            html.P(one.refusal or one.words, className="quiet"),
        ],
        className="effect",
    )


def table(content: Table) -> html.Div:
    """Return a table with its notes."""
    head = html.Tr([html.Th(name, scope="col") for name in content.columns])
    rows = [
        html.Tr([html.Th(row[0], scope="row"), *(html.Td(cell) for cell in row[1:])])
        for row in content.rows
    ]
    # Where it is wider than the screen, it is scrolled by keys, too.
    named: dict[str, Any] = {"tabIndex": 0, "role": "region", "aria-label": content.title}
    return html.Div(
        [
            html.Div(html.Table([html.Thead(head), html.Tbody(rows)]), className="wide", **named),
            *(html.P(note, className="quiet") for note in content.notes),
        ]
    )


def verdict(opened: OpenedStudy) -> list[Any]:
    """Return what the diagnosis says, or what it is doing."""
    search, found = opened.search, opened.diagnosis
    if found is None and search.is_running:
        return [html.Progress(), html.Span(f"Looking for what is missing: {search.doing}")]
    if found is None:
        return [html.P(f"No diagnosis: {search.failure}")]
    more = [html.P(one) for one in found.caveats]
    asked = [html.P(one) for one in dependence_sentences(found.residual_dependence)]
    return [
        html.P("The diagnosis of the study:", className="quiet"),
        html.P(found.sentence, className="sentence"),
        *([html.P(_ASKED, className="quiet"), *asked] if asked else []),
        *([html.Details([html.Summary("How far this can be trusted"), *more])] if more else []),
    ]


def fitted_by(opened: OpenedStudy) -> str:
    """Say how the page fits, and why the figures of the diagnosis differ."""
    found = opened.search.diagnosis
    if not len(opened.study.test):
        return "Blocks of time are held out, each predicted by the fit to all others."
    said = "Here models are fitted by least squares, weighted per joint, as dynident fit does."
    if found is None:
        return said
    return (
        f"{said} The diagnosis ({found.fitted_by}) may leave out rows, too: its figures differ "
        "a little."
    )
