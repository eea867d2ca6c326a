"""Lanes of a manoeuvre, and the pieces of path along them."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from dorothie_gym.angles import wrap_degrees
from dorothie_gym.copying import shared
from dorothie_gym.maps.model import Exit, LinkType
from dorothie_gym.maps.town import Town
from dorothie_gym.sim.ego.limits import LEAD, MIN_SWITCH, PLANNED_BRAKING, SWITCH_TIME
from dorothie_gym.sim.ego.path import PathPiece, follow, switch

LEAST_PATH = 120.0
"""Least length of path ahead [m]."""

LAID = 180.0
"""Length of path that is laid ahead [m]: more than `LEAST_PATH`, so that it is seldom laid again."""

SWITCH_COST = 20.0
"""Misfit by which an exit of the own lane is preferred to that of a lane beside it [degrees]."""

SETTLE = 15.0
"""Way along a newly entered lane before it is changed, where there is room [m]."""

EXACT = 5.0
"""Misfit within which an exit is the one that was asked for [degrees]."""

ANOTHER_WAY = 15.0
"""Difference of angle from which on exits are different turns [degrees]."""

WAITING_ROOM = 4.5
"""Distance between the end of a lane switch and a lane's end at which the ego may have to wait [m]."""

MOST_CHANGES = 3
"""Most lane changes before a turn."""

SIDES = (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)


@dataclass(frozen=True)
class LaneStep:
    """A lane of a plan, and whether it is entered from the side."""

    lane: int
    change: bool = False


