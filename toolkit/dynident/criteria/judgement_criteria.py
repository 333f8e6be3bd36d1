"""Criteria of what is said: contacts and other nuisances, the verdict, advice, simulated loops."""

from __future__ import annotations

from dataclasses import dataclass

from dynident.criteria.criterion import TWO_LINK_CASES, CriteriaGroup, criterion


@dataclass(frozen=True, kw_only=True)
class ContactCriteria(CriteriaGroup):
    """When a burst in one repetition is a contact, and how its noise is measured."""

    level: float = criterion(
        1e-6,
        "1",
        "p value below which a disturbance pulse is a contact",
        "measured: p values come out up to some hundred times too small in noise that is "
        "correlated over 0.2 s, as it is measured without the place that stands out most; of 600 "
        "searches in Gaussian noise none falls below this, of 1200 in noise of heavy tails 3",
        over=0,
        most=1,
    )
    narrowest: float = criterion(0.025, "s", "narrowest pulse that is sought", over=0)
    widest: float = criterion(0.6, "s", "widest pulse that is sought", over=0)
    widths: int = criterion(6, "1", "widths between them that are tried", least=2)
    most: int = criterion(
        8, "pulses", "pulses in one diagnosis: more are noise of another kind", least=1
    )
    worth_a_look: float = criterion(
        0.05,
        "1",
        "probability at the one place that stands out most, to look closer",
        over=0,
        most=1,
    )
    looks: int = criterion(
        4,
        "1",
        "closer looks at it at most, each by noise measured without it",
        least=1,
    )
    widest_share: float = criterion(
        1 / 12,
        "1",
        "share of a repetition that the widest pulse may take: it must not be most of what is "
        "compared",
        over=0,
        most=0.5,
    )
    stride: float = criterion(
        0.25, "1", "step from one position to the next, over the width", over=0, most=1
    )
    peaks: int = criterion(
        5, "1", "positions, with what surrounds them, that are no witnesses of the noise", least=0
    )
    reach: float = criterion(
        4.0,
        "1",
        "widths on either side beyond which a pulse is nothing, and which are left out",
        over=0,
    )
    peak_reach: float = criterion(
        3.0, "1", "widths about the peak that say nothing of the usual size of the noise", over=0
    )
    left_out: float = criterion(
        0.25,
        "1",
        "share of a repetition that is left out on either side, at most",
        over=0,
        most=0.5,
    )
    same_place: float = criterion(
        2.0, "1", "distance of two pulses over the sum of their widths, up to which they are one"
    )
    speed_quantiles: tuple[float, ...] = criterion(
        (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0),
        "1",
        "quantiles of speed between which the size of the noise is measured: it is worst at rest",
        least=0,
        most=1,
    )
    samples_per_scale: int = criterion(40, "samples", "samples that show such a size", least=2)
    white_share: float = criterion(
        0.3, "1", "white noise assumed, over the noise: filters may leave nothing to find it in"
    )
    clip: float = criterion(
        3.0, "1", "standard deviations beyond which a sample says nothing of the noise", over=0
    )
    huber: float = criterion(
        1.345,
        "1",
        "standard deviations from which a sample weighs less in the slow changes",
        "literature: Huber, Robust Statistics (1981): 95 % efficiency under normal noise",
        over=0,
    )
    tukey: float = criterion(
        4.685,
        "1",
        "standard deviations from which a sample has no weight in the slow changes",
        "literature: Beaton and Tukey, Technometrics 16 (1974): 95 % efficiency under normal noise",
        over=0,
    )
    tails: tuple[float, ...] = criterion(
        (0.95, 0.99, 0.997),
        "1",
        "quantiles at which the tails of the noise are measured",
        over=0,
        most=1,
    )
    least_in_tail: int = criterion(
        5, "samples", "values beyond a quantile that show a tail", least=1
    )
    degrees: tuple[float, ...] = criterion(
        (3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 14.0, 20.0, 30.0, 60.0, 200.0),
        "1",
        "degrees of freedom of Student's distribution among which tails are placed",
        over=2,
    )


@dataclass(frozen=True, kw_only=True)
class NuisanceCriteria(CriteriaGroup):
    """What is allowed for beside contacts: friction widths, the steps of encoders."""

    narrowest_width: float = criterion(
        0.02,
        "1",
        "narrowest friction width over the stated one that is tried: below it dry friction has "
        "reversed between two samples",
        over=0,
        most=1,
    )
    widest_width: float = criterion(
        15.0,
        "1",
        "widest friction width over the stated one that is tried: above it dry friction is "
        "viscous friction",
        least=1,
    )
    widths: int = criterion(13, "1", "friction widths between these two that are tried", least=3)
    at_bound: float = criterion(
        1.05,
        "1",
        "factor of the narrowest or widest width within which a width is said to be a bound only",
        least=1,
    )
    rounding_recordings: int = criterion(
        2, "recordings", "recordings along which the steps of encoders are looked at", least=1
    )
    rounding_places: int = criterion(
        6, "1", "places of a motion between the steps of its encoders that are tried", least=3
    )
    rounding_deviations: float = criterion(
        2.0,
        "1",
        "standard deviations over these places by which encoders' steps may leave more than usual",
        least=0,
    )


