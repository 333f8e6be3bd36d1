"""Robots of one kind: which differs from the others, in what, and how often that is wrong."""

from __future__ import annotations

import json

import numpy as np
import pytest

from dynident import Dataset, Model, fit
from dynident.errors import FitError
from dynident.fitting import Fleet, fit_fleet
from dynident.fitting.comparing.between_robots import against_others, holm, usual_value
from fleets import NAMES, model, robots
from synthetic import arm, synthetic, true_values


@pytest.fixture(scope="module")
def even() -> Fleet:
    return fit_fleet(model(), robots())


@pytest.mark.slow
def test_equal_robots_are_told_no_differences(even: Fleet) -> None:
    assert even.differences == ()
    assert list(even.estimates) == list(NAMES)
    assert len(even.comparisons) == len(NAMES) * even.basis.rank
    alone = fit(model(), robots()["dan"])
    np.testing.assert_array_equal(even.estimates["dan"].values, alone.values)


@pytest.mark.parametrize(
    ("parameter", "factor"), [("Izz.upper", 1.3), ("Fv@elbow", 2.0), ("Fc@shoulder", 2.0)]
)
def test_the_odd_robot_is_found_and_no_other(parameter: str, factor: float) -> None:
    fleet = fit_fleet(model(), robots(**{parameter.replace("@", "__"): factor}))
    assert [(one.robot, one.parameter) for one in fleet.differences] == [("cleo", parameter)]
    (one,) = fleet.differences
    assert one.value / one.usual == pytest.approx(factor, rel=0.1)
    assert "cleo differs" in fleet.headline
    told = json.loads(json.dumps(fleet.to_dict(), allow_nan=True))
    assert told["differences"][0]["robot"] == "cleo"
    page = fleet._repr_html_()
    assert "beyond both its own uncertainty and the usual spread" in page


@pytest.mark.parametrize("own", [0.02, 1.0])
@pytest.mark.parametrize("many", [4, 6])
@pytest.mark.slow
def test_false_alarms_in_a_fleet_are_few(many: int, own: float) -> None:
    """In 400 fleets 5 % are 20, and 30 with three standard deviations of that number."""
    rng = np.random.default_rng([many, round(100 * own)])
    alarms = 0
    for _ in range(400):
        sigma = own * np.exp(0.5 * rng.standard_normal((many, 8)))
        values = 3.0 + rng.standard_normal((many, 8)) + sigma * rng.standard_normal((many, 8))
        alarms += bool(np.any(holm(against_others(values, sigma**2).p_value) < 0.05))
    assert alarms <= 30


def test_p_values_are_uniform_where_the_spread_is_all() -> None:
    values = np.random.default_rng(3).standard_normal((6, 4000))
    p = against_others(values, np.full_like(values, 1e-8)).p_value[0]
    np.testing.assert_allclose(np.quantile(p, [0.05, 0.5, 0.95]), [0.05, 0.5, 0.95], atol=0.025)


def test_the_spread_is_what_own_uncertainties_leave() -> None:
    rng = np.random.default_rng(4)
    sigma = np.linspace(0.2, 2.0, 400)[:, None] * np.ones(3)
    spread = np.array([0.0, 0.5, 2.0])
    values = 1.0 + spread * rng.standard_normal((400, 3)) + sigma * rng.standard_normal((400, 3))
    found = usual_value(values, sigma**2)
    np.testing.assert_allclose(found.mean, 1.0, atol=0.3)
    np.testing.assert_allclose(found.spread, spread, atol=0.2)
    # Of its definition: weighted squares are the degrees of freedom, where there is a spread.
    squares = np.sum(found.weights * (values - found.mean) ** 2, axis=0)
    np.testing.assert_allclose(squares[1:], 399.0, rtol=1e-8)


def test_units_do_not_matter() -> None:
    rng = np.random.default_rng(5)
    values, variances = rng.standard_normal((5, 7)), rng.random((5, 7))
    here, there = against_others(values, variances), against_others(1e6 * values, 1e12 * variances)
    np.testing.assert_allclose(there.p_value, here.p_value, rtol=1e-9)


def test_holm_by_hand() -> None:
    np.testing.assert_allclose(
        holm(np.array([[0.01, 0.04], [0.03, 0.5]])), [[0.04, 0.09], [0.09, 0.5]]
    )


@pytest.mark.slow
def test_what_one_robot_does_not_show_is_not_compared(even: Fleet) -> None:
    """A robot whose elbow stands still: the others' combinations shrink to what it shows."""
    data = robots()
    still = data["bob"]
    q = still.q.copy()
    q[:, 1] = 0.3
    kind = Model(arm()) + "viscous_friction"
    truth = true_values(kind, Fv__shoulder=1.2, Fv__elbow=0.5)
    run = synthetic(kind, truth, 1, rate_hz=250.0, duration=8.0, torque_std=0.2)
    block = kind.block(run.t, q, *_derivatives(q, run.t))
    noise = 0.2 * np.random.default_rng(0).standard_normal(q.shape)
    data["bob"] = still.replace(q=q, tau=kind.torque(block, truth) + noise)
    fleet = fit_fleet(kind, data)
    assert fleet.basis.rank <= fleet.estimates["bob"].basis.rank < fleet.estimates["ada"].basis.rank
    assert "Fv@elbow" not in {one.parameter for one in fleet.comparisons}
    assert any("not compared: " in note and "Fv@elbow" in note for note in fleet.notes)
    # What is compared, every robot identifies: its combinations are sums of the robot's own.
    for one in fleet.estimates.values():
        own, common = one.basis.combination, fleet.basis.combination
        np.testing.assert_allclose(common[:, list(one.basis.independent)] @ own, common, atol=1e-4)


def _derivatives(q: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    v = np.gradient(q, t, axis=0)
    return v, np.gradient(v, t, axis=0)


def test_bad_fleets_are_one_line() -> None:
    data = robots()
    with pytest.raises(FitError, match="2 robots, where one is compared"):
        fit_fleet(model(), {name: data[name] for name in NAMES[:2]})
    with pytest.raises(FitError, match=r"robot 'bob': .*no recording"):
        fit_fleet(model(), {**data, "bob": Dataset(())})
