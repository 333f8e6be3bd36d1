"""The shapes of a robot's links, as Drake reads them from its description."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dynident.errors import DesignError
from dynident.experiment_design.geometry.surroundings import Obstacle
from dynident.robot import Robot
from dynident.robot.formats.tree_assembly import quiet

_SUFFIX = {"urdf": "urdf", "sdf": "sdf", "mjcf": "xml"}


@dataclass(frozen=True, eq=False, kw_only=True)
class RobotShapes:
    """A robot with its visual and collision geometry, before its diagram is built.

    Attributes
    ----------
    builder, plant, scene : of Drake; the plant is finalized.
    places : (n,) of the robot's joints among the plant's positions.
    obstacles : geometries of what is around it.
    """

    builder: Any
    plant: Any
    scene: Any
    places: np.ndarray
    obstacles: tuple[Any, ...] = ()

    @classmethod
    def of(cls, robot: Robot, obstacles: tuple[Obstacle, ...] = ()) -> RobotShapes:
        """Read the geometry of a robot's description.

        Parameters
        ----------
        robot : with the description that it was read from.
        obstacles : fixed to its base.

        Raises
        ------
        DesignError
            If the robot has no description, or its geometry cannot be read.
        """
        from pydrake.multibody.parsing import Parser
        from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
        from pydrake.systems.framework import DiagramBuilder

        description = robot.description
        if description is None:
            raise DesignError("the robot has no shapes", remedy="read it from a file")
        builder = DiagramBuilder()
        plant, scene = AddMultibodyPlantSceneGraph(builder, 0.0)
        parser, path = Parser(plant), Path(description.path)
        try:
            with quiet():
                if path.is_file():
                    parser.package_map().PopulateFromFolder(path.absolute().parent)
                    parser.AddModels(path)
                else:
                    parser.AddModelsFromString(description.text, _SUFFIX[description.format])
            around = tuple(_placed(plant, one, f"obstacle {k}") for k, one in enumerate(obstacles))
            plant.Finalize()
            places = [plant.GetJointByName(name).position_start() for name in robot.names]
        except Exception as error:  # Drake's readers fail in as many ways as files do
            said = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise DesignError(f"geometry cannot be read: {said}", description.path) from None
        return cls(
            builder=builder, plant=plant, scene=scene, places=np.array(places), obstacles=around
        )

    def positions(self, q: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Return the plant's positions; what is no joint of the robot stays where it is.

        Parameters
        ----------
        q : (n,) rad or m.
        others : all positions of the plant.
        """
        found = np.array(others)
        found[self.places] = q
        return found


def _placed(plant: Any, one: Obstacle, name: str) -> Any:
    """Add an obstacle to a plant; return its geometry."""
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import CoulombFriction

    centre: Any = one.centre  # the stubs of Drake take no array
    pose, body = RigidTransform(centre), plant.world_body()
    return plant.RegisterCollisionGeometry(body, pose, one.shape(), name, CoulombFriction(0.0, 0.0))
