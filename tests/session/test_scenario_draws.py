"""Scenarios of all seeds can be played in every shipped town, and vary names, places and departures."""

from __future__ import annotations

import pytest

from dorothie_gym.maps import load_town, town_names
from dorothie_gym.maps.routing import router
from dorothie_gym.ontology import StreetName
from dorothie_gym.session.scenario import draw_scenario

DRAWS = 1000


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
