import hashlib
import json
import platform
import re
import shlex
from dataclasses import replace
from datetime import datetime
from html import escape, unescape

import numpy as np
import pytest

from dynident.diagnosis.dependence.explained_shares import ExplainedShares, Share
from dynident.diagnosis.dependence.residual_dependence import JointDependence
from dynident.diagnosis.details import Candidate, Step
from dynident.diagnosis.effect_groups import hidden_effects
from dynident.diagnosis.result import Diagnosis
from dynident.errors import DynidentError
from dynident.reporting import report
from dynident.reporting.headline import headline
from dynident.reporting.html import page
from dynident.reporting.intervals import parameter_table
from dynident.reporting.next_steps import THIS_REPORT, next_steps
from dynident.tables import percent
from reporting.fabricated import diagnosis, effect
from reporting.read_page import Elements, unpacked


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return diagnosis()


@pytest.fixture(scope="module")
def html(found) -> str:
    return page(found, command="dynident explain study.toml")


def test_nothing_is_loaded_from_elsewhere(html):
    for tag, attributes in Elements(html).elements:
        assert tag not in ("link", "iframe", "base", "object", "embed")
        assert attributes.get("href", "#").startswith("#")  # within the page
        for key in ("src", "srcset", "data", "action", "poster"):
            assert key not in attributes, (tag, attributes)
    style = html.split("<style>")[1].split("</style>")[0]
    assert "url(" not in style and "@import" not in style
    assert "default-src 'none'" in html


def test_plotly_is_inlined_once_and_the_file_is_small(found, tmp_path):
    path = report(found, tmp_path / "report.html")
    assert path == tmp_path / "report.html"
    assert path.stat().st_size < 3e6
    (library,) = re.findall(r'id="library">([^<]*)<', path.read_text(encoding="utf-8"))
    assert unpacked(library).count("* plotly.js v") == 1


@pytest.mark.slow
def test_seven_joints_and_long_traces_stay_small():
    many = diagnosis(tuple(f"joint{i}" for i in range(7)), samples=1500)
    again = [replace(t, recording=f"{k}-{t.recording}") for k in range(3) for t in many.traces]
    assert len(page(replace(many, traces=tuple(again)))) < 3e6


def test_it_goes_from_the_verdict_to_the_provenance(found, html):
    headings = re.findall(r"<h2.*?>(.*?)</h2>", html)
    assert headings[:2] == ["How far the model is off", "What to do next"]
    assert headings[2:4] == ["Switch effects on and off", "The joints"]
    assert headings[-4:] == ["Parameters", "How sure this is", "Glossary", "Provenance"]
    text = Elements(html).text
    assert text.index(headline(found).sentence) < text.index("What to do next")
    assert text.index("How sure this is") < text.index(found.sentence)


def test_windows_of_one_recording_are_told_apart(found):
    """Several windows of a file are drawn under its name; what is chosen has to be told."""
    later = [replace(trace, t=trace.t + 100.0) for trace in found.traces]
    html = page(replace(found, traces=(*found.traces, *later)))
    chosen = re.findall(r"<option value=\"torque-[^>]*>([^<]*)<", html)
    assert len(set(chosen)) == len(chosen) == 2 * len(found.traces)


def test_what_is_left_is_a_sentence_or_two_beside_the_verdict_and_its_table_is_folded(found):
    part = {"position and velocity": Share(0.3, 0.05, 2.5)}
    shares = ExplainedShares(by=part, rest=Share(0.7, 0.05, 2.5), units=20)
    left = JointDependence(joint="elbow", whole="systematic", shares=shares)
    html = page(replace(found, verdict="unexplained", residual_dependence=(left,)))
    between = html[html.index('<h2 id="left"') : html.index('<h2 id="next"')]
    said, _, folded = between.partition("<details>")
    assert left.sentence in said and "<table>" not in said and "<table>" in folded


def test_a_report_does_not_tell_its_reader_to_write_it(found):
    unexplained = replace(found, verdict="unexplained")
    assert any(THIS_REPORT in one.commands for one in next_steps(unexplained))
    html = page(unexplained)
    assert "Look at the pictures of" in html and "--report report.html" not in html


