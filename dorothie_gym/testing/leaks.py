"""Check that a role observes no hidden information."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar

import numpy as np

from dorothie_gym.ontology.roles import Role
from dorothie_gym.pictures.camera.range_sensors import Lidar, Radar
from dorothie_gym.pictures.camera.scenery.landmarks import landmark_key
from dorothie_gym.pictures.camera.session_pictures import camera_of, car_state, scene_of
from dorothie_gym.pictures.camera.visibility import PERCEPTION_CAMERA
from dorothie_gym.session.car_sensors import car_sensor_fields
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig, PerceptionModel
from dorothie_gym.session.providers import OBSERVERS, sensor_spaces
from dorothie_gym.session.scenario import Scenario, draw_scenario
from dorothie_gym.session.spaces.actions import noop
from dorothie_gym.support import portable_math as pm
from dorothie_gym.tasks.storyboard import TaskMessages
from dorothie_gym.testing.playing import (
    ByAgent,
    Decision,
    ParallelSession,
    first_unequal,
    play_again,
    play_random,
    play_scripted,
)

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.sim.world import World

CO_WIZARD = str(Role.CO_WIZARD)
AD_WIZARD = str(Role.AD_WIZARD)
PARTICIPANT = str(Role.PARTICIPANT)

_BESIDE: Final = 40.0
"""Distance from the place of a landmark within which all of its model lies [m]."""


def check_observations_do_not_leak(env: ParallelSession, *, seed: int = 0, decisions: int = 60) -> None:
    """Checks that the Co-Wizard observes neither hidden landmarks nor the participant's tasks.

    A session is played with random and with scripted actions. The same actions are then played in two altered
    scenarios: hidden landmarks are at other sites; the story and the order of the tasks differ. Observation,
    action mask and refusals of the Co-Wizard must be bit-identical at every decision (with other tasks: up to the
    first arrival, which all roles may notice, and with an idle Ad-Wizard, because its refusals depend on the task). The
    participant's observation must differ, or the check would be meaningless.

    Pictures, lidar and radar may show a hidden landmark. The pictures and scans of the Co-Wizard and of the participant
    must be equal at every decision at which no hidden landmark is in view of a camera or sensor in either session. With
    perception by the camera, everything is compared until one is in view for the first time; afterwards, the Co-Wizard
    and the car may know it.

    Args:
        env: a `DuoWizardEnv`, or a wrapper around one with the same parallel API and
            `reset(options={"scenario": ...})`. It is reset several times.
        seed: first candidate for the seed of the session; it counts up until a scenario has a hidden landmark.
        decisions: decisions played in each session, at 2 Hz by default.

    Raises:
        AssertionError: a field differs; the message names the scenario, the decision and the field.
    """
    for play in (play_random, play_scripted):
        check_hidden_landmarks(env, play, _seed_with_hidden_landmark(env.unwrapped.town, seed), decisions)
        _check_errands(env, play, seed, decisions)


Play = Callable[..., Iterator[Decision]]


class Compared(NamedTuple):
    """Numbers of decisions of a pair of sessions.

    Attributes:
        decisions: number of decisions.
        in_view: decisions at which a hidden landmark was in view in either session.
        pictures: decisions at which pictures, if there are any, were compared.
    """

    decisions: int
    in_view: int
    pictures: int


def check_hidden_landmarks(env: ParallelSession, play: Play, seed: int, decisions: int) -> Compared:
    """Checks that the Co-Wizard's observations do not depend on the sites of hidden landmarks.

    Args:
        env: see `check_observations_do_not_leak`.
        play: plays a session, such as `playing.play_scripted`.
        seed: seed of the session, whose scenario has a hidden landmark.
        decisions: decisions played.

    Raises:
        AssertionError: see `check_observations_do_not_leak`.
    """
    played, in_view = _with_views(env, play(env, seed=seed, decisions=decisions))
    moved = with_hidden_landmarks_moved(env.unwrapped.scenario, env.unwrapped.town, np.random.default_rng(seed))
    actions = [decision.actions for decision in played if decision.actions]
    again, in_view_again = _with_views(env, play_again(env, moved, actions))
    where = f"hidden landmarks moved, seed {seed}"
    by_camera = env.unwrapped.config.perception is PerceptionModel.CAMERA
    pictures = _scene_fields(env.unwrapped.config)
    views = list(map(bool.__or__, in_view, in_view_again))
    for k, (decision, (observations, infos)) in enumerate(zip(played, again, strict=False)):
        if by_camera and any(views[: k + 1]):
            break  # the Co-Wizard's knowledge may affect where the car stops
        if not views[k]:
            _check_pictures(where, k, decision.observations, observations, pictures)
        one, other = (_without(pictures, part) for part in (decision.observations, observations))
        _check_equal(where, k, (one, decision.infos), (other, infos))
        field = first_unequal(one[PARTICIPANT]["objects"], other[PARTICIPANT]["objects"], "objects")
        assert field is None, f"{where}, decision {k}: the participant's observation {field} differs"
        seen, moved_seen = (part[PARTICIPANT]["landmarks"] for part in (decision.observations, observations))
        assert not np.array_equal(seen, moved_seen), f"{where}, decision {k}: the participant must see the difference"
    return Compared(len(views), sum(views), views.index(True) if by_camera and any(views) else views.count(False))


# --- Pictures ---------------------------------------------------------------------------------------------------------

_Played = TypeVar("_Played")


class _Viewers:
    """Cameras and sensors of a session, with the samples of what the roles see, or see by."""

    def __init__(self, town: Town, scenario: Scenario, config: EnvConfig) -> None:
        self._cameras = [camera_of(town, scenario, each) for each in _cameras(config)]
        scene, sensors = scene_of(town, scenario), config.sensors
        lidar = [] if sensors.lidar is None else [Lidar(scene, sensors.lidar)]
        self._scanners = [*lidar, *([] if sensors.radar is None else [Radar(scene, sensors.radar)])]
        self._hidden = [mark for mark in scenario.storyboard.landmarks if mark.hidden]
        from_above = [each for each in config.all_cameras.values() if CameraOutput.BIRDS_EYE in each.outputs]
        self._reach = max(
            (0.5 * each.metres_per_pixel * pm.hypot(each.width, each.height) + _BESIDE for each in from_above),
            default=0.0,
        )

    def sees_hidden(self, world: World) -> bool:
        """Returns whether a hidden landmark is in view."""
        x, y = world.car.position.tolist()
        if any(pm.hypot(mark.position[0] - x, mark.position[1] - y) < self._reach for mark in self._hidden):
            return True
        car, bodies = car_state(world), world.actors.arrays
        scans = [scanner.scan(car, bodies, world.weather).instance for scanner in self._scanners]
        scans += [camera.render(world).keys for camera in self._cameras]
        keys = [landmark_key(mark.index) for mark in self._hidden]
        return any(bool(np.isin(each, keys).any()) for each in scans)


def _with_views(env: ParallelSession, playing: Iterator[_Played]) -> tuple[list[_Played], list[bool]]:
    """Returns the results of a session, and for each decision whether a picture has a sample of a hidden landmark."""
    played, views, viewers = list[_Played](), list[bool](), list[_Viewers]()
    for decision in playing:
        session = env.unwrapped.session
        if not played:
            viewers = [_Viewers(env.unwrapped.town, session.scenario, session.config)]
        views.append(viewers[0].sees_hidden(session.world))
        played.append(decision)
    return played, views


def _cameras(config: EnvConfig) -> list[CameraConfig]:
    """Returns cameras whose pixels are the samples of the pictures that the roles see, or see by.

    RGB has several samples in a pixel; labels have one, in the centre, which is none of these.
    """
    cameras = [*config.all_cameras.values()]
    if config.perception is PerceptionModel.CAMERA:
        cameras.append(PERCEPTION_CAMERA)
    return [
        dataclasses.replace(
            camera,
            width=samples * camera.width,
            height=samples * camera.height,
            antialiasing=False,
            outputs=(CameraOutput.INSTANCE,),
        )
        for camera in cameras
        for samples in {1, camera.samples}
    ]


def _scene_fields(config: EnvConfig) -> frozenset[str]:
    """Returns the fields of observations that may show a landmark: pictures, lidar and radar."""
    blind = {field.name for field in car_sensor_fields(config.sensors, config.frames)}
    return frozenset(sensor_spaces(config, Role.CO_WIZARD)) - blind


def _check_pictures(where: str, k: int, observations: ByAgent, others: ByAgent, names: frozenset[str]) -> None:
    for role in OBSERVERS:
        one, other = observations[str(role)], others[str(role)]
        for name in sorted(names):
            field = first_unequal(one.get(name), other.get(name), name)
            assert field is None, f"{where}, decision {k}: the picture {field} of {role} differs"


def _without(names: frozenset[str], observations: ByAgent) -> ByAgent:
    return {
        agent: {name: value for name, value in observation.items() if name not in names}
        for agent, observation in observations.items()
    }


# --- Tasks ------------------------------------------------------------------------------------------------------------


def _check_errands(env: ParallelSession, play: Play, seed: int, decisions: int) -> None:
    played = list(play(env, seed=seed, decisions=decisions))
    idle = noop(Role.AD_WIZARD, env.unwrapped.limits)
    actions = [{**decision.actions, AD_WIZARD: idle} for decision in played if decision.actions]
    scenario = env.unwrapped.scenario
    runs = []
    for variant in (scenario, with_other_tasks(scenario)):
        run = []
        for observations, infos in play_again(env, variant, actions):
            run.append((observations, infos))
            if any(event.type == "Subgoal" for event in env.unwrapped.last_events):
                break
        runs.append(run)
    where = f"other tasks, seed {seed}"
    for k, (one, other) in enumerate(zip(*runs, strict=False)):
        _check_equal(where, k, one, other)
        same = one[0][PARTICIPANT]["story"] == other[0][PARTICIPANT]["story"]
        assert not same, f"{where}, decision {k}: the participant must see the difference"


def _check_equal(where: str, k: int, one: tuple[ByAgent, ByAgent], other: tuple[ByAgent, ByAgent]) -> None:
    (observations, infos), (others, other_infos) = one, other
    field = first_unequal(observations[CO_WIZARD], others[CO_WIZARD])
    assert field is None, f"{where}, decision {k}: the Co-Wizard's observation {field} differs"
    for key in ("action_mask", "refused", "refusal_reason"):
        field = first_unequal(infos[CO_WIZARD][key], other_infos[CO_WIZARD][key], key)
        assert field is None, f"{where}, decision {k}: the Co-Wizard's info {field} differs"


def _seed_with_hidden_landmark(town: Town, seed: int) -> int:
    for candidate in range(seed, seed + 1000):
        if any(landmark.hidden for landmark in draw_scenario(town, None, candidate).storyboard.landmarks):
            return candidate
    raise AssertionError(f"{town.name}: no scenario of a thousand seeds has a hidden landmark")


def with_hidden_landmarks_moved(scenario: Scenario, town: Town, rng: np.random.Generator) -> Scenario:
    """Returns the scenario with its hidden landmarks at other, free sites."""
    board = scenario.storyboard
    taken = {landmark.site for landmark in board.landmarks}
    free = [site for site in town.sites if site.id not in taken]
    landmarks = list(board.landmarks)
    for k in [k for k, landmark in enumerate(landmarks) if landmark.hidden]:
        site = free.pop(int(rng.integers(len(free))))
        landmarks[k] = dataclasses.replace(
            landmarks[k],
            site=site.id,
            lane=site.lane,
            station=site.station,
            position=site.position,
            waypoint=site.waypoint,
            street=site.street,
        )
    return dataclasses.replace(scenario, storyboard=dataclasses.replace(board, landmarks=tuple(landmarks)))


def with_other_tasks(scenario: Scenario) -> Scenario:
    """Returns the scenario with another story, and with every task at the place of the next one."""
    board = scenario.storyboard
    places = [subgoal.landmark for subgoal in board.subgoals]
    subgoals = tuple(
        dataclasses.replace(
            subgoal, landmark=place, description=f"task {k}", reason=f"reason {k}", messages=TaskMessages()
        )
        for k, (subgoal, place) in enumerate(zip(board.subgoals, places[1:] + places[:1], strict=True))
    )
    return dataclasses.replace(scenario, storyboard=dataclasses.replace(board, story="A story.", subgoals=subgoals))
