"""Nonlinear programs: known optima, multipliers, words for what has none, and what they print."""

from __future__ import annotations

import os
import signal
import threading
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import lsq_linear

from dynident.errors import FitError, ProgramError
from dynident.nlp import Constraint, Cost, Program, ProgramSolution, Residual, Variable

RNG = np.random.default_rng(3)
A = RNG.normal(size=(12, 4))
B = RNG.normal(size=12)


def least_squares(**bounds) -> tuple[Program, Variable]:
    x = Variable("x", 4, unit="kg", **bounds)
    residual = Residual("torque", ca.mtimes(ca.DM(A), x.symbol) - B, unit="N m")
    return Program("four masses") + x + residual, x


def rosenbrock(start=(-1.2, 1.0), size: float = 1.0, unit: float = 1.0) -> Program:
    """Its minimum is 0 at (unit, unit); `size` multiplies the objective."""
    x = Variable("x", 2, scale=unit, start=np.multiply(start, unit))
    a, b = x.symbol[0] / unit, x.symbol[1] / unit
    return Program("valley") + x + Residual("r", size * ca.vertcat(1 - a, 10 * (b - a**2)))


# --- optima that are known -------------------------------------------------------------------


def test_unconstrained_least_squares_is_the_closed_form() -> None:
    program, _ = least_squares()
    solution = program.solve().require()
    exact, rest, *_ = np.linalg.lstsq(A, B, rcond=None)
    assert solution.values["x"] == pytest.approx(exact, rel=1e-9)
    assert solution.objective == pytest.approx(0.5 * rest[0], rel=1e-12)
    assert solution.status.word == "solved"


def test_bounded_least_squares_is_scipys() -> None:
    lower, upper = np.array([-0.05, -np.inf, 0.1, -0.2]), np.array([0.05, 0.0, np.inf, 0.2])
    program, _ = least_squares(lower=lower, upper=upper)
    solution = program.solve().require()
    exact = lsq_linear(A, B, (lower, upper), method="bvls", tol=1e-14)
    assert solution.objective == pytest.approx(exact.cost, rel=1e-9)
    assert solution.values["x"] == pytest.approx(exact.x, abs=1e-8)
    assert np.all(solution.values["x"] >= lower) and np.all(solution.values["x"] <= upper)


def test_an_equation_is_met_as_the_closed_form_says() -> None:
    program, x = least_squares()
    row = np.array([[1.0, 1.0, 1.0, 1.0]])
    total = Constraint("total mass", ca.sum1(x.symbol), lower=2.0, upper=2.0, unit="kg")
    solution = (program + total).solve().require()
    kkt = np.block([[A.T @ A, -row.T], [row, np.zeros((1, 1))]])
    exact = np.linalg.solve(kkt, np.append(A.T @ B, 2.0))
    assert solution.values["x"] == pytest.approx(exact[:4], abs=1e-9)
    assert solution.multipliers["total mass"] == pytest.approx(exact[4:], rel=1e-8)
    assert solution.violation < 1e-12


def test_fixed_entries_stay_and_the_others_follow() -> None:
    program, x = least_squares()
    held = program.replacing(
        replace(x, lower=[0.7, *[-np.inf] * 3], upper=[0.7, *[np.inf] * 3])
    ).solve()
    rest = np.linalg.lstsq(A[:, 1:], B - 0.7 * A[:, 0], rcond=None)[0]
    assert held.values["x"] == pytest.approx([0.7, *rest], rel=1e-9)
    gradient = A.T @ (A @ held.values["x"] - B)
    assert held.multipliers["x"][0] == pytest.approx(gradient[0], rel=1e-8)


def test_the_best_of_several_starts_wins_and_all_are_told() -> None:
    x = Variable("x", 1)
    double_well = Cost("well", (x.symbol**2 - 1) ** 2 + 0.3 * x.symbol)
    solution = (Program("two valleys") + x + double_well).solve([{"x": 1.0}, {"x": [-1.0]}])
    right, left = solution.starts
    assert right.objective > left.objective == solution.objective
    assert right.status.ok and left.status.ok
    assert right.start == [1.0] and solution.values["x"] < 0


def test_tall_rows_are_folded_to_the_same_objective() -> None:
    rows, target = RNG.normal(size=(500, 4)), RNG.normal(size=500)
    x = Variable("x", 4)
    y = x.symbol**2
    long = Program("long") + x + Residual("r", ca.mtimes(ca.DM(rows), y) - target)
    folded = Program("short") + x + Residual("r", y, matrix=rows, target=target)
    at = {"x": RNG.normal(size=4)}
    values = [p.evaluate(p.terms[0].cost, at) for p in (long, folded)]
    assert values[0] == pytest.approx(values[1], rel=1e-12)
    assert folded.terms[0].rows == 5


