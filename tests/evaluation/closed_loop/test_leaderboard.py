from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.errors import RolloutError
from dorothie_gym.evaluation.closed_loop import (
    RolloutResult,
    RolloutRow,
    RolloutSettings,
    protocol,
    roll_out,
    submission,
)
from dorothie_gym.evaluation.closed_loop.leaderboard import labels_of, leaderboard_page, read_entries
from dorothie_gym.evaluation.tiers import TIERS, Tier
from dorothie_gym.maps import DEVELOPMENT_TOWNS, SEEN_TOWNS, UNSEEN_TOWNS
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED, Player
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.scenario import ReferenceDrive
from tests.evaluation.closed_loop.drives import record
from tests.evaluation.closed_loop.rollout_edits import PROTOCOL, edit, settings


def write(folder: Path, name: str, successes: int, **settings: Any) -> Path:
    """The result of four sessions of a Co-Wizard."""
    player = Player(name=name, training={"steps": 50_000, "seconds": 1200.0} if name == "ppo" else {})
    made = RolloutSettings(
        cast={**ALL_SCRIPTED, Role.CO_WIZARD: player}, sessions=4, **{"towns": UNSEEN_TOWNS, **settings}
    )
    rows = tuple(
        RolloutRow(number=k, town=made.towns[0], seed=k, record=record(success=k < successes)) for k in range(4)
    )
    folder.mkdir(parents=True)
    result = RolloutResult(settings=made.to_json(), rows=rows)
    (folder / "rollout.json").write_text(json.dumps(result.to_json()))
    return folder


def test_policies_are_ranked_within_each_fold_of_towns(tmp_path: Path) -> None:
    for name, successes in (("random", 0), ("ppo", 3), ("scripted", 4)):
        write(tmp_path / name, name, successes)
    write(tmp_path / "seen", "random", 1, towns=SEEN_TOWNS)
    write(tmp_path / "former", "random", 2, towns=DEVELOPMENT_TOWNS)
    ranked = [(entry.part, entry.policy) for entry in read_entries([tmp_path])]
    assert ranked == [
        ("seen", "random"), ("development", "random"),
        ("unseen", "scripted"), ("unseen", "ppo"), ("unseen", "random"),
    ]  # fmt: skip


def test_towns_from_files_have_a_part_of_their_own(tmp_path: Path) -> None:
    write(tmp_path / "files", "scripted", 4, towns=("maps/Town01.xodr", "maps/Town02.xodr"))
    write(tmp_path / "mixed", "scripted", 4, towns=("maps/Town01.xodr", "brookside"))
    entries = read_entries([tmp_path])
    assert [entry.part for entry in entries] == ["imported", "other"]
    assert "## Imported towns" in leaderboard_page(entries)


def test_page_has_figures_cost_and_the_command_of_each_row(tmp_path: Path) -> None:
    folder = write(tmp_path / "one", "ppo", 3)
    (folder / "cost.json").write_text('{"wall_seconds": 100.0, "cpu_seconds": 180.0, "workers": 2}')
    page = leaderboard_page(read_entries([folder]), "board.png")
    assert "![Success and driving score of each policy, with intervals](board.png)" in page
    assert "| ppo | 4 | 0 | figures, name | 75.0 [30.1, 95.4] % |" in page
    for name in ("training steps", "training time", "wall time", "processor time"):
        assert f"| {name} (claimed) |" in page
    assert "| ppo | unseen | 50,000 | 20 min | 800 | 100 s by 2 | 180 s |" in page
    assert "dorothie-gym rollout --co-wizard ppo --participant scripted" in page


def test_who_hears_badly_has_a_row_of_its_own(tmp_path: Path) -> None:
    write(tmp_path / "clear", "scripted", 4)
    write(tmp_path / "noisy", "scripted", 2, config=EnvConfig(word_error_rate=0.2))
    assert [entry.policy for entry in read_entries([tmp_path])] == ["scripted", "scripted (word errors 20 %)"]


def test_duplicate_and_missing_results_are_rejected(tmp_path: Path) -> None:
    write(tmp_path / "a", "scripted", 4)
    write(tmp_path / "b", "scripted", 3)
    with pytest.raises(RolloutError, match=r"b: scripted in unseen towns is also in .*a; give one"):
        read_entries([tmp_path])
    (tmp_path / "empty").mkdir()
    with pytest.raises(RolloutError, match=r"empty: has no rollout.json"):
        read_entries([tmp_path / "empty"])


