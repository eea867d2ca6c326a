"""Interface of the Ad-Wizard: the exceptions of the scripted policy, at freely chosen times."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from dorothie_gym.baselines.selfplay.role_interface import LastUtterance, Mask, RoleInterface, last_utterance
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind, PropKind, Sensor, WeatherParameter
from dorothie_gym.policies.ad_wizard import AdWizardConfig
from dorothie_gym.policies.observation_parser import SeenSubgoal, place_on_path, read_subgoals, scalar
from dorothie_gym.policies.task_exceptions import task_message
from dorothie_gym.spaces.actions import ActionMapping, AdWizardAction, LanePosition
from dorothie_gym.spaces.observations import ObservationMapping, PropColumn

ROADBLOCK_DISTANCE, SPAWN_DISTANCE = 60.0, 100.0
"""Distances ahead of the car of a roadblock, and of spawned actors [m]."""

SPAWN_COUNT, SPAWN_EXTENT = 3, 25
"""Number of actors spawned at once, and half the side of their square [m]."""


class AdWizardMacro(enum.IntEnum):
    """Macro actions of the Ad-Wizard."""

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
    AdWizardMacro.FOG: (WeatherParameter.FOG_DENSITY, 0.8),
    AdWizardMacro.RAIN: (WeatherParameter.PRECIPITATION, 0.9),
    AdWizardMacro.NIGHT: (WeatherParameter.SUN_ALTITUDE_ANGLE, 0.25),
    AdWizardMacro.CLEAR: (WeatherParameter.FOG_DENSITY, 0.0),
}
_FAULTS = {AdWizardMacro.BLUR: Sensor.BLUR, AdWizardMacro.NO_GPS: Sensor.GPS, AdWizardMacro.NO_VIEW: Sensor.VIEW}
_SPAWNS = {
    AdWizardMacro.VEHICLES: ExceptionKind.SPAWN_VEHICLES,
    AdWizardMacro.PEDESTRIANS: ExceptionKind.SPAWN_PEDESTRIANS,
}
_TASKS = {
    AdWizardMacro.TRIGGER: ExceptionKind.TASK_TRIGGER,
    AdWizardMacro.DROP: ExceptionKind.TASK_DELETE,
    AdWizardMacro.CHANGE: ExceptionKind.TASK_CHANGE,
}
_NOTHING = AdWizardAction()
_KINDS = [
    int(kind)
    for kind in (
        ExceptionKind.NONE, *(ExceptionKind.WEATHER for _ in _WEATHER), ExceptionKind.PLACE_PROP,
        ExceptionKind.DELETE_PROP, *(ExceptionKind.SENSOR_FAULT for _ in _FAULTS), *_SPAWNS.values(), *_TASKS.values(),
    )
]  # fmt: skip
"""Kind of exception of each macro action."""


@dataclass(frozen=True, kw_only=True)
class AdWizardMemory:
    """Memory of the Ad-Wizard: the last utterances of the other roles, and the time of its last exception [s]."""

    participant: LastUtterance | None = None
    co_wizard: LastUtterance | None = None
    last_exception: float = -math.inf


class AdWizardInterface(RoleInterface[AdWizardMemory, AdWizardAction]):
    """Interface of the Ad-Wizard: one `AdWizardMacro` at a time, at least `AdWizardConfig.spacing` apart."""

    role = Role.AD_WIZARD
    speakers = (Role.PARTICIPANT, Role.CO_WIZARD)
    fields = ("hidden", "landmarks", "motion", "props", "sensors", "speed", "subgoals", "time", "waypoints", "weather")
    actions = len(AdWizardMacro)
    own_size: ClassVar[int] = 2

    def initial_memory(self) -> AdWizardMemory:
        """Returns an empty memory."""
        return AdWizardMemory()

    def update(self, observation: ObservationMapping, memory: AdWizardMemory) -> AdWizardMemory:
        """Stores the last utterances of participant and Co-Wizard."""
        return replace(
            memory,
            participant=last_utterance(observation, Role.PARTICIPANT, memory.participant),
            co_wizard=last_utterance(observation, Role.CO_WIZARD, memory.co_wizard),
        )

    def utterances(self, memory: AdWizardMemory) -> tuple[LastUtterance | None, ...]:
        """Returns the last utterances of the participant and of the Co-Wizard."""
        return memory.participant, memory.co_wizard

    def own_features(self, observation: ObservationMapping, memory: AdWizardMemory) -> list[float]:
        """Returns the time until the next exception, and whether one can be placed ahead on the path."""
        wait = max(_next_exception(memory) - scalar(observation, "time"), 0.0)
        placeable = place_on_path(self.town, observation, ROADBLOCK_DISTANCE) is not None
        return [wait / AdWizardConfig.spacing, float(placeable)]

    def mask(self, observation: ObservationMapping, memory: AdWizardMemory) -> Mask:
        """Returns the actions that have a target; only `NOTHING` until the next exception is due."""
        mask = np.zeros(self.actions, dtype=np.bool_)
        mask[AdWizardMacro.NOTHING] = True
        if scalar(observation, "time") < _next_exception(memory):
            return mask
        mask[[*_WEATHER, *_FAULTS]] = True
        props = observation["props"][:, PropColumn.KIND] > 0
        placeable = place_on_path(self.town, observation, ROADBLOCK_DISTANCE) is not None
        mask[AdWizardMacro.ROADBLOCK] = not props.all() and placeable
        mask[AdWizardMacro.UNBLOCK] = props.any()
        mask[list(_SPAWNS)] = place_on_path(self.town, observation, SPAWN_DISTANCE) is not None
        for macro in _TASKS:
            mask[macro] = self._subgoal(macro, observation) is not None
        return mask

    def permitted(self, observation: ObservationMapping, memory: AdWizardMemory, masks: ActionMapping) -> Mask:
        """Returns the actions whose kind of exception the environment permits."""
        return np.asarray(masks["exception"])[_KINDS].astype(np.bool_)

    def act(
        self, choice: int, observation: ObservationMapping, memory: AdWizardMemory
    ) -> tuple[AdWizardAction, AdWizardMemory]:  # fmt: skip
        """Returns the exception of a macro action."""
        action = self._action(AdWizardMacro(choice), observation)
        if action.exception is ExceptionKind.NONE:
            return action, memory
        return action, replace(memory, last_exception=scalar(observation, "time"))

    def choice_of(
        self, action: AdWizardAction, observation: ObservationMapping, memory: AdWizardMemory
    ) -> int:  # fmt: skip
        """Returns the macro action of the same kind, with the same weather parameter or sensor."""
        if action.exception is ExceptionKind.WEATHER:
            shares = {k: share for k, (parameter, share) in _WEATHER.items() if parameter is action.weather}
            return min(shares, key=lambda k: abs(shares[k] - action.share), default=AdWizardMacro.NOTHING)
        if action.exception is ExceptionKind.SENSOR_FAULT:
            fault = next((k for k, sensor in _FAULTS.items() if sensor is action.sensor), AdWizardMacro.NOTHING)
            return fault if action.on else AdWizardMacro.NOTHING
        return next((k for k in AdWizardMacro if _KINDS[k] == action.exception), AdWizardMacro.NOTHING)

    def _action(self, macro: AdWizardMacro, observation: ObservationMapping) -> AdWizardAction:
        if macro in _WEATHER:
            parameter, share = _WEATHER[macro]
            return AdWizardAction(exception=ExceptionKind.WEATHER, weather=parameter, share=share)
        if macro in _FAULTS:
            return AdWizardAction(exception=ExceptionKind.SENSOR_FAULT, sensor=_FAULTS[macro], on=True)
        if macro is AdWizardMacro.UNBLOCK:
            return AdWizardAction(exception=ExceptionKind.DELETE_PROP)
        if macro in _TASKS:
            return self._task_exception(macro, observation)
        if macro is AdWizardMacro.NOTHING:
            return _NOTHING
        return self._exception_ahead(macro, observation)

    def _exception_ahead(self, macro: AdWizardMacro, observation: ObservationMapping) -> AdWizardAction:
        """Returns a roadblock or spawned actors ahead on the path; nothing where the path is too short."""
        found = place_on_path(self.town, observation, SPAWN_DISTANCE if macro in _SPAWNS else ROADBLOCK_DISTANCE)
        if found is None:
            return _NOTHING
        place = LanePosition(lane=found[0], metres=round(found[1]))
        if macro in _SPAWNS:
            return AdWizardAction(exception=_SPAWNS[macro], place=place, count=SPAWN_COUNT, extent=SPAWN_EXTENT)
        return AdWizardAction(exception=ExceptionKind.PLACE_PROP, prop=PropKind.STREET_BARRIER, place=place)

    def _subgoal(self, macro: AdWizardMacro, observation: ObservationMapping) -> SeenSubgoal | None:
        """Returns the first subgoal that a task exception can change."""
        flag = {
            AdWizardMacro.TRIGGER: "can_trigger",
            AdWizardMacro.DROP: "can_delete",
            AdWizardMacro.CHANGE: "can_change",
        }[macro]
        return next((subgoal for subgoal in read_subgoals(observation) if getattr(subgoal, flag)), None)

    def _task_exception(self, macro: AdWizardMacro, observation: ObservationMapping) -> AdWizardAction:
        subgoal, kind = self._subgoal(macro, observation), _TASKS[macro]
        if subgoal is None:
            return _NOTHING
        message = task_message(observation, kind, subgoal.index)
        return AdWizardAction(exception=kind, item=subgoal.index, message=message)


def _next_exception(memory: AdWizardMemory) -> float:
    """Returns the earliest time of the next exception [s]."""
    return max(memory.last_exception + AdWizardConfig.spacing, AdWizardConfig.first_at)
