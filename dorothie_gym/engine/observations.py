"""Observations of the roles. A value that a role must not know is never written into its observation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.compilation import direct
from dorothie_gym.copying import Lookups
from dorothie_gym.dialogue import Utterance
from dorothie_gym.engine.beliefs import BeliefTracker
from dorothie_gym.engine.path_measurements import EgoMeasurements, UpcomingJunction
from dorothie_gym.engine.scenario import Scenario
from dorothie_gym.ontology import AGENT_ROLES, LABELS, GoalStatus, PropKind, Role, Sensor, encode_slots
from dorothie_gym.sim.ego.motion_control import motion_of
from dorothie_gym.sim.world import World
from dorothie_gym.spaces import (
    ExitColumn,
    LandmarkColumn,
    Motion,
    Observation,
    SpaceLimits,
    SubgoalColumn,
    observation_space,
    plain_text,
)
from dorothie_gym.spaces.actions import NO_MOVE
from dorothie_gym.spaces.fields import FieldBuffer
from dorothie_gym.spaces.limits import MESSAGE_LENGTH, STORY_LENGTH
from dorothie_gym.spaces.observations import MAX_UTTERANCE
from dorothie_gym.tasks import Landmark, TaskState

Table = NDArray[np.float64]

WAYPOINT_SPACING = 5.0
"""Distance between the observed waypoints of the planned path [m]."""

_SENSORS = tuple(Sensor)
_motion_of = direct(motion_of)
_PROP_NUMBERS = {kind: 1.0 + k for k, kind in enumerate(PropKind)}


@dataclass(kw_only=True)
class DeliveredMessages:
    """Speech and messages that reach the roles at a decision.

    Attributes:
        said: utterances that ended since the last decision, by speaker.
        heard: the same utterances as the listener recognises them.
        message: message of the Ad-Wizard to the participant.
        speaking: remaining speaking time of each role [s].
    """

    said: Mapping[Role, Utterance]
    heard: Mapping[Role, Utterance]
    message: str
    speaking: Mapping[Role, float]


@lru_cache(maxsize=16)
def _int64s(count: int) -> tuple[np.int64, ...]:
    """Returns the numbers below `count`, which are handed out as they are."""
    return tuple(np.int64(number) for number in range(count))


class ObservationBuilder(Lookups):
    """Builds the observations of a session, for the roles that are asked for.

    Each role has a buffer. Its template holds the values that are the same in most decisions: constant values are
    written once, rarely changing ones when they change. A copy of the template is completed and handed out.
    """

    LOOKED_UP: ClassVar[Sequence[str]] = ("_unread", "_numbers")

    def __init__(
        self,
        world: World,
        scenario: Scenario,
        task: TaskState,
        beliefs: BeliefTracker,
        limits: SpaceLimits,
        observe_acts: bool,
        junction: UpcomingJunction,
    ) -> None:
        self._world, self._task, self._beliefs = world, task, beliefs
        self._limits, self._observe_acts = limits, observe_acts
        self._junction = junction
        self._buffers = {
            role: FieldBuffer.of_space(observation_space(role, limits, observe_acts)) for role in AGENT_ROLES
        }
        self._story = plain_text(scenario.storyboard.story, STORY_LENGTH)
        self._tasks = ""
        self._weather: tuple[float, ...] = ()
        self._faults: tuple[Sensor, ...] = ()
        self._versions = (-1, -1)
        self._write_constants(scenario)

    @cached_property
    def _unread(self) -> dict[Role, Observation]:
        """Tables that are written in place of those of a role that is not asked for."""
        return {role: buffer.copy() for role, buffer in self._buffers.items()}

    @cached_property
    def _numbers(self) -> tuple[np.int64, ...]:
        return _int64s(max(self._limits.lanes, len(LABELS)))

    def build(self, delivered: DeliveredMessages, roles: Sequence[Role]) -> dict[str, Observation]:
        """Builds the observations of some roles, by agent, each in its observation space.

        Args:
            delivered: speech and messages of the last decision.
            roles: the roles that observe.
        """
        self._update_templates()
        time, speed = self._world.time, self._world.car.speed
        views: dict[str, Observation] = {}
        for role in roles:
            view = views[_NAMES[role]] = self._buffers[role].copy()
            view["time"][0], view["speed"][0] = time, speed
        ego = EgoMeasurements(self._world)
        participant, co_wizard = views.get(Role.PARTICIPANT), views.get(Role.CO_WIZARD)
        ad_wizard = views.get(Role.AD_WIZARD)
        if co_wizard is not None or ad_wizard is not None:
            true, believed = ad_wizard or self._unread[Role.AD_WIZARD], co_wizard or self._unread[Role.CO_WIZARD]
            ego.write_path(WAYPOINT_SPACING, true["waypoints"], true["path_lanes"], believed["waypoints"])
        if participant is not None or co_wizard is not None:
            true, believed = participant or self._unread[Role.PARTICIPANT], co_wizard or self._unread[Role.CO_WIZARD]
            ego.write_objects(true["objects"], believed["objects"])
        motion = self._numbers[0 if co_wizard is None and ad_wizard is None else self.motion()]
        if participant is not None:
            self._build_participant(participant, delivered, ego)
        if co_wizard is not None:
            self._build_co_wizard(co_wizard, delivered, ego, motion)
        if ad_wizard is not None:
            self._build_ad_wizard(ad_wizard, delivered, ego, motion)
        return views

    def _build_participant(self, view: Observation, delivered: DeliveredMessages, ego: EgoMeasurements) -> None:
        self._write_true_place(view, ego)
        view["lights"] = self._numbers[self._world.ego.lights]
        view["story"], view["tasks"] = self._story, self._tasks
        view["message"] = plain_text(delivered.message, MESSAGE_LENGTH) if delivered.message else ""
        view["speaking"][0] = delivered.speaking[Role.PARTICIPANT]
        self._write_utterance(Role.CO_WIZARD, delivered.heard.get(Role.CO_WIZARD), view)

    def _build_co_wizard(
        self, view: Observation, delivered: DeliveredMessages, ego: EgoMeasurements, motion: np.int64
    ) -> None:
        self._write_believed_place(view, ego.pose)
        self._write_exits(view["exits"], ego)
        view["lights"] = self._numbers[self._world.ego.lights]
        view["motion"] = motion
        view["speaking"][0] = delivered.speaking[Role.CO_WIZARD]
        self._write_driving(view)
        self._write_utterance(Role.PARTICIPANT, delivered.heard.get(Role.PARTICIPANT), view)

    def _build_ad_wizard(
        self, view: Observation, delivered: DeliveredMessages, ego: EgoMeasurements, motion: np.int64
    ) -> None:
        self._write_true_place(view, ego)
        view["motion"] = motion
        view["story"] = self._story
        self._write_props(view["props"])
        for speaker in (Role.PARTICIPANT, Role.CO_WIZARD):
            self._write_utterance(speaker, delivered.said.get(speaker), view)

    def motion(self) -> Motion:
        """Returns the state of motion of the ego."""
        return Motion(_motion_of(self._world.actors.arrays))

    # --- templates --------------------------------------------------------------------------------------------------

    def _write_constants(self, scenario: Scenario) -> None:
        landmarks = scenario.storyboard.landmarks[: self._limits.landmarks]
        known = [landmark for landmark in landmarks if not landmark.hidden]
        write_landmarks(self._buffers[Role.PARTICIPANT].template["landmarks"], landmarks)
        write_landmarks(self._buffers[Role.AD_WIZARD].template["landmarks"], landmarks)
        write_landmarks(self._buffers[Role.CO_WIZARD].template["landmarks"], known)
        self._buffers[Role.AD_WIZARD].template["hidden"][: len(landmarks)] = [landmark.hidden for landmark in landmarks]
        for buffer in self._buffers.values():
            buffer.template["street_names"][: len(scenario.street_names)] = [
                name.value for name in scenario.street_names
            ]
            for name, array in buffer.template.items():
                if name.endswith("_moves"):
                    array[:] = NO_MOVE

    def _update_templates(self) -> None:
        """Updates weather, sensor faults, tasks and guesses in the templates where they have changed."""
        weather = tuple(self._world.weather.values.values())
        if weather != self._weather:
            self._weather = weather
            for buffer in self._buffers.values():
                buffer.template["weather"][:] = weather
        faults = tuple(self._world.faults)
        if faults != self._faults:
            self._faults = faults
            self._buffers[Role.AD_WIZARD].template["sensors"][:] = [sensor in faults for sensor in _SENSORS]
        versions = self._task.version, self._beliefs.version
        if versions != self._versions:
            self._versions = versions
            self._write_tasks()
            self._write_guesses(self._buffers[Role.CO_WIZARD].template["guesses"])

    def _write_tasks(self) -> None:
        self._tasks = plain_text("\n".join(self._task.description(i) for i in self._task.live), STORY_LENGTH)
        for buffer, permissions in ((self._buffers[Role.PARTICIPANT], False), (self._buffers[Role.AD_WIZARD], True)):
            write_subgoals(buffer.template["subgoals"], self._task, permissions=permissions)

    def _write_guesses(self, table: Table) -> None:
        table[:] = 0.0
        for name, guess in self._beliefs.places.items():
            (xx, xy), (_, yy) = guess.covariance
            table[name.value] = (1.0, *guess.mean, xx, yy, xy)

    # --- values of the present decision -----------------------------------------------------------------------------

    def _write_true_place(self, view: Observation, ego: EgoMeasurements) -> None:
        """Writes the true pose and place of the ego."""
        planner = self._world.planner
        view["pose"][:] = ego.true_pose
        view["lane"] = self._numbers[planner.lane]
        view["station"][0] = planner.station

    def _write_believed_place(self, view: Observation, pose: Table) -> None:
        """Writes the estimated pose of the ego and the place on the map that belongs to it."""
        world = self._world
        view["pose"][:] = pose
        view["pose_covariance"][:] = world.localizer.covariance
        x, y, heading = pose.tolist()
        lane, view["station"][0] = world.network.closest_place(x, y, heading, world.car.height)
        view["lane"] = self._numbers[lane]

    def _write_exits(self, table: Table, ego: EgoMeasurements) -> None:
        options = self._junction.options()
        rows = options.rows[: len(table)]
        if len(rows):
            table[: len(rows)] = rows
            table[: len(rows), ExitColumn.DISTANCE] = ego.distance_left(options.distance)

    def _write_driving(self, view: Observation) -> None:
        """Writes cruise speed, manoeuvre and hazard stop."""
        world = self._world
        manoeuvre, angle = world.planner.manoeuvre
        hazard = world.hazard
        view["cruise_speed"][0] = world.ego.cruise
        view["manoeuvre"] = self._numbers[manoeuvre or 0]
        view["manoeuvre_angle"][0] = angle
        view["hazard"] = self._numbers[hazard.kind.value if hazard is not None else 0]
        if hazard is not None:
            view["hazard_distance"][0] = max(hazard.gap, 0.0)

    def _write_props(self, table: Table) -> None:
        for row, prop in zip(table, self._world.actors.props, strict=False):
            row[:] = _PROP_NUMBERS[prop.kind], prop.position[0], prop.position[1], prop.heading

    def _write_utterance(self, speaker: Role, utterance: Utterance | None, view: Observation) -> None:
        if utterance is None:
            view[_TEXT[speaker]] = ""
            return
        view[_TEXT[speaker]] = plain_text(utterance.text, MAX_UTTERANCE)
        if self._observe_acts:
            for k, act in enumerate(utterance.acts[: self._limits.spans]):
                view[f"{speaker}_moves"][k] = int(act.move)
                view[f"{speaker}_slots"][k] = encode_slots(act.slots)


_NAMES = {role: str(role) for role in AGENT_ROLES}
_TEXT = {role: f"{role}_text" for role in Role}


def write_landmarks(table: Table, landmarks: Sequence[Landmark]) -> None:
    """Writes landmarks as rows of `LandmarkColumn`."""
    for row, landmark in zip(table, landmarks, strict=False):
        row[LandmarkColumn.NAME] = landmark.name.value
        row[LandmarkColumn.X], row[LandmarkColumn.Y] = landmark.position
        row[LandmarkColumn.LANE], row[LandmarkColumn.STATION] = landmark.lane, landmark.station
        row[LandmarkColumn.STREET] = landmark.street


def write_subgoals(table: Table, task: TaskState, *, permissions: bool) -> None:
    """Writes the subgoals as rows of `SubgoalColumn`.

    Args:
        table: table of which all rows are written.
        task: present state of the task.
        permissions: whether untriggered subgoals and the permitted changes of each subgoal are written.
    """
    table[:] = 0.0
    triggers, deletions, changes = task.possible_triggers(), task.possible_deletions(), task.possible_changes()
    for i, (row, subgoal) in enumerate(zip(table, task.storyboard.subgoals, strict=False)):
        live = i in task.live
        if not (live or permissions or task.status(i) is GoalStatus.ABANDONED):
            continue  # not yet triggered: unknown to the participant
        row[SubgoalColumn.LIVE] = live
        row[SubgoalColumn.LANDMARK] = task.landmark_of(i)
        row[SubgoalColumn.STATUS] = task.status(i).value
        row[SubgoalColumn.REACHED] = task.reached(i)
        row[SubgoalColumn.ALLOWED] = task.allowed(i)
        row[SubgoalColumn.AFTER] = sum(1 << k for k in subgoal.after)
        if permissions:
            row[SubgoalColumn.CAN_TRIGGER] = i in triggers
            row[SubgoalColumn.CAN_DELETE] = i in deletions
            row[SubgoalColumn.CAN_CHANGE] = i in changes


# --- observations on demand -------------------------------------------------------------------------------------------

_AGENTS = {str(role): role for role in AGENT_ROLES}


class Observable(Protocol):
    """Session whose roles can be observed; `decisions` is the number of decisions played so far."""

    decisions: int

    def observations(self, roles: Sequence[Role]) -> dict[str, Observation]:
        """Builds the observations of some roles at the present decision, by agent."""
        ...


class LazyObservations(Mapping[str, Observation]):
    """Observations of the roles at one decision, each built when it is first read.

    A mapping is valid until the session takes its next step: it raises `RuntimeError` when an observation that was not
    read in time is asked for afterwards.
    """

    def __init__(self, session: Observable) -> None:
        self._session, self._decision = session, session.decisions
        self._built: dict[str, Observation] = {}

    def __getitem__(self, agent: str) -> Observation:
        return self.of((_AGENTS[agent],))[agent]

    def __iter__(self) -> Iterator[str]:
        return iter(_AGENTS)

    def __len__(self) -> int:
        return len(_AGENTS)

    def of(self, roles: Sequence[Role] = AGENT_ROLES) -> dict[str, Observation]:
        """Returns the observations of some roles by agent; those that are missing are built together."""
        missing = [role for role in roles if role not in self._built] if self._built else roles
        if not missing:
            return {_NAMES[role]: self._built[role] for role in roles}
        if self._session.decisions != self._decision:
            raise RuntimeError(f"the session has taken a step since; the observation of {missing[0]} was not read")
        found = self._session.observations(missing)
        self._built.update(found)
        return found if missing is roles else {_NAMES[role]: self._built[role] for role in roles}
