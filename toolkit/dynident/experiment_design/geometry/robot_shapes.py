"""The shapes of a robot's links, as Drake reads them from its description."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dynident.errors import DesignError
from dynident.robot import Robot
from dynident.robot.formats.tree_assembly import quiet

_SUFFIX = {"urdf": "urdf", "sdf": "sdf", "mjcf": "xml"}


@dataclass(frozen=True, eq=False)
class RobotShapes:
    """A robot with its visual and collision geometry, before its diagram is built.

    Attributes
    ----------
    builder, plant, scene : of Drake; the plant is finalized.
    places : (n,) of the robot's joints among the plant's positions.
    """

    builder: Any
    plant: Any
    scene: Any
    places: np.ndarray

    @classmethod
    def of(cls, robot: Robot) -> RobotShapes:
        """Read the geometry of a robot's description.

        Parameters
        ----------
        robot : with the description that it was read from.

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
            plant.Finalize()
            places = [plant.GetJointByName(name).position_start() for name in robot.names]
        except Exception as error:  # Drake's readers fail in as many ways as files do
            said = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise DesignError(f"geometry cannot be read: {said}", description.path) from None
        return cls(builder, plant, scene, np.array(places))

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
