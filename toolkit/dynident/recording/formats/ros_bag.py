"""Bags of ROS 1 and ROS 2 in, through the package `rosbags`; no installation of ROS is needed.

Only messages `sensor_msgs/JointState` are decoded, by the definition that all versions of ROS
share: what a bag says of its own types is not taken, because code would be made from it.
"""

from __future__ import annotations

import bz2
import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from dynident import files
from dynident.data_files import natural_order
from dynident.errors import RecordingError
from dynident.recording.formats.column_table import ColumnTable, FileLayout
from dynident.recording.formats.joint_state_table import JointStates
from dynident.recording.formats.limits import (
    BAG,
    CUT,
    LARGEST_CHUNK,
    SizeLimit,
    damaged,
    require_few,
    require_unpacked,
)
from dynident.words import did_you_mean

SUFFIXES = (".bag", ".mcap", ".db3")
METADATA = "metadata.yaml"
"""What a folder holds that is a bag of ROS 2."""
_JOINT_STATE = "sensor_msgs/msg/JointState"
_COMPLETE = "is the file complete? `rosbag reindex` and `ros2 bag reindex` mend what was cut off"
_BEGINS = b"#ROSBAG V"
"""How a file of ROS 1 begins. `rosbags` reads the first line of any file to see, however long."""
_ZSTD = b"\x28\xb5\x2f\xfd"
_LEAST_ALLOWED, _MOST_PACKED = 1 << 28, 200
"""A bag unpacks to as many bytes in any case, and to as many for each that is stored."""
_MOST_OPEN = 1 << 30
"""Bytes of all chunks that are open at once."""


@dataclass
class _Allowance:
    """Bytes that a bag may still unpack to."""

    left: int
    file: str

    def take(self, size: int) -> None:
        """Count bytes as unpacked; refuses more than are left."""
        self.left -= size
        if self.left < 0:
            what = f"unpacks to more than {_MOST_PACKED} times its size"
            raise RecordingError(what, self.file, CUT)


_ALLOWANCE: ContextVar[_Allowance] = ContextVar("_ALLOWANCE")


def is_bag(path: Path) -> bool:
    """Whether a path names a bag: a file by its suffix, a folder by what is in it."""
    if path.suffix.lower() in SUFFIXES:
        return True
    return "\0" not in str(path) and (path / METADATA).exists()


def open_bag(path: Path, layout: FileLayout) -> ColumnTable:
    """Return the table of the joint states that a bag holds.

    Parameters
    ----------
    path : a file .bag (ROS 1), .mcap or .db3 (ROS 2), or the folder that ROS 2 records into.
    layout : the topic, where the bag holds joint states on several.

    Returns
    -------
    ColumnTable
        `t` in s since the first message; `q.<joint>`, `v.<joint>` and `tau.<joint>`, as far as the
        messages hold them.

    Raises
    ------
    FileError
        If it cannot be read, or is larger than allowed.
    RecordingError
        If `rosbags` is not installed, the bag is damaged, it holds no joint states or several
        topics of them, or messages are not as `JointStates` wants them.
    """
    parts = _storage(path) if path.is_dir() else [path]
    for part in parts:
        with files.open_regular(part) as stream:
            head = stream.read(len(_BEGINS))
        if not head:
            raise RecordingError("is empty", str(part), "is the file complete?")
    _require_size(path, parts)
    if path.suffix.lower() == ".bag" and path.is_file() and head != _BEGINS:
        what = "cannot be read as a bag of ROS (it does not begin as one)"
        raise RecordingError(what, str(path), _COMPLETE)
    rosbags = _rosbags(str(path))
    with _bounded(str(path), sum(part.stat().st_size for part in parts)):
        found, others = _gathered(rosbags, path, parts, layout.topic)
        table = found.table()
    digest = hashlib.sha256()
    for part in parts:
        digest.update(bytes.fromhex(files.sha256(part)))
    told = table.skipped
    return replace(
        table,
        sha256=files.sha256(path) if path.is_file() else digest.hexdigest(),
        skipped=lambda wanted: others + told(wanted),
    )


