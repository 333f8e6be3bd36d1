"""The torque of a robot with effects, and the order in which its columns can be evaluated."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynident.arguments import checked
from dynident.batch import side_by_side
from dynident.effects import Block, Effect, Needs
from dynident.model.parametrised_robot import ParametrisedRobot


@checked
@dataclass(frozen=True, repr=False)
class Model(ParametrisedRobot):
    """A robot and its effects, as a torque that is linear in its parameters.

    The parameters are the robot's base parameters (structurally identifiable combinations of the
    standard inertial parameters), then those of each effect in turn.

    Attributes
    ----------
    robot : the tree of joints and links.
    effects : at most one of a label.
    friction_width : rad/s or m/s, see `dynident.effects.FRICTION_WIDTH`; of all joints, or n of
        them.
    laws : of the user, whose effects can be in the model, and are looked for where it fails.
    """

    # --- torque --------------------------------------------------------------------------------

    def block(
        self,
        t,
        q,
        v,
        a,
        *,
        carries_payload: bool = False,
        number: int = 0,
        temperature: np.ndarray | None = None,
    ) -> Block:
        """Return samples as effects see them, without what depends on the model's bodies.

        Parameters
        ----------
        t : (T,) s, from the start of the session.
        q, v, a : (T, n) rad or m, and their derivatives.
        carries_payload : whether the payload under study is on the robot.
        number : of the recording in its study, from 1; 0 where that does not matter.
        temperature : (T, n) degrees Celsius of the motors; or None.

        Returns
        -------
        A block for `columns`, `with_regressor` or `ready`.
        """
        return Block(
            t,
            q,
            v,
            a,
            names=self.robot.names,
            friction_width=self.friction_widths,
            carries_payload=carries_payload,
            tip=self.robot.tip,
            number=number,
            temperature=temperature,
        )

    def with_regressor(self, block: Block) -> Block:
        """Return a block with the rigid-body regressor, which is costly; as it is if it has it."""
        if block.rigid is not None:
            return block
        return replace(block, rigid=self.robot.regressor(block.q, block.v, block.a))

    def columns(
        self,
        block: Block,
        values: np.ndarray | None = None,
        known: Mapping[str, np.ndarray] | None = None,
    ) -> np.ndarray:
        """Torque per unit of each parameter.

        Parameters
        ----------
        block : Block
            Of any length; the regressor is evaluated here unless it has one.
        values : (p,), optional
            Parameter values at which columns that depend on the fitted model are taken; without
            them those that depend on its torque are zero, and its bodies are as described.
        known : label -> (T, n, k), optional
            Columns of effects that need the whole recording, see `whole_columns`; without them
            the block is taken for it.

        Returns
        -------
        (T, n, p) in N m or N per unit of the parameters.
        """
        if any(effect.needs_regressor for effect in self.effects):
            block = self.with_regressor(block)
        full = side_by_side(len(block.t), (self.robot.n, self.size))
        rank = self.base.rank
        full[:, :, rank:] = 0.0
        self._write_rigid(block, full[:, :, :rank])

        def torque(found: Mapping[str, np.ndarray]) -> np.ndarray:
            # With the regressor at hand, a product is quicker than recursive inverse dynamics.
            assert values is not None
            return _product(self._filled(full, found), self._without_loads(values))

        given = known or {}
        wanted = [e for e in self.effects if not (e.needs_torque and values is None)]
        found = self._in_order(
            [e for e in wanted if e.label not in given], block, values, given, torque
        )
        return self._filled(full, found)

    def whole_columns(
        self, block: Block, values: np.ndarray | None = None
    ) -> dict[str, np.ndarray]:
        """Columns of the effects that need the whole recording, by their labels.

        Parameters
        ----------
        block : Block
            The whole recording at its full rate; no regressor is needed.
        values : as for `columns`.

        Returns
        -------
        label -> (T, n, k)
        """
        whole = [effect for effect in self.effects if effect.needs_recording]
        return self._in_order(
            whole, block, values, {}, lambda found: self.torque_without_loads(block, values, found)
        )

    def torque(
        self, block: Block, values: np.ndarray, known: Mapping[str, np.ndarray] | None = None
    ) -> np.ndarray:
        """Predicted torque, in N m or N.

        Parameters
        ----------
        block, values, known : as for `columns`.

        Returns
        -------
        (T, n)
        """
        return _product(self.columns(block, values, known), values)

    def torque_without_loads(
        self,
        block: Block,
        values: np.ndarray | None,
        known: Mapping[str, np.ndarray] | None = None,
    ) -> np.ndarray:
        """Predicted torque, but for effects that depend on it, (T, n) in N m or N.

        By recursive inverse dynamics: `block` needs no regressor unless an effect does.

        Parameters
        ----------
        block : Block
            Of any length.
        values, known : as for `columns`; without values the torque is zero.

        Returns
        -------
        (T, n)
        """
        if values is None:
            return np.zeros(block.q.shape)
        carries = block.carries_payload
        bodies = self._bodies(values, carries_payload=carries)
        torque = bodies.inverse_dynamics(block.q, block.v, block.a)
        for effect in self.effects:
            if effect.needs_torque or effect.is_payload:
                continue
            own, at = (known or {}).get(effect.label), values[self.slices[effect.label]]
            if own is None:
                acting = list(effect.acting_at(self.robot))
                torque[:, acting] += effect.acting_columns(self.ready(effect, block, values)) @ at
            else:
                torque += own @ at
        return torque

    # --- in which order columns can be evaluated ------------------------------------------------

    def ready(self, effect: Effect, block: Block, values: np.ndarray | None) -> Block:
        """Return a block with all that an effect needs of the model: bodies, regressor, torque.

        What the block has already stays as it is.

        Parameters
        ----------
        effect : of this model, or a candidate for it.
        block : of any length.
        values : (p,); None for the robot as described, and no torque.

        Returns
        -------
        A block that effects of the same `shares_block` can use as well.
        """
        block = self.with_bodies(effect, block, values)
        if effect.needs_regressor:
            block = self.with_regressor(block)
        if effect.needs_torque and block.torque is None:
            block = replace(block, torque=self.torque_without_loads(block, values))
        return block

    def with_bodies(self, effect: Effect, block: Block, values: np.ndarray | None) -> Block:
        """Return a block with the bodies that an effect needs, and no more of what it needs.

        Parameters
        ----------
        effect, block, values : as for `ready`.

        Returns
        -------
        The block itself where the effect needs none, or the block has them.
        """
        if effect.needs_bodies and block.body is None:
            values = self.given_values() if values is None else values
            carries = block.carries_payload
            body = self.current_robot(values, effect, carries_payload=carries)
            empty = self.current_robot(values, effect) if carries else body
            block = replace(block, body=body, empty=empty, rotor=self.rotor(values))
        return block

    def shares_block(self, effect: Effect) -> Hashable:
        """Return what effects have in common that can use one and the same `ready` block."""
        # What comes before an effect of the model is another robot than what a candidate sees.
        before = effect.label if effect.needs_bodies and effect in self else ""
        return effect.needs & Needs.OF_MODEL, before

    def _in_order(
        self,
        effects: Sequence[Effect],
        block: Block,
        values: np.ndarray | None,
        known: Mapping[str, np.ndarray],
        torque: Callable[[Mapping[str, np.ndarray]], np.ndarray],
    ) -> dict[str, np.ndarray]:
        """Columns by label: of the effects that make the torque, then of those that depend on it.

        `torque` predicts it from the columns of the former, as soon as one of the latter asks.
        """
        found = dict(known)
        for effect in sorted(effects, key=lambda one: one.needs_torque):
            if effect.needs_torque and block.torque is None:
                block = replace(block, torque=torque(found))
            columns = effect.columns(self.ready(effect, block, values))
            effect.require_finite(columns, block)
            found[effect.label] = columns
        return found

    def _write_rigid(self, block: Block, out: np.ndarray) -> None:
        kept = self.base.independent
        if block.rigid is None:
            self.robot.regressor(block.q, block.v, block.a, columns=kept, out=out)
        else:
            out[:] = np.take(block.rigid, kept, axis=2)

    def _filled(self, full: np.ndarray, found: Mapping[str, np.ndarray]) -> np.ndarray:
        for label, own in found.items():
            full[:, :, self.slices[label]] = own
        return full

    def _without_loads(self, values: np.ndarray) -> np.ndarray:
        """Values with those of effects that depend on the predicted torque at zero."""
        without = np.array(values)
        for effect in self.effects:
            if effect.needs_torque:
                without[self.slices[effect.label]] = 0.0
        return without


def _product(columns: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Columns (T, n, p) @ values, for columns that have their samples side by side, (T, n)."""
    return (values @ columns.transpose(1, 2, 0)).T
