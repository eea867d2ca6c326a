"""Score of a session for an agent: in [0, 1], and never lowered by playing on.

The rewards of the environments cost time and talk, so that an agent that ends at once has more than one that tries. A
score does not: it is 0.8 times the share of the task that was done, and 0.2 for success. The subgoal that is under way
counts by the share of the way to it that was covered, up to half a subgoal.

The Ad-Wizard is scored against the others: by what is left of their score, in a finished session in which it has made a
change. Otherwise it has 0, so that neither silence nor an early end pays.

A talk task (tiers "ask-first" and "admit-it") has the score 1 once it was decided for the Co-Wizard, and 0 otherwise.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.navigation.cost_to_go import CostToGo

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dorothie_gym.maps.routing import Place
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.live_session import LiveSession

SUCCESS_SHARE: Final = 0.2
"""Part of the score that only a success brings."""

APPROACH_SHARE: Final = 0.5
"""Largest part of a subgoal that the way to it counts for."""

_LEAST_WAY: Final = 1.0
"""Cost of a way below which no share of it is counted [m]."""


class TaskProgress:
    """Progress of a session towards its subgoals.

    Args:
        session: session that has just begun.
    """

    def __init__(self, session: LiveSession) -> None:
        self._session = session
        self._reached = 0
        self._places: list[Place] = []
        self._ways: dict[Place, _Way] = {}
        self.note()

    def note(self) -> None:
        """Notes the place of the car at a decision; the way to the next subgoal begins where one was reached."""
        task, car = self._session.task, self._session.world.planner
        reached = sum(task.reached(i) for i in task.live)
        if reached != self._reached:
            self._reached, self._places, self._ways = reached, [], {}
        self._places.append((car.lane, car.station))

    @property
    def share(self) -> float:
        """Share of the task that was done, in [0, 1]; the last subgoal counts by the way that was covered."""
        live = len(self._session.task.live)
        return min((self._reached + APPROACH_SHARE * self._approach()) / live, 1.0) if live else 0.0

    def _approach(self) -> float:
        """Returns the covered share of the way to the subgoal that was approached most, of those that may be next."""
        task, town, best = self._session.task, self._session.world.town, 0.0
        for i in task.live:
            if task.allowed(i):
                mark = task.storyboard.landmarks[task.landmark_of(i)]
                goal = mark.lane, mark.station
                if goal not in self._ways:
                    self._ways[goal] = _Way(town, goal)
                best = max(best, self._ways[goal].covered(self._places))
        return min(best, 1.0)


class _Way:
    """Way to a subgoal: its cost at the first place, and at the nearest one so far."""

    def __init__(self, town: Town, goal: Place) -> None:
        self._cost = CostToGo(town)
        self._cost.aim(goal)
        self._seen, self._first, self._nearest = 0, math.inf, math.inf

    def covered(self, places: Sequence[Place]) -> float:
        """Returns the covered share of the way; reads the places that have been added."""
        for place in places[self._seen :]:
            cost = self._cost.from_place(*place)
            if self._seen == 0:
                self._first = cost
            self._seen, self._nearest = self._seen + 1, min(self._nearest, cost)
        if not _LEAST_WAY < self._first < math.inf:
            return 0.0
        return 1.0 - self._nearest / self._first


def score_of(session: LiveSession, progress: TaskProgress, role: Role) -> float:
    """Returns the score of a role.

    Args:
        session: the session, over or not.
        progress: its progress.
        role: role that is scored.
    """
    done = (1.0 - SUCCESS_SHARE) * progress.share + SUCCESS_SHARE * session.success
    return _of_role(session, role, done)


def score_of_talk(session: LiveSession, role: Role, *, passed: bool) -> float:
    """Returns the score of a role in a talk task.

    Args:
        session: the session, over or not.
        role: role that is scored.
        passed: whether the Co-Wizard has reacted rightly.
    """
    return _of_role(session, role, float(passed))


def _of_role(session: LiveSession, role: Role, done: float) -> float:
    if role is not Role.AD_WIZARD:
        return round(done, 6)
    return round(1.0 - done, 6) if session.over and session.log.counts["exceptions"] else 0.0
