"""Joint states in bags of ROS 1 and ROS 2: the recording that went in comes out, or one line."""

import bz2
import os
import sys
import tracemalloc
import warnings
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="bags need the extra `ros`, which is a part of `test`")

from dynident.errors import DynidentError, DynidentWarning, FileError, RecordingError
from dynident.recording import FileLayout, open_table, read
from dynident.recording.formats import ros_bag
from dynident.recording.formats.joint_state_table import prefixed
from dynident.study import load
from ros_bags import KINDS, TOPIC, JointMessage, messages_of, write_bag
from study_files import write_study


@pytest.fixture
def run(arm):
    """A second of the arm, without the reference, which no joint state holds."""
    return arm.cut(0, 1).replace(q_ref=None, period=None)


def same(found, expected):
    assert found.joints == expected.joints
    np.testing.assert_allclose(found.t, expected.t - expected.t[0], atol=1.1e-9)
    for signal in ("q", "v", "tau"):
        np.testing.assert_array_equal(getattr(found, signal), getattr(expected, signal))


@pytest.mark.parametrize("kind", KINDS)
def test_what_went_in_comes_out(run, tmp_path, kind):
    path = write_bag(tmp_path, kind, messages_of(run), text=7)
    found = read(path)
    same(found, run)
    assert found.name == "run" and len(found.provenance.sha256) == 64
    assert found.provenance.skipped == ("1 other topic with 7 messages: /log",)
    same(read(path, ["elbow", "shoulder"]), run.select(["elbow", "shoulder"]))
    same(read(path, layout=FileLayout(topic=TOPIC)), run)
    table = open_table(path)
    assert table.names[:4] == ("t", "q.shoulder", "q.elbow", "v.shoulder")


@pytest.mark.parametrize(
    ("kind", "packing"),
    [("bag", "BZ2"), ("bag", "LZ4"), ("mcap", "STORAGE"), ("mcap", "MESSAGE"), ("db3", "MESSAGE")],
)
def test_compressed_bags(run, tmp_path, kind, packing):
    same(read(write_bag(tmp_path, kind, messages_of(run), packing=packing)), run)


@pytest.mark.parametrize("kind", ["mcap", "db3"])
def test_the_folder_of_a_bag(run, tmp_path, kind):
    """With several files in it, as long recordings are split."""
    messages = messages_of(run)
    first = write_bag(tmp_path / "a", kind, messages[:100])
    second = write_bag(tmp_path / "b", kind, messages[100:])
    second.rename(first.with_name(f"run_10.{kind}"))
    first.rename(first.with_name(f"run_9.{kind}"))
    same(read(first.parent), run)


@pytest.mark.parametrize("kind", KINDS)
def test_messages_of_other_joints_are_left_out_and_counted(run, tmp_path, kind):
    gripper = [JointMessage(["finger"], k * 0.1 + 0.001, [1.0], [3.0], [2.0]) for k in range(5)]
    arm = messages_of(run)
    path = write_bag(tmp_path, kind, sorted(arm + gripper, key=lambda one: one.stamp or 0.0))
    found = read(path, run.joints)
    same(found, run)
    assert "5 of 255 messages: of other joints" in found.provenance.skipped
    with pytest.raises(RecordingError, match=r"message 1: holds other joints .* and no joint 'fi"):
        read(path)


def test_joints_in_another_order_are_told_by_their_names(run, tmp_path):
    messages = messages_of(run)
    for k in range(0, 250, 3):
        one = messages[k]
        messages[k] = JointMessage(
            one.names[::-1], one.stamp, one.position[::-1], one.velocity[::-1], one.effort[::-1]
        )
    same(read(write_bag(tmp_path, "mcap", messages), run.joints), run)


@pytest.mark.parametrize(
    ("theirs", "ours"),
    [
        (("panda/shoulder", "panda/elbow"), ("shoulder", "elbow")),
        (("left_arm_shoulder", "left_arm_elbow"), ("shoulder", "elbow")),
        (("shoulder", "elbow"), ("panda_shoulder", "panda_elbow")),
    ],
)
def test_prefixes(run, tmp_path, theirs, ours):
    path = write_bag(tmp_path, "mcap", messages_of(run, theirs))
    found = read(path, ours)
    same(found, run.replace(joints=ours))
    assert (f"q.{ours[0]}", f"q.{theirs[0]}", 1.0) in found.provenance.columns
    swapped = read(path, ours, {f"q.{ours[0]}": f"q.{theirs[1]}"})
    np.testing.assert_array_equal(swapped.q[:, 0], run.q[:, 1])


def test_which_prefix_is_meant():
    names = ["left_a", "left_b", "right_a", "right_b", "xa", "xb"]
    with pytest.raises(RecordingError, match="several prefixes: left_, right_"):
        prefixed(names, ["a", "b"], "bag")
    assert prefixed(names[:3], ["a", "b"], "bag") == {"a": "left_a", "b": "left_b"}
    assert prefixed(["a", *names], ["a"], "bag") == {}
    assert prefixed(["xa", "xb"], ["a", "b"], "bag") == {}
    assert prefixed(["b_1"], ["a_1", "b_1"], "bag") == {}


