"""What is measured of a session that was driven: the numbers from which every closed-loop metric follows."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from dorothie_gym.evaluation.closed_loop.recovery import MetException, met_exceptions
from dorothie_gym.evaluation.closed_loop.talk import TalkRecord, talk_of
from dorothie_gym.evaluation.closed_loop.task import TaskRecord, is_arrival, task_at_end, without_reached
from dorothie_gym.evaluation.closed_loop.ways import TaskWay, driven_length, places_of
from dorothie_gym.ontology import ObjectClass
from dorothie_gym.sessions import FRAME_RATE, EventType, Session
from dorothie_gym.world.town import Town

TIMEOUT: Final = "timeout"
HIT_BY_OTHERS: Final = "hit_by_others"
"""Name of the collisions that are not of the car's own making: they are counted, and cost nothing."""

OUT_OF_TIME: Final = "out of time"
"""Reason of an `End` that cut the session off."""

_RULES: Final = {
    EventType.RED_LIGHT: "red_light",
    EventType.STOP_SIGN: "stop_sign",
    EventType.OFF_ROAD: "off_road",
    EventType.WRONG_WAY: "wrong_way",
}
_TOUCHED: Final = {ObjectClass.PEDESTRIAN: "pedestrian", ObjectClass.VEHICLES: "vehicle"}


@dataclass(frozen=True, kw_only=True)
class SessionRecord:
    """The measures of one session.

    Attributes:
        live: number of live subgoals at the end.
        reached: how many of them were reached.
        success: whether all were, the destination last, without a collision of the car's own making.
        shortest: length of the shortest way through all live subgoals [m]; None where there is none.
        driven: length of the way that was driven [m].
        completion: share of the way that was done, in [0, 1]; None where no way leads to what is left.
        seconds: simulated time.
        decisions: of the agents.
        infractions: how often each kind happened ("pedestrian", "vehicle", "static", "red_light", "stop_sign",
            "timeout", "off_road", "wrong_way", "hit_by_others").
        talk: counts of the dialogue.
        exceptions: those that happened.
    """

    live: int
    reached: int
    success: bool
    shortest: float | None
    driven: float
    completion: float | None
    seconds: float
    decisions: int = 0
    infractions: Mapping[str, int] = field(default_factory=dict)
    talk: TalkRecord = field(default_factory=TalkRecord)
    exceptions: tuple[MetException, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Returns the fields in JSON types."""
        return {
            **{name: getattr(self, name) for name in _PLAIN},
            "infractions": dict(self.infractions),
            "talk": self.talk.to_json(),
            "exceptions": [each.to_json() for each in self.exceptions],
        }

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> SessionRecord:
        """Reads what `to_json` returned; raises `KeyError` or `TypeError` where it is something else."""
        return cls(
            **{name: row[name] for name in _PLAIN},
            infractions=dict(row["infractions"]),
            talk=TalkRecord.from_json(row["talk"]),
            exceptions=tuple(MetException.from_json(each) for each in row["exceptions"]),
        )


_PLAIN: Final = ("live", "reached", "success", "shortest", "driven", "completion", "seconds", "decisions")


def measure(session: Session, town: Town) -> SessionRecord:
    """Returns the measures of a recorded session.

    Args:
        session: one that was played to its end, or as far as it goes.
        town: its map.
    """
    task = task_at_end(session)
    infractions = count_infractions(session)
    own = sum(infractions.get(name, 0) for name in ("pedestrian", "vehicle", "static"))
    start = session.header.departure
    shortest = TaskWay(town, without_reached(task)).shortest(start)
    return SessionRecord(
        live=len(task.live),
        reached=len(task.reached),
        success=task.done and own == 0,
        shortest=None if math.isinf(shortest) else round(shortest, 3),
        driven=round(driven_length(session), 3),
        completion=route_completion(session, town, task),
        seconds=round(session.duration, 3),
        decisions=round(session.duration * session.header.decision_frequency),
        infractions=infractions,
        talk=talk_of(session),
        exceptions=met_exceptions(session, town),
    )


def count_infractions(session: Session) -> dict[str, int]:
    """Returns how often each kind of infraction happened; kinds that did not are left out.

    A collision counts by what was hit: pedestrian, vehicle, or anything else ("static"). One that others caused, while
    the car stood or was run into from behind (`own_fault` of the event), counts as "hit_by_others".
    """
    counts: Counter[str] = Counter()
    for each in session.infractions:
        if each.type is not EventType.COLLISION:
            counts[_RULES[each.type]] += 1
        elif not each.own_fault:
            counts[HIT_BY_OTHERS] += 1
        else:
            counts[_TOUCHED.get(each.other, "static") if each.other is not None else "static"] += 1
    ends = session.of_type(EventType.END)
    counts[TIMEOUT] += sum(event.data.get("reason") == OUT_OF_TIME for event in ends)
    return {name: count for name, count in sorted(counts.items()) if count}


def route_completion(session: Session, town: Town, task: TaskRecord) -> float | None:
    """Returns the share of the way through the live subgoals that was done, in [0, 1].

    1 - (what was left where the car was nearest to the end) / (what there was from the departure), both the router's
    cost in the best order that is allowed. As the leaderboard's it does not fall when the car drives away again: the
    nearest place since the last arrival counts, looked at every two seconds.

    Returns:
        The share; None where no way leads to what is left.
    """
    if task.done:
        return 1.0
    whole = TaskWay(town, without_reached(task)).left(session.header.departure)
    if math.isinf(whole) or whole <= 0.0:
        return None
    way = TaskWay(town, task)
    last = max((event.frame for event in session.events if is_arrival(event)), default=0)
    end = round(session.duration * FRAME_RATE)
    places = places_of(session, town, [*range(last, end, 2 * FRAME_RATE), end]) or [session.header.departure]
    left = min(way.left(place) for place in places)
    return None if math.isinf(left) else round(min(max(1.0 - left / whole, 0.0), 1.0), 6)
