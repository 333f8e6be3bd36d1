"""Contacts: found where they are, and nowhere in noise of any colour."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfiltfilt

from dynident import diagnose
from dynident.criteria import DEFAULTS
from dynident.diagnosis.nuisances import pulse_search
from dynident.diagnosis.nuisances.changes import Repeated, changes_of, scanned
from dynident.diagnosis.nuisances.pulse_search import (
    DisturbancePulse,
    find_contacts,
    pulses_in,
    without,
)
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import Run, gather
from dynident.recording import Dataset, Filter
from study_files import true_model
from synthetic import synthetic, true_values

STEP = 0.02
INSTANTS = 250


def motion(rng: np.random.Generator) -> np.ndarray:
    """Speed over one period, (S,) rad/s."""
    phase = 2 * np.pi * np.arange(1, 5)[:, None] * np.arange(INSTANTS) / INSTANTS
    return rng.normal(size=4) @ np.sin(phase) + rng.normal(size=4) @ np.cos(phase)


def noise(rng: np.random.Generator, kind: str, speed: np.ndarray) -> np.ndarray:
    """Noise (P, S) of standard deviation one at speed."""
    if "heavy" in kind:
        x = rng.standard_t(5, speed.size + 200)
    else:
        x = rng.standard_normal(speed.size + 200)
    if "coloured" in kind:
        x = np.asarray(lfilter([1.0], [1.0, -rng.uniform(0.5, 0.9)], x))
    x = (x[200:] / x[200:].std()).reshape(speed.shape)
    if "slow" in kind:
        x = x * (1 + rng.uniform(1, 5) * np.exp(-np.abs(speed) / rng.uniform(0.05, 0.3)))
    return x


def data(seed: int, kind: str = "", repetitions: int = 4) -> list[Repeated]:
    """Two joints in two recordings: what a model lacks, and noise."""
    rng, found = np.random.default_rng(seed), []
    for run in range(2):
        t = 50.0 * run + STEP * np.arange(repetitions * INSTANTS).reshape(repetitions, -1)
        for joint in ("shoulder", "elbow"):
            speed = np.tile(motion(rng), (repetitions, 1))
            lacking = 3.0 * np.sign(speed) + 2.0 * np.sin(2 * np.pi * t / (STEP * INSTANTS))
            residual = lacking + noise(rng, kind, speed)
            found.append(
                Repeated(
                    run=run,
                    number=run + 1,
                    joint=joint,
                    t=t,
                    residual=residual,
                    speed=speed,
                    certain=np.ones(INSTANTS, dtype=bool),
                )
            )
    return found


def pushed(series: list[Repeated], k: int, p: int, time: float, width: float, height: float):
    one = series[k]
    pulse = np.zeros_like(one.residual)
    pulse[p] = height * np.exp(-(((one.t[p] - time) / width) ** 2) / 2)
    return [replace(s, residual=s.residual + pulse) if s is one else s for s in series]


@pytest.mark.parametrize("kind", ["", "coloured", "slow"])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.slow
def test_one_burst_is_found_where_it_is_and_nowhere_else(kind: str, seed: int) -> None:
    time = 50.0 + STEP * INSTANTS * 2 + 1.7
    # Slow noise of the same size hides more.
    height = 9.0 if kind == "coloured" else 5.0
    (pulse,) = pulses_in(pushed(data(seed, kind), 3, 2, time, 0.2, height), DEFAULTS)
    assert (pulse.run, pulse.number, pulse.repetition, pulse.joint) == (1, 2, 2, "elbow")
    assert pulse.time == pytest.approx(time, abs=0.2)
    assert 0.1 < pulse.width < 0.4
    assert pulse.amplitude == pytest.approx(height, rel=0.5)
    assert pulse.p_value < DEFAULTS.contacts.level


@pytest.mark.parametrize("repetitions", [2, pytest.param(4, marks=pytest.mark.slow)])
@pytest.mark.parametrize("first", [0, 3, 6, 12])
def test_a_burst_as_a_recording_begins_is_in_no_other_repetition(
    first: int, repetitions: int
) -> None:
    """Before the first instants there is nothing that would foretell the noise."""
    for seed in range(3):
        series = pushed(data(seed, "", repetitions), 1, 0, STEP * first, 0.2, 12.0)
        found = pulses_in(series, DEFAULTS)
        assert all((one.repetition, one.run, one.amplitude > 0) == (0, 0, True) for one in found)
        assert len(found) == 1 or first < 12


@pytest.mark.parametrize("p", [0, 1])
@pytest.mark.parametrize("height", [8.0, -8.0])
def test_of_two_repetitions_it_is_the_one_with_the_larger_residual(p: int, height: float) -> None:
    time = STEP * INSTANTS * p + 2.5
    below_noise = [
        replace(s, residual=noise(np.random.default_rng(k), "", s.speed))
        for k, s in enumerate(data(5, repetitions=2))
    ]
    (pulse,) = pulses_in(pushed(below_noise, 0, p, time, 0.15, height), DEFAULTS)
    assert (pulse.repetition, pulse.joint) == (p, "shoulder")
    assert pulse.time == pytest.approx(time, abs=0.1)
    assert np.sign(pulse.amplitude) == np.sign(height)


@pytest.mark.parametrize("kind", ["", "slow"])
@pytest.mark.slow
def test_a_wide_and_large_burst_does_not_hide_behind_itself(kind: str) -> None:
    """It is the most of what is seen at some speeds, and of what is far out, of two repetitions."""

    right = 0
    for seed in range(12):
        time = STEP * INSTANTS * (0.2 + 0.03 * seed)
        series = pushed(data(seed, kind, repetitions=2), 0, 0, time, 0.35, 20.0)
        pulses = pulses_in(series, DEFAULTS)
        assert all((p.run, p.joint) == (0, "shoulder") for p in pulses)
        apart = [abs(p.time - time) % (STEP * INSTANTS) for p in pulses[:1]]
        right += any(min(far, STEP * INSTANTS - far) < 0.7 for far in apart)
    assert right >= 10


def uncertain(series: list[Repeated], k: int, start: int, stop: int) -> list[Repeated]:
    """The same, but some instants of one do not count."""
    certain = np.ones(INSTANTS, dtype=bool)
    certain[start:stop] = False
    return [replace(s, certain=certain) if n == k else s for n, s in enumerate(series)]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.slow
def test_where_a_joint_sticks_there_is_no_contact_and_elsewhere_there_is(seed: int) -> None:
    """What dry friction does at rest is not the same in every repetition."""
    series = data(seed)
    stuck = pushed(series, 3, 2, 50.0 + STEP * (2 * INSTANTS + 75), 0.15, 12.0)
    assert len(pulses_in(stuck, DEFAULTS)) == 1
    assert pulses_in(uncertain(stuck, 3, 40, 110), DEFAULTS) == ()
    time = 50.0 + STEP * (2 * INSTANTS + 190)
    both = uncertain(pushed(stuck, 3, 2, time, 0.15, 6.0), 3, 40, 110)
    (pulse,) = pulses_in(both, DEFAULTS)
    assert (pulse.joint, pulse.repetition) == ("elbow", 2)
    assert pulse.time == pytest.approx(time, abs=0.2)
    scattered = [replace(s, certain=np.arange(INSTANTS) % 10 < 5) for s in stuck]
    assert pulses_in(scattered, DEFAULTS) == (), "too short to show what the noise is"


def test_bursts_come_in_the_order_of_their_significance() -> None:
    series = pushed(data(1), 0, 1, STEP * INSTANTS + 2.0, 0.2, 6.0)
    found = pulses_in(pushed(series, 3, 0, 53.0, 0.2, -12.0), DEFAULTS)
    assert [(b.run, b.joint) for b in found] == [(1, "elbow"), (0, "shoulder")]
    assert found[0].p_value <= found[1].p_value


@pytest.mark.parametrize("kind", ["", "coloured", "slow", "coloured slow", "heavy"])
@pytest.mark.slow
def test_noise_is_no_contact(kind: str) -> None:
    assert [seed for seed in range(6) if pulses_in(data(100 + seed, kind), DEFAULTS)] == []


def test_friction_that_falls_is_no_contact() -> None:
    warming = [
        replace(s, residual=s.residual + 8.0 * np.exp(-s.t / 10.0) * np.sign(s.speed))
        for s in data(7)
    ]
    assert pulses_in(warming, DEFAULTS) == ()


@pytest.mark.parametrize("lost", [0, 3, 40])
def test_the_scan_is_the_fit_at_every_row(lost: int) -> None:
    series = uncertain(data(2, "coloured slow"), 2, 100, 100 + lost)
    series = [s for s in series if s.joint == "elbow"]
    prepared = changes_of(series, [np.zeros(INSTANTS, dtype=bool)] * len(series), DEFAULTS)[0]
    rows = np.arange(100.0, 600.0)
    for width in (0.025 / STEP, 0.32 / STEP):
        exact = prepared.match(prepared.change, rows, width)[0]
        exact[~prepared.whole[100:600]] = 0.0
        np.testing.assert_allclose(scanned(prepared, width)[100:600], exact, atol=0.01)


@pytest.mark.slow
def test_noise_behind_a_low_pass_stands_out_nowhere_around_instants_that_do_not_count() -> None:
    """Smooth noise is foretold by the samples before it: where these are missing it is not."""
    stops, low_pass = np.arange(20, INSTANTS - 20, 40), butter(4, 0.5, output="sos")
    certain = np.ones(INSTANTS, dtype=bool)
    for stop in stops:
        certain[stop : stop + 3] = False
        certain[stop + 4] = False
    sizes = []
    for seed in range(40):
        rng = np.random.default_rng([seed, 9])
        smooth = [
            replace(s, residual=smoothed.reshape(s.residual.shape), certain=certain)
            for s in data(seed)
            for smoothed in [sosfiltfilt(low_pass, rng.normal(size=s.residual.size))]
            if s.joint == "elbow"
        ]
        nothing = [np.zeros(INSTANTS, dtype=bool)] * len(smooth)
        for one in changes_of(smooth, nothing, DEFAULTS):
            z = scanned(one, 1.5).reshape(one.of.residual.shape)
            sizes.append(np.stack([z[1:, stops + 3 + k].ravel() for k in range(12)]))
    rms = np.sqrt(np.mean(np.concatenate(sizes, axis=1) ** 2, axis=1))
    assert rms.max() < 1.6 * np.median(rms[rms > 0])


def test_instants_of_a_bump_are_left_out_of_all_repetitions() -> None:
    t = STEP * np.arange(1000)
    recording: Any = SimpleNamespace(start=100.0)
    replicate: Any = SimpleNamespace(t=t, recording=recording)
    run = Run(
        kind="repeated",
        replicates=(replicate,),
        index=np.arange(1000).reshape(4, 250),
        edges=np.array([0, 125, 250]),
    )
    pulse = DisturbancePulse(
        run=0,
        number=1,
        repetition=2,
        joint="elbow",
        time=100.0 + 11.0,
        width=0.1,
        amplitude=5.0,
        p_value=1e-9,
    )
    short = without(run, [pulse], DEFAULTS.contacts)
    assert without(run, [], DEFAULTS.contacts) is run
    # One second into the period, less and plus four widths.
    gone = set(range(250)) - set(short.index[0])
    assert min(gone) == pytest.approx(30, abs=1) and max(gone) == pytest.approx(70, abs=1)
    np.testing.assert_array_equal(short.index[1] - short.index[0], 250)
    np.testing.assert_array_equal(short.edges, [0, 125 - len(gone), 250 - len(gone)])


def test_repetitions_that_are_alike_to_rounding_hold_no_contact() -> None:
    """What a filter leaves of equal numbers is no noise that a burst could stand out of."""
    model = true_model()
    one = synthetic(model, true_values(model, Fv__shoulder=2.0), 0, rate_hz=250.0)
    count = round(8.0 * 250.0)
    alike = {name: np.tile(getattr(one, name)[:count], (2, 1)) for name in ("q", "tau")}
    evidence = Evidence(model, gather(Dataset((one.replace(t=one.t[: 2 * count], **alike),))))
    fitted = fit_evidence(evidence, model)
    assert evidence.runs[0].kind == "repeated"
    assert find_contacts(evidence, fitted) == ()


@pytest.mark.slow
def test_a_push_is_told_on_the_clock_of_its_recording() -> None:
    """Later in a session the clock of a file begins anew, and `window` is on that one."""
    model = true_model()
    truth = true_values(model)
    each = []
    for seed in range(3):
        one = synthetic(model, truth, seed, rate_hz=200.0, torque_std=0.05)
        if seed < 2:
            push = (1.0 + seed) * np.exp(-(((one.t - 4.0 - seed) / 0.1) ** 2) / 2)
            push += seed * np.exp(-(((one.t - 11.0) / 0.1) ** 2) / 2)
            one = one.replace(tau=one.tau + push[:, None] * np.array([0.0, 1.0]))
        each.append(one.replace(start=100.0 * seed, name=f"run{seed}"))
    found = diagnose(model, Dataset(tuple(each)), propose="never")
    assert [step.effect.label for step in found.steps] == ["contact@elbow"]
    (said,) = (note for note in found.notes if note.startswith("Contact at elbow"))
    first, last = (float(x) for x in re.findall(r"t = (\S+) to (\S+) s", said)[0])
    assert "a push of 2 N m in run1," in said and "s, and 2 more pushes" in said
    assert (first, last) == pytest.approx((4.8, 5.2), abs=0.05), "two widths on either side"


@pytest.mark.parametrize(("rate_hz", "cutoff_hz"), [(100.0, 8.0), (200.0, 5.0)])
@pytest.mark.slow
def test_what_a_filter_makes_up_at_the_ends_is_no_contact_though_a_study_keeps_it(
    rate_hz: float, cutoff_hz: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A healthy arm used to be pushed at the last row of its recording."""
    model = true_model()
    for seed in range(3):
        run = synthetic(
            model, true_values(model), seed, rate_hz=rate_hz, torque_std=0.01, position_std=1e-6
        )
        keeps = Filter(position_cutoff_hz=cutoff_hz, ends="keep")
        evidence = Evidence(model, gather(Dataset((run,), keeps)))
        fitted = fit_evidence(evidence, model)
        assert find_contacts(evidence, fitted) == ()
        with monkeypatch.context() as as_before:
            as_before.setattr(pulse_search, "_made_up", lambda one: np.zeros(len(one.t), bool))
            found = find_contacts(evidence, fitted)
            assert found
            assert all(min(one.time, run.duration - one.time) < 0.5 for one in found)
