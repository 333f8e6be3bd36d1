"""The page: a Dash application whose callbacks ask `page_answers` and fill `page_parts`."""

from __future__ import annotations

from typing import Any

from dash import ALL, Dash, Input, Output, State, ctx, html, no_update, set_props
from dash.exceptions import PreventUpdate
from flask import Flask

from dynident.errors import DynidentError, StudyError
from dynident.explorer.next_recording import next_recording
from dynident.explorer.opened_study import OpenedStudy, StudyVersions
from dynident.explorer.page_answers import Contrast, map_answer, value_table
from dynident.explorer.page_figures import error_bars, zoomed
from dynident.explorer.page_parts import (
    SWITCH,
    fitted_by,
    recordings_of,
    switches,
    table,
    verdict,
    whole_page,
)
from dynident.explorer.tab_state import TabState

_WORKING = "Working out the intervals ..."


def page(server: Flask, token: str, versions: StudyVersions, motions: str) -> Dash:
    """Put the page of a study on a server.

    Parameters
    ----------
    server : that asks for the token.
    token : under which every path of the page lies.
    versions : the study.
    motions : token under which the motions of its designed recordings lie.

    Returns
    -------
    The application; it brings all its scripts and styles along.
    """
    app = Dash(
        __name__,
        server=server,  # type: ignore[arg-type]  # a Flask application, as its words say
        url_base_pathname=f"/{token}/",
        assets_folder="assets",
        serve_locally=True,
        title=f"{versions.path.name} - dynident",
        update_title="",
        add_log_handler=False,
        on_error=_told,
    )

    def layout() -> Any:
        """A tab of its own whenever the page is loaded; the study as it is by then."""
        try:
            opened = versions.latest()
        except DynidentError as error:
            return html.Main(html.P(f"The study cannot be read: {error}", role="alert"))
        return whole_page(opened, TabState.of(opened.digest), motions)

    # Screen readers choose their voice by the language, which Dash does not say.
    app.index_string = app.index_string.replace("<html>", '<html lang="en">')
    app.layout = layout
    app.validation_layout = layout()
    _Callbacks(app, versions, motions).register()
    return app


def _told(error: Exception) -> None:
    """Say on the page what no callback has an answer to."""
    said = str(error)
    if not isinstance(error, DynidentError):
        said = f"Unexpected {type(error).__name__}: {error}. Please report it with the study."
    set_props("fault", {"children": said})
    set_props("working", {"children": ""})