def test_every_link_has_its_place_and_every_place_is_one(html):
    parsed = Elements(html)
    places = [a["id"] for _, a in parsed.elements if "id" in a]
    links = [a["href"][1:] for tag, a in parsed.elements if tag == "a"]
    assert len(links) > 10 and set(links) <= set(places)
    assert len(set(places)) == len(places)


def test_a_rejected_model_has_wider_intervals_and_says_so(found):
    joints = tuple(replace(joint, ratio_after=2.0) for joint in found.joints)
    rejected = replace(found, verdict="unexplained", joints=joints)
    text = Elements(page(rejected)).text
    assert "Birge ratio" in text and "elbow 2.24" in text  # root of 1 + 2^2
    assert "Look at the pictures of shoulder and elbow in the report" in text
    assert "what is left is 2 times the noise" in text


def test_it_says_what_the_diagnosis_says(found, html):
    text = Elements(html).text
    assert found.sentence in text
    for note in found.notes:
        assert note in text
    for step in found.steps:
        assert step.effect.title in text and step.effect.label in text
        for other in step.indistinguishable:
            assert other.title in text
    for one in found.maps:
        if one.sentence:
            assert one.sentence[1:] in text
    not_identifiable = [c for c in found.candidates if c.status == "absorbed"]
    assert not_identifiable
    for one in hidden_effects(not_identifiable, len(found.joints)):
        assert one.title in text and one.remark in text


def test_numbers_are_those_of_the_diagnosis(found, html):
    text = Elements(html).text
    for error in (found.test_error.before, found.test_error.after, found.test_error.noise_floor):
        assert percent(error) in text
    for joint in found.joints:
        assert percent(joint.error_before) in text and percent(joint.error_after) in text
        assert joint.noise_rms is not None
        assert percent(joint.noise_rms / joint.torque_rms) in text
    step = found.steps[0]
    assert f"Fs = {step.values[0]:.4g} N m" in text and "vs = 0.16 rad/s" in text
    for candidate in found.candidates:
        if candidate.status != "absorbed":
            assert f"{100 * candidate.test_gain:.2f}" in text
    for name, *_, stands_for in found.after.parameter_table().rows:
        assert name in text and stands_for in text
    values = {name: x for name, x in zip(found.after.names, found.after.values, strict=True)}
    shown = {row[0]: row[2] for row in parameter_table(found.after, None, "replicates").rows}
    assert all(cell in text for cell in shown.values())
    # An effect's parameter stands for itself: its value is the estimate's, as far as it is known.
    assert float(shown["Fs@elbow"]) == pytest.approx(values["Fs@elbow"], rel=0.05)


def test_provenance(found, html):
    text = Elements(html).text
    source = found.after.sources[0]
    wanted = (source.file, source.sha256, source.filter, "arms/bench.urdf", "casadi", "drake")
    for word in (*wanted, platform.python_version(), str(datetime.now().year)):
        assert word in text
    assert np.__version__ in text
    # Advice names commands, too: the one that made the page stands where it is said how.
    told, untold = (one.rpartition("Provenance")[2] for one in (text, Elements(page(found)).text))
    assert "dynident explain study.toml" in told and "casadi" in untold
    assert "dynident explain" not in untold


def test_the_study_is_named_with_its_hash(found, tmp_path):
    study = tmp_path / "study.toml"
    study.write_text('robot = "arm.urdf"')
    text = Elements(page(found, study=study)).text
    assert hashlib.sha256(study.read_bytes()).hexdigest() in text


def test_commands_name_the_study_where_it_is_known(found, html):
    path = "studies/<i>my arm</i>.toml"
    commands = re.findall("<code>(dynident .*?)</code>", page(found, study=path))
    assert commands and all("STUDY" not in one and "<i>" not in one for one in commands)
    assert unescape(commands[0]).startswith(f"dynident add {shlex.quote(path)} ")
    assert "<code>dynident add STUDY" in html


def test_every_plot_has_its_figure(found, html):
    parsed = Elements(html)
    figures = json.loads(parsed.figures)
    wanted = [a["data-figure"] for _, a in parsed.elements if "data-figure" in a]
    wanted += [a["value"] for t, a in parsed.elements if t == "option" and "torque" in a["value"]]
    assert set(wanted) == set(figures)
    assert len(figures) == 4 + len(found.maps) + len(found.traces)


