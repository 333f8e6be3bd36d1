"""Hostile words on the command line."""

from __future__ import annotations

import os

from hostile.case import ANSWER, Content, HostileCase, folder, link_to
from synthetic import ARM

KNOWN = {
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
        r"joint_spring@elbov: the robot has no joint 'elbov'. did you mean 'elbow'",
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

FILTERED = ("fit", "study.toml", "--method", "iv", "--instruments", "filtered", "--cutoff")
OTHERS: dict[str, tuple[tuple[str, ...], str]] = {
    "an empty command": (("",), "No such command ''"),
    "a command of a NUL": (("\0",), "An argument holds a NUL character"),
    "a command that paints": (("\x1b[31m\u202efit",), r"No such command '\\x1b\[31m\\u202efit'"),
    "a command of 100 kB": (("x" * 100_000,), r"No such command 'x+\.\.\.x"),
    "a lone surrogate": (("check", "\udcff.urdf"), r"\\udcff\.urdf: no such file"),
    "a study of no name": (("explain", ""), r"\.: is a folder, not a file"),
    "a study with a NUL": (("explain", "a\0.toml"), "An argument holds a NUL character"),
    "a study with a line break": (("explain", "a\nb.toml"), r"a b\.toml: no such file"),
    "a study of 5000 letters": (("explain", "x" * 5000), r"x+\.\.\.x"),
    "a study that is an option": (("explain", "--", "--json"), "--json: no such file"),
    "a study that is a device": (
        ("explain", "/dev/zero"),
        "/dev/zero: is not a regular file, but a device, a pipe or a socket",
    ),
    "two studies": (("explain", "study.toml", "study.toml"), "Got unexpected extra argument"),
    "an option twice": (
        ("explain", "study.toml", "--most", "1", "--most", "x"),
        "Invalid value for '--most': 'x' is not a valid integer range",
    ),
    "effects of -1": (
        ("explain", "study.toml", "--most", "-1"),
        "Invalid value for '--most': -1 is not in the range x>=0",
    ),
    "effects of NaN": (
        ("explain", "study.toml", "--most", "nan"),
        "Invalid value for '--most': 'nan' is not a valid integer range",
    ),
    "effects of many digits": (
        ("explain", "study.toml", "--most", "9" * 5000),
        r"Invalid value for '--most': '9+\.\.\.9",
    ),
    "effects in Arabic digits": (("diagnose", "study.toml", "--most", "\u0660"), ANSWER),
    "a method that nobody has": (
        ("fit", "study.toml", "--method", "magic"),
        "Invalid value for '--method': 'magic' is not one of 'least-squares', 'iv",
    ),
    "a cut-off of NaN": ((*FILTERED, "nan"), "instruments: cutoff_hz = nan"),
    "a cut-off of infinity": ((*FILTERED, "inf"), "instruments: cutoff_hz = inf"),
    "a cut-off of 1e-300": (
        (*FILTERED, "1e-300"),
        r"train\.csv: samples at 100 Hz are too many for a cut-off of 1e-300 Hz",
    ),
    "a cut-off of 1e300": (
        (*FILTERED, "1e300"),
        r"train\.csv: a cut-off of 1e\+300 Hz does not suit samples at 100 Hz",
    ),
    "instruments without a loop": (
        ("fit", "study.toml", "--method", "iv"),
        r"study\.toml: has no \[controller\], so that its loop cannot be simulated fo",
    ),
    "noise of no method": (
        ("fit", "study.toml", "--input-noise", "repeats"),
        "--input-noise goes with --method corrected, factors or bayes",
    ),
    "encoders that nobody knows": (
        ("fit", "study.toml", "--method", "corrected", "--input-noise", "encoders"),
        "the noise of the encoders is not stated",
    ),
    "an estimate with a NUL": (
        ("fit", "study.toml", "--out", "a\0.json"),
        "An argument holds a NUL character",
    ),
    "an estimate over the data": (
        ("fit", "study.toml", "--out", "train.csv"),
        r"train\.csv: is a recording of the study, which would be lost",
    ),
    "an estimate over the robot": (
        ("fit", "study.toml", "--robot", "arm.urdf"),
        "is the robot of the study",
    ),
    "an estimate to a device": (
        ("fit", "study.toml", "--out", "/dev/full"),
        "/dev/full: is not a regular file, but a device, a pipe or a socket",
    ),
    "an estimate to the root": (("fit", "study.toml", "--out", "/"), "/: is a folder, not a file"),
    "an estimate of 300 letters": (("fit", "study.toml", "--out", "x" * 300), r"x+\.\.\.x"),
    "an estimate in a circle": (
        ("fit", "study.toml", "--out", "circle/fit.json"),
        r"circle/fit\.json: cannot be written",
    ),
    "a robot of no format": (("fit", "study.toml", "--robot", "new.exe"), ANSWER),
    "a robot of another format": (
        ("fit", "study.toml", "--robot", "new.sdf"),
        r"new\.sdf: the description is of the format URDF",
    ),
    "a plot of no method": (
        ("fit", "study.toml", "--plot", "a.png"),
        "--plot goes with --method iv",
    ),
    "one file for two": (
        ("fit", "study.toml", "--out", "new.urdf", "--robot", "new.urdf"),
        r"new\.urdf: is named for two results",
    ),
    "a picture of no kind": (
        ("show", "study.toml", "--to", "a.exe"),
        r"a\.exe: is no kind of picture that can be written",
    ),
    "a picture of no name": (
        ("show", "study.toml", "--to", ""),
        r"\.: is no kind of picture that can be written",
    ),
    "a picture that is a folder": (
        ("show", "study.toml", "--to", "folder.png"),
        r"folder\.png: is a folder, not a file",
    ),
    "a picture with a NUL": (
        ("show", "study.toml", "--to", "a\0.png"),
        "An argument holds a NUL character",
    ),
    "a picture over the study": (
        ("show", "study.toml", "--to", "study.toml"),
        r"study\.toml: is no kind of picture that can be written",
    ),
    "a picture in a pipe": (
        ("show", "study.toml", "--to", "pipe.png"),
        r"pipe\.png: is not a regular file, but a device, a pipe or a socket",
    ),
    "a report with a NUL": (
        ("explain", "study.toml", "--report", "a\0.html"),
        "An argument holds a NUL character",
    ),
    "a report to a device": (
        ("report", "study.toml", "--to", "/dev/null"),
        "/dev/null: is not a regular file, but a device, a pipe or a socket",
    ),
    "a report into the processes": (
        ("report", "study.toml", "--to", "/proc/self/x.html"),
        "/proc/self: may not be written",
    ),
    "an effect of nothing": (("add", "study.toml", ""), "no effect is named ''"),
    "an effect of marks": (("add", "study.toml", "@"), "no effect is named ''"),
    "an effect of more marks": (
        ("add", "study.toml", "joint_coupling@elbow:"),
        "joint_coupling@elbow: joint_coupling needs source",
    ),
    "an effect with a NUL": (
        ("add", "study.toml", "joint_spring@el\0bow"),
        "An argument holds a NUL character",
    ),
    "an effect that writes TOML": (
        ("add", "study.toml", 'x"]\nrobot = "y'),
        r"no effect is named 'x.\] robot = .y'",
    ),
    "an effect of 100 kB": (("add", "study.toml", "x" * 100_000), r"no effect is named 'x+\.\.\.x"),
    "an event": (
        ("add", "study.toml", "contact@elbow"),
        "contact@elbow: happened once, and a fit does not look for when",
    ),
    "a comparison of nothing": (("compare", "study.toml", "--with", ""), "no effect is named ''"),
    "a load of a study without": (
        ("payload", "study.toml"),
        r"study\.toml: no recording names a load that is to be weighed",
    ),
    "a robot that is a study": (
        ("check", "study.toml"),
        r"study\.toml: is neither a robot description nor a saved estimate",
    ),
    "a study that is a robot": (
        ("explain", "arm.urdf"),
        r"arm\.urdf: is not TOML: Invalid statement",
    ),
    "a study that is a recording": (
        ("explain", "train.csv"),
        r"train\.csv: is not TOML: Expected '=' after a key in a key/value pair",
    ),
    "an experiment that is a study": (
        ("simulate", "study.toml", "--out", "x"),
        r"--out is for an experiment, and study\.toml is a study",
    ),
    "an estimate that is a study": (
        ("simulate", "study.toml", "--estimate", "study.toml"),
        r"study\.toml: has no \[controller\], so that its loop is not known",
    ),
    "a refit of the data": (
        ("refit", "train.csv", "--out", "new.urdf"),
        r"train\.csv: is taken for a CSV of parameters, which does not say of which",
    ),
    "a refit of no robot": (
        ("refit", "train.csv", "--robot", "arm.urdf", "--out", "n.urdf"),
        r"train\.csv, header: no layout is known",
    ),
    "a refit without a place": (("refit", "arm.urdf"), "Missing option '--out'"),
    "a refit of no format": (("refit", "arm.urdf", "--out", "new.step"), ANSWER),
    "a refit of another format": (
        ("refit", "arm.urdf", "--out", "new.sdf"),
        r"new\.sdf: the description is of the format URDF",
    ),
    "a refit with a NUL": (
        ("refit", "arm.urdf", "--out", "a\0.urdf"),
        "An argument holds a NUL character",
    ),
    "a refit with the study of nobody": (
        ("refit", "arm.urdf", "--study", "no.toml", "--out", "new.urdf"),
        r"no\.toml: no such file",
    ),
    "a refit with a spread of NaN": (
        ("refit", "arm.urdf", "--out", "new.urdf", "--spread", "nan"),
        "spread = nan of a prior",
    ),
    "a refit with a spread of zero": (
        ("refit", "arm.urdf", "--out", "new.urdf", "--spread", "0"),
        "spread = 0 of a prior",
    ),
    "a refit with a spread of -1": (
        ("refit", "arm.urdf", "--out", "new.urdf", "--spread", "-1"),
        "spread = -1 of a prior",
    ),
    "a refit with a spread of 1e300": (
        ("refit", "arm.urdf", "--out", "new.urdf", "--spread", "1e300"),
        ANSWER,
    ),
    "a refit with an order of nobody": (
        ("refit", "arm.urdf", "--out", "new.urdf", "--order", "x"),
        r"arm\.urdf: is no CSV file, and says its own order",
    ),
    "a draft of nothing": (("init",), "Missing argument 'ROBOT'"),
    "a draft with a NUL": (
        ("init", "arm.urdf", "tr\0ain.csv", "--out", "new.toml"),
        "An argument holds a NUL character",
    ),
    "a draft over a study": (("init", "arm.urdf", "train.csv"), r"study\.toml: is there already"),
    "a draft of the robot": (
        ("init", "arm.urdf", "arm.urdf", "--out", "new.toml"),
        r"arm\.urdf: the suffix '\.urdf' names no format",
    ),
    "a draft at a rate of NaN": (
        ("init", "arm.urdf", "train.csv", "--rate", "nan", "--out", "new.toml"),
        "rate_hz: rate_hz = nan",
    ),
    "a draft at a rate of -1": (
        ("init", "arm.urdf", "train.csv", "--rate", "-1", "--out", "new.toml"),
        r"rate_hz: rate_hz = -1\.0",
    ),
    "a draft at a rate of 1e300": (
        ("init", "arm.urdf", "train.csv", "--rate", "1e300", "--out", "new.toml"),
        r"rate_hz: rate_hz = 1e\+300",
    ),
    "a draft with gears of NaN": (
        ("init", "arm.urdf", "train.csv", "--gears", "nan,1", "--out", "new.toml"),
        "gears nan, 1",
    ),
    "a draft with gears of zero": (
        ("init", "arm.urdf", "train.csv", "--gears", "0,1", "--out", "new.toml"),
        r"gears 0, 1\. give one number for each of shoulder, elbow, none of them 0; neg",
    ),
    "a draft with gears of nothing": (
        ("init", "arm.urdf", "train.csv", "--gears", ",", "--out", "new.toml"),
        "Invalid value for --gears: ',' holds what is no number",
    ),
    "a draft of no joints": (
        ("init", "arm.urdf", "train.csv", "--joints", ",,", "--out", "new.toml"),
        r"arm\.urdf: has no moving joint ''",
    ),
    "a draft of joints twice": (
        ("init", "arm.urdf", "train.csv", "--joints", "elbow,elbow", "--out", "new.toml"),
        r"arm\.urdf: joint 'elbow' is asked for twice",
    ),
    "a draft of a thousand files": (
        ("init", "arm.urdf", *(f"none_{k}.csv" for k in range(1000)), "--out", "new.toml"),
        r"none_0\.csv: no such data file",
    ),
    "a draft of a pipe": (
        ("init", "arm.urdf", "pipe.png", "--out", "new.toml"),
        r"pipe\.png: the suffix '\.png' names no format",
    ),
    "a draft to a folder": (
        ("init", "arm.urdf", "train.csv", "--out", "folder.png"),
        r"folder\.png: is a folder, not a file",
    ),
    "a draft with a NUL in its name": (
        ("init", "arm.urdf", "train.csv", "--out", "a\0"),
        "An argument holds a NUL character",
    ),
    "a demo to nowhere": (("demo", "--to", "no/demo.html"), "no: no such folder"),
    "a demo with a NUL": (("demo", "--to", "a\0.html"), "An argument holds a NUL character"),
}
"""Words, and the one line."""

AROUND: dict[str, Content] = {
    "pipe.png": os.mkfifo,
    "folder.png": folder,
    "circle": link_to("circle"),
    "twin.urdf": ARM,
}
"""What lies beside the small study."""

CASES = {
    name: HostileCase(commands=(words,), files=AROUND, message=message)
    for name, (words, message) in {**KNOWN, **OTHERS}.items()
}
