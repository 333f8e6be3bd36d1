"""Loads weighed by a wrench sensor: recovery, frames, and what a motion does not tell."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dynident.errors import FitError, StudyError
from dynident.fitting.loads import Load
from dynident.fitting.wrench_sensor import SensedLoads, WrenchProblem, fit_wrench
from dynident.inertia import frame_change, margins, to_com
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from wrench_logs import CONSTANTS, CRATE, FRAME, NOISE, TOOL, N, motion, recorded, robot

PLACES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def truth(phi: np.ndarray) -> np.ndarray:
    """Mass, centre and inertia (10,) as `QUANTITIES`."""
    found = to_com(phi)
    return np.array([found.mass, *found.com, *(found.inertia_com[one] for one in PLACES)])


def weighed(*recordings: Recording, loads: tuple[Load, ...] = (), **changes) -> SensedLoads:
    return fit_wrench(WrenchProblem(robot(), FRAME, Dataset(recordings), loads, **changes))


def poses(count: int, seed: int, position_std: float = 2e-5) -> list[Recording]:
    """The arm at rest with the crate, a pose a recording."""
    rng, t = np.random.default_rng([seed, 8]), np.arange(401) / 200
    still = np.zeros((len(t), N))
    turns = rng.uniform(-1.5, 1.5, (count, N))
    return [
        recorded(
            CRATE,
            (t, np.tile(q, (len(t), 1)), still, still),
            100 * seed + number,
            position_std=position_std,
        )
        for number, q in enumerate(turns)
    ]


@cache
def one_crate() -> SensedLoads:
    return weighed(recorded(CRATE, motion(1), 1))


def test_mass_centre_and_inertia_of_what_hangs_on_the_sensor() -> None:
    found = one_crate()
    (crate,) = found.loads
    right = truth(CRATE)
    assert abs(crate.values[0] / right[0] - 1) < 0.005
    assert np.linalg.norm(crate.values[1:4] - right[1:4]) < 0.002
    np.testing.assert_allclose(crate.values[4:], right[4:], atol=0.001)
    assert np.all(np.abs(crate.values - right) < 4 * crate.sigma)
    assert crate.sigma[0] < 0.005 * right[0]
    assert crate.verdict == "possible: its pseudo-inertia is positive definite"
    assert np.all(np.abs(found.constants - CONSTANTS) < 4 * found.sigma)
    # The low-pass leaves 0.42 of white noise; noise of the positions adds to it.
    assert np.all(found.residual_std > 0.4 * NOISE)
    assert np.all(found.residual_std < 1.5 * NOISE)
    assert found.records == "what moves the load"
    assert not found.lacking


def test_without_noise_nothing_is_left() -> None:
    found = weighed(recorded(CRATE, motion(2), 2, noise=0.0, position_std=0.0))
    np.testing.assert_allclose(found.loads[0].values, truth(CRATE), rtol=2e-3, atol=2e-5)
    np.testing.assert_allclose(found.constants, CONSTANTS, atol=2e-3)


@pytest.mark.slow
def test_intervals_cover_the_truth() -> None:
    """95 % intervals of ten quantities and six constants, over twelve sensors."""
    scores = []
    for seed in range(20, 32):
        found = weighed(recorded(CRATE, motion(seed, 10.0), seed))
        (crate,) = found.loads
        scores += list((crate.values - truth(CRATE)) / crate.sigma)
        scores += list((found.constants - CONSTANTS) / found.sigma)
    inside = np.mean(np.abs(scores) < 1.96)
    assert 0.88 < inside <= 1.0  # 0.95 of 192, not all independent


def test_a_load_is_weighed_beside_what_always_hangs_there() -> None:
    found = weighed(
        recorded(TOOL, motion(3), 3),
        recorded(TOOL + CRATE, motion(4), 4, load="crate"),
        loads=(Load(name="crate"),),
    )
    tool, crate = found.loads
    assert tool.load.name == "on the sensor"
    for one, phi in ((tool, TOOL), (crate, CRATE)):
        assert abs(one.values[0] - truth(phi)[0]) < 0.005 * truth(phi)[0]
        assert np.linalg.norm(one.values[1:4] - truth(phi)[1:4]) < 0.002
    both = weighed(recorded(TOOL + CRATE, motion(4), 4, load="crate"), loads=(Load(name="crate"),))
    np.testing.assert_allclose(both.loads[0].values[0], truth(TOOL + CRATE)[0], rtol=0.005)


def test_what_is_known_of_a_load_is_taken() -> None:
    known = truth(CRATE)
    load = Load(name="crate", mass=known[0], centre=tuple(known[1:4]))
    found = weighed(recorded(CRATE, motion(5), 5, load="crate"), loads=(load,))
    (crate,) = found.loads
    np.testing.assert_allclose(crate.values[:4], known[:4], rtol=1e-12)
    np.testing.assert_array_equal(crate.sigma[:4], 0.0)
    np.testing.assert_allclose(crate.values[4:], known[4:], atol=0.001)
    free = weighed(recorded(CRATE, motion(5), 5, load="crate"), loads=(Load(name="crate"),))
    assert np.all(crate.sigma[4:] < free.loads[0].sigma[4:])


def test_a_load_is_stated_in_the_frame_of_its_link() -> None:
    (sensor,) = (one for one in robot().links if one.name == FRAME)
    found = weighed(
        recorded(CRATE, motion(5), 5, load="crate"), loads=(Load(name="crate", link="l5"),)
    )
    right = truth(frame_change(sensor.R, sensor.p) @ CRATE)
    assert np.linalg.norm(found.loads[0].values[1:4] - right[1:4]) < 0.002
    assert "'l5'" in found.loads[0].table().title


def test_a_sensor_that_records_what_the_load_does_is_told_by_the_mass() -> None:
    one = recorded(CRATE, motion(6), 6)
    forth, back = weighed(one), weighed(one.replace(tau=-one.tau))
    assert back.records == "what the load does"
    np.testing.assert_allclose(back.loads[0].values, forth.loads[0].values, rtol=1e-9, atol=1e-12)
    # They are constants of what is recorded: what is subtracted from it.
    np.testing.assert_allclose(back.constants, -forth.constants, rtol=1e-6)


@pytest.mark.parametrize("position_std", [0.0, 2e-5, 3e-4])
@pytest.mark.slow
def test_poses_at_rest_tell_no_inertia(position_std: float) -> None:
    """Neither exact encoders nor noisy ones, whose noise looks like accelerations."""
    found = weighed(*poses(12, 11, position_std))
    (crate,) = found.loads
    assert np.isnan(crate.values[4:]).all()
    assert abs(crate.values[0] / truth(CRATE)[0] - 1) < 0.005
    assert np.linalg.norm(crate.values[1:4] - truth(CRATE)[1:4]) < 0.002
    assert crate.verdict.startswith("not judged")
    assert "Inertia shows where the sensor turns fast" in " ".join(found.table().notes)
    assert crate.possible is None


def test_one_pose_tells_nothing() -> None:
    with pytest.raises(FitError, match="do not tell a mass from its constants"):
        weighed(*poses(1, 5))


def test_a_body_that_cannot_be_comes_with_the_nearest_that_can() -> None:
    """A rod, so thin that noise makes one of its moments negative."""
    rod = np.array([1.2, 0, 0, 0.06, 0.008, 0, 0.008, 0, 0, 1e-6])
    for seed in range(40, 60):
        (one,) = weighed(recorded(rod, motion(seed, 8.0, 0.4), seed)).loads
        if not one.is_consistent:
            break
    assert not one.is_consistent
    assert one.possible is not None
    assert margins(one.possible.phi).consistent
    assert one.possible.certificate.optimal
    assert one.possible.distance < 5
    # What the data know well hardly moves.
    assert abs(one.possible.phi[0] - one.phi[0]) < 3 * one.sigma[0]
    assert one.table().columns[-1] == "possible"
    assert one.to_dict()["nearest_possible"]["certificate"]["optimal"]


@pytest.mark.slow
def test_noise_of_short_records_is_no_load_that_moves() -> None:
    """Of 3 s little is known in the band of the motion: it is large by chance."""
    short = [weighed(recorded(CRATE, motion(50 + seed, 3.0), seed)) for seed in range(12)]
    assert sum(one.lacking for one in short) <= 1


def test_something_that_pulls_widens_the_errors() -> None:
    """A cable: a force that grows with the position of a joint."""
    one = recorded(CRATE, motion(7), 7)
    tau = np.array(one.tau)
    tau[:, N] += 6.0 * np.sin(3.0 * one.q[:, 3])
    pulled = weighed(one.replace(tau=tau))
    assert pulled.lacking
    (crate,) = pulled.loads
    free = weighed(one)
    assert not free.lacking
    assert np.all(crate.sigma >= 1.5 * free.loads[0].sigma)


def test_a_jittered_clock_does_not_matter() -> None:
    t, q, v, a = motion(8)
    rng = np.random.default_rng(2)
    jittered = t + 1e-3 * rng.uniform(-1, 1, len(t))
    from scipy.interpolate import CubicSpline

    path = (jittered, *(CubicSpline(t, x)(jittered) for x in (q, v, a)))
    with pytest.warns(UserWarning, match="jittered"):
        found = weighed(recorded(CRATE, path, 8))
    right = truth(CRATE)
    assert abs(found.loads[0].values[0] / right[0] - 1) < 0.005
    assert np.linalg.norm(found.loads[0].values[1:4] - right[1:4]) < 0.002


def test_a_sensor_is_at_a_link_behind_the_last_joint() -> None:
    data = Dataset((recorded(CRATE, motion(1), 1),))
    with pytest.raises(StudyError, match="no link 'nowhere'"):
        WrenchProblem(robot(), "nowhere", data)
    with pytest.raises(StudyError, match="the joint 'j3' moves what hangs on the link 'l2'"):
        WrenchProblem(robot(), "l2", data)
    with pytest.raises(StudyError, match="no joint moves the link 'base'"):
        WrenchProblem(robot(), "base", data)
    with pytest.raises(StudyError, match="does not move with the sensor"):
        WrenchProblem(robot(), FRAME, data, (Load(name="crate", link="l2"),))


def test_gravity_is_the_robots() -> None:
    """The same wrench on a robot that hangs from the ceiling: gravity points the other way."""
    one = recorded(CRATE, motion(9), 9)
    upside = Robot(robot().name, robot().joints, robot().links, gravity=-robot().gravity)
    found = fit_wrench(WrenchProblem(upside, FRAME, Dataset((one,))))
    assert found.residual_std[0] > 5 * weighed(one).residual_std[0]


def test_known_loads_alone_leave_nothing_to_weigh() -> None:
    known = truth(CRATE)
    load = Load(name="crate", mass=known[0], centre=tuple(known[1:4]), inertia=tuple(known[4:]))
    with pytest.raises(FitError, match="every load is known"):
        weighed(recorded(CRATE, motion(1), 1, load="crate"), loads=(load,))
    assert replace(load, mass=None).is_known is False
