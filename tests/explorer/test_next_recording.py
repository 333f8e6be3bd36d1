"""Designed recordings on the page: what they settle, and motions in an origin of their own."""

from __future__ import annotations

import base64
import json
import os
import re
from collections.abc import Iterator
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
import tomlkit

import dynident as di
from dynident.diagnosis import Diagnosis
from dynident.experiment_design.written_design import DESIGN, DesignFile
from dynident.explorer import explore
from dynident.explorer.local_access import ADDRESS
from dynident.explorer.local_server import LocalServer
from study_files import STUDY, listing, write_study

SENTENCE = "16 s of this tell <b>one</b> from another by 8 standard deviations."


@pytest.fixture(scope="module")
def diagnosis(tmp_path_factory) -> Diagnosis:
    study = di.load(write_study(tmp_path_factory.mktemp("diagnosed")))
    return di.diagnose(study.model, study.train, study.test)


@pytest.fixture
def server(tmp_path, diagnosis) -> Iterator[LocalServer]:
    found = explore(di.load(write_study(tmp_path)), diagnosis)
    yield found
    found.stop()


def write_design(folder: Path, study: str, motion: str = "<p>moves</p>", **changed: object) -> None:
    """A motion of the arm of the tests, beside the study."""
    told = DesignFile(
        sentence=SENTENCE,
        study=study,
        motion=sha256(motion.encode()).hexdigest(),
        repeat=2,
        duration=8.0,
        joints=["shoulder", "elbow"],
        centre=[0.5, -0.25],
        sine=[[0.0, 1.0], [0.0, 0.0]],
        cosine=[[0.0, 0.0], [0.0, 0.0]],
    )
    folder.mkdir(exist_ok=True)
    (folder / DESIGN).write_text(tomlkit.dumps({**told.model_dump(), **changed}))
    (folder / "motion.html").write_text(motion)


def asked(server: LocalServer, path: str, **headers: str):
    home = {"Host": f"{ADDRESS}:{server.port}"}
    return server.flask.test_client().get(path, headers={**home, **headers})


def shown(server: LocalServer) -> str:
    """What the page has of recordings to make, as JSON."""
    layout = json.loads(asked(server, f"/{server.token}/_dash-layout").get_data(as_text=True))
    parts = layout["props"]["children"]
    (found,) = [one for one in parts if one["props"].get("id") == "next"]
    return json.dumps(found)


@pytest.mark.slow
def test_a_design_is_shown_with_its_motion_and_what_it_settles(server, tmp_path):
    assert SENTENCE not in shown(server)
    write_design(tmp_path / "next", server.versions.latest().digest)
    text = shown(server)
    assert SENTENCE in text and "8 s from rest to rest, 2 times" in text
    assert "has changed since" not in text and f'"/{server.motions}/next"' in text
    # q(t) = 0.5 + sin(2 * 2 pi t / 8) at the shoulder, -0.25 at the elbow, over one repetition.
    curves = json.loads(text)["props"]["children"][0]["props"]["children"][-1]["props"]["figure"]
    shoulder, elbow = ({k: np.array(_numbers(d[k])) for k in "xy"} for d in curves["data"])
    assert shoulder["x"][[0, -1]].tolist() == [0.0, 8.0]
    np.testing.assert_allclose(
        shoulder["y"], 0.5 + np.sin(np.pi * shoulder["x"] / 2), rtol=0, atol=1e-5
    )
    np.testing.assert_allclose(elbow["y"], -0.25, rtol=1e-5)


def _numbers(found) -> list[float]:
    if isinstance(found, list):
        return found
    return np.frombuffer(base64.b64decode(found["bdata"]), np.dtype(found["dtype"])).tolist()


@pytest.mark.slow
def test_what_it_says_may_be_old(server, tmp_path):
    write_design(tmp_path / "next", server.versions.latest().digest)
    (tmp_path / "study.toml").write_text(STUDY + "# another recording\n")
    assert "The study has changed since this was designed" in shown(server)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"joints": ["shoulder", "wrist"]}, "is the design of another robot"),
        ({"centre": [0.5]}, "has no motion"),
        ({"sine": [[0.0], [0.0, 1.0]]}, "has no motion"),
        ({"duration": 0.0}, "duration: input should be greater than 0"),
        ({"sentence": 3}, "sentence: input should be a valid string"),
        ({"centre": [float("nan"), 0.0]}, "centre.0: input should be a finite number"),
    ],
)
def test_what_is_no_design_of_this_robot_is_told(server, tmp_path, changed, said):
    write_design(tmp_path / "next", "", **changed)
    text = shown(server)
    assert said in text and "Graph" not in text


