"""Models that the package ships: `pretrained:NAME` plays wherever a policy is named."""

from __future__ import annotations

import dataclasses
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from dorothie_gym.cli import app
from dorothie_gym.errors import PolicyLoadError
from dorothie_gym.evaluation.analysis.intervals import wilson_interval
from dorothie_gym.evaluation.closed_loop import RolloutResult, RolloutSettings, roll_out
from dorothie_gym.maps.folds import SEEN_TOWNS
from dorothie_gym.ontology import Role
from dorothie_gym.policies import (
    ALL_SCRIPTED,
    find_player,
    make_policy,
    pretrained,
    pretrained_card,
    pretrained_folder,
    pretrained_names,
)
from dorothie_gym.policies.policy_loader import TALK_POLICIES
from dorothie_gym.policies.pretrained import names_for
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import SpaceLimits
from dorothie_gym.support.installation import pip_install

LIMIT = 10_000_000
"""Largest size of all shipped models [bytes]."""

CO_WIZARDS = (
    "pretrained:co-wizard",
    "pretrained:maskable-ppo",
    "pretrained:ppo",
    "pretrained:reader",
    "pretrained:toto",
)
NAMES = tuple(sorted((*CO_WIZARDS, "pretrained:participant")))


def call(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))


def play(name: str, folder: Path, sessions: int, seconds: float) -> RolloutResult:
    role = Role.PARTICIPANT if "participant" in name else Role.CO_WIZARD
    settings = RolloutSettings(
        cast={**ALL_SCRIPTED, role: find_player(name, role)},
        towns=("brookside",),
        sessions=sessions,
        seed=7,
        config=EnvConfig(max_seconds=seconds),
    )
    return roll_out(settings, folder)