@shared
class LaneChooser:
    """Choice of lanes for plans: side lanes, successors, ways to an exit."""

    def __init__(self, town: Town) -> None:
        self._town = town
        self._choices: dict[int, bool] = {}

    def is_choice(self, lane: int) -> bool:
        """Returns whether a turn has to be chosen at the end of a lane."""
        exits = self._town.exits(lane)
        return len(exits) > 1 and any(way.junction_id >= 0 for way in exits)

    def offers_turns(self, lane: int) -> bool:
        """Returns whether the junction at the end of a lane offers a turn, from this lane or from one beside it."""
        if lane not in self._choices:
            ways = [way for beside in self.side_by_side(lane) for way in self._town.exits(beside)]
            turns = [way.angle for way in ways if way.junction_id >= 0]
            apart = max((abs(wrap_degrees(turn - turns[0])) for turn in turns), default=0.0)
            self._choices[lane] = self.is_choice(lane) or (bool(self._town.exits(lane)) and apart > ANOTHER_WAY)
        return self._choices[lane]

    def side_by_side(self, lane: int) -> list[int]:
        """Returns a lane and all that are reached from it by lane changes."""
        found = [lane]
        for known in found:
            for side in SIDES:
                beside = self._town.neighbour(known, side)
                if beside is not None and beside not in found:
                    found.append(beside)
        return found

    def default_successor(self, lane: int) -> int | None:
        """Returns the lane that follows by default: the only one, or outside junctions the straightest."""
        exits = self._town.exits(lane)
        if not exits or self.is_choice(lane):
            return None
        return min(exits, key=lambda way: (abs(way.angle), way.connector)).connector

    def through_junction(self, lane: int) -> list[LaneStep]:
        """Returns the lane, and inside a junction those up to the lane behind it."""
        steps = [LaneStep(lane)]
        while self._town.lanes[steps[-1].lane].in_junction:
            on = self.default_successor(steps[-1].lane)
            if on is None:
                break
            steps.append(LaneStep(on))
        return steps

    def steps_along(self, lanes: Sequence[int]) -> list[LaneStep]:
        """Returns the steps along lanes that follow, or lie beside, one another."""
        steps = [LaneStep(lane) for lane in lanes]
        for k in range(1, len(steps)):
            beside = [self._town.neighbour(steps[k - 1].lane, side) for side in SIDES]
            if steps[k].lane in beside:
                steps[k] = LaneStep(steps[k].lane, change=True)
        return steps

    def find_turn(self, first: list[LaneStep], station: float, angle: int) -> tuple[list[LaneStep], Exit] | None:
        """Returns the steps to the exit that fits an angle best, with lane changes if that fits much better.

        Args:
            first: steps that are taken in any case.
            station: place of the ego on the first of them [m].
            angle: degrees, positive left.
        """
        town = self._town
        own = first[-1].lane
        if not self.offers_turns(own):
            # a lane that itself leads on as asked is kept to its end; lanes are changed further on, if at all
            fits = [way for way in town.exits(own) if abs(wrap_degrees(way.angle - angle)) <= EXACT]
            if fits:
                first = [*first, LaneStep(fits[0].connector), *self._onward(fits[0])]
                if fits[0].junction_id >= 0 and abs(fits[0].angle) > ANOTHER_WAY:
                    return first, fits[0]  # the only way on there: it is the turn that was asked for
        best: tuple[float, list[LaneStep], Exit] | None = None
        # successors come before lanes beside, so that lanes are changed as late as there is room
        queue: deque[tuple[list[LaneStep], int]] = deque([(first, 0)])
        seen = {first[-1].lane}
        while queue:
            steps, changes = queue.popleft()
            lane = steps[-1].lane
            if self.offers_turns(lane):
                for way in town.exits(lane):
                    misfit = abs(wrap_degrees(way.angle - angle)) + SWITCH_COST * changes
                    if best is None or misfit < best[0]:
                        best = (misfit, [*steps, LaneStep(way.connector), *self._onward(way)], way)
            else:
                on = self.default_successor(lane)
                if on is not None and on not in seen:
                    seen.add(on)
                    queue.appendleft(([*steps, LaneStep(on)], changes))
            for side in SIDES:
                beside = town.neighbour(lane, side)
                if beside is None or beside in seen or changes == MOST_CHANGES:
                    continue
                if self._room_to_switch(steps, station):
                    seen.add(beside)
                    queue.append(([*steps, LaneStep(beside, change=True)], changes + 1))
        return None if best is None else (best[1], best[2])

    def _onward(self, way: Exit) -> list[LaneStep]:
        """Returns connectors and lane from the entered one to the exit's lane."""
        steps, lane = [], way.connector
        while lane != way.lane:
            lane = self._town.successors(lane)[0].target
            steps.append(LaneStep(lane))
        return steps

    def _room_to_switch(self, steps: list[LaneStep], station: float) -> bool:
        lane = self._town.lanes[steps[-1].lane]
        changes = 1
        for step in reversed(steps):
            if not step.change:
                break
            changes += 1
        first = len(steps) - changes  # where the lanes that lie beside one another begin
        start = station if first <= 0 else 0.0
        return lane.length - start >= changes * (MIN_SWITCH + LEAD) and not lane.in_junction

    # --- Pieces of path -----------------------------------------------------------------------------------------------

    def lay(self, steps: list[LaneStep], station: float, speed: float) -> tuple[list[PathPiece], bool]:
        """Lays pieces of path along steps, and on from there up to the next choice.

        Args:
            steps: the lanes.
            station: beginning of the path on the first of them [m].
            speed: of the ego [m/s], which the length of lane switches depends on.

        Returns:
            The pieces (none at the very end of a lane), and whether the path ends where a turn has to be chosen.
        """
        steps = list(steps)
        lengths = [self._town.lanes[step.lane].length for step in steps if not step.change]
        open_end = self._grow(steps, sum(lengths) - station)
        pieces: list[PathPiece] = []
        at = station
        for k, step in enumerate(steps):
            lane = self._town.lanes[step.lane]
            following = steps[k + 1] if k + 1 < len(steps) else None
            if following is None or not following.change:
                if at < lane.length - 1e-3:
                    pieces.append(follow(lane, at))
                at = 0.0
                continue
            changes = 1
            while k + 1 + changes < len(steps) and steps[k + 1 + changes].change:
                changes += 1
            end = lane.length - WAITING_ROOM * self.is_choice(following.lane)
            room = max((end - at) / changes - LEAD, 2.0)
            distance = min(max(MIN_SWITCH, SWITCH_TIME * speed), room)
            spare = (lane.length - at) - changes * (distance + LEAD)
            if k == 0:  # begins late enough to stop before it if others are beside the ego
                most = max(end - at - changes * (distance + LEAD), 0.0)
                lead = LEAD + min(speed * speed / (2 * PLANNED_BRAKING), most)
            else:
                lead = min(max(spare, LEAD), SETTLE)
            begin = min(at + lead, lane.length - distance)
            if begin > at + 1e-3:
                pieces.append(follow(lane, at, begin))
            pieces.append(switch(lane, self._town.lanes[following.lane], max(begin, at), distance))
            at = float(pieces[-1].stations[-1])
        return pieces, open_end

    def _grow(self, steps: list[LaneStep], ahead: float) -> bool:
        """Adds the lanes that follow until the path is long enough; returns whether it has an open end."""
        while ahead < LAID:
            on = self.default_successor(steps[-1].lane)
            if on is None:
                return True
            steps.append(LaneStep(on))
            ahead += self._town.lanes[on].length
        return False
