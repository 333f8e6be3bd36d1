"""Hostile settings: experiment files."""

from __future__ import annotations

from experiment_files import HEAD, HIDDEN_STRIBECK, SHORT_RUN, STIFF
from hostile.case import ANSWER, Content, HostileCase, folder, link_to
from study_files import edited

SENSORS = """
[sensors]
position_std = 2e-5
torque_std = [0.05, 0.02]
"""
EXPERIMENT = HEAD + HIDDEN_STRIBECK + STIFF + SENSORS + SHORT_RUN


def but(old: str, new: str) -> str:
    return edited((old, new), text=EXPERIMENT)


FOUND: dict[str, tuple[Content, str]] = {
    "a folder": (folder, r"experiment\.toml: is a folder, not a file"),
    "a device": (
        link_to("/dev/zero"),
        r"experiment\.toml: is not a regular file, but a device, a pipe or a socket",
    ),
    "empty": ("", r"--out is for an experiment, and experiment\.toml is a study"),
    "binary": (bytes(range(256)), r"experiment\.toml: is not UTF-8 text"),
    "a seed of -1": (
        but("seed = 3", "seed = -1"),
        r"experiment\.toml: seed: input should be greater than or equal to 0",
    ),
    "a seed of 2^64": (but("seed = 3", f"seed = {2**64}"), ANSWER),
    "a seed of many digits": (
        but("seed = 3", "seed = " + "9" * 5000),
        r"experiment\.toml: is not TOML: Exceeds the limit",
    ),
    "a seed of a text": (but("seed = 3", 'seed = "3"'), ANSWER),
    "a lead-in of ages": (
        but("lead_in = 0.5", "lead_in = 1e300"),
        r"experiment\.toml: lead_in: input should be less than or equal to 10000000",
    ),
    "a lead-in of -1": (
        but("lead_in = 0.5", "lead_in = -1.0"),
        r"experiment\.toml: lead_in: input should be greater than or equal to 0",
    ),
    "a lead-in of an hour": (
        but("lead_in = 0.5", "lead_in = 1e7"),
        r"lead_in = 1e\+07 s at 250 Hz are more than 1e\+07 samples",
    ),
    "no controller": (but(STIFF, ""), r"experiment\.toml: key 'controller' is missing"),
    "a controller of 1e7 Hz": (
        edited(("250.0", "1e7"), ("duration = 1.0", "duration = 9.0"), text=EXPERIMENT),
        r"duration = 9 s at 1e\+07 Hz are more than 1e\+07 samples",
    ),
    "a controller of 1e-6 Hz": (but("250.0", "1e-6"), "duration = 1 s at 1e-06 Hz"),
    "a controller of no rate": (
        but("rate_hz = 250.0\n", ""),
        r"experiment\.toml: controller\.rate_hz: the controller's rate is not stated",
    ),
    "gains of 1e300": (
        but("[300.0, 100.0]", "[1e300, 1e300]"),
        r"run1\.csv, t = -0\.5 s: the loop cannot be integrated",
    ),
    "gains of -1": (
        but("[300.0, 100.0]", "[-300.0, 100.0]"),
        r"experiment\.toml: controller\.kp: kp = \[-300\.0, 100\.0\]",
    ),
    "gains that shake": (
        but("[40.0, 5.0]", "[40000.0, 50000.0]"),
        r"run1\.csv, t = -0\.496 s: the loop cannot be integrated",
    ),
    "an integral of 1e300": (
        but('kind = "pd"', 'kind = "pid"\nki = 1e300'),
        r"run1\.csv, t = -0\.5 s: the loop cannot be integrated",
    ),
    "a limit of 1e-300": (but('kind = "pd"', 'kind = "pd"\nlimit = 1e-300'), ANSWER),
    "a delay of an hour": (but('kind = "pd"', 'kind = "pd"\ndelay_s = 3600.0'), ANSWER),
    "a delay of ages": (but('kind = "pd"', 'kind = "pd"\ndelay_s = 1e9'), ANSWER),
    "a duration of ages": (
        but("duration = 1.0", "duration = 1e9"),
        r"duration = 1e\+09 s at 250 Hz are more than 1e\+07 samples",
    ),
    "a duration of nothing": (
        but("duration = 1.0", "duration = 1e-9"),
        "duration = 1e-09 s at 250 Hz",
    ),
    "a duration of zero": (
        but("duration = 1.0", "duration = 0.0"),
        r"experiment\.toml: recordings\.0\.duration: input should be greater than 0",
    ),
    "a period of 1e-9 s": (
        but("period = 0.5", "period = 1e-9"),
        r"run1\.csv: its acceleration is not finite, or beyond 1e\+06",
    ),
    "a period of ages": (
        but("period = 0.5", "period = 1e9"),
        r"run1\.csv, t = 0\.296 s: the loop oscillates from sample to sample: joint",
    ),
    "no harmonics": (
        but("harmonics = 2", "harmonics = 0"),
        r"experiment\.toml: recordings\.0\.trajectory\.harmonics: input should be grea",
    ),
    "a billion harmonics": (
        but("harmonics = 2", "harmonics = 1000000000"),
        r"experiment\.toml: recordings\.0\.trajectory\.harmonics: input should be less",
    ),
    "a speed of NaN": (
        but("speed = 2.0", "speed = nan"),
        r"experiment\.toml: recordings\.0\.trajectory\.speed: input should be a finite",
    ),
    "a speed of -1": (
        but("speed = 2.0", "speed = -1.0"),
        r"experiment\.toml: recordings\.0: trajectory\.speed, joint 'shoulder': is be",
    ),
    "a speed of 1e300": (
        but("speed = 2.0", "speed = 1e300"),
        r"experiment\.toml: recordings\.0: trajectory\.speed, joint 'shoulder': is be",
    ),
    "a speed of no joint": (
        but("speed = 2.0", "speed = []"),
        r"experiment\.toml: recordings\.0: trajectory\.speed: 0 for 2 joints",
    ),
    "a centre of 1e300": (
        but("speed = 2.0", "centre = 1e300"),
        r"experiment\.toml: recordings\.0: trajectory\.centre, joint 'shoulder': lies",
    ),
    "an amplitude of zero": (
        but("speed = 2.0", "amplitude = 0.0"),
        r"experiment\.toml: recordings\.0: trajectory\.amplitude, joint 'shoulder': l",
    ),
    "noise of -1": (
        but("position_std = 2e-5", "position_std = -1.0"),
        r"experiment\.toml: sensors\.position_std: \[-1\.0\]",
    ),
    "noise of 1e300": (
        but("position_std = 2e-5", "position_std = 1e300"),
        r"run1\.csv, t = -0\.5 s: the loop cannot be integrated",
    ),
    "a resolution of 1e-300": (but("position_std = 2e-5", "position_resolution = 1e-300"), ANSWER),
    "a resolution of 1e300": (
        but("position_std = 2e-5", "position_resolution = 1e300"),
        r"run1\.csv, t = 0\.296 s: the loop oscillates from sample to sample: joint",
    ),
    "a file above": (
        but('"run1.csv"', '"../run1.csv"'),
        r"experiment\.toml: recordings\.0: '\.\./run1\.csv' cannot be the file of a rec",
    ),
    "a file of the system": (
        but('"run1.csv"', '"/etc/passwd"'),
        r"experiment\.toml: recordings\.0: '/etc/passwd' cannot be the file of a rec",
    ),
    "a file of no name": (
        but('"run1.csv"', '""'),
        r"experiment\.toml: recordings\.0: '' cannot be the file of a recording",
    ),
    "a file with a NUL": (
        but('"run1.csv"', '"a\\u0000.csv"'),
        r"experiment\.toml: recordings\.0: 'a\\u0000\.csv' cannot be the file of a rec",
    ),
    "a file of no format": (
        but('"run1.csv"', '"run1.exe"'),
        r"experiment\.toml: recordings\.0: 'run1\.exe' cannot be the file of a record",
    ),
    "a file that is the study": (
        but('"run1.csv"', '"study.toml"'),
        r"experiment\.toml: recordings\.0: 'study\.toml' cannot be the file of a reco",
    ),
    "a file that is the robot": (
        but('"run1.csv"', '"arm.urdf"'),
        r"experiment\.toml: recordings\.0: 'arm\.urdf' cannot be the file of a record",
    ),
    "a file twice": (
        EXPERIMENT + EXPERIMENT[EXPERIMENT.index("[[rec") :],
        r"experiment\.toml: run1\.csv: two recordings have this name",
    ),
    "no recordings": (
        "recordings = []\n" + EXPERIMENT[: EXPERIMENT.index("[[rec")],
        r"experiment\.toml: no recordings are asked for",
    ),
    "an effect of no name": (
        but('"stribeck_friction@elbow"', '""'),
        r"experiment\.toml: effects\.0: no effect is named ''",
    ),
    "an effect of no joint": (
        but("stribeck_friction@elbow", "stribeck_friction@knee"),
        r"experiment\.toml: effects\.0: stribeck_friction@knee: the robot has no joi",
    ),
    "a value of no parameter": (
        but("{Fs = 0.3}", "{Fx = 0.3}"),
        r"experiment\.toml: effects\.0: stribeck_friction@elbow: no parameter 'Fx'",
    ),
    "a value of NaN": (
        but("{Fs = 0.3}", "{Fs = nan}"),
        r"experiment\.toml: effects\.0\.values\.Fs: input should be a finite number",
    ),
    "a value of 1e300": (
        but("{Fs = 0.3}", "{Fs = 1e300}"),
        r"run1\.csv, t = -0\.5 s: the loop cannot be integrated",
    ),
    "a value of -1e6": (
        but("{Fs = 0.3}", "{Fs = -1e6}"),
        r"experiment\.toml: effects\.0: stribeck_friction@elbow: Fs = -1e\+06",
    ),
    "a shape of zero": (
        but("{vs = 0.1}", "{vs = 0.0}"),
        r"experiment\.toml: effects\.0: stribeck_friction@elbow: vs = 0",
    ),
    "a shape of 1e300": (
        but("{vs = 0.1}", "{vs = 1e300}"),
        r"experiment\.toml: effects\.0: stribeck_friction@elbow: vs = 1e\+300",
    ),
    "a friction width of 5e-324": (
        "friction_width = 5e-324\n" + EXPERIMENT,
        r"experiment\.toml: friction_width: input should be greater than or equal t",
    ),
    "a friction width of 1e300": (
        "friction_width = 1e300\n" + EXPERIMENT,
        r"experiment\.toml: friction_width: input should be less than or equal to 1",
    ),
    "gravity of 1e300": (
        "gravity = [0.0, 0.0, 1e300]\n" + EXPERIMENT,
        r"experiment\.toml: gravity\.2: input should be less than or equal to 100",
    ),
    "a nominal robot that is none": (
        'nominal = "train.csv"\n' + EXPERIMENT,
        r"train\.csv: is not well-formed XML: syntax error",
    ),
    "a nominal robot of other joints": (
        'nominal = "other.urdf"\n' + EXPERIMENT,
        r"other\.urdf: no such file",
    ),
    "keys of a study": (EXPERIMENT + "[filter]\n", r"experiment\.toml: is no study"),
}
"""Content of `experiment.toml`, and the one line of `dynident simulate`."""

CASES = {
    name: HostileCase(
        commands=(("simulate", "experiment.toml", "--out", "virtual"),),
        files={"experiment.toml": content},
        message=message,
    )
    for name, (content, message) in FOUND.items()
}
