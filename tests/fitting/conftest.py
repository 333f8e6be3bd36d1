from collections.abc import Iterator

import pytest

from chains import chain_text, estimated, recorded
from dynident.fitting import Estimate
from dynident.robot import Robot


@pytest.fixture(scope="module")
def client() -> Iterator:
    """The client of a cluster of two processes on this machine.

    No longer than a file: with nothing to do it takes a twelfth of a processor all the same.
    """
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    dask = pytest.importorskip("dask")
    with (
        # What kills a process is not given to the next one, which would kill that, too.
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.fixture(scope="session")
def chain_estimate() -> Estimate:
    """Three links, an impossible estimate."""
    robot = Robot.from_text(chain_text(3))
    estimate = estimated(robot, recorded(robot))
    assert estimate.inconsistent_links()
    return estimate
