"""Who may see the page: whoever has its token, and calls this machine by its name."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from dataclasses import replace

import pytest
from flask.testing import FlaskClient

import dynident as di
from dynident.effect_modules import Permission
from dynident.errors import DynidentError
from dynident.explorer import explore
from dynident.explorer.local_access import ADDRESS
from dynident.explorer.local_server import LocalServer
from dynident.explorer.tab_state import TabState
from study_files import STUDY, edited, listing, write_study


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("study")


@pytest.fixture(scope="module")
def server(folder) -> Iterator[LocalServer]:
    study = di.load(write_study(folder))
    found = explore(study, di.diagnose(study.model, study.train, study.test))
    yield found
    found.stop()


@pytest.fixture
def home(server) -> dict[str, str]:
    return {"Host": f"{ADDRESS}:{server.port}"}


@pytest.fixture
def client(server) -> FlaskClient:
    return server.flask.test_client()


@pytest.mark.slow
def test_the_page_and_all_that_belongs_to_it_is_served_with_the_token(client, server, home):
    answer = client.get(f"/{server.token}/", headers=home)
    assert answer.status_code == 200
    text = answer.get_data(as_text=True)
    assert 'src="http' not in text and 'href="http' not in text  # all of it is local
    for path in ("_dash-layout", "_dash-dependencies", "alive", "assets/page.css"):
        with client.get(f"/{server.token}/{path}", headers=home) as found:
            assert found.status_code < 300


@pytest.mark.parametrize("token", ["", "wrong", "x" * 32, "%00", "\u00fc"])
@pytest.mark.parametrize("rest", ["", "/", "/_dash-layout", "/assets/page.css"])
def test_without_the_token_nothing_is_told(client, home, token, rest):
    assert client.get(f"/{token}{rest}", headers=home).status_code == 403
    assert client.post(f"/{token}{rest}", headers=home, json={}).status_code == 403


def test_a_part_of_the_token_is_no_token(client, server, home):
    assert client.get(f"/{server.token[:-1]}/", headers=home).status_code == 403
    assert client.get(f"/{server.token}x/", headers=home).status_code == 403


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "[::1]:80", ""])
def test_another_name_that_leads_here_is_refused(client, server, host):
    """DNS rebinding: the browser believes that it talks to a page elsewhere."""
    assert client.get(f"/{server.token}/", headers={"Host": host}).status_code == 403


def test_pages_elsewhere_cannot_ask(client, server, home):
    path = f"/{server.token}/_dash-update-component"
    for origin in ("https://evil.example", "null", f"http://{ADDRESS}:1"):
        answer = client.post(path, headers={**home, "Origin": origin}, json={})
        assert answer.status_code == 403


def test_the_address_goes_to_nobody_else(client, server, home):
    headers = client.get(f"/{server.token}/", headers=home).headers
    assert headers["Referrer-Policy"] == "no-referrer" and headers["Cache-Control"] == "no-store"
    policy = headers["Content-Security-Policy"]
    assert "default-src 'self'" in policy and "http" not in policy


def test_only_this_machine_is_listened_to(server):
    with socket.create_connection((ADDRESS, server.port), timeout=10) as link:
        assert link.getpeername()[0] == "127.0.0.1"
    other = "127.0.0.2"  # a loopback address, too: were it bound to all, it would answer
    with pytest.raises(OSError), socket.create_connection((other, server.port), timeout=10):
        pass


def test_a_notebook_shows_it_and_says_how_to_stop(server):
    shown = server._repr_html_()
    assert f'src="{server.url}"' in shown and ".stop()" in shown
    policy = server.flask.test_client().get(f"/{server.token}/").headers
    assert "frame-ancestors" not in policy["Content-Security-Policy"]


def test_alone_no_other_page_may_frame_it(server):
    alone = LocalServer(server.versions)
    answer = alone.flask.test_client().get("/")
    assert "frame-ancestors 'none'" in answer.headers["Content-Security-Policy"]
    assert alone.token != server.token and len(server.token) >= 32
    alone.stop()


def test_a_study_that_was_changed_since_is_not_explored(tmp_path):
    path = write_study(tmp_path)
    study = di.load(path)
    path.write_text(edited(('"viscous_friction"', '"coulomb_friction"')))
    for text in (path.read_text(), STUDY + "# somebody else was here\n"):
        path.write_text(text)
        with pytest.raises(DynidentError, match="has changed since it was loaded"):
            explore(study)
    # Nor is a model that the file does not have.
    path.write_text(STUDY)
    other = replace(study, model=study.model + "coulomb_friction@elbow")
    with pytest.raises(DynidentError, match="has other effects than the model"):
        explore(other)


@pytest.mark.slow
def test_what_a_study_may_run_it_may_when_it_is_read_again(tmp_path, monkeypatch):
    study, told = di.load(write_study(tmp_path), modules="run"), []

    def load(path, *, modules: Permission = "trusted"):
        told.append(modules)
        return di.load(path, modules=modules)

    monkeypatch.setattr("dynident.study.load", load)
    explore(study, di.diagnose(study.model, study.train, study.test)).stop()
    assert set(told) == {"run"}


def test_who_chooses_by_an_error_is_told_that_it_is_too_small(client, server, home):
    layout = client.get(f"/{server.token}/_dash-layout", headers=home).get_data(as_text=True)
    assert "Choosing effects by this error makes it too small" in layout


@pytest.mark.parametrize(
    "sent", [None, 3, [], {"on": "all"}, {"on": [1, None, {"a": 1}], "opened": 7}, {"written": {}}]
)
def test_whatever_a_tab_sends_is_a_state(sent):
    state = TabState.read(sent)
    assert all(isinstance(one, str) for one in (*state.on, *state.written, state.opened))
    assert TabState.read(state.to_dict()) == TabState.read(TabState.read(state.to_dict()).to_dict())


@pytest.mark.parametrize("what", ["tab.data", "write.n_clicks", "search.children", "nothing"])
def test_what_is_sent_by_hand_writes_nothing(client, server, home, folder, what):
    """Labels that nobody offered, versions that nobody opened, outputs that do not exist."""
    before = listing(folder)
    output, _, prop = what.partition(".")
    body = {
        "output": what,
        "outputs": {"id": output, "property": prop},
        "inputs": [{"id": "write", "property": "n_clicks", "value": 1}],
        "changedPropIds": ["write.n_clicks"],
        "state": [{"id": "tab", "property": "data", "value": {"on": ["payload"], "file": "x"}}],
    }
    client.post(f"/{server.token}/_dash-update-component", headers=home, json=body)
    assert listing(folder) == before
