"""A study file read into a model, recordings and settings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dynident.arguments import checked
from dynident.closed_loop import Controller
from dynident.criteria import DEFAULTS, Criteria
from dynident.effect_modules import Permission, import_effects, require_sound
from dynident.effects import FRICTION_WIDTH, effects_of, law_effect, laws_of
from dynident.errors import DynidentError, EffectError, StudyError, warn
from dynident.fitting.drive_gains import (
    DriveGains,
    GainProblem,
    fit_drive_gains,
    in_newton_metres,
)
from dynident.model import Model
from dynident.recording import (
    Dataset,
    Noise,
    require_motion,
    require_torque,
    warn_of_limited_torque,
    warn_of_missing_torque,
)
from dynident.robot import Robot
from dynident.settings import read_toml
from dynident.study.adding import study_digest
from dynident.study.named_files import filter_of, naming, recordings_of, robot_of
from dynident.study.study_file import StudyFile


@dataclass(frozen=True, kw_only=True)
class Study:
    """What a study file says.

    Attributes
    ----------
    path : the file.
    model : the robot and the effects that it is said to have.
    train, test : recordings to fit and recordings to judge by; `test` is empty where the study
        names none, and the diagnosis then holds out blocks of time. Their torques are in N m, and
        those of the robot alone where loads have names.
    drives : gains by which torques were converted, and loads that were identified; None where the
        recordings are in N m and no load has a name.
    gain_problem : what they solve; None where they are None.
    recorded_test : `test` in the unit of the drives and with its loads; None where they are None.
    controller : of the closed loop, where the study states one.
    criteria : the numbers that decide a diagnosis, with those that the study wants otherwise: a
        table for each group, as `[criteria.gates] level = 0.005`; see `dynident.criteria`.
    digest : SHA-256 of the file's text as it was read, by which a change of it is seen.
    modules : what might be run of its `effect_modules`, as `load` was told.
    """

    path: Path
    model: Model
    train: Dataset
    test: Dataset
    drives: DriveGains | None = None
    gain_problem: GainProblem | None = None
    recorded_test: Dataset | None = None
    controller: Controller | None = None
    criteria: Criteria = DEFAULTS
    digest: str = ""
    modules: Permission = "trusted"

    def __repr__(self) -> str:
        return f"<Study {self.path}\n  {self.model}\n  train {self.train}\n  test {self.test}>"

    @property
    def robot(self) -> Robot:
        """The robot as its description gives it."""
        return self.model.robot

    def with_drives(self, drives: DriveGains | None) -> Study:
        """Return the study with torques by other gains and loads.

        Parameters
        ----------
        drives : of its drives; None where it is in N m and no load has a name.
        """
        if drives is self.drives or drives is None:
            return self
        if self.gain_problem is None or self.recorded_test is None:
            return self
        sets = (self.gain_problem.dataset, self.recorded_test)
        train, test = (in_newton_metres(one, drives, self.robot) for one in sets)
        return replace(self, train=train, test=test, drives=drives)


@checked
def load(path: str | Path, *, modules: Permission = "trusted") -> Study:
    """Read a study file and everything that it names.

    Parameters
    ----------
    path : the file.
    modules : what may be run of its `effect_modules`: "trusted", those that the user has said yes
        to before or that this process has imported already; "run", all of them.

    Raises
    ------
    UntrustedError
        If an effect module would have to be run that is not trusted.
    StudyError
        If the file is not a study: it names the key, and the remedy.
    DynidentError
        If the robot or a recording that it names is unusable.
    """
    path = Path(path)
    digest = study_digest(path)  # first: what changes from here on is another file
    said = read_toml(path, StudyFile)
    if not said.recordings:
        raise StudyError("no [[recordings]]", str(path), "add at least one")
    brought = import_effects(said.effect_modules, path, modules)
    robot = robot_of(said, path)
    require_sound(brought, robot)
    laws = laws_of(said.laws, path)
    try:
        for law in laws:
            why = law_effect(law).elsewhere(robot)
            if why is not None and law.name in said.laws:
                raise why
            if why is not None:  # of another robot's file
                warn(f"{why}; it is not tried")
        effects = tuple(one for label in said.effects for one in effects_of(label, robot, laws))
        model = Model(robot, effects, _widths(said.friction_width, robot), laws)
    except DynidentError as error:
        raise StudyError(str(error), f"{path}: effects") from None
    recordings, loads = recordings_of(said, path, robot)
    with naming(path, "filter"):
        settings = filter_of(said.filter, recordings)
    with naming(path, "criteria"):
        criteria = Criteria.with_values(said.criteria)
    noise = _noise(said, path, robot)
    sets = {
        use: Dataset(tuple(r for r in recordings if r.use == use), settings, noise)
        for use in ("train", "test")
    }
    if not sets["train"].recordings:
        remedy = 'set use = "train" for some of them'
        raise StudyError("no recording is for training", str(path), remedy)
    for dataset in sets.values():
        require_torque(dataset.recordings)
    warn_of_missing_torque(recordings)
    warn_of_limited_torque(recordings)
    require_motion(sets["train"].recordings, robot.kinds)
    controller = None
    if said.controller:
        controller = said.controller.controller(robot, f"{path}: controller")
    drives = problem = recorded = None
    if said.torque_unit != "N m" or said.drive_gains or said.trusted or loads:
        known = said.drive_gains
        if said.torque_unit == "N m":
            known = dict.fromkeys(robot.names, 1.0)
        problem = GainProblem(model, sets["train"], known, loads, trusted=tuple(said.trusted))
        drives, recorded = _drives(said, path, problem), sets["test"]
        sets = {use: in_newton_metres(one, drives, robot) for use, one in sets.items()}
    return Study(
        path=path,
        model=model,
        train=sets["train"],
        test=sets["test"],
        drives=drives,
        gain_problem=problem,
        recorded_test=recorded,
        controller=controller,
        criteria=criteria,
        digest=digest,
        modules=modules,
    )


def _widths(said: float | dict[str, float], robot: Robot) -> float | tuple[float, ...]:
    """Friction width of all joints, or of each: of those that are not named, the default."""
    if not isinstance(said, dict):
        return said
    for name in said:
        if name not in robot.names:
            remedy = f"joints: {', '.join(robot.names)}"
            raise EffectError(f"the robot has no joint '{name}'", "friction_width", remedy)
    return tuple(said.get(name, FRICTION_WIDTH) for name in robot.names)


def _drives(said: StudyFile, path: Path, problem: GainProblem) -> DriveGains:
    """Gains and loads that the training recordings tell."""
    if said.torque_unit == "N m" and said.drive_gains:
        what, remedy = "gains of drives, and torques in N m", 'state torque_unit = "A" or "%"'
        raise StudyError(what, f"{path}: drive_gains", remedy)
    if said.torque_unit == "N m" and said.trusted:
        what, remedy = "trusted links, and torques in N m", 'state torque_unit = "A" or "%"'
        raise StudyError(what, f"{path}: trusted", remedy)
    trained = {recording.load for recording in problem.dataset.recordings}
    for load in problem.loads:
        if load.name not in trained and not load.is_known:
            what = f"no training recording carries the load '{load.name}', which is not known"
            remedy = "state all of it, or train with a recording that carries it"
            raise StudyError(what, str(path), remedy)
    return fit_drive_gains(problem, said.torque_unit)


def _noise(said: StudyFile, path: Path, robot: Robot) -> Noise | None:
    """The noise that a study states."""
    if not said.noise:
        return None
    return Noise(
        _per_joint(said.noise.position_std, robot, f"{path}: noise.position_std"),
        _per_joint(said.noise.torque_std, robot, f"{path}: noise.torque_std"),
    )


def _per_joint(value: float | list[float], robot: Robot, where: str) -> np.ndarray:
    values = np.full(robot.n, value) if isinstance(value, float) else np.array(value)
    if values.shape != (robot.n,):
        raise StudyError(f"{len(values)} values for {robot.n} joints", where, "give one per joint")
    if not np.all(values > 0):
        raise StudyError("a standard deviation is not positive", where)
    return values
