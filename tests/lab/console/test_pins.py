"""Names of pins and stopping places: told apart, of the role's own observation, where a stop counts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from dorothie_gym.lab.console.lane_lookup import lane_lookup
from dorothie_gym.lab.console.pins import Pin, pin_rows
from dorothie_gym.lab.console.views import role_view
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import ARRIVAL_DISTANCE, LandmarkName, Role, StreetName
from dorothie_gym.session.spaces import LandmarkColumn
from dorothie_gym.tasks import template_names
from tests.lab.console.people import Person, Table

STREETS = [StreetName(k).label for k in range(1, 9)]


def rows(role: Role, table: Table) -> list[list[Any]]:
    engine = table.room.engine
    found: list[list[Any]] = role_view(role, engine.observations[role.value], engine.mask(role), table.room._places)[
        "landmarks"
    ]
    return found


def names(*pins: Pin) -> list[str]:
    return [row[3] for row in pin_rows(pins, STREETS, lane_lookup(load_town("brookside")))]


def house(street: int) -> Pin:
    return Pin(LandmarkName.HOUSE, (0.0, 0.0), 0, 5.0, street)


def test_houses_are_named_by_their_street_and_numbered_only_where_that_is_not_enough() -> None:
    first, second = STREETS[0], STREETS[1]
    assert names(house(0), house(1)) == [f"House, {first}", f"House, {second}"]
    assert names(house(0), house(1), house(0)) == [f"House 1, {first}", f"House, {second}", f"House 2, {first}"]
    assert names(house(-1), house(-1)) == ["House 1", "House 2"]
    assert names(Pin(LandmarkName.KFC, (0.0, 0.0), 0, 5.0, 0)) == ["KFC"]


@pytest.mark.parametrize("story", ["winter_coats", "house_calls", "band_practice", "school_run"])
def test_no_two_pins_of_a_map_have_the_same_name(story: str) -> None:
    assert story in template_names()
    table = Table(storyboard=story, seed=3)
    for role in (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD):
        labels = [row[3] for row in rows(role, table)]
        assert len(set(labels)) == len(labels)
    kinds = [row[0] for row in rows(Role.PARTICIPANT, table)]
    assert len(set(kinds)) < len(kinds), "the story has several houses or people"


def test_a_hidden_house_changes_no_name_on_the_map_of_the_co_wizard() -> None:
    table = Table(storyboard="house_calls", seed=2)
    board = table.room.engine.scenario.storyboard
    hidden = [each for each in board.landmarks if each.hidden and each.name is LandmarkName.HOUSE]
    assert hidden
    engine = table.room.engine
    before = rows(Role.CO_WIZARD, table)
    observation = dict(engine.observations["participant"])
    landmarks = observation["landmarks"]
    keep = [k for k, each in enumerate(board.landmarks) if not each.hidden]
    alone = {**engine.observations["co_wizard"], "landmarks": np.array(landmarks[keep])}
    assert role_view(Role.CO_WIZARD, alone, engine.mask(Role.CO_WIZARD), table.room._places)["landmarks"] == before
    assert all(math.dist(row[1:3], each.position) > 1.0 for row in before for each in hidden)
    assert all(math.dist(row[4:6], each.waypoint) > 1.0 for row in before for each in hidden)


def test_a_stop_counts_at_the_stopping_place_of_the_view() -> None:
    table = Table(seed=5)
    board = table.room.engine.scenario.storyboard
    shown = rows(Role.PARTICIPANT, table)
    assert len(shown) == len(board.landmarks)
    for row, landmark in zip(shown, board.landmarks, strict=True):
        assert math.dist(row[4:6], landmark.waypoint) < 0.1
    observed = table.room.engine.observations["participant"]["landmarks"][0]
    assert shown[0][6] == int(observed[LandmarkColumn.STREET])


def test_the_rule_and_the_geometry_of_the_pictures_come_with_the_greeting() -> None:
    table = Table(pictures=True)
    person = table.seat("participant")
    table.tick()
    assert person.hello["stop"]["within"] == ARRIVAL_DISTANCE
    assert set(person.hello["camera"]) == {"view", "forward", "up", "pitch"}


def test_the_co_wizard_is_told_places_by_what_it_heard_alone() -> None:
    table = Table("participant=human,co_wizard=human", storyboard="winter_coats", seed=2)
    participant, co_wizard = table.seat("participant"), table.seat("co_wizard")
    table.run(1.0)
    participant.command("say", text="Hello car.")
    street = StreetName(int(table.room.engine.observations["participant"]["street_names"][0])).label
    table.until(lambda: _lines(co_wizard, "participant"))
    assert "places" not in _lines(co_wizard, "participant")[0]
    participant.command("say", text=f"Please take me to the house on {street}.")
    table.until(lambda: len(_lines(co_wizard, "participant")) == 2)
    line = _lines(co_wizard, "participant")[1]
    assert (line["places"], line["streets"]) == (["House"], [street])
    assert not any("places" in each for each in participant.talk)


def _lines(person: Person, who: str) -> list[dict[str, Any]]:
    return [line for line in person.talk if line["who"] == who]
