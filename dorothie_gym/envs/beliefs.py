"""What the Co-Wizard said it believes: its goals, and guesses of where hidden landmarks are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.envs.gazetteer import Gazetteer
from dorothie_gym.envs.place_filter import PlaceEstimate, about, refined
from dorothie_gym.envs.scenario import Scenario
from dorothie_gym.ontology import DialogueAct, DialogueMove, LandmarkName, Role, Slot, StreetName
from dorothie_gym.world.car.driver import GoalAhead
from dorothie_gym.world.kernel.seeing import RANGE_SCALE
from dorothie_gym.world.town import Town
from dorothie_gym.world.town.model import Array

MARK = 20.0
"""How far off a mark is that is made from afar, along each axis [m]: a house or two."""

SIGHTING = 5.0
"""The same of a place that is in sight [m]: half a house; what camera and pose are off comes on top."""

STREET_OFFSET = 15.0
"""How far off a street's line a place on it stands [m]: a building behind the pavement."""

BESIDE = 30.0
"""How far from a landmark a place beside it stands, along each axis [m]: a house or two."""

AT_CORNER = 20.0
"""How far from a junction's middle a place at its corner stands, along each axis [m]."""

STATEMENTS = frozenset(
    {DialogueMove.EXPLAIN, DialogueMove.CLARIFY, DialogueMove.REPLY_W, DialogueMove.INSTRUCT, DialogueMove.CONFIRM}
)
"""Moves that say how things are, or where to go."""

_NOBODY = frozenset({LandmarkName.UNKNOWN, LandmarkName.QUERIED})


@dataclass(frozen=True)
class Guess:
    """A place on a lane [m] that the Co-Wizard marked as that of a hidden landmark."""

    lane: int
    station: float


class Beliefs:
    """Goals and guesses of the Co-Wizard in a session.

    Attributes:
        goals: landmarks that the Co-Wizard is heading for.
        guesses: places it marked last, by the landmark's name.
        places: where hidden landmarks are by all that was marked and said, by name.
        version: counts the changes of `places`.
    """

    def __init__(self, town: Town, scenario: Scenario) -> None:
        self._town, self._names = town, Gazetteer(town, scenario)
        self.goals: tuple[LandmarkName, ...] = ()
        self.guesses: dict[LandmarkName, Guess] = {}
        self.places: dict[LandmarkName, PlaceEstimate] = {}
        self.version = 0
        self._topic: LandmarkName | None = None  # the hidden landmark that was last spoken of
        self._said: dict[LandmarkName, set[frozenset[LandmarkName | StreetName]]] = {}

    def guess(
        self, name: LandmarkName, lane: int, station: float, *, pose: Array, covariance: Array, sight: float
    ) -> None:  # fmt: skip
        """Takes in a mark on the map.

        Args:
            name: whose place it is.
            lane: where it is: the lane,
            station: and the distance along it [m].
            pose: where the car believes itself to be (x, y, heading) [m, m, rad].
            covariance: how surely (3, 3).
            sight: how far it sees [m]; a mark within it is of what is seen, and as exact as that.
        """
        place = self._town.lanes[lane].position(station)
        distance = float(np.hypot(*(place - pose[:2])))
        error = (SIGHTING**2 + (distance**2 / RANGE_SCALE) ** 2) * np.eye(2) + covariance[:2, :2]
        if distance > sight:
            error = MARK**2 * np.eye(2)
        last = self.guesses.get(name)
        self.guesses[name] = Guess(lane, station)
        if last != self.guesses[name]:  # the same mark again says nothing new
            self.places[name] = refined(self.places.get(name), PlaceEstimate.of(place, error), drift=MARK)
            self.version += 1

    def hear(self, speaker: Role, acts: Sequence[DialogueAct]) -> None:
        """Takes in what was said of places of hidden landmarks."""
        for act in acts:
            named = [name for name in act.ordered if isinstance(name, LandmarkName) and name not in _NOBODY]
            known = [name for name in named if name in self._names.landmarks]
            hidden = [name for name in named if name not in self._names.landmarks]
            if len(hidden) == 1:
                self._topic = hidden[0]
            elif known and act.move is DialogueMove.INSTRUCT:
                self._topic = None  # a task with a place that is on the map
            if speaker is Role.PARTICIPANT and act.move in STATEMENTS and not act.values(Slot.ACTION):
                self._locate(act, known)

    def _locate(self, act: DialogueAct, known: Sequence[LandmarkName]) -> None:
        """Takes in where the landmark in question is said to be; the same said again is nothing new."""
        streets = [value for value in act.ordered if isinstance(value, StreetName)]
        what: frozenset[LandmarkName | StreetName] = frozenset((*known, *streets))
        if self._topic is None or not what or what in self._said.setdefault(self._topic, set()):
            return
        self._said[self._topic].add(what)
        estimate = self.places.get(self._topic)
        corners = self._names.corners(streets) if len(streets) > 1 else np.zeros((0, 2))
        statements = [(self._names.street(street), STREET_OFFSET) for street in streets]
        if len(corners):
            statements = [(corners, AT_CORNER)]
        statements += [(self._names.landmarks[name], BESIDE) for name in known]
        for points, sigma in statements:
            if len(points):
                estimate = about(estimate, points, sigma)
        if estimate is not None:
            self.places[self._topic] = estimate
            self.version += 1

    def goal_places(self, known: dict[LandmarkName, list[GoalAhead]]) -> list[GoalAhead]:
        """Places where the car is expected to stop.

        Args:
            known: places of the landmarks that the Co-Wizard knows, by name.
        """
        places: list[GoalAhead] = []
        for name in self.goals:
            guess = self.guesses.get(name)
            places.extend(known.get(name, []))
            if guess is not None:
                places.append(GoalAhead(lane=guess.lane, station=guess.station))
        return places
