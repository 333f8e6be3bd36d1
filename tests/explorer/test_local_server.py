"""Ctrl-C ends the page, whatever goes on at that moment."""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Iterator

import pytest

import dynident as di
from dynident.explorer import explore
from dynident.explorer.local_access import ADDRESS
from dynident.explorer.local_server import LocalServer
from study_files import write_study


class _Interrupting:
    """Has Ctrl-C arrive while it is finalised, where what it raises is lost."""

    def __del__(self) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000):  # the handler runs between two steps of Python
            pass


@pytest.fixture
def server(tmp_path) -> LocalServer:
    study = di.load(write_study(tmp_path))
    found = explore(study, di.diagnose(study.model, study.train, study.test))
    found.stop()
    return LocalServer(found.versions)


@pytest.fixture
def handlers() -> Iterator[None]:
    """Have the handlers that a command begins with, and those of the tests after it."""
    kinds = signal.SIGINT, signal.SIGALRM
    before = [signal.getsignal(kind) for kind in kinds]
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.alarm(0)
    for kind, handler in zip(kinds, before, strict=True):
        signal.signal(kind, handler)


@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="no alarms here")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.slow
def test_ctrl_c_is_not_lost_while_an_object_is_finalised(server, handlers):
    calls = []

    def alarm(number: int, frame: object) -> None:
        calls.append(number)
        if len(calls) > 1:
            raise TimeoutError("Ctrl-C did not end it")
        signal.alarm(20)
        _Interrupting()

    signal.signal(signal.SIGALRM, alarm)
    held = socket.create_connection((ADDRESS, server.port))  # a browser that asks for nothing yet
    signal.alarm(1)
    server.serve()
    held.close()
    assert len(calls) == 1
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
