"""Sign of JTurn angles, determined from the motion of the car, and angles of turns into a road."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.session.recording.events import Event, EventType
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.archive.sdn.trajectory import CarPoses, SdnMap

MIN_CLEAR_TURN: Final = 30.0
"""Angles and turns from here to `MAX_CLEAR_TURN` distinguish left from right [degrees]."""

MAX_CLEAR_TURN: Final = 150.0

MAX_TURN_DELAY: Final = 600
"""Longest time from a JTurn to its junction [frames at 10 Hz]."""


@dataclass(frozen=True)
class SignVote:
    """Votes of JTurns on the sign of angles: the car turned to the side of the sign.

    Attributes:
        left: votes for "positive is left", the convention of this package.
        right: votes for "positive is right".
    """

    left: int = 0
    right: int = 0

    def __add__(self, other: SignVote) -> SignVote:
        """Returns the sum of both votes."""
        return SignVote(self.left + other.left, self.right + other.right)

    @property
    def positive_left(self) -> bool:
        """Whether positive angles point to the left; True for a tie."""
        return self.left >= self.right

    def to_json(self) -> dict[str, object]:
        """Returns sign, agreement (share of the turns that vote for it, or null) and number of turns."""
        total = self.left + self.right
        return {
            "positive": "left" if self.positive_left else "right",
            "agreement": round(max(self.left, self.right) / total, 3) if total else None,
            "turns": total,
        }


def vote(events: Sequence[Event], places: CarPoses, first_frame: int) -> SignVote:
    """Returns the vote of a session's JTurns, with angles as in the file."""
    result = SignVote()
    for event in events:
        angle = _angle(event)
        if angle is None or not MIN_CLEAR_TURN <= abs(angle) <= MAX_CLEAR_TURN:
            continue
        turned = _turn_after(places, event.frame // FRAMES_PER_TENTH + first_frame)
        if turned is not None and MIN_CLEAR_TURN <= abs(turned) <= MAX_CLEAR_TURN:
            agrees = (angle > 0) == (turned > 0)
            result += SignVote(left=1) if agrees else SignVote(right=1)
    return result


def _turn_after(places: CarPoses, frame: int) -> float | None:
    """Returns the angle of the car's turn at the next junction [degrees, positive left]; None without one."""
    start = int(np.searchsorted(places.frames, frame))
    end = int(np.searchsorted(places.frames, frame + MAX_TURN_DELAY))
    inside = places.ids["junction_id"][start:] >= 0
    if not inside[: end - start].any():
        return None
    first = start + int(np.argmax(inside))
    outside = ~inside[first - start :]
    if not outside.any():
        return None
    last = first + int(np.argmax(outside))
    return wrap_degrees(float(np.degrees(places.heading[max(first - 1, 0)] - places.heading[last])))


def with_sign(events: Sequence[Event], sign: SignVote) -> list[Event]:
    """Returns the events with positive-left angles of JTurns."""
    if sign.positive_left:
        return list(events)
    return [
        event if (angle := _angle(event)) is None or "road" in event.data else _turned(event, wrap_degrees(-angle))
        for event in events
    ]


def with_roads(
    events: Sequence[Event], roads: dict[int, int], places: CarPoses, first_frame: int, place: SdnMap
) -> tuple[list[Event], int]:
    """Computes the angles of the JTurns that name a road.

    Args:
        events: the events.
        roads: number of the JTurn among the JTurns, and the road.
        places: poses of the car.
        first_frame: frame (10 Hz) at which the session begins.
        place: the town.

    Returns:
        The events, and the number of JTurns with an unknown angle.
    """
    result, number, unknown = [], -1, 0
    for event in events:
        number += _is_turn(event)
        if _is_turn(event) and number in roads:
            frame = event.frame // FRAMES_PER_TENTH + first_frame
            lane = _lane_at(places, frame, place)
            angle = place.turn_angle(lane, roads[number], _junction_after(places, frame))
            unknown += angle is None
            event = _turned(event, angle, road=roads[number])
        result.append(event)
    return result, unknown


def _lane_at(places: CarPoses, frame: int, place: SdnMap) -> int:
    if not len(places.frames):
        return -1
    k = max(int(np.searchsorted(places.frames, frame, side="right")) - 1, 0)
    ids = (int(places.ids["road_id"][k]), int(places.ids["lane_id"][k]))
    return place.locate(float(places.x[k]), float(places.y[k]), *ids).lane


def _junction_after(places: CarPoses, frame: int) -> int | None:
    """Returns the junction that the car enters next, or crosses; None without one in time."""
    start = int(np.searchsorted(places.frames, frame))
    end = int(np.searchsorted(places.frames, frame + MAX_TURN_DELAY))
    junctions = places.ids["junction_id"][start:end]
    inside = np.flatnonzero(junctions >= 0)
    return int(junctions[inside[0]]) if len(inside) else None


def _is_turn(event: Event) -> bool:
    return event.type is EventType.PHYSICAL_ACTION and event.data["action"] == PhysicalAction.J_TURN.label


def _angle(event: Event) -> float | None:
    """Returns the angle of a JTurn; None without one."""
    angle = event.data["angle"] if _is_turn(event) else None
    return angle if isinstance(angle, int | float) else None


def _turned(event: Event, angle: float | None, **more: object) -> Event:
    return replace(event, data={**event.data, "angle": angle, **more})
