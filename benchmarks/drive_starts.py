"""Starts of driving tests: places of a town where the needs of a test hold and its plan can be driven."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from dorothie_gym.dialogue import Direction
from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.maps.routing import Place
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology import LandmarkName, StreetName
from dorothie_gym.policies.road_ahead import Crossing, RoadAhead

SEEDS: Final = 80
"""Number of sessions that are tried for a start."""

FIRST_POINT: Final = 75.0
"""Least distance to the first place that matters [m]: the car drives on while it listens."""

FARTHEST: Final = 500.0
"""Largest distance to a landmark or street ahead [m]."""

_COMMON: Final = frozenset({LandmarkName.HOUSE, LandmarkName.PERSON, LandmarkName.UNKNOWN, LandmarkName.QUERIED})
_CORNER: Final = 60.0  # largest distance between a landmark and "its" junction [m]
_FEWEST_ON_ROAD: Final = frozenset({"turn", "straight", "stop", "speed", "u_turn"})


@dataclass(frozen=True, kw_only=True)
class Start:
    """Start of a test.

    Attributes:
        seed: seed of the session.
        labels: labels of the names, by placeholder.
        words: names as they are spoken, by placeholder.
        landmarks: positions of the landmarks on the map of the Co-Wizard [m].
        streets: indices of the streets by name.
    """

    seed: int
    labels: Mapping[str, str]
    words: Mapping[str, str]
    landmarks: Mapping[LandmarkName, tuple[float, float]]
    streets: Mapping[StreetName, frozenset[int]]


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """What lies ahead of a start: the road, and the known places."""

    town: Town
    here: Place
    landmarks: Mapping[LandmarkName, tuple[float, float]]
    streets: Mapping[StreetName, frozenset[int]]

    @property
    def road(self) -> RoadAhead:
        """Road straight ahead."""
        return RoadAhead.straight_on(self.town, self.here)

    def ahead(self) -> list[LandmarkName]:
        """Returns the landmarks on the road ahead, the nearest first."""
        road = self.road
        found = [(road.distance_to(x, y), name.label, name) for name, (x, y) in self.landmarks.items()]
        return [name for far, _, name in sorted(row for row in found if row[0] is not None and _is_ahead(row[0]))]

    def crossing_streets(self) -> list[StreetName]:
        """Returns the streets that lead off the road ahead, the nearest first."""
        road, found = self.road, []
        here = self.town.lanes[self.here[0]].street
        for crossing in road.crossings:
            if not _is_ahead(crossing.distance):
                continue
            lanes = {self.town.lanes[way.lane].street for way in crossing.exits} - {here}
            found += [name for name, indices in self.streets.items() if indices & lanes and here not in indices]
        return list(dict.fromkeys(found))


def _is_ahead(distance: float | None) -> bool:
    return distance is not None and FIRST_POINT <= distance <= FARTHEST


def find_start(
    env: DuoWizardEnv, needs: Mapping[str, Any], plan: Sequence[Mapping[str, Any]], texts: Sequence[str]
) -> Start | None:
    """Returns the first session of a town in which the needs of a test hold, with names for its placeholders.

    Args:
        env: environment of the town; it is reset.
        needs: numbers of junctions and lights ahead.
        plan: expected steps with placeholders.
        texts: utterances with placeholders.
    """
    wanted = sorted(
        {
            name
            for name in ("landmark", "landmark2", "street", "street2")
            if any(f"{{{name}}}" in text for text in texts)
        }
    )
    for seed in range(SEEDS):
        observations, _ = env.reset(seed=seed)
        around = _surroundings(env, observations)
        road = around.road
        crossings = [one for one in road.crossings if one.distance >= FIRST_POINT]
        enough = len(crossings) >= int(needs["junctions"]) and len(crossings) == len(road.crossings)
        lights = sum(one.lights for one in crossings) >= int(needs["lights"])
        if not enough or not lights or env.town.lanes[around.here[0]].in_junction:
            continue
        for names in _namings(around, wanted, plan):
            if _is_drivable(around, plan, names):
                return _start(seed, around, names)
    return None


def _surroundings(env: DuoWizardEnv, observations: Mapping[str, Mapping[str, Any]]) -> Surroundings:
    true = observations["participant"]
    story = env.scenario.storyboard
    names = [mark.name for mark in story.landmarks]
    marks = {
        mark.name: (float(mark.position[0]), float(mark.position[1]))
        for mark in story.landmarks
        if not mark.hidden and mark.name not in _COMMON and names.count(mark.name) == 1
    }
    streets: dict[StreetName, set[int]] = {}
    for index, name in enumerate(env.scenario.street_names):
        streets.setdefault(name, set()).add(index)
    streets.pop(StreetName.UNKNOWN, None)
    return Surroundings(
        town=env.town,
        here=(int(true["lane"]), float(true["station"][0])),
        landmarks=marks,
        streets={name: frozenset(indices) for name, indices in streets.items()},
    )


def _namings(
    around: Surroundings, wanted: Sequence[str], plan: Sequence[Mapping[str, Any]]
) -> Iterator[dict[str, LandmarkName | StreetName]]:
    """Yields values for the placeholders; landmarks of conditions lie on the road ahead, those to visit anywhere."""
    on_road = any(step["action"] in _FEWEST_ON_ROAD and "condition" in step for step in plan)
    anywhere = sorted(around.landmarks, key=lambda name: name.value)
    marks = around.ahead() if on_road else anywhere
    choices: list[list[LandmarkName | StreetName]] = []
    for name in wanted:
        found: Sequence[LandmarkName | StreetName]
        found = around.crossing_streets() if name.startswith("street") else marks if name == "landmark" else anywhere
        choices.append([*found])
    for values in itertools.product(*choices):
        if len(set(values)) == len(values):
            yield dict(zip(wanted, values, strict=True))


def _start(seed: int, around: Surroundings, names: Mapping[str, LandmarkName | StreetName]) -> Start:
    words = {name: load_lexicon().forms(value, "say")[0].removeprefix("the ") for name, value in names.items()}
    return Start(
        seed=seed,
        labels={name: value.label for name, value in names.items()},
        words=words,
        landmarks=around.landmarks,
        streets=around.streets,
    )


# --- can the plan be driven? ------------------------------------------------------------------------------------------


def _is_drivable(
    around: Surroundings, plan: Sequence[Mapping[str, Any]], names: Mapping[str, LandmarkName | StreetName]
) -> bool:
    """Returns whether the map has the turns of a plan, one behind the other."""
    here: Place | None = around.here
    for number, step in enumerate(plan):
        if here is None:
            return True
        road = RoadAhead.straight_on(around.town, here)
        if step["action"] == "turn":
            crossing = _turn_at(around, road, step, names)
            if crossing is None or (number == 0 and crossing.distance < FIRST_POINT):
                return False
            here = _behind(crossing, str(step.get("direction", "")))
        elif step["action"] == "straight" and "condition" not in step:
            count = int(step.get("ordinal", 1))
            passed = [one for one in road.crossings[:count] if one.leads(Direction.STRAIGHT)]
            if len(passed) < count:
                return False
            here = road.place_at(road.junction_lanes(passed[-1]) + 1.0)
        elif step["action"] in ("visit", "u_turn", "follow"):
            return True
        elif step["action"] == "stop" and not _is_stop_ahead(around, road, step, names):
            return False
    return True


def _is_stop_ahead(
    around: Surroundings, road: RoadAhead, step: Mapping[str, Any], names: Mapping[str, LandmarkName | StreetName]
) -> bool:
    place = step.get("condition", {}).get("place", {})
    if "landmark" not in place:
        return True
    name = names[place["landmark"].strip("{}")]
    distance = road.distance_to(*around.landmarks[name]) if isinstance(name, LandmarkName) else None
    return distance is not None and distance > 25.0


def _turn_at(
    around: Surroundings, road: RoadAhead, step: Mapping[str, Any], names: Mapping[str, LandmarkName | StreetName]
) -> Crossing | None:
    """Returns the junction of a turn; None if the road ahead has none that fits."""
    side = step.get("direction")
    fitting = [one for one in road.crossings if side is None or one.leads(Direction(side))]
    condition, number = step.get("condition"), int(step.get("ordinal", 1)) - 1
    if "distance" in step:
        near = [one for one in fitting if abs(one.distance - 40.0 - float(step["distance"])) < 50.0]
        return near[0] if near else None
    if condition is None or "reference" in condition["place"]:
        return fitting[number] if number < len(fitting) else None
    place, relation = condition["place"], condition["relation"]
    if "landmark" in place:
        name = names[place["landmark"].strip("{}")]
        distance = road.distance_to(*around.landmarks[name]) if isinstance(name, LandmarkName) else None
        if distance is None:
            return None
        if relation == "before":
            earlier = [one for one in fitting if 20.0 < distance - one.distance < 120.0]
            return earlier[-1] if earlier else None
        if relation in ("after", "past") or "ordinal" in step:
            later = [one for one in fitting if one.distance > distance + 10.0]
            return later[number] if number < len(later) else None
        near = [one for one in fitting if abs(one.distance + 12.0 - distance) < _CORNER]
        return near[0] if near else None
    if "street" in place:
        street = names[place["street"].strip("{}")]
        named = around.streets[street] if isinstance(street, StreetName) else frozenset()
        onto = [one for one in road.crossings if any(around.town.lanes[way.lane].street in named for way in one.exits)]
        return onto[0] if onto and (side is None or onto[0].leads(Direction(side))) else None
    lit = [one for one in road.crossings if one.lights]
    which = int(place.get("ordinal", 1)) - 1
    if which >= len(lit):
        return None
    if relation in ("after", "past"):
        later = [one for one in fitting if one.distance > lit[which].distance]
        return later[number] if number < len(later) else None
    return lit[which] if lit[which] in fitting else None


def _behind(crossing: Crossing, side: str) -> Place | None:
    way = next((way for way in crossing.exits if str(way.type) == side), None)
    return None if way is None else (way.lane, 0.0)
