"""Talk tasks: scenarios of the families "ask first" and "admit it", drawn from a seed in any town.

A talk task has a client with a request (`Brief`), landmarks that make it possible, ambiguous or impossible, and the
reaction that is right. Kinds use the same words in different worlds, so that the words alone do not give the reaction
away (contrast sets; Gardner et al. 2020, arXiv:2004.02709).
"""

from __future__ import annotations

import enum
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.refusals import Reason
from dorothie_gym.errors import StoryboardError
from dorothie_gym.maps.model import Site
from dorothie_gym.maps.site_inference import connected_sites
from dorothie_gym.ontology.slots import LandmarkName, StreetName
from dorothie_gym.support.copying import shared
from dorothie_gym.tasks.briefs import Brief
from dorothie_gym.tasks.catalogue import catalogue, map_labels
from dorothie_gym.tasks.storyboard import Landmark, Storyboard, Subgoal

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town


class Reaction(enum.StrEnum):
    """Reaction of the Co-Wizard to a request that is right."""

    GO_TO = "go_to"
    """Set the place as the goal, without a question."""
    AGREE = "agree"
    """Promise it, without a question."""
    ANSWER = "answer"
    """Answer the question truly, without a question in return."""
    ASK = "ask"
    """Settle by a question or a statement what is meant; then set the place as the goal."""
    ADMIT = "admit"
    """Decline with the true reason, and offer something else; do and promise nothing before."""


@shared
@dataclass(frozen=True, kw_only=True)
class TalkTask:
    """Task whose outcome depends on talk.

    Attributes:
        kind: kind of the task.
        reaction: reaction that is right.
        brief: words of the client.
        landmarks: name and site of each landmark of the town.
        target: number of the landmark that the client means; None if there is none.
        reason: reason for which the request must be declined; None if it need not be.
        answer: street that answers the request; None if it is no such question.
        closed: lane and station [m] where the street is closed; None if it is open.
        departure: lane of the car and the distance along it [m]; None for any place.
    """

    kind: str
    reaction: Reaction
    brief: Brief
    landmarks: tuple[tuple[LandmarkName, Site], ...] = ()
    target: int | None = None
    reason: Reason | None = None
    answer: StreetName | None = None
    closed: tuple[int, int] | None = None
    departure: tuple[int, float] | None = None


class UnfitTownError(Exception):
    """The town has too few streets or sites for a kind of task; another kind is drawn."""


class TaskDraw:
    """Random draws of streets and sites for one task.

    Attributes:
        rng: source of randomness.
        share: draw in [0, 1), which selects the world of a kind.
        town: the map.
        names: name of each street of the town.
    """

    def __init__(self, town: Town, names: Sequence[StreetName], rng: np.random.Generator) -> None:
        self.town, self.names, self.rng = town, tuple(names), rng
        self.share = float(rng.random())
        self._sites: dict[StreetName, list[Site]] = {}
        for k in rng.permutation(len(connected_sites(town))).tolist():
            site = connected_sites(town)[k]
            name = self.names[site.street] if 0 <= site.street < len(self.names) else StreetName.UNKNOWN
            if name is not StreetName.UNKNOWN:
                self._sites.setdefault(name, []).append(site)

    def streets(self, count: int, sites: int = 1) -> list[StreetName]:
        """Draws different streets, each with a number of sites; raises `UnfitTownError` if there are too few."""
        fitting = [name for name in sorted(self._sites, key=lambda name: name.value) if len(self._sites[name]) >= sites]
        if len(fitting) < count:
            raise UnfitTownError
        return [fitting[k] for k in self.rng.permutation(len(fitting))[:count].tolist()]

    def take(self, street: StreetName) -> Site:
        """Draws a site on a street; no site is drawn twice."""
        return self._sites[street].pop()

    def absent_street(self) -> StreetName:
        """Draws a name that no street of the town has."""
        unnamed = (StreetName.UNKNOWN, StreetName.QUERIED, StreetName.HIGHWAY)
        free = [name for name in StreetName if name not in (*self.names, *unnamed)]
        if not free:
            raise UnfitTownError
        return free[int(self.rng.integers(len(free)))]

    def one_of(self, names: Sequence[LandmarkName], count: int = 1) -> list[LandmarkName]:
        """Draws different landmarks."""
        return [names[k] for k in self.rng.permutation(len(names))[:count].tolist()]

    def around(
        self, named: Sequence[tuple[LandmarkName, Site]], absent: Collection[LandmarkName] = ()
    ) -> tuple[tuple[LandmarkName, Site], ...]:
        """Returns landmarks with others around them, as far as the town has sites, and one left for the departure.

        Args:
            named: landmarks of the task.
            absent: landmarks that the town must not have.
        """
        taken = {site.id for _, site in named}
        free = [site for sites in self._sites.values() for site in sites if site.id not in taken]
        free = [free[k] for k in self.rng.permutation(len(free)).tolist()][1:]
        present = {name for name, _ in named}
        others = [name for name in catalogue() if name not in present and name not in absent]
        return (*named, *zip(others, free, strict=False))


