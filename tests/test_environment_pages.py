"""The pages in docs/environments are up to date and describe every field of every space."""

import importlib
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import gymnasium as gym
import numpy as np
import pettingzoo
import pytest
from gymnasium import spaces
from PIL import Image

import dorothie_gym
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk

DOCS = Path(__file__).parents[1] / "docs"
FOLDER = DOCS / "environments"
IDS = {
    "participant": "Participant-v0",
    "co_wizard": "CoWizard-v0",
    "ad_wizard": "AdWizard-v0",
    "navigation": "Navigation-v0",
    "navigation_continuous": "Navigation-continuous-v0",
    "ufn": "UfN-v0",
    "rfn": "RfN-v0",
    "nfd": "NfD-v0",
    "town": "Town-v0",
}
PAGES = [*IDS, "duo_wizard"]


@pytest.fixture
def generator(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(DOCS)
    return importlib.import_module("environment_pages")


@pytest.fixture
def corpus(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "corpus" / "train" / "one", talk())
    monkeypatch.chdir(tmp_path)


def page(name: str) -> str:
    return (FOLDER / f"{name}.md").read_text(encoding="utf-8")


def section(name: str, title: str) -> str:
    return page(name).split(f"\n## {title}\n")[1].split("\n## ")[0]


def made(name: str) -> gym.Env[Any, Any]:
    corpus = {"corpus": "corpus"} if name in ("ufn", "rfn", "nfd") else {}
    return gym.make(f"dorothie_gym/{IDS[name]}", **corpus)  # type: ignore[arg-type]  # keywords of several types


def rows(text: str) -> dict[str, list[str]]:
    """The cells of the first table of a text by the name of the field."""
    table = re.search(r"(?:^\|.*\n?)+", text, flags=re.MULTILINE)
    assert table is not None
    cells = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in table[0].splitlines()[2:]]
    return {re.sub(r"[`\s]", "", row[0]): row for row in cells}


def test_pages_are_those_of_the_generator(generator: ModuleType) -> None:
    texts = generator.pages()
    assert {path.name for path in FOLDER.glob("*.md")} == set(texts)
    for name, text in texts.items():
        hint = f"{name} is out of date: run python docs/pages.py environments"
        assert (FOLDER / name).read_text(encoding="utf-8") == text, hint


def test_every_registered_environment_has_a_page() -> None:
    registered = {env_id for env_id in gym.registry if env_id.startswith("dorothie_gym/")}
    assert registered == {f"dorothie_gym/{env_id}" for env_id in IDS.values()}


@pytest.mark.parametrize("name", [name for name in IDS if name != "town"])
@pytest.mark.usefixtures("corpus")
def test_each_field_of_each_space_has_a_row(name: str) -> None:
    env = made(name)
    found = 0
    for title, space in (("Observation Space", env.observation_space), ("Action Space", env.action_space)):
        if not isinstance(space, spaces.Dict):
            continue
        table = rows(section(name, title))
        assert set(table) == set(space)
        for field, part in space.items():
            _, shape, dtype, values, _, meaning = table[field]
            text = isinstance(part, spaces.Text)
            assert shape == ("-" if text else str(part.shape)) and dtype == ("str" if text else str(part.dtype)), field
            assert meaning and (str(part.max_length) if text else "[") in values, field  # type: ignore[attr-defined]  # only texts reach the attribute
            found += 1
    assert found > 10 or name.startswith("navigation")


@pytest.mark.parametrize("name", ["navigation", "navigation_continuous"])
def test_rows_of_a_vector_cover_it_in_order(name: str) -> None:
    env = made(name)
    for title, space in (("Observation Space", env.observation_space), ("Action Space", env.action_space)):
        table = rows(section(name, title))
        if isinstance(space, spaces.Discrete):
            assert [int(value) for value in table] == list(range(int(space.n)))
            continue
        positions = [[int(end) for end in row[1].split(" to ")] for row in table.values()]
        covered = [k for ends in positions for k in range(ends[0], ends[-1] + 1)]
        assert covered == list(range(space.shape[0]))  # type: ignore[index]  # a `Box` always has a shape