def test_six_models_are_shipped_in_less_than_ten_megabytes() -> None:
    assert pretrained_names() == NAMES
    files = [path for path in pretrained.SHIPPED.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < LIMIT
    assert {path.suffix for path in files} == {".json", ".safetensors"}


@pytest.mark.parametrize("name", NAMES)
def test_card_tells_how_the_model_was_made_and_how_well_it_does_in_validation(name: str) -> None:
    card = pretrained_card(name)
    assert all(command.startswith("dorothie-gym ") for command in card.commands)
    assert card.licence == "MIT" and card.steps > 0 and card.seconds > 0.0
    assert f"--{card.role.replace('_', '-')} {name} " in card.rollout
    assert f"--towns {','.join(SEEN_TOWNS)} " in card.rollout
    assert "--seed 1" in card.rollout, "the seed of the tests is 0"
    success = card.figures["success"]
    wilson = wilson_interval(round(success.mean * card.sessions), card.sessions)
    assert (success.low, success.high) == pytest.approx(wilson, abs=1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_model_plays_its_role_by_name(name: str, tmp_path: Path) -> None:
    pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
    result = play(name, tmp_path / "named", 2, 20.0)
    assert [row.error for row in result.rows] == [None, None]
    player = find_player(name, Role(pretrained_card(name).role))
    assert player.training == {"steps": pretrained_card(name).steps, "seconds": pretrained_card(name).seconds}
    by_path = play(str(pretrained_folder(name)), tmp_path / "path", 2, 20.0)
    assert [row.record for row in by_path.rows] == [row.record for row in result.rows]
    assert by_path.settings["sha256"] == result.settings["sha256"], "the hash covers the weights"


@pytest.mark.long
def test_masked_driver_completes_errands_that_driving_on_does_not(tmp_path: Path) -> None:
    pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
    learned, idle = (play(name, tmp_path / name, 4, 480.0) for name in ("pretrained:maskable-ppo", "lane-follow"))
    assert (learned.figures()["goal_condition_success"].mean or 0.0) >= 0.5
    assert (idle.figures()["goal_condition_success"].mean or 0.0) < 0.25
    assert idle.figures()["success"].mean == 0.0


def test_shipped_models_are_named_for_their_own_role() -> None:
    assert names_for(Role.CO_WIZARD) == CO_WIZARDS
    assert names_for(Role.PARTICIPANT) == ("pretrained:participant",)
    with pytest.raises(PolicyLoadError, match=r"participant: there is no policy 'pretrained:maskable-ppo'"):
        find_player("pretrained:maskable-ppo", Role.PARTICIPANT)


def test_unknown_name_is_one_line_with_the_list() -> None:
    done = call("rollout", "--co-wizard", "pretrained:maskable_ppo", "--sessions", "1")
    assert done.exit_code == 2 and done.stderr.count("\n") == 1
    assert "did you mean 'pretrained:maskable-ppo'?" in done.stderr and ", ".join(CO_WIZARDS) in done.stderr
    with pytest.raises(PolicyLoadError, match="shipped models are pretrained:co-wizard"):
        pretrained_folder("dqn")


@pytest.mark.long
@pytest.mark.parametrize("module", ["torch", "sb3_contrib"])
def test_missing_library_is_one_line_that_names_the_extra(module: str) -> None:
    code = (
        f"import sys; sys.modules[{module!r}] = None\n"
        "from dorothie_gym.cli import main\n"
        "sys.argv = ['dorothie-gym', 'run', '--co-wizard', 'pretrained:maskable-ppo', '--max-seconds', '5', '--json']\n"
        "main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2 and done.stdout == ""
    wanted = f"pretrained:maskable-ppo needs {module}, which is not installed; run: {pip_install('baselines')}"
    assert done.stderr == f"Error: co_wizard: {wanted}\n"


def test_python_face_makes_the_policy_by_name() -> None:
    pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
    from dorothie_gym.policies.navigation import NavigationPolicy

    assert isinstance(make_policy("pretrained:maskable-ppo", Role.CO_WIZARD), NavigationPolicy)


@pytest.mark.parametrize(
    ("change", "wanted"),
    [
        ({"objects": 12}, "of [0-9]+ numbers, not [0-9]+: it is older than this version"),
        ({"objects": None}, "with other fields|not [0-9]+"),
    ],
)
def test_driver_trained_on_other_observations_is_refused_in_one_line(
    change: dict[str, int | None], wanted: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(pretrained.SHIPPED / "maskable-ppo", tmp_path / "maskable-ppo")
    card = tmp_path / "maskable-ppo" / "card.json"
    page = json.loads(card.read_text(encoding="utf-8"))
    page["observation"] = {name: change.get(name, width) for name, width in page["observation"].items()}
    page["observation"] = {name: width for name, width in page["observation"].items() if width is not None}
    card.write_text(json.dumps(page), encoding="utf-8")
    monkeypatch.setattr(pretrained, "SHIPPED", tmp_path)
    done = call("run", "--co-wizard", "pretrained:maskable-ppo", "--max-seconds", "5", "--json")
    assert done.exit_code == 2 and done.stderr.count("\n") == 1
    with pytest.raises(PolicyLoadError, match=wanted):
        make_policy("pretrained:maskable-ppo", Role.CO_WIZARD, SpaceLimits())


def test_fields_in_another_order_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(pretrained.SHIPPED / "maskable-ppo", tmp_path / "maskable-ppo")
    card = tmp_path / "maskable-ppo" / "card.json"
    page = json.loads(card.read_text(encoding="utf-8"))
    page["observation"] = dict(reversed(page["observation"].items()))
    card.write_text(json.dumps(page), encoding="utf-8")
    monkeypatch.setattr(pretrained, "SHIPPED", tmp_path)
    with pytest.raises(PolicyLoadError, match="with other fields: it is older than this version"):
        make_policy("pretrained:maskable-ppo", Role.CO_WIZARD)


@pytest.mark.parametrize("damage", ["{", '{"description": 3}', "[]"])
def test_damaged_card_is_an_error_of_one_line(damage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "maskable-ppo").mkdir()
    (tmp_path / "maskable-ppo" / "card.json").write_text(damage, encoding="utf-8")
    monkeypatch.setattr(pretrained, "SHIPPED", tmp_path)
    done = call("policies")
    assert done.exit_code == 2 and done.stderr.count("\n") == 1 and "card.json" in done.stderr


def test_policies_are_listed_with_size_training_and_validation() -> None:
    rows = {row["name"]: row for row in json.loads(call("policies", "--json").stdout)}
    of_talk_tasks = {name for names in TALK_POLICIES.values() for name in names}
    assert set(rows) == {"scripted", "silent", "random", "lane-follow", *of_talk_tasks, *NAMES}
    assert rows["scripted"]["roles"] == ["participant", "co_wizard", "ad_wizard"]
    shown = call("policies").stdout
    for name in NAMES:
        card, row = pretrained_card(name), rows[name]
        assert row["roles"] == [card.role] and row["bytes"] > 10_000
        assert row["validation"]["success"] == dataclasses.asdict(card.figures["success"])
        assert name in shown and f"{100 * card.figures['success'].mean:.0f} %" in shown
        assert all(command in shown for command in card.commands)


def test_shipped_models_need_no_optimiser_and_no_download() -> None:
    pytest.importorskip("safetensors", reason="needs the extra 'baselines'")
    from safetensors import safe_open

    for name in NAMES:
        page = json.loads((pretrained_folder(name) / "model.json").read_text(encoding="utf-8"))
        assert page.get("encoder", "hashing") == "hashing"
        for file in pretrained_folder(name).glob("*.safetensors"):
            with safe_open(file, framework="np") as tensors:
                assert not [key for key in tensors.keys() if "optimi" in key]  # noqa: SIM118  # a handle, not a dict
