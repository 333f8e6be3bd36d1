"""Instruments from the simulated loop: right where least squares is not, and honest about it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynident as di
import loops
from dynident.closed_loop import Controller
from dynident.errors import DynidentError, FitError, SimulationError
from dynident.fitting import IV, LeastSquares, SimulatedLoop
from dynident.fitting.history import Ending
from dynident.model import Model
from dynident.recording import Dataset, Filter, Noise

FILTERED = Filter(position_cutoff_hz=20.0, cutoff_hz=8.0, rate_hz=20.0)
TIGHT = 1e-12


@pytest.fixture(scope="module")
def quiet() -> Dataset:
    return loops.dataset(loops.experiment(0, 0.0, coulomb=True), FILTERED)


@pytest.fixture(scope="module")
def noisy() -> Dataset:
    return loops.dataset(loops.experiment(1, 3e-5))


@pytest.mark.parametrize(("coulomb", "rate"), [(False, 200.0), (True, 1000.0)])
def test_without_noise_it_is_least_squares(coulomb, rate):
    """To 1e-6; dry friction at 200 Hz misses that: sampling leaves a residual at reversals."""
    loop = replace(loops.LOOP, rate_hz=rate)
    dataset = loops.dataset(loops.experiment(0, 0.0, coulomb=coulomb, controller=loop))
    model = loops.model(coulomb=coulomb)
    ours = IV(loop, tolerance=TIGHT).fit(model, dataset)  # both of every row
    window = _window(dataset, model)
    same = replace(dataset, recordings=tuple(r.replace(window=window) for r in dataset.recordings))
    theirs = LeastSquares().fit(model, same)
    assert ours.rows == theirs.rows
    # Each parameter by the torque that it makes, so that units do not decide.
    scale = theirs.basis.scale
    torque = np.linalg.norm(scale * theirs.values)
    assert np.max(scale * np.abs(ours.values - theirs.values)) < 1e-6 * torque


def _window(dataset: Dataset, model: Model) -> tuple[float, float]:
    """What the loop's transient leaves."""
    from dynident.fitting.instrumental.source import Guess

    guess = Guess(loops.truth(model), (loops.truth(model),))
    (cut,) = SimulatedLoop(loops.LOOP).prepare(model, dataset, guess).measured.recordings
    assert cut.window is not None
    return cut.window


@pytest.mark.slow
def test_two_starts_reach_the_same_fixed_point(quiet):
    model = loops.model(coulomb=True)
    found = [
        di.fit(model, quiet, IV(loops.LOOP, start=start, tolerance=TIGHT)).values
        for start in ("least_squares", "regular")
    ]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


@pytest.mark.parametrize("start", ["least_squares", "description", "regular"])
def test_noise_that_ruins_least_squares_is_mended_in_three_iterations(noisy, start):
    model = loops.model(coulomb=False)
    true = loops.inertial(loops.truth(model), model)
    plain = loops.inertial(di.fit(model, noisy).values, model)
    found = di.fit(model, noisy, IV(SimulatedLoop(loops.LOOP, loops.FREQUENCY_HZ), start=start))
    mended = loops.inertial(found.values, model)
    assert found.history is not None and found.history.ending is Ending.CONVERGED
    assert len(found.history.rounds) <= 3
    assert np.linalg.norm(plain - true) > 0.2 * np.linalg.norm(true)
    assert np.linalg.norm(mended - true) < 0.005 * np.linalg.norm(true)


def test_half_of_the_bandwidth_will_do(noisy):
    model = loops.model(coulomb=False)
    true = loops.inertial(loops.truth(model), model)
    half = tuple(f / 2 for f in loops.FREQUENCY_HZ)
    found = di.fit(model, noisy, IV(SimulatedLoop(loops.LOOP, half), start="regular"))
    mended = loops.inertial(found.values, model)
    assert np.linalg.norm(mended - true) < 0.01 * np.linalg.norm(true)


def test_one_diagram_serves_all_iterations(noisy):
    from dynident.fitting.instrumental.source import Guess

    model = loops.model(coulomb=True)
    start = loops.truth(model)
    source = SimulatedLoop(loops.LOOP).prepare(model, noisy, Guess(start, (start,)))
    for share in (1.0, 0.7, 1.3, 0.9):
        source.at(share * start)
    assert source.builds == 1


def test_a_consistent_lift_gives_the_same_estimate(noisy):
    model = loops.model(coulomb=False)
    plain = di.fit(model, noisy, IV(loops.LOOP))
    lifted = di.fit(model, noisy, IV(SimulatedLoop(loops.LOOP, lift="consistent")))
    np.testing.assert_allclose(lifted.values, plain.values, rtol=2e-3, atol=2e-4)