def test_command_writes_page_and_picture(tmp_path: Path) -> None:
    write(tmp_path / "runs" / "a", "scripted", 4)
    page = tmp_path / "leaderboard.md"
    done = CliRunner().invoke(app, ["leaderboard", str(tmp_path / "runs"), "--out", str(page)])
    assert done.exit_code == 0, done.output
    assert page.read_text().startswith("# Leaderboard")
    assert (tmp_path / "leaderboard.png").read_bytes().startswith(b"\x89PNG")
    done = CliRunner().invoke(app, ["leaderboard", str(tmp_path), "--out", str(page)])
    assert done.exit_code == 2 and "has no rollout.json" in done.stderr


def test_command_works_by_default_in_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "runs" / "a", "scripted", 4)
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["leaderboard", "runs"])
    assert done.exit_code == 0, done.output
    page = Path("leaderboard.md").read_text()
    assert "(leaderboard.png)" in page and "(closed-loop.md)" not in page
    assert Path("leaderboard.png").is_file()


def test_shortened_sessions_are_marked_and_ranked_after_complete_ones(tmp_path: Path) -> None:
    write(tmp_path / "long", "random", 1)
    write(tmp_path / "short", "scripted", 4, config=EnvConfig(max_seconds=60.0))
    entries = read_entries([tmp_path])
    assert [entry.policy for entry in entries] == ["random", "scripted (sessions of at most 60 s)"]
    page = leaderboard_page(entries)
    assert "Rollouts with sessions shorter than 900 s are marked and ranked after the others" in page
    assert "shorter than" not in leaderboard_page(entries[:1])


def test_models_are_named_and_their_commands_have_the_path(tmp_path: Path) -> None:
    for name in ("warm_ppo/best", "models/reader/small/seed-0", "runs/c/models/toto/paper/seed-12", "lane-follow"):
        write(tmp_path / name.replace("/", "-"), name, 2)
    entries = read_entries([tmp_path])
    assert sorted(labels_of(entries).values()) == ["lane-follow", "reader, seed 0", "toto, seed 12", "warm_ppo"]
    page = leaderboard_page(entries)
    assert "| reader, seed 0 | 4 |" in page and "--co-wizard models/reader/small/seed-0 " in page


def test_two_models_of_one_name_keep_their_paths(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        write(tmp_path / folder, f"{folder}/ppo/best", 2)
    assert sorted(labels_of(read_entries([tmp_path])).values()) == ["one/ppo/best", "two/ppo/best"]


# --- Claims -----------------------------------------------------------------------------------------------------------


def claims_in(page: str) -> list[tuple[str, str]]:
    """Name and claims of each row of the tables of figures."""
    found, inside = [], False
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if cells[:4] == ["Co-Wizard", "sessions", "errored", "claimed"]:
            inside = True
        elif inside and line.startswith("| "):
            found.append((cells[0], cells[3]))
        elif not line.startswith("|-"):
            inside = False
    return found


def test_claims_are_marked_in_page_output_and_json(tmp_path: Path) -> None:
    folder = write(tmp_path / "one", "ppo", 3)
    (folder / "cost.json").write_text('{"wall_seconds": 100.0, "cpu_seconds": 180.0, "workers": 2}')
    call = ["leaderboard", str(folder), "--out", str(tmp_path / "board.md")]
    done = CliRunner().invoke(app, call, env={"COLUMNS": "200"})
    assert done.exit_code == 0, done.output
    assert "ppo: success 75.0 % (claimed: figures, name, training cost, run time)" in done.stdout
    assert claims_in((tmp_path / "board.md").read_text()) == [("ppo", "figures, name")]
    (row,) = json.loads(CliRunner().invoke(app, [*call, "--json"]).stdout)["rows"]
    assert row["claims"] == ["figures", "name", "training cost", "run time"]


def test_checked_rollout_claims_only_what_nobody_can_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "PROTOCOL", PROTOCOL)
    monkeypatch.setenv("COLUMNS", "200")
    roll_out(settings(), tmp_path / "lane-follow")
    write(tmp_path / "imported", "scripted", 4, towns=("Town01.xodr",))
    call = ["leaderboard", str(tmp_path), "--out", str(tmp_path / "board.md"), "--check", "--workers", "1"]
    done = CliRunner().invoke(app, call)
    assert done.exit_code == 0, done.output
    short = "lane-follow (sessions of at most 15 s)"
    assert claims_in((tmp_path / "board.md").read_text()) == [(short, "-"), ("scripted", "figures, name")]
    assert f"{short}: success 0.0 % (claimed: run time)" in done.stdout
    edit(tmp_path / "lane-follow" / "rollout.json", lambda page: page["rows"][1]["record"].update(success=True))
    done = CliRunner().invoke(app, call)
    assert done.exit_code == 1 and done.stderr.count("\n") == 1
    assert "lane-follow: session 1 (brookside" in done.stderr and "see `dorothie-gym submit" in done.stderr


