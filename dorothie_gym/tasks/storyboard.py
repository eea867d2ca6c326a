"""Storyboards bound to a town."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from dorothie_gym.ontology import LandmarkName


class LandmarkSite(Protocol):
    """A place in a town where a landmark may stand (the world's `Site` is one)."""

    @property
    def id(self) -> int:
        """Number of the place in its town."""

    @property
    def lane(self) -> int:
        """Lane that it is reached from."""

    @property
    def station(self) -> float:
        """Distance of its waypoint along the lane [m]."""

    @property
    def position(self) -> tuple[float, float]:
        """Where the landmark stands (x, y) [m]."""

    @property
    def waypoint(self) -> tuple[float, float]:
        """The closest place on the lane (x, y) [m]."""

    @property
    def street(self) -> int:
        """Number of its street."""


@dataclass(frozen=True, kw_only=True)
class Landmark:
    """A landmark at its place.

    Attributes:
        index: position in `Storyboard.landmarks`.
        name: the ontology's landmark.
        label: how a map names it; houses and people are numbered where there are several.
        category: dotted category.
        site: id of the place.
        lane: lane that it is reached from.
        station: distance of its waypoint along the lane [m].
        position: where it stands (x, y) [m].
        waypoint: the closest place on the lane (x, y) [m].
        street: number of its street.
        hidden: whether the Co-Wizard does not know where it is.
    """

    index: int
    name: LandmarkName
    label: str
    category: str
    site: int
    lane: int
    station: float
    position: tuple[float, float]
    waypoint: tuple[float, float]
    street: int
    hidden: bool


@dataclass(frozen=True, kw_only=True)
class Subgoal:
    """One thing to do; see `SubgoalTemplate`, with names filled in and landmarks given by index."""

    landmark: int
    description: str
    after: tuple[int, ...] = ()
    trigger: bool = False
    delete: bool = False
    change: str | None = None
    change_landmark: int | None = None
    delete_after_subgoal: int | None = None
    leaves: bool = False


@dataclass(frozen=True, kw_only=True)
class Storyboard:
    """A bound storyboard.

    Attributes:
        name: name of the template.
        story: what the participant reads.
        subgoals: in the template's order, those to be triggered included.
        landmarks: everything that stands in the town. The first ten are the ontology's, in the order of its ids;
            further houses and people follow.
    """

    name: str
    story: str
    subgoals: tuple[Subgoal, ...]
    landmarks: tuple[Landmark, ...]
