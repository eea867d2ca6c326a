"""What a picture of the world shows, as plain data: an environment or a recorded session fills it in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps import Town
from dorothie_gym.ontology import Role

ActorKind: TypeAlias = Literal["vehicle", "cyclist", "pedestrian", "prop"]
SubgoalState: TypeAlias = Literal["none", "pending", "ongoing", "complete", "abandoned"]


def _no_points() -> NDArray[np.float64]:
    return np.zeros((0, 2))


@dataclass(frozen=True, kw_only=True)
class CarView:
    """The car: its place [m], heading [rad], size [m], speed [m/s], and whether its lights are on."""

    x: float
    y: float
    heading: float
    speed: float = 0.0
    lights: bool = False
    length: float = 5.0
    width: float = 2.0


@dataclass(frozen=True, kw_only=True)
class Actor:
    """Another one on the road, or a thing: its place [m], heading [rad] and size [m]."""

    kind: ActorKind
    x: float
    y: float
    heading: float = 0.0
    length: float = 5.0
    width: float = 2.0

    def __post_init__(self) -> None:
        if self.kind not in get_args(ActorKind):
            raise ValueError(f"Actor.kind: {self.kind!r} is none of {', '.join(get_args(ActorKind))}")


@dataclass(frozen=True, kw_only=True)
class Pin:
    """A landmark on the map: name, place (x, y) [m], the waypoint (x, y) [m] to stop at, its state, if it is hidden."""

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
class SpokenLine:
    """Something said: when [s], by whom, the words, and the dialogue acts in short."""

    time: float
    speaker: Role
    text: str
    acts: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """A moment of a session.

    Attributes:
        time: since the start [s].
        town: where it happens.
        car: the car.
        street_names: by street index; the town's own where None.
        trail: the way driven so far (n, 2) [m].
        waypoints: the way planned (m, 2) [m].
        others: who and what else is there.
        landmarks: pins.
        subgoals: (description, state) of each task.
        utterances: what was said, oldest first.
        notes: what deserves a warning, such as a hazard or an exception.
        weather: the ten parameters by name; those absent are as on a clear noon.
        caption: a line at the head of the panel, such as the storyboard's name.
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
    notes: Sequence[str] = ()
    weather: Mapping[str, float] = field(default_factory=dict)
    caption: str = ""

    def __post_init__(self) -> None:
        for name in ("trail", "waypoints"):
            shape = getattr(self, name).shape
            if len(shape) != 2 or shape[1] != 2:
                raise ValueError(f"Scene.{name}: shape {shape} is not (n, 2)")
