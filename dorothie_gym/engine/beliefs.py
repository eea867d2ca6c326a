"""What the Co-Wizard said it believes: its goals, and guesses of where hidden landmarks are."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.engine.scenario import Scenario
from dorothie_gym.maps import Town
from dorothie_gym.maps.model import Array
from dorothie_gym.ontology import DialogueAct, DialogueMove, LandmarkName, Role, Slot, StreetName
from dorothie_gym.sim.ego.ego_controller import GoalAhead
from dorothie_gym.sim.sensing.seeing import RANGE_SCALE

GATE = 13.82
"""Squared Mahalanobis distance that one in a thousand true statements exceeds (chi-square, 2 degrees of freedom)."""


@dataclass(frozen=True)
class PlaceEstimate:
    """A normal distribution over places.

    Attributes:
        mean: (x, y) [m].
        covariance: rows (xx, xy), (xy, yy) [m^2].
    """

    mean: tuple[float, float]
    covariance: tuple[tuple[float, float], tuple[float, float]]

    @classmethod
    def of(cls, mean: Array, covariance: Array) -> PlaceEstimate:
        """From arrays (2,) and (2, 2)."""
        (xx, xy), (yx, yy) = covariance.tolist()
        return cls((float(mean[0]), float(mean[1])), ((xx, (xy + yx) / 2), ((xy + yx) / 2, yy)))

    def distance(self, x: float, y: float) -> float:
        """Squared Mahalanobis distance of a place [m] from the mean."""
        offset = np.array([x, y]) - self.mean
        return float(offset @ np.linalg.solve(np.array(self.covariance), offset))


def near(x: float, y: float, sigma: float) -> PlaceEstimate:
    """Somewhere about a place [m], `sigma` off along each axis [m]."""
    return PlaceEstimate((x, y), ((sigma**2, 0.0), (0.0, sigma**2)))


def refined(before: PlaceEstimate | None, mark: PlaceEstimate, drift: float = 0.0) -> PlaceEstimate:
    """The estimate after a mark on the map.

    Args:
        before: the estimate so far; None if nothing is known.
        mark: place of the mark, and how exact it is.
        drift: by how much the estimate may have been off besides, along each axis [m]: a mark is moved for a reason.
    """
    if before is None:
        return mark
    # imported here: filterpy brings matplotlib along, which is slow to import
    from filterpy.kalman import KalmanFilter

    refine = KalmanFilter(dim_x=2, dim_z=2)
    refine.x, refine.P = np.array(before.mean), np.array(before.covariance)
    refine.F, refine.H = np.eye(2), np.eye(2)
    refine.Q, refine.R = drift**2 * np.eye(2), np.array(mark.covariance)
    refine.predict()
    refine.update(np.array(mark.mean))
    if float(refine.y @ refine.SI @ refine.y) > GATE:
        return mark
    return PlaceEstimate.of(refine.x, refine.P)


def about(before: PlaceEstimate | None, points: Array, sigma: float) -> PlaceEstimate:
    """The estimate after a statement that the place is about one of some points.

    Each point makes another Gaussian of the estimate, as likely as the point is from it; together they are replaced by
    one of the same mean and covariance.

    Args:
        before: the estimate so far; None if nothing is known.
        points: any of them as likely as the others (n, 2) [m].
        sigma: how far off it the place is, along each axis [m].

    Raises:
        ValueError: there are no points.
    """
    points = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    if not len(points):
        raise ValueError("a place about one of some points needs at least one point")
    offset = points.mean(axis=0) - points
    alone = PlaceEstimate.of(points.mean(axis=0), offset.T @ offset / len(points) + sigma**2 * np.eye(2))
    if before is None:
        return alone
    mean, covariance = np.array(before.mean), np.array(before.covariance)
    spread = np.linalg.inv(covariance + sigma**2 * np.eye(2))
    away = points - mean
    squared = np.einsum("ij,jk,ik->i", away, spread, away)
    if squared.min() > GATE:
        return alone
    weights = np.exp(-0.5 * (squared - squared.min()))
    weights /= weights.sum()
    gain = covariance @ spread
    means = mean + away @ gain.T  # (n, 2)
    together = weights @ means
    centred = means - together
    return PlaceEstimate.of(together, (centred * weights[:, None]).T @ centred + (np.eye(2) - gain) @ covariance)


# --- Names on the map: points of a street, of a landmark that everybody knows, and of the corners of two  ------------

SPACING = 10.0
"""Distance between the points of a street [m]."""


class Gazetteer:
    """Places that names stand for, as far as the Co-Wizard's map has them.

    Attributes:
        landmarks: places of the landmarks that are not hidden, by name (n, 2) [m].
    """

    def __init__(self, town: Town, scenario: Scenario) -> None:
        self._town, self._names = town, scenario.street_names
        places: dict[LandmarkName, list[tuple[float, float]]] = {}
        for landmark in scenario.storyboard.landmarks:
            if not landmark.hidden:
                places.setdefault(landmark.name, []).append(landmark.position)
        self.landmarks = {name: np.array(found) for name, found in places.items()}

    def street(self, name: StreetName) -> Array:
        """Points of the streets of a name, every 10 m of each lane (n, 2) [m]; none if no street has it."""
        points = [
            lane.position(float(station))
            for lane in self._town.lanes
            if lane.street in self._streets(name) and not lane.in_junction
            for station in np.arange(min(SPACING, lane.length) / 2, lane.length, SPACING)
        ]
        return np.array(points).reshape(-1, 2)

    def corners(self, names: Sequence[StreetName]) -> Array:
        """Middles of the junctions where streets of all these names meet (n, 2) [m]."""
        wanted = [self._streets(name) for name in names]
        middles = [
            junction.position
            for junction, streets in zip(self._town.junctions, self._meeting, strict=True)
            if all(streets & each for each in wanted)
        ]
        return np.array(middles).reshape(-1, 2)

    def _streets(self, name: StreetName) -> frozenset[int]:
        if name in (StreetName.UNKNOWN, StreetName.QUERIED):
            return frozenset()
        return frozenset(k for k, other in enumerate(self._names) if other is name)

    @functools.cached_property
    def _meeting(self) -> tuple[frozenset[int], ...]:
        """Streets that lead to or from each junction, in their order."""
        town = self._town
        return tuple(
            frozenset(
                town.lanes[lane].street
                for connector in junction.connectors
                for lane in (*town.predecessors(connector), *(link.target for link in town.successors(connector)))
            )
            for junction in town.junctions
        )


# --- What the Co-Wizard said it believes: its goals, and guesses of where hidden landmarks are -----------------------

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