def test_the_page_of_all_roles_lists_the_fields_of_each_role() -> None:
    env = pettingzoo.make("parallel", "dorothie_gym/DuoWizard-v0")
    for title, space_of in (("Observation Space", env.observation_space), ("Action Space", env.action_space)):
        table = rows(section("duo_wizard", title))
        for column, agent in enumerate(("participant", "co_wizard", "ad_wizard"), start=1):
            assert {field for field, row in table.items() if row[column]} == set(space_of(agent))


def test_the_page_of_the_town_environment_lists_features_and_actions() -> None:
    env: Any = made("town").unwrapped
    observations, actions = rows(section("town", "Observation Space")), rows(section("town", "Action Space"))
    assert [row[1].strip("`") for row in observations.values()] == env.observation_type.features
    assert [row[1].strip("`") for row in actions.values()] == list(env.action_type.actions.values())


@pytest.mark.parametrize("name", PAGES)
@pytest.mark.filterwarnings("ignore::DeprecationWarning:pettingzoo")
@pytest.mark.usefixtures("corpus")
def test_the_example_of_a_page_runs(name: str) -> None:
    code = re.search(r"```python\n(.*?)```", page(name), flags=re.DOTALL)
    assert code is not None
    exec(compile(code[1], f"{name}.md", "exec"), {"__name__": "__main__"})


@pytest.mark.parametrize("name", PAGES)
def test_a_page_names_its_class_and_has_all_sections(name: str) -> None:
    text = page(name)
    named = re.search(r"^Class: `dorothie_gym\.(\w+)`\.$", text, flags=re.MULTILINE)
    assert named is not None
    if name in IDS:
        entry = gym.spec(f"dorothie_gym/{IDS[name]}").entry_point
        assert isinstance(entry, str)
        module, _, cls = entry.partition(":")
        assert getattr(importlib.import_module(module), cls) is getattr(dorothie_gym, named[1])
    titles = re.findall(r"^## (.*)", text, flags=re.MULTILINE)
    wanted = [
        "Description",
        "Observation Space",
        "Action Space",
        "Rewards",
        "Episode End",
        "Arguments",
        "Version History",
    ]
    assert [title for title in titles if title != "Agents"] == wanted


@pytest.mark.parametrize("name", [path.stem for path in sorted(FOLDER.glob("*.md"))])
def test_links_to_vocabularies_have_a_heading(name: str, generator: ModuleType) -> None:
    headings = re.findall(r"^## (.*)", page("vocabularies"), flags=re.MULTILINE)
    anchors = {re.sub(r"[^\w-]", "", heading.lower()) for heading in headings}
    assert set(re.findall(r"vocabularies\.md#([\w-]+)", page(name))) <= anchors


@pytest.mark.parametrize("name", PAGES)
def test_a_page_shows_an_animation_that_is_small_and_moves(name: str) -> None:
    path = FOLDER / f"{name}.webp"
    assert f"]({name}.webp)" in page(name).split("\n## ")[0], "the animation is above the sections"
    assert path.stat().st_size < 400_000
    with Image.open(path) as film:
        frames = int(getattr(film, "n_frames", 1))
        assert frames >= 20 and film.width == 640
        first = np.asarray(film.convert("RGB"), dtype=np.int16)
        film.seek(frames - 1)
        assert (np.abs(first - np.asarray(film.convert("RGB"))).max(axis=2) > 60).mean() > 0.01, "nothing moves"


def test_one_command_draws_every_animation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)
    drawn = importlib.import_module("environment_animations").ANIMATIONS
    assert set(drawn) == set(PAGES) == {path.stem for path in FOLDER.glob("*.webp")}
