"""Unusable input: one clear line, exit status 2, no traceback, and nothing is written."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from dynident.cli import main
from dynident.recording import write
from study_files import CONTROLLER, STUDY, csv_text, edited, listing, recording
from synthetic import ARM

TEST_ENTRY = STUDY[STUDY.index('[[recordings]]\nfile = "test.csv"') :]
NOISE = "\n[noise]\nposition_std = {}\ntorque_std = 0.05\n"
FILTER = "\n[filter]\n{}\n"


def refused(run, folder: Path, message: str, *arguments: str | Path) -> str:
    """Run the command and hold it to what unusable input must give; return the line."""
    before = listing(folder)
    done = run(*arguments)
    assert done.status == 2, done
    assert done.out == ""
    assert done.err.startswith("error: ") and done.err.count("\n") == 1, done.err
    assert "Traceback" not in done.err and len(done.err) < 700
    assert re.search(message, done.err), done.err
    assert listing(folder) == before
    return done.err


# --- studies ------------------------------------------------------------------------------------

STUDIES = {
    "not TOML": ("robot = [", r"study.toml: is not TOML"),
    "empty": ("", r"study.toml: key 'robot' is missing"),
    "unknown key": (edited(("effects", "efects")), r"unknown key 'efects'. did you mean 'effects'"),
    "unknown key of a recording": (
        edited(("period = 8.0", "priod = 8.0")),
        r"unknown key 'recordings.0.priod'. did you mean 'period'",
    ),
    "missing key": (
        edited(('robot = "arm.urdf"', "")),
        r"study.toml: key 'robot' is missing. add it",
    ),
    "missing file": (
        edited(('file = "test.csv"', "")),
        r"key 'recordings.1.file' is missing",
    ),
    "wrong type": (edited(('effects = ["viscous_friction"]', "effects = 3")), r"effects: .*list"),
    "wrong type inside": (
        edited(('file = "test.csv"', "file = 7")),
        r"recordings.1.file: .*string",
    ),
    "one recording": (
        edited((TEST_ENTRY, ""), ("[[recordings]]", "[recordings]")),
        r"recordings: .*list",
    ),
    "wrong choice": (edited(('use = "test"', 'use = "tests"')), r"recordings.1.use: .*'train'"),
    "wrong torque": (edited(('"measured"', '"commanded"')), r"torque: .*'held_command'"),
    "not finite": (edited(("period = 8.0", "period = inf")), r"recordings.0.period: .*finite"),
    "negative period": (edited(("period = 8.0", "period = -8.0")), r"period: .*greater than 0"),
    "unknown effect": (
        edited(('"viscous_friction"', '"viscuous_friction"')),
        r"study.toml: effects: no effect is named 'viscuous_friction'. did you mean 'viscous_frict",
    ),
    "misspelt joint of an effect": (
        edited(('"viscous_friction"', '"viscous_friction@elbo"')),
        r"effects: viscous_friction@elbo: the robot has no joint 'elbo'. .*elbow",
    ),
    "effect twice": (
        edited(('"viscous_friction"', '"viscous_friction", "viscous_friction@elbow"')),
        r"effects: viscous_friction@elbow: is in the model twice",
    ),
    "coupling without source": (
        edited(('"viscous_friction"', '"joint_coupling@elbow"')),
        r"needs source. write it joint_coupling@JOINT:SOURCE",
    ),
    "misspelt joint": (
        edited(('["shoulder", "elbow"]', '["shoulder", "elbov"]')),
        r"joints: .*no moving joint 'elbov'. .*did you mean 'elbow'",
    ),
    "joint twice": (
        edited(('["shoulder", "elbow"]', '["elbow", "elbow"]')),
        r"joints: .*'elbow' .*twice",
    ),
    "no joints": (edited(('["shoulder", "elbow"]', "[]")), r"joints: .*no joints"),
    "no recordings": (
        STUDY[: STUDY.index("[[")] + "recordings = []\n",
        r"study.toml: no \[\[recordings\]\]. add at least one",
    ),
    "no recording to train": (edited(('"train"', '"test"')), r"no recording is for training"),
    "period beyond the recording": (
        edited(("period = 8.0", "period = 30.0")),
        r"train.csv: .* no two periods of 30 s. record longer",
    ),
    "period that does not repeat": (
        edited(("period = 8.0", "period = 5.0")),
        r"train.csv: the positions do not repeat with the given period .*8?",
    ),
    "window outside": (
        edited(("period = 8.0\n\n", "window = [20.0, 30.0]\n\n")),
        r"train.csv: .*(20|30)",
    ),
    "window the wrong way": (
        edited(("period = 8.0\n\n", "window = [9.0, 3.0]\n\n")),
        r"window = \(9.0, 3.0\). .*earlier one first",
    ),
    "window of one number": (
        edited(("period = 8.0\n\n", "window = [9.0]\n\n")),
        r"recordings.0.window: too few values",
    ),
    "window too short": (
        edited(("period = 8.0\n\n", "window = [1.0, 1.1]\n\n")),
        r"train.csv: only \d rows",
    ),
    "negative cut-off": (STUDY + FILTER.format("cutoff_hz = -1"), r"filter.cutoff_hz: .*greater"),
    "cut-off beyond Nyquist": (
        STUDY + FILTER.format("position_cutoff_hz = 60"),
        r"train.csv: a cut-off of 60 Hz does not suit samples at 100 Hz. .*below 50 Hz",
    ),
    "cut-off beyond the rate": (
        STUDY + FILTER.format("cutoff_hz = 18\nrate_hz = 30"),
        r"study.toml: filter: cutoff_hz = 18 is not below half of rate_hz = 30",
    ),
    "rate too low": (
        STUDY + FILTER.format("cutoff_hz = 0.2\nrate_hz = 1"),
        r"train.csv: only \d+ rows are left",
    ),
    "edges too wide": (
        STUDY + FILTER.format("edge_s = [9, 9]"),
        r"train.csv: nothing is left of 16 s",
    ),
    "negative edge": (STUDY + FILTER.format("edge_s = [-1, 0]"), r"study.toml: filter: edge_s"),
    "noise of wrong length": (
        STUDY + NOISE.format([1e-5] * 3),
        r"noise.position_std: 3 values for 2 joints. give one per joint",
    ),
    "noise of zero": (STUDY + NOISE.format(0), r"noise.position_std: .*not positive"),
    "noise without torque": (
        STUDY + "\n[noise]\nposition_std = 1e-5\n",
        r"key 'noise.torque_std' is missing",
    ),
    "controller of no kind": (
        STUDY + edited(('"pd"', '"p"'), text=CONTROLLER),
        r"controller.kind: no controller of kind 'p'. kinds: pd, pid",
    ),
    "controller without gain": (
        STUDY + edited(("kd = [120.0, 50.0]\n", ""), text=CONTROLLER),
        r'study.toml: controller.kd: a "pd" controller needs kd. its gains are kp, kd',
    ),
    "controller of other joints": (
        STUDY + edited((", 1500.0", ""), (", 50.0", ""), text=CONTROLLER),
        r"controller.kp: 1 values for 2 joints",
    ),
    "controller of negative gain": (
        STUDY + edited(("120.0", "-120.0"), text=CONTROLLER),
        r"kd = \[-120.0, 50.0\]",
    ),
    "friction width": (
        "friction_width = 0\n" + STUDY,
        r"friction_width: .*greater than 0",
    ),
    "columns that are not ours": (
        STUDY + '\n[columns]\n"q.elbov" = "x"\n',
        r"column mapping names 'q.elbov', which is not ours.*did you mean 'q.elbow'",
    ),
    "columns that are not theirs": (
        STUDY + '\n[columns]\n"q.elbow" = "angle"\n',
        r"no column 'angle' \(for q.elbow\)",
    ),
    "column without quotes": (
        STUDY + '\n[columns]\nq.elbow = "angle"\n',
        r'study.toml: columns: a name with a dot needs quotes: "q.elbow" = ',
    ),
    "column of a wrong type": (
        STUDY + '\n[columns]\n"q.elbow" = 3\n',
        r"study.toml: columns.q.elbow: input should be a valid string",
    ),
    "noise of a wrong type": (
        STUDY + NOISE.format('"small"'),
        r"study.toml: noise.position_std: input should be a valid number",
    ),
    "column of scale zero": (
        STUDY + '\n[columns]\n"q.elbow" = { name = "q.elbow", scale = 0 }\n',
        r"study.toml: columns: scale = 0.0 of 'q.elbow'",
    ),
    "no robot": (
        edited(('"arm.urdf"', '"leg.urdf"')),
        r"leg.urdf: no such file. check the path",
    ),
    "a period of ages": (
        edited(("period = 8.0", "period = 1e300")),
        r"recordings.0.period: .*less than or equal",
    ),
    "a filter slower than anything": (
        STUDY + "\n[filter]\ncutoff_hz = 18.0\nrate_hz = 1e-300\n",
        r"filter.rate_hz: .*greater than or equal",
    ),
    "a key of very many levels": ("a" + 20_000 * ".a" + " = 1\n" + STUDY, r"nested too deeply"),
    "a deep inline table": (STUDY + "x = " + 3000 * "{a=" + "1" + 3000 * "}", r"nested too deeply"),
    "a number of very many digits": (
        edited(("period = 8.0", "period = " + 5000 * "9")),
        r"is not TOML: .*digits",
    ),
    "no data": (edited(('"test.csv"', '"tests.csv"')), r"tests.csv: no such data file. put it"),
    "data of no format": (edited(('"test.csv"', '"study.toml"')), r"'.toml' names no format"),
    "data that is a folder": (edited(('"test.csv"', '"."')), r"no such data file|folder"),
}


@pytest.mark.parametrize("kind", STUDIES)
def test_study(run, study, tmp_path, kind):
    text, message = STUDIES[kind]
    refused(run, tmp_path, message, "compare", study(text))


def test_study_files(run, tmp_path):
    refused(run, tmp_path, r"none.toml: no such file. check the path", "explain", "none.toml")
    refused(run, tmp_path, r"is a folder, not a file", "explain", tmp_path)
    (tmp_path / "binary.toml").write_bytes(bytes(range(256)))
    refused(run, tmp_path, r"binary.toml: is not UTF-8 text", "explain", "binary.toml")
    (tmp_path / "null.toml").write_bytes(b"\0" * 100)
    refused(run, tmp_path, r"null.toml: is not TOML", "explain", "null.toml")
    refused(run, tmp_path, r"no/study.toml: no such file", "add", "no/study.toml", "joint_spring")
    refused(run, tmp_path, r"none.toml: no such file", "simulate", "none.toml", "--out", "x")


# --- recordings ---------------------------------------------------------------------------------

LINES = csv_text(0).splitlines()


def csv(change) -> str:
    lines = list(LINES)
    change(lines)
    return "\n".join(lines) + "\n"


def cell(row: int, column: int, text: str) -> str:
    def change(lines):
        cells = lines[row].split(",")
        cells[column] = text
        lines[row] = ",".join(cells)

    return csv(change)


def still(columns: slice) -> str:
    """Columns that hold their first value throughout."""

    def change(lines):
        first = lines[1].split(",")
        for row in range(2, len(lines)):
            cells = lines[row].split(",")
            cells[columns] = first[columns]
            lines[row] = ",".join(cells)

    return csv(change)


def zero_torque() -> str:
    made = (line.split(",") for line in LINES[1:])
    return "\n".join([LINES[0], *(",".join([*cells[:3], "0", "0"]) for cells in made)]) + "\n"


RECORDINGS = {
    "empty": ("", r"train.csv: is empty. is the file complete"),
    "header only": (LINES[0] + "\n", r"train.csv: holds a header but no samples"),
    "no header": ("\n".join(LINES[1:]), r"train.csv, line 1: the first line holds numbers"),
    "NaN": (cell(7, 1, "nan"), r"line 8, column q.shoulder: 'nan' is not a finite number"),
    "text": (cell(7, 2, "n/a"), r"line 8, column q.elbow: 'n/a' is not a number"),
    "no cell": (cell(7, 2, ""), r"line 8, column q.elbow: the cell is empty"),
    "missing column": (
        csv_text(0).replace("tau.elbow", "torque.elbow"),
        r"no column 'tau.elbow'. it holds t, q.shoulder, .*did you mean 'torque.elbow'",
    ),
    "unsorted": (
        csv(lambda lines: lines.insert(3, lines.pop(9))),
        r"train.csv, row \d \(line \d\), column t: time goes back",
    ),
    "time twice": (
        csv(lambda lines: lines.insert(3, lines[3])),
        r"row 4 \(line 5\), column t: the time stamp 0.02 s is there twice",
    ),
    "number beyond measure": (cell(7, 3, "1e200"), r"column tau.shoulder: 1e\+200 is beyond any"),
    "clock of another unit": (
        "\n".join(
            [LINES[0], *(f"{k}e-9,{line.partition(',')[2]}" for k, line in enumerate(LINES[1:]))]
        ),
        r"train.csv: samples at 1e\+09 Hz are too many for .*are the time stamps in s\?",
    ),
    "one sample": ("\n".join(LINES[:2]), r"holds 1 sample. a recording needs at least 2"),
    "too short": ("\n".join(LINES[:10]), r"train.csv: .*(few|nothing is left)"),
    "shorter than the filter": ("\n".join(LINES[:40]), r"train.csv: "),
    "cut off": ("\n".join(LINES)[:-12], r"(columns where the header has|is the file complete)"),
    "never moves": (still(slice(1, 3)), r"train.csv: the robot does not move. record a motion"),
    "zero torque": (zero_torque(), r"train.csv: the torque is zero throughout"),
}


@pytest.mark.parametrize("kind", RECORDINGS)
@pytest.mark.parametrize("command", ["compare", "fit", "diagnose"])
def test_recording(run, study, tmp_path, kind, command):
    text, message = RECORDINGS[kind]
    path = study()
    (tmp_path / "train.csv").write_text(text)
    refused(run, tmp_path, message, command, path)


@pytest.mark.parametrize("suffix", [".npz", ".mat", ".parquet"])
def test_truncated(run, study, tmp_path, suffix):
    path = study(edited(("train.csv", f"train{suffix}")))
    file = write(recording(0), tmp_path / f"train{suffix}")
    file.write_bytes(file.read_bytes()[:5000])
    refused(run, tmp_path, rf"train{suffix}: .*(complete|no column)", "explain", path)


class Trap:
    def __reduce__(self):
        return (pytest.fail, ("a file was unpickled",))


def test_pickled(run, study, tmp_path):
    path = study(edited(("train.csv", "train.npz")))
    t = np.arange(3.0)
    columns = {name: t for name in LINES[0].split(",")}
    np.savez(tmp_path / "train.npz", **{**columns, "q.elbow": np.array([Trap()] * 3)})
    message = r"train.npz: 'q.elbow' holds Python objects, which are never loaded"
    refused(run, tmp_path, message, "explain", path)


# --- robots -------------------------------------------------------------------------------------

BOMB = """<!DOCTYPE r [<!ENTITY a "ha">""" + "".join(
    f'<!ENTITY {new} "{f"&{old};" * 10}">' for old, new in zip("abcdefgh", "bcdefghi", strict=True)
)
ROBOTS = {
    "empty": ("", r"arm.urdf: .*XML|empty"),
    "not XML": ("robot: arm", r"arm.urdf: .*XML"),
    "billion laughs": (BOMB + "]><robot>&i;</robot>", r"arm.urdf: .*(entit|DOCTYPE|DTD)"),
    "no joints": ('<robot name="arm"><link name="a"/></robot>', r"arm.urdf: .*joint"),
    "floating base": (edited(('type="revolute"', 'type="floating"'), text=ARM), r"floating"),
    "mimic": (
        edited(("<axis", '<mimic joint="shoulder"/><axis'), text=ARM),
        r"joint '\w+': mimics",
    ),
    "closed chain": (
        edited(
            (
                "</robot>",
                '<joint name="loop" type="revolute"><parent link="base"/><child link="fore"/>'
                '<axis xyz="0 0 1"/></joint></robot>',
            ),
            text=ARM,
        ),
        r"fore.*(loop|elbow)",
    ),
    "NaN inertia": (
        edited(('izz="0.06"', 'izz="nan"'), text=ARM),
        r"arm.urdf: link 'upper': its inertia is not finite. fix",
    ),
    "text for a number": (edited(('value="4"', 'value="heavy"'), text=ARM), r"'heavy'"),
    "unknown parent": (edited(('parent link="base"', 'parent link="bas"'), text=ARM), r"'bas'"),
}


@pytest.mark.parametrize("kind", ROBOTS)
def test_robot(run, study, tmp_path, kind):
    text, message = ROBOTS[kind]
    path = study()
    (tmp_path / "arm.urdf").write_text(text)
    refused(run, tmp_path, message, "compare", path)


@pytest.mark.slow
def test_a_joint_at_rest_is_named(run, study, tmp_path):
    path = study()
    (tmp_path / "train.csv").write_text(still(slice(2, 3)))
    done = run("fit", path)
    assert done.status == 0
    assert re.search(r"^warning: .*train.csv: elbow stands still in every training", done.err)
    assert done.err.count("\n") == 1
    assert "The data do not excite every parameter" in done.out
    for command in ("compare", "explain"):
        done = run(command, path, "--json")
        assert done.status == 0 and "elbow stands still" in done.err
        assert done.json


def test_a_joint_without_torque_is_named(run, study, tmp_path):
    path = study()
    for name in ("train.csv", "test.csv"):
        lines = [line.rpartition(",")[0] for line in (tmp_path / name).read_text().splitlines()]
        (tmp_path / name).write_text(
            "\n".join([lines[0] + ",tau.elbow"] + [f"{x},0" for x in lines[1:]])
        )
    done = run("compare", path, "--json")
    assert done.status == 0 and done.err.count("\n") == 1
    assert re.search(r"^warning: .*train.csv: the torque of elbow is zero throughout", done.err)
    assert [joint["error"] for joint in done.json["models"][0]["joints"]][1] is None


def test_massless_robot(run, study, tmp_path):
    """A model of massless links is something to start from: nothing given enters the fit."""
    path = study()
    text = re.sub(r'mass value="\d"', 'mass value="0"', ARM)
    (tmp_path / "arm.urdf").write_text(re.sub(r'(i[xyz]{2})="[^"]*"', r'\1="0"', text))
    done = run("fit", path, "--json")
    assert done.status == 0 and done.json["error"] < 0.1


# --- arguments ----------------------------------------------------------------------------------

ARGUMENTS = {
    "no command": ((), r"[Mm]issing command. See `dynident --help`"),
    "unknown command": (("explane",), r"No such command 'explane'. Did you mean 'explain'"),
    "unknown option": (("explain", "study.toml", "--jsn"), r"No such option '--jsn'.*'--json'"),
    "no study": (("explain",), r"Missing argument 'STUDY'. See `dynident explain --help`"),
    "no controller": (("simulate", "study.toml"), r"study.toml: has no \[controller\]"),
    "effect that is there": (
        ("add", "study.toml", "viscous_friction"),
        r"study.toml: has viscous_friction already. nothing was changed",
    ),
    "effect that is there at a joint": (
        ("add", "study.toml", "viscous_friction@elbow"),
        r"has viscous_friction@elbow already",
    ),
    "unknown effect": (("add", "study.toml", "stribek_friction"), r"did you mean 'stribeck_frict"),
    "effect of an unknown joint": (
        ("add", "study.toml", "joint_spring@elbov"),
        r"joint_spring@elbov: the robot has no joint 'elbov'. .*elbow",
    ),
    "payload that nothing carries": (
        ("add", "study.toml", "payload"),
        r"no recording carries a payload. set payload = true",
    ),
    "comparison with an unknown effect": (
        ("compare", "study.toml", "--with", "spring"),
        r"no effect is named 'spring'. did you mean 'joint_spring'",
    ),
    "report in no folder": (
        ("explain", "study.toml", "--report", "no/report.html"),
        r"no: no such folder",
    ),
    "report below a file": (
        ("report", "study.toml", "--to", "arm.urdf/report.html"),
        r"arm.urdf: is a file",
    ),
    "report over a folder": (("report", "study.toml", "--to", "."), r"\.: is a folder"),
    "report over the study": (
        ("report", "study.toml", "--to", "study.toml"),
        r"study.toml: is the study itself",
    ),
    "estimate in no folder": (("fit", "study.toml", "--out", "no/fit.json"), r"no: no such folder"),
    "robot in no folder": (
        ("fit", "study.toml", "--out", "fit.json", "--robot", "no/new.urdf"),
        r"no: no such folder",
    ),
    "study as experiment": (
        ("simulate", "study.toml", "--out", "virtual"),
        r"--out is for an experiment, and study.toml is a study",
    ),
}


@pytest.mark.parametrize("kind", ARGUMENTS)
def test_arguments(run, study, tmp_path, kind):
    arguments, message = ARGUMENTS[kind]
    study()
    refused(run, tmp_path, message, *arguments)


def test_an_event_of_one_recording_is_nothing_to_fit(run, study, tmp_path):
    text = edited(('"viscous_friction"', '"viscous_friction", "contact@elbow"'))
    refused(run, tmp_path, r"contact@elbow: happened once", "fit", study(text))


def test_what_a_terminal_would_obey_is_spelt_out(run, study, tmp_path):
    text = edited(('"test.csv"', '"a\\u202e\\u001b[31mb\\u0007.csv"'))
    said = refused(run, tmp_path, r"a.u202e.u001b\[31mb.u0007.csv", "compare", study(text))
    assert not {"\u202e", "\x1b", "\x07"} & set(said)


def test_what_nobody_foresaw_is_one_line_too(run, study, capfd, monkeypatch):
    path = study()

    def broken(*_: object, **__: object) -> None:
        raise ValueError("two\nlines")

    monkeypatch.setattr("dynident.study.load", broken)
    with pytest.raises(SystemExit) as stop:
        main(["compare", str(path)])
    assert stop.value.code == 2
    said = capfd.readouterr().err
    assert said.count("\n") == 1 and "unexpected ValueError: two lines" in said
    monkeypatch.setenv("DYNIDENT_TRACEBACK", "1")
    with pytest.raises(ValueError, match="two"):
        main(["compare", str(path)])
