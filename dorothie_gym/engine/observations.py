"""Builds what each role observes. What a role must not know does not enter its view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.dialogue import Utterance
from dorothie_gym.engine.beliefs import Beliefs
from dorothie_gym.engine.observation_buffers import Sheet
from dorothie_gym.engine.path_measurements import Bearings
from dorothie_gym.engine.scenario import Scenario
from dorothie_gym.engine.upcoming_junction import Prospect
from dorothie_gym.ontology import LABELS, GoalStatus, PropKind, Role, Sensor, encode_slots
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
from dorothie_gym.spaces.limits import MESSAGE_LENGTH, STORY_LENGTH
from dorothie_gym.spaces.observations import MAX_UTTERANCE
from dorothie_gym.tasks import Landmark, TaskState

Table = NDArray[np.float64]

WAYPOINT_SPACING = 5.0
"""Distance between the planned waypoints shown [m]."""

_SENSORS = tuple(Sensor)
_PROP_NUMBERS = {kind: 1.0 + k for k, kind in enumerate(PropKind)}


@dataclass(kw_only=True)
class Moment:
    """What changed in the decision that a view is of.

    Attributes:
        said: utterances that ended, by speaker.
        heard: the same, as the one who is spoken to hears them.
        message: of the Ad-Wizard to the participant.
        speaking: seconds that each role has still to speak.
    """

    said: Mapping[Role, Utterance]
    heard: Mapping[Role, Utterance]
    message: str
    speaking: Mapping[Role, float]


class Views:
    """Observations of a session.

    Each role has a sheet whose form holds what is the same in most decisions: what never changes is written once, what
    changes now and then when it does. Copies of it are filled in with the rest and handed out.
    """

    def __init__(
        self,
        world: World,
        scenario: Scenario,
        task: TaskState,
        beliefs: Beliefs,
        limits: SpaceLimits,
        observe_acts: bool,
        prospect: Prospect | None = None,
    ) -> None:
        self._world, self._task, self._beliefs = world, task, beliefs
        self._limits, self._observe_acts = limits, observe_acts
        self._prospect = prospect or Prospect(world)
        self._sheets = {
            role: Sheet.of_space(observation_space(role, limits, observe_acts))
            for role in (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD)
        }
        self._agents = [str(role) for role in self._sheets]
        self._participant = self._sheets[Role.PARTICIPANT]
        self._co_wizard = self._sheets[Role.CO_WIZARD]
        self._ad_wizard = self._sheets[Role.AD_WIZARD]
        self._numbers = [np.int64(number) for number in range(max(limits.lanes, len(LABELS)))]  # made once
        self._story = plain_text(scenario.storyboard.story, STORY_LENGTH)
        self._tasks = ""
        self._weather: tuple[float, ...] = ()
        self._faults: tuple[Sensor, ...] = ()
        self._versions = (-1, -1)
        self._write_what_stays(scenario)

    def observe(self, moment: Moment) -> dict[str, Observation]:
        """The observations of the three roles, each in its observation space."""
        self._note_changes()
        participant, co_wizard, ad_wizard = views = [sheet.copy() for sheet in self._sheets.values()]
        time, speed = self._world.time, self._world.car.speed
        for view in views:
            view["time"][0], view["speed"][0] = time, speed
        bearings = Bearings(self._world)
        motion = self._numbers[self.motion()]
        lights = self._numbers[self._world.ego.lights]
        self._write_true_place(participant, ad_wizard)
        self._write_believed_place(co_wizard, bearings.pose)
        bearings.write_path(
            WAYPOINT_SPACING, ad_wizard["waypoints"], ad_wizard["path_lanes"], co_wizard["waypoints"]
        )  # fmt: skip
        bearings.write_objects(participant["objects"], co_wizard["objects"])
        self._write_exits(co_wizard["exits"], bearings)
        participant["lights"] = co_wizard["lights"] = lights
        co_wizard["motion"] = ad_wizard["motion"] = motion
        participant["story"] = ad_wizard["story"] = self._story
        participant["tasks"] = self._tasks
        participant["message"] = plain_text(moment.message, MESSAGE_LENGTH) if moment.message else ""
        participant["speaking"][0] = moment.speaking[Role.PARTICIPANT]
        co_wizard["speaking"][0] = moment.speaking[Role.CO_WIZARD]
        self._write_driving(co_wizard)
        self._write_props(ad_wizard["props"])
        for speaker, listener in ((Role.CO_WIZARD, participant), (Role.PARTICIPANT, co_wizard)):
            self._write_heard(speaker, moment.heard.get(speaker), listener)
            self._write_heard(speaker, moment.said.get(speaker), ad_wizard)
        return dict(zip(self._agents, views, strict=True))

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

    # --- what seldom changes ----------------------------------------------------------------------------------------

    def _write_what_stays(self, scenario: Scenario) -> None:
        landmarks = scenario.storyboard.landmarks[: self._limits.landmarks]
        known = [landmark for landmark in landmarks if not landmark.hidden]
        write_landmarks(self._participant.form["landmarks"], landmarks)
        write_landmarks(self._ad_wizard.form["landmarks"], landmarks)
        write_landmarks(self._co_wizard.form["landmarks"], known)
        self._ad_wizard.form["hidden"][: len(landmarks)] = [landmark.hidden for landmark in landmarks]
        for sheet in self._sheets.values():
            sheet.form["street_names"][: len(scenario.street_names)] = [name.value for name in scenario.street_names]
            for name, array in sheet.form.items():
                if name.endswith("_moves"):
                    array[:] = NO_MOVE

    def _note_changes(self) -> None:
        """Brings the forms up to date."""
        weather = tuple(self._world.weather.values.values())
        if weather != self._weather:
            self._weather = weather
            for sheet in self._sheets.values():
                sheet.form["weather"][:] = weather
        faults = tuple(self._world.faults)
        if faults != self._faults:
            self._faults = faults
            self._ad_wizard.form["sensors"][:] = [sensor in faults for sensor in _SENSORS]
        versions = self._task.version, self._beliefs.version
        if versions != self._versions:
            self._versions = versions
            self._write_tasks()
            self._write_guesses(self._co_wizard.form["guesses"])

    def _write_tasks(self) -> None:
        self._tasks = plain_text("\n".join(self._task.description(i) for i in self._task.live), STORY_LENGTH)
        for sheet, permissions in ((self._participant, False), (self._ad_wizard, True)):
            write_subgoals(sheet.form["subgoals"], self._task, permissions=permissions)

    def _write_guesses(self, table: Table) -> None:
        table[:] = 0.0
        for name, guess in self._beliefs.places.items():
            (xx, xy), (_, yy) = guess.covariance
            table[name.value] = (1.0, *guess.mean, xx, yy, xy)

    # --- what is new each time --------------------------------------------------------------------------------------

    def _write_true_place(self, participant: Observation, ad_wizard: Observation) -> None:
        """Where the car is; both know it."""
        car, planner = self._world.car, self._world.planner
        participant["pose"][:2], participant["pose"][2] = car.position, car.heading
        ad_wizard["pose"][:] = participant["pose"]
        participant["lane"] = ad_wizard["lane"] = self._numbers[planner.lane]
        participant["station"][0] = ad_wizard["station"][0] = planner.station

    def _write_believed_place(self, view: Observation, pose: Table) -> None:
        """Where the Co-Wizard takes the car to be."""
        world = self._world
        view["pose"][:] = pose
        view["pose_covariance"][:] = world.localizer.covariance
        x, y, heading = pose.tolist()
        lane, view["station"][0] = world.network.closest_place(x, y, heading, world.car.height)
        view["lane"] = self._numbers[lane]

    def _write_exits(self, table: Table, bearings: Bearings) -> None:
        options = self._prospect.options()
        rows = options.rows[: len(table)]
        if len(rows):
            table[: len(rows)] = rows
            table[: len(rows), ExitColumn.DISTANCE] = bearings.way_left(options.distance)

    def _write_driving(self, view: Observation) -> None:
        """What the car is told to do, and does."""
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

    def _write_heard(self, speaker: Role, utterance: Utterance | None, view: Observation) -> None:
        if utterance is None:
            view[_TEXT[speaker]] = ""
            return
        view[_TEXT[speaker]] = plain_text(utterance.text, MAX_UTTERANCE)
        if self._observe_acts:
            for k, act in enumerate(utterance.acts[: self._limits.spans]):
                view[f"{speaker}_moves"][k] = int(act.move)
                view[f"{speaker}_slots"][k] = encode_slots(act.slots)


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
        table: all of its rows are written.
        task: the task as it stands.
        permissions: whether those that wait for their trigger show, and what may be done with each.
    """
    table[:] = 0.0
    triggers, deletions, changes = task.possible_triggers(), task.possible_deletions(), task.possible_changes()
    for i, (row, subgoal) in enumerate(zip(table, task.storyboard.subgoals, strict=False)):
        live = i in task.live
        if not (live or permissions or task.status(i) is GoalStatus.ABANDONED):
            continue  # not yet triggered: the participant does not know of it
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
