from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.evaluation.closed_loop import many_rollouts
from dorothie_gym.evaluation.closed_loop.cross_play import CrossPlaySettings, cross_play
from dorothie_gym.evaluation.closed_loop.many_rollouts import folder_name
from dorothie_gym.ontology import Role
from dorothie_gym.policies import Player, find_player
from dorothie_gym.session.config import EnvConfig

SHORT = ("--towns", "brookside", "--max-seconds", "5", "--workers", "1", "--sessions", "2")


def settings(**changes: Any) -> CrossPlaySettings:
    drivers = [find_player(name, Role.CO_WIZARD) for name in ("scripted", "lane-follow")]
    guides = [find_player(name, Role.PARTICIPANT) for name in ("scripted", "silent")]
    usual: dict[str, Any] = {
        "co_wizards": drivers,
        "participants": guides,
        "towns": ("brookside",),
        "sessions": 2,
        "config": EnvConfig(max_seconds=12.0),
    }
    return CrossPlaySettings(**{**usual, **changes})


def test_all_pairs_play_the_same_sessions(tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    result = cross_play(settings(), tmp_path, on_session=lambda done, total: seen.append((done, total)))
    assert list(result.cells) == [
        ("scripted", "scripted"),
        ("scripted", "silent"),
        ("lane-follow", "scripted"),
        ("lane-follow", "silent"),
    ]
    seeds = {tuple(row.seed for row in cell.rows) for cell in result.cells.values()}
    assert len(seeds) == 1
    assert seen[-1] == (8, 8) and seen == sorted(seen)
    talked = {pair: cell.table().figures["utterances_per_subgoal"]["mean"] for pair, cell in result.cells.items()}
    assert (talked["lane-follow", "silent"] or 0.0) == 0.0 < (talked["scripted", "scripted"] or 0.0)


def test_finished_pairs_are_not_played_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = cross_play(settings(), tmp_path)
    monkeypatch.setattr(many_rollouts, "roll_out", None)
    assert cross_play(settings(), tmp_path).to_json() == first.to_json()


def test_models_are_named_where_that_is_clear(tmp_path: Path) -> None:
    found = cross_play(settings(sessions=1), tmp_path)
    cells = {("runs/reader/seed-0", guide): found.cells["scripted", guide] for guide in found.participants}
    page = replace(found, co_wizards=("runs/reader/seed-0",), cells=cells).page()
    assert "| reader, seed 0 | " in page


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"participants": []}, "participants is empty"),
        ({"co_wizards": [Player(name="silent"), Player(name="silent")]}, "give each once"),
    ],
)
def test_wrong_settings_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        settings(**changes)


def test_folders_of_models_are_told_apart_by_their_weights() -> None:
    one, other = (Player(name="runs/co-wizard/seed-0", sha256=digit * 64) for digit in "ab")
    assert folder_name(one, Role.CO_WIZARD) == "runs-co-wizard-seed-0-aaaaaaaa"
    assert folder_name(one, Role.CO_WIZARD) != folder_name(other, Role.CO_WIZARD)
    assert "/" not in folder_name(Player(name="../a:b"), Role.CO_WIZARD)


def test_command_writes_json_result_and_page(tmp_path: Path) -> None:
    out, page = tmp_path / "pairs", tmp_path / "pairs.md"
    given = ["--co-wizard", "lane-follow", "--participant", "silent", "--participant", "random"]
    call = ["cross-play", *given, *SHORT, "--out", str(out), "--page", str(page)]
    done = CliRunner().invoke(app, [*call, "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert [(cell["co_wizard"], cell["participant"]) for cell in found["cells"]] == [
        ("lane-follow", "silent"),
        ("lane-follow", "random"),
    ]
    assert set(found["cells"][0]["success"]) == {"mean", "low", "high"}
    assert json.loads((out / "cross_play.json").read_text()) == found
    text = page.read_text()
    assert "| lane-follow | 0.0 [0.0, 65.8] % | 0.0 [0.0, 65.8] % |" in text
    assert "--participant random" in text
    again = CliRunner().invoke(app, call)
    assert again.exit_code == 0 and "success" in again.stdout


def test_unknown_player_is_reported() -> None:
    done = CliRunner().invoke(app, ["cross-play", "--participant", "nobody", *SHORT])
    assert done.exit_code == 2 and "there is no policy 'nobody'" in " ".join(done.stderr.split())