def _storage(folder: Path) -> list[Path]:
    """Files of a folder that is a bag, in the order in which they were written."""
    inside = sorted(folder.iterdir(), key=lambda one: natural_order(one.name))
    found = [one for one in inside if one.suffix.lower() in (".mcap", ".db3")]
    if not found:
        packed = [one.name for one in inside if one.suffix.lower() in (".zstd", ".zst")]
        what = "holds no file .mcap or .db3"
        remedy = f"unpack it: `zstd -d {packed[0]}`" if packed else "is it the folder of a bag?"
        raise RecordingError(what, str(folder), remedy)
    require_few(len(found), "files", str(folder))
    return found


def _require_size(path: Path, parts: list[Path]) -> None:
    size = sum(part.stat().st_size for part in parts)
    if size > BAG.stored:
        remedy = "record or filter the topic of the joint states alone"
        raise files.too_large(path, size, BAG.stored, remedy)
    for part in parts:
        if part.suffix.lower() == ".db3" and any(mark in str(part.resolve()) for mark in "?#%"):
            remedy = "rename it, or the folder"
            raise RecordingError(
                "a path with ?, # or % is no address of a database", str(part), remedy
            )


@dataclass(frozen=True)
class _Rosbags:
    """What is used of the package."""

    readers: tuple[Callable[[Path], Any], Callable[[Path], Any]]
    decoders: tuple[Callable[[bytes, str], Any], Callable[[bytes, str], Any]]


@cache
def _loaded() -> _Rosbags:
    import lz4.frame  # pyright: ignore[reportMissingImports]
    from rosbags.rosbag1 import Reader as Reader1  # pyright: ignore[reportMissingImports]
    from rosbags.rosbag1 import reader as rosbag1  # pyright: ignore[reportMissingImports]
    from rosbags.rosbag2 import Reader as Reader2  # pyright: ignore[reportMissingImports]
    from rosbags.rosbag2 import storage_mcap  # pyright: ignore[reportMissingImports]
    from rosbags.typesys import Stores, get_typestore  # pyright: ignore[reportMissingImports]

    def bounded(decompressor: Callable[[], Any]) -> Callable[..., bytes]:
        def unpack(data: bytes, size: int = LARGEST_CHUNK) -> bytes:
            return _unpacked(decompressor(), data, size)

        return unpack

    # By themselves they unpack a chunk to whatever size it has, and not to that which it says.
    rosbag1.decompressors.update(
        none=_counted, bz2=bounded(bz2.BZ2Decompressor), lz4=bounded(lz4.frame.LZ4FrameDecompressor)
    )
    storage_mcap.DECOMPRESSORS.update(
        lz4=bounded(lz4.frame.LZ4FrameDecompressor), zstd=bounded(_zstd)
    )
    one, two = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.LATEST)
    return _Rosbags((Reader1, Reader2), (one.deserialize_ros1, two.deserialize_cdr))


def _zstd() -> Any:
    try:
        from compression import zstd  # pyright: ignore[reportMissingImports]
    except ImportError:
        from backports import zstd  # pyright: ignore[reportMissingImports]
    return zstd.ZstdDecompressor()


def _unpacked(decompressor: Any, data: bytes, size: int) -> bytes:
    """What a chunk unpacks to, at most one byte more than it may have."""
    allowed = min(size, LARGEST_CHUNK)
    found = decompressor.decompress(data, max_length=allowed + 1)
    _counted(found)
    if len(found) > allowed:
        file = _ALLOWANCE.get().file
        what = f"a chunk unpacks to more than {files.size_in_words(allowed)}"
        raise RecordingError(what, file, "record or filter the topic of the joint states alone")
    return found


def _counted(data: bytes) -> bytes:
    _ALLOWANCE.get().take(len(data))
    return data


def _rosbags(file: str) -> _Rosbags:
    try:
        return _loaded()
    except ImportError:
        remedy = "pip install 'dynident[ros]'; ROS itself is not needed"
        raise RecordingError("bags of ROS need rosbags", file, remedy) from None


