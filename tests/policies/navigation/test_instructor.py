from __future__ import annotations

import copy
import functools
import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from dorothie_gym.envs.navigation_v0 import NavigationEnv
from dorothie_gym.maps.route_arrays import empty_search
from dorothie_gym.maps.routing import LaneEntry, Place, Route, router
from dorothie_gym.maps.routing_graph import routing_graph
from dorothie_gym.ontology import ActionValue, ObjectClass, Role
from dorothie_gym.policies.navigation.guidance_steps import instruct
from dorothie_gym.policies.navigation.instructor import (
    Guidance,
    NavigationInstruction,
    exit_sectors,
    instruction_of,
)
from dorothie_gym.policies.navigation.instructor_arrays import InstructorArrays, instructor_arrays
from dorothie_gym.policies.navigation.observation_fields import SECTORS
from dorothie_gym.policies.observation_parser import SeenLandmark, read_landmarks, read_subgoals
from dorothie_gym.policies.route_tables import route_tables
from dorothie_gym.session.spaces import ObjectColumn, SubgoalColumn


class Talk:
    """An instructor, and a car that is moved at will: what it observes is that of a session but for the car."""

    def __init__(self, town: str = "brookside", guidance: Guidance = Guidance.TURNS, seed: int = 0) -> None:
        env = NavigationEnv(town)
        env.reset(seed=seed)
        self.town = env.town
        self.seen: dict[str, Any] = env.session.observations((Role.PARTICIPANT,))[Role.PARTICIPANT]
        self.seen["objects"][:] = 0.0
        self.seen["speed"] = np.array([8.0])
        self.known: frozenset[Place] = frozenset()
        self.guidance, self.time = guidance, 0.0

    @functools.cached_property
    def arrays(self) -> InstructorArrays:
        """The instructor, which knows the landmarks of the session."""
        marks, streets = read_landmarks(self.seen, self.town), self.seen["street_names"].tolist()
        arrays = instructor_arrays(
            subgoals=len(self.seen["subgoals"]),
            landmarks=1 + max(m.row for m in marks),
            streets=len(streets),
            things=len(self.seen["objects"]),
        )
        arrays.names[:] = streets
        arrays.now["by_name"] = self.guidance is Guidance.GOALS
        for mark in marks:
            arrays.marks[mark.row] = mark.station, mark.lane, mark.name.value, mark.place in self.known
        return arrays

    @property
    def goal(self) -> SeenLandmark | None:
        row = int(self.arrays.route["landmark"][0])
        return next((mark for mark in read_landmarks(self.seen, self.town) if mark.row == row), None)

    @property
    def blocked(self) -> tuple[Place, ...]:
        closed = self.arrays.closed[: int(self.arrays.route["closed"][0])].tolist()
        return tuple((lane, station) for station, lane in closed)

    @property
    def place(self) -> Place:
        return int(self.seen["lane"]), float(self.seen["station"][0])

    def at(self, lane: int, station: float, *, waits: bool = False, wait: float = 0.5) -> NavigationInstruction | None:
        """Moves the car to a place; returns what is said there."""
        self.time += wait
        self.seen.update(lane=np.array(lane), station=np.array([station]), time=np.array([self.time]))
        arrays = self.arrays
        for number, subgoal in enumerate(read_subgoals(self.seen)):
            arrays.subgoals[number] = subgoal.landmark, subgoal.open, subgoal.allowed
        static = self.seen["objects"][self.seen["objects"][:, ObjectColumn.KIND] == ObjectClass.STATIC.value]
        for name, column in (("x", ObjectColumn.X), ("y", ObjectColumn.Y), ("distance", ObjectColumn.DISTANCE)):
            arrays.things[name][: len(static)] = static[:, column]
        now = {"lane": lane, "station": station, "speed": 8.0, "time": self.time, "waits": waits, "things": len(static)}
        for name, value in now.items():
            arrays.now[name] = value
        town = self.town
        given = instruct(
            route_tables(town), routing_graph(town), empty_search(routing_graph(town)), exit_sectors(town), arrays
        )
        return instruction_of(arrays) if given else None

    def route(self, blocked: tuple[Place, ...] = ()) -> Route:
        """The route from the car to the goal."""
        assert self.goal is not None
        found = router(self.town).route(self.place, self.goal.place, blocked)
        assert found is not None
        return found

    def drive(self, step: float = 2.0) -> Iterator[NavigationInstruction]:
        """Drives to the goal as the route says, and yields what is said on the way."""
        for leg in self.route().legs:
            for station in (*np.arange(leg.start, leg.end, step).tolist(), leg.end):
                said = self.at(leg.lane, station)
                if said is not None:
                    yield said


@pytest.mark.parametrize("town", ["brookside", "midtown"])
def test_every_turn_of_the_route_is_said_before_its_junction_and_the_stop_last(town: str) -> None:
    for seed in range(4):
        talk = Talk(town, seed=seed)
        talk.at(*talk.place)
        steps = [turn for turn in talk.route().turns(talk.town) if turn.choice]
        said = [one for one, _ in itertools.groupby(talk.drive(), key=lambda one: (one.action, one.sector))]
        turns = [turn for turn in steps if turn.entry is LaneEntry.FOLLOW]
        assert said[-1][0] is ActionValue.STOP
        told = [sector for action, sector in said if action is ActionValue.J_TURN]
        assert len(told) <= len(turns)
        if not any(turn.entry is LaneEntry.U_TURN for turn in steps):
            for sector in told:
                assert sector is not None
                angles = [turn.angle for turn in turns]
                assert min(abs((SECTORS[sector] - angle + 180) % 360 - 180) for angle in angles) <= 90


