"""Scenarios of all seeds can be played in every shipped town, and vary names, places and departures."""

from __future__ import annotations

from pathlib import Path

import gymnasium
import pytest

import dorothie_gym  # noqa: F401 - registers the environments
from dorothie_gym.errors import StoryboardError, TownError
from dorothie_gym.maps import Town, load_town, town_names
from dorothie_gym.maps.routing import router
from dorothie_gym.ontology import StreetName
from dorothie_gym.session.scenario import draw_scenario
from dorothie_gym.tasks import StoryboardSource
from tests.maps.opendrive_text import lane, opendrive, road, section

DRAWS = 1000
GENERATED = StoryboardSource.GENERATED


@pytest.mark.long
@pytest.mark.parametrize("name", town_names())
def test_every_seed_binds_storyboard_with_reachable_places(name: str) -> None:
    town = load_town(name)
    search = router(town)
    unreachable = []
    for seed in range(DRAWS):
        scenario = draw_scenario(town, None, seed)
        found = search.reachable(scenario.departure)
        for landmark in scenario.storyboard.landmarks:
            if not found[search.cell(landmark.lane, landmark.station)]:
                unreachable.append((seed, landmark.name))
    assert not unreachable


@pytest.mark.parametrize("name", town_names())
def test_seeds_vary_street_names_sites_and_departures(name: str) -> None:
    town = load_town(name)
    drawn = [draw_scenario(town, None, seed) for seed in range(DRAWS)]
    given = [(scenario.street_names[k], k) for scenario in drawn for k in range(len(town.streets))]
    plain = sum(street.name != StreetName.HIGHWAY.label for street in town.streets)
    assert len(set(given)) == 14 * plain + (len(town.streets) - plain)  # every street gets every name
    for scenario in drawn:
        assert len(set(scenario.street_names)) == len(town.streets)
    sites = {landmark.site for scenario in drawn for landmark in scenario.storyboard.landmarks}
    assert sites == set(range(len(town.sites)))
    assert len({scenario.departure for scenario in drawn}) == len(town.sites)


@pytest.mark.parametrize("name", town_names())
def test_every_street_of_shipped_towns_gets_a_name(name: str) -> None:
    assert 8 <= len(load_town(name).streets) <= 15


# --- Small towns -----------------------------------------------------------------------------------------------------


def _with_sites(count: int) -> Town:
    town = load_town("brookside")
    parts = ("lanes", "links", "junctions", "streets", "signals", "crosswalks", "sidewalks", "programmes")
    return Town(name="few", sites=town.sites[:count], **{part: getattr(town, part) for part in parts})


@pytest.mark.parametrize("count", [2, 3, 4, 8, 11])
def test_a_small_town_plays_storyboards_that_fit_it(count: int) -> None:
    town = _with_sites(count)
    for seed in range(10):
        scenario = draw_scenario(town, None, seed)
        assert len(scenario.storyboard.landmarks) <= count
        assert scenario.departure in {(site.lane, site.station) for site in town.sites}


@pytest.mark.parametrize("name", town_names())
def test_generated_storyboards_are_new_for_each_seed_and_have_the_wanted_stops(name: str) -> None:
    town = load_town(name)
    drawn = [draw_scenario(town, None, seed, (4, 6), None, GENERATED) for seed in range(40)]
    assert drawn == [draw_scenario(town, None, seed, (4, 6), None, GENERATED) for seed in range(40)]
    assert len({scenario.storyboard.name for scenario in drawn}) == 40
    stops = {sum(not goal.trigger for goal in scenario.storyboard.subgoals) for scenario in drawn}
    assert stops == {4, 5, 6}
    shipped = draw_scenario(town, None, 0)
    assert drawn[0].street_names == shipped.street_names and drawn[0].storyboard != shipped.storyboard


@pytest.mark.parametrize("count", [2, 3, 5, 8])
def test_a_small_town_gets_generated_storyboards_that_fit_it(count: int) -> None:
    town = _with_sites(count)
    for seed in range(10):
        scenario = draw_scenario(town, None, seed, storyboards=GENERATED)
        assert len(scenario.storyboard.landmarks) <= count


def test_a_town_too_small_for_generated_storyboards_is_refused_with_numbers() -> None:
    with pytest.raises(StoryboardError, match=r"with 4 stops need more than the 3 places of town few"):
        draw_scenario(_with_sites(3), None, 3, (4, 6), None, GENERATED)
    with pytest.raises(StoryboardError, match=r"have 2 to 6 stops, not 7 to 9; change EnvConfig\.stops"):
        draw_scenario(_with_sites(3), None, 3, (7, 9), None, GENERATED)


@pytest.mark.parametrize("count", [0, 1])
def test_a_town_too_small_for_any_storyboard_is_refused_with_numbers(count: int) -> None:
    with pytest.raises(StoryboardError, match=rf"needs 2 places, fewer than any other, but town few has {count} "):
        draw_scenario(_with_sites(count), None, 3)


def test_a_town_without_places_is_one_error_in_navigation(tmp_path: Path) -> None:
    path = tmp_path / "short.xodr"
    path.write_text(opendrive(road(1, length=12.0, sections=section(0.0, lane(1), lane(-1)))))
    with pytest.raises(StoryboardError, match="town short has 0"):
        gymnasium.make("dorothie_gym/Navigation-v0", town=str(path)).reset(seed=1)
    with pytest.raises(TownError, match="short: town: no lane is longer than 12 m"):
        gymnasium.make("dorothie_gym/Town-v0", town=str(path)).reset(seed=1)
