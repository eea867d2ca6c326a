"""Cameras and sensors of the car of a session, as fields of the observations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.car_sensors import CarSensors
from dorothie_gym.session.providers import OBSERVERS, Pictures, draw_pictures, lines_of, sensor_spaces

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
    from dorothie_gym.session.config import EnvConfig
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.session.spaces.observations import Observation
    from dorothie_gym.sim.traffic_rules import WorldEvent
    from dorothie_gym.sim.world import World


class SensorReadings:
    """Cameras and sensors of a session that has at least one.

    Pictures and scans are made when they are first read; other sensors are read at every decision.
    """

    def __init__(self, world: World, scenario: Scenario, config: EnvConfig) -> None:
        self._names = {role: tuple(sensor_spaces(config, role)) for role in OBSERVERS}
        self._pictures: Pictures | None = draw_pictures(world, scenario, config) if config.draws else None
        self._car = CarSensors(world, config, lines_of) if config.sensors.measures else None

    def begin_decision(self) -> None:
        """Notes the present before the world is stepped."""
        if self._pictures is not None:
            self._pictures.begin_decision()

    def update(self, events: Sequence[WorldEvent]) -> None:
        """Reads the sensors after a step of the world, with its events."""
        if self._car is not None:
            self._car.update(events)

    def readings(self, decision: int, role: Role = Role.CO_WIZARD) -> Mapping[str, NDArray[np.generic]]:
        """Returns the fields of a role at the current decision of this number; callers must not write to them."""
        names = self._names.get(role, ())
        known = {} if self._car is None else self._car.readings
        found = {name: value for name, value in known.items() if name in names}
        return found if self._pictures is None else found | self._pictures.readings(decision, names)

    def add_to(self, observations: Mapping[str, Observation], decision: int) -> None:
        """Adds the fields of the current decision to the observations of the roles, which own their arrays."""
        for role in OBSERVERS:
            if role in observations:
                readings = self.readings(decision, role)
                observations[role].update({name: value.copy() for name, value in readings.items()})

    def picture(self, decision: int, name: str = "") -> CameraFrame | None:
        """Returns the picture of a camera, boxes included; None for no such camera."""
        return None if self._pictures is None else self._pictures.frame(decision, name)
