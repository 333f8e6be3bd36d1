"""Recordings: what a robot did and which torques it took.

`read` and `write` exchange them with CSV, NPZ, MAT and Parquet files (other names and units
through `Column`; what a file does not say of itself through `FileLayout`), `open_table` opens any
file with its columns under its own names, `Recording` checks what is read. `read_wrench` reads a
wrench sensor's columns as the torques of six joints that stand still.
`uniform` puts jittered time stamps on a uniform clock. `differentiate` turns positions into a
`Motion`, `MotionInParts` as much of it as is asked for; `ParallelFilter` passes regressor columns
and torque through one low-pass and decimation, in blocks if asked; both follow a `Filter`, which
`suited_filter` chooses for recordings.
`usable` and `usable_rows` decide which rows count, `within` and `moving` pick some of them;
`periods` lays repetitions side by side; `within_limits` brings together angles that were kept
within a turn; `require_motion` and `require_torque` refuse recordings that show nothing.
"""

from dynident.recording.dataset import (
    Dataset,
    Noise,
    filtered_alike,
    numbered,
    without_ends,
)
from dynident.recording.derivatives import (
    central_difference,
    difference_gain,
    held_gain,
    held_torque_adjoint,
)
from dynident.recording.filters import (
    Filter,
    default_cutoff,
    default_filter,
    default_position_cutoff,
    lowpass,
)
from dynident.recording.formats.column_names import Column
from dynident.recording.formats.column_table import ColumnTable, FileLayout
from dynident.recording.formats.open_table import READABLE, open_table
from dynident.recording.formats.read import SUFFIXES, read
from dynident.recording.formats.recorded import counted_window
from dynident.recording.formats.sound_stretch import sound_part
from dynident.recording.formats.whole_turns import UNWRAPPED, unwrapped_notes, within_limits
from dynident.recording.formats.wrench_file import (
    COMPONENTS,
    WrenchColumns,
    frame_of,
    frames_in,
    read_wrench,
    sensed_frames,
)
from dynident.recording.formats.write import write
from dynident.recording.masks import moving, within
from dynident.recording.motion import Motion, MotionInParts, differentiate
from dynident.recording.parallel import FilterBlock, ParallelFilter, choose_factor
from dynident.recording.periods import Periods, mismatch, periods, require_repetition
from dynident.recording.plausibility import (
    require_motion,
    require_torque,
    resolution,
    warn_of_limited_torque,
    warn_of_missing_torque,
)
from dynident.recording.position_cutoff import (
    SpeedGain,
    common_filter,
    suited_filter,
    suited_instead,
    suited_position_cutoff,
    usual_position_cutoffs,
    with_suited_order,
)
from dynident.recording.recording import SIGNALS, LeftOut, Provenance, Recording
from dynident.recording.repetition import as_points, turning_round, turns_between
from dynident.recording.uniform import uniform
from dynident.recording.usable_rows import (
    RowCount,
    count_rows,
    rows_in_words,
    usable,
    usable_rows,
)

__all__ = [
    "COMPONENTS",
    "READABLE",
    "SIGNALS",
    "SUFFIXES",
    "UNWRAPPED",
    "Column",
    "ColumnTable",
    "Dataset",
    "FileLayout",
    "Filter",
    "FilterBlock",
    "LeftOut",
    "Motion",
    "MotionInParts",
    "Noise",
    "ParallelFilter",
    "Periods",
    "Provenance",
    "Recording",
    "RowCount",
    "SpeedGain",
    "WrenchColumns",
    "as_points",
    "central_difference",
    "choose_factor",
    "common_filter",
    "count_rows",
    "counted_window",
    "default_cutoff",
    "default_filter",
    "default_position_cutoff",
    "difference_gain",
    "differentiate",
    "filtered_alike",
    "frame_of",
    "frames_in",
    "held_gain",
    "held_torque_adjoint",
    "lowpass",
    "mismatch",
    "moving",
    "numbered",
    "open_table",
    "periods",
    "read",
    "read_wrench",
    "require_motion",
    "require_repetition",
    "require_torque",
    "resolution",
    "rows_in_words",
    "sensed_frames",
    "sound_part",
    "suited_filter",
    "suited_instead",
    "suited_position_cutoff",
    "turning_round",
    "turns_between",
    "uniform",
    "unwrapped_notes",
    "usable",
    "usable_rows",
    "usual_position_cutoffs",
    "warn_of_limited_torque",
    "warn_of_missing_torque",
    "with_suited_order",
    "within",
    "within_limits",
    "without_ends",
    "write",
]
