"""Sessions on a map with motorways."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli import app
from dorothie_gym.maps import load_town
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.route_state import MOST_AVOIDED, RouteState

TOWN_05 = Path(__file__).parents[3] / "shared" / "maps" / "Town05.xodr"


@pytest.mark.parametrize(
    ("seed", "trouble"),
    [
        (1767456383, "a lane change that ends where the car waits for its turn"),
        (844386238, "a place behind two lane changes that is missed again and again"),
    ],
)
def test_both_find_their_way_on_a_motorway(seed: int, trouble: str) -> None:
    if not TOWN_05.is_file():
        pytest.skip("../shared/maps is not there")
    result = CliRunner().invoke(app, ["run", "--town", str(TOWN_05), "--seed", str(seed), "--json"])
    assert result.exit_code == 0, result.output
    assert json.loads(result.output)["success"], trouble


def test_only_the_latest_missed_places_are_avoided() -> None:
    town = load_town("midtown")
    start, goal = (0, 1.0), (40, 5.0)
    state = RouteState(progress=RouteProgress.plan(town, start, goal))
    places = [(lane, 1.0) for lane in range(50, 50 + MOST_AVOIDED + 2)]
    for place in places:
        state = state.avoiding(town, start, place)
    assert state.avoided == tuple(places[-MOST_AVOIDED:])
