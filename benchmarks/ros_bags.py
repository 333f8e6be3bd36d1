"""Bags of ROS 1 and 2, of joint states and of what comes between them; used by the tests, too."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

START = 1_700_000_000_123_456_789
"""Time of the first message, ns."""
TOPIC = "/joint_states"
KINDS = ("bag", "mcap", "db3")


@dataclass(frozen=True)
class JointMessage:
    """One message: what is empty is not reported; `stamp` in s since the start, None for zero."""

    names: Sequence[str]
    stamp: float | None
    position: Sequence[float] = ()
    velocity: Sequence[float] = ()
    effort: Sequence[float] = ()
    topic: str = TOPIC
    received: float | None = None


def messages_of(recording, names: Sequence[str] | None = None) -> list[JointMessage]:
    """A recording as messages, the joints under other names if wished."""
    return [
        JointMessage(
            names or recording.joints,
            float(t - recording.t[0]),
            recording.q[k],
            () if recording.v is None else recording.v[k],
            recording.tau[k],
        )
        for k, t in enumerate(recording.t)
    ]


def write_bag(
    folder: Path, kind: str, messages: Iterable[JointMessage], *, packing: str = "", text: int = 0
) -> Path:
    """Write a bag: `kind` is its suffix, `packing` how it is compressed; with texts between.

    Returns
    -------
    The file; that of ROS 2 lies in a folder with its description beside it.
    """
    from rosbags.rosbag1 import Writer as Writer1  # pyright: ignore[reportMissingImports]
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin  # pyright: ignore[reportMissingImports]
    from rosbags.rosbag2 import Writer as Writer2  # pyright: ignore[reportMissingImports]
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.LATEST)
    path = folder / "run.bag" if kind == "bag" else folder / "run"
    if kind == "bag":
        writer = Writer1(path)
        if packing:
            writer.set_compression(Writer1.CompressionFormat[packing])
        encode = store.serialize_ros1
    else:
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        writer = Writer2(path, version=9, storage_plugin=plugin)
        if packing:
            writer.set_compression(CompressionMode[packing], CompressionFormat.ZSTD)
        encode = store.serialize_cdr
    state, string = "sensor_msgs/msg/JointState", "std_msgs/msg/String"
    connections = {}
    with writer:
        for k in range(text):
            if string not in connections:
                connections[string] = writer.add_connection("/log", string, typestore=store)
            raw = encode(store.types[string](data=f"line {k}"), string)
            writer.write(connections[string], START + k, raw)
        for one in messages:
            if one.topic not in connections:
                connections[one.topic] = writer.add_connection(one.topic, state, typestore=store)
            raw = encode(_message(store, one, kind), state)
            at = one.received if one.received is not None else (one.stamp or 0.0) + 1e-3
            writer.write(connections[one.topic], START + round(at * 1e9), raw)
    return path if kind == "bag" else path / f"run.{kind}"


def _message(store, one: JointMessage, kind: str):
    ns = 0 if one.stamp is None else START + round(one.stamp * 1e9)
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
    sequence = {"seq": 0} if kind == "bag" else {}
    return types["sensor_msgs/msg/JointState"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="", **sequence),
        name=list(one.names),
        position=np.array(one.position, dtype=np.float64),
        velocity=np.array(one.velocity, dtype=np.float64),
        effort=np.array(one.effort, dtype=np.float64),
    )