@dataclass(frozen=True, kw_only=True)
class StickingCriteria(CriteriaGroup):
    """When a joint sticks at its reversals, and which rows that makes useless."""

    noise: float = criterion(
        4.0, "1", "speed over its noise, within which a joint counts as standing", over=0
    )
    longer: float = criterion(
        2.0,
        "1",
        "time within that speed over the time up to three times as much, above which a joint has "
        "stood: passing through zero takes 0.5, turning back from it 1.4",
        over=1.4,
    )
    stops: int = criterion(3, "stops", "stops at which a joint that sticks has stood", least=1)
    stops_share: float = criterion(
        0.1,
        "1",
        "share of its stops at which a joint that sticks has stood: Stribeck friction, too, lets a "
        "joint stand now and then",
        over=0,
        most=1,
    )
    coarse: float = criterion(
        1.0,
        "1",
        "change of speed while a command is held, over the friction width, above which a reversal "
        "falls between two samples: its friction is off by some 6 % of the Coulomb level",
        over=0,
    )
    resolved: float = criterion(
        3.0,
        "1",
        "friction width over the noise of the speed, below which a width cannot be told from none",
        over=0,
    )
    rounded: float = criterion(
        0.01,
        "1",
        "share of a joint's root mean square speed up to which the low-pass of positions may have "
        "rounded a reversal",
        least=0,
        most=0.2,
    )
    spread: float = criterion(
        0.02,
        "1",
        "share of a row's low-pass that lies within a reversal, from which the row is left out",
        over=0,
        most=1,
    )
    most: float = criterion(
        0.5,
        "1",
        "share of a joint's rows, long rests apart, up to which its reversals may be left out",
        over=0,
        most=0.9,
    )
    least_seen: float = criterion(
        0.2,
        "1",
        "share of an effect's largest torque in rows that count, below which its values are said "
        "to be extrapolated",
        least=0,
        most=1,
    )


@dataclass(frozen=True, kw_only=True)
class VerdictCriteria(CriteriaGroup):
    """When a model is said to be complete, and when a residual counts as explained."""

    within_noise: float = criterion(
        0.3,
        "1",
        "systematic residual over noise above which something is said to be missing",
        TWO_LINK_CASES,
    )
    resolution: float = criterion(
        1e-4,
        "1",
        "share of a joint's torque below which a residual is that of differentiation and filters",
    )
    most_explained: float = criterion(
        0.8,
        "1",
        "share of the systematic square that added effects must take away, for the residual to "
        "count as explained although a part smaller than the noise is left of it",
        TWO_LINK_CASES,
        least=0,
        most=1,
    )
    most_left: float = criterion(
        1.0, "1", "systematic residual over noise at any joint that may then be left"
    )
    not_nothing: float = criterion(
        0.5, "1", "systematic residual over noise from which a verdict says that something is left"
    )
    few_rows: float = criterion(
        0.01, "1", "share of the training rows that is looked at for bursts", over=0, most=0.5
    )
    held_by_few: float = criterion(
        0.5,
        "1",
        "share of the residual's square which those rows must hold to be told as bursts; of normal "
        "noise they hold 0.08",
        over=0,
        most=1,
    )
    unlike: float = criterion(
        2.0,
        "1",
        "residual of a test recording over what training and the parameters' uncertainty make "
        "expect, from which it is said to be unlike the training recordings",
        least=1,
    )


@dataclass(frozen=True, kw_only=True)
class AdviceCriteria(CriteriaGroup):
    """Which experiments are advised."""

    clearly: float = criterion(
        0.05,
        "1",
        "share of an effect's torque that another must leave, for an experiment to be advised",
        least=0,
        most=1,
    )
    nearly: float = criterion(
        0.8,
        "1",
        "share of the best experiment's difference from which a simpler one is advised instead",
        least=0,
        most=1,
    )
    more: float = criterion(
        1.1, "1", "a speed or range over the recorded one from which it is worth saying", least=1
    )
    faster: float = criterion(1.5, "1", "acceleration advised over the recorded one", least=1)
    limits_share: float = criterion(
        0.8, "1", "share of a joint's limits that is advised", over=0, most=1
    )
    slow_revolute: float = criterion(
        0.1, "rad/s", "speed below which a revolute joint moves slowly", over=0
    )
    slow_prismatic: float = criterion(
        0.01, "m/s", "speed below which a prismatic joint moves slowly", over=0
    )
    tiny_revolute: float = criterion(
        0.01, "rad", "motion to and fro that is tiny at a revolute joint", over=0
    )
    tiny_prismatic: float = criterion(
        0.001, "m", "motion to and fro that is tiny at a prismatic joint", over=0
    )
    session: float = criterion(600.0, "s", "shortest session that is advised", over=0)
    longer: float = criterion(
        3.0, "1", "length of the session that is advised over the recorded one", least=1
    )


@dataclass(frozen=True, kw_only=True)
class LoopCriteria(CriteriaGroup):
    """What the errors of a simulated closed loop mean."""

    same_as_noise: float = criterion(
        1.5, "1", "difference over the noise, up to which it may be the noise", least=1
    )
    further: float = criterion(
        1.2,
        "1",
        "ratio of two distances from the measurement, noise taken out, below which they are about "
        "equal",
        least=1,
    )
    beyond_noise: float = criterion(
        3.0, "1", "torque error over its noise above which the model lacks something", least=1
    )
    relevant: float = criterion(
        0.01, "1", "torque error over the torque above which it does", least=0, most=1
    )
    law_holds: float = criterion(
        0.2, "1", "relative error up to which the stated control law may have run", over=0
    )
    law_noise: float = criterion(
        3.0, "1", "multiple of the noise up to which it may have run", least=1
    )
    repeats: float = criterion(
        0.3, "1", "mismatch of two periods over the motion, above which nothing repeats", over=0
    )
