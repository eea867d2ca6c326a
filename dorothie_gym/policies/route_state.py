"""Route of an agent to a place, the places that its planner must not use, and what was driven in vain."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from dorothie_gym.errors import PolicyStateError
from dorothie_gym.maps.routing import Place, router
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import CELL_BEHIND, SAME_ROADBLOCK, RouteProgress, lanes_beside

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

NEAR_MISS = 150.0
"""A car that leaves the route within this distance of the goal may have missed it [m]."""

WAY_ROUND = 60.0
"""A new route that is longer by more than this shows that the goal was missed [m]."""

WORN_OUT = 2
"""Number of times that a section of road is driven on the way to one goal before another route is taken."""

WORN_DETOUR = 600.0
"""Largest additional length of such a route [m]."""

MOST_AVOIDED = 3
"""Maximum number of places that are excluded after misses; more could close all lanes of a road."""


Section: TypeAlias = tuple[int, bool]
"""Section of road in one direction: its road, and whether its lanes have positive numbers."""


def section(town: Town, lane: int) -> Section:
    """Returns the section of road that a lane belongs to."""
    return town.lanes[lane].road_id, town.lanes[lane].lane_id > 0


@dataclass(frozen=True, kw_only=True)
class RouteState:
    """Route of an agent, and known places that the planner must not use.

    Attributes:
        progress: route to the goal and the progress on it; None without a place to go to.
        blocked: places beyond roadblocks.
        avoided: places excluded because the car missed the goal after passing them, the latest last.
        misses: number of times that the car has driven past the goal.
        kept_off: places on the streets that the car is to keep off.
        driven: sections of road that the car has entered on the way to the goal, in order; see `section`.
        worn: places on the sections that were driven in vain, which another route avoids.
    """

    progress: RouteProgress | None = None
    blocked: tuple[Place, ...] = ()
    avoided: tuple[Place, ...] = ()
    misses: int = 0
    kept_off: tuple[Place, ...] = ()
    driven: tuple[Section, ...] = ()
    worn: tuple[Place, ...] = ()

    @property
    def to_goal(self) -> RouteProgress:
        """Progress on the route, for code that requires a route; raises `PolicyStateError` without one."""
        if self.progress is None:
            raise PolicyStateError("the agent has no route: it was given no place to go to, or gave it up")
        return self.progress

    @property
    def closed(self) -> tuple[Place, ...]:
        """Places that the planner must not use."""
        return self.blocked + self.avoided + self.kept_off + self.worn

    def with_progress(self, progress: RouteProgress | None) -> RouteState:
        """Sets the route, or gives it up (None)."""
        return replace(self, progress=progress)

    def for_new_goal(self) -> RouteState:
        """Resets the misses of the previous goal; roadblocks stay known."""
        return replace(self, misses=0, avoided=(), driven=self.driven[-1:], worn=())

    def entering(self, town: Town, lane: int) -> RouteState:
        """Records the section of road that the car is on."""
        if town.lanes[lane].in_junction:
            return self
        here = section(town, lane)
        return self if self.driven[-1:] == (here,) else replace(self, driven=(*self.driven, here))

    def replanned(self, town: Town, start: Place) -> RouteState:
        """Plans another route to the same goal, without the sections that the car has driven twice, if there is one."""
        return replace(self, progress=self.to_goal.replanned(town, start, self.closed)).sparing_worn(town, start)

    def sparing_worn(self, town: Town, start: Place) -> RouteState:
        """Plans a route without the sections that the car has driven twice, where the present one uses any.

        Sections of the car and of the goal remain. U-turns and lane changes that the route avoids are allowed where it
        cannot spare the sections without them. The route is kept if the other one is much longer.
        """
        progress = self.to_goal
        spared = {section(town, start[0]), section(town, progress.goal[0])}
        worn = {here for here, times in Counter(self.driven).items() if times >= WORN_OUT} - spared
        if not any(section(town, leg.lane) in worn for leg in progress.legs):
            return self
        lanes = (lane for lane in town.lanes if not lane.in_junction and section(town, lane.id) in worn)
        places = tuple((lane.id, lane.length / 2.0) for lane in lanes)
        closed = self.blocked + self.avoided + self.kept_off + places
        longest = progress.left(start[1]) + WORN_DETOUR
        for cost in dict.fromkeys((progress.manoeuvre_cost, 0.0)):  # rather a U-turn than another lap
            found = router(town).route(start, progress.goal, closed, cost)
            if found is not None and found.length <= longest:
                another = RouteProgress.plan(town, start, progress.goal, closed, cost)
                return replace(self, worn=places, progress=another)
        return replace(self, worn=())

    def has_missed(self, before: float, station: float) -> bool:
        """Returns whether the goal, `before` metres ahead on the previous route, now needs a long detour."""
        return before < NEAR_MISS and self.to_goal.left(station) > before + WAY_ROUND

    def after_miss(self, town: Town, start: Place, former: RouteProgress) -> RouteState:
        """Counts a drive past the goal; after the second one, avoids the last lane change of the previous route."""
        counted = replace(self, misses=self.misses + 1)
        way_in = former.way_in()
        return counted.avoiding(town, start, way_in) if counted.misses > 1 and way_in is not None else counted

    def avoiding(self, town: Town, start: Place, place: Place) -> RouteState:
        """Excludes a place, in addition to the `MOST_AVOIDED` - 1 latest ones, and plans another route."""
        return replace(self, avoided=(*self.avoided, place)[-MOST_AVOIDED:]).replanned(town, start)

    def keeping_off(self, town: Town, streets: frozenset[int], here: int) -> RouteState:
        """Excludes the lanes of some streets; junctions with them can be crossed, and the present lane left.

        Args:
            town: the map.
            streets: indices of the streets.
            here: lane of the car.
        """
        spared = (here, *lanes_beside(town, here))
        kept = (lane for lane in town.lanes if lane.street in streets and not lane.in_junction)
        lanes = (lane for lane in kept if lane.id not in spared)
        places = tuple((lane.id, lane.length / 2.0) for lane in lanes)
        return replace(self, kept_off=tuple(dict.fromkeys((*self.kept_off, *places))))

    def knows_roadblock(self, place: Place) -> bool:
        """Returns whether a roadblock at a place is one of those known."""
        return any(lane == place[0] and abs(station - place[1]) < SAME_ROADBLOCK for lane, station in self.blocked)

    def with_roadblock(self, town: Town, place: Place) -> RouteState:
        """Adds a roadblock: its cell and the next one, because the car's own cell counts as free."""
        behind = place[0], min(place[1] + CELL_BEHIND, town.lanes[place[0]].length)
        return replace(self, blocked=(*self.blocked, place, behind))
