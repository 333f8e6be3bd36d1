"""The keys of a study file: tables, what each key means, and which values it takes."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator
from pydantic_core import PydanticCustomError

from dynident.closed_loop import ControllerFile
from dynident.criteria import criteria_schema
from dynident.effects import FRICTION_WIDTH, LawsEntry
from dynident.fitting.loads import LoadEntry, PayloadEntry
from dynident.settings import Duration, Gravity, Rate, SettingsTable, Time, in_unit

_NARROWEST, _WIDEST = 1e-9, 1e3
"""rad/s or m/s over which dry friction changes its sign."""
_Gain = Annotated[float, Field(ge=-1e9, le=1e9, json_schema_extra=in_unit("N m (or N) per A or %"))]
_PositionStd = Annotated[float, Field(le=1e9, json_schema_extra=in_unit("rad or m"))]
_TorqueStd = Annotated[float, Field(le=1e9, json_schema_extra=in_unit("N m, N, A or %"))]
_Width = Annotated[float, Field(json_schema_extra=in_unit("rad/s or m/s"))]


class RecordingEntry(SettingsTable):
    """A file of data, or several that have the rest in common."""

    file: str | list[str]
    """Its name, from the folder of the study; a pattern, as `"runs/train_*.csv"`, one recording for
    each file that matches, in the order of the numbers in their names; or a list of either."""
    record: str | None = None
    """Which one of an NPZ or MAT file that holds several; then it is one file."""
    columns: list[str] | None = None
    """Names of the columns of a text file without a header line, by position, as
    `["t", "q.joint1", "-"]`; "" or "-" skips one."""
    rate_hz: Rate | None = None
    """Sampling rate, where the file has no column of time."""
    topic: str = ""
    """Of a bag that holds the joints on several, as `"/joint_states"`."""
    use: Literal["train", "test"] = "train"
    """`"train"` to fit, `"test"` to judge by."""
    period: Duration | None = None
    """After which the excitation repeats: what differs between repetitions is the noise."""
    start: Time = 0.0
    """When the recording began in the session, for what warms up or drifts. Files on a wall clock,
    as seconds since 1970, tell it where no recording states it."""
    window: tuple[Time, Time] | None = None
    """[t0, t1] of the file's clock, or from its first sample where that is a wall clock: what is
    used of it once the whole is filtered. Outside of it the file may have faults: then no more is
    read than up to them."""
    payload: PayloadEntry = None
    """Whether the load under study was on board, true or false; `"unknown"` asks for it. Or the
    name of one of several loads, see [loads.NAME], or what is known of a load without a name:
    `payload = { mass = 2.8, centre = [0.0, 0.02, 0.05] }`."""


class FilterEntry(SettingsTable):
    """How positions are differentiated, and columns and torque filtered alike.

    Without this table frequencies follow the sampling rate, and the encoders; see
    `dynident.recording.Filter`.
    """

    position_cutoff_hz: Rate | Literal["default", "none"] = "default"
    """Zero-phase low-pass of q before it is differentiated; `"none"` for none. By default it
    follows the sampling rate, and is two to eight times as high where the encoders' noise permits:
    a low-pass shifts the instant at which dry friction turns round."""
    cutoff_hz: Rate | Literal["default", "none"] = "default"
    """The same low-pass on every column and on the torque; `"none"` for none. By default 0.45 of
    the positions' cut-off where that is stated (above it these predict no torque), else of the
    usual one; none where positions are not
    filtered, `decimation` is `"chebyshev"`, or `ends` are kept."""
    rate_hz: Rate | None = None
    """Decimated to about this. Without it every sample is kept; where the cut-off is the default
    one, about three for each of its periods."""
    decimation: Literal["pick", "chebyshev"] = "pick"
    """`"pick"` keeps every k-th filtered row, `"chebyshev"` filters as MATLAB's `decimate`."""
    edge_s: tuple[Time, Time] = (0.0, 0.0)
    """[start, end] dropped after differentiation."""
    ends: Literal["drop", "keep"] = "drop"
    """`"drop"` leaves out what filters make up at the ends, `"keep"` uses all of the record."""
    difference_order: Literal[2, 4, 6, 8] | None = None
    """Order of accuracy of the central differences of positions, and of the torque that held
    commands make. By default 8 behind a low-pass of the positions; without one as the noise of the
    encoders allows, and 2 with `ends = "keep"`. Published recipes mostly have 2, with which
    accelerations at 2 Hz and 100 samples a second are 0.5 % too small."""


class NoiseEntry(SettingsTable):
    """Standard deviations of a raw sample, where nothing repeats: one number, or one per joint."""

    position_std: _PositionStd | list[_PositionStd]
    """Of the position."""
    torque_std: _TorqueStd | list[_TorqueStd]
    """Of the torque, in the unit in which torques are recorded."""


