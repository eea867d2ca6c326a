"""Builds what each role observes. What a role must not know does not enter its view."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.dialogue import Utterance
from dorothie_gym.envs.bearings import Bearings
from dorothie_gym.envs.beliefs import Beliefs
from dorothie_gym.envs.scenario import Scenario
from dorothie_gym.ontology import LABELS, GoalStatus, LandmarkName, Role, Sensor, WeatherParameter, encode_slots
from dorothie_gym.spaces import (
    NO_MOVE,
    ExitColumn,
    GuessColumn,
    LandmarkColumn,
    Motion,
    ObjectColumn,
    Observation,
    PropColumn,
    SpaceLimits,
    SubgoalColumn,
    plain_text,
)
from dorothie_gym.spaces.limits import MESSAGE_LENGTH, STORY_LENGTH
from dorothie_gym.spaces.observations import MAX_UTTERANCE
from dorothie_gym.tasks import Landmark, TaskState
from dorothie_gym.world.props import PROP_KINDS
from dorothie_gym.world.world import World

Table = NDArray[np.float64]

WAYPOINT_SPACING = 5.0
"""Distance between the planned waypoints shown [m]."""


@dataclass(kw_only=True)
class Moment:
    """What changed in the decision that a view is of.

    Attributes:
        heard: utterances that ended, by speaker.
        message: of the Ad-Wizard to the participant.
        speaking: seconds that each role has still to speak.
    """

    heard: Mapping[Role, Utterance]
    message: str
    speaking: Mapping[Role, float]


class Views:
    """Observations of a session."""

    def __init__(
        self,
        world: World,
        scenario: Scenario,
        task: TaskState,
        beliefs: Beliefs,
        limits: SpaceLimits,
        observe_acts: bool,
    ) -> None:
        self._world, self._scenario, self._task, self._beliefs = world, scenario, task, beliefs
        self._limits, self._observe_acts = limits, observe_acts
        names = np.zeros(limits.streets, dtype=np.int64)
        names[: len(scenario.street_names)] = [name.value for name in scenario.street_names]
        self._street_names = names
        landmarks = scenario.storyboard.landmarks[: limits.landmarks]
        self._all_landmarks = self._landmark_table(landmarks, limits.landmarks)
        self._known_landmarks = self._landmark_table([m for m in landmarks if not m.hidden], limits.landmarks)
        self._hidden = np.zeros(limits.landmarks, dtype=np.int8)
        self._hidden[: len(landmarks)] = [m.hidden for m in landmarks]
        self._story = plain_text(scenario.storyboard.story, STORY_LENGTH)

    def observe(self, role: Role, moment: Moment) -> Observation:
        """The observation of a role, in its observation space."""
        build = {
            Role.PARTICIPANT: self._participant,
            Role.CO_WIZARD: self._co_wizard,
            Role.AD_WIZARD: self._ad_wizard,
        }[role]
        return {**self._common(), **build(moment)}

    def _common(self) -> Observation:
        world = self._world
        return {
            "time": np.array([world.time]),
            "speed": np.array([float(world.car.speed)]),
            "weather": np.array([world.weather.values[p] for p in WeatherParameter]),
            "street_names": self._street_names.copy(),
        }

    def _participant(self, moment: Moment) -> Observation:
        tasks = "\n".join(self._task.description(i) for i in self._task.live)
        return {
            **self._true_place(),
            "landmarks": self._all_landmarks.copy(),
            "objects": self._objects(),
            "lights": np.int64(self._world.lights),
            "subgoals": self._subgoals(permissions=False),
            "story": self._story,
            "tasks": plain_text(tasks, STORY_LENGTH),
            "message": plain_text(moment.message, MESSAGE_LENGTH),
            "speaking": np.array([moment.speaking[Role.PARTICIPANT]]),
            **self._heard(Role.CO_WIZARD, moment),
        }

    def _co_wizard(self, moment: Moment) -> Observation:
        world = self._world
        bearings = Bearings(world)
        pose = bearings.pose
        network = world.network
        index = network.get_closest_lane_index(pose[:2], float(pose[2]), height=float(world.car.height))
        lane = network.get_lane(index)
        station = min(max(lane.local_coordinates(pose[:2])[0], 0.0), lane.length)
        manoeuvre, angle = world.planner.manoeuvre
        hazard = world.hazard
        return {
            "pose": pose.copy(),
            "pose_covariance": world.localizer.covariance.copy(),
            "lane": np.int64(lane.town_lane.id),
            "station": np.array([float(station)]),
            "landmarks": self._known_landmarks.copy(),
            "cruise_speed": np.array([world.driver.cruise]),
            "lights": np.int64(world.lights),
            "motion": np.int64(self.motion()),
            "hazard": np.int64(hazard.kind.value if hazard is not None else 0),
            "hazard_distance": np.array([max(hazard.gap, 0.0) if hazard is not None else 0.0], dtype=np.float64),
            "manoeuvre": np.int64(manoeuvre or 0),
            "manoeuvre_angle": np.array([float(angle)]),
            "waypoints": bearings.waypoints(self._limits.waypoints, WAYPOINT_SPACING),
            "exits": self._exits(bearings),
            "objects": self._objects(bearings),
            "guesses": self._guesses(),
            "speaking": np.array([moment.speaking[Role.CO_WIZARD]]),
            **self._heard(Role.PARTICIPANT, moment),
        }

    def _ad_wizard(self, moment: Moment) -> Observation:
        path = np.zeros(self._limits.plan, dtype=np.int64)
        ahead = self._world.planner.lanes_ahead[: self._limits.plan]
        path[: len(ahead)] = [lane + 1 for lane in ahead]
        faults = self._world.faults
        return {
            **self._true_place(),
            "landmarks": self._all_landmarks.copy(),
            "motion": np.int64(self.motion()),
            "hidden": self._hidden.copy(),
            "subgoals": self._subgoals(permissions=True),
            "story": self._story,
            "waypoints": self._waypoints(),
            "path_lanes": path,
            "props": self._props(),
            "sensors": np.array([sensor in faults for sensor in Sensor], dtype=np.int8),
            **self._heard(Role.PARTICIPANT, moment),
            **self._heard(Role.CO_WIZARD, moment),
        }

    # --- parts ------------------------------------------------------------------------------------------------------

    def motion(self) -> Motion:
        """What the car is about."""
        world = self._world
        if world.planner.held:
            return Motion.STOPPED
        if world.hazard is not None:
            return Motion.HAZARD
        if world.planner.waits_at_end and world.planner.room < 5.0 and world.car.speed < 0.3:
            return Motion.WAITING
        return Motion.DRIVING

    def _true_place(self) -> Observation:
        car, planner = self._world.car, self._world.planner
        return {
            "pose": np.array([car.position[0], car.position[1], car.heading], dtype=np.float64),
            "lane": np.int64(planner.lane),
            "station": np.array([planner.station]),
        }

    def _landmark_table(self, landmarks: Sequence[Landmark], rows: int) -> Table:
        table = np.zeros((rows, len(LandmarkColumn)))
        for k, landmark in enumerate(landmarks):
            table[k] = (
                landmark.name.value,
                *landmark.position,
                landmark.lane,
                landmark.station,
                landmark.street,
            )
        return table

    def _subgoals(self, *, permissions: bool) -> Table:
        task = self._task
        table = np.zeros((self._limits.subgoals, len(SubgoalColumn)))
        triggers, deletions, changes = task.possible_triggers(), task.possible_deletions(), task.possible_changes()
        for i, subgoal in enumerate(task.storyboard.subgoals[: self._limits.subgoals]):
            live = i in task.live
            shown = live or permissions or task.status(i) is GoalStatus.ABANDONED
            if not shown:
                continue  # not yet triggered: the participant does not know of it
            row = table[i]
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
        return table

    def _objects(self, bearings: Bearings | None = None) -> Table:
        """Bodies that are perceived; where `bearings` are given, around the estimated pose and not the true one."""
        car = self._world.car
        table = np.zeros((self._limits.objects, len(ObjectColumn)))
        for row, body in zip(table, self._world.perceived(), strict=False):
            dx, dy = body.x - float(car.position[0]), body.y - float(car.position[1])
            bearing = math.atan2(dy, dx) - float(car.heading)
            x, y = bearings.seen(body.x, body.y) if bearings is not None else (body.x, body.y)
            row[:] = (
                body.kind.value,
                x,
                y,
                math.hypot(dx, dy),
                (bearing + math.pi) % (2 * math.pi) - math.pi,
                body.length,
                body.width,
                body.speed,
            )
        return table

    def _waypoints(self) -> Table:
        planner = self._world.planner
        table = np.zeros((self._limits.waypoints, 2))
        for k, row in enumerate(table):
            row[:] = planner.path.position_at(min(planner.s + (k + 1) * WAYPOINT_SPACING, planner.path.length))
        return table

    def _exits(self, bearings: Bearings) -> Table:
        town = self._world.town
        exits, distance = self._world.planner.exits()
        distance = bearings.way_left(distance)
        table = np.zeros((self._limits.exits, len(ExitColumn)))
        numbers = {junction.id: k for k, junction in enumerate(town.junctions)}
        for row, way in zip(table, exits, strict=False):
            row[:] = (1.0, way.angle, distance, way.lane, town.lanes[way.lane].street, numbers.get(way.junction_id, -1))
        return table

    def _guesses(self) -> Table:
        table = np.zeros((len(LandmarkName), len(GuessColumn)))
        for name, guess in self._beliefs.places.items():
            (xx, xy), (_, yy) = guess.covariance
            table[name.value] = (1.0, *guess.mean, xx, yy, xy)
        return table

    def _props(self) -> Table:
        table = np.zeros((self._limits.props, len(PropColumn)))
        for row, prop in zip(table, self._world.actors.props, strict=False):
            row[:] = (1 + PROP_KINDS.index(prop.kind), prop.position[0], prop.position[1], prop.heading)
        return table

    def _heard(self, speaker: Role, moment: Moment) -> Observation:
        utterance = moment.heard.get(speaker)
        fields: dict[str, Any] = {f"{speaker}_text": plain_text(utterance.text, MAX_UTTERANCE) if utterance else ""}
        if self._observe_acts:
            moves = np.full(self._limits.spans, NO_MOVE, dtype=np.int64)
            slots = np.zeros((self._limits.spans, len(LABELS)), dtype=np.int8)
            for k, act in enumerate(utterance.acts[: self._limits.spans] if utterance else ()):
                moves[k] = int(act.move)
                slots[k] = encode_slots(act.slots)
            fields[f"{speaker}_moves"], fields[f"{speaker}_slots"] = moves, slots
        return fields
