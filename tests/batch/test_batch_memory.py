"""Memory that is used again, but never while somebody holds a part of it."""

import gc
import threading

import numpy as np

from dynident.batch import memory, side_by_side

SAMPLES, SHAPE = 20_000, (3, 10)


def address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]


def test_what_somebody_holds_is_not_given_away():
    whole = side_by_side(SAMPLES, SHAPE)
    whole[:] = 1.0
    place = address(whole)
    part = whole.reshape(SAMPLES, -1)[5:, 3]  # a view of a view, of one column
    assert np.shares_memory(part, whole)
    del whole
    gc.collect()
    others = [side_by_side(SAMPLES, SHAPE) for _ in range(3)]
    for other in others:
        other[:] = 2.0
    assert np.all(part == 1.0)
    assert place not in map(address, others)


def test_what_nobody_holds_is_used_again(monkeypatch):
    monkeypatch.setattr(memory, "_free", {})
    place = address(side_by_side(SAMPLES, SHAPE))
    assert address(side_by_side(SAMPLES, SHAPE)) == place


def test_samples_lie_side_by_side_and_columns_merge_without_a_copy():
    for samples in (0, 1, 7, 8, 4096, SAMPLES):
        array = side_by_side(samples, SHAPE)
        assert array.shape == (samples, *SHAPE)
        if samples:
            assert array.strides[0] == 8
            assert address(array) % 64 == 0 and array.strides[2] % 64 == 0
            assert np.shares_memory(array.reshape(samples, 30), array)


def test_threads_never_share():
    wrong = []

    def use(number: float) -> None:
        for _ in range(50):
            array = side_by_side(SAMPLES, SHAPE)
            array[:, 0] = number
            if not np.all(array[:, 0] == number):
                wrong.append(number)

    threads = [threading.Thread(target=use, args=(float(k),)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_no_more_is_kept_than_is_said(monkeypatch):
    monkeypatch.setattr(memory, "_KEPT", 2**24)
    held = [side_by_side(SAMPLES, SHAPE) for _ in range(6)]
    held.clear()
    gc.collect()
    assert 0 < sum(map(len, memory._free.values())) <= 2**24


def test_blocks_of_another_length_do_not_stand_beside_those_of_before(monkeypatch):
    monkeypatch.setattr(memory, "_free", {})
    held = [side_by_side(4 * SAMPLES, SHAPE) for _ in range(3)]
    held.clear()
    gc.collect()
    before = sum(map(len, memory._free.values()))
    held = [side_by_side(SAMPLES, SHAPE) for _ in range(3)]
    held.clear()
    gc.collect()
    assert 0 < sum(map(len, memory._free.values())) < before / 2
