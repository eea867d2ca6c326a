"""What is sent to a browser comes from the observation of its role: no secret of the session is in its bytes."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.lab.console.views import role_view
from dorothie_gym.ontology import Role
from tests.lab.console.people import Person, Table

APART = 0.5
"""Distance between true and estimated place from which on they are told apart [m]."""


@pytest.fixture(scope="module")
def played() -> tuple[Table, dict[str, Person], list[tuple[tuple[float, float], tuple[float, float]]]]:
    """Session with a GPS fault, and a change of the task: its people, and true and estimated places."""
    table = Table("participant=human,co_wizard=human,ad_wizard=human", max_seconds=80.0)
    people = {name: table.seat(name) for name in ("participant", "co_wizard", "ad_wizard")}
    places = []
    table.run(0.5)
    trigger = next(task for task in people["ad_wizard"].state["tasks"] if "trigger" in task["may"])
    people["ad_wizard"].command("task", change="trigger", item=trigger["item"], message=trigger["messages"]["trigger"])
    for decision in range(550):
        if decision == 300:  # the traffic light has turned green
            people["ad_wizard"].command("fault", sensor="gps", on=True)
        exits = people["co_wizard"].state["exits"]
        if decision % 10 == 0 and exits:  # drives on, so that the position without GPS becomes uncertain
            people["co_wizard"].command("drive", action="JTurn", angle=exits[0][0])
        table.tick()
        world = table.room.engine.session.world
        x, y = world.car.position.tolist()
        places.append(((x, y), tuple(people["co_wizard"].state["pose"][:2])))
    return table, people, places


def pairs(value: Any) -> Iterator[tuple[float, float]]:
    """All neighbouring numbers in lists: places on the map."""
    if isinstance(value, dict):
        for item in value.values():
            yield from pairs(item)
    elif isinstance(value, list):
        numbers = [isinstance(item, int | float) and not isinstance(item, bool) for item in value]
        for k, (one, other) in enumerate(itertools.pairwise(value)):
            if numbers[k] and numbers[k + 1]:
                yield float(one), float(other)
        for item in value:
            yield from pairs(item)


def test_the_name_of_a_record_tells_neither_story_nor_seed(tmp_path: Path) -> None:
    """People at the seats may see where a session is recorded; seeds and storyboards are few enough to be tried."""
    names = []
    for number, seed in enumerate((3, 3, 4)):
        table = Table("co_wizard=human", folder=tmp_path / str(number), seed=seed, max_seconds=2.0)
        person = table.seat("co_wizard")
        table.until(lambda person=person: person.state.get("outcome") is not None)  # type: ignore[misc]  # bound at once
        (folder,) = (tmp_path / str(number)).iterdir()
        names.append(folder.name)
        assert re.fullmatch("brookside_[0-9a-f]{8}", folder.name)
    assert len(set(names)) == 3, "names follow from the seed"


def frames(person: Person) -> list[dict[str, Any]]:
    return [message for message in map(json.loads, person.received) if message["k"] == "frame"]


def test_the_co_wizard_is_sent_no_true_pose(played: Any) -> None:
    _, people, places = played
    apart = [(true, seen) for true, seen in places if math.dist(true, seen) > APART]
    assert len(apart) > 50, "the estimate has drifted from the truth"
    sent = frames(people["co_wizard"])[-len(places) :]
    for frame, (true, seen) in zip(sent, places, strict=True):
        if math.dist(true, seen) > APART:
            assert min((math.dist(true, pair) for pair in pairs(frame)), default=9.9) > 0.2


def test_the_co_wizard_is_sent_no_hidden_place_story_or_arrival(played: Any) -> None:
    table, people, _ = played
    board = table.room.engine.scenario.storyboard
    content = b"".join(people["co_wizard"].received)
    hidden = [landmark for landmark in board.landmarks if landmark.hidden]
    assert hidden
    for landmark in hidden:
        near = [
            pair
            for frame in frames(people["co_wizard"])
            for pair in pairs({**frame, "guesses": [], "path": []})
            if math.dist(pair, landmark.position) < 0.2
        ]
        assert not near
    assert board.story.encode() not in content
    assert not any(goal.description.encode() in content for goal in board.subgoals)
    assert set().union(*frames(people["co_wizard"])) == {
        "k", "time", "pose", "speed", "landmarks", "speaking", "other_speaking", "covariance", "cruise", "lights",
        "motion", "sight", "hazard", "manoeuvre", "path", "exits", "objects", "guesses", "feasible", "asked", "state",
        "why", "outcome", "done", "refused",
    }  # fmt: skip


def test_the_participant_is_sent_no_plans_of_the_ad_wizard(played: Any) -> None:
    table, people, _ = played
    content = b"".join(people["participant"].received)
    board = table.room.engine.scenario.storyboard
    messages = [str(goal.messages.trigger) for goal in board.subgoals if goal.messages.trigger]
    assert sum(message.encode() in content for message in messages) == 1, "the one that was sent"
    fields = set().union(*frames(people["participant"]))
    assert fields == {
        "k", "time", "pose", "speed", "landmarks", "speaking", "other_speaking", "lights", "objects", "tasks", "state",
        "why", "outcome", "talk",
    }  # fmt: skip


def test_tasks_that_wait_for_their_trigger_are_unknown_to_the_participant() -> None:
    table = Table("participant=human")
    participant = table.seat("participant")
    table.run(2.0)
    board = table.room.engine.scenario.storyboard
    waiting = [goal for goal in board.subgoals if goal.trigger]
    assert waiting and all(goal.description.encode() not in b"".join(participant.received) for goal in waiting)


@pytest.mark.parametrize("role", ["participant", "co_wizard", "ad_wizard"])
def test_a_view_follows_from_the_observation_alone(role: str) -> None:
    table = Table()
    table.seat(role)
    table.run(3.0)
    engine = table.room.engine
    observation = {name: value for name, value in engine.observations[role].items()}
    mask = engine.mask(Role(role))
    before = role_view(Role(role), observation, mask, table.room._places)
    table.run(3.0)  # the world goes on; the view of the old observation does not
    kept = {name: value.copy() if hasattr(value, "copy") else value for name, value in observation.items()}
    assert role_view(Role(role), kept, mask, table.room._places) == before
