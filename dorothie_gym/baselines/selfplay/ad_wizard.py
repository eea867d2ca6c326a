"""Interface of the Ad-Wizard: the exceptions of the scripted policy, at freely chosen times."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from dorothie_gym.baselines.selfplay.role_interface import Mask, RoleInterface
from dorothie_gym.baselines.selfplay.utterance_memory import HeardRemark, listen
from dorothie_gym.ontology import ExceptionKind, PropKind, Role, Sensor, WeatherParameter
from dorothie_gym.policies.ad_wizard import AdWizardConfig, task_message
from dorothie_gym.policies.observation_parser import SeenSubgoal, place_on_path, read_landmarks, read_subgoals, scalar
from dorothie_gym.spaces import AdWizardAction, LanePosition, PropColumn

NEAR, FARTHER = 60.0, 100.0
"""Distance ahead of the car of a roadblock, and of spawned actors [m]."""

CROWD, EXTENT = 3, 25
"""Number of actors spawned at once, and half the side of their square [m]."""


class AdWizardTrick(enum.IntEnum):
    """Actions of the Ad-Wizard."""

    NOTHING = 0
    FOG = 1
    RAIN = 2
    NIGHT = 3
    CLEAR = 4
    """Removes the fog."""
    ROADBLOCK = 5
    UNBLOCK = 6
    """Removes the oldest prop."""
    BLUR = 7
    NO_GPS = 8
    NO_VIEW = 9
    VEHICLES = 10
    PEDESTRIANS = 11
    TRIGGER = 12
    DROP = 13
    CHANGE = 14


_WEATHER = {
    AdWizardTrick.FOG: (WeatherParameter.FOG_DENSITY, 0.8),
    AdWizardTrick.RAIN: (WeatherParameter.PRECIPITATION, 0.9),
    AdWizardTrick.NIGHT: (WeatherParameter.SUN_ALTITUDE_ANGLE, 0.25),
    AdWizardTrick.CLEAR: (WeatherParameter.FOG_DENSITY, 0.0),
}
_FAULTS = {AdWizardTrick.BLUR: Sensor.BLUR, AdWizardTrick.NO_GPS: Sensor.GPS, AdWizardTrick.NO_VIEW: Sensor.VIEW}
_CROWDS = {
    AdWizardTrick.VEHICLES: ExceptionKind.SPAWN_VEHICLES,
    AdWizardTrick.PEDESTRIANS: ExceptionKind.SPAWN_PEDESTRIANS,
}
_TASKS = {
    AdWizardTrick.TRIGGER: ExceptionKind.TASK_TRIGGER,
    AdWizardTrick.DROP: ExceptionKind.TASK_DELETE,
    AdWizardTrick.CHANGE: ExceptionKind.TASK_CHANGE,
}
_NOTHING = AdWizardAction()
_KINDS = [
    int(kind)
    for kind in (
        ExceptionKind.NONE, *(ExceptionKind.WEATHER for _ in _WEATHER), ExceptionKind.PLACE_PROP,
        ExceptionKind.DELETE_PROP, *(ExceptionKind.SENSOR_FAULT for _ in _FAULTS), *_CROWDS.values(), *_TASKS.values(),
    )
]  # fmt: skip
"""Kind of exception of each action."""


@dataclass(frozen=True, kw_only=True)
class AdWizardMemory:
    """Memory of the Ad-Wizard: the others' last utterances, and the time of its last exception [s]."""

    participant: HeardRemark | None = None
    co_wizard: HeardRemark | None = None
    last: float = -math.inf


