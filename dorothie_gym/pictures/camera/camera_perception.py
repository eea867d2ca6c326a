"""Perception by the camera: the roles observe the bodies and landmarks that the picture shows, and no others.

A picture is drawn once for each decision, whether it is observed or not. The car's own safety functions, such as hazard
stops, keep the sensors of the simulation (`sim.sensing.perception`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from dorothie_gym.ontology.roles import Role
from dorothie_gym.pictures.camera.scenery.landmarks import landmark_key
from dorothie_gym.pictures.camera.session_pictures import camera_of
from dorothie_gym.pictures.camera.visibility import PERCEPTION_CAMERA, is_body_seen, is_landmark_recognised
from dorothie_gym.session.observed_tables import write_landmarks
from dorothie_gym.session.providers import OBSERVERS
from dorothie_gym.sim.sensing.perception import BODY, look_around
from dorothie_gym.sim.state.records import EyeRecord, SeenRecord
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import RecordArray, empty_records, plain
from dorothie_gym.support.copying import CachedViews
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.session_camera import SessionCamera
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.session.spaces.observations import Observation
    from dorothie_gym.sim.world import World
    from dorothie_gym.tasks.storyboard import Landmark


class CameraPerception(CachedViews):
    """Bodies and landmarks that the camera on the car of a session shows.

    Attributes:
        in_view: indices of the landmarks that are recognised at the current decision, ascending.
        recognised: indices of the landmarks that have been recognised so far, in the order of the first time.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_camera", "_eye", "_seen")

    def __init__(self, world: World, scenario: Scenario) -> None:
        """Takes the first look.

        Args:
            world: world of the session.
            scenario: storyboard and street names.
        """
        self._world, self._scenario = world, scenario
        self._pixels: Mapping[int, int] = {}
        self.in_view: tuple[int, ...] = ()
        self.recognised: tuple[int, ...] = ()
        self.look()

    @cached_property
    def _camera(self) -> SessionCamera:
        return camera_of(self._world.town, self._scenario, PERCEPTION_CAMERA)

    @cached_property
    def _eye(self) -> RecordArray[EyeRecord]:
        """Visibility without misses, which the picture replaces."""
        return empty_records(EyeRecord, 1)

    @cached_property
    def _seen(self) -> RecordArray[SeenRecord]:
        """Scratch list with room for all bodies."""
        return empty_records(SeenRecord, 0)

    def look(self) -> None:
        """Updates to the current decision."""
        boxes = self._camera.render(self._world).bodies
        self._pixels = dict(zip(boxes.keys.tolist(), boxes.pixels.tolist(), strict=True))
        self.in_view = tuple(
            landmark.index
            for landmark in self._scenario.storyboard.landmarks
            if self._recognises(landmark, self.pixels(landmark_key(landmark.index)))
        )
        self.recognised += tuple(index for index in self.in_view if index not in self.recognised)

    def pixels(self, key: int) -> int:
        """Returns the number of visible pixels of a body, by its key; landmarks have a `landmark_key`."""
        return self._pixels.get(key, 0)

    def _recognises(self, landmark: Landmark, pixels: int) -> bool:
        visibility, (x, y) = self._world.visibility, self._world.car.position.tolist()
        distance = pm.hypot(landmark.position[0] - x, landmark.position[1] - y)
        return is_landmark_recognised(pixels, visibility.clarity * visibility.transmission(distance))

    # --- Observations -------------------------------------------------------------------------------------------------

    def add_to(self, observations: Mapping[str, Observation]) -> None:
        """Writes visible objects into the observations of the roles that see them, which own their arrays."""
        for role in OBSERVERS:
            if role in observations:
                observation = observations[role]
                self._write_landmarks(role, observation)
                self._write_bodies(role, observation["objects"])

    def _write_landmarks(self, role: Role, observation: Observation) -> None:
        """Adds the recognised landmarks to those on the Co-Wizard's map, and the flags of those in view."""
        landmarks, table = self._scenario.storyboard.landmarks, observation["landmarks"]
        rows = [landmark.index for landmark in landmarks]
        if role is Role.CO_WIZARD:
            known = [landmark.index for landmark in landmarks[: len(table)] if not landmark.hidden]
            rows = [*known, *(index for index in self.recognised if landmarks[index].hidden)]
            write_landmarks(table, [landmarks[index] for index in rows])
        in_view = np.zeros(len(table), np.int8)
        in_view[[row for row, index in enumerate(rows[: len(table)]) if index in self.in_view]] = 1
        observation["landmarks_in_view"] = in_view

    def _write_bodies(self, role: Role, table: Array) -> None:
        """Writes the bodies that are seen as rows of `ObjectColumn`; their places have the errors of the visibility."""
        table[:] = 0.0
        world, row = self._world, 0
        heading, (x, y) = float(world.car.heading), world.car.position.tolist()
        believed_x, believed_y, believed_heading = world.localizer.pose.tolist()
        cosine, sine = pm.cos(believed_heading - heading), pm.sin(believed_heading - heading)
        for key, kind, at_x, at_y, _, length, width, speed, _ in self._bodies().tolist():
            dx, dy = at_x - x, at_y - y
            distance = pm.hypot(dx, dy)
            if row == len(table):
                break
            if not is_body_seen(self.pixels(int(key)), world.visibility.gain(distance)):
                continue
            if role is Role.CO_WIZARD:
                at_x, at_y = believed_x + dx * cosine - dy * sine, believed_y + dx * sine + dy * cosine
            bearing = wrap_radians(pm.atan2(dy, dx) - heading)
            table[row] = kind, at_x, at_y, distance, bearing, length, width, speed
            row += 1

    def _bodies(self) -> Array:
        """Returns all bodies within `visibility.CLEAR_SIGHT`, nearest first: (n, 9), columns `perception.BODY`."""
        arrays = self._world.sensing_arrays
        room = len(arrays.vehicles) + len(arrays.pedestrians) + len(arrays.props)
        if len(self._seen) < room:
            self._seen = empty_records(SeenRecord, room)
        plain(self._eye)[:] = plain(arrays.eye)
        plain(self._eye)["sight"] = math.inf
        table = np.empty((len(self._seen), len(BODY)))
        count = look_around(arrays._replace(seen=self._seen, eye=self._eye), self._world.frame, table)
        return table[:count]
