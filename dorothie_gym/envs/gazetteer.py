"""Names on the map: points of a street, of a landmark that everybody knows, and of the corners of two streets."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from dorothie_gym.envs.scenario import Scenario
from dorothie_gym.ontology import LandmarkName, StreetName
from dorothie_gym.world.town import Town
from dorothie_gym.world.town.model import Array

SPACING = 10.0
"""Distance between the points of a street [m]."""


class Gazetteer:
    """Places that names stand for, as far as the Co-Wizard's map has them.

    Attributes:
        landmarks: places of the landmarks that are not hidden, by name (n, 2) [m].
    """

    def __init__(self, town: Town, scenario: Scenario) -> None:
        self._town, self._names = town, scenario.street_names
        places: dict[LandmarkName, list[tuple[float, float]]] = {}
        for landmark in scenario.storyboard.landmarks:
            if not landmark.hidden:
                places.setdefault(landmark.name, []).append(landmark.position)
        self.landmarks = {name: np.array(found) for name, found in places.items()}

    def street(self, name: StreetName) -> Array:
        """Points of the streets of a name, every 10 m of each lane (n, 2) [m]; none if no street has it."""
        points = [
            lane.position(float(station))
            for lane in self._town.lanes
            if lane.street in self._streets(name) and not lane.in_junction
            for station in np.arange(min(SPACING, lane.length) / 2, lane.length, SPACING)
        ]
        return np.array(points).reshape(-1, 2)

    def corners(self, names: Sequence[StreetName]) -> Array:
        """Middles of the junctions where streets of all these names meet (n, 2) [m]."""
        wanted = [self._streets(name) for name in names]
        middles = [
            junction.position
            for junction, streets in zip(self._town.junctions, self._meeting, strict=True)
            if all(streets & each for each in wanted)
        ]
        return np.array(middles).reshape(-1, 2)

    def _streets(self, name: StreetName) -> frozenset[int]:
        if name in (StreetName.UNKNOWN, StreetName.QUERIED):
            return frozenset()
        return frozenset(k for k, other in enumerate(self._names) if other is name)

    @functools.cached_property
    def _meeting(self) -> tuple[frozenset[int], ...]:
        """Streets that lead to or from each junction, in their order."""
        town = self._town
        return tuple(
            frozenset(
                town.lanes[lane].street
                for connector in junction.connectors
                for lane in (*town.predecessors(connector), *(link.target for link in town.successors(connector)))
            )
            for junction in town.junctions
        )
