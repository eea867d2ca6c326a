"""Record of a driving test: the path of the car, the junctions that it passed, and what the Co-Wizard said."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dorothie_gym.maps.town import Town
from dorothie_gym.ontology import DialogueMove, LandmarkName, ObjectClass
from dorothie_gym.policies.route_progress import lanes_beside
from dorothie_gym.session.spaces import CoWizardAction
from dorothie_gym.support.portable_math import wrap_degrees

STANDING = 0.3
"""Speed below which the car stands [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Moment:
    """State of the car at one decision.

    Attributes:
        time: [s].
        x: position [m].
        y: position [m].
        heading: clockwise [rad].
        speed: [m/s].
        cruise: speed that the car is set to [km/h].
        lane: id of the lane.
        station: distance along it [m].
        lights: whether the head lights are on.
        held: whether something ahead keeps the car from driving on: a red light, another road user, a roadblock.
    """

    time: float
    x: float
    y: float
    heading: float
    speed: float
    cruise: float
    lane: int
    station: float
    lights: bool
    held: bool

    @classmethod
    def of(cls, observations: Mapping[str, Mapping[str, Any]]) -> Moment:
        """Reads the true state of the car from the participant's observation, and the settings from the Co-Wizard's."""
        true, car = observations["participant"], observations["co_wizard"]
        x, y, heading = (float(value) for value in true["pose"])
        return cls(
            time=float(true["time"][0]),
            x=x,
            y=y,
            heading=heading,
            speed=float(true["speed"][0]),
            cruise=float(car["cruise_speed"][0]),
            lane=int(true["lane"]),
            station=float(true["station"][0]),
            lights=bool(true["lights"]),
            held=int(car["hazard"]) != ObjectClass.UNLABELED.value,
        )


@dataclass(frozen=True, kw_only=True)
class Passage:
    """Junction that the car has passed.

    Attributes:
        number: index of the moment at which the car had left it.
        time: time of that moment [s].
        before: lane before it.
        after: lane behind it.
        turned: change of direction [degrees], positive left.
        open: directions of its exits for the car: "left", "right", "straight".
        lights: whether it has traffic lights.
        streets: streets of its exits.
        x: middle [m].
        y: middle [m].
    """

    number: int
    time: float
    before: int
    after: int
    turned: float
    open: frozenset[str]
    lights: bool
    streets: frozenset[int]
    x: float
    y: float

    @property
    def direction(self) -> str:
        """Direction in which the car left it."""
        if abs(self.turned) < 40.0:
            return "straight"
        return "left" if self.turned > 0.0 else "right"


@dataclass(frozen=True, kw_only=True)
class Said:
    """Span that the Co-Wizard said: time [s], move, number of slot values, predicates of its meaning, and words."""

    time: float
    move: DialogueMove
    slots: int
    predicates: tuple[str, ...]
    text: str


@dataclass(kw_only=True)
class DriveLog:
    """Record of a test.

    Attributes:
        town: the map.
        moments: states of the car, one a decision.
        said: spans of the Co-Wizard.
        goals: destinations that it adopted, in order.
        began: time at which the participant began to speak [s].
        told: end of the participant's last utterance [s].
    """

    town: Town
    moments: list[Moment] = field(default_factory=list)
    said: list[Said] = field(default_factory=list)
    goals: list[LandmarkName] = field(default_factory=list)
    began: float = math.inf
    told: float = math.inf

    def note(self, action: CoWizardAction, time: float) -> None:
        """Records what the Co-Wizard does at a decision."""
        if action.speech is not None:
            act, meaning = action.speech.act, action.speech.meaning
            said = Said(
                time=time,
                move=act.move,
                slots=len(act.slots),
                predicates=tuple("limit" if one.get("limit") is True else str(one.predicate) for one in meaning),
                text=action.speech.text,
            )
            self.said.append(said)
        for goal in action.mental.goals if action.mental is not None else ():
            if not self.goals or self.goals[-1] is not goal:
                self.goals.append(goal)

    def since(self, time: float) -> list[Moment]:
        """Returns the moments from a time on [s]."""
        return [moment for moment in self.moments if moment.time >= time]

    def passages(self, since: float) -> list[Passage]:
        """Returns the junctions passed after a time [s] at which there was more than one way, in order."""
        lanes, found, before = self.town.lanes, [], None
        inside = False
        for number, moment in enumerate(self.moments):
            if lanes[moment.lane].in_junction:
                inside = True
                continue
            if before is not None and moment.lane != before and (inside or self._adjoins(before, moment.lane)):
                passage = self._passage(number, before, moment)
                if passage is not None and moment.time > since:
                    found.append(passage)
            before, inside = moment.lane, False
        return found

    def _adjoins(self, before: int, after: int) -> bool:
        """Returns whether a junction between two lanes was crossed between two decisions."""
        return any(way.lane == after and way.junction_id >= 0 for way in self.town.exits(before))

    def _passage(self, number: int, before: int, moment: Moment) -> Passage | None:
        exits = [way for lane in (before, *lanes_beside(self.town, before)) for way in self.town.exits(lane)]
        exits = [way for way in exits if way.junction_id >= 0]
        roads = {self.town.lanes[way.lane].road_id for way in exits}
        if len(roads) < 2:
            return None
        lanes = self.town.lanes
        change = lanes[before].headings[-1] - lanes[moment.lane].heading_at(moment.station)
        middle = np.mean([lanes[way.connector].position(lanes[way.connector].length / 2) for way in exits], axis=0)
        return Passage(
            number=number,
            time=moment.time,
            before=before,
            after=moment.lane,
            turned=wrap_degrees(math.degrees(float(change))),
            open=frozenset(str(way.type) for way in exits),
            lights=self.town.light(before, 0.0) is not None,
            streets=frozenset(lanes[way.lane].street for way in exits),
            x=float(middle[0]),
            y=float(middle[1]),
        )

    def stands(self, since: float) -> list[Moment]:
        """Returns the first moment of every standstill that begins after a time [s] for no hazard."""
        found: list[Moment] = []
        standing = False
        for moment in self.moments:
            stands = moment.speed < STANDING and not moment.held
            if stands and not standing and moment.time >= since:
                found.append(moment)
            standing = stands
        return found


def replies(log: DriveLog, until: float) -> Sequence[Said]:
    """Returns what the Co-Wizard said between the participant's first words and a time [s]."""
    return [said for said in log.said if log.began < said.time <= until]
