"""Criteria of the wiring check: when recordings contradict what is said of their columns."""

from __future__ import annotations

from dataclasses import dataclass

from dynident.criteria.criterion import CriteriaGroup, criterion

_INJECTED = (
    "measured: faults put into hidden_effect, scara, double_pendulum and panda, and these and all "
    "other problems without a fault"
)


@dataclass(frozen=True, kw_only=True)
class WiringCriteria(CriteriaGroup):
    """By how much another assignment of columns must win, and what no robot does."""

    rows: int = criterion(300, "rows", "rows on which assignments are compared", least=50)
    independent_hz: float = criterion(
        5.0, "1/s", "rows that count as independent: what a model lacks lasts as motions do", over=0
    )
    gain: float = criterion(
        0.3,
        "1",
        "logarithmic likelihood per row, summed over joints, by which an assignment must win: 0.3 "
        "halves the residual of one joint in two",
        _INJECTED + "; without one at most 0.07, with one as a rule above 0.8",
        over=0,
    )
    evidence: float = criterion(15.0, "1", "the same over all independent rows", "taste", over=0)
    tie: float = criterion(
        0.1,
        "1",
        "share of the best gain within which the plainer fault is named",
        over=0,
        most=1,
    )
    least_turn: float = criterion(
        0.5,
        "rad",
        "turn of gravity from which the study is said to have it wrong: less is a tilted base",
        over=0,
    )
    most_faults: int = criterion(3, "faults", "faults of columns that are looked for", least=1)
    poor_fit: float = criterion(
        0.2, "1", "residual over torque above which gears are looked for at every joint", over=0
    )
    beyond_limits: float = criterion(
        1.2, "1", "travel over the room between a joint's limits that no joint has", over=1
    )
    widest_turn: float = criterion(
        15.0,
        "rad",
        "travel that no revolute joint has whose limits are not known; a continuous one may",
        over=0,
    )
    described_z: float = criterion(
        6.0, "1", "standard deviations by which the described torque shows in the measured one"
    )
    described_share: float = criterion(
        0.3,
        "1",
        "part of one joint's torque that the described one makes, from which its size is compared "
        "with that of the others",
        least=0,
        most=1,
    )
    milli: tuple[float, ...] = criterion(
        (200.0, 5000.0),
        "1",
        "measured over described torque between which the unit is N mm or mN m",
        "measured: 0.68 to 1.7 in eight studies with descriptions of every kind",
    )
    least_gear: float = criterion(
        15.0,
        "1",
        "described over measured torque of every joint above which a gear is likely",
        over=1,
    )
    as_described: float = criterion(
        5.0,
        "1",
        "factor by which torques may differ from those described, units being right",
        over=1,
    )
    odd_one: float = criterion(
        20.0, "1", "factor by which one joint's torque is off, the others being right", over=1
    )
    beyond_effort: float = criterion(
        20.0,
        "1",
        "rms of a torque over the limit in the description from which its unit is N mm or mN m: in "
        "these a drive at a fiftieth of its limit is there",
        over=1,
    )
    shared: float = criterion(
        0.2,
        "1",
        "share of a test recording's samples that are fitted above which it judges nothing",
    )
    one_source: float = criterion(
        1e-5, "1", "difference of two columns, each of unit size, below which they are one", over=0
    )
    period_off: float = criterion(
        0.005, "1", "difference of positions a period apart, over the motion, that is worth a look"
    )
    period_ratio: float = criterion(
        3.0, "1", "factor by which another period must fit better", over=1
    )
    period_left: float = criterion(
        0.1, "1", "difference of positions, over the motion, with which a motion repeats", over=0
    )
    filter_ratio: float = criterion(
        1.5,
        "1",
        "residual of a fit over that with the usual low-pass of positions above which [filter] is "
        "named",
        "measured: 1.7 to 10 where a filter makes up effects of healthy arms, at most 1.3 in the "
        "problems and behind filters that do no harm",
        over=1,
    )
    filter_error: float = criterion(
        0.003, "1", "residual over torque from which that is said", over=0
    )