@contextmanager
def _bounded(file: str, stored: int) -> Iterator[None]:
    """Bound what a bag of that many bytes unpacks to."""
    size = min(_LEAST_ALLOWED + _MOST_PACKED * stored, BAG.unpacked)
    token = _ALLOWANCE.set(_Allowance(size, file))
    try:
        yield
    except Exception as error:
        told = damaged("a bag of ROS", file, error)
        if told is not error and not isinstance(error, MemoryError):
            told = RecordingError(told.what, file, _COMPLETE)
        raise told from None
    finally:
        _ALLOWANCE.reset(token)


def _gathered(
    rosbags: _Rosbags, path: Path, parts: list[Path], topic: str
) -> tuple[JointStates, tuple[str, ...]]:
    """Joint states of the topic that is asked for, or of the only one; and what else there is."""
    second = int(path.suffix.lower() != ".bag" or path.is_dir())
    reader, decode = rosbags.readers[second], rosbags.decoders[second]
    counts: dict[tuple[str, str], int] = {}
    for part in parts:
        with reader(part) as bag:
            for one in bag.connections:
                key = (one.topic, one.msgtype)
                counts[key] = counts.get(key, 0) + one.msgcount
    chosen = _topic(counts, topic, str(path))
    states = JointStates(f"{path}, topic {chosen}")
    for part in parts:
        with reader(part) as bag:
            wanted = [
                one
                for one in bag.connections
                if one.topic == chosen and one.msgtype == _JOINT_STATE
            ]
            _require_few_open(bag, str(part))
            for _, received, raw in bag.messages(wanted) if wanted else ():
                data = bytes(raw)
                if data[:4] == _ZSTD:
                    data = _unpacked(_zstd(), data, LARGEST_CHUNK)
                states.add(decode(data, _JOINT_STATE), received)
    others = {name: count for (name, _), count in counts.items() if name != chosen}
    shown = ", ".join(sorted(others)[:10]) + (", ..." if len(others) > 10 else "")
    number = f"{len(others)} other topic{'s' * (len(others) != 1)}"
    said = f"{number} with {sum(others.values())} messages: {shown}"
    return states, (said,) if others else ()


def _require_few_open(bag: Any, file: str) -> None:
    """Refuse chunks that overlap in time so much that all would be unpacked side by side."""
    chunks = getattr(getattr(bag, "storage", None), "chunks", ())
    events = [(one.message_start_time, 1, one.uncompressed_size) for one in chunks]
    events += [(one.message_end_time, 2, -one.uncompressed_size) for one in chunks]
    size = 0
    for _, _, change in sorted(events):
        size += change
        require_unpacked(size, SizeLimit(0, _MOST_OPEN), file)


def _topic(counts: dict[tuple[str, str], int], topic: str, file: str) -> str:
    """The topic of joint states that is asked for, or the only one."""
    fitting = sorted(name for name, kind in counts if kind == _JOINT_STATE)
    if topic:
        if topic in fitting:
            return topic
        kinds = [kind for name, kind in counts if name == topic]
        remedy = did_you_mean(topic, fitting, "name another topic", cutoff=0.4)
        what = f"has the type {kinds[0]}" if kinds else "is not in it"
        raise RecordingError(f"the topic '{topic}' {what}", file, remedy)
    held = [name for name in fitting if counts[name, _JOINT_STATE]] or fitting
    if not held:
        names = sorted(name for name, _ in counts)
        shown = ", ".join(names[:10]) + (", ..." if len(names) > 10 else "")
        remedy = f"its topics: {shown}" if names else "it holds no topic at all"
        raise RecordingError("holds no message sensor_msgs/JointState", file, remedy)
    if len(held) > 1:
        remedy = f'name one beside the file: topic = "{held[0]}" (`init`: --topic {held[0]})'
        raise RecordingError(f"holds joint states on {', '.join(held[:10])}", file, remedy)
    return held[0]
