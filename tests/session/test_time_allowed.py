"""Time allowed for a session: by the reference route on maps where cars drive by the limits."""

from pathlib import Path

import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.scenario import draw_scenario
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.time_allowed import reference_seconds, time_allowed
from tests.maps.opendrive_text import geometry, lane, linked, opendrive, road, section

USUAL = EnvConfig().max_seconds


def long_road(path: Path) -> Path:
    """A two-way road of 8 km in one line."""
    roads = []
    for number in range(1, 9):
        link = "".join(
            f'<{word} elementType="road" elementId="{number + step}" contactPoint="{end}"/>'
            for word, step, end in (("predecessor", -1, "end"), ("successor", 1, "start"))
            if 1 <= number + step <= 8
        )
        lanes = (
            lane(1, more=linked(*((1 if 1 <= number + step <= 8 else None) for step in (-1, 1)))),
            lane(-1, more=linked(*((-1 if 1 <= number + step <= 8 else None) for step in (-1, 1)))),
        )
        plan = geometry("<line/>", 1000.0, x=1000.0 * number)
        roads.append(road(number, length=1000.0, plan=plan, sections=section(0.0, *lanes), link=link))
    path.write_text(opendrive(*roads))
    return path


@pytest.mark.parametrize("name", ["brookside", "northgate"])
def test_shipped_towns_keep_their_time(name: str) -> None:
    town = load_town(name)
    for seed in range(5):
        assert time_allowed(town, draw_scenario(town, None, seed), EnvConfig()) == USUAL


def test_time_grows_with_the_reference_route(tmp_path: Path) -> None:
    town = load_town(long_road(tmp_path / "road.xodr"))
    scenarios = [draw_scenario(town, None, seed) for seed in range(12)]
    times = [time_allowed(town, scenario, EnvConfig()) for scenario in scenarios]
    assert max(times) > USUAL
    for time, scenario in zip(times, scenarios, strict=True):
        assert time >= max(USUAL, 2.9 * reference_seconds(town, scenario))


def test_requested_time_counts(tmp_path: Path) -> None:
    town = load_town(long_road(tmp_path / "road.xodr"))
    config = EnvConfig(max_seconds=300.0)
    assert all(time_allowed(town, draw_scenario(town, None, seed), config) == 300.0 for seed in range(12))


def test_session_knows_its_time(tmp_path: Path) -> None:
    engine = SessionEngine(long_road(tmp_path / "road.xodr"))
    engine.reset(seed=3)
    session = engine.session
    assert session.seconds_allowed == time_allowed(engine.town, session.scenario, engine.config)
