"""Page about towns: the examples compile, the message is the real one, and the tables agree with the code."""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import networkx as nx
import pytest
import yaml

from dorothie_gym.errors import TownError
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.town import Town
from dorothie_gym.maps.yaml import arms as ramps
from dorothie_gym.maps.yaml import centrelines as heights
from dorothie_gym.maps.yaml import clearance, layout, read_yaml_town, schema
from dorothie_gym.maps.yaml import furniture as site_places
from dorothie_gym.maps.yaml import schema as signs
from dorothie_gym.maps.yaml import street_schema as streets

PAGE = (Path(__file__).parents[2] / "docs" / "towns.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```yaml\n(.*?)```", PAGE, flags=re.DOTALL)
WHOLE = [block for block in BLOCKS if block.startswith("name:")]
STEPS = [block for block in BLOCKS if not block.startswith("name:")]


def compiled(tmp_path: Path, text: str) -> Town:
    file = tmp_path / "mill_end.yaml"
    file.write_text(text, encoding="utf-8")
    return read_yaml_town(file)


def grown(steps: int) -> dict[str, Any]:
    """The village after a number of steps, put together as the page says."""
    town: dict[str, Any] = yaml.safe_load(WHOLE[0])
    for step in STEPS[:steps]:
        for key, value in yaml.safe_load(step).items():
            town[key] = {**town[key], **value} if isinstance(value, Mapping) else value
    return town


def check_drivable(town: Town) -> None:
    graph = nx.DiGraph((link.source, link.target) for link in town.links)
    graph.add_nodes_from(lane.id for lane in town.lanes)
    assert nx.is_strongly_connected(graph)


def rows(heading: str) -> dict[str, list[str]]:
    """Rows of the tables below a heading, by key: meaning, range, default."""
    section = PAGE.split(f"### {heading}\n")[1].split("\n#")[0]
    cells = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if line[:3] == "| `"
    ]
    return {row[0].strip("`"): row[1:] for row in cells}


@pytest.mark.parametrize("steps", range(len(STEPS) + 1))
def test_the_village_compiles_after_every_step(tmp_path: Path, steps: int) -> None:
    town = compiled(tmp_path, yaml.safe_dump(grown(steps), sort_keys=False))
    check_drivable(town)
    assert town.signals and town.crosswalks and town.sites


@pytest.mark.parametrize("text", WHOLE, ids=lambda text: text.split("\n")[0])
def test_whole_files_compile(tmp_path: Path, text: str) -> None:
    check_drivable(compiled(tmp_path, text))


def test_the_whole_town_is_what_the_steps_make() -> None:
    assert len(STEPS) == 5
    assert yaml.safe_load(WHOLE[1]) == grown(len(STEPS))


def test_the_steps_have_their_described_effects(tmp_path: Path) -> None:
    town = compiled(tmp_path, WHOLE[1])
    assert {"park", "Viaduct", "Ferry Street"} <= {street.name for street in town.streets}
    assert {SignalKind.TRAFFIC_LIGHT, SignalKind.YIELD} <= {signal.kind for signal in town.signals}
    assert max(float(lane.points[:, 2].max()) for lane in town.lanes) == pytest.approx(6.0)
    assert len(town.programmes) == 3


def test_the_message_is_the_real_one(tmp_path: Path) -> None:
    shown = re.search(r"```text\n(.*?)\n```", PAGE, flags=re.DOTALL)
    assert shown is not None
    with pytest.raises(TownError) as caught:
        compiled(tmp_path, WHOLE[0].replace("Mill Lane: [mill, forge]", "Mil Lane: [mil, forge]"))
    assert str(caught.value).replace(f"{tmp_path}/", "") == shown[1]


@pytest.mark.parametrize(
    ("heading", "keys"),
    [
        ("Keys of the town", schema.TOWN_KEYS),
        ("Keys of a junction", schema.JUNCTION_KEYS),
        ("Keys of a street", streets.STREET_KEYS),
        ("Keys of lights and phases", signs.LIGHTS_KEYS + signs.PHASE_KEYS),
    ],
)
def test_the_tables_list_every_key(heading: str, keys: tuple[str, ...]) -> None:
    assert list(rows(heading)) == list(keys)


DEFAULTS = streets.StreetDefaults()


@pytest.mark.parametrize(
    ("heading", "key", "limits", "default"),
    [
        ("Keys of the town", "speed", streets.SPEED_RANGE, f"{DEFAULTS.speed:g}"),
        ("Keys of the town", "width", streets.WIDTH_RANGE, f"{DEFAULTS.width:g}"),
        ("Keys of the town", "sidewalk", streets.SIDEWALK_RANGE, f"{DEFAULTS.sidewalk:g}"),
        ("Keys of a junction", "roundabout", schema.ROUNDABOUT_RADIUS, "a plain junction"),
        ("Keys of a junction", "lanes", schema.ROUNDABOUT_LANES, "1"),
        ("Keys of a junction", "speed", streets.SPEED_RANGE, f"{schema.ROUNDABOUT_SPEED:g}, or the town's"),
        ("Keys of a street", "lanes", streets.LANES_RANGE, "1"),
        ("Keys of a street", "median", streets.MEDIAN_RANGE, "0"),
        ("Keys of a street", "speed", streets.SPEED_RANGE, "the town's"),
        ("Keys of a street", "width", streets.WIDTH_RANGE, "the town's"),
        ("Keys of a street", "sidewalk", streets.SIDEWALK_RANGE, "the town's"),
        ("Keys of a street", "radius", streets.RADIUS_RANGE, "the largest"),
        ("Keys of lights and phases", "offset", signs.OFFSET, "0"),
        ("Keys of lights and phases", "seconds", signs.SECONDS, "required"),
    ],
)
def test_the_tables_list_ranges_and_defaults(heading: str, key: str, limits: tuple[float, float], default: str) -> None:
    _, range_, told = rows(heading)[key]
    assert re.match(rf"{limits[0]:g} to {limits[1]:.0f}\b", range_)
    assert told.startswith(default)


def test_the_page_states_the_figures_of_the_layout() -> None:
    low, high = (math.degrees(angle) for angle in (ramps.SMALLEST_ANGLE, ramps.LARGEST_ANGLE))
    for told in (
        f"at least {clearance.HEADROOM:g} m above",
        f"at most {100 * heights.STEEPEST:.0f} %",
        f"They open {layout.POCKET_LENGTH:.0f} m before",
        f"at most {site_places.FARTHEST_SITE:.0f} m from the kerb lane",
        f"at {low:.0f} to {high:.0f} degrees",
    ):
        assert told in PAGE.replace("\n", " "), told
