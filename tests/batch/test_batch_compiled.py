"""Compiled functions: the same numbers to the bit, or a reason and the replay."""

import ctypes
import os
import stat
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from random_trees import random_tree, urdf

from chains import chain
from dynident.batch import c_function, compiler, evaluations, kernel, wish
from dynident.batch.c_source import ENTRY, c_source
from dynident.batch.kernel import Kernel
from dynident.batch.newton_euler import regressor_equations, torque_equations
from dynident.batch.tape import tape_of
from dynident.errors import SettingError
from dynident.robot import Robot

needs_compiler = pytest.mark.skipif(compiler.compiler() is None, reason="no C compiler")


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("DYNIDENT_COMPILE", "auto")


def torque_of(robot: Robot) -> Kernel:
    return Kernel(torque_equations(robot.joint_tree), (robot.n,))


def answer(found: Kernel, robot: Robot, samples: int = 20):
    return found(*robot.random_motion(0, samples), parameters=robot.theta.tolist())


@needs_compiler
def test_compiled_is_the_replay_to_the_bit(monkeypatch):
    """For every number of samples beside the eight and the chunk that the code goes by."""
    robot = Robot.from_text(urdf(random_tree(1, moving=6)), gravity=(3, -9, 1.5))
    tree = robot.joint_tree
    columns = tuple(range(10 * robot.n))
    for made, parameters in (
        (Kernel(regressor_equations(tree, columns), (robot.n, len(columns))), ()),
        (Kernel(torque_equations(tree), (robot.n,)), robot.theta.tolist()),
    ):
        assert len(made._tape.steps) > 600, "more than one part"
        for samples in [*range(1, 18), 255, 256, 257, 263, 264, 265, 700]:
            motion = robot.random_motion(samples, samples)
            monkeypatch.setenv("DYNIDENT_COMPILE", "never")
            want = made(*motion, parameters=parameters)
            assert made.evaluation.way == "replayed"
            monkeypatch.setenv("DYNIDENT_COMPILE", "always")
            np.testing.assert_array_equal(made(*motion, parameters=parameters), want)
            assert made.evaluation.way == "compiled"


@needs_compiler
def test_arrays_of_any_memory_order_are_the_same(monkeypatch):
    robot = chain(2)
    motion = [np.asfortranarray(x) for x in robot.random_motion(0, 30)]
    every_other = [np.repeat(x, 2, axis=0)[::2] for x in motion]
    want = answer(torque_of(robot), robot, 30)
    monkeypatch.setenv("DYNIDENT_COMPILE", "always")
    for given in (motion, every_other):
        np.testing.assert_array_equal(
            torque_of(robot)(*given, parameters=robot.theta.tolist()), want
        )


@needs_compiler
@pytest.mark.parametrize("wish", ["never", "always"])
def test_out_of_any_memory_and_precision_is_written(wish, monkeypatch):
    monkeypatch.setenv("DYNIDENT_COMPILE", wish)
    robot = chain(2)
    made = Kernel(regressor_equations(robot.joint_tree, tuple(range(20))), (2, 20))
    motion = robot.random_motion(0, 30)
    want = made(*motion)
    beyond = np.full((40, 2, 20), 7.0)
    raw = np.zeros(30 * 40 * 8 + 1, dtype=np.uint8)[1:]
    records = np.zeros((30, 2, 20), dtype=[("x", "f8"), ("k", "i4")])
    for out in (
        beyond[:30],
        np.full(want.shape, np.nan, order="F"),
        beyond[10:].astype(np.float32),
        beyond[10:].astype(">f8"),
        raw.view(float).reshape(30, 2, 20),
        records["x"],
    ):
        assert made(*motion, out=out) is out
        np.testing.assert_array_equal(out, want.astype(out.dtype))
    assert np.all(beyond[30:] == 7.0)
    for wrong, error in ((beyond, ValueError), (beyond[:30].astype(int), TypeError)):
        with pytest.raises(error):
            made(*motion, out=wrong)


@needs_compiler
def test_compiles_when_as_much_was_replayed_and_finds_it_again(monkeypatch):
    monkeypatch.setattr(kernel, "COMPILE_AFTER", 50)
    monkeypatch.setattr(kernel, "LOOK_AFTER", 10)
    robot = chain(2)
    first = torque_of(robot)
    answer(first, robot, 49)
    assert str(first.evaluation) == "replayed (fewer than 50 samples)"
    answer(first, robot, 1)
    assert str(first.evaluation) == "compiled (from 50 samples on)"
    second = torque_of(robot)
    answer(second, robot, 9)
    assert second.evaluation.way == "replayed"
    answer(second, robot, 1)
    assert str(second.evaluation) == "compiled (from the cache)"
    assert {first.evaluation, second.evaluation} <= set(evaluations())


