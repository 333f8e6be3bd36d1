"""A diagnosis with what its residual depends on, and its verdict where noise alone cannot be left.

Where nothing repeats, nothing tells the noise of what is left. But noise does not come again at the
same position and velocity: a residual that a function of the motion predicts on blocks of time that
it was not fitted to is no noise, whatever its size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from dynident.diagnosis.dependence.explained_shares import ORDER
from dynident.diagnosis.dependence.residual_dependence import MOTION, residual_dependence
from dynident.diagnosis.dependence.residual_record import joined, residual_records
from dynident.diagnosis.result import Diagnosis
from dynident.diagnosis.search.withdrawal import Path
from dynident.evidence.columns import Evidence
from dynident.evidence.held_out import on_blocks


def with_dependence(
    found: Diagnosis,
    evidence: Evidence,
    held: Evidence | None,
    path: Path,
    order: Sequence[tuple[str, ...]] = ORDER,
) -> Diagnosis:
    """Return a diagnosis that says what its residual depends on.

    Parameters
    ----------
    found : the diagnosis so far.
    evidence, held : of the training and of the test recordings; `held` may be None.
    path : to the model that was reached.
    order : which sets of inputs are asked in each turn.

    Returns
    -------
    With `residual_dependence`.
    """
    judged = path.judged[-1]
    records = residual_records(judged, (held or evidence).runs)
    if held is not None:
        # Of the training recordings blocks of time that the model was not fitted to.
        records = (*records, *residual_records(on_blocks(evidence, path.final), evidence.runs))
    names, criteria = path.final.model.robot.names, evidence.criteria.verdict
    shares = residual_dependence(judged, joined(records), names, criteria, order)
    return replace(found, residual_dependence=shares)


def doubted(found: Diagnosis, evidence: Evidence, held: Evidence | None, path: Path) -> Diagnosis:
    """Return a diagnosis that explains nothing where what it took for noise follows the motion.

    Parameters
    ----------
    found : the diagnosis so far, without a noise floor.
    evidence, held : of the training and of the test recordings; `held` may be None.
    path : to the model that was reached.

    Returns
    -------
    As it is, unless the verdict is another.
    """
    told = with_dependence(found, evidence, held, path, MOTION).residual_dependence
    follow = tuple(one.joint for one in told if one.of_the_motion(evidence.criteria.verdict))
    if not follow:
        return found
    return replace(found, verdict="unexplained", following_motion=follow, detection_limits=())