def test_hostile_names_are_text():
    names = ("<script>alert(1)</script>", '"$x$" </script><img src=x onerror=alert(2)>')
    bad = diagnosis(names)
    bad = replace(bad, notes=("<b onclick=alert(3)>note</b>",))
    html = page(bad, command="dynident </script><script>alert(4)</script>")
    parsed = Elements(html)
    assert {tag for tag, _ in parsed.elements}.isdisjoint({"img", "b"})
    assert sum(tag == "script" for tag, _ in parsed.elements) == 5
    assert not any(key.startswith("on") for _, a in parsed.elements for key in a)
    for name in names:
        assert name in parsed.text
    figures = parsed.figures
    labels = json.loads(figures)["waterfall"]["layout"]["yaxis"]["ticktext"]
    assert "<img" not in labels[1] and "$" not in labels[1]
    assert names[1] in unescape(labels[1])


@pytest.mark.parametrize("noise", [True, False], ids=["noise known", "noise unknown"])
@pytest.mark.parametrize("steps", [True, False], ids=["something added", "nothing added"])
@pytest.mark.parametrize("joints", [("slide",), ("shoulder", "elbow")], ids=["one", "two"])
@pytest.mark.slow
def test_every_kind_of_diagnosis(joints, steps, noise):
    found = diagnosis(joints, steps=steps, noise=noise, samples=200)
    bare = replace(found, candidates=(), remaining=(), maps=(), traces=(), notes=())
    for one in (found, bare, replace(found, verdict="unexplained")):
        html = page(one)
        assert escape(one.sentence) in html
        assert ("unknown" in Elements(html).text) == (not noise)
        json.loads(Elements(html).figures)


def test_absorbed_without_a_remark_names_its_experiment(found):
    hidden = effect("rotor_inertia", "shoulder")
    only = replace(
        found,
        candidates=(Candidate(effect=hidden, status="absorbed", p_value=None, test_gain=None),),
    )
    assert hidden.advice in Elements(page(only)).text


def test_several_steps_and_effects_of_the_whole_robot(found):
    whole = effect("payload")
    count = len(whole.parameters(found.after.model.robot))
    steps = (
        *found.steps,
        Step(
            effect=whole,
            values=(0.5,) * count,
            test_error_before=0.0095,
            test_error_after=0.0094,
            indistinguishable=(),
            p_value=1e-5,
        ),
    )
    text = Elements(page(replace(found, steps=steps))).text
    assert "payload" in text and "with 2 effects added" in text


def test_a_missing_folder_is_named_and_nothing_is_written(found, tmp_path):
    with pytest.raises(DynidentError, match="cannot be written"):
        report(found, tmp_path / "absent" / "report.html")
    assert list(tmp_path.iterdir()) == []


def test_an_old_report_is_replaced(found, tmp_path):
    path = tmp_path / "report.html"
    path.write_text("old")
    report(found, path)
    assert path.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert list(tmp_path.iterdir()) == [path]


def test_an_unknown_noise_is_no_tick():
    for noise, mark in ((True, "\u2713"), (False, "?")):
        text = Elements(page(diagnosis(("slide",), noise=noise, samples=200))).text
        assert text.split("What the model of bench arm lacks")[1].strip().startswith(mark)


def test_the_first_choice_is_printed_and_contacts_are_said_to_be_left_out(found, html):
    assert "contacts are left out in every choice" not in html
    first, *others = found.switches.choices
    choices = (replace(first, error=0.4321), *others)
    pushed = effect("contact", found.joints[0].name)
    robot = found.after.model.robot
    values = (1.0,) * len(pushed.parameters(robot))
    shape = (1.0,) * len(pushed.shape_parameters(robot))
    pushed = replace(pushed, shape=shape)
    contact = replace(found.steps[0], effect=pushed, values=values)
    with_contact = replace(
        found, switches=replace(found.switches, choices=choices), steps=(contact, *found.steps[1:])
    )
    text = page(with_contact)
    assert f'<output id="switched-error">{percent(0.4321)}</output>' in text
    assert "contacts are left out in every choice" in text
