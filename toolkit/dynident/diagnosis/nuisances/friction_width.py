"""Dry friction that reverses less or more sharply than its law: a nuisance, no missing effect.

A drive that feeds encoder noise into its torque dithers the joint, and dithered dry friction is
wider than that of a robot without noise; so is friction seen through noisy velocities. And the
width that a study states may be wider or narrower than a joint's. Without a word for it, healthy
robots would be said to lack something. So the diagnosis lets a share of a joint's dry friction
reverse over another range of speeds, where the data call for it by the same tests as for any
effect, and says so.
"""

from __future__ import annotations

import numpy as np

from dynident.diagnosis.search.ranking import rank
from dynident.effects import Block, JointEffect, Parameter, ShapeParameter
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence

_BLUNTER = (
    "blunter",
    "Noise that the drive feeds into the joint does that, or a friction_width that is not the "
    "joint's.",
)
_SHARPER = ("sharper", "The study's friction_width is larger than the joint's.")


class FrictionWidthColumn(JointEffect):
    """A share of the dry friction that reverses over k times the width: no loss at speed.

    With k below 1 it is sharper than the law, with k above 1 less sharp.
    """

    name = "blunted_friction"
    law = "Fb (tanh(v/(k w)) - tanh(v/w))"
    sign_of = "opposite spikes on both sides of zero velocity"
    experiment = "move {joint} with less noise in the drive"

    def parameters(self, robot):
        unit = robot.torque_units[robot.names.index(str(self.joint))]
        return (Parameter("Fb", unit, 0.0),)

    def shape_parameters(self, robot):
        return (ShapeParameter("k", "1", (0.5, 2.0, 4.0, 8.0), lower=0.2, upper=15.0),)

    def at_joint(self, block: Block) -> np.ndarray:
        v = block.v[:, [block.index(self.joint)]]
        return block.sign(v / self.shape[0]) - block.sign(v)


def with_friction_width(evidence: Evidence, fitted: EvidenceFit) -> EvidenceFit:
    """Return the fit with another friction width at the joints where the data call for it."""
    model = fitted.model
    dry = [e.joint for e in model.effects if e.name == "coulomb_friction"]
    wanted = tuple(FrictionWidthColumn(joint).on(model.robot) for joint in dry)
    wanted = tuple(effect for effect in wanted if effect not in model)
    if not wanted:
        return fitted
    for score in rank(evidence, fitted, 0, only=wanted, least=0.0).passing:
        model = model + score.effect
    return fitted if model is fitted.model else fit_evidence(evidence, model)


def friction_width_notes(fitted: EvidenceFit) -> tuple[str, ...]:
    """Joints whose dry friction has another width, in plain words."""
    model, notes = fitted.model, []
    for effect in model.effects:
        if isinstance(effect, FrictionWidthColumn):
            wide = effect.shape[0] * model.friction_width
            unit = model.robot.units[model.robot.names.index(str(effect.joint))]
            share = fitted.values[model.slices[effect.label]][0]
            whole = fitted.values[model.slices[f"coulomb_friction@{effect.joint}"]][0]
            if share < fitted.criteria.nuisances.friction_width_share * whole:
                continue  # what was added since has taken its place
            part = f"{100 * share / whole:.0f} % of it" if 0 < share < whole else "it"
            how, why = _BLUNTER if effect.shape[0] > 1 else _SHARPER
            notes.append(
                f"Dry friction at {effect.joint} is {how} than tanh(v / {model.friction_width:g} "
                f"{unit}/s): {part} reverses over {wide:.2g} {unit}/s. {why}"
            )
    return tuple(notes)
