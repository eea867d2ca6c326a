"""Pictures of the camera on the car of a session, for its observations and for spectators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig
from dorothie_gym.session.providers import FIELDS, OBSERVERS
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.session.spaces.observations import Observation
    from dorothie_gym.sim.world import World


def camera_of(town: Town, scenario: Scenario, config: CameraConfig) -> SessionCamera:
    """Returns a camera on the car of a session."""
    names = [name.label for name in scenario.street_names]
    return SessionCamera(SessionScene(town_scene(town), names, scenario.storyboard.landmarks), config)


def windscreen_camera(town: Town, scenario: Scenario, config: EnvConfig, size: tuple[int, int]) -> SessionCamera:
    """Returns a spectators' camera of a width and height [px], otherwise like the session's camera."""
    own = config.camera or CameraConfig()
    return camera_of(town, scenario, replace(own, width=size[0], height=size[1], outputs=(CameraOutput.RGB,)))


class SessionPictures(CachedViews):
    """Pictures of a session, each drawn at its first use from the world's state; copies of a session draw their own."""

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_camera", "_taken")

    _taken: tuple[int, CameraFrame] | None = None

    def __init__(self, world: World, scenario: Scenario, config: CameraConfig) -> None:
        self._world, self._scenario, self._config = world, scenario, config

    @cached_property
    def _camera(self) -> SessionCamera:
        return camera_of(self._world.town, self._scenario, self._config)

    def frame(self, decision: int) -> CameraFrame:
        """Returns the picture at the current decision, of this number."""
        if self._taken is None or self._taken[0] != decision:
            self._taken = decision, self._camera.render(self._world)
        return self._taken[1]

    def add_to(self, observations: Mapping[str, Observation], decision: int) -> None:
        """Adds the pictures of the current decision to the observations of the roles that see them."""
        for role in OBSERVERS:
            if role in observations:
                observations[role].update(self._fields(decision))

    def _fields(self, decision: int) -> dict[str, Any]:
        frame = self.frame(decision)
        parts = {FIELDS[output]: getattr(frame, output.value) for output in self._config.outputs if output in FIELDS}
        return {name: part.copy() for name, part in parts.items()}
