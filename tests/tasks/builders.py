"""Fake towns and random templates for the tests of this folder."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import strategies as st

from dorothie_gym.tasks import Storyboard, StoryboardTemplate, Subgoal, bind, parse_template


@dataclass(frozen=True)
class FakePlace:
    id: int
    lane: int
    station: float
    position: tuple[float, float]
    waypoint: tuple[float, float]
    street: int


def grid_places(count: int, *, spacing: float = 40.0, lanes: int = 8) -> list[FakePlace]:
    """Returns places along parallel streets, `spacing` metres apart, three metres beside their waypoints."""
    places = []
    for k in range(count):
        row, column = k % lanes, k // lanes
        x, y = spacing * column, spacing * row
        places.append(FakePlace(k, row, x, (x, y + 3.0), (x, y), row // 2))
    return places


def parse(fields: dict[str, Any], name: str = "test") -> StoryboardTemplate:
    return parse_template(json.dumps(fields), name)


def plain(*subgoals: dict[str, Any], **fields: Any) -> dict[str, Any]:
    """Returns a template with default landmarks and descriptions; arguments replace or add fields."""
    names = ["KFC", "Shell", "Ikea", "Coco", "Qdoba", "Panera", "SevenEleven"]
    rows = [
        {"destination": name, "description": f"Stop at {name}"} | subgoal
        for name, subgoal in zip(names, subgoals, strict=False)
    ]
    return {"story": "Several stops.", "subgoals": rows} | fields


def bound(*subgoals: dict[str, Any], seed: int = 0, **fields: Any) -> Storyboard:
    return bind(parse(plain(*subgoals, **fields)), grid_places(24), np.random.default_rng(seed))


def site_of(storyboard: Storyboard, subgoal: Subgoal) -> int:
    return storyboard.landmarks[subgoal.landmark].site


ATTRIBUTES = {"places.restaurants": "menuitems", "places.cafe": "menuitems", "places.stores": "items"}
# Each category as often as the catalogue can serve it beside the others.
POOL = (
    ["places.restaurants"] * 4
    + ["places.cafe", "places.stores", "places.stores", "places.gasstation"]
    + ["places.residential"] * 3
    + ["people"] * 2
)


@st.composite
def templates(draw: st.DrawFn) -> dict[str, Any]:
    """Draws valid templates: 2 to 6 subgoals live at the start, up to two triggered ones, every field used."""
    live = draw(st.integers(2, 6))
    triggers = draw(st.integers(0, 2))
    count = live + triggers
    pool = draw(st.permutations(POOL))
    variables = [[f"V{k}", pool[k]] for k in range(count)]
    wide = draw(st.booleans())
    if wide:
        variables.append(["W", "places"])
    dependents = [
        [f"D{k}{n}", f"V{k}.{ATTRIBUTES[category]}"]
        for k, (_, category) in enumerate(variables)
        if category in ATTRIBUTES
        for n in range(draw(st.integers(0, 2)))
    ]
    triggered = set(draw(st.permutations(range(count)))[:triggers])
    subgoals: list[dict[str, Any]] = []
    for k in range(count):
        subgoal: dict[str, Any] = {"destination": f"$V{k}", "description": f"Do what is to be done at $V{k}"}
        if k in triggered:
            subgoal["trigger"] = True
        if draw(st.booleans()):
            subgoal["delete"] = True
        if k and draw(st.booleans()):
            subgoal["after"] = draw(st.lists(st.integers(0, k - 1), max_size=2))
        if wide and draw(st.booleans()):
            subgoal |= {"change": "Go to $W instead", "change_destination": "$W"}
        if k and draw(st.booleans()):
            subgoal["delete_after_subgoal"] = draw(st.integers(0, k - 1))
        subgoals.append(subgoal)
    hidden = [name for name, _ in variables if draw(st.booleans())]
    return {
        "story": "Today: " + ", ".join(f"${name}" for name, _ in variables + dependents),
        "variables": variables,
        "dependents": dependents,
        "subgoals": subgoals,
        "hidden_from_wizard": hidden,
    }
