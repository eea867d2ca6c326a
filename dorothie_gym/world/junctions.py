"""Who may cross a junction: lights and signs first, then priority, then whoever came first.

Stock IDM vehicles do not see each other across a junction. Here each announces where it is going, as indicators do, and
asks before it enters. Those whose paths cross are never let in together, whatever lights and signs say: who is on its
way across clears the junction first.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from dataclasses import dataclass

from dorothie_gym.world.town.lights import LightColour
from dorothie_gym.world.town.model import SignalKind, Town
from dorothie_gym.world.town.right_of_way import right_of_way

COMFORTABLE_BRAKING = 3.0
"""Who can stop before a yellow light no harder than this does so (ITE's 10 ft/s^2 for yellow times) [m/s^2]."""

HARDEST_BRAKING = 6.0
"""Who cannot stop before a red light with this any more goes on [m/s^2]."""

CRITICAL_GAP = 4.5
"""Who gives way goes if nobody with priority comes sooner (Highway Capacity Manual 2010, permitted left turns) [s]."""

GIVING_WAY_PATIENCE = 30.0
"""Who has been giving way for longer than this has its turn like anybody else [s]."""

SNEAKING = 2.0
"""Who has been giving way at a green light for this long may go when it turns yellow (HCM's sneakers) [s]."""

START = 1.2
"""Time from a stand at the line until the front is over it [s]."""

AT_LINE = 3.5
"""Who stands with its front this close before the line stands at it [m]."""

OVER_LINE = 0.5
"""Who is this far over the line does not stop for its light any more [m]."""

STANDING = 0.3
"""Slower than this a vehicle stands [m/s]."""

UNUSED = 3.0
"""Who was let in and stands before the junction for this long has to ask again [s]."""

LAPSE = 1.0
"""Who was let in, or waits, and asks no more (it goes elsewhere) has lost its place after this long [s]."""


class Wait(enum.Enum):
    """Why a vehicle may not enter a junction."""

    LIGHT = "its light is red, or yellow and it can stop"
    STOP_SIGN = "it has not come to a stand at its stop sign"
    GIVING_WAY = "somebody comes who has priority"
    TURN = "somebody else has been waiting for longer"
    OCCUPIED = "somebody is on a path that crosses its own"
    CLOSED = "somebody turns round in the junction"
    NO_ROOM = "there is no room behind the junction"


@dataclass
class _Approach:
    """A vehicle that comes to a junction or waits before it.

    Attributes:
        lane: where it comes from.
        connector: where it goes.
        distance: from its front to the line [m].
        speed: [m/s].
        seen: when it was announced last [s].
        asked: when it asked last [s].
        since: when it began to wait, later by the time for which its light was red; infinite while it does not [s].
        stood: whether it has come to a stand at the line.
        wait: why it waited when it asked last.
    """

    lane: int
    connector: int
    distance: float
    speed: float
    seen: float
    asked: float = -math.inf
    since: float = math.inf
    stood: bool = False
    wait: Wait | None = None

    @property
    def braking(self) -> float:
        """Deceleration that stops it at the line [m/s^2]."""
        return self.speed**2 / (2 * max(self.distance, 0.1))


@dataclass(eq=False)
class _Claim:
    """A connector that a vehicle was let into.

    Attributes:
        key: tells the vehicle apart.
        connector: the lane.
        since: when it was let in, or was last seen moving before the junction [s].
        asked: when it asked last [s].
        entered: whether it is in the junction.
    """

    key: int
    connector: int
    since: float
    asked: float
    entered: bool = False


class JunctionControl:
    """Lets vehicles into the junctions of a town."""

    def __init__(self, town: Town) -> None:
        self._town = town
        self._rules = right_of_way(town)
        self._foes = {lane.id: frozenset(self._rules.foes(lane.id)) for lane in town.lanes if lane.in_junction}
        self._approaches: dict[int, _Approach] = {}
        self._towards: dict[int, dict[int, _Approach]] = {connector: {} for connector in self._foes}
        self._held: dict[int, list[_Claim]] = {}
        self._inside: dict[int, list[_Claim]] = {self._junction(connector): [] for connector in self._foes}
        self._closed: dict[int, tuple[int, float]] = {}  # junction: who closed it, and when it asked last

    # --- asking -----------------------------------------------------------------------------------------------------

    def announce(self, key: int, lane: int, connector: int, now: float, *, distance: float, speed: float) -> None:
        """Tells that a vehicle comes to a junction; to be repeated at least for the last `CRITICAL_GAP`.

        Args:
            key: tells the vehicle apart.
            lane: it comes on.
            connector: lane across the junction that it will take.
            now: simulated time [s].
            distance: from its front to the end of the lane [m].
            speed: [m/s].
        """
        approach = self._approaches.get(key)
        if approach is None or approach.connector != connector or approach.lane != lane:
            stood = approach is not None and approach.lane == lane and approach.stood
            self._forget(key)
            approach = self._approaches[key] = _Approach(lane, connector, distance, speed, now, stood=stood)
            self._towards[connector][key] = approach
        approach.distance, approach.speed, approach.seen = distance, speed, now
        approach.stood |= speed < STANDING and distance < AT_LINE

    def request(self, key: int, now: float, *, room: Callable[[int], bool]) -> Wait | None:
        """Asks to enter the connector that was announced last; to be repeated until the vehicle is on it.

        Args:
            key: tells the vehicle apart.
            now: simulated time [s].
            room: tells whether there is room behind the junction, for that many others as well.

        Returns:
            Why it has to wait, or None: it may enter. Then nobody is let in whose path crosses its own until it has
            crossed, loses its green light, or does not use the permission.
        """
        approach = self._approaches[key]
        if now - approach.asked > LAPSE:
            approach.since = math.inf
        for claim in list(self._held.get(key, ())):
            # a vehicle may still be crossing the last junction, but heads for one connector only
            elsewhere = claim.connector != approach.connector
            if not claim.entered and (elsewhere or self._light_stops(approach, now, let_in=True)):
                self._drop(claim)
            elif claim.connector == approach.connector:
                claim.asked = approach.asked = now
                approach.wait = None
                return None
        approach.wait = self._reason_to_wait(key, approach, now, room)
        approach.asked = now
        if approach.wait is None:
            claim = _Claim(key, approach.connector, now, now)
            self._held.setdefault(key, []).append(claim)
            self._inside[self._junction(approach.connector)].append(claim)
        return approach.wait

    def close(self, key: int, junction: int, now: float) -> bool:
        """Asks for a whole junction, to turn round in its mouth; to be repeated as long as it is needed.

        Args:
            key: tells the vehicle apart.
            junction: id of the junction.
            now: simulated time [s].

        Returns:
            Whether it is empty; then nobody else is let in while this is repeated.
        """
        self._closed[junction] = (key, now)
        return all(claim.key == key for claim in self._inside.get(junction, ()))

    def note(self, key: int, lane: int, speed: float, now: float) -> None:
        """Takes note of where a vehicle is: enters or leaves its connector, or does not use what it was granted."""
        held = self._held.get(key)
        if not held:
            return
        junction = self._junction(lane)
        for claim in list(held):
            if junction == self._junction(claim.connector):
                claim.entered = True
                approach = self._approaches.get(key)
                if approach is not None and approach.connector == claim.connector:
                    self._forget(key)
            elif claim.entered:
                self._drop(claim)
            else:
                claim.since = now if speed > STANDING else claim.since
                if now - claim.since > UNUSED or now - claim.asked > LAPSE:
                    self._drop(claim)

    def release(self, key: int) -> None:
        """Gives back what a vehicle holds or waits for."""
        for claim in list(self._held.get(key, ())):
            self._drop(claim)
        self._forget(key)

    def holds(self, key: int) -> int | None:
        """Connector that a vehicle was let into last."""
        held = self._held.get(key)
        return held[-1].connector if held else None

    # --- the rules --------------------------------------------------------------------------------------------------

    def obeys_sign(self, lane: int) -> bool:
        """Whether a stop or yield sign stands at the end of a lane."""
        return self._rules.control(lane) in (SignalKind.STOP, SignalKind.YIELD)

    def _reason_to_wait(self, key: int, own: _Approach, now: float, room: Callable[[int], bool]) -> Wait | None:
        if self._light_stops(own, now):
            own.since += max(now - own.asked, 0.0) if math.isfinite(own.since) else 0.0
            return Wait.LIGHT
        if self._has_to_stop(own):
            return Wait.STOP_SIGN
        if not room(self._heading_to_exit(key, own)):
            own.since = math.inf  # whoever cannot leave the junction keeps nobody waiting
            return Wait.NO_ROOM
        own.since = min(own.since, now)
        closed = self._closed.get(self._junction(own.connector))
        if closed is not None and closed[0] != key and now - closed[1] < LAPSE:
            return Wait.CLOSED
        if self._is_occupied(key, own.connector):
            return Wait.OCCUPIED
        if self._is_anothers_turn(key, own, now):
            return Wait.TURN
        return Wait.GIVING_WAY if self._gives_way(key, own, now) else None

    def _light_stops(self, approach: _Approach, now: float, *, let_in: bool = False) -> bool:
        """Whether a vehicle has to stop for its light, and can; `let_in` if it was about to enter."""
        colour = self._town.light(approach.lane, now)
        if colour is None or colour is LightColour.GREEN or approach.distance < -OVER_LINE:
            return False
        # who has begun to stop goes on stopping
        if colour is LightColour.RED or approach.wait is Wait.LIGHT:
            return approach.braking <= HARDEST_BRAKING
        return approach.braking <= COMFORTABLE_BRAKING and not self._may_sneak(approach, now, let_in)

    def _may_sneak(self, approach: _Approach, now: float, let_in: bool) -> bool:
        """Whether who gave way at the line all the green time may use the yellow: it must not last into the red."""
        waited = now - approach.since > SNEAKING and approach.distance < AT_LINE
        if not waited or not self._rules.waits_for(approach.connector):
            return False
        return let_in or self._town.light(approach.lane, now + START) is LightColour.YELLOW

    def _has_to_stop(self, approach: _Approach) -> bool:
        return not approach.stood and self._rules.control(approach.lane) is SignalKind.STOP

    def _heading_to_exit(self, key: int, own: _Approach) -> int:
        """How many others have been let into the junction who will leave it on the same lane."""
        exits = {link.target for link in self._town.successors(own.connector)}
        return sum(
            claim.key != key and any(link.target in exits for link in self._town.successors(claim.connector))
            for claim in self._inside[self._junction(own.connector)]
        )

    def _is_occupied(self, key: int, connector: int) -> bool:
        foes = self._foes[connector]
        return any(claim.connector in foes and claim.key != key for claim in self._inside[self._junction(connector)])

    def _is_anothers_turn(self, key: int, own: _Approach, now: float) -> bool:
        return any(
            other_key != key and self._comes_first(other, own, now)
            for foe in self._rules.foes(own.connector)
            for other_key, other in self._towards[foe].items()
        )

    def _comes_first(self, other: _Approach, own: _Approach, now: float) -> bool:
        """Whether one who waits goes before another by the time of waiting; priority is none of it, but patience is."""
        if other.since >= own.since or now - other.asked >= LAPSE:
            return False
        if other.wait in (Wait.LIGHT, Wait.STOP_SIGN, Wait.NO_ROOM):
            return False
        if now - other.since > GIVING_WAY_PATIENCE:
            return True
        if other.wait is Wait.GIVING_WAY or other.connector in self._rules.waits_for(own.connector):
            return False
        return own.connector not in self._rules.waits_for(other.connector)

    def _gives_way(self, key: int, own: _Approach, now: float) -> bool:
        if now - own.since > GIVING_WAY_PATIENCE:
            return False
        return any(
            other_key != key and self._is_coming(other_key, other, now)
            for foe in self._rules.waits_for(own.connector)
            for other_key, other in self._towards[foe].items()
        )

    def _is_coming(self, key: int, other: _Approach, now: float) -> bool:
        """Whether one who has priority would be in the junction within the critical gap."""
        if now - other.seen >= LAPSE or self._light_stops(other, now) or self._has_to_stop(other):
            return False
        if other.wait in (Wait.GIVING_WAY, Wait.TURN, Wait.CLOSED, Wait.NO_ROOM):
            return False  # it waits for others itself
        if other.speed < STANDING:  # about to start, unless somebody is in its way
            return other.distance < AT_LINE and not self._is_occupied(key, other.connector)
        return other.distance < CRITICAL_GAP * other.speed

    # --- bookkeeping ------------------------------------------------------------------------------------------------

    def _junction(self, lane: int) -> int:
        return self._town.lanes[lane].junction_id

    def _forget(self, key: int) -> None:
        approach = self._approaches.pop(key, None)
        if approach is not None:
            del self._towards[approach.connector][key]

    def _drop(self, claim: _Claim) -> None:
        self._held[claim.key].remove(claim)
        self._inside[self._junction(claim.connector)].remove(claim)