def test_what_is_not_reported_is_not_read(run, tmp_path):
    """Neither where a field is empty, nor where it is filled with what is no number."""
    nan = [np.nan, np.nan]
    for k, velocity in enumerate(([], nan)):
        messages = [replace(one, velocity=velocity) for one in messages_of(run)]
        (tmp_path / str(k)).mkdir()
        found = read(write_bag(tmp_path / str(k), "mcap", messages))
        assert found.v is None
        np.testing.assert_array_equal(found.tau, run.tau)


def test_without_stamps_the_time_of_receiving_is_taken_and_said(run, tmp_path):
    messages = [
        replace(one, stamp=None, received=float(t))
        for one, t in zip(messages_of(run), run.t, strict=True)
    ]
    path = write_bag(tmp_path, "mcap", messages)
    with pytest.warns(DynidentWarning, match="no message has a time stamp"):
        found = read(path)
    same(found, run)
    assert "no message has a stamp" in found.provenance.skipped[-1]


def test_topics(run, tmp_path):
    left, right = ([replace(m, topic=f"/{side}") for m in messages_of(run)] for side in "lr")
    path = write_bag(tmp_path, "mcap", left + right, text=1)
    with pytest.raises(RecordingError, match=r'states on /l, /r. name one .*: topic = "/l"'):
        read(path)
    same(read(path, layout=FileLayout(topic="/r")), run)
    for topic, message in (("/rr", "did you mean '/r'"), ("/log", "has the type std_msgs/msg/Str")):
        with pytest.raises(RecordingError, match=message):
            read(path, layout=FileLayout(topic=topic))


def messages(*stamps, **changes):
    return [JointMessage(["a"], stamp, [1.0], [], [2.0], **changes) for stamp in stamps]