class AdWizardInterface(RoleInterface[AdWizardMemory]):
    """Interface of the Ad-Wizard: one `AdWizardTrick` at a time, as far apart as those of the scripted policy."""

    role = Role.AD_WIZARD
    speakers = (Role.PARTICIPANT, Role.CO_WIZARD)
    fields = ("hidden", "landmarks", "motion", "props", "sensors", "speed", "subgoals", "time", "waypoints", "weather")
    actions = len(AdWizardTrick)
    own_size: ClassVar[int] = 2

    def begin(self) -> AdWizardMemory:
        """Returns an empty memory."""
        return AdWizardMemory()

    def notice(self, observation: Mapping[str, Any], memory: AdWizardMemory) -> AdWizardMemory:
        """Returns the memory with what the others said."""
        return replace(
            memory,
            participant=listen(observation, Role.PARTICIPANT, memory.participant),
            co_wizard=listen(observation, Role.CO_WIZARD, memory.co_wizard),
        )

    def remarks(self, memory: AdWizardMemory) -> tuple[HeardRemark | None, ...]:
        """Returns the last utterances of the participant and of the Co-Wizard."""
        return memory.participant, memory.co_wizard

    def own(self, observation: Mapping[str, Any], memory: AdWizardMemory) -> list[float]:
        """Returns the time until the next exception, and whether one can be placed ahead on the path."""
        wait = max(memory.last + AdWizardConfig.spacing, AdWizardConfig.first_at) - scalar(observation, "time")
        return [max(wait, 0.0) / AdWizardConfig.spacing, float(place_on_path(self.town, observation, NEAR) is not None)]

    def mask(self, observation: Mapping[str, Any], memory: AdWizardMemory) -> Mask:
        """Returns the actions that have a target; only "nothing" for `SPACING` after the last exception."""
        mask = np.zeros(self.actions, dtype=np.bool_)
        mask[AdWizardTrick.NOTHING] = True
        if scalar(observation, "time") < max(memory.last + AdWizardConfig.spacing, AdWizardConfig.first_at):
            return mask
        mask[[*_WEATHER, *_FAULTS]] = True
        props = observation["props"][:, PropColumn.KIND] > 0
        mask[AdWizardTrick.ROADBLOCK] = not props.all() and place_on_path(self.town, observation, NEAR) is not None
        mask[AdWizardTrick.UNBLOCK] = props.any()
        mask[list(_CROWDS)] = place_on_path(self.town, observation, FARTHER) is not None
        for caper in _TASKS:
            mask[caper] = self._subgoal(caper, observation) is not None
        return mask

    def allowed(self, observation: Mapping[str, Any], masks: Mapping[str, Any]) -> Mask:
        """Returns the actions whose kind of exception the environment allows."""
        return np.asarray(masks["exception"])[_KINDS].astype(np.bool_)

    def act(
        self, choice: int, observation: Mapping[str, Any], memory: AdWizardMemory
    ) -> tuple[AdWizardAction, AdWizardMemory]:  # fmt: skip
        """Returns the exception of an action."""
        action = self._action(AdWizardTrick(choice), observation)
        if action.exception is ExceptionKind.NONE:
            return action, memory
        return action, replace(memory, last=scalar(observation, "time"))

    def choice_of(
        self, action: AdWizardAction, observation: Mapping[str, Any], memory: AdWizardMemory
    ) -> int:  # fmt: skip
        """Returns the action of the same kind, with the same weather parameter or sensor."""
        if action.exception is ExceptionKind.WEATHER:
            about = {k: share for k, (parameter, share) in _WEATHER.items() if parameter is action.weather}
            return min(about, key=lambda k: abs(about[k] - action.share), default=AdWizardTrick.NOTHING)
        if action.exception is ExceptionKind.SENSOR_FAULT:
            fault = next((k for k, sensor in _FAULTS.items() if sensor is action.sensor), AdWizardTrick.NOTHING)
            return fault if action.on else AdWizardTrick.NOTHING
        return next((k for k in AdWizardTrick if _KINDS[k] == action.exception), AdWizardTrick.NOTHING)

    def _action(self, caper: AdWizardTrick, observation: Mapping[str, Any]) -> AdWizardAction:
        if caper in _WEATHER:
            parameter, share = _WEATHER[caper]
            return AdWizardAction(exception=ExceptionKind.WEATHER, weather=parameter, share=share)
        if caper in _FAULTS:
            return AdWizardAction(exception=ExceptionKind.SENSOR_FAULT, sensor=_FAULTS[caper], on=True)
        if caper is AdWizardTrick.UNBLOCK:
            return AdWizardAction(exception=ExceptionKind.DELETE_PROP)
        if caper in _TASKS:
            return self._task(caper, observation)
        if caper is AdWizardTrick.NOTHING:
            return _NOTHING
        return self._on_the_way(caper, observation)

    def _on_the_way(self, caper: AdWizardTrick, observation: Mapping[str, Any]) -> AdWizardAction:
        found = place_on_path(self.town, observation, FARTHER if caper in _CROWDS else NEAR)
        if found is None:
            return _NOTHING
        place = LanePosition(lane=found[0], metres=round(found[1]))
        if caper in _CROWDS:
            return AdWizardAction(exception=_CROWDS[caper], place=place, count=CROWD, extent=EXTENT)
        return AdWizardAction(exception=ExceptionKind.PLACE_PROP, prop=PropKind.STREET_BARRIER, place=place)

    def _subgoal(self, caper: AdWizardTrick, observation: Mapping[str, Any]) -> SeenSubgoal | None:
        """Returns the first subgoal that a task exception can change."""
        may = {
            AdWizardTrick.TRIGGER: "can_trigger",
            AdWizardTrick.DROP: "can_delete",
            AdWizardTrick.CHANGE: "can_change",
        }[caper]
        return next((subgoal for subgoal in read_subgoals(observation) if getattr(subgoal, may)), None)

    def _task(self, caper: AdWizardTrick, observation: Mapping[str, Any]) -> AdWizardAction:
        subgoal, kind = self._subgoal(caper, observation), _TASKS[caper]
        if subgoal is None:
            return _NOTHING
        names = {mark.row: mark.name for mark in read_landmarks(observation, self.town)}
        words = np.random.default_rng(round(scalar(observation, "time")))
        return AdWizardAction(
            exception=kind, item=subgoal.index, message=task_message(kind, names[subgoal.landmark], words)
        )
