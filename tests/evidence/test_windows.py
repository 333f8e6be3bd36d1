"""Windows of one recording are evaluated as one, and each has the columns that it has alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.effects import Block, catalogue
from dynident.effects.effect import Effect
from dynident.evidence.columns.column_cache import Tried
from dynident.evidence.columns.windows import sources
from dynident.evidence.evidence import Evidence
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset, Noise, Recording, numbered
from synthetic import arm, synthetic, true_values

_WINDOWS = ((0.5, 2.0), (2.0, 3.0), (4.0, 6.0))


def _model() -> Model:
    return Model(arm()) + "viscous_friction" + "coulomb_friction" + "presliding@elbow"


def _windows(seed: int, model: Model) -> tuple[Recording, ...]:
    truth = true_values(model, Fv__shoulder=1.2, Fc__elbow=0.6)
    whole = synthetic(model, truth, seed, rate_hz=250.0)
    (recordings,) = numbered(
        Dataset(tuple(whole.replace(window=window, period=None) for window in _WINDOWS))
    )
    return recordings.recordings


def _effects(model: Model) -> list[Effect]:
    return [
        catalogue()[name](joint, None, shape).on(model.robot)
        for name, joint, shape in (
            ("stribeck_friction", "elbow", (0.3,)),
            ("torque_ripple", "shoulder", ()),
            ("presliding", "shoulder", ()),
            ("torque_delay", None, ()),
            ("drive_gain", "elbow", ()),
            ("joint_elasticity", "elbow", ()),
            ("contact", "elbow", (2.0, 1.0, 5.0)),
            *((one, "elbow", ()) for one in ("viscous_friction", "coulomb_friction")),
        )
    ]


def test_windows_have_the_columns_that_each_has_alone() -> None:
    model = _model()
    recordings = _windows(0, model)
    together = Evidence(model, gather(Dataset(recordings)))
    values = np.linspace(1.0, 2.0, model.size)
    for effect in _effects(model):
        for run, recording in enumerate(recordings):
            alone = Evidence(model, gather(Dataset((recording,))))
            expected = alone.of(effect, 0, model, values)[0]
            found = together.of(effect, run, model, values)[0]
            assert np.allclose(found, expected, rtol=1e-12, atol=1e-12), effect.label
            assert np.any(found) or effect.name == "contact"
            assert np.allclose(
                together.rigid(run)[0].dense(), alone.rigid(0)[0].dense(), rtol=1e-12, atol=1e-12
            )
    contact = _effects(model)[6]
    here = [bool(np.any(together.of(contact, run, model, values)[0])) for run in range(3)]
    assert here == [False, True, False]


def test_shapes_looked_at_first_are_those_of_each_window() -> None:
    model = _model()
    together = Evidence(model, gather(Dataset(_windows(0, model))))
    values = np.linspace(1.0, 2.0, model.size)
    elastic = catalogue()["joint_elasticity"]("shoulder").on(model.robot)
    variants = list(elastic.variants(model.robot))[:3]
    for ask in (together.columns, together.first_look):
        for run, each in enumerate(ask(variants, model, values)):
            for variant, columns in zip(variants, each, strict=True):
                expected = together.of(variant, run, model, values)[0]
                assert np.allclose(columns[0], expected, rtol=1e-9, atol=1e-12)


def test_windows_are_those_of_one_recording_with_one_payload() -> None:
    model = _model()
    one, other = _windows(0, model), _windows(1, model)
    runs = gather(Dataset((*one, *other, one[0].replace(payload=True))))
    found = sources(run.replicates[0] for run in runs)
    groups = [found[run.replicates[0]].sampled for run in runs]
    assert groups[0] is groups[1] is groups[2]
    assert groups[3] is groups[4] is groups[5]
    assert len({id(group) for group in groups}) == 3
    for run in runs:
        source = found[run.replicates[0]]
        kept = source.sampled.parallel.times(source.sampled.motion.t)[source.sampled.kept]
        assert np.array_equal(kept[source.rows], run.replicates[0].t)


def test_what_an_effect_says_of_its_friction_width_is_so() -> None:
    """Those that do not change with it are not evaluated again for another width."""
    model = _model()
    sampled = gather(Dataset(_windows(0, model)))[0].replicates[0]
    block: Block = model.with_regressor(sampled.block(model))
    wider = replace(block, friction_width=3.0 * np.asarray(block.friction_width))
    for kind in catalogue().values():
        if kind.needs & kind.needs.OF_MODEL and not kind.needs & kind.needs.REGRESSOR:
            continue
        for effect in kind.candidates(model.robot):
            effect = effect.on(model.robot)
            same = np.array_equal(effect.columns(block), effect.columns(wider))
            assert same is not effect.reverses, effect.label


def test_the_latest_shapes_are_kept() -> None:
    column = np.zeros(10)
    kept = Tried(3 * column.nbytes)
    for name in "abc":
        kept.put(name, column)
    assert kept.get("a") is column
    kept.put("d", column)
    assert kept.get("b") is None
    assert all(kept.get(name) is column for name in "acd")


def test_windows_have_the_noise_of_one_recording_on_their_copies() -> None:
    """A copy of the whole recording is evaluated once, whatever windows are taken out of it."""
    model = _model()
    recordings = _windows(0, model)
    noise = Noise(np.full(2, 1e-4), np.full(2, 0.1))
    runs = gather(Dataset(recordings, noise=noise))
    whole = gather(Dataset((recordings[0].replace(window=None),), noise=noise))[0]
    motions = {id(one.motion) for run in runs for one in run.replicates}
    assert len(motions) == len(whole.replicates)
    for k, copy in enumerate(whole.replicates):
        at = {time: row for row, time in enumerate(copy.t)}
        for run in runs:
            rows = [at[time] for time in run.replicates[k].t]
            assert np.allclose(run.replicates[k].tau, copy.tau[rows], rtol=1e-12, atol=1e-12)


def test_recordings_of_their_own_have_noise_of_their_own() -> None:
    """Noise that were the same in two recordings would not be averaged over them."""
    model = _model()
    first, second = (_windows(seed, model)[0] for seed in (0, 1))
    noise = Noise(np.full(2, 1e-4), np.full(2, 0.1))
    one, two = gather(Dataset((first, second), noise=noise))
    drawn = [run.replicates[1].q - run.replicates[0].q for run in (one, two)]
    assert abs(np.corrcoef(drawn[0].ravel(), drawn[1].ravel())[0, 1]) < 0.2
