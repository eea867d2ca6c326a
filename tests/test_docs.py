"""The examples in docs/ are accepted by the package."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.tasks import bind, load_template
from dorothie_gym.world.town import describe, load_town

DOCS = Path(__file__).parents[1] / "docs"


def example(page: str, language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), flags=re.DOTALL)
    assert found is not None
    return found.group(1)


def test_the_village_of_the_towns_page_compiles(tmp_path: Path) -> None:
    file = tmp_path / "mill_end.yaml"
    file.write_text(example("towns.md", "yaml"), encoding="utf-8")
    described = describe(load_town(file))
    assert described["junctions"] == 4
    assert len(described["components"]) == 1
    assert described["signals"] > 0
    assert described["crosswalks"] > 0


def test_the_storyboard_of_its_page_binds_to_brookside(tmp_path: Path) -> None:
    file = tmp_path / "parcel.json"
    file.write_text(example("storyboards.md", "json"), encoding="utf-8")
    storyboard = bind(load_template(file), load_town("brookside").sites, np.random.default_rng(0))
    assert [storyboard.landmarks[subgoal.landmark].hidden for subgoal in storyboard.subgoals] == [False, True]


@pytest.mark.parametrize("page", sorted(path.name for path in DOCS.glob("*.md")))
def test_pages_have_a_title_and_no_dead_links(page: str) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    assert text.startswith("# ")
    for link in re.findall(r"\]\(((?!http)[^)#]+)\)", text):
        assert (DOCS / link).exists(), f"{page} links to {link}"


def test_the_storyboard_of_its_page_is_strict_json() -> None:
    assert json.loads(example("storyboards.md", "json"))