def test_the_hessian_is_exact() -> None:
    x = Variable("x", 4, start=RNG.normal(size=4), scale=[1.0, 2.0, 0.5, 3.0])
    bent = ca.vertcat(x.symbol[0] * x.symbol[1], ca.exp(x.symbol[2]), x.symbol[3] ** 3)
    rows, target = RNG.normal(size=(7, 3)), RNG.normal(size=7)
    program = Program("bent") + x + Residual("rows", bent, matrix=rows, target=target)
    program = program + Residual("plain", ca.sin(x.symbol)) + Cost("c", ca.sum1(x.symbol**4))
    program = program + Constraint("g", ca.vertcat(ca.sumsqr(x.symbol), ca.cos(x.symbol[1])))
    form, weights = program.scaled, np.array([0.3, -1.7])
    z, scales = program.point() / form.scale, np.array([2.0, 3.0, 0.5])
    lagrangian = 0.7 * form.nlp["f"] + ca.dot(ca.DM(weights), form.nlp["g"])
    exact = ca.hessian(lagrangian, form.nlp["x"])[0]
    function = ca.Function("H", [form.nlp["x"], form.nlp["p"]], [ca.triu(exact)])
    found = form.hessian(z, scales, 0.7, weights).full()
    assert found == pytest.approx(np.array(function(z, scales)), rel=1e-12, abs=1e-12)


def test_a_residual_with_another_target_is_another_residual() -> None:
    x = Variable("x", 4, start=0.5)
    residual = Residual("r", x.symbol, matrix=np.eye(4), target=B[:4])
    other = (Program("p") + x + replace(residual, target=np.full(4, 2.0))).solve()
    assert other.values["x"] == pytest.approx(np.full(4, 2.0), rel=1e-8)


def test_parts_add_up_to_the_objective() -> None:
    program, x = least_squares()
    program = program + Cost("entropic prior", ca.sum1(ca.exp(x.symbol)))
    solution = program.solve().require()
    at = solution.values["x"]
    assert solution.parts["torque"] == pytest.approx(0.5 * np.sum((A @ at - B) ** 2), rel=1e-12)
    assert solution.parts["entropic prior"] == pytest.approx(np.exp(at).sum(), rel=1e-12)
    assert solution.objective == pytest.approx(sum(solution.parts.values()), rel=1e-12)


# --- multipliers -----------------------------------------------------------------------------


def nonlinear(scale: float = 1.0, rows: float = 1.0) -> tuple[Program, Variable]:
    x = Variable("x", 3, lower=[0.0, -1.0, -5.0], upper=5.0, start=1.0, scale=scale)
    cost = Cost("c", ca.sumsqr(x.symbol - ca.DM([-1.0, 3.0, 2.0])))
    disc = Constraint("disc", rows * ca.sumsqr(x.symbol), upper=rows * 4.0)
    both = Constraint("sum", x.symbol[1] - x.symbol[2], lower=0.5, upper=0.5)
    return Program("ball") + x + cost + disc + both, x


@pytest.mark.parametrize("scale", [1.0, 1e-3, 50.0])
def test_multipliers_fulfil_the_first_order_conditions(scale: float) -> None:
    solution = nonlinear(scale)[0].solve().require()
    at, found = solution.values["x"], solution.multipliers
    gradient = 2 * (at - [-1.0, 3.0, 2.0])
    pull = found["disc"] * 2 * at + found["sum"] * [0.0, 1.0, -1.0] + found["x"]
    assert pull == pytest.approx(gradient, abs=1e-6)
    assert found["disc"] < 0, "an upper bound that holds"
    assert found["x"][0] > 0, "a lower bound that holds"
    assert found["x"][1:] == pytest.approx(0.0, abs=1e-6)
    assert max(solution.stationarity, solution.complementarity, solution.violation) < 1e-6


def test_a_multiplier_is_what_the_objective_grows_by_per_unit_of_its_bound() -> None:
    program, _ = nonlinear()
    disc = program["disc"]
    step = 1e-4
    ends = [
        program.replacing(replace(disc, upper=4.0 + sign * step)).solve().objective
        for sign in (-1.0, 1.0)
    ]
    growth = (ends[1] - ends[0]) / (2 * step)
    assert program.solve().multipliers["disc"] == pytest.approx([growth], rel=1e-5)


# --- invariance ------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [1e-6, 1e5])
@pytest.mark.parametrize("unit", [1e-4, 1e6])
def test_units_change_neither_the_answer_nor_the_way_to_it(size: float, unit: float) -> None:
    reference, other = rosenbrock().solve(), rosenbrock(size=size, unit=unit).solve()
    assert other.values["x"] == pytest.approx(unit * reference.values["x"], rel=1e-8)
    assert other.status.iterations == reference.status.iterations