class _Callbacks:
    """What happens on the page; each method is one callback."""

    def __init__(self, app: Dash, versions: StudyVersions, motions: str) -> None:
        self._app, self._versions, self._motions = app, versions, motions

    def register(self) -> None:
        on, tab = self._app.callback, State("tab", "data")
        ticks, switched = (
            Input("tick", "n_intervals"),
            Input({"type": SWITCH, "place": ALL}, "value"),
        )
        changed = Input("tab", "data")
        on(
            Output("search", "children"),
            Output("choices", "children"),
            Output("tick", "disabled"),
            Output("joint", "value"),
            Output("fitted-by", "children"),
            Output("next", "children"),
            ticks,
            tab,
        )(self.searched)
        on(Output("tab", "data"), switched, tab, prevent_initial_call=True)(self.switched)
        on(
            Output("errors", "figure"),
            Output("said", "children"),
            Output("write", "children"),
            Output("write", "disabled"),
            changed,
            Input("tick", "disabled"),
        )(self.judged)
        on(
            Output("torque", "figure"),
            Output("held", "children"),
            Output("torque", "relayoutData"),
            changed,
            Input("joint", "value"),
            Input("recording", "value"),
            Input("tick", "disabled"),
            State("torque", "relayoutData"),
        )(self.drawn)
        on(
            Output("against", "options"),
            Output("against", "value"),
            Output("seen", "children"),
            Output("map", "figure"),
            changed,
            Input("joint", "value"),
            Input("against", "value"),
            Input("tick", "disabled"),
        )(self.mapped)
        on(
            Output("values", "children"),
            Output("working", "children"),
            Input("errors", "figure"),
            tab,
        )(self.valued)
        on(
            Output("written", "children"),
            Output("tab", "data", allow_duplicate=True),
            Output("choices", "children", allow_duplicate=True),
            Input("write", "n_clicks"),
            tab,
            prevent_initial_call=True,
        )(self.written)

    def searched(self, ticks: int | None, tab: object) -> tuple[Any, ...]:
        """How far the diagnosis is; what it offers once it is done."""
        opened, state = self._of(tab)
        if opened.search.is_running:
            return verdict(opened), no_update, False, no_update, fitted_by(opened), no_update
        worst = Contrast.of(opened, TabState.of(opened.digest)).worst_joint
        offered, words = switches(opened.choices, state), fitted_by(opened)
        following = next_recording(opened, self._motions)
        return verdict(opened), offered, True, worst, words, following

    def switched(self, values: list[list[str] | None], tab: object) -> dict[str, Any]:
        """Which effects are on."""
        opened, state = self._of(tab)
        offered = {one.label for one in opened.choices}
        wanted = [label for value in values for label in value or () if label in offered]
        changed = state.switched(wanted)
        if changed == state:
            raise PreventUpdate
        return changed.to_dict()

    def judged(self, tab: object, _: object) -> tuple[Any, ...]:
        """The errors, in the picture and in words, and what there is to write."""
        opened, state = self._of(tab)
        try:
            found = Contrast.of(opened, state)
        except DynidentError as error:
            return no_update, f"This cannot be fitted: {error}", "Nothing to write", True
        # Until the values of this choice are there; those of one that it has replaced end nothing.
        set_props("working", {"children": _WORKING if opened.chosen(state.on) else ""})
        many = len(state.fresh)
        name = opened.study.path.name
        words = f"Write {many} effect{'s' * (many > 1)} into {name}" if many else "Nothing to write"
        return error_bars(found.before, found.now), found.sentence, words, not many

    def drawn(
        self, tab: object, joint: int, recording: str, _: object, zoom: object
    ) -> tuple[Any, str, Any]:
        """A recording at a joint; after a switch it is still zoomed."""
        opened, found = self._contrast(tab)
        named, robot = recordings_of(opened), opened.study.robot
        if not (_is_place(joint, robot.n) and recording in map(str, range(len(named)))):
            raise PreventUpdate
        place = int(recording)
        zoom = zoom if ctx.triggered_id == "tab" else None
        figure = zoomed(found.torque(place, joint), zoom)
        return figure, f"{robot.names[joint]}, {named[place]}", zoom

    def mapped(self, tab: object, joint: int, against: str | None, _: object) -> tuple[Any, ...]:
        """A residual map of a joint; of another joint the one that shows most."""
        opened, found = self._contrast(tab)
        robot = opened.study.robot
        if not _is_place(joint, robot.n):
            raise PreventUpdate
        if "joint" in ctx.triggered_prop_ids.values():  # beside others, where they come at once
            against = None
        names, against, words, figure = map_answer(found.maps, robot.names[joint], against)
        return names, against, [html.Span([one, html.Br()]) for one in words], figure

    def valued(self, _: object, tab: object) -> tuple[Any, str]:
        """The values of what is switched on, with intervals: they take longer than the errors."""
        opened, state = self._of(tab)
        chosen = opened.chosen(state.on)
        if not chosen:
            return html.P("Switch on an effect to see its values.", className="quiet"), ""
        try:
            estimate = opened.refitter.with_intervals([one.effect for one in chosen])
            impossible = opened.refitter.impossible(estimate)
        except DynidentError as error:
            return html.P(f"No values: {error}"), ""
        return table(value_table(estimate, [one.label for one in chosen], impossible)), ""

    def written(self, clicks: int | None, tab: object) -> tuple[Any, Any, Any]:
        """Write what is switched on into the study."""
        opened, state = self._of(tab)
        chosen = opened.chosen(state.fresh)
        if not clicks or not chosen:
            raise PreventUpdate
        labels = [one.label for one in chosen]
        try:
            digest = self._versions.write(chosen, state.file, state.name)
        except DynidentError as error:
            return [f"Not written: {error}. ", *_reload()], no_update, no_update
        after = state.after_write(labels, digest)
        said = f"Written into {opened.study.path.name}: {', '.join(labels)}. "
        return [said, *_reload()], after.to_dict(), switches(opened.choices, after)

    def _of(self, tab: object) -> tuple[OpenedStudy, TabState]:
        state = TabState.read(tab)
        opened = self._versions.of(state.opened)
        if opened is None:
            what = "has changed often since this tab was opened"
            raise StudyError(what, self._versions.path.name, "reload the page")
        return opened, state

    def _contrast(self, tab: object) -> tuple[OpenedStudy, Contrast]:
        opened, state = self._of(tab)
        try:
            return opened, Contrast.of(opened, state)
        except DynidentError:  # the errors say so
            raise PreventUpdate from None


def _reload() -> list[Any]:
    return [html.A("Reload the page", href=""), " to diagnose the study as it is now."]


def _is_place(sent: object, many: int) -> bool:
    return isinstance(sent, int) and 0 <= sent < many