def test_only_motions_of_designs_are_served_and_in_a_sandbox(server, tmp_path):
    write_design(tmp_path / "next one", "")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "motion.html").write_text("no design")
    (tmp_path / "motion.html").write_text("beside the study")
    before = listing(tmp_path)
    home = f"/{server.motions}"
    answer = asked(server, f"{home}/next%20one")
    assert (answer.status_code, answer.get_data()) == (200, b"<p>moves</p>")
    policy = answer.headers["Content-Security-Policy"]
    assert policy.startswith("sandbox allow-scripts; default-src 'none';")
    assert "same-origin" not in policy and "'self'" not in policy and "http" not in policy
    for name in ("other", "..", "%2e%2e", ".", "next%20one%2fdesign.toml", "next one/../other"):
        told = asked(server, f"{home}/{name}")
        assert told.status_code in (403, 404), name
    assert asked(server, "/motion/next%20one").status_code == 403
    assert asked(server, f"{home}/next%20one", Host="evil.example").status_code == 403
    assert listing(tmp_path) == before


def test_a_motion_does_not_know_the_token_of_the_page(server, tmp_path):
    """Its scripts read their own address, and may go elsewhere with it."""
    write_design(tmp_path / "next", "")
    (address,) = re.findall(r'"href": "([^"]*)"', shown(server))
    assert asked(server, address).get_data() == b"<p>moves</p>"
    assert server.token not in address and server.motions != server.token
    for rest in ("", "/", "/alive", "/_dash-layout", "/_dash-dependencies", "/assets/page.css"):
        told = asked(server, f"/{server.motions}{rest}")
        assert told.status_code == 404 and server.token not in told.get_data(as_text=True), rest
    home = {"Host": f"{ADDRESS}:{server.port}"}
    path = f"/{server.motions}/_dash-update-component"
    assert server.flask.test_client().post(path, headers=home, json={}).status_code in (404, 405)


def test_a_motion_of_another_design_is_neither_linked_nor_served(server, tmp_path):
    write_design(tmp_path / "next", "")
    (tmp_path / "next" / "motion.html").write_text("<p>moves otherwise</p>")
    text = shown(server)
    assert "is not the one that was written with this design" in text and "href" not in text
    assert asked(server, f"/{server.motions}/next").status_code == 404
    (tmp_path / "next" / "motion.html").unlink()
    text = shown(server)
    assert SENTENCE in text and "motion.html" not in text and "href" not in text


def test_a_folder_whose_name_is_no_text_hides_no_other(server, tmp_path):
    write_design(tmp_path / "next", "")
    odd = Path(os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9"))
    try:
        write_design(odd, "")
    except OSError:
        pytest.skip("the file system has names of UTF-8 alone")
    text = shown(server)
    assert "next/reference.csv" in text and "caf" not in text
    assert asked(server, f"/{server.motions}/caf%e9").status_code == 404


@pytest.mark.slow
def test_what_is_left_open_comes_with_the_command_that_designs(tmp_path, diagnosis):
    """Were drag as good as the friction that was found, a motion could tell them apart."""
    study = di.load(write_study(tmp_path))
    rival = di.effects_of("quadratic_drag@elbow", study.robot)
    (step,) = diagnosis.steps
    undecided = replace(diagnosis, steps=(replace(step, indistinguishable=rival),))
    decided = replace(diagnosis, steps=(replace(step, indistinguishable=()),))
    hidden = [one.effect for one in diagnosis.candidates if one.status == "absorbed"]
    server = explore(study, decided)
    assert ("cannot: " in shown(server)) == any(one.is_of_an_instant for one in hidden)
    server.stop()
    server = explore(study, undecided)
    text = shown(server)
    assert "tell apart" in text and "dynident explain study.toml --design next" in text
    write_design(tmp_path / "next", "")
    assert "--design" not in shown(server)
    server.stop()
