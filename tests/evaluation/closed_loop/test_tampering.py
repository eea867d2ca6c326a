"""Each way of tampering with a rollout is found, in its own words."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from dorothie_gym.evaluation.closed_loop import roll_out
from dorothie_gym.evaluation.closed_loop.submission import check_submission
from tests.evaluation.closed_loop.rollout_edits import LONGER, ONE, PROTOCOL, settings
from tests.evaluation.closed_loop.tampering import TAMPERINGS, Tampering

DOCS = Path(__file__).parents[3] / "docs"


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tampering") / "honest"
    roll_out(settings(), folder)
    return folder


@pytest.mark.parametrize(
    "tampering",
    [pytest.param(each, id=each.name, marks=() if each.quick else pytest.mark.long) for each in TAMPERINGS],
)
def test_tampering_is_found(
    tampering: Tampering, honest: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "rollout"
    if tampering.edits is not None:
        shutil.copytree(honest, folder)
        tampering.edits(folder)
    if tampering.plays is not None:
        tampering.plays(folder, monkeypatch)
    found = check_submission(folder, protocol=PROTOCOL if tampering.edits is not None else ONE)
    assert tampering.message in "\n".join(found.faults)
    assert found.submission is None


def test_untouched_rollouts_of_both_protocols_are_accepted(honest: Path, tmp_path: Path) -> None:
    roll_out(settings(sessions=1, config=LONGER), tmp_path / "one")
    for folder, protocol in ((honest, PROTOCOL), (tmp_path / "one", ONE)):
        found = check_submission(folder, protocol=protocol)
        assert found.faults == () and found.played and found.claims == ("run time",)


def test_page_lists_every_tampering_that_was_tried() -> None:
    page = (DOCS / "leaderboard-checks.md").read_text(encoding="utf-8")
    section = page.split("## Tampering")[1].split("\n## ")[0]
    rows = [line.split("|")[1].strip() for line in section.splitlines() if line.startswith("| ")]
    assert sorted(row for row in rows if row != "tampering") == sorted(each.name for each in TAMPERINGS)
    assert len(TAMPERINGS) >= 30 and len({each.name for each in TAMPERINGS}) == len(TAMPERINGS)
