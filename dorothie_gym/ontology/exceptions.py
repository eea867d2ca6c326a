"""What the Ad-Wizard does to the world and to the task."""

from __future__ import annotations

from enum import StrEnum

from dorothie_gym.ontology.labelled import LabelledInt


class ExceptionKind(LabelledInt):
    """A kind of unexpected change. MESSAGE, a text to the participant alone, is neither environmental nor task."""

    NONE = 0, "None"
    WEATHER = 1, "Weather"
    SPAWN_VEHICLES = 2, "SpawnVehicles"
    SPAWN_PEDESTRIANS = 3, "SpawnPedestrians"
    PLACE_PROP = 4, "PlaceProp"
    MOVE_PROP = 5, "MoveProp"
    DELETE_PROP = 6, "DeleteProp"
    SENSOR_FAULT = 7, "SensorFault"
    TASK_TRIGGER = 8, "TaskTrigger"
    TASK_DELETE = 9, "TaskDelete"
    TASK_CHANGE = 10, "TaskChange"
    MESSAGE = 11, "Message"

    @property
    def is_environmental(self) -> bool:
        """Whether the exception changes the world, or what the car perceives of it."""
        return ExceptionKind.WEATHER <= self <= ExceptionKind.SENSOR_FAULT

    @property
    def is_plan_level(self) -> bool:
        """Whether the exception may force another route: a prop put, moved or taken away."""
        return self in (ExceptionKind.PLACE_PROP, ExceptionKind.MOVE_PROP, ExceptionKind.DELETE_PROP)

    @property
    def is_task(self) -> bool:
        """Whether the exception changes the participant's goals."""
        return self in (ExceptionKind.TASK_TRIGGER, ExceptionKind.TASK_DELETE, ExceptionKind.TASK_CHANGE)


class Sensor(StrEnum):
    """What a sensor fault takes away: sharpness of the view, the position, the whole view."""

    BLUR = "blur"
    GPS = "gps"
    VIEW = "view"