BAD = {
    "no joint states": ([], "holds no message sensor_msgs/JointState. its topics: /log"),
    "no names": ([JointMessage([], 0.0)] * 3, "holds 3 messages, and none that names a joint"),
    "a field cut off": (
        [*messages(0, 1), JointMessage(["a", "b"], 2.0, [1.0, 2.0], [], [3.0])],
        "message 3: 2 joints are named, and effort has 1 values",
    ),
    "a joint missing": (
        [*messages(0), replace(messages(1)[0], names=["a", "b"], position=[1, 2], effort=[1, 2])],
        "message 1: holds other joints that are asked for, and no joint 'b'",
    ),
    "a field missing": (
        [*messages(0, 1), JointMessage(["a"], 2.0, [1.0])],
        "message 3: holds no effort, and others do",
    ),
    "a joint twice": ([JointMessage(["a", "a"], 0.0, [1, 2])], "message 1: the joint 'a' is named"),
    "a stamp missing": (messages(0.1, None, 0.2), r"message [12]: has no time stamp \(1 such"),
    "time goes back": (messages(0, 1, 0.5, received=1.0), "row 3, column t: time goes back"),
    "the same time": (messages(0, 1, 1, received=1.0), "row 3, column t: the time stamp .* twice"),
    "one message": (messages(0), "holds 1 sample"),
    "not a number": ([*messages(0), JointMessage(["a"], 1, [np.nan], [], [1.0])], "row 2.* nan is"),
    "no effort": ([JointMessage(["a"], t, [1.0]) for t in (0, 1)], "no column 'tau.a'"),
    "too many joints": (
        [JointMessage([f"j{k}" for k in range(2000)], 0.0, [0.0] * 2000)],
        "holds 6001 signals of joints, and 4096 is the limit",
    ),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", BAD)
def test_unusable_messages_are_one_line(tmp_path, kind, case):
    content, message = BAD[case]
    path = write_bag(tmp_path, kind, content, text=2)
    with pytest.raises(DynidentError, match=message) as told:
        read(path)
    assert "\n" not in str(told.value) and path.name in str(told.value)


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_bags_are_one_line(run, tmp_path, kind):
    path = write_bag(tmp_path, kind, messages_of(run), text=2)
    whole = path.read_bytes()
    random = np.random.default_rng(1)
    cuts = [whole[:n] for n in (0, 1, 9, 40, len(whole) // 2, len(whole) - 9)]
    cuts += [b"\0" * 500, whole[:40] + bytes(len(whole) - 40)]
    for _ in range(60):
        data = bytearray(whole)
        for place in random.integers(0, len(whole), 8):
            data[place] = random.integers(256)
        cuts.append(bytes(data))
    refused = 0
    for data in cuts:
        path.write_bytes(data)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DynidentWarning)
                read(path)
        except DynidentError as error:
            refused += 1
            assert "\n" not in str(error) and len(str(error)) < 600
    assert refused >= 7


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_no_regular_file_is_refused(tmp_path, kind):
    os.mkfifo(tmp_path / f"pipe.{kind}")
    (tmp_path / f"zero.{kind}").symlink_to("/dev/zero")
    (tmp_path / f"folder.{kind}").mkdir()
    (tmp_path / f"text.{kind}").write_text("t,q.a,tau.a\n")
    with (tmp_path / f"large.{kind}").open("wb") as stream:
        stream.truncate(20 << 30)
    for name, message in (
        ("pipe", "is not a regular file"),
        ("zero", "is not a regular file"),
        ("folder", "holds no file .mcap or .db3"),
        ("text", "cannot be read as a bag of ROS"),
        ("large", "holds 20 GB, and 16 GB is the limit"),
        ("a\0b", "NUL"),
    ):
        with pytest.raises(DynidentError, match=message) as told:
            read(tmp_path / f"{name}.{kind}")
        assert "\n" not in str(told.value) and "\0" not in str(told.value)


def test_folders_that_are_no_bags(run, tmp_path):
    with pytest.raises(FileError, match=r"is a folder, and .* no metadata.yaml"):
        read(tmp_path)
    (tmp_path / "metadata.yaml").touch()
    (tmp_path / "run_0.db3.zstd").touch()
    with pytest.raises(RecordingError, match=r"unpack it: `zstd -d run_0.db3.zstd`"):
        read(tmp_path)
    path = write_bag(tmp_path, "db3", messages_of(run))
    path = path.rename(path.with_name("a?b.db3"))
    with pytest.raises(RecordingError, match=r"a path with \?, # or % is no address"):
        read(path)


@pytest.mark.parametrize(
    ("kind", "packing"), [("bag", "BZ2"), ("bag", "LZ4"), ("mcap", "STORAGE"), ("db3", "MESSAGE")]
)
def test_chunks_that_unpack_to_too_much_are_refused(run, tmp_path, monkeypatch, kind, packing):
    path = write_bag(tmp_path, kind, messages_of(run), packing=packing)
    monkeypatch.setattr(ros_bag, "LARGEST_CHUNK", 60)
    with pytest.raises(RecordingError, match="a chunk unpacks to more than 60 bytes"):
        read(path)
    monkeypatch.undo()
    monkeypatch.setattr(ros_bag, "_LEAST_ALLOWED", 10)
    monkeypatch.setattr(ros_bag, "_MOST_PACKED", 0)
    with pytest.raises(RecordingError, match=r"unpacks to more than 0 times its size"):
        read(path)


def test_a_chunk_is_not_unpacked_further_than_it_says(monkeypatch):
    import lz4.frame  # pyright: ignore[reportMissingImports]
    from rosbags.rosbag1 import reader  # pyright: ignore[reportMissingImports]
    from rosbags.rosbag2 import storage_mcap  # pyright: ignore[reportMissingImports]

    ros_bag._loaded()
    monkeypatch.setattr(ros_bag, "LARGEST_CHUNK", 1 << 20)
    zeros = bytes(20 << 20)
    unpack = {
        "bz2": lambda data: reader.decompressors["bz2"](data),
        "lz4": lambda data: storage_mcap.DECOMPRESSORS["lz4"](data, 1 << 40),
    }
    for name, data in (("bz2", bz2.compress(zeros)), ("lz4", lz4.frame.compress(zeros))):
        tracemalloc.start()
        with (
            pytest.raises(RecordingError, match=r"a.bag: a chunk unpacks to more than 1 MB"),
            ros_bag._bounded("a.bag", 1 << 30),
        ):
            unpack[name](data)
        assert tracemalloc.get_traced_memory()[1] < 5 << 20
        tracemalloc.stop()


def test_chunks_that_would_all_be_open_at_once_are_refused(run, tmp_path, monkeypatch):
    path = write_bag(tmp_path, "mcap", messages_of(run))
    monkeypatch.setattr(ros_bag, "_MOST_OPEN", 10_000)
    with pytest.raises(RecordingError, match=r"kB, and 9.766 kB is the limit"):
        read(path)


def test_without_the_package_the_remedy_is_said(run, tmp_path, monkeypatch):
    path = write_bag(tmp_path, "mcap", messages_of(run))
    ros_bag._loaded.cache_clear()
    monkeypatch.setitem(sys.modules, "rosbags.rosbag1", None)
    with pytest.raises(RecordingError, match=r"need rosbags. pip install 'dynident\[ros"):
        read(path)
    monkeypatch.undo()
    same(read(path), run)


def test_a_study_of_a_bag(tmp_path):
    path = write_study(tmp_path)
    before = load(path)
    for name in ("train", "test"):
        recording = read(tmp_path / f"{name}.csv")
        write_bag(tmp_path / name, "mcap", messages_of(recording.replace(v=None)))
        said = f'file = "{name}/run"\ntopic = "{TOPIC}"'
        path.write_text(path.read_text().replace(f'file = "{name}.csv"', said))
    after = load(path)
    for one, other in zip(before.train.recordings, after.train.recordings, strict=True):
        np.testing.assert_array_equal(one.tau, other.tau)
        assert other.name == "train/run"
