"""Hostile settings: study files."""

from __future__ import annotations

from hostile.case import ANSWER, Content, HostileCase, folder, link_to
from study_files import CONTROLLER, STUDY, edited

TEST_ENTRY = STUDY[STUDY.index('[[recordings]]\nfile = "test.csv"') :]
NOISE = "\n[noise]\nposition_std = {}\ntorque_std = 0.05\n"
FILTER = "\n[filter]\n{}\n"


KNOWN = {
    "not TOML": ("robot = [", r"study.toml: is not TOML"),
    "empty": ("", r"study.toml: key 'robot' is missing"),
    "unknown key": (edited(("effects", "efects")), r"unknown key 'efects'. did you mean 'effects'"),
    "a key of the file in a table": (
        STUDY + "friction_width = 0.02\n",
        r"\.friction_width'. friction_width is a key of the whole file: write it above the first",
    ),
    "one table of recordings": (
        STUDY[: STUDY.index("[[")] + '[recordings]\nfile = "train.csv"\n',
        r"recordings: input should be a valid list. write \[\[recordings\]\] above each table",
    ),
    "a large truth": (STUDY + "x = True\n", r"is not TOML: .*true or false, in small letters"),
    "no value": (STUDY + "x =\n", r"is not TOML: Invalid value \(at line \d+, column \d+\)$"),
    "no quotes": (edited(('"arm.urdf"', "arm.urdf")), r"is not TOML: .*texts stand between quotes"),
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
        r"effects: viscous_friction@elbo: the robot has no joint 'elbo'. did you mean 'elbow'",
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


def entry(text: str) -> str:
    """The study with more said of its training recording."""
    return edited(("period = 8.0\n\n", f"period = 8.0\n{text}\n\n"))


def columns(expression: str) -> str:
    """The study with an expression in the place of a column."""
    return STUDY + f'\n[columns]\n"q.elbow" = "{expression}"\n'


LOAD = 'payload = "crate"\n'
OTHERS: dict[str, tuple[Content, str]] = {
    # Bytes
    "a folder": (folder, r"study\.toml: is a folder, not a file"),
    "a link to itself": (link_to("study.toml"), r"study\.toml: cannot be read"),
    "a device": (
        link_to("/dev/full"),
        r"study\.toml: is not a regular file, but a device, a pipe or a socket",
    ),
    "UTF-16": (STUDY.encode("utf-16"), r"study\.toml: is not UTF-8 text"),
    "a byte order mark": (b"\xef\xbb\xbf" + STUDY.encode(), ANSWER),
    "lines of Windows": (STUDY.replace("\n", "\r\n"), ANSWER),
    "lines of old Macs": (
        STUDY.replace("\n", "\r"),
        r"study\.toml: is not TOML: Found invalid character '\\r'",
    ),
    "NUL": (STUDY + "\0", r"study\.toml: is not TOML: Invalid statement"),
    "JSON": ('{"robot": "arm.urdf"}', r"study\.toml: is not TOML: Invalid statement"),
    "YAML": (
        "robot: arm.urdf\n",
        r"study\.toml: is not TOML: Expected '=' after a key in a key/value pair",
    ),
    "a key twice": (
        'robot = "b.urdf"\n' + STUDY,
        r"study\.toml: is not TOML: Cannot overwrite a value",
    ),
    "a table twice": (STUDY + "[filter]\n[filter]\n", r"study\.toml: is not TOML: Cannot declare"),
    "a table and a value": (
        "filter = 3\n" + STUDY + "[filter]\n",
        r"study\.toml: is not TOML: Cannot overwrite a value",
    ),
    "100 000 unknown keys": (
        "".join(f"k{k} = 1\n" for k in range(100_000)) + STUDY,
        r"study\.toml: unknown key 'k0'",
    ),
    "10 000 recordings of one file": (
        STUDY + '[[recordings]]\nfile = "none.csv"\n' * 10_000,
        r"none\.csv: no such data file",
    ),
    "a deep list": (
        "x = " + "[" * 5000 + "]" * 5000 + "\n" + STUDY,
        r"study\.toml: has tables nested too deeply",
    ),
    "a text of 10 MB": (
        f'name = "{"x" * 10_000_000}"\n' + STUDY,
        r"study\.toml: unknown key 'name'",
    ),
    "a key that paints": (
        '"\\u001b[31m\\u202e" = 1\n' + STUDY,
        r"study\.toml: unknown key '\\u001b\[31m\\u202e'",
    ),
    "a key of nothing": ('"" = 1\n' + STUDY, r"study\.toml: unknown key ''"),
    "a key of Cyrillic": (
        edited(("robot =", '"r\u043ebot" =')),
        r"study\.toml: key 'robot' is missing",
    ),
    # Paths
    "a robot of no name": (edited(('"arm.urdf"', '""')), r"\.: is a folder, not a file"),
    "a robot with a NUL": (
        edited(('"arm.urdf"', '"arm\\u0000.urdf"')),
        r"'arm\\x00\.urdf': its name holds a NUL character",
    ),
    "a robot of a very long name": (
        edited(('"arm.urdf"', f'"{"a" * 5000}"')),
        r"^error: a+\.\.\.a.*File name too long",
    ),
    "a robot far above": (
        edited(('"arm.urdf"', '"' + "../" * 2000 + 'etc/passwd"')),
        r"^error: (\.\./)+\.\.\.[./]*etc/passwd: ",
    ),
    "a robot that is a device": (
        edited(('"arm.urdf"', '"/dev/zero"')),
        "/dev/zero: is not a regular file, but a device, a pipe or a socket",
    ),
    "a robot that is the study": (
        edited(('"arm.urdf"', '"study.toml"')),
        r"study\.toml: is not well-formed XML: not well-formed",
    ),
    "data of no name": (
        edited(('"train.csv"', '""')),
        ": is a folder, and not one that ROS 2 records into: it holds no metadata",
    ),
    "data with a NUL": (
        edited(('"train.csv"', '"a\\u0000.csv"')),
        r"'a\\x00\.csv': its name holds a NUL character",
    ),
    "data that is a device": (edited(('"train.csv"', '"/dev/zero"')), "/dev/zero: has no suffix"),
    "data of the home": (
        edited(('"train.csv"', '"~/train.csv"')),
        r"~/train\.csv: no such data file",
    ),
    "data of everything": (
        edited(('"train.csv"', '"/**/**/**/*"')),
        r"/\*\*/\*\*/\*\*/\*: more than 3 folders of the pattern have wildcards in their",
    ),
    "data of a broken pattern": (
        edited(('"train.csv"', '"[a-.csv"')),
        r"\[a-\.csv: no file matches",
    ),
    "data of the web": (
        edited(('"train.csv"', '"http://localhost:1/a.csv"')),
        r"http:/localhost:1/a\.csv: no such data file",
    ),
    "data, and itself again": (edited(('"train.csv"', '["train.csv", "train.csv"]')), ANSWER),
    # Numbers
    "a period of NaN": (
        edited(("period = 8.0", "period = nan")),
        r"study\.toml: recordings\.0\.period: input should be a finite number",
    ),
    "a period of 5e-324": (
        edited(("period = 8.0", "period = 5e-324")),
        r"train\.csv: period = 5e-324",
    ),
    "a period of a text": (
        edited(("period = 8.0", 'period = "eight"')),
        r"study\.toml: recordings\.0\.period: input should be a valid number, unable",
    ),
    "a period that is true": (
        edited(("period = 8.0", "period = true")),
        r"train\.csv: the positions do not repeat with the given period",
    ),
    "a period of a date": (
        edited(("period = 8.0", "period = 1979-05-27")),
        r"study\.toml: recordings\.0\.period: input should be a valid number",
    ),
    "a period below the sampling": (
        edited(("period = 8.0", "period = 0.001")),
        r"train\.csv: period = 0\.001",
    ),
    "a period of 2^63": (
        edited(("period = 8.0", "period = 9223372036854775808")),
        r"study\.toml: recordings\.0\.period: input should be less than or equal to 1",
    ),
    "a window of -inf": (
        entry("window = [-inf, 3.0]"),
        r"study\.toml: recordings\.0\.window\.0: input should be a finite number",
    ),
    "a window of three": (
        entry("window = [1.0, 3.0, 5.0]"),
        r"study\.toml: recordings\.0\.window: tuple should have at most 2 items after",
    ),
    "a window of no width": (entry("window = [3.0, 3.0]"), r"train\.csv: window ="),
    "a start of ages ago": (
        entry("start = -1e300"),
        r"study\.toml: recordings\.0\.start: input should be greater than or equal to",
    ),
    "a rate beside a clock": (
        entry("rate_hz = 100.0"),
        r"train\.csv: rate_hz = 100 is given, and the file has a column of time, 't",
    ),
    "a rate of zero": (
        entry("rate_hz = 0"),
        r"study\.toml: recordings\.0\.rate_hz: input should be greater than or equal",
    ),
    "a record of a CSV": (
        entry('record = "a"'),
        r"train\.csv: record 'a' is asked for, and no array 'columns' names its col",
    ),
    "columns of a file that has a header": (
        entry('columns = ["t", "t"]'),
        r"train\.csv, line 1: the first line names the columns, and the study names",
    ),
    "a topic of a CSV": (
        entry('topic = "/joint_states"'),
        r"train\.csv: topic = '/joint_states' is of a bag",
    ),
    "gravity of a text": (
        'gravity = "down"\n' + STUDY,
        r"study\.toml: gravity: input should be a valid tuple",
    ),
    "gravity of two numbers": (
        "gravity = [0.0, -9.81]\n" + STUDY,
        r"study\.toml: gravity: too few values",
    ),
    "gravity of a star": (
        "gravity = [0.0, 0.0, -1e12]\n" + STUDY,
        r"study\.toml: gravity\.2: input should be greater than or equal to -100",
    ),
    "no gravity": ("gravity = [0.0, 0.0, -0.0]\n" + STUDY, ANSWER),
    "a filter of infinity": (
        STUDY + FILTER.format("cutoff_hz = inf"),
        r"study\.toml: filter\.cutoff_hz: input should be a finite number",
    ),
    "a filter of 1e7 Hz": (
        STUDY + FILTER.format("cutoff_hz = 1e7"),
        r"train\.csv: a cut-off of 1e\+07 Hz does not suit samples at 100 Hz",
    ),
    "a filter of 1e-6 Hz": (
        STUDY + FILTER.format("position_cutoff_hz = 1e-6"),
        r"train\.csv: samples at 100 Hz are too many for a cut-off of 1e-06 Hz",
    ),
    "a filter of a word": (
        STUDY + FILTER.format('position_cutoff_hz = "off"'),
        r"study\.toml: filter\.position_cutoff_hz: input should be a valid number, u",
    ),
    "a filter of unknown decimation": (
        STUDY + FILTER.format('decimation = "x"'),
        r"study\.toml: filter\.decimation: input should be 'pick' or 'chebyshev'",
    ),
    "edges of ages": (
        STUDY + FILTER.format("edge_s = [1e9, 1e9]"),
        r"train\.csv: nothing is left of 16 s when 1e\+09 and 1e\+09 s are dropped at",
    ),
    "noise of NaN": (
        STUDY + NOISE.format("nan"),
        r"study\.toml: noise\.position_std: input should be a finite number",
    ),
    "noise of nothing": (
        STUDY + NOISE.format("[]"),
        r"study\.toml: noise\.position_std: 0 values for 2 joints",
    ),
    "noise of 1e300": (
        STUDY + NOISE.format("1e300"),
        r"study\.toml: noise\.position_std: input should be less than or equal to 10",
    ),
    "noise of 5e-324": (STUDY + NOISE.format("5e-324"), ANSWER),
    "friction widths of no joint": (
        edited(("[[recordings]]", "[friction_width]\nknee = 0.1\n[[recordings]]")),
        r"study\.toml: is not TOML: Cannot declare",
    ),
    "a friction width of 5e-324": (
        "friction_width = 5e-324\n" + STUDY,
        r"study\.toml: friction_width: input should be from 1e-09 to 1000 rad/s or",
    ),
    # Names
    "a joint of nothing": (
        edited(('"elbow"]', '""]')),
        r"study\.toml: joints: arm\.urdf: has no moving joint ''",
    ),
    "a joint that paints": (
        edited(('"elbow"]', '"\\u001b[31melbow"]')),
        r"study\.toml: joints: arm\.urdf: has no moving joint '\\u001b\[31melbow'",
    ),
    "10 000 joints": (
        edited(('"elbow"]', '"elbow"' + ', "elbow"' * 10_000 + "]")),
        r"study\.toml: joints: arm\.urdf: joint 'elbow' is asked for twice",
    ),
    "an effect of nothing": (
        edited(('"viscous_friction"', '""')),
        r"study\.toml: effects: no effect is named ''",
    ),
    "an effect of marks": (
        edited(('"viscous_friction"', '"@@@:::"')),
        r"study\.toml: effects: no effect is named ''",
    ),
    "an effect of a number": (
        edited(('"viscous_friction"', "3")),
        r"study\.toml: effects\.0: input should be a valid string",
    ),
    "an effect of 1 MB": (
        edited(('"viscous_friction"', f'"{"x" * 1_000_000}"')),
        r"study\.toml: effects: no effect is named 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx",
    ),
    "every effect at once, twice": (
        edited(('"viscous_friction"', '"viscous_friction", ' * 500 + '"joint_spring"')),
        r"study\.toml: effects: viscous_friction@shoulder: is in the model twice",
    ),
    "a coupling of a joint with itself": (
        edited(('"viscous_friction"', '"joint_coupling@elbow:elbow"')),
        r"study\.toml: effects: joint_coupling@elbow:elbow: a joint is not coupled",
    ),
    # Columns
    "an expression that is code": (
        columns("__import__('os').system('touch PWNED')"),
        r'train\.csv: no column has this name, and the expression "__import__',
    ),
    "an expression of powers": (
        columns("9**9**9**9"),
        r"train\.csv: no column has this name, and the expression '9\*\*9\*\*9\*\*9' hold",
    ),
    "an expression by zero": (
        columns("q.elbow / 0"),
        r"train\.csv: no column has this name, and the expression 'q\.elbow / 0' div",
    ),
    "an expression by nothing": (
        columns("q.elbow / (1 - 1)"),
        r"train\.csv: no column has this name, and the expression 'q\.elbow /",
    ),
    "an expression of two columns": (
        columns("q.elbow * q.elbow"),
        r"train\.csv: no column has this name, and the expression 'q\.elbow \* q\.elbo",
    ),
    "an expression of brackets": (
        columns("(" * 1000 + "q.elbow" + ")" * 1000),
        r"train\.csv: no column has this name, and the expression '",
    ),
    "an expression of 200 brackets": (columns("(" * 200 + "q.elbow" + ")" * 200), ANSWER),
    "an expression of signs": (columns("-" * 250 + "q.elbow"), ANSWER),
    "an expression of 1 MB": (
        columns("q.elbow" + " + q.elbow" * 100_000),
        r"train\.csv: no column has this name, and the expression 'q\.elbow \+ q\.elbo",
    ),
    "an expression that overflows": (
        columns("1e308 * 1e308 * q.elbow"),
        r"train\.csv: no column has this name, and the expression '1e308 \* 1e308 \*",
    ),
    "an expression of attributes": (
        columns("q.elbow.__class__"),
        r"train\.csv: no column 'q\.elbow\.__class__'",
    ),
    "an expression of a constant": (columns("pi"), r"train\.csv: no column 'pi'"),
    "a scale of 1e308": (
        STUDY + '\n[columns]\n"q.elbow" = { name = "q.elbow", scale = 1e308 }\n',
        r"train\.csv, row 1",
    ),
    "a column of ours twice": (
        STUDY + '\n[columns]\n"t" = "t"\nt = "t"\n',
        r"study\.toml: is not TOML: Cannot overwrite a value",
    ),
    # Drives and loads
    "a unit that nobody has": (
        'torque_unit = "V"\n' + STUDY,
        r"study\.toml: torque_unit: input should be 'N m', 'A' or '%'",
    ),
    "gains of N m": (
        "drive_gains = { elbow = 3.0 }\n" + STUDY,
        r"study\.toml: drive_gains: gains of drives, and torques in N m",
    ),
    "a gain of zero": (
        'torque_unit = "A"\ndrive_gains = { elbow = 0.0 }\n' + STUDY,
        r"drive_gains: elbow = 0\.0",
    ),
    "a gain of 1e300": (
        'torque_unit = "A"\ndrive_gains = { elbow = 1e300 }\n' + STUDY,
        r"study\.toml: drive_gains\.elbow: input should be less than or equal to 100",
    ),
    "a gain of no joint": (
        'torque_unit = "A"\ndrive_gains = { knee = 3.0 }\n' + STUDY,
        "drive_gains: the robot has no joint 'knee'",
    ),
    "a load that nobody knows": (
        entry(LOAD),
        r"study\.toml: recordings\.0: payload = 'crate' names no load",
    ),
    "a load that nobody carries": (STUDY + "[loads.crate]\nmass = 1.0\n", ANSWER),
    "a load of no mass": (
        entry("payload = { mass = 0.0 }"),
        r"study\.toml: recordings\.0\.payload\.mass: input should be greater than 0",
    ),
    "a load of 1e308 kg": (
        entry("payload = { mass = 1e308 }"),
        r"study\.toml: recordings\.0\.payload\.mass: input should be less than or equa",
    ),
    "a load that cannot be": (
        entry(
            "payload = { mass = 1.0, centre = [0.0, 0.0, 0.0], "
            "inertia = [1.0, 0.0, 0.0, 1.0, 0.0, 9.0] }"
        ),
        r"load 'of recordings\.0': no rigid body has its principal moments, 1, 1, 9",
    ),
    "a load of NaN": (
        entry("payload = { mass = 1.0, centre = [nan, 0.0, 0.0] }"),
        r"study\.toml: recordings\.0\.payload\.centre\.0: input should be a finite numb",
    ),
    "a load of a list": (
        entry("payload = [1, 2]"),
        r"study\.toml: recordings\.0\.payload: input should be a valid boolean",
    ),
    "a load of no name": (
        entry('payload = ""'),
        r"study\.toml: recordings\.0: payload = '' names no load",
    ),
    "a load at no link": (
        entry('payload = { mass = 1.0, link = "hand" }'),
        r"load 'of recordings\.0': the last joint, 'elbow', moves no link 'hand'",
    ),
    # Controller and criteria
    "a controller of no rate": (
        STUDY + CONTROLLER.replace("1000.0", "0.0"),
        r"study\.toml: controller\.rate_hz: input should be greater than or equal to",
    ),
    "a controller of 1e300 Hz": (
        STUDY + CONTROLLER.replace("1000.0", "1e300"),
        r"study\.toml: controller\.rate_hz: input should be less than or equal to 10",
    ),
    "a controller of NaN": (
        STUDY + CONTROLLER.replace("120.0", "nan"),
        r"study\.toml: controller\.kd\.0: input should be a finite number",
    ),
    "a controller of ages of delay": (
        STUDY + CONTROLLER + "delay_s = 1e300\n",
        r"study\.toml: controller\.delay_s: input should be less than or equal to 10",
    ),
    "a controller of no limit": (
        STUDY + CONTROLLER + "limit = 0.0\n",
        r"study\.toml: controller\.limit: limit = \[0\.0, 0\.0\]",
    ),
    "a criterion of a text": (
        STUDY + '[criteria.gates]\nlevel = "low"\n',
        r"study\.toml: criteria: gates\.level: needs a number",
    ),
    "a criterion of NaN": (
        STUDY + "[criteria.gates]\nlevel = nan\n",
        r"study\.toml: criteria: gates\.level: nan is out of its range",
    ),
    "a criterion that is true": (
        STUDY + "[criteria.gates]\nlevel = true\n",
        r"study\.toml: criteria: gates\.level: needs a number",
    ),
    "a criterion of a table": (
        STUDY + "[criteria.gates.level]\nx = 1\n",
        r"study\.toml: criteria: gates\.level: needs a number",
    ),
    "criteria of private names": (
        STUDY + "[criteria.__class__]\n__init__ = 1\n",
        r"study\.toml: criteria: unknown group '__class__'",
    ),
}
"""Content of `study.toml`, and the one line of `dynident compare`."""

CASES = {
    name: HostileCase(
        commands=(("compare", "study.toml"),), files={"study.toml": content}, message=message
    )
    for name, (content, message) in {**KNOWN, **OTHERS}.items()
}
