import numpy as np
import pytest

from dynident.errors import RecordingError
from dynident.recording import Recording

T = np.arange(5) * 0.1
Q = np.ones((5, 2))
JOINTS = ("a", "b")


def broken(array, row, column, value):
    array = np.array(array, dtype=float)
    array[row, column] = value
    return array


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"t": T[:, None]}, r"t has the shape \(5, 1\)"),
        ({"t": T[:1], "q": Q[:1], "tau": Q[:1]}, "holds 1 sample;|holds 1 sample"),
        ({"t": []}, "holds 0 samples"),
        (
            {"t": [0, 0.1, 0.1, 0.3, 0.4]},
            r"row 3, column t: the time stamp 0.1 s is there twice. drop one",
        ),
        ({"t": [0, 0.1, 0.1, 0.2, 0.2]}, r"there twice \(2 such rows\). log it with more digits"),
        ({"t": [0, 0.2, 0.1, 0.3, 0.4]}, r"row 3, column t: time goes back from 0.2 to 0.1 s"),
        ({"t": [0, 0.1, np.nan, 0.3, 0.4]}, "row 3, column t: nan is not a finite number"),
        ({"q": Q[:4]}, r"q has the shape \(4, 2\) where 5 time stamps and 2 joints"),
        ({"q": Q[:, :1]}, r"q has the shape \(5, 1\)"),
        ({"tau": broken(Q, 3, 1, np.inf)}, "row 4, column tau.b: inf is not a finite number"),
        ({"v": broken(Q, 0, 0, np.nan)}, "row 1, column v.a: nan"),
        ({"q": [["x", "y"]] * 5}, "q does not hold numbers"),
        ({"q": Q + 1j}, "q does not hold numbers"),
        ({"q": None}, "q "),
        ({"joints": ()}, "no joints are named"),
        ({"joints": ("a", "a")}, "the joint 'a' is named twice"),
        ({"joints": ("a", " b")}, "' b' is no name of a joint"),
        ({"joints": ("a", "b\nc")}, "no name of a joint"),
        ({"joints": "ab"}, "is one text"),
        ({"period": 0.0}, "period = 0.0"),
        ({"period": float("nan")}, "period = nan"),
        ({"period": "long"}, "period = 'long'"),
        ({"start": float("inf")}, "start = inf"),
        ({"window": (2.0, 1.0)}, r"window = \(2.0, 1.0\)"),
        ({"window": (0.0, "end")}, "window = "),
        ({"use": "validation"}, 'use = \'validation\'.* "train" or "test"'),
        ({"torque": "held"}, "torque = 'held'.*held_command"),
        ({"payload": "yes"}, "payload = 'yes'"),
    ],
)
def test_every_defect_has_one_clear_message(changes, message):
    arguments = {"t": T, "q": Q, "tau": Q, "joints": JOINTS, "name": "run"} | changes
    with pytest.raises(RecordingError, match=message) as caught:
        Recording(**arguments)
    assert str(caught.value).startswith("run")
    assert "\n" not in str(caught.value)


def test_rate_and_jitter():
    even = Recording(T, Q, Q, JOINTS)
    assert even.rate_hz == pytest.approx(10)
    assert even.jitter < 1e-12
    uneven = Recording(np.array([0, 0.1, 0.25, 0.3, 0.4]), Q, Q, JOINTS)
    assert uneven.jitter == pytest.approx(0.5)


def test_one_joint_may_come_as_vectors():
    one = Recording(T, T, T, ("slider",))
    assert one.q.shape == one.tau.shape == (5, 1)


def test_it_cannot_be_changed_from_outside():
    q = Q.copy()
    recording = Recording(T, q, q, JOINTS)
    q[0, 0] = 7
    assert recording.q[0, 0] == 1
    with pytest.raises(ValueError, match="read-only"):
        recording.q[0, 0] = 7


def test_select_reorders_every_signal(arm):
    swapped = arm.select(["elbow", "shoulder"])
    assert swapped.joints == ("elbow", "shoulder")
    for signal in ("q", "tau", "v", "q_ref"):
        np.testing.assert_array_equal(getattr(swapped, signal), getattr(arm, signal)[:, ::-1])
    assert swapped.a is None
    with pytest.raises(RecordingError, match=r"no joint 'wrist'.*shoulder, elbow"):
        arm.select(["wrist"])


def test_windows_that_touch_share_no_sample(arm):
    first, second = arm.cut(None, 2.0), arm.cut(2.0)
    assert first.samples + second.samples == arm.samples
    assert second.t[0] == 2.0
    with pytest.raises(RecordingError, match=r"holds no samples.*from 0 to 3.996"):
        arm.cut(10, 20)
    with pytest.raises(RecordingError, match="is empty"):
        arm.cut(2, 1)


def test_it_prints_as_one_line(arm):
    assert repr(arm) == "<Recording arm: shoulder, elbow; 1000 samples at 250 Hz, 3.996 s; train>"
