"""What the Co-Wizard said it believes: its goals, and guesses of where hidden landmarks are."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dorothie_gym.ontology import LandmarkName
from dorothie_gym.world.car.driver import GoalAhead
from dorothie_gym.world.town import Town

GUESS_SIGMA = 20.0
"""How far off a first guess of a place is [m]: about a house or two."""

NEW_GUESS = 60.0
"""A guess farther than this from the last one is a new idea, not a refinement [m]."""


@dataclass(frozen=True)
class Guess:
    """Where a hidden landmark is believed to be: the last place named, and the filtered estimate (x, y) [m]."""

    lane: int
    station: float
    mean: tuple[float, float]
    variance: tuple[float, float]


class Beliefs:
    """Goals and guesses of the Co-Wizard in a session.

    Attributes:
        goals: landmarks that the Co-Wizard is heading for.
        guesses: of hidden landmarks, by name.
    """

    def __init__(self, town: Town) -> None:
        self._town = town
        self.goals: tuple[LandmarkName, ...] = ()
        self.guesses: dict[LandmarkName, Guess] = {}

    def guess(self, name: LandmarkName, lane: int, station: float) -> None:
        """Takes in a guess of a landmark's place; guesses close to each other refine the estimate (a Kalman filter)."""
        # imported here: filterpy brings matplotlib along, which is slow to import
        from filterpy.kalman import KalmanFilter

        place = self._town.lanes[lane].position(station)
        before = self.guesses.get(name)
        if before is None or math.hypot(*(place - np.array(before.mean))) > NEW_GUESS:
            mean, variance = (float(place[0]), float(place[1])), (GUESS_SIGMA**2, GUESS_SIGMA**2)
        else:
            refine = KalmanFilter(dim_x=2, dim_z=2)
            refine.x = np.array(before.mean)
            refine.P, refine.R, refine.H = np.diag(before.variance), np.eye(2) * GUESS_SIGMA**2, np.eye(2)
            refine.update(place)
            mean = (float(refine.x[0]), float(refine.x[1]))
            variance = (float(refine.P[0, 0]), float(refine.P[1, 1]))
        self.guesses[name] = Guess(lane, station, mean, variance)

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