@pytest.mark.skipif(os.name == "nt", reason="shell scripts as compilers")
@pytest.mark.parametrize("fault", ["none there", "fails", "makes rubbish", "no cache"])
def test_what_cannot_be_compiled_is_replayed_with_a_reason(fault, tmp_path, monkeypatch):
    robot = chain(2)
    want = answer(torque_of(robot), robot)
    program = tmp_path / "cc"
    bodies = {
        "fails": "echo 'no room left' >&2; exit 1",
        "makes rubbish": 'while [ "$1" != -o ]; do shift; done; echo rubbish > "$2"',
    }
    program.write_text(f"#!/bin/sh\n{bodies.get(fault, 'exit 3')}\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    if fault == "no cache":
        (tmp_path / "cache").write_text("a file where the folder should be")
    reasons = {
        "none there": "there is no C compiler",
        "fails": "the compiler failed: no room left",
        "makes rubbish": "OSError",
        "no cache": "Error",
    }
    there = None if fault == "none there" else str(program)
    monkeypatch.setattr(compiler, "compiler", lambda: there)
    monkeypatch.setenv("DYNIDENT_COMPILE", "always")
    found = torque_of(robot)
    for _ in range(2):
        np.testing.assert_array_equal(answer(found, robot), want)
        assert found.evaluation.way == "replayed"
        assert reasons[fault] in found.evaluation.reason
    left = tmp_path / "cache" / "dynident" / "batch"
    assert not left.exists() or not list(left.glob("*.tmp"))


@needs_compiler
def test_a_recursion_is_compiled_where_nothing_can_be_kept(tmp_path, monkeypatch):
    """Its results do not depend on where its user may write; and nothing stays behind."""
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null/x")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    found = c_function("double of_the_moment(void) { return 2.0; }", "of_the_moment")
    assert found is not None
    found.restype = ctypes.c_double
    assert found() == 2.0 and not list(tmp_path.iterdir())
    assert c_function("no C", "of_the_moment") is None


@needs_compiler
def test_a_broken_file_in_the_cache_is_made_anew(monkeypatch):
    monkeypatch.setattr(kernel, "LOOK_AFTER", 1)
    robot = chain(2)
    want = answer(torque_of(robot), robot)
    source = c_source(tape_of(torque_equations(robot.joint_tree)))
    place = compiler._place(source, "-O1")
    place.parent.mkdir(parents=True, mode=0o700)
    place.write_bytes(b"half a library")
    place.chmod(0o600)
    found = torque_of(robot)
    np.testing.assert_array_equal(answer(found, robot), want)
    assert found.evaluation.way == "compiled"


@needs_compiler
@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="no owners of files")
@pytest.mark.parametrize("fault", ["file", "folder", "no file", "owner"])
def test_what_others_may_write_is_not_loaded(fault, tmp_path, monkeypatch):
    robot = chain(2)
    want = answer(torque_of(robot), robot)
    monkeypatch.setenv("DYNIDENT_COMPILE", "always")
    first = torque_of(robot)
    answer(first, robot)
    assert first.evaluation.way == "compiled"
    (place,) = (tmp_path / "cache" / "dynident" / "batch").iterdir()
    assert stat.S_IMODE(place.stat().st_mode) == 0o700
    if fault == "owner":
        own = os.geteuid()
        monkeypatch.setattr(os, "geteuid", lambda: own + 1)
    elif fault == "file":
        place.chmod(0o720)
    else:
        place.parent.chmod(0o702)
    if fault == "no file":
        place.unlink()
    monkeypatch.setattr(compiler.ctypes, "CDLL", lambda _: pytest.fail("loaded"))
    found = torque_of(robot)
    np.testing.assert_array_equal(answer(found, robot), want)
    assert found.evaluation.way == "replayed"
    blamed = place if fault == "file" else place.parent
    what = "belongs to another user" if fault == "owner" else "may be written by other users"
    assert found.evaluation.reason == f"{blamed} {what}"


X86 = "model name\t: A\ncpu MHz\t\t: 2596.098\nflags\t\t: sse2 avx2\n"
ARM = "BogoMIPS\t: 50.00\nFeatures\t: fp asimd sve\nCPU implementer\t: 0x41\nCPU part\t: 0xd40\n"


@pytest.mark.parametrize(
    ("text", "change"),
    [(X86, ("avx2", "avx")), (ARM, ("sve", "")), (ARM, ("0xd40", "0xd0c")), ("", None)],
    ids=["x86", "arm", "another arm", "unknown"],
)
def test_a_library_is_for_its_processor_alone(text, change, tmp_path, monkeypatch):
    monkeypatch.setattr(compiler, "_processor", compiler._processor.__wrapped__)
    monkeypatch.setattr(compiler, "_CPU_INFO", tmp_path / "cpuinfo")
    if change is None:
        assert compiler._tuning() == ()
        return
    places = []
    for said in (
        text,
        text.replace("2596", "2600").replace("50.00", "60.00"),
        text.replace(*change),
    ):
        compiler._CPU_INFO.write_text(said)
        assert compiler._tuning() == ("-march=native",)
        places.append(compiler._place("source", "-O1"))
    assert places[0] == places[1] != places[2]


@needs_compiler
def test_many_may_compile_the_same_at_once(tmp_path):
    source = c_source(tape_of(torque_equations(chain(2).joint_tree)))
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: compiler.compiled(source, ENTRY), range(4)))
    assert all(callable(one) for one in found)
    names = [path.suffix for path in (tmp_path / "cache" / "dynident" / "batch").iterdir()]
    assert names == [".so"]


def test_the_environment_says_when_to_compile(monkeypatch):
    for said in ("never", "auto", "always"):
        monkeypatch.setenv("DYNIDENT_COMPILE", said)
        assert wish() == said
    for empty in ("", None):
        if empty is None:
            monkeypatch.delenv("DYNIDENT_COMPILE")
        else:
            monkeypatch.setenv("DYNIDENT_COMPILE", empty)
        assert wish() == "auto"
    monkeypatch.setenv("DYNIDENT_COMPILE", "yes")
    with pytest.raises(SettingError, match="'yes' is none of never, auto, always"):
        answer(torque_of(chain(2)), chain(2))


def test_a_wrong_word_ends_the_command_with_one_line(monkeypatch):
    environment = {**os.environ, "DYNIDENT_COMPILE": "sometimes"}
    command = [sys.executable, "-m", "dynident.cli", "check", "nothing.urdf"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 2 and not done.stdout
    (line,) = done.stderr.splitlines()
    assert "DYNIDENT_COMPILE: 'sometimes' is none of" in line