def test_names_of_others_stay_text_on_the_page(tmp_path: Path) -> None:
    name = "[best] <img src=x> `a` | b\n# Best"
    write(tmp_path / "one", name, 4)
    page = leaderboard_page(read_entries([tmp_path]))
    assert "\n# Best" not in page
    (row,) = [line for line in page.splitlines() if line.startswith("| ") and "| 4 | 0 | figures, name |" in line]
    assert "\\[best\\]" in row and "<img" not in row and "\\`a\\`" in row and "\\| b" in row


def test_page_of_the_documentation_has_the_columns_and_words_of_the_command(tmp_path: Path) -> None:
    write(tmp_path / "one", "ppo", 3)
    made = leaderboard_page(read_entries([tmp_path]), None, "closed-loop.md")
    kept = (Path(__file__).parents[3] / "docs" / "leaderboard.md").read_text(encoding="utf-8")
    heads = [line for line in made.splitlines() if line.startswith(("| Co-Wizard | sessions", "| Co-Wizard | towns"))]
    assert len(heads) == 2 and all(head in kept for head in heads)
    assert made.split("\n\n")[2] in kept and "`claimed` names" in made.split("\n\n")[2]
    assert {claims for _, claims in claims_in(kept)} >= {"figures, name", "figures, name, weights"}


def in_tier(folder: Path, tier: Tier, name: str = "scripted", *, oracle: bool = False, **changes: Any) -> Path:
    """The result of four sessions of a Co-Wizard in a tier."""
    participants = tuple(Player(name=each) for each in tier.participants)
    cast = {Role.PARTICIPANT: participants[0], Role.AD_WIZARD: Player(name=tier.ad_wizard)}
    given: dict[str, Any] = {
        "towns": tier.towns,
        "config": tier.oracle if oracle else tier.config,
        "pool": participants if len(participants) > 1 else (),
        "tier": tier.name,
        "oracle": oracle,
        "references": True,
    }
    made = RolloutSettings(
        cast={**ALL_SCRIPTED, **cast, Role.CO_WIZARD: Player(name=name)}, sessions=4, **{**given, **changes}
    )
    drive = ReferenceDrive(seconds=300.0, exchanges=9, subgoals=3)
    rows = tuple(
        RolloutRow(number=k, town=made.towns[0], seed=k, record=record(success=k < 2, reference=drive))
        for k in range(4)
    )
    folder.mkdir(parents=True)
    (folder / "rollout.json").write_text(json.dumps(RolloutResult(settings=made.to_json(), rows=rows).to_json()))
    return folder


@pytest.mark.parametrize("tier", TIERS.values(), ids=list(TIERS))
def test_each_tier_is_a_part_of_its_own_with_its_headline(tmp_path: Path, tier: Tier) -> None:
    write(tmp_path / "usual", "scripted", 4)
    in_tier(tmp_path / "tier", tier)
    in_tier(tmp_path / "oracle", tier, oracle=True)
    in_tier(tmp_path / "trials", tier, trials=2)
    in_tier(tmp_path / "town", tier, towns=("my town.yaml",))
    in_tier(tmp_path / "exact", tier, config=dataclasses.replace(tier.oracle, max_seconds=50.0, time_factor=None))
    entries = read_entries([tmp_path])
    assert (entries[0].part, entries[0].policy) == ("unseen", "scripted")
    assert {entry.part for entry in entries[1:]} == {tier.name}
    names = {entry.policy for entry in entries[1:]}
    assert {"scripted", "scripted (oracle)", "scripted (2 trials)", "scripted (towns my town.yaml)"} < names
    exact = next(entry.policy for entry in entries if "sessions of at most 50 s" in entry.policy)
    assert ("word errors 0 %" in exact) is (tier.config.talk is None)
    page = leaderboard_page(entries)
    usual, hard = page.split(f"## Tier {tier.name}")[:2]
    assert "timely completion" not in usual.split("## Unseen towns")[1]
    assert "timely completion" in hard.splitlines()[2]


def test_a_rollout_with_trials_outside_of_a_tier_is_no_submission(tmp_path: Path) -> None:
    (fault,) = submission.check_submission(write(tmp_path / "trials", "scripted", 4, trials=2)).faults
    assert "without --trials" in fault
