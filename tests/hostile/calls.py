"""Hostile arguments of the public calls: one line of the package's own errors, or a right answer.

A call is written as Python and runs with `di`, `np`, `Path`, and what a small study holds: `study`,
`model`, `robot`, `train`, `test`, `recording`, `fit`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hostile.case import ANSWER, HostileCase
from study_files import write_study

CALLS: dict[str, str] = {
    # --- files ------------------------------------------------------------------------------
    "di.load(3)": "load: path = 3. give a path",
    "di.load(None)": "load: path is None. give a path",
    "di.load(b'study.toml')": "load: path = b'study.toml'. give a path",
    "di.load(study)": "load: path is a Study. give a path",
    "di.load()": r"load: missing a required argument: 'path'. see help\(dynident.load\)",
    "di.load('study.toml', modules='all')": "say 'trusted' or 'run'",
    "di.load('study.toml', modules=1)": "load: modules = 1. give 'trusted' or 'run'",
    "di.load('study.toml', trust=True)": "load: got an unexpected keyword argument 'trust'",
    "di.load('\\x1b[31mred\\u202e')": r"red.*: no such file",
    "di.load(Path('study.toml'))": ANSWER,
    "di.load_estimate(fit)": "load_estimate: path is an Estimate. give a path",
    "di.load_estimate(['a.json'])": "load_estimate: path is a list of str. give a path",
    "di.read(7)": "read: path = 7. give a path",
    "di.read('train.csv', joints='shoulder')": "read: joints = 'shoulder'. give a list whose items",
    "di.read('train.csv', joints=[1, 2])": "read: joints is a list of int. give a list",
    "di.read('train.csv', columns=['a'])": "read: columns is a list of str. give a dictionary",
    "di.read('train.csv', columns={'q.shoulder': 3})": "read: columns is a dict. give a diction",
    "di.read('train.csv', layout={'rate_hz': 3})": "read: layout is a dict. give a FileLayout",
    "di.read('train.csv', record=1.5)": r"read: record = 1.5. give a string or None",
    "di.read('train.csv', joints=np.array(['shoulder', 'elbow']))": ANSWER,
    "di.write('a', 'b.csv')": "write: recording = 'a'. give a Recording",
    "di.write(recording, 3)": "write: path = 3. give a path",
    "di.write(train, 'b.csv')": "write: recording is a Dataset. give a Recording",
    # --- recordings -------------------------------------------------------------------------
    "di.Filter(rate_hz='100')": "Filter: rate_hz = '100'. give a number or None",
    "di.Filter(cutoff_hz=[18.0])": "Filter: cutoff_hz is a list of float. give a number",
    "di.Filter(position_cutoff_hz=1j)": "Filter: position_cutoff_hz is a complex. give a number",
    "di.Filter(cutoff_hz=True)": "Filter: cutoff_hz = True. give a number",
    "di.Filter(cutoff_hz=float('nan'))": "filter: cutoff_hz = nan. choose it above 0 Hz",
    "di.Filter(edge_s=1.0)": "Filter: edge_s = 1.0. give a list whose items",
    "di.Filter(edge_s=(0.1, None))": "Filter: edge_s is a tuple of NoneType, float. give",
    "di.Filter(edge_s=(0.1, 0.1, 0.1))": "filter: edge_s = ",
    "di.Filter(ends='neither')": "filter: ends = 'neither'. write .drop. or .keep.",
    "di.Filter(18.0)": r"Filter: too many positional arguments. see help\(dynident.Filter\)",
    "di.Filter(cutof_hz=18.0)": "Filter: got an unexpected keyword argument 'cutof_hz'",
    "di.Filter(cutoff_hz=np.float32(9), rate_hz=np.int64(50), edge_s=np.zeros(2))": ANSWER,
    "di.Filter(cutoff_hz=np.array(9.0), edge_s=[0, 1])": ANSWER,
    "di.Dataset('train.csv')": "Dataset: recordings = 'train.csv'. give a list whose items are",
    "di.Dataset(recording)": "Dataset: recordings is a Recording. give a list whose items are",
    "di.Dataset(['train.csv'])": "Dataset: recordings is a list of str. give a list",
    "di.Dataset({'a': recording})": "Dataset: recordings is a dict. give a list",
    "di.Dataset((recording,), 18.0)": "Dataset: filter = 18.0. give a Filter or None",
    "di.Dataset([recording])": ANSWER,
    "di.Dataset(one for one in [recording])": ANSWER,
    "di.Recording(1, 2, 3, 4)": "joints = 4 is no list",
    "di.Recording([0, 1], [[0], [1]], [[0], [1]], 'q')": "joints = 'q' is one text. write a list",
    "di.Recording([0, 1], 'a', [[0], [1]], ['q'])": "q does not hold numbers",
    "di.Recording(None, [[0], [1]], [[0], [1]], ['q'])": "recording: t ",
    "di.Recording([0, 1], [[0], [1]], {}, ['q'])": "recording: tau does not hold numbers",
    "di.Recording([0, 1], [[0], [1]], [[0], [1]], ['q'], use='both')": "use = 'both'. write .train",
    "di.Recording([0, 1], [[0], [1]], [[0], [1]], ['q'], period='8')": ANSWER,
    "di.Recording([0, 1], [[0], [1]], [[0], [1]], ['q'], payload=2)": "payload = 2. write",
    "di.Recording([0, 1], [[0], [1]], [[0], [1]], ['q'], window=3)": "window = 3. give two times",
    "di.Recording([0, 1], [[0], [1]], [[0], [1]], ['q'])": ANSWER,
    # --- robots and models ------------------------------------------------------------------
    "di.Robot('arm', 3, 4)": "Robot: joints = 3. give a list whose items are each a Joint",
    "di.Robot('arm', ('a',), ())": "Robot: joints is a tuple of str. give a list whose items",
    "di.Robot(None, (), ())": "Robot: name is None. give a string",
    "di.Model('arm.urdf')": "Model: robot = 'arm.urdf'. give a Robot",
    "di.Model(robot, 'viscous_friction')": "Model: effects = 'viscous_friction'. give a list whose",
    "di.Model(robot, ('viscous_friction',))": "Model: effects is a tuple of str. give a list whose",
    "di.Model(robot, friction_width='x')": "Model: friction_width = 'x'. give a number or a list",
    "di.Model(study)": "Model: robot is a Study. give a Robot",
    "di.Model(robot, (di.catalogue()['joint_spring'],))": "Model: effects is a tuple of ABCMeta",
    "di.Model(robot, (di.catalogue()['joint_spring'](3),))": "the robot has no joint '3'",
    "model + 3": "Model: effects is a tuple of ViscousFriction, int. give a list",
    "model + 'springy'": "no effect is named 'springy'",
    "di.effects_of(3, robot)": "effects_of: label = 3. give a string",
    "di.effects_of('springy', robot)": "no effect is named 'springy'",
    "di.effects_of('joint_spring@elbow', robot, 5)": "effects_of: laws = 5. give a list",
    "di.catalogue(3)": "catalogue: too many positional arguments",
    "di.check(3)": "a int has no robot to check. give a Robot",
    "di.check(None)": "has no robot to check",
    "di.check(di.Robot)": "has no robot to check",
    "di.check_effect('joint_spring')": "'joint_spring' is no subclass of Effect",
    "di.check_effect(int)": "no subclass of Effect. give the class, not an effect",
    # --- fits -------------------------------------------------------------------------------
    "di.fit()": r"fit: missing a required argument: 'model'. see help\(dynident.fit\)",
    "di.fit(robot, train)": "fit: model is a Robot. give a Model",
    "di.fit(study, train)": "fit: model is a Study. give a Model",
    "di.fit(model, 'train.csv')": "fit: data = 'train.csv'. give a Dataset or a Recording",
    "di.fit(model, [recording])": "fit: data is a list of Recording. give a Dataset or a Recording",
    "di.fit(model, train, 'iv')": "fit: method = 'iv'. give an object with the methods of Method",
    "di.fit(model, train, di.LeastSquares)": "fit: method is the class LeastSquares itself. give",
    "di.fit(model, train, client=3)": "fit: client = 3. give an object with the methods of Cluster",
    "di.fit(model, di.Dataset(()))": "no recording to fit. mark some",
    "di.fit(model, recording)": ANSWER,
    "di.LeastSquares(3)": "LeastSquares: weighting = 3. give 'joint' or 'none'",
    "di.LeastSquares(errors='both')": "LeastSquares: errors = 'both'. give 'correlated' or",
    "di.Constrained('full')": "Constrained: within = 'full'. give a Within",
    "di.Constrained(prior=3)": "Constrained: prior = 3. give a Robot or a Prior or None",
    "di.Prior('arm.urdf')": "Prior: robot = 'arm.urdf'. give a Robot",
    "di.Prior(robot, spread='wide')": "Prior: spread = 'wide'. give a number",
    "di.IV('filtered')": "IV: instruments = 'filtered'. give a Controller or an object with",
    "di.IV(None)": "IV: instruments is None. give a Controller or an object",
    "di.fit(model, train, di.Regression(3))": "estimator",
    "di.fit(model, train, di.Regression(noise=3))": "noise = 3 of the inputs. choose none",
    "di.fit(model, train, di.Regression(noise='sensors'))": "choose none, repeats or encoders",
    "di.Estimate(model=3)": "Estimate: missing a required argument",
    "di.project(3)": "project: what = 3. give an Estimate or a Robot or a Projection",
    "di.project(robot, within='full')": "project: within = 'full'. give a Within or None",
    "di.project(robot, solver=1)": "project: solver = 1. give 'conic' or 'nlp'",
    "di.refit(3, 4)": "refit: what = 3. give a Robot or",
    "di.refit(robot, 'study.toml')": "refit: study = 'study.toml'. give a Study or None",
    # --- what is asked of them --------------------------------------------------------------
    "di.compare(model, test)": "compare: estimates is a Model. give an Estimate or a dictionary",
    "di.compare([fit], test)": "compare: estimates is a list of Estimate. give an Estimate or",
    "di.compare({'a': model}, test)": "compare: estimates is a dict. give an Estimate or a dict",
    "di.compare({}, test)": "no estimate to compare. give one",
    "di.compare(fit, di.Dataset(()))": "no recording to compare with",
    "di.compare(fit, recording)": ANSWER,
    "di.compare(fit, [recording])": "compare: dataset is a list of Recording. give a Dataset or a",
    "di.compare(fit, None)": "compare: dataset is None. give a Dataset",
    "di.compare(fit, test, criteria={})": "compare: criteria is a dict. give a Criteria",
    "di.compare(fit, test)": ANSWER,
    "di.diagnose(study)": "diagnose: missing a required argument: 'train'",
    "di.diagnose(fit, di.Dataset(()))": "no recording to diagnose. mark some",
    "di.diagnose(study, train)": "diagnose: model is a Study. give a Model or an Estimate",
    "di.diagnose(fit, train, 'test.csv')": "diagnose: test = 'test.csv'. give a Dataset or a",
    "di.diagnose(fit, train, most='all')": "diagnose: most = 'all'. give a whole number or None",
    "di.diagnose(fit, train, most=1.5)": "diagnose: most = 1.5. give a whole number or None",
    "di.diagnose(fit, train, propose='maybe')": "DiagnosisTask: propose = 'maybe'. give",
    "di.diagnose(fit, train, progress=True)": "diagnose: progress = True. give a function or None",
    "di.design(robot, train)": "design: model is a Robot. give a Model",
    "di.design(model, recording)": ANSWER,
    "di.design(model, train, 'friction')": "design: task = 'friction'. give a DesignTask or None",
    "di.design(model, train, limits=3.0)": "design: limits = 3.0. give a MotionLimits or None",
    "di.validate(fit, test, 'pd')": "validate: controller = 'pd'. give a Controller",
    "di.validate(model, test, None)": "validate: estimate is a Model. give an Estimate",
    "di.report(fit)": "report: found is an Estimate. give a Diagnosis or a Validation",
    "di.report('study.toml', to=3)": "report: found = 'study.toml'. give a Diagnosis or",
    "di.draft_study('arm.urdf', 'train.csv')": "draft_study: data = 'train.csv'. give a list whose",
    "di.draft_study(robot, ['train.csv'])": "draft_study: robot is a Robot. give a path",
    "di.draft_study('arm.urdf', [3])": "draft_study: data is a list of int. give a list whose",
    "di.draft_study('arm.urdf', ['train.csv'], facts=3)": "draft_study: facts = 3. give a LogFacts",
    "di.draft_study('arm.urdf', [])": "no file of measurements. name at least one",
}
"""A call, and the pattern of its one line."""


@cache
def _names() -> dict[str, Any]:
    import numpy as np

    import dynident as di

    with TemporaryDirectory(prefix="calls.") as name:
        study = di.load(write_study(Path(name)))
    fit = di.fit(study.model, study.train)
    return {
        "di": di,
        "np": np,
        "Path": Path,
        "study": study,
        "model": study.model,
        "robot": study.model.robot,
        "train": study.train,
        "test": study.test,
        "recording": study.train.recordings[0],
        "fit": fit,
    }


def _call(words: tuple[str, ...]) -> None:
    """Evaluate a call of this table; show its answer, or its line as the command line does."""
    from dynident.errors import DynidentError
    from dynident.tables import printable

    try:
        found = eval(words[0], dict(_names()))
    except DynidentError as error:
        print(f"error: {printable(str(error))}", file=sys.stderr)
        raise SystemExit(2) from None
    print(type(found).__name__)
    raise SystemExit(0)


@dataclass(frozen=True, kw_only=True)
class HostileCall(HostileCase):
    """A call of the public API, in the folder of the small study."""

    @property
    def run(self) -> Callable[[tuple[str, ...]], object]:
        """What is given the call."""
        return _call


CASES: dict[str, HostileCase] = {
    call: HostileCall(commands=((call,),), message=message, files={})
    for call, message in CALLS.items()
}
"""By the calls themselves."""