def test_a_start_that_cannot_move_is_projected(noisy):
    """Negative inertia everywhere: the nearest possible robot is simulated in its place."""
    model = loops.model(coulomb=False)
    first = di.fit(model, noisy)
    values = first.values.copy()
    values[: model.base.rank] *= -1.0
    found = di.fit(model, noisy, IV(loops.LOOP, start=replace(first, values=values)))
    assert found.history is not None and found.history.rounds[0].way.projected
    assert any("nearest possible robot" in note for note in found.notes)
    true = loops.inertial(loops.truth(model), model)
    assert np.linalg.norm(loops.inertial(found.values, model) - true) < 0.01 * np.linalg.norm(true)


# --- what cannot work gets a clear line and a status -------------------------------------------


def test_a_controller_that_is_not_the_recorded_one_is_doubted(noisy):
    slow = replace(loops.LOOP, kp=tuple(k / 40 for k in loops.LOOP.kp))
    found = di.fit(loops.model(coulomb=False), noisy, IV(slow))
    assert found.history is not None and found.history.ending is Ending.DOUBTFUL_LOOP
    assert any("is this the controller" in note for note in found.notes)
    assert "doubtful loop" in found.status


def test_an_unstable_loop_is_refused(noisy):
    wild = replace(loops.LOOP, kd=tuple(40 * k for k in loops.LOOP.kd))
    with pytest.raises(
        SimulationError, match=r"diverges|oscillates|cannot be integrated"
    ) as caught:
        di.fit(loops.model(coulomb=False), noisy, IV(wild))
    assert "\n" not in str(caught.value)


def test_saturation_is_told(noisy):
    tired = replace(loops.LOOP, limit=(4.0, 0.4))
    found = di.fit(loops.model(coulomb=False), noisy, IV(tired))
    assert any("at its limit" in note for note in found.notes)


def test_a_missing_reference_is_named(noisy):
    bare = Dataset(tuple(r.replace(q_ref=None) for r in noisy.recordings), Filter())
    with pytest.raises(SimulationError, match=r"no reference.*q_ref\.shoulder"):
        di.fit(loops.model(coulomb=False), bare, IV(loops.LOOP))


def test_a_recording_shorter_than_the_transient_is_refused():
    brief = loops.dataset(loops.experiment(1, 0.0, seconds=0.45))
    with pytest.raises(FitError, match="shorter than the loop's transient"):
        di.fit(loops.model(coulomb=False), brief, IV(loops.LOOP))


def test_a_controller_for_another_robot_is_refused(noisy):
    other = replace(loops.LOOP, kp=(1.0,), kd=(1.0,))
    with pytest.raises(DynidentError, match="1 joints for a robot of 2"):
        di.fit(loops.model(coulomb=False), noisy, IV(other))


def test_a_joint_without_position_gain_is_named(noisy):
    loose = replace(loops.LOOP, kp=(loops.LOOP.kp[0], 0.0))
    with pytest.raises(SimulationError, match="kp = 0 at joint 'elbow'"):
        di.fit(loops.model(coulomb=False), noisy, IV(loose))


def test_lost_rank_is_refused_by_name(noisy):
    """An elbow that never moved, with instruments that do: no direction is made up."""
    (recording,) = noisy.recordings
    still = recording.replace(q_ref=recording.q_ref * (1.0, 0.0), q=recording.q * (1.0, 0.0))
    with pytest.raises(FitError, match=r"rank of the measured regressor is \d, that of the instr"):
        di.fit(loops.model(coulomb=False), Dataset((still,), Filter()), IV(loops.LOOP))


def test_history_prints_saves_and_is_left_out_when_read_back(noisy, tmp_path):
    found = di.fit(loops.model(coulomb=True), noisy, IV(loops.LOOP))
    assert "regressor simulated" in found.summary() and "textbook" in found.summary()
    back = di.load_estimate(found.save(tmp_path / "estimate.json"))
    np.testing.assert_array_equal(back.values, found.values)
    assert back.history is None and back.status == found.status


def test_a_start_that_noise_has_emptied_gives_way_to_the_regular_one():
    """Noise of 3e-3 rad leaves least squares next to no inertia: not worth simulating."""
    quiet = loops.dataset(loops.experiment(1, 0.0))
    (one,) = quiet.recordings
    noise = 3e-3 * np.random.default_rng(0).standard_normal(one.q.shape)
    noisy = replace(quiet, recordings=(one.replace(q=one.q + noise),))
    model = loops.model(coulomb=False)
    found = di.fit(model, noisy, IV(loops.LOOP))
    assert found.history is not None and found.history.start_name.startswith("regular")
    true = loops.inertial(loops.truth(model), model)
    assert np.linalg.norm(loops.inertial(found.values, model) - true) < 0.2 * np.linalg.norm(true)


