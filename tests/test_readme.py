"""What README.md, and docs/tour.md behind it, show runs as written."""

import importlib.resources
import json
import re
import tomllib
from pathlib import Path

import pytest
import yaml
from PIL import Image

from dorothie_gym import EnvConfig
from dorothie_gym._version import __version__
from dorothie_gym.maps import fold_of, load_town, town_names
from dorothie_gym.ontology import Role
from dorothie_gym.policies.pretrained import names_for

README = Path(__file__).parents[1] / "README.md"
TOUR = README.parent / "docs" / "tour.md"
SNIPPETS = [
    snippet
    for page in (README, TOUR)
    for snippet in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)
]


@pytest.fixture(autouse=True)
def a_default_corpus_that_is_played_fast(monkeypatch: pytest.MonkeyPatch) -> None:
    module = importlib.import_module("dorothie_gym.evaluation.rollout.corpus_cache")
    monkeypatch.setattr(module, "SESSIONS", 2)
    monkeypatch.setattr(module, "CONFIG", EnvConfig(max_seconds=30.0))


@pytest.mark.parametrize("snippet", SNIPPETS, ids=[f"snippet_{k}" for k in range(len(SNIPPETS))])
# PettingZoo's and stable-baselines3's imports reach for packages that are deprecating things.
@pytest.mark.filterwarnings("ignore::DeprecationWarning:pettingzoo")
def test_snippet_runs_as_written(snippet: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(snippet, str(README), "exec"), {"__name__": "__main__"})


def test_readme_shows_the_promised_snippets() -> None:
    text = "\n".join(SNIPPETS)
    for shown in ("gym.make", "pettingzoo.make", ".learn(", "NfD-v0"):
        assert shown in text


@pytest.mark.parametrize("link", re.findall(r"\]\(((?!http)[^)#]+)\)", README.read_text(encoding="utf-8")))
def test_linked_file_exists(link: str) -> None:
    assert (README.parent / link).exists(), f"README.md links to {link}"


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "CHANGELOG.md"])
def test_links_of_the_other_pages_exist(page: str) -> None:
    links = re.findall(r"\]\(((?!http)[^)#]+)", (README.parent / page).read_text(encoding="utf-8"))
    assert [link for link in links if not (README.parent / link).exists()] == []


def test_files_named_in_the_contributing_guide_exist() -> None:
    text = (README.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    paths = re.findall(r"`((?:dorothie_gym|tests|docs|examples)/[\w/.]*)`", text)
    examples = [path for path in paths if "harbour" in path]  # the town that the guide adds
    assert len(paths) > 10 and len(examples) == 1
    assert [path for path in paths if path not in examples and not (README.parent / path).exists()] == []


def test_description_on_an_index_page_has_no_broken_links_and_pictures() -> None:
    project = tomllib.loads((README.parent / "pyproject.toml").read_text(encoding="utf-8"))
    hook = project["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]
    assert [fragment["path"] for fragment in hook["fragments"]] == ["README.md"]
    text = README.read_text(encoding="utf-8")
    for rule in hook["substitutions"]:
        text = re.sub(rule["pattern"], rule["replacement"], text)
    assert "](https://aclanthology.org" in text
    assert re.findall(r"\]\((?!https?:)[^)]*\)", text) == []


def test_source_distribution_has_docs_benchmarks_and_examples() -> None:
    project = tomllib.loads((README.parent / "pyproject.toml").read_text(encoding="utf-8"))
    included = project["tool"]["hatch"]["build"]["targets"]["sdist"]["only-include"]
    assert {"docs", "benchmarks", "examples", "tests"} <= set(included)
    assert {"Dockerfile", ".dockerignore", ".devcontainer"} <= set(included), "tests of the distribution read them"
    assert all((README.parent / name).exists() for name in included)
    assert project["project"]["urls"]


def test_tour_names_shipped_towns_only() -> None:
    text = TOUR.read_text(encoding="utf-8")
    named = re.findall(r"--town (\S+)", text)
    assert named and set(named) <= set(town_names())


def test_tour_measures_towns_and_counts_shipped_models_as_they_are() -> None:
    text = " ".join(TOUR.read_text(encoding="utf-8").split())
    for name in town_names():
        town = load_town(name)
        fold = fold_of(name)
        kilometres = sum(lane.length for lane in town.lanes) / 1000.0
        assert f"| `{name}` | {fold} | {len(town.lanes)} | {kilometres:.1f} |" in text
    files = (importlib.resources.files("dorothie_gym.maps").joinpath("data", f"{name}.yaml") for name in town_names())
    lines = [len(file.read_text(encoding="utf-8").splitlines()) for file in files]
    assert f"a [YAML file of {min(lines)} to {max(lines)} lines]" in text
    words = ("none", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
    drivers, everyone = len(names_for(Role.CO_WIZARD)), len({name for role in Role for name in names_for(role)})
    assert f"and so can {words[drivers]} of the {words[everyone]} [trained models]" in text


def test_readme_is_one_screen_and_its_first_snippet_draws_a_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = README.read_text(encoding="utf-8")
    prose = re.sub(r"<!-- tests -->.*<!-- /tests -->|```bibtex.*?```", "", text, flags=re.DOTALL)
    assert len(prose.split()) <= 900
    monkeypatch.chdir(tmp_path)
    exec(compile(SNIPPETS[0], str(README), "exec"), {"__name__": "__main__"})
    with Image.open(tmp_path / "co_wizard.png") as picture:
        colours = picture.convert("RGB").getcolors(1_000_000)
    assert picture.width >= 300 and colours is not None and len(colours) > 50


def test_citations_have_the_version_and_the_title() -> None:
    citation = yaml.safe_load((README.parent / "CITATION.cff").read_text(encoding="utf-8"))
    text = README.read_text(encoding="utf-8").replace("\\_", "_")
    assert citation["version"] == __version__ and f"version = {{{__version__}}}" in text
    assert citation["title"] in text


def test_container_copies_what_the_package_is_built_from() -> None:
    text = (README.parent / "Dockerfile").read_text(encoding="utf-8")
    copied = {name for line in re.findall(r"^COPY (.*) \S+$", text, flags=re.MULTILINE) for name in line.split()}
    kept = set(re.findall(r"^!([\w.]+)", (README.parent / ".dockerignore").read_text(encoding="utf-8"), re.MULTILINE))
    project = tomllib.loads((README.parent / "pyproject.toml").read_text(encoding="utf-8"))
    needed = {"pyproject.toml", "constraints.txt", "README.md", "dorothie_gym", *project["project"]["license-files"]}
    assert needed <= copied and copied <= kept and all((README.parent / name).exists() for name in copied)
    extras = set(project["project"]["optional-dependencies"])
    container = json.loads((README.parent / ".devcontainer" / "devcontainer.json").read_text(encoding="utf-8"))
    named = re.findall(r"EXTRAS=([\w,]+)", text) + re.findall(r"\.\[([\w,]+)\]", container["postCreateCommand"])
    assert len(named) == 2 and {name for part in named for name in part.split(",")} <= extras


def test_home_page_shows_what_the_package_is() -> None:
    page = (README.parent / "docs" / "index.md").read_text(encoding="utf-8")
    assert "![" in page and "gym.make(" in page and "dorothie-gym run" in page