TARGET: Final = "(target)"
"""Part of a reply that stands for the name of the target on the map."""


def in_map_order(task: TalkTask) -> TalkTask:
    """Returns a task whose landmarks are in the order of names and sites, which says nothing about the target."""
    order = sorted(range(len(task.landmarks)), key=lambda k: (task.landmarks[k][0].value, task.landmarks[k][1].id))
    landmarks = tuple(task.landmarks[k] for k in order)
    if task.target is None:
        return replace(task, landmarks=landmarks)
    target = order.index(task.target)
    label = map_labels([name for name, _ in landmarks])[target]
    replies = tuple(replace(reply, text=reply.text.replace(TARGET, label)) for reply in task.brief.replies)
    return replace(task, landmarks=landmarks, target=target, brief=replace(task.brief, replies=replies))


def storyboard_of(task: TalkTask) -> Storyboard:
    """Returns the storyboard of a task.

    The participant reads the brief as its story. A closed street is an errand that is never given: only the Ad-Wizard
    observes it.

    Raises:
        StoryboardError: the task has no landmarks.
    """
    labels = map_labels([name for name, _ in task.landmarks])
    landmarks = tuple(
        Landmark(
            index=k,
            name=name,
            label=label,
            category=catalogue()[name].category,
            site=site.id,
            lane=site.lane,
            station=site.station,
            position=site.position,
            waypoint=site.waypoint,
            street=site.street,
            hidden=False,
        )
        for k, ((name, site), label) in enumerate(zip(task.landmarks, labels, strict=True))
    )
    if not landmarks:
        raise StoryboardError(task.kind, "landmarks", "the town has no sites on streets with names; use a larger town")
    where = 0 if task.target is None else task.target
    subgoals = [Subgoal(landmark=where, description="Follow your story.")]
    if task.closed is not None:
        lane, metres = task.closed
        subgoals.append(Subgoal(landmark=where, description=CLOSURE.format(lane=lane, metres=metres), trigger=True))
    return Storyboard(name=task.kind, story=str(task.brief), subgoals=tuple(subgoals), landmarks=landmarks)


CLOSURE: Final = "Close lane {lane} at {metres} m at once, for good."
"""Description of the errand by which the Ad-Wizard learns that a street is closed."""

_CLOSURE: Final = re.compile(r"^Close lane (\d+) at (\d+) m at once, for good\.$", re.MULTILINE)


def closure_in(tasks: str) -> tuple[int, int] | None:
    """Returns lane and station [m] of a closed street from the errands of the Ad-Wizard; None if it is open."""
    found = _CLOSURE.search(tasks)
    return None if found is None else (int(found[1]), int(found[2]))