def test_the_unit_of_a_constraint_does_not_matter() -> None:
    reference, other = nonlinear()[0].solve(), nonlinear(rows=1e9)[0].solve()
    assert other.values["x"] == pytest.approx(reference.values["x"], abs=1e-9)
    assert other.multipliers["disc"] == pytest.approx(reference.multipliers["disc"] / 1e9, rel=1e-6)


def test_the_same_program_gives_the_same_bits() -> None:
    one, two = nonlinear()[0].solve(), nonlinear()[0].solve()
    assert np.array_equal(one.values["x"], two.values["x"])


def test_weak_directions_are_not_lost_beside_stiff_ones() -> None:
    # Ten decades of curvature: the stiff ones alone would make any tolerance too loose.
    weight = np.logspace(0, 5, 6)
    x = Variable("x", 6, start=1.1)
    rows = ca.vertcat(ca.DM(weight) * (x.symbol**2 - 1.0), ca.MX(1e-1))
    solution = (Program("stiff") + x + Residual("r", rows)).solve().require()
    assert solution.values["x"] == pytest.approx(np.ones(6), rel=1e-6)


# --- programs without a solution -------------------------------------------------------------


def ended(program: Program, word: str, **options) -> ProgramSolution:
    solution = program.solve(**options)
    assert solution.status.word == word, solution.status
    assert not solution.status.ok
    with pytest.raises(FitError, match=word):
        solution.require()
    return solution


def test_contradictory_constraints_are_infeasible() -> None:
    program, x = least_squares()
    total = ca.sum1(x.symbol)
    contradiction = (Constraint("most", total, upper=1.0), Constraint("least", total, lower=2.0))
    solution = ended(program + contradiction, "infeasible")
    assert solution.violation > 0.1


def test_an_objective_without_end_is_unbounded() -> None:
    x = Variable("x", 2)
    ended(Program("downhill") + x + Cost("slope", x.symbol[0]), "unbounded")


def test_too_few_iterations_are_told() -> None:
    ended(rosenbrock(), "iteration limit", max_iterations=3)


def test_an_objective_that_only_flattens_is_not_called_solved() -> None:
    x = Variable("x", 1, lower=0.0, start=1.0)
    assert not (Program("logarithm") + x + Cost("log", -ca.log(x.symbol))).solve().status.ok


def test_a_start_without_a_value_fails_and_leaves_the_others_their_chance() -> None:
    x = Variable("x", 1)
    program = Program("log") + x + Cost("log", x.symbol - ca.log(x.symbol))
    program = program + Constraint("most", x.symbol, upper=7.0)
    alone = ended(program, "failed")
    assert "log is not finite at the start" in str(alone.status)
    assert str(alone)
    both = program.solve([{"x": -1.0}, {"x": 5.0}]).require()
    assert [s.status.ok for s in both.starts] == [False, True]
    assert both.values["x"] == pytest.approx([1.0], rel=1e-8)


def test_a_solver_prints_nothing(capfd) -> None:
    x = Variable("x", 1, lower=-1.0, start=3.0)
    logarithm = Cost("log", x.symbol - ca.log(x.symbol))
    (Program("logarithm") + x + logarithm).solve()
    rosenbrock().solve(max_iterations=2)
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_ctrl_c_reaches_the_caller() -> None:
    x = Variable("x", 100, start=1.0)
    deep = x.symbol
    for _ in range(60):
        deep = ca.sin(deep) + 1e-3 * x.symbol
    wild = Residual("wild", ca.vertcat(ca.mtimes(ca.DM(RNG.normal(size=(200, 100))), deep), deep))
    program = Program("long") + x + wild + Cost("waves", ca.sum1(ca.sin(1e3 * x.symbol)))
    assert program.scaled  # made before the signal comes
    seen = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sent = threading.Event()

    def interrupt() -> None:
        os.kill(os.getpid(), signal.SIGINT)
        sent.set()

    timer = threading.Timer(0.5, interrupt)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            while not sent.is_set():  # which the run that is interrupted does not come back to
                program.solve(max_iterations=100_000, tolerance=1e-16)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, seen)


# --- what is printed, inspected and extended -------------------------------------------------