def test_instructions_on_a_route_with_more_legs_than_room_are_those_of_the_whole_route() -> None:
    long = 0
    for seed in range(8):
        one, other = (Talk("northgate", seed=seed) for _ in range(2))
        other.arrays = other.arrays._replace(legs=other.arrays.legs[:16])
        for talk in (one, other):
            talk.at(*talk.place)
        long += len(one.route().legs) > 16
        assert list(one.drive()) == list(other.drive())
    assert long >= 2


def test_closest_open_subgoal_is_the_goal() -> None:
    for seed in range(6):
        talk = Talk(seed=seed)
        talk.seen["subgoals"][:, SubgoalColumn.ALLOWED] = talk.seen["subgoals"][:, SubgoalColumn.LIVE]
        marks = {mark.row: mark for mark in read_landmarks(talk.seen, talk.town)}
        goals = [marks[goal.landmark] for goal in read_subgoals(talk.seen) if goal.open and goal.landmark in marks]
        for _ in range(len(goals)):
            talk.at(*talk.place)
            chosen = talk.goal
            assert chosen is not None
            routes = [router(talk.town).route(talk.place, mark.place) for mark in goals]
            assert talk.route().cost == min(route.cost for route in routes if route is not None)
            done = talk.seen["subgoals"][:, SubgoalColumn.LANDMARK] == chosen.row
            talk.seen["subgoals"][done, SubgoalColumn.REACHED] = 1.0
            goals = [mark for mark in goals if mark.row != chosen.row]
        talk.at(*talk.place)
        assert not goals and talk.goal is None


def test_instruction_is_repeated_after_nine_seconds() -> None:
    talk = Talk()
    talk.at(*talk.place)
    last = talk.route().legs[-1]
    before = last.lane, max(last.end - 20.0, last.start)
    said = [talk.at(*before) for _ in range(5)]
    first = next(one for one in said if one is not None)
    assert first.action is ActionValue.STOP and sum(one is not None for one in said) == 1
    assert talk.at(*before, wait=first.time + 8.9 - talk.time) is None
    again = talk.at(*before, wait=0.1)
    assert again is not None and (again.action, again.distance) == (first.action, first.distance)


def test_waiting_car_is_sent_on_but_not_from_the_goal() -> None:
    talk = Talk()
    talk.at(*talk.place)
    last = talk.route().legs[-1]
    place = max(last.end - 20.0, last.start)
    said = talk.at(last.lane, place, waits=True)
    assert said is not None and said.action is ActionValue.START and said.distance == pytest.approx(last.end - place)
    assert talk.at(last.lane, last.end - 1.0, waits=True, wait=60.0) is None


def test_goal_on_the_map_is_only_named() -> None:
    talk = Talk(guidance=Guidance.GOALS)
    talk.known = frozenset(mark.place for mark in read_landmarks(talk.seen, talk.town))
    said = talk.at(*talk.place)
    goal = talk.goal
    assert said is not None and goal is not None
    assert (said.action, said.landmark, said.sector) == (None, goal.name, None)


@pytest.mark.parametrize("town", ["brookside", "northgate"])
def test_roadblock_in_sight_on_the_route_is_planned_around(town: str) -> None:
    changed = 0
    for seed in range(8):
        talk = Talk(town, seed=seed)
        talk.at(*talk.place)
        leg = talk.route().legs[0]
        if leg.end - leg.start < 45.0:
            continue
        x, y = talk.town.lanes[leg.lane].position(leg.start + 35.0)
        row = talk.seen["objects"][0]
        row[ObjectColumn.X], row[ObjectColumn.Y], row[ObjectColumn.DISTANCE] = x, y, 35.0
        row[ObjectColumn.KIND] = ObjectClass.VEHICLES.value
        talk.at(*talk.place)
        assert not talk.blocked
        row[ObjectColumn.KIND] = ObjectClass.STATIC.value
        talk.at(*talk.place)
        blocked = talk.blocked
        assert blocked == (
            (leg.lane, pytest.approx(leg.start + 35.0)),
            (leg.lane, pytest.approx(leg.start + 43.0)),
        )
        talk.at(*talk.place)
        assert talk.blocked == blocked  # known now
        around = talk.route(blocked)
        assert around.cost >= talk.route().cost
        changed += around.legs[0] != leg
    assert changed


def test_car_off_the_route_gets_another_one_at_the_third_decision() -> None:
    talk = Talk()
    talk.at(*talk.place)
    on_route = {leg.lane for leg in talk.route().legs}
    off = next(
        lane for lane in talk.town.lanes if lane.id not in on_route and not lane.in_junction and lane.length > 60.0
    )
    heard = [talk.at(off.id, 5.0 + k, waits=True) for k in range(4)]
    assert heard[:2] == [None, None] and heard[2] is not None


def test_copy_goes_on_as_the_original() -> None:
    one, two = Talk("midtown"), Talk("midtown")
    one.at(*one.place)
    two.arrays = copy.deepcopy(one.arrays)
    two.time = one.time
    assert list(one.drive()) == list(two.drive())