@pytest.mark.parametrize("kind", ["cascade", "computed_torque", "drive"])
def test_every_controller_keeps_its_poles(kind):
    """The same poles stated in other ways: the regular start's gains follow in each."""
    w = 2 * np.pi * np.array(loops.FREQUENCY_HZ)
    inertia = np.array([1.36, 0.0621])
    if kind == "cascade":
        kp, kv = tuple(w / 2), tuple(2 * inertia * w)
        controller = Controller(kind="cascade", rate_hz=loops.RATE, kp=kp, kv=kv)
    elif kind == "computed_torque":
        controller = Controller(kind=kind, rate_hz=loops.RATE, kp=tuple(w**2), kd=tuple(2 * w))
    else:
        kp, kd = (tuple(np.array(k) / 5) for k in (loops.LOOP.kp, loops.LOOP.kd))
        controller = replace(loops.LOOP, kp=kp, kd=kd, drive_gain=(5.0, 5.0))
    noisy = loops.dataset(loops.experiment(2, 3e-5, controller=controller))
    model = loops.model(coulomb=False)
    true = loops.inertial(loops.truth(model), model)
    for instruments in (SimulatedLoop(controller), SimulatedLoop(controller, loops.FREQUENCY_HZ)):
        found = di.fit(model, noisy, IV(instruments, start="regular"))
        assert found.history is not None and found.history.ending is Ending.CONVERGED
        error = np.linalg.norm(loops.inertial(found.values, model) - true)
        assert error < 0.005 * np.linalg.norm(true)


@pytest.mark.parametrize(
    "settings", [Filter(), replace(FILTERED, difference_order=2)], ids=["unfiltered", "filtered"]
)
def test_the_bias_of_sampling_is_foreseen(settings):
    """Without noise the whole error is that of differences and held torques: known to 5 %."""
    dataset = loops.dataset(loops.experiment(0, 0.0, coulomb=True, seconds=20.0), settings)
    model = loops.model(coulomb=True)
    found = IV(loops.LOOP).fit(model, dataset)  # of every row, those around reversals, too
    assert found.history is not None
    error, foreseen = found.values - loops.truth(model), found.history.sampling_bias
    assert np.linalg.norm(error - foreseen) < 0.05 * np.linalg.norm(error)
    assert any("Sampling" in note for note in found.notes)


@pytest.mark.parametrize(("order", "said"), [(2, True), (4, False)])
def test_values_that_sampling_shifts_beyond_sigma_come_with_a_warning_first(order, said):
    noisy = loops.experiment(0, 1e-6, coulomb=False, seconds=20.0)
    data = loops.dataset(noisy, Filter(difference_order=order))
    found = di.fit(loops.model(coulomb=False), data, IV(loops.LOOP))
    assert ("Sampling" in found.headline) is said
    assert ("difference_order = 4" in str(found)) is said


def test_without_noise_there_is_no_sigma_to_be_shifted_by():
    exact = Noise(np.zeros(2), np.zeros(2))
    data = loops.dataset(loops.experiment(0, 0.0, seconds=20.0), Filter(difference_order=2))
    found = di.fit(loops.model(coulomb=False), replace(data, noise=exact), IV(loops.LOOP))
    assert "Sampling" not in found.headline


def test_differences_of_high_order_leave_less_of_that_bias():
    dataset = loops.dataset(loops.experiment(0, 0.0, coulomb=True, seconds=20.0), FILTERED)
    model = loops.model(coulomb=True)
    bias = []
    for order in (2, 8):
        data = replace(dataset, filter=replace(FILTERED, difference_order=order))
        found = IV(loops.LOOP).fit(model, data)
        bias.append(np.linalg.norm(found.values - loops.truth(model)))
    assert bias[1] < 0.6 * bias[0]


def test_good_tracking_within_the_noise_is_not_doubted():
    """Reference, motion and simulation differ by less than the encoder's noise."""
    stiff = Controller(
        kind="computed_torque", rate_hz=loops.RATE, kp=(3600.0, 3600.0), kd=(90.0, 90.0)
    )
    dataset = loops.dataset(loops.experiment(3, 3e-4, controller=stiff))
    found = di.fit(loops.model(coulomb=False), dataset, IV(stiff))
    assert found.history is not None and found.history.ending is Ending.CONVERGED


def test_half_of_the_bandwidth_keeps_the_damping():
    from dynident.fitting.instrumental.gains import retuned

    ratio = np.array([0.5, 2.0])
    for one in (
        loops.LOOP,
        Controller(kind="cascade", rate_hz=200.0, kp=(10.0, 20.0), kv=(3.0, 4.0)),
    ):
        before, after = one.feedback(), retuned(one, ratio).feedback()
        np.testing.assert_allclose(after.position, before.position * ratio**2)
        np.testing.assert_allclose(after.speed, before.speed * ratio)