def test_a_program_prints_its_parts_with_their_units() -> None:
    program, x = least_squares(lower=0.0)
    program = program + Cost("entropic prior", ca.sum1(x.symbol))
    program = program + Constraint("total mass", ca.sum1(x.symbol), "kg", lower=9.0, upper=11.0)
    for text in (str(program), program._repr_html_()):
        for word in ("four masses", "torque", "N m", "kg", "total mass", "9 to 11", ">= 0"):
            assert word in text.replace("&gt;", ">"), word
        assert "minimise 1/2 |torque|^2 + entropic prior" in text
    assert program.terms[0].rows == 12 and program["torque"] is program.terms[0]
    shown = str(program.solve())
    for word in ("x[3]", "total mass", "multiplier", "Ipopt: solved", "stationarity"):
        assert word in shown


def test_an_extended_program_leaves_the_first_as_it_was() -> None:
    program, x = least_squares()
    before, printed = program.solve().objective, str(program)
    longer = program + Constraint("total mass", ca.sum1(x.symbol), lower=5.0)
    assert longer.solve().objective > before + 1e-3
    assert str(program) == printed and program.solve().objective == before
    assert longer.without("total mass").solve().objective == before
    assert "total mass" in longer and "total mass" not in program


def test_any_expression_can_be_asked_for_at_the_solution() -> None:
    program, x = least_squares()
    solution = program.solve()
    found = solution.evaluate(ca.sum1(x.symbol))
    assert found == pytest.approx([solution.values["x"].sum()], rel=1e-12)


def test_an_inner_function_of_scalars_gives_the_same_program() -> None:
    inner = ca.SX.sym("s", 4)
    squares = ca.Function("squares", [inner], [inner**2])
    x = Variable("x", 4, start=0.5)
    ends = [
        (Program("p") + x + Residual("r", y, matrix=A, target=B)).solve().objective
        for y in (squares(x.symbol), x.symbol**2)
    ]
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)


# --- mistakes --------------------------------------------------------------------------------


def test_mistakes_in_blocks_are_told() -> None:
    x = Variable("x", 2)
    with pytest.raises(ProgramError, match=r"variable x, entry 1: lower bound is NaN"):
        Variable("x", 2, lower=[0.0, np.nan])
    with pytest.raises(ProgramError, match="no number lies between the bounds 2 and 1"):
        Variable("x", 2, lower=2.0, upper=1.0)
    with pytest.raises(ProgramError, match="start is NaN"):
        Variable("x", 2, start=np.nan)
    with pytest.raises(ProgramError, match=r"start has the shape \(3,\)"):
        Variable("x", 2, start=np.zeros(3))
    with pytest.raises(ProgramError, match="scale is not positive"):
        Variable("x", 2, scale=0.0)
    with pytest.raises(ProgramError, match="2 entries and 3 units"):
        Variable("x", 2, unit=("kg", "m", "s"))
    with pytest.raises(ProgramError, match="cost c: has 2 rows"):
        Cost("c", x.symbol)
    with pytest.raises(ProgramError, match="is an SX"):
        Residual("r", ca.SX.sym("s", 2))
    with pytest.raises(ProgramError, match="no number lies between"):
        Constraint("c", x.symbol, lower=[0.0, 3.0], upper=[1.0, 2.0])
    with pytest.raises(ProgramError, match="do not fit"):
        Residual("r", x.symbol, matrix=np.ones((3, 3)), target=np.ones(3))
    with pytest.raises(ProgramError, match="not finite"):
        Residual("r", x.symbol, matrix=np.full((3, 2), np.inf), target=np.ones(3))


def test_mistakes_in_programs_are_told() -> None:
    program, x = least_squares()
    with pytest.raises(ProgramError, match="torque is in the program twice"):
        _ = program + Residual("torque", x.symbol)
    with pytest.raises(ProgramError, match="prior depends on y, no variable"):
        _ = program + Residual("prior", Variable("y", 4).symbol)
    with pytest.raises(ProgramError, match="depends on x"):  # the name is not enough
        _ = program + Residual("prior", Variable("x", 4).symbol)
    with pytest.raises(ProgramError, match="There is: x, torque"):
        _ = program["h"]
    with pytest.raises(ProgramError, match="has no variables"):
        Program("nothing").solve()
    with pytest.raises(ProgramError, match="nothing that a program is made of"):
        _ = program + "x"  # pyright: ignore[reportOperatorIssue]


def test_mistakes_in_starts_are_told() -> None:
    program, _ = least_squares()
    with pytest.raises(ProgramError, match=r"h is no variable.*There is: x"):
        program.solve([{"h": 1.0}])
    with pytest.raises(ProgramError, match="start has the shape"):
        program.solve([{"x": np.zeros(3)}])
    with pytest.raises(ProgramError, match="start is NaN"):
        program.solve([{"x": [0.0, np.nan, 0.0, 0.0]}])
    with pytest.raises(ProgramError, match="there is no start"):
        program.solve([])
    with pytest.raises(ProgramError, match="tolerance"):
        program.solve(tolerance=0.0)
