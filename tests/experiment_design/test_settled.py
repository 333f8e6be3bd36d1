"""What a designed recording settled: a rival outside the group that was asked leaves it open."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from dynident.experiment_design.virtual_recording import ClosedDesignLoop


def named(*labels: str) -> tuple[Any, ...]:
    return tuple(SimpleNamespace(label=label) for label in labels)


@pytest.mark.parametrize(
    ("steps", "says"),
    [
        ("A", "A or B: settled, it is A."),
        ("AC", "A or B: not B; A or C is still open."),
        ("CA", "A or B: not B; A or C is still open."),
        ("AB", "A or B: still open."),
        ("CAB", "A or B: still open beside C."),
        ("C", "A or B: none of them is needed now."),
    ],
)
def test_it_is_settled_only_where_no_rival_is_left(steps: str, says: str) -> None:
    effect, *rivals = named(*steps)
    step: Any = SimpleNamespace(effect=effect, indistinguishable=tuple(rivals))
    task: Any = SimpleNamespace(task=SimpleNamespace(tell=(named("A", "B"),)))
    after: Any = SimpleNamespace(steps=(step,))
    whole: Any = None
    loop = ClosedDesignLoop(before=whole, designed=task, recording=whole, after=after)
    assert loop.settled == (says,)
