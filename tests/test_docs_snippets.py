"""Snippets of README and docs: all of them compile and import names that exist, and most run as written."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = sorted(str(page.relative_to(ROOT)) for page in (ROOT / "README.md", *(ROOT / "docs").rglob("*.md")))

RUN = {
    "docs/agents.md": (),
    "docs/closed-loop.md": (),
    "docs/copies.md": (),
    "docs/cross-play.md": (),
    "docs/index.md": (),
    "docs/models.md": ("stable_baselines3",),
    "docs/navigation.md": ("sb3_contrib",),
    "docs/roles.md": (),
    "docs/testing.md": (),
    "docs/tiers.md": (),
    "docs/towns.md": (),
}
"""Pages whose snippets are run here, and the packages of extras that they need."""

ELSEWHERE = frozenset(
    [
        "README.md",  # tests/test_readme.py
        "docs/tour.md",
        "docs/camera.md",  # tests/test_docs.py, as the next ones
        "docs/learning-roles.md",
        "docs/own.md",
        "docs/predictions.md",
        "docs/sensors.md",
        "docs/speech.md",
        "docs/statistics.md",
        "docs/talk.md",
        "docs/tasks.md",
        "docs/integrations.md",  # tests/integrations/test_examples.py
    ]
)
"""Pages whose snippets other tests run; tests/test_environment_pages.py runs those of `docs/environments`."""

NEED_FILES = frozenset(
    [
        "docs/studies.md",  # pandas, which no extra has
        "docs/agents-openenv.md",  # a server
        "docs/agents-trl.md",  # TRL
        "docs/annotation-tool.md",  # an annotation
        "docs/sdn.md",  # SDN
        "docs/session-format.md",  # recordings
        "docs/sessions.md",
    ]
)
"""Pages whose snippets read files of the reader, or need a framework of their own."""


def snippets(page: str) -> list[str]:
    """Returns the Python of a page, block by block."""
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), flags=re.DOTALL)


def test_snippets_of_every_page_are_run_or_known_to_need_files() -> None:
    with_snippets = {page for page in PAGES if snippets(page) and not page.startswith("docs/environments/")}
    assert with_snippets == {*RUN, *ELSEWHERE, *NEED_FILES}


@pytest.mark.parametrize("page", [page for page in PAGES if snippets(page)])
def test_names_that_snippets_import_exist(page: str) -> None:
    for code in snippets(page):
        for node in ast.walk(ast.parse(code)):
            if isinstance(node, ast.ImportFrom) and str(node.module).split(".")[0] == "dorothie_gym":
                try:
                    module = importlib.import_module(str(node.module))
                except ModuleNotFoundError as error:
                    assert not str(error.name).startswith("dorothie_gym"), f"{page}: {error}"  # else a framework
                    continue
                assert [alias.name for alias in node.names if not hasattr(module, alias.name)] == [], page


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")  # of the libraries
@pytest.mark.parametrize("page", RUN)
def test_snippets_run_as_written(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for package in RUN[page]:
        pytest.importorskip(package)
    monkeypatch.chdir(tmp_path)
    for number, code in enumerate(snippets(page)):
        exec(compile(code, f"{page}, snippet {number}", "exec"), {"__name__": "__main__"})
