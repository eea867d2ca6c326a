"""Belief tracker: goals of the Co-Wizard, and estimates of the places of hidden landmarks."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.ontology.actions import MentalAction
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import LandmarkName, Slot, StreetName
from dorothie_gym.sim.ego.ego_controller import GoalAhead
from dorothie_gym.sim.sensing.perception import RANGE_SCALE
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.session.session_log import Outcome
    from dorothie_gym.session.spaces.actions import Mental
    from dorothie_gym.sim.sensing.localizer import Localizer

GATE = 13.82
"""Squared Mahalanobis distance that one in a thousand true statements exceeds (chi-square, 2 degrees of freedom)."""


@shared
@dataclass(frozen=True)
class PlaceEstimate:
    """Normal distribution over places.

    Attributes:
        mean: (x, y) [m].
        covariance: rows (xx, xy), (xy, yy) [m^2].
    """

    mean: tuple[float, float]
    covariance: tuple[tuple[float, float], tuple[float, float]]

    @classmethod
    def of(cls, mean: Array, covariance: Array) -> PlaceEstimate:
        """Returns an estimate from arrays (2,) and (2, 2); the covariance is made symmetric."""
        (xx, xy), (yx, yy) = covariance.tolist()
        return cls((float(mean[0]), float(mean[1])), ((xx, (xy + yx) / 2), ((xy + yx) / 2, yy)))

    def distance(self, x: float, y: float) -> float:
        """Returns the squared Mahalanobis distance of a place [m] from the mean."""
        offset = np.array([[x, y]]) - self.mean
        return float((pn.matmul(offset, pn.inverse(np.array(self.covariance))) * offset).sum())


def near(x: float, y: float, sigma: float) -> PlaceEstimate:
    """Returns an estimate around a place [m] with the standard deviation `sigma` along each axis [m]."""
    return PlaceEstimate((x, y), ((sigma * sigma, 0.0), (0.0, sigma * sigma)))


def refined(before: PlaceEstimate | None, mark: PlaceEstimate, drift: float = 0.0) -> PlaceEstimate:
    """Returns the estimate after a mark on the map (Kalman update).

    Args:
        before: previous estimate; None if nothing is known.
        mark: place of the mark and its covariance.
        drift: process noise, as the standard deviation along each axis [m]: a mark that moves corrects an earlier one.
    """
    if before is None:
        return mark
    # Imported here: filterpy imports matplotlib, which is slow.
    from filterpy.kalman import KalmanFilter

    # Arrays of Python's numbers: products of arrays of float64 are rounded differently by different processors (BLAS).
    refine = KalmanFilter(dim_x=2, dim_z=2)
    refine.inv = pn.inverse
    refine.x, refine.P = np.array(before.mean, object), np.array(before.covariance, object)
    refine.F, refine.H = np.eye(2, dtype=object), np.eye(2, dtype=object)
    refine.Q, refine.R = drift * drift * np.eye(2, dtype=object), np.array(mark.covariance, object)
    refine.predict()
    refine.update(np.array(mark.mean, object))
    if float((refine.y[:, None] * refine.SI * refine.y).sum()) > GATE:
        return mark
    return PlaceEstimate.of(refine.x, refine.P)


def about(before: PlaceEstimate | None, points: Array, sigma: float) -> PlaceEstimate:
    """Returns the estimate after the statement that the place is near one of the given points.

    Each point updates the estimate to a Gaussian, weighted by the likelihood of the point under the estimate. The
    mixture is replaced by one Gaussian of the same mean and covariance (moment matching).

    Args:
        before: previous estimate; None if nothing is known.
        points: equally likely points (n, 2) [m].
        sigma: standard deviation of the place around its point, along each axis [m].

    Raises:
        ValueError: there are no points.
    """
    points = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    if not len(points):
        raise ValueError("a place about one of some points needs at least one point")
    offset, noise = points.mean(axis=0) - points, sigma * sigma * np.eye(2)
    alone = PlaceEstimate.of(points.mean(axis=0), pn.matmul(offset.T, offset) / len(points) + noise)
    if before is None:
        return alone
    mean, covariance = np.array(before.mean), np.array(before.covariance)
    spread = pn.inverse(covariance + noise)
    away = points - mean
    squared = (pn.matmul(away, spread) * away).sum(axis=1)
    if squared.min() > GATE:
        return alone
    weights = pn.exp(-0.5 * (squared - squared.min()))
    weights /= weights.sum()
    gain = pn.matmul(covariance, spread)
    means = mean + pn.matmul(away, gain.T)  # (n, 2)
    together = (weights[:, None] * means).sum(axis=0)
    centred = means - together
    spread_out = pn.matmul((centred * weights[:, None]).T, centred)
    return PlaceEstimate.of(together, spread_out + pn.matmul(np.eye(2) - gain, covariance))


# --- Names on the map -------------------------------------------------------------------------------------------------

STREET_POINT_SPACING = 10.0
"""Distance between the sampled points of a street [m]."""


@shared
class MapNames:
    """Positions of the named streets and landmarks on the Co-Wizard's map.

    Attributes:
        landmarks: positions of the landmarks that are not hidden, by name (n, 2) [m].
    """

    def __init__(self, town: Town, scenario: Scenario) -> None:
        self._town, self._names = town, scenario.street_names
        places: dict[LandmarkName, list[tuple[float, float]]] = {}
        for landmark in scenario.storyboard.landmarks:
            if not landmark.hidden:
                places.setdefault(landmark.name, []).append(landmark.position)
        self.landmarks = {name: np.array(found) for name, found in places.items()}

    def street(self, name: StreetName) -> Array:
        """Returns points on the streets with a name, every 10 m of each lane (n, 2) [m]; (0, 2) for an unknown name."""
        points = [
            lane.position(float(station))
            for lane in self._town.lanes
            if lane.street in self._streets(name) and not lane.in_junction
            for station in np.arange(min(STREET_POINT_SPACING, lane.length) / 2, lane.length, STREET_POINT_SPACING)
        ]
        return np.array(points).reshape(-1, 2)

    def corners(self, names: Sequence[StreetName]) -> Array:
        """Returns the centres of the junctions where streets of all these names meet (n, 2) [m]."""
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
        """Streets that lead to or from each junction, in the order of the junctions."""
        town = self._town
        return tuple(
            frozenset(
                town.lanes[lane].street
                for connector in junction.connectors
                for lane in (*town.predecessors(connector), *(link.target for link in town.successors(connector)))
            )
            for junction in town.junctions
        )


def goals_on_map(scenario: Scenario, names: Sequence[LandmarkName], recognised: Sequence[int] = ()) -> list[GoalAhead]:
    """Returns the places of goals on the Co-Wizard's map, in the order of the names.

    Args:
        scenario: scenario of the session.
        names: the goals.
        recognised: indices of hidden landmarks that the camera has shown.
    """
    return [
        GoalAhead(lane=landmark.lane, station=landmark.station)
        for name in names
        for landmark in scenario.storyboard.landmarks
        if landmark.name is name and (not landmark.hidden or landmark.index in recognised)
    ]


# --- Belief tracker ---------------------------------------------------------------------------------------------------

MARK = 20.0
"""Standard deviation of a mark beyond the range of sight, along each axis [m]: the width of one or two houses."""

SIGHTING = 5.0
"""Standard deviation of a mark in sight [m]: half a house; errors of camera and pose are added."""

STREET_OFFSET = 15.0
"""Standard deviation of a place from the centre line of its street [m]: a building behind the pavement."""

BESIDE_LANDMARK = 30.0
"""Standard deviation of a place beside a landmark, along each axis [m]: the width of one or two houses."""

AT_CORNER = 20.0
"""Standard deviation of a place at a corner from the centre of the junction, along each axis [m]."""

STATEMENTS = frozenset(
    {DialogueMove.EXPLAIN, DialogueMove.CLARIFY, DialogueMove.REPLY_W, DialogueMove.INSTRUCT, DialogueMove.CONFIRM}
)
"""Moves that make a statement or give an instruction."""

_NO_LANDMARK = frozenset({LandmarkName.UNKNOWN, LandmarkName.QUERIED})


@shared
@dataclass(frozen=True)
class LandmarkGuess:
    """Place on a lane that the Co-Wizard marked as the place of a hidden landmark.

    Attributes:
        lane: id of the lane.
        station: distance along the lane [m].
    """

    lane: int
    station: float


class BeliefTracker:
    """Tracks the goals of the Co-Wizard and the places of hidden landmarks.

    Marks (mental actions of the Co-Wizard) and statements of the participant update one estimate for each landmark.

    Attributes:
        goals: landmarks that the Co-Wizard drives to.
        guesses: last marked places, by name of the landmark.
        places: estimated places of hidden landmarks after all marks and statements, by name.
        version: number of changes of `places`.
        recognised: indices of the landmarks that the camera has shown, with `EnvConfig.perception` "camera".
    """

    def __init__(self, town: Town, scenario: Scenario) -> None:
        self._town, self._names = town, MapNames(town, scenario)
        self.goals: tuple[LandmarkName, ...] = ()
        self.guesses: dict[LandmarkName, LandmarkGuess] = {}
        self.places: dict[LandmarkName, PlaceEstimate] = {}
        self.version = 0
        self.recognised: Sequence[int] = ()
        self._topic: LandmarkName | None = None  # the hidden landmark mentioned last
        self._said: dict[LandmarkName, set[frozenset[LandmarkName | StreetName]]] = {}
        self._scenario = scenario

    def update(self, mental: Mental, localizer: Localizer, sight: float) -> Outcome:
        """Applies a belief update of the Co-Wizard.

        Args:
            mental: the update.
            localizer: pose estimate of the ego.
            sight: range of sight [m]; a mark within it is as exact as the perception.

        Returns:
            Event data of the update, or the reason of a refusal.
        """
        if mental.action is MentalAction.PLAN_UPDATE:
            junctions = self._town.junctions
            unknown = [k for k in mental.plan if k >= len(junctions)]
            if unknown:
                return f"the town has no junction number {unknown[0]}"
            return {"junctions": [junctions[k].id for k in mental.plan]}
        if mental.action is MentalAction.GOAL_UPDATE:
            self.goals = mental.goals
            return {"landmarks": [name.label for name in mental.goals]}
        if mental.action is MentalAction.STATUS_UPDATE:
            return {"landmark": mental.landmark.label, "status": mental.status.label}
        if mental.action is MentalAction.KNOWLEDGE_UPDATE:
            lane, metres = mental.place.lane, float(mental.place.metres)
            if lane >= len(self._town.lanes) or metres > self._town.lanes[lane].length + 1.0:
                return "the guessed place is not on a lane of the town"
            pose, covariance = localizer.pose, localizer.covariance
            self.guess(mental.landmark, lane, metres, pose=pose, covariance=covariance, sight=sight)
            x, y = self._town.lanes[lane].position(metres)
            return {"landmark": mental.landmark.label, "x": round(float(x), 3), "y": round(float(y), 3)}
        return {}

    def guess(
        self, name: LandmarkName, lane: int, station: float, *, pose: Array, covariance: Array, sight: float
    ) -> None:
        """Updates the estimate of a landmark with a mark on the map.

        Args:
            name: the landmark.
            lane: lane of the mark.
            station: distance of the mark along the lane [m].
            pose: estimated pose of the ego (x, y, heading) [m, m, rad].
            covariance: covariance of the pose (3, 3).
            sight: range of sight [m]; a mark within it is as exact as the perception.
        """
        place = self._town.lanes[lane].position(station)
        distance = pm.hypot(*(place - pose[:2]))
        blur = distance * distance / RANGE_SCALE
        error = (SIGHTING * SIGHTING + blur * blur) * np.eye(2) + covariance[:2, :2]
        if distance > sight:
            error = MARK * MARK * np.eye(2)
        last = self.guesses.get(name)
        self.guesses[name] = LandmarkGuess(lane, station)
        if last != self.guesses[name]:  # a repeated mark adds no information
            self.places[name] = refined(self.places.get(name), PlaceEstimate.of(place, error), drift=MARK)
            self.version += 1

    def hear(self, speaker: Role, acts: Sequence[DialogueAct]) -> None:
        """Updates the estimates with the acts of an utterance about places of hidden landmarks."""
        for act in acts:
            named = [name for name in act.ordered if isinstance(name, LandmarkName) and name not in _NO_LANDMARK]
            known = [name for name in named if name in self._names.landmarks]
            hidden = [name for name in named if name not in self._names.landmarks]
            if len(hidden) == 1:
                self._topic = hidden[0]
            elif known and act.move is DialogueMove.INSTRUCT:
                self._topic = None  # an instruction about a place on the map
            if speaker is Role.PARTICIPANT and act.move in STATEMENTS and not act.values(Slot.ACTION):
                self._locate(act, known)

    def _locate(self, act: DialogueAct, known: Sequence[LandmarkName]) -> None:
        """Updates the place of the current topic with a statement; a repeated statement adds no information."""
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
        statements += [(self._names.landmarks[name], BESIDE_LANDMARK) for name in known]
        for points, sigma in statements:
            if len(points):
                estimate = about(estimate, points, sigma)
        if estimate is not None:
            self.places[self._topic] = estimate
            self.version += 1

    def goal_places(self) -> list[GoalAhead]:
        """Returns the places where the ego is expected to stop: of the goals on the map, and of marked ones."""
        places: list[GoalAhead] = []
        for name in self.goals:
            guess = self.guesses.get(name)
            places.extend(goals_on_map(self._scenario, (name,), self.recognised))
            if guess is not None:
                places.append(GoalAhead(lane=guess.lane, station=guess.station))
        return places