class ColumnEntry(SettingsTable):
    """Where a column is found in files that use other names, units or coordinates.

    `name` (or a bare string in its place) is the file's name, `name[2]` the third column of a
    table of numbers. What is no name in the file is read as a linear expression of its columns:
    `"q.joint6" = "motor_position[5]/32 - motor_position[4]/45 - 1.5707963"`, with numbers, `pi`,
    `+ - * /`, signs and parentheses, at most 2000 characters. A name that such an expression could
    not hold goes between backticks: "0.5 * `left current (A)` - 0.5 * `right current (A)`". It is
    read by rules and never evaluated as code. Ours is `scale` times the whole.
    """

    name: str
    """The file's name of the column, or a linear expression of its columns."""
    scale: float = 1.0
    """Factor from the file's unit to ours (s, rad or m, N m or N)."""


class StudyFile(SettingsTable):
    """What a study file says; `robot` and [[recordings]] have to be there."""

    robot: str
    """Its description (URDF, SDF, MJCF), a path from the folder of the study."""
    joints: list[str] | None = None
    """Names, the order of columns; by default every joint that moves."""
    effects: list[str] = Field(default_factory=list)
    """Those that the robot is said to have, `name` or `name@joint`."""
    effect_modules: list[str] = Field(default_factory=list)
    """Python files with effects of one's own, as `["my_effects.py"]`, paths from the folder of the
    study. To read the study is to run them: what nobody has said yes to before is asked for on a
    terminal, and refused elsewhere without `--trust`."""
    torque: Literal["measured", "held_command"] = "measured"
    """`"measured"`, or `"held_command"` where a command acts from its sample to the next."""
    torque_unit: Literal["N m", "A", "%"] = "N m"
    """`"N m"` (and N, of prismatic joints), or the unit of the drives, `"A"` or `"%"`: then each
    joint's gain is identified, and torques are converted before anything else is done."""
    drive_gains: dict[str, _Gain] = Field(default_factory=dict)
    """Joint -> its gain where that is known; one fixes the scale."""
    trusted: list[str] = Field(default_factory=list)
    """Links whose mass, centre and inertia in the description are right, as of a hand that was
    weighed; with `torque_unit = "A"` they fix the scale, as far as what they weigh shows without
    that of links that are not trusted."""
    loads: dict[str, LoadEntry] = Field(default_factory=dict)
    """Name -> a load that recordings carry; a known one fixes the scale."""
    friction_width: _Width | dict[str, _Width] = FRICTION_WIDTH
    """Speed within which dry friction turns over, from 1e-9 to 1000; one, or by joint."""
    gravity: tuple[Gravity, Gravity, Gravity] | None = None
    """In the axes of the description's base; by default [0, 0, -9.81], or what the description
    says."""
    recordings: list[RecordingEntry]
    """Files of data."""
    filter: FilterEntry | None = None
    """How positions are differentiated, and what is filtered alike."""
    noise: NoiseEntry | None = None
    """Noise of a raw sample, where nothing repeats."""
    controller: ControllerFile | None = None
    """The controller of the closed loop: needed to simulate it, and for instruments from it."""
    laws: LawsEntry = Field(default_factory=dict)
    """Effects as formulas, in tables [laws.NAME] or files of their own. At a joint such an effect
    is `law:NAME@joint`."""
    columns: dict[str, str | ColumnEntry] = Field(default_factory=dict)
    """Ours -> the files' names of columns, or linear expressions of them. Ours are t, and for each
    joint q.<joint>, tau.<joint>, v.<joint>, a.<joint>, q_ref.<joint> and temperature.<joint>; for a
    wrench sensor wrench.<link>.fx, .fy, .fz, .tx, .ty and .tz, in N and N m in the frame of that
    link of the description, for `dynident payload`."""
    criteria: dict[str, Any] = Field(default_factory=dict, json_schema_extra=criteria_schema())
    """Numbers that decide a diagnosis, otherwise than by default, in tables [criteria.GROUP]."""

    @field_validator("friction_width")
    @classmethod
    def _positive(cls, width: float | dict[str, float]) -> float | dict[str, float]:
        """Refuse a width that is no width."""
        for one in width.values() if isinstance(width, dict) else (width,):
            if not one > 0:
                raise PydanticCustomError("width", "input should be greater than 0")  # pyright: ignore
            if not _NARROWEST <= one <= _WIDEST:
                what = f"input should be from {_NARROWEST:g} to {_WIDEST:g} rad/s or m/s"
                raise PydanticCustomError("width", what)  # pyright: ignore
        return width

    @field_validator("columns", mode="before")
    @classmethod
    def _quoted(cls, columns: Any) -> Any:
        """Refuse `q.elbow = ...` without quotes, which TOML reads as a table `q`."""
        for ours, theirs in columns.items() if isinstance(columns, dict) else ():
            if isinstance(theirs, dict) and "name" not in theirs:
                inner = next(iter(theirs), "joint")
                what = f'a name with a dot needs quotes: "{ours}.{inner}" = ...'
                raise PydanticCustomError("quotes", what)  # pyright: ignore
        return columns
