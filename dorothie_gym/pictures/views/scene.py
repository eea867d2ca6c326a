"""Scene of a picture as plain data, filled in by an environment or a recorded session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import GoalStatus

FigureKind: TypeAlias = Literal["vehicle", "cyclist", "pedestrian", "prop"]
SubgoalState: TypeAlias = Literal["none", "pending", "ongoing", "complete", "abandoned"]


SUBGOAL_STATES: Mapping[GoalStatus, SubgoalState] = MappingProxyType(
    {
        GoalStatus.COMPLETE: "complete",
        GoalStatus.ONGOING: "ongoing",
        GoalStatus.PENDING: "pending",
        GoalStatus.ABANDONED: "abandoned",
    }
)
"""States of subgoals in pictures."""


def _no_points() -> NDArray[np.float64]:
    return np.zeros((0, 2))


@dataclass(frozen=True, kw_only=True)
class CarView:
    """Car: position [m], heading [rad], size [m], speed [m/s], and whether its lights are on."""

    x: float
    y: float
    heading: float
    speed: float = 0.0
    lights: bool = False
    length: float = 5.0
    width: float = 2.0


@dataclass(frozen=True, kw_only=True)
class Actor:
    """Other road user or object: position [m], heading [rad] and size [m]."""

    kind: FigureKind
    x: float
    y: float
    heading: float = 0.0
    length: float = 5.0
    width: float = 2.0

    def __post_init__(self) -> None:
        if self.kind not in get_args(FigureKind):
            raise ValueError(f"Actor.kind: {self.kind!r} is none of {', '.join(get_args(FigureKind))}")


@dataclass(frozen=True, kw_only=True)
class Pin:
    """Landmark on the map: name, position (x, y) [m], waypoint (x, y) [m], state, and whether it is hidden."""

    label: str
    x: float
    y: float
    waypoint: tuple[float, float]
    state: SubgoalState = "none"
    hidden: bool = False

    def __post_init__(self) -> None:
        if self.state not in get_args(SubgoalState):
            raise ValueError(f"Pin.state: {self.state!r} is none of {', '.join(get_args(SubgoalState))}")


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Estimated position (x, y) [m] with its covariance (xx, xy, yy) [m^2]; without a label that of the car."""

    x: float
    y: float
    covariance: tuple[float, float, float]
    label: str = ""


@dataclass(frozen=True, kw_only=True)
class SpokenLine:
    """Utterance or message: time at which it is heard, at its end [s], speaker, text, and acts in short form.

    `start` is the time at which it begins [s], None if unknown or the line was not spoken.
    """

    time: float
    speaker: Role
    text: str
    acts: str = ""
    start: float | None = None


@dataclass(frozen=True, kw_only=True)
class ExceptionMark:
    """Exception of the Ad-Wizard: time [s], words, and position (x, y) of the car [m]."""

    time: float
    text: str
    x: float
    y: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """State of a session at one time.

    Attributes:
        time: time since the start [s].
        town: the town.
        car: the car.
        street_names: by street index; the town's own where None.
        trail: path driven so far (n, 2) [m], from the start.
        waypoints: planned path (m, 2) [m].
        others: other road users and objects.
        landmarks: landmarks with pins.
        subgoals: (description, state) of each task, deleted ones included.
        utterances: utterances and messages, oldest first.
        speaking: utterances in progress, whose end has not been heard.
        notes: warnings, such as a hazard or an exception.
        exceptions: exceptions so far.
        weather: the ten parameters by name; missing ones have their values of a clear noon.
        estimates: estimated positions, drawn as regions that hold the true one with a probability of 95 %.
        caption: first line of the panel, such as the name of the storyboard.
    """

    time: float
    town: Town
    car: CarView
    street_names: Sequence[str] | None = None
    trail: NDArray[np.float64] = field(default_factory=_no_points)
    waypoints: NDArray[np.float64] = field(default_factory=_no_points)
    others: Sequence[Actor] = ()
    landmarks: Sequence[Pin] = ()
    subgoals: Sequence[tuple[str, SubgoalState]] = ()
    utterances: Sequence[SpokenLine] = ()
    speaking: Sequence[SpokenLine] = ()
    notes: Sequence[str] = ()
    exceptions: Sequence[ExceptionMark] = ()
    weather: Mapping[str, float] = field(default_factory=dict)
    estimates: Sequence[Estimate] = ()
    caption: str = ""

    def __post_init__(self) -> None:
        for name in ("trail", "waypoints"):
            shape = getattr(self, name).shape
            if len(shape) != 2 or shape[1] != 2:
                raise ValueError(f"Scene.{name}: shape {shape} is not (n, 2)")
