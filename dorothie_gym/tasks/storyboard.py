"""Storyboard bound to a town."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from dorothie_gym.ontology import LandmarkName


class LandmarkSite(Protocol):
    """Candidate site of a landmark in a town (the `Site` of a town implements it)."""

    @property
    def id(self) -> int:
        """Id of the site in its town."""

    @property
    def lane(self) -> int:
        """Id of the lane that gives access."""

    @property
    def station(self) -> float:
        """Distance of the waypoint along the lane [m]."""

    @property
    def position(self) -> tuple[float, float]:
        """Position of the landmark (x, y) [m]."""

    @property
    def waypoint(self) -> tuple[float, float]:
        """Closest point on the lane (x, y) [m]."""

    @property
    def street(self) -> int:
        """Index of the street."""


@dataclass(frozen=True, kw_only=True)
class Landmark:
    """Landmark at its site.

    Attributes:
        index: index in `Storyboard.landmarks`.
        name: landmark of the ontology.
        label: name on maps; several houses and people are numbered.
        category: dotted category.
        site: id of the site.
        lane: id of the lane that gives access.
        station: distance of the waypoint along the lane [m].
        position: position of the landmark (x, y) [m].
        waypoint: closest point on the lane (x, y) [m].
        street: index of the street.
        hidden: whether the position is hidden from the Co-Wizard.
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
    """Subgoal with texts filled in and landmarks given by index; fields as in `SubgoalTemplate`."""

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
    """Storyboard bound to a town.

    Attributes:
        name: name of the template.
        story: text for the participant.
        subgoals: subgoals in the order of the template, including those that await their trigger.
        landmarks: all landmarks of the town. The first ten are those of the ontology, in the order of its ids; further
            houses and people follow.
    """

    name: str
    story: str
    subgoals: tuple[Subgoal, ...]
    landmarks: tuple[Landmark, ...]
